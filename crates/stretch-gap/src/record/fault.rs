//! Hypotheses about errors. Each is one error of the recording or of the rig file, expressed as an
//! effect with one parameter (its size).

use stretch_data::ends;
use stretch_effects::{EffectParameter, Role};

use crate::problem::{
    column::{Column, Distortion},
    record_facts::nouns,
    simulator::Simulator,
    spec::EffectSpec,
};

/// Factors that are searched, as deviations from 1.
const FACTORS: (f64, f64) = (-0.95, 9.0);
/// Powers of ten around which factors of an output are searched, in addition to 1. Such factors
/// occur if the simulator uses other units.
const DECADES: [i32; 8] = [-4, -3, -2, -1, 1, 2, 3, 4];
/// Range of factors around a power of ten, as multiples of it: from 1/sqrt(10) to sqrt(10).
const NEAREST: (f64, f64) = (0.316, 3.163);
/// Largest offset that is searched, in spans of the column.
const SPANS: f64 = 20.0;
/// Largest delay that is searched, s.
pub(crate) const DELAY_S: f64 = 2.0;

/// Kind of error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A column is scaled by a wrong factor.
    Scale,
    /// A column has an offset.
    Offset,
    /// A column is late.
    Delay,
    /// A column has the wrong sign.
    Sign,
    /// A nominal parameter, given by its index, differs from the rig file.
    Parameter(usize),
}

/// One error of unknown size.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fault {
    pub(crate) kind: Kind,
    /// Index of the column; `None` for a parameter.
    pub(crate) column: Option<usize>,
    /// Stages whose simulation the error changes.
    pub(crate) touches: Vec<usize>,
    name: String,
    unit: String,
    range: (f64, f64),
    /// Scale factor at size 0.
    base: f64,
}

impl Fault {
    /// Returns every error that the columns and parameters of a simulator may have.
    pub(crate) fn all(simulator: &dyn Simulator, columns: &[Column<'_>]) -> Vec<Self> {
        let mut all: Vec<Self> =
            columns.iter().enumerate().flat_map(|(i, column)| Self::of_column(i, column)).collect();
        let stages = simulator.stages();
        let [model, _] = nouns(simulator.record().gauge_alone);
        for (p, spec) in simulator.parameters().iter().enumerate() {
            // A factor on a nominal value of 0 would have no effect.
            if spec.sd > 0.0 && spec.nominal != 0.0 {
                let acts = |s: &usize| stages[*s].parameters.contains(&p);
                all.push(Self {
                    kind: Kind::Parameter(p),
                    column: None,
                    touches: (0..stages.len()).filter(acts).collect(),
                    name: format!("{} of the {model}", spec.name),
                    unit: "1".into(),
                    range: FACTORS,
                    base: 1.0,
                });
            }
        }
        all.retain(|fault| !fault.touches.is_empty());
        all
    }

    fn of_column(index: usize, column: &Column<'_>) -> Vec<Self> {
        let mut touches: Vec<usize> =
            column.output_of.iter().chain(&column.read_by).copied().collect();
        touches.sort_unstable();
        touches.dedup();
        let reach = SPANS * span(&column.values);
        let kinds = [
            (Kind::Scale, "scale", "1", FACTORS),
            (Kind::Offset, "offset", &*column.unit, (-reach, reach)),
            (Kind::Delay, "delay", "s", (-DELAY_S, DELAY_S)),
            (Kind::Sign, "sign", &*column.unit, (-reach, reach)),
        ];
        let offered = if column.is_command { 1 } else { kinds.len() };
        let one = |(kind, what, unit, range): (Kind, &str, &str, (f64, f64))| Self {
            kind,
            column: Some(index),
            touches: touches.clone(),
            name: format!("{what} of {}", column.name),
            unit: unit.into(),
            range,
            base: 1.0,
        };
        let scale = one(kinds[0]);
        let decades = DECADES.iter().filter(|_| column.output_of.is_some()).map(|power| Self {
            name: format!("{} by 1e{power}", scale.name),
            base: 10.0_f64.powi(*power),
            ..scale.clone()
        });
        let near = kinds.into_iter().take(offered).map(one);
        near.chain(decades).filter(|f| f.range.0 < f.range.1).collect()
    }

    /// Returns the size that corresponds to a factor, for a scale around this fault's `base`;
    /// `None` if the fault with another base covers that factor.
    pub(crate) fn of_factor(&self, factor: f64) -> Option<f64> {
        let share = factor / self.base;
        let is_own = match self.base == 1.0 {
            true => (1.0 + FACTORS.0..=1.0 + FACTORS.1).contains(&factor) || factor <= 0.0,
            false => {
                let is_beyond = !(1.0 + FACTORS.0..=1.0 + FACTORS.1).contains(&factor);
                is_beyond && (NEAREST.0..NEAREST.1).contains(&share)
            }
        };
        is_own.then_some(share - 1.0)
    }

    /// Whether the factors of this fault differ from 1 by more than any sensor error.
    pub(crate) fn is_beyond(&self) -> bool {
        self.base != 1.0
    }

    /// Returns the factor that corresponds to a size.
    pub(crate) fn factor(&self, size: f64) -> f64 {
        self.base * (1.0 + size)
    }

    /// Returns the error as an effect that can be fitted.
    pub(crate) fn spec(&self) -> EffectSpec {
        let (least, greatest) = self.range;
        let mut strength = EffectParameter::sized("size", &self.unit, least..=greatest);
        if self.kind == Kind::Sign {
            // A wrong sign has no size at which it is absent.
            strength = strength.with_role(Role::Shape);
        }
        let first = self.touches.first().copied().unwrap_or(0);
        EffectSpec {
            touches: self.touches.clone(),
            ..EffectSpec::new(&self.name, (first, "record"), vec![strength])
        }
    }

    pub(crate) fn clamped(&self, size: f64) -> f64 {
        size.clamp(self.range.0, self.range.1)
    }

    /// Returns the distortion of the column by an error of the given size.
    pub(crate) fn distortion(&self, size: f64) -> Distortion {
        let none = Distortion::default();
        match self.kind {
            Kind::Scale => Distortion { scale: self.factor(size), ..none },
            Kind::Offset => Distortion { offset: size, ..none },
            Kind::Delay => Distortion { delay_s: size, ..none },
            Kind::Sign => Distortion { scale: -1.0, offset: size, ..none },
            Kind::Parameter(_) => none,
        }
    }
}

/// Returns the largest minus the smallest value.
pub(crate) fn span(values: &[f64]) -> f64 {
    let (low, high) = ends(values);
    (high - low).max(0.0)
}

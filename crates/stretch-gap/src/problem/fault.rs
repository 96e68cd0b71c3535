//! Errors of the recording or of the rig file, each expressed as an effect with one parameter (its
//! size).

use std::ops::RangeInclusive;

use stretch_data::ends;
use stretch_effects::{EffectParameter, Role};

use crate::problem::{
    column::{Column, Distortion},
    record_facts::nouns,
    simulator::Simulator,
    spec::EffectSpec,
};

/// Factors that are searched, except for outputs.
const FACTORS: RangeInclusive<f64> = 0.05..=10.0;
/// Largest factor of an output, and inverse of the smallest. Factors beyond [`FACTORS`] occur if the
/// simulator uses other units. The range is so wide that the prior of its logarithm is flat.
const LARGEST: f64 = 1e30;
/// Largest offset that is searched, in spans of the column.
const SPANS: f64 = 20.0;
/// Largest delay that is searched, s.
pub(crate) const DELAY_S: f64 = 2.0;

/// Kind of error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A column is scaled by a wrong factor, its size.
    Scale,
    /// A column has an offset.
    Offset,
    /// A column is late.
    Delay,
    /// A column has the wrong sign. The size is the sum of the recorded and the true value.
    Sign,
    /// A nominal parameter, given by its index, differs from the rig file by a factor, its size.
    Parameter(usize),
}

/// One error of unknown size.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fault {
    pub(crate) kind: Kind,
    /// Index of the column; `None` for a parameter.
    pub(crate) column: Option<usize>,
    /// The error as an effect that can be fitted.
    pub(crate) spec: EffectSpec,
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
                let touches = (0..stages.len()).filter(acts).collect();
                let name = format!("{} of the {model}", spec.name);
                let size = EffectParameter::shaped("size", "1", FACTORS);
                all.push(Self::new(Kind::Parameter(p), None, touches, (&name, size)));
            }
        }
        all.retain(|fault| !fault.spec.touches.is_empty());
        all
    }

    fn of_column(index: usize, column: &Column<'_>) -> Vec<Self> {
        let mut touches: Vec<usize> =
            column.output_of.iter().chain(&column.read_by).copied().collect();
        touches.sort_unstable();
        touches.dedup();
        let (low, high) = ends(&*column.values);
        let reach = SPANS * (high - low).max(0.0);
        let factors = if column.output_of.is_some() { 1.0 / LARGEST..=LARGEST } else { FACTORS };
        let sized = |unit: &str, reach: f64| EffectParameter::sized("size", unit, -reach..=reach);
        let kinds = [
            (Kind::Scale, "scale", EffectParameter::shaped("size", "1", factors)),
            (Kind::Offset, "offset", sized(&column.unit, reach)),
            (Kind::Delay, "delay", sized("s", DELAY_S)),
            // A wrong sign has no size at which it is absent.
            (Kind::Sign, "sign", sized(&column.unit, reach).with_role(Role::Shape)),
        ];
        let offered = if column.is_command { 1 } else { kinds.len() };
        let possible = kinds.into_iter().take(offered).filter(|(_, _, size)| size.min < size.max);
        let one = |(kind, what, size)| {
            let name = format!("{what} of {}", column.name);
            Self::new(kind, Some(index), touches.clone(), (&name, size))
        };
        possible.map(one).collect()
    }

    fn new(
        kind: Kind,
        column: Option<usize>,
        touches: Vec<usize>,
        (name, size): (&str, EffectParameter),
    ) -> Self {
        let first = touches.first().copied().unwrap_or(0);
        let spec = EffectSpec { touches, ..EffectSpec::new(name, (first, "record"), vec![size]) };
        Self { kind, column, spec }
    }

    /// Whether a factor of this size differs from 1 by more than any sensor error.
    pub(crate) fn is_beyond(&self, size: f64) -> bool {
        self.kind == Kind::Scale && !FACTORS.contains(&size)
    }

    pub(crate) fn clamped(&self, size: f64) -> f64 {
        let range = &self.spec.parameters[0];
        size.clamp(range.min, range.max)
    }

    /// Returns the distortion of the column by an error of the given size.
    pub(crate) fn distortion(&self, size: f64) -> Distortion {
        let none = Distortion::default();
        match self.kind {
            Kind::Scale => Distortion { scale: size, ..none },
            Kind::Offset => Distortion { offset: size, ..none },
            Kind::Delay => Distortion { delay_s: size, ..none },
            Kind::Sign => Distortion { scale: -1.0, offset: size, ..none },
            Kind::Parameter(_) => none,
        }
    }
}

//! What is fitted in every run, as numbers around 0 in units of what is known before.

use stretch_effects::EffectParameter;
use stretch_gap::{Diagnosis, Evidence, Model, Simulator};

/// Where a value stands in a model.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    Parameter(usize),
    /// Effect of the model, and parameter of the effect.
    Effect(usize, usize),
}

/// A value that is fitted.
#[derive(Debug, Clone, PartialEq)]
struct Unknown {
    name: String,
    unit: String,
    place: Place,
    /// Value at 0, and by how much a step of 1 changes it; in its logarithm where `is_log`.
    centre: f64,
    scale: f64,
    is_log: bool,
    /// Range of the value.
    range: [f64; 2],
}

impl Unknown {
    fn value(&self, x: f64) -> f64 {
        let value = match self.is_log {
            true => self.centre * (self.scale * x).exp(),
            false => self.centre + self.scale * x,
        };
        value.clamp(self.range[0], self.range[1])
    }

    fn x(&self, value: f64) -> f64 {
        match self.is_log {
            true => (value / self.centre).ln() / self.scale,
            false => (value - self.centre) / self.scale,
        }
    }

    /// Change of the value for a change of 1 around it.
    fn slope(&self, value: f64) -> f64 {
        if self.is_log { self.scale * value } else { self.scale }
    }
}

/// All values that are fitted.
pub(super) struct Unknowns {
    all: Vec<Unknown>,
    /// The model around which they are fitted: what is not fitted stays as it is.
    model: Model,
}

/// Tolerances to either side within which a nominal parameter is fitted.
const REACH: f64 = 3.0;
impl Unknowns {
    /// Nominal parameters with a tolerance, and the parameters of the named effects.
    pub(super) fn of(
        simulator: &dyn Simulator,
        diagnosis: &Diagnosis,
        evidence: &Evidence,
    ) -> Self {
        let found = evidence.candidates.first().filter(|_| !diagnosis.named.is_empty());
        let mut model = found.unwrap_or(&evidence.retuned).clone();
        let is_named = |e: usize| diagnosis.named.contains(&simulator.effects()[e].name);
        model.effects.retain(|(e, _)| is_named(*e));
        let mut all = Vec::new();
        for (index, p) in simulator.parameters().iter().enumerate().filter(|(_, p)| p.sd > 0.0) {
            let reach = REACH * p.sd;
            all.push(Unknown {
                name: p.name.clone(),
                unit: p.unit.clone(),
                place: Place::Parameter(index),
                centre: p.nominal,
                scale: p.sd,
                is_log: false,
                range: [p.least.max(p.nominal - reach), p.greatest.min(p.nominal + reach)],
            });
        }
        for (slot, (effect, values)) in model.effects.iter().enumerate() {
            let spec = &simulator.effects()[*effect];
            let own = spec.parameters.iter().zip(values).enumerate();
            let moved = own.filter(|(_, (p, _))| p.is_fitted() && !p.is_form());
            all.extend(moved.map(|(k, (p, value))| {
                let name = format!("{}.{}", spec.name, p.name);
                Self::of_effect(name, p, *value, Place::Effect(slot, k))
            }));
        }
        Self { all, model }
    }

    fn of_effect(name: String, p: &EffectParameter, value: f64, place: Place) -> Unknown {
        let is_log = p.is_log() && value > 0.0 && p.min > 0.0;
        let width = if is_log { (p.max / p.min).ln() } else { p.max - p.min };
        Unknown {
            name,
            unit: p.unit.to_string(),
            place,
            centre: value,
            // What was known before is no more than the range.
            scale: 0.5 * width,
            is_log,
            range: [p.min, p.max],
        }
    }

    pub(super) fn len(&self) -> usize {
        self.all.len()
    }

    pub(super) fn name(&self, i: usize) -> &str {
        &self.all[i].name
    }

    pub(super) fn unit(&self, i: usize) -> &str {
        &self.all[i].unit
    }

    /// Where a fit begins: as the diagnosis left the values.
    pub(super) fn start(&self) -> Vec<f64> {
        let now = |u: &Unknown| match u.place {
            Place::Parameter(p) => self.model.parameters[p],
            Place::Effect(slot, k) => self.model.effects[slot].1[k],
        };
        self.all.iter().map(|u| u.x(now(u))).collect()
    }

    /// The model at some numbers.
    pub(super) fn model(&self, x: &[f64]) -> Model {
        let mut model = self.model.clone();
        for (u, x) in self.all.iter().zip(x) {
            match u.place {
                Place::Parameter(p) => model.parameters[p] = u.value(*x),
                Place::Effect(slot, k) => model.effects[slot].1[k] = u.value(*x),
            }
        }
        model
    }

    /// Numbers within their ranges.
    pub(super) fn held(&self, x: &mut [f64]) {
        for (u, x) in self.all.iter().zip(x) {
            *x = u.x(u.value(*x));
        }
    }

    /// A step for the derivative: a fiftieth of what is known before, or a twentieth of an effect's value where that is less.
    pub(super) fn step(&self, i: usize, x: &[f64]) -> f64 {
        let u = &self.all[i];
        let own = match u.place {
            Place::Effect(..) if !u.is_log => (0.05 * u.value(x[i]) / u.scale).abs().max(1e-5),
            _ => f64::INFINITY,
        };
        let step = own.min(0.02);
        // Inwards at the end of a range.
        if u.value(x[i] + step) > u.value(x[i]) { step } else { -step }
    }

    /// A value and its standard deviation.
    pub(super) fn at(&self, i: usize, x: f64, sd: f64) -> (f64, f64) {
        let value = self.all[i].value(x);
        (value, sd * self.all[i].slope(value).abs())
    }

    /// Whether a value is a nominal parameter's.
    pub(super) fn is_parameter(&self, i: usize) -> bool {
        matches!(self.all[i].place, Place::Parameter(_))
    }
}

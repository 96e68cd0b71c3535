//! Defines the coordinates of a fit: the free parameters, scaled such that a change by 1 is large,
//! with their priors and bounds.
//!
//! | parameter | coordinate x | prior | bounds |
//! | --- | --- | --- | --- |
//! | nominal | (value - nominal)/tolerance | Gaussian, mean 0, standard deviation 1 | three tolerances |
//! | strength | value/range | flat | its range |
//! | shape, on a logarithmic scale | ln value | Gaussian, mean in the middle of its range, standard deviation half of it | its range |
//! | form | value/range or ln value | Gaussian around its usual value, standard deviation 0.35 of its range | its range |
//!
//! A prior p adds -ln p(x), without its constant, to the cost of a fit. The prior of a strength is
//! flat, so that strength 0 (no effect) is not preferred; the penalty for having the effect is part
//! of the score.

use stretch_effects::EffectParameter;

use crate::problem::{
    simulator::{Model, Simulator},
    spec::REACH,
};

/// Standard deviation of a form around its usual value, as a share of its range.
const FORM_SD: f64 = 0.35;

/// One coordinate of a fit.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Coordinate {
    /// A nominal parameter.
    Nominal { index: usize, nominal: f64, sd: f64 },
    /// An effect's parameter on a linear scale; a form has a usual value.
    Linear { slot: usize, index: usize, range: f64, usual: Option<f64> },
    /// An effect's parameter on a logarithmic scale.
    Log { slot: usize, index: usize, middle: f64, half: f64, is_form: bool },
}

/// -ln of a prior without its constant (the cost), with its slope and its curvature.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Prior {
    pub(crate) cost: f64,
    pub(crate) slope: f64,
    pub(crate) curvature: f64,
}

impl Coordinate {
    pub(crate) fn read(self, model: &Model) -> f64 {
        match self {
            Self::Nominal { index, nominal, sd } => (model.parameters[index] - nominal) / sd,
            Self::Linear { slot, index, range, .. } => model.effects[slot].1[index] / range,
            Self::Log { slot, index, .. } => model.effects[slot].1[index].max(1e-300).ln(),
        }
    }

    pub(crate) fn write(self, model: &mut Model, x: f64) {
        let place = match self {
            Self::Nominal { index, .. } => &mut model.parameters[index],
            Self::Linear { slot, index, .. } | Self::Log { slot, index, .. } => {
                &mut model.effects[slot].1[index]
            }
        };
        *place = self.value(x);
    }

    /// Returns the parameter's value at the coordinate x.
    pub(crate) fn value(self, x: f64) -> f64 {
        match self {
            Self::Nominal { nominal, sd, .. } => nominal + sd * x,
            Self::Linear { range, .. } => x * range,
            Self::Log { .. } => x.exp(),
        }
    }

    /// Returns the change of the parameter's value if x changes by 1, at a given value.
    pub(crate) fn slope(self, value: f64) -> f64 {
        match self {
            Self::Nominal { sd, .. } => sd,
            Self::Linear { range, .. } => range,
            Self::Log { .. } => value,
        }
    }

    pub(crate) fn prior(self, x: f64) -> Prior {
        let (cost, slope, curvature) = match self {
            Self::Nominal { .. } => (0.5 * x * x, x, 1.0),
            Self::Linear { usual: Some(usual), .. } => {
                let z = (x - usual) / FORM_SD;
                (0.5 * z * z, z / FORM_SD, 1.0 / (FORM_SD * FORM_SD))
            }
            Self::Linear { .. } => (0.0, 0.0, 0.0),
            Self::Log { middle, half, .. } => {
                let z = (x - middle) / half;
                (0.5 * z * z, z / half, 1.0 / (half * half))
            }
        };
        Prior { cost, slope, curvature }
    }

    /// Returns the step of a one-sided difference: small enough that curvature does not matter,
    /// large compared with the rounding of a simulation.
    pub(crate) fn probe(self, x: f64) -> f64 {
        match self {
            Self::Nominal { .. } | Self::Log { .. } => 0.03,
            Self::Linear { .. } => (2e-4_f64).max(0.02 * x.abs()),
        }
    }

    /// Returns the longest step of one iteration; beyond it, the linearisation is poor. A parameter
    /// on a logarithmic scale changes by at most a factor of three.
    pub(crate) fn stride(self) -> f64 {
        match self {
            Self::Nominal { .. } => 6.0,
            Self::Linear { .. } => 0.4,
            Self::Log { .. } => 1.1,
        }
    }

    /// Whether the output of a stage may depend on the coordinate.
    pub(crate) fn acts_in(self, simulator: &dyn Simulator, stage: usize, model: &Model) -> bool {
        match self {
            Self::Nominal { index, .. } => simulator.stages()[stage].parameters.contains(&index),
            Self::Linear { slot, .. } | Self::Log { slot, .. } => {
                simulator.effects()[model.effects[slot].0].touches.contains(&stage)
            }
        }
    }

    pub(crate) fn is_form(self) -> bool {
        match self {
            Self::Nominal { .. } => false,
            Self::Linear { usual, .. } => usual.is_some(),
            Self::Log { is_form, .. } => is_form,
        }
    }
}

/// Returns the coordinates of the nominal parameters of some stages and of the model's effects,
/// each with its bounds.
pub(crate) fn coordinates(
    simulator: &dyn Simulator,
    stages: &[usize],
    model: &Model,
) -> Vec<(Coordinate, [f64; 2])> {
    let specs = simulator.parameters();
    let mut own: Vec<usize> = Vec::new();
    for &index in stages.iter().flat_map(|&stage| &simulator.stages()[stage].parameters) {
        // A parameter that acts in two stages is one coordinate.
        if specs[index].sd > 0.0 && !own.contains(&index) {
            own.push(index);
        }
    }
    let tuned = own.into_iter().map(|index| {
        let p = &specs[index];
        let bounds = [
            ((p.least - p.nominal) / p.sd).max(-REACH),
            ((p.greatest - p.nominal) / p.sd).min(REACH),
        ];
        (Coordinate::Nominal { index, nominal: p.nominal, sd: p.sd }, bounds)
    });
    tuned.chain(of_effects(simulator, model)).collect()
}

fn of_effects(
    simulator: &dyn Simulator,
    model: &Model,
) -> impl Iterator<Item = (Coordinate, [f64; 2])> {
    model.effects.iter().enumerate().flat_map(|(slot, (effect, values))| {
        let specs = &simulator.effects()[*effect].parameters;
        let free = specs.iter().enumerate().filter(|&(index, p)| {
            // A second threshold that is off stays off, because switching it on would make another
            // form of the effect.
            let is_other = index > 0 || values.len() > 1;
            let is_off = p.off() == Some(values[index]) && values[index] != 0.0;
            p.is_fitted() && !(is_other && is_off)
        });
        free.map(move |(index, p)| of_parameter(slot, index, p))
    })
}

fn of_parameter(slot: usize, index: usize, p: &EffectParameter) -> (Coordinate, [f64; 2]) {
    if p.is_log() {
        let (a, b) = (p.min.ln(), p.max.ln());
        // A form is searched near its usual value, anything else in the whole range.
        let (middle, half) = match p.usual_form() {
            Some(usual) => (usual.ln(), FORM_SD * (b - a)),
            None => (0.5 * (a + b), 0.5 * (b - a)),
        };
        let is_form = p.usual_form().is_some();
        (Coordinate::Log { slot, index, middle, half, is_form }, [a, b])
    } else {
        let range = p.max - p.min;
        let usual = p.usual_form().map(|usual| usual / range);
        (Coordinate::Linear { slot, index, range, usual }, [p.min / range, p.max / range])
    }
}

/// Returns -ln of the prior of the forms of a model's effects: the cost of forms that differ from
/// the usual ones.
pub(crate) fn form_cost(simulator: &dyn Simulator, model: &Model) -> f64 {
    let all = of_effects(simulator, model).map(|(coordinate, _)| coordinate);
    all.filter(|c| c.is_form()).map(|c| c.prior(c.read(model)).cost).sum()
}

/// Returns -ln of the prior of the ways in which effects act. For example, a saturation may be at
/// the lower or at the upper end. Each of n ways has the probability 1/n, so choosing one costs ln
/// n.
pub(crate) fn choice_cost(simulator: &dyn Simulator, model: &Model) -> f64 {
    let one = |(effect, values): &(usize, Vec<f64>)| {
        let specs = &simulator.effects()[*effect].parameters;
        let ways = specs.iter().zip(values).filter_map(|(p, v)| p.off().map(|off| off == *v));
        let off = ways.clone().filter(|is_off| *is_off).count();
        if off > 0 { (ways.count() as f64).ln() } else { 0.0 }
    };
    model.effects.iter().map(one).sum()
}

/// Returns the number of free parameters that the score penalises: parameters of effects, except
/// forms and parameters that are off.
pub(crate) fn free_parameters(simulator: &dyn Simulator, model: &Model) -> usize {
    let one = |(effect, values): &(usize, Vec<f64>)| {
        let specs = simulator.effects()[*effect].parameters.iter().zip(values);
        let is_free = |p: &EffectParameter, v: f64| {
            let is_on = p.off().is_none_or(|off| off == 0.0 || off != v);
            p.is_fitted() && p.usual_form().is_none() && is_on
        };
        specs.filter(|(p, v)| is_free(p, **v)).count()
    };
    model.effects.iter().map(one).sum()
}

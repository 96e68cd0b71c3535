//! The parameters of a model, sorted by what they set.

use stretch_gap::Model;
use stretch_sim::{RigParams, RigStage};

use super::{nominal::TunedParameter, timing::Leads};

/// The parameters of a model.
pub(super) struct Tuned {
    pub(super) params: RigParams,
    /// Offset of the pressure at a trial's start, standard deviations.
    pub(super) offset: f64,
    /// How far ahead of their rows commands act, samples.
    pub(super) leads: Leads,
    /// Share of the settled state in the initial state of the muscle, 0 to 1.
    pub(super) initial_muscle: f64,
    /// Share of the settled state in the initial state of the gauge, 0 to 1.
    pub(super) initial_gauge: f64,
}

impl Tuned {
    pub(super) fn of(base: &RigParams, parameters: &[TunedParameter], model: &Model) -> Self {
        let mut out = Self {
            params: *base,
            offset: 0.0,
            leads: [0.0; 2],
            initial_muscle: 0.0,
            initial_gauge: 0.0,
        };
        for (parameter, value) in parameters.iter().zip(&model.parameters) {
            let share = value.clamp(0.0, 1.0);
            match parameter {
                TunedParameter::Rig(key) => out.params[*key] = *value,
                TunedParameter::StartPressure => out.offset = *value,
                TunedParameter::CommandLead(which) => out.leads[*which] = *value,
                TunedParameter::InitialState(RigStage::Sensing) => out.initial_gauge = share,
                TunedParameter::InitialState(_) => out.initial_muscle = share,
            }
        }
        out
    }
}

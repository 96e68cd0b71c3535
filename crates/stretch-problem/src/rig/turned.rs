//! What the parameters of a model turn.

use stretch_gap::Model;
use stretch_sim::{RigParams, Stage};

use super::{nominal::Knob, timing::Leads};

/// The parameters of a model.
pub(super) struct Turned {
    pub(super) params: RigParams,
    /// Of the pressure at a trial's start, standard deviations.
    pub(super) offset: f64,
    /// How far ahead of their rows commands act, samples.
    pub(super) leads: Leads,
    /// How little of the move before the session muscle and gauge remember.
    pub(super) unwound_muscle: f64,
    pub(super) unwound_gauge: f64,
}

impl Turned {
    pub(super) fn of(base: &RigParams, knobs: &[Knob], model: &Model) -> Self {
        let mut turned = Self {
            params: *base,
            offset: 0.0,
            leads: [0.0; 2],
            unwound_muscle: 0.0,
            unwound_gauge: 0.0,
        };
        for (knob, value) in knobs.iter().zip(&model.parameters) {
            let share = value.clamp(0.0, 1.0);
            match knob {
                Knob::Rig(key) => turned.params[*key] = *value,
                Knob::Start => turned.offset = *value,
                Knob::Lead(which) => turned.leads[*which] = *value,
                Knob::Unwound(Stage::Sensing) => turned.unwound_gauge = share,
                Knob::Unwound(_) => turned.unwound_muscle = share,
            }
        }
        turned
    }
}

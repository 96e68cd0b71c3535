//! Effects of a model: those that stages run, and those that act outside of them.

use stretch_gap::Model;
use stretch_sim::{Effect, EffectSet};

use crate::{
    error::BenchError,
    rig::{
        forms::commands::{skew, wobble},
        hum,
    },
};

/// The effects of a model.
pub(crate) struct Acting<'a> {
    /// Those that the stages run.
    pub(crate) inside: EffectSet,
    /// Dead band of the valves, which acts before a stage.
    pub(crate) deadband: Option<&'a [f64]>,
    skew: Option<&'a [f64]>,
    hum: Option<(f64, f64)>,
}

/// The recorder of the signal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Recorder {
    /// Noise of its samples, 1 sd.
    pub(crate) noise: f64,
    /// What a hum of amplitude one is in the unit of the signal.
    pub(crate) unit: f64,
    pub(crate) dt_s: f64,
}

impl<'a> Acting<'a> {
    /// Sorts the effects of a model on top of those that the simulator already has; `rows` are the entries of its
    /// catalogue. A hum's phase is the record's, so that of a rig file, too, acts outside.
    pub(crate) fn of(
        base: &EffectSet,
        rows: &[&'static dyn Effect],
        model: &'a Model,
    ) -> Result<Self, BenchError> {
        let mut acting = Self { inside: base.clone(), deadband: None, skew: None, hum: None };
        let hum = acting.inside.remove("mains_hum");
        acting.hum = hum.map(|hum| (hum.values()[0], hum.values()[1]));
        for (index, values) in &model.effects {
            let row = rows[*index];
            match row.name() {
                "mains_hum" => acting.hum = Some((values[0], values[1])),
                "valve_deadband" => {
                    acting.deadband = Some(values.as_slice()).filter(|v| v[0] > 0.0);
                }
                "channel_skew" => acting.skew = Some(values),
                _ => acting.inside.push(row, values)?,
            }
        }
        Ok(acting)
    }

    /// Samples of another time: what a recorder does to a trial that nobody has measured yet.
    pub(crate) fn late(&self, recorder: Recorder, simulated: &mut [f64]) {
        if let Some(values) = self.skew {
            skew(values, recorder.dt_s, simulated);
        }
    }

    /// What the recorder makes of a simulated trial: samples of another time, and hum whose phase is the measured record's.
    pub(crate) fn record(&self, recorder: Recorder, measured: &[f64], simulated: &mut [f64]) {
        let Recorder { noise, unit, dt_s } = recorder;
        self.late(recorder, simulated);
        if let Some(values) = self.skew {
            wobble(values[2] * values[0].abs(), noise, dt_s, measured, simulated);
        }
        if let Some((a, f)) = self.hum {
            hum::add(a * unit, f, noise, dt_s, measured, simulated);
        }
    }
}

//! The rig at an imposed length.

use stretch_effects::{Grid, Start};

use super::{ChainMemory, Openings, Pneumatics, Recorded, Reference, Sensing, check_length};
use crate::{SimError, effects::EffectSet, params::RigParams};

/// The prepared rig with its crossbeam clamped or held by gauge blocks. The chamber follows its
/// valves; the gauge and the reference follow the imposed length. The muscle's memory does not
/// change.
#[derive(Debug)]
pub struct Held {
    pneumatics: Pneumatics,
    sensing: Sensing,
    reference: Reference,
}

/// What is imposed from outside, one value per sample.
#[derive(Debug, Clone, Copy)]
pub struct Setting<'a> {
    /// Length, mm.
    pub length_mm: &'a [f64],
    /// Share by which a shunt lowers the trim of the bridge; empty without one.
    pub shunt: &'a [f64],
}

impl Held {
    /// Prepares the stages, as [`Chain::new`](super::Chain::new).
    ///
    /// # Errors
    /// As [`Chain::new`](super::Chain::new).
    pub fn new(
        params: &RigParams,
        effects: &EffectSet,
        dt_s: f64,
        max_step_s: f64,
    ) -> Result<Self, SimError> {
        let samples = Grid::samples(dt_s)?;
        Ok(Self {
            pneumatics: Pneumatics::new(params, effects, &effects.grid(params, dt_s, max_step_s)?)?,
            sensing: Sensing::new(params, effects, &samples)?,
            reference: Reference::new(params, effects, &samples)?,
        })
    }

    /// Simulates one trial in the memory of the [`Chain`](super::Chain) of the same effects.
    ///
    /// # Errors
    /// As [`Chain::run`](super::Chain::run).
    pub fn run(
        &self,
        memory: &mut ChainMemory,
        (start, start_s): (Start, f64),
        openings: Openings<'_>,
        setting: Setting<'_>,
        initial_kpa: f64,
        recorded: Recorded<'_>,
    ) -> Result<(), SimError> {
        let Recorded { pressure_kpa, length_mm, bridge_v } = recorded;
        check_length("set_length_mm", openings.check()?, setting.length_mm.len())?;
        // The cells of the chamber are the first of the actuation's.
        let (own, set) = (&mut memory.actuation, setting.length_mm);
        let kpa = &mut *pressure_kpa;
        self.pneumatics.run_with_length(own, start, openings, set, initial_kpa, kpa)?;
        let shown = (set, setting.shunt);
        let own = &mut memory.sensing;
        self.sensing.run_shunted(own, start, start_s, shown, pressure_kpa, bridge_v)?;
        self.reference.run(&mut memory.reference, start, set, length_mm)
    }
}

//! The whole rig: every stage runs on the outputs of the previous stage, or the length is imposed from outside.

use stretch_effects::{Grid, Start};

use super::{Actuation, Memory, Openings, Pneumatics, Reference, Sensing, check_length, pick};
use crate::{SimError, effects::EffectSet, params::RigParams};

/// Caller's buffers for the recorded channels, one value per sample.
#[derive(Debug)]
pub struct Recorded<'a> {
    /// Gauge pressure, kPa.
    pub pressure_kpa: &'a mut [f64],
    /// Length as the reference shows it, mm.
    pub length_mm: &'a mut [f64],
    /// Amplified bridge voltage, V.
    pub bridge_v: &'a mut [f64],
}

/// Memories of all stages of a [`Chain`], and its working space.
#[derive(Debug, Clone, Default)]
pub struct ChainMemory {
    pub(super) actuation: Memory,
    pub(super) sensing: Memory,
    pub(super) reference: Memory,
    pressure: Vec<f64>,
    length: Vec<f64>,
}

impl ChainMemory {
    /// Forgets everything: the next trial starts settled.
    pub fn clear(&mut self) {
        self.actuation.clear();
        self.sensing.clear();
        self.reference.clear();
    }

    /// Pressure (kPa) and true length (mm) at the last trial's nodes.
    pub fn nodes(&self) -> (&[f64], &[f64]) {
        (&self.pressure, &self.length)
    }
}

/// The whole rig, prepared: openings to pressure, measured length and bridge voltage, without noise or rounding.
///
/// ```
/// use stretch_sim::{Chain, DEFAULT_STEP_S, EffectSet, Openings, Recorded, RigParams, Start};
/// let rig = Chain::new(&RigParams::default(), &EffectSet::new(), 0.01, DEFAULT_STEP_S)?;
/// let (inlet, outlet) = ([1.0; 500], [0.0; 500]);
/// let [mut p, mut l, mut v] = [[0.0; 500]; 3];
/// let recorded = Recorded { pressure_kpa: &mut p, length_mm: &mut l, bridge_v: &mut v };
/// let openings = Openings { inlet: &inlet, outlet: &outlet };
/// rig.run(&mut rig.memory(), Start::Settled, 0.0, openings, 0.0, recorded)?;
/// assert_eq!([p[0], l[0], v[0]], [0.0, 180.0, 1.24]);
/// assert!((p[499] - 620.0).abs() < 1e-9);          // full of supply air
/// assert!((l[499] - 150.3277).abs() < 1e-3);       // 16.5 % shorter
/// assert!((v[499] - 2.30929).abs() < 1e-4);
/// # Ok::<(), stretch_sim::SimError>(())
/// ```
#[derive(Debug)]
pub struct Chain {
    actuation: Actuation,
    sensing: Sensing,
    reference: Reference,
}

impl Chain {
    /// Prepares all stages for trials sampled every `dt_s`, integrated in steps of at most `max_step_s`
    /// ([`DEFAULT_STEP_S`](crate::DEFAULT_STEP_S)).
    ///
    /// # Errors
    /// Times that are not positive; more than two effects that draw on the supply.
    pub fn new(
        params: &RigParams,
        effects: &EffectSet,
        dt_s: f64,
        max_step_s: f64,
    ) -> Result<Self, SimError> {
        let grid = &effects.grid(params, dt_s, max_step_s)?;
        Ok(Self {
            actuation: Actuation::new(params, effects, grid)?,
            sensing: Sensing::new(params, effects, grid)?,
            reference: Reference::new(params, effects, grid)?,
        })
    }

    /// Creates the memories for this rig.
    pub fn memory(&self) -> ChainMemory {
        ChainMemory {
            actuation: self.actuation.memory(),
            sensing: self.sensing.memory(),
            reference: self.reference.memory(),
            ..ChainMemory::default()
        }
    }

    /// The time steps.
    pub fn grid(&self) -> &Grid {
        self.actuation.grid()
    }

    /// Simulates one trial: `start_s` is its session time, `initial_kpa` its first pressure.
    ///
    /// # Errors
    /// Openings outside 0..1, buffers of different lengths, an initial pressure below vacuum or not finite.
    pub fn run(
        &self,
        memory: &mut ChainMemory,
        start: Start,
        start_s: f64,
        openings: Openings<'_>,
        initial_kpa: f64,
        recorded: Recorded<'_>,
    ) -> Result<(), SimError> {
        let samples = openings.check()?;
        check_length("pressure_kpa", samples, recorded.pressure_kpa.len())?;
        check_length("length_mm", samples, recorded.length_mm.len())?;
        check_length("bridge_v", samples, recorded.bridge_v.len())?;
        let nodes = self.grid().nodes(samples);
        memory.pressure.resize(nodes, 0.0);
        memory.length.resize(nodes, 0.0);
        let (pressure, length) = (&mut memory.pressure, &mut memory.length);
        self.actuation.run_nodes(
            &mut memory.actuation,
            start,
            openings,
            initial_kpa,
            pressure,
            length,
        )?;
        pick(self.grid(), None, pressure, recorded.pressure_kpa);
        self.sensing.run(
            &mut memory.sensing,
            start,
            start_s,
            length,
            pressure,
            recorded.bridge_v,
        )?;
        self.reference.run(&mut memory.reference, start, length, recorded.length_mm)
    }
}

/// The prepared rig with its crossbeam clamped or held by gauge blocks. The chamber follows its
/// valves; the gauge and the reference follow the imposed length. The muscle's memory does not
/// change.
#[derive(Debug)]
pub struct Held {
    pneumatics: Pneumatics,
    sensing: Sensing,
    reference: Reference,
}

/// Inputs that are imposed from outside, one value per sample.
#[derive(Debug, Clone, Copy)]
pub struct Setting<'a> {
    /// Length, mm.
    pub length_mm: &'a [f64],
    /// Share by which a shunt lowers the trim of the bridge, by sample; empty if there is no shunt.
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

    /// Simulates one trial with the memory of a [`Chain`](super::Chain) that has the same effects.
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
        // The cells (states) of the chamber are the first in the memory of the actuation.
        let (own, set) = (&mut memory.actuation, setting.length_mm);
        let kpa = &mut *pressure_kpa;
        self.pneumatics.run_with_length(own, start, openings, set, initial_kpa, kpa)?;
        let shown = (set, setting.shunt);
        let own = &mut memory.sensing;
        self.sensing.run_shunted(own, start, start_s, shown, pressure_kpa, bridge_v)?;
        self.reference.run(&mut memory.reference, start, set, length_mm)
    }
}

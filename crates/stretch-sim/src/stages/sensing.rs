//! Stage `sensing`: length to bridge voltage.

use stretch_effects::{
    Action, Grid, Need, Place, RigStage, Row, Skew, SkewSpec, Span, Start, Surroundings,
};

use super::{Memory, check_length};
use crate::{
    SimError,
    effects::{ActiveEffect, EffectSet},
    params::{Key, RigParams},
};

/// Values processed at a time: few enough to stay in the nearest cache.
const BLOCK: usize = 512;

/// Sleeve, gauge, bridge and amplifier of the nominal rig: memoryless.
///
/// e = (1 + e0)(1 - k) - 1; R = R0 (1 + e)^2; v = V_ref + G V_exc (1/2 - R/(R + R_b)), R_b = beta R(e0).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bridge {
    stretch_per_mm: f64,
    resistance: f64,
    trim: f64,
    reference: f64,
    scale: f64,
}

impl Bridge {
    /// The bridge of a rig.
    pub fn new(params: &RigParams) -> Self {
        let stretch = 1.0 + params[Key::E0];
        let resistance = params[Key::R0];
        Self {
            stretch_per_mm: stretch / params[Key::L0],
            resistance,
            trim: params[Key::Beta] * resistance * stretch * stretch,
            reference: params[Key::VRef],
            scale: params[Key::G] * params[Key::VExc],
        }
    }

    /// Returns the same bridge with its trim reduced by `share` (0 to 1).
    #[inline]
    pub fn shunted(&self, share: f64) -> Self {
        Self { trim: self.trim * (1.0 - share), ..*self }
    }

    /// Gauge strain at a length in mm.
    #[inline]
    pub fn strain(&self, length_mm: f64) -> f64 {
        self.stretch_per_mm * length_mm - 1.0
    }

    /// Resistance in ohm at a gauge strain.
    #[inline]
    pub fn resistance(&self, strain: f64) -> f64 {
        let stretch = 1.0 + strain;
        self.resistance * (stretch * stretch)
    }

    /// Amplified voltage at a resistance in ohm.
    #[inline]
    pub fn volts(&self, resistance: f64) -> f64 {
        self.reference + self.scale * (0.5 - resistance / (resistance + self.trim))
    }
}

/// The sensing stage, prepared to run: the nominal bridge and the effects on strain, resistance, voltage and recorded
/// samples.
#[derive(Debug)]
pub struct Sensing {
    grid: Grid,
    bridge: Bridge,
    sites: Sites,
    skew: Option<Skew>,
    needs_pressure: Option<&'static str>,
}

impl Sensing {
    /// Prepares the stage. For a measured length, which is linear between samples, [`Grid::samples`] is enough.
    ///
    /// # Errors
    /// None for the catalogue's effects.
    pub fn new(params: &RigParams, effects: &EffectSet, grid: &Grid) -> Result<Self, SimError> {
        let around = params.surroundings(grid);
        let sites = Sites::new(effects.acting_in(RigStage::Sensing), &around);
        Ok(Self {
            grid: grid.clone(),
            bridge: Bridge::new(params),
            skew: sites.skew(grid),
            sites,
            needs_pressure: effects
                .acting_in(RigStage::Sensing)
                .find(|e| e.effect().needs == Some(Need::Pressure))
                .map(|e| e.name()),
        })
    }

    /// Creates a memory for this stage.
    pub fn memory(&self) -> Memory {
        Memory::with_cells(self.sites.record.end())
    }

    /// The time steps.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Computes the bridge voltage in V at every sample, before noise, clipping and rounding.
    ///
    /// `length_mm` and `pressure_kpa` hold one value per node of the grid (per sample, on [`Grid::samples`]). The
    /// pressure may be empty unless `pressure_crosstalk` is on. `start_s` is the session time of the first sample.
    ///
    /// # Errors
    /// Slices of different lengths, or a missing pressure that an effect needs.
    pub fn run(
        &self,
        memory: &mut Memory,
        start: Start,
        start_s: f64,
        length_mm: &[f64],
        pressure_kpa: &[f64],
        bridge_v: &mut [f64],
    ) -> Result<(), SimError> {
        self.run_shunted(memory, start, start_s, (length_mm, &[]), pressure_kpa, bridge_v)
    }

    /// Like [`run`](Self::run), with a shunt that lowers the trim of the bridge by a share. The share is given at each
    /// node like the length; it is empty without a shunt. The effects behind the bridge act on the voltage that the
    /// shunt has changed.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    ///
    /// ```
    /// use stretch_sim::{EffectSet, Grid, RigParams, Sensing, Start};
    /// let mut effects = EffectSet::new();
    /// effects.insert("amplifier_lowpass", &[("tau", 0.1)])?;
    /// let stage = Sensing::new(&RigParams::default(), &effects, &Grid::samples(0.01)?)?;
    /// let (mut length, mut shunt, mut volts) = ([180.0; 200], [0.0; 200], [0.0; 200]);
    /// shunt[100..].fill(0.02);
    /// stage.run_shunted(&mut stage.memory(), Start::Settled, 0.0, (&length, &shunt), &[], &mut volts)?;
    /// assert!(volts[101] - volts[0] > -0.01 && volts[199] - volts[0] < -0.05);
    /// # Ok::<(), stretch_sim::SimError>(())
    /// ```
    pub fn run_shunted(
        &self,
        memory: &mut Memory,
        start: Start,
        start_s: f64,
        (length_mm, shunt): (&[f64], &[f64]),
        pressure_kpa: &[f64],
        bridge_v: &mut [f64],
    ) -> Result<(), SimError> {
        check_length("length_mm", self.grid.nodes(bridge_v.len()), length_mm.len())?;
        if let (Some(name), true) = (self.needs_pressure, pressure_kpa.is_empty()) {
            return Err(SimError::not_here(name, Need::Pressure.words()));
        }
        if !pressure_kpa.is_empty() {
            check_length("pressure_kpa", length_mm.len(), pressure_kpa.len())?;
        }
        if !shunt.is_empty() {
            check_length("shunt", length_mm.len(), shunt.len())?;
        }
        let Some(first) = length_mm.first() else { return Ok(()) };
        let start = memory.start(start);
        let (bridge, sites) = (&self.bridge, &self.sites);
        let grid = &self.grid;
        let span = |first_node: usize| Span { first_node, start_s, ..Span::whole(grid) };
        let cells = &mut memory.cells;
        let at = Span { pressure_kpa: pressure_kpa.get(..1).unwrap_or(&[]), ..span(0) };
        let e = [sites.strain.begin(&at, start, bridge.strain(*first), cells)];
        let at = Span { strain: &e, ..at };
        sites.resistance.begin_at(start, e[0], cells);
        let mut r = [bridge.resistance(e[0])];
        sites.resistance.run(&at, cells, &mut r);
        let first_share = shunt.first().copied().unwrap_or(0.0);
        sites.volts.begin(&at, start, bridge.shunted(first_share).volts(r[0]), cells);
        let mut work = std::mem::take(&mut memory.nodes);
        let direct = grid.pieces() == 1 && self.skew.is_none();
        if !direct {
            work.resize(length_mm.len(), 0.0);
        }
        let nodes: &mut [f64] = if direct { bridge_v } else { &mut work };
        let mut strain = [0.0; BLOCK];
        for (block, (length, v)) in length_mm.chunks(BLOCK).zip(nodes.chunks_mut(BLOCK)).enumerate()
        {
            let from = block * BLOCK;
            let strain = &mut strain[..length.len()];
            for (e, l) in strain.iter_mut().zip(length) {
                *e = bridge.strain(*l);
            }
            let pressure = pressure_kpa.get(from..from + length.len()).unwrap_or(&[]);
            let at = Span { pressure_kpa: pressure, ..span(from) };
            sites.strain.run(&at, &mut memory.cells, strain);
            for (v, e) in v.iter_mut().zip(strain.iter()) {
                *v = bridge.resistance(*e);
            }
            sites.resistance.run(&Span { strain, ..at }, &mut memory.cells, v);
            match shunt.get(from..from + length.len()) {
                Some(shares) if !shares.is_empty() => {
                    for (v, share) in v.iter_mut().zip(shares) {
                        *v = bridge.shunted(*share).volts(*v);
                    }
                }
                _ => v.iter_mut().for_each(|v| *v = bridge.volts(*v)),
            }
            sites.volts.run(&at, &mut memory.cells, v);
        }
        if !direct {
            pick(grid, self.skew.as_ref(), &work, bridge_v);
        }
        memory.nodes = work;
        self.write_down(memory, start_s, bridge_v);
        Ok(())
    }

    /// Applies the effects on recorded samples.
    fn write_down(&self, memory: &mut Memory, start_s: f64, samples: &mut [f64]) {
        if self.sites.record.is_empty() {
            return;
        }
        let span = Span { start_s, ..Span::whole(&self.grid) };
        self.sites.record.begin(&span, Start::Settled, samples[0], &mut memory.cells);
        self.sites.record.run(&span, &mut memory.cells, samples);
    }
}

/// Takes the samples from the nodes, shifted by a skew if there is one.
pub(crate) fn pick(grid: &Grid, skew: Option<&Skew>, nodes: &[f64], samples: &mut [f64]) {
    match skew {
        Some(skew) => skew.sample(nodes, samples),
        None => {
            for (out, node) in samples.iter_mut().zip(nodes.iter().step_by(grid.pieces())) {
                *out = *node;
            }
        }
    }
}

/// The operators of a sensing chain at each place, in the catalogue's order.
#[derive(Debug)]
pub(crate) struct Sites {
    pub(crate) strain: Row,
    pub(crate) resistance: Row,
    pub(crate) volts: Row,
    pub(crate) record: Row,
    skew: SkewSpec,
}

impl Sites {
    pub(crate) fn new<'a>(
        effects: impl Iterator<Item = &'a ActiveEffect>,
        around: &Surroundings<'_>,
    ) -> Self {
        let [mut strain, mut resistance, mut volts, mut record] = [const { Vec::new() }; 4];
        let mut skew = SkewSpec::default();
        for active in effects {
            match active.action(around) {
                Action::At(Place::Strain, operator) => strain.push(operator),
                Action::At(Place::Resistance, operator) => resistance.push(operator),
                Action::At(Place::Volts, operator) => volts.push(operator),
                Action::At(Place::Record, operator) => record.push(operator),
                Action::Skew(own) => {
                    skew.skew_s += own.skew_s;
                    skew.rate += own.rate;
                }
                _ => {}
            }
        }
        let strain = Row::new(strain, 0);
        let resistance = Row::new(resistance, strain.end());
        let volts = Row::new(volts, resistance.end());
        let record = Row::new(record, volts.end());
        Self { strain, resistance, volts, record, skew }
    }

    pub(crate) fn skew(&self, grid: &Grid) -> Option<Skew> {
        (self.skew != SkewSpec::default()).then(|| Skew::new(grid, self.skew))
    }
}

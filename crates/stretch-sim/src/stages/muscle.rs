//! Stage `muscle`: chamber pressure to length.

use stretch_effects::{Action, Grid, MeanReversion, Place, RigStage, Row, Span, Start};

use super::{Memory, check_length, pick};
use crate::{
    SimError,
    effects::EffectSet,
    params::{Key, RigParams},
    static_law::StaticLaw,
};

/// The muscle, prepared to run. Its parts act in this order: static contraction, effects on it, first-order lag,
/// effects after the lag, and the length L = L0 (1 - k).
#[derive(Debug)]
pub struct Muscle {
    grid: Grid,
    law: StaticLaw,
    lag: MeanReversion,
    before: Row,
    behind: Row,
    rest_mm: f64,
    k_max: f64,
    offset: usize,
}

impl Muscle {
    /// Prepares the stage. For a measured pressure, use [`Grid::new`] without delay and with steps of
    /// [`DEFAULT_STEP_S`](crate::DEFAULT_STEP_S).
    ///
    /// # Errors
    /// None for the catalogue's effects.
    pub fn new(params: &RigParams, effects: &EffectSet, grid: &Grid) -> Result<Self, SimError> {
        Self::at_cells(params, effects, grid, 0)
    }

    /// Like [`new`](Self::new), with its cells (states) placed after `offset` cells of another stage.
    pub(crate) fn at_cells(
        params: &RigParams,
        effects: &EffectSet,
        grid: &Grid,
        offset: usize,
    ) -> Result<Self, SimError> {
        let around = params.surroundings(grid);
        let (mut before, mut behind) = (Vec::new(), Vec::new());
        for active in effects.acting_in(RigStage::Muscle) {
            match active.action(&around) {
                Action::At(Place::StaticContraction, operator) => before.push(operator),
                Action::At(Place::MovingContraction, operator) => behind.push(operator),
                _ => {}
            }
        }
        let before = Row::new(before, offset + MeanReversion::CELLS);
        let behind = Row::new(behind, before.end());
        Ok(Self {
            grid: grid.clone(),
            law: StaticLaw::new(params),
            lag: MeanReversion::new(params[Key::TauM], params[Key::KMax], grid),
            before,
            behind,
            rest_mm: params[Key::L0],
            k_max: params[Key::KMax],
            offset,
        })
    }

    /// Creates a memory for this stage.
    pub fn memory(&self) -> Memory {
        Memory::with_cells(self.end())
    }

    /// The time steps.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    pub(crate) fn end(&self) -> usize {
        self.behind.end()
    }

    /// Computes the length in mm at every sample, from the gauge pressure in kPa at the same samples, which is taken as
    /// linear between them.
    ///
    /// # Errors
    /// Slices of different lengths.
    pub fn run(
        &self,
        memory: &mut Memory,
        start: Start,
        pressure_kpa: &[f64],
        length_mm: &mut [f64],
    ) -> Result<(), SimError> {
        check_length("length_mm", pressure_kpa.len(), length_mm.len())?;
        let mut nodes = std::mem::take(&mut memory.nodes);
        interpolate(&self.grid, pressure_kpa, &mut nodes);
        let start = memory.start(start);
        self.run_nodes(&mut memory.cells, start, &mut nodes);
        pick(&self.grid, None, &nodes, length_mm);
        memory.nodes = nodes;
        Ok(())
    }

    /// Replaces the pressure (kPa) at the nodes by the length (mm).
    pub(crate) fn run_nodes(&self, cells: &mut [f64], start: Start, nodes: &mut [f64]) {
        let Some(first) = nodes.first() else { return };
        self.begin(cells, start, *first);
        for x in nodes.iter_mut() {
            *x = self.law.contraction(*x);
        }
        self.move_on(cells, 0, nodes);
        for x in nodes {
            *x = self.length_mm(*x);
        }
    }

    /// Begins a trial at a pressure; returns the contraction there.
    pub(crate) fn begin(&self, cells: &mut [f64], start: Start, pressure_kpa: f64) -> f64 {
        let span = self.span(0);
        let still = self.before.begin(&span, start, self.law.contraction(pressure_kpa), cells);
        // The lag has no hysteresis state and settles within a fifth of a second.
        let lag_start = if matches!(start, Start::Hysteresis(_)) { Start::Settled } else { start };
        self.lag.begin(lag_start, still, &mut cells[self.offset..]);
        let moving = cells[self.offset];
        self.behind.begin(&span, start, moving, cells)
    }

    /// Advances to the next node and returns the contraction there.
    #[inline]
    pub(crate) fn step(&self, cells: &mut [f64], node: usize, pressure_kpa: f64) -> f64 {
        let mut x = [self.law.contraction(pressure_kpa)];
        self.move_on(cells, node, &mut x);
        x[0]
    }

    /// Replaces the static contraction by the dynamic one.
    fn move_on(&self, cells: &mut [f64], first_node: usize, signal: &mut [f64]) {
        let span = self.span(first_node);
        self.before.run(&span, cells, signal);
        let lag = &mut cells[self.offset..self.offset + MeanReversion::CELLS];
        self.lag.run(&span, lag, signal, |_, z| z);
        self.behind.run(&span, cells, signal);
    }

    fn span(&self, first_node: usize) -> Span<'_> {
        Span { first_node, ..Span::whole(&self.grid) }
    }

    #[inline]
    pub(crate) fn length_mm(&self, contraction: f64) -> f64 {
        self.rest_mm * (1.0 - contraction)
    }

    /// k/k_max.
    #[inline]
    pub(crate) fn share(&self, contraction: f64) -> f64 {
        contraction / self.k_max
    }
}

/// Interpolates samples linearly at the nodes of a grid.
pub(crate) fn interpolate(grid: &Grid, samples: &[f64], nodes: &mut Vec<f64>) {
    nodes.clear();
    nodes.reserve(grid.nodes(samples.len()));
    for pair in samples.windows(2) {
        let mut at = 0.0;
        for h in grid.steps() {
            nodes.push(pair[0] + (at / grid.dt_s()) * (pair[1] - pair[0]));
            at += h;
        }
    }
    nodes.extend(samples.last());
}

//! Stage `reference`: true length to the length that the potentiometer shows.

use stretch_effects::{Action, Grid, Place, RigStage, Row, Span, Start, Surroundings};

use super::{Memory, check_length, pick};
use crate::{SimError, effects::EffectSet, params::RigParams};

/// The reference, prepared to run. Without an effect it shows the true length.
#[derive(Debug)]
pub struct Reference {
    grid: Grid,
    row: Row,
}

impl Reference {
    /// Prepares the stage.
    ///
    /// # Errors
    /// None for the catalogue's effects.
    pub fn new(params: &RigParams, effects: &EffectSet, grid: &Grid) -> Result<Self, SimError> {
        Ok(Self::around(&params.surroundings(grid), effects, grid))
    }

    pub(crate) fn around(around: &Surroundings<'_>, effects: &EffectSet, grid: &Grid) -> Self {
        let row = effects
            .acting_in(RigStage::Reference)
            .filter_map(|active| match active.action(around) {
                Action::At(Place::Length, operator) => Some(operator),
                _ => None,
            })
            .collect();
        Self { grid: grid.clone(), row: Row::new(row, 0) }
    }

    /// Creates a memory for this stage.
    pub fn memory(&self) -> Memory {
        Memory::with_cells(self.row.end())
    }

    /// Computes the measured length (before noise and rounding) at every sample, from the true length at every node of
    /// the grid.
    ///
    /// # Errors
    /// Slices of different lengths.
    pub fn run(
        &self,
        memory: &mut Memory,
        start: Start,
        true_mm: &[f64],
        length_mm: &mut [f64],
    ) -> Result<(), SimError> {
        check_length("true length", self.grid.nodes(length_mm.len()), true_mm.len())?;
        let Some(first) = true_mm.first() else { return Ok(()) };
        let start = memory.start(start);
        if self.row.is_empty() {
            pick(&self.grid, None, true_mm, length_mm);
            return Ok(());
        }
        let span = Span::whole(&self.grid);
        self.row.begin(&span, start, *first, &mut memory.cells);
        if self.grid.pieces() == 1 {
            length_mm.copy_from_slice(true_mm);
            self.row.run(&span, &mut memory.cells, length_mm);
        } else {
            let mut work = std::mem::take(&mut memory.nodes);
            work.clear();
            work.extend_from_slice(true_mm);
            self.row.run(&span, &mut memory.cells, &mut work);
            pick(&self.grid, None, &work, length_mm);
            memory.nodes = work;
        }
        Ok(())
    }

    /// Replaces a measured (and smoothed) length by the true length that would have produced it.
    /// This length drives `sensing` when the reference has its own effects. The result is exact for
    /// `pot_nonlinearity`. For `pot_backlash` it is exact while the reference moves and linearly
    /// interpolated while it dwells.
    pub fn undo(&self, length_mm: &mut [f64]) {
        self.row.undo(length_mm);
    }
}

//! The stages. Each is prepared once from parameters and effects, then runs any number of trials without allocating.

mod actuation;
mod chain;
mod muscle;
mod pneumatics;
mod reference;
mod sensing;

pub use actuation::Actuation;
pub use chain::{Chain, ChainMemory, Held, Recorded, Setting};
pub use muscle::Muscle;
pub use pneumatics::Pneumatics;
pub use reference::Reference;
pub use sensing::{Bridge, Sensing};
pub(crate) use sensing::{Sites, pick};

use stretch_effects::Start;

use crate::SimError;

/// Returns an error unless `found` equals `expected`; both are numbers of values.
pub(crate) fn check_length(name: &str, expected: usize, found: usize) -> Result<(), SimError> {
    let refused = || format!("`{name}` has {found} values, but {expected} are needed");
    if expected == found { Ok(()) } else { Err(SimError::Refused(refused())) }
}

/// Openings of the two valves, one value per sample, each held until the next sample.
#[derive(Debug, Clone, Copy)]
pub struct Openings<'a> {
    /// Inlet, 0..1.
    pub inlet: &'a [f64],
    /// Outlet, 0..1.
    pub outlet: &'a [f64],
}

impl Openings<'_> {
    /// Checks the openings and returns the number of samples.
    ///
    /// # Errors
    /// The valves have different numbers of samples, or an opening is not within 0..1.
    pub fn check(&self) -> Result<usize, SimError> {
        check_length("outlet", self.inlet.len(), self.outlet.len())?;
        for (column, openings) in [("inlet", self.inlet), ("outlet", self.outlet)] {
            if let Some(sample) = openings.iter().position(|u| !(0.0..=1.0).contains(u)) {
                let value = openings[sample];
                return Err(SimError::Refused(format!(
                    "{column}, sample {sample}: opening {value} is outside 0 .. 1"
                )));
            }
        }
        Ok(self.inlet.len())
    }
}

/// Memory of a prepared stage: the states (cells) of its operators, and buffers that are allocated once and reused.
///
/// The method `memory()` of a stage creates it. A memory fits the stage that created it, and any stage with the same
/// effects at other values.
#[derive(Debug, Clone, Default)]
pub struct Memory {
    pub(crate) cells: Vec<f64>,
    /// Whether a trial has run with this memory.
    pub(crate) used: bool,
    pub(crate) nodes: Vec<f64>,
    pub(crate) more_nodes: Vec<f64>,
    /// Openings after the effects on the valve commands.
    pub(crate) commands: [Vec<f64>; 2],
}

impl Memory {
    pub(crate) fn with_cells(count: usize) -> Self {
        Self { cells: vec![0.0; count], ..Self::default() }
    }

    /// Returns how a trial can start with this memory. A fresh memory has no state to carry over, so the trial starts
    /// settled instead.
    pub(crate) fn start(&mut self, asked: Start) -> Start {
        let used = std::mem::replace(&mut self.used, true);
        match asked {
            Start::Carried { .. } if !used => Start::Settled,
            Start::Hysteresis(_) if !used => {
                self.cells.fill(0.0);
                asked
            }
            _ => asked,
        }
    }

    /// Moves the state by a share of the distance to the state of another memory of the same stage. The result is a
    /// possible state, because the possible states of an operator form a convex set.
    pub fn move_towards(&mut self, other: &Self, share: f64) {
        for (own, other) in self.cells.iter_mut().zip(&other.cells) {
            *own += share * (other - *own);
        }
    }

    /// Forgets everything: the next trial starts settled unless it begins with a given hysteresis state.
    pub fn clear(&mut self) {
        self.cells.fill(0.0);
        self.used = false;
    }
}

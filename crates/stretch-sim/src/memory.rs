//! What a stage remembers between trials, and its working space.

/// Memory of a prepared stage: its operators' states, and buffers that grow once and are used again.
///
/// Every stage hands out its own by `memory()`; a memory fits the stage (and effects) that made it, and any stage with
/// the same effects at other values.
#[derive(Debug, Clone, Default)]
pub struct Memory {
    pub(crate) cells: Vec<f64>,
    /// Whether a trial has run in it.
    pub(crate) used: bool,
    pub(crate) nodes: Vec<f64>,
    pub(crate) more_nodes: Vec<f64>,
    /// Openings as the valves take them.
    pub(crate) commands: [Vec<f64>; 2],
}

impl Memory {
    pub(crate) fn with_cells(count: usize) -> Self {
        Self { cells: vec![0.0; count], ..Self::default() }
    }

    /// How a trial may start in it: nothing can be carried out of a fresh memory, so it settles.
    pub(crate) fn start(&mut self, asked: crate::Start) -> crate::Start {
        let used = std::mem::replace(&mut self.used, true);
        match asked {
            crate::Start::Carried { .. } if !used => crate::Start::Settled,
            crate::Start::Hysteresis(_) if !used => {
                self.cells.fill(0.0);
                asked
            }
            _ => asked,
        }
    }

    /// Moves what is remembered a share of the way to what another memory of the same stage remembers: between two states that an
    /// operator may be in lie only such states.
    pub fn move_towards(&mut self, other: &Self, share: f64) {
        for (own, other) in self.cells.iter_mut().zip(&other.cells) {
            *own += share * (other - *own);
        }
    }

    /// Forgets everything: the next trial settles unless it begins with a given hysteresis state.
    pub fn clear(&mut self) {
        self.cells.fill(0.0);
        self.used = false;
    }
}

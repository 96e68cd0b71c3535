//! How many rows of what was read a diagnosis stands on.

use serde::{Deserialize, Serialize};

/// Rows of the trials: those that a diagnosis stands on, and all that were read.
///
/// ```
/// let rows = stretch_gap::RowsUsed { used: 120, read: 1000 };
/// assert_eq!(rows.share(), 0.12);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct RowsUsed {
    /// Rows used.
    pub used: usize,
    /// Rows read.
    pub read: usize,
}

impl RowsUsed {
    /// Share of the rows that is used; 1 of none.
    pub fn share(&self) -> f64 {
        if self.read == 0 { 1.0 } else { self.used as f64 / self.read as f64 }
    }
}

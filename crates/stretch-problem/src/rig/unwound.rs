//! What is remembered of the move before the session.
//!
//! A muscle that begins its session vented was filled before, as a rule: play and creep then begin from that side. A rig that had settled
//! where it begins (one that was just switched on, a simulated one) remembers no such move. Between the two lies a share of the memory,
//!
//! ```text
//! cells = moved + share (settled - moved)
//! ```
//!
//! and the share is a parameter of the record, as is the pressure at a trial's start.

use stretch_sim::{Memory, Start};

use crate::error::ProblemError;

/// Moves a memory that was left at the other end of the stroke towards that of a stage that settled where the session begins.
/// `begin` lets a memory begin there; the trial then goes on without a pause.
pub(super) fn unwind(
    share: f64,
    after_pause: Start,
    memory: &mut Memory,
    mut settled: Memory,
    mut begin: impl FnMut(&mut Memory, Start) -> Result<(), ProblemError>,
) -> Result<(), ProblemError> {
    if share > 0.0 {
        begin(memory, after_pause)?;
        begin(&mut settled, Start::Settled)?;
        memory.move_towards(&settled, share);
    }
    Ok(())
}

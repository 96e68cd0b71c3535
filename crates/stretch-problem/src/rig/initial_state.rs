//! The initial hysteresis state: what a stage remembers of the motion before the session.
//!
//! As a rule a muscle that is vented at the session's start was filled before; then play and creep begin from the filled side. A rig that had
//! settled where the session begins (a rig that was just switched on, a simulated one) remembers no such motion. The initial state lies
//! between the two:
//!
//! ```text
//! cells = moved + share (settled - moved)
//! ```
//!
//! The share is a parameter of the recording, as is the pressure at a trial's start.

use stretch_sim::{Memory, Start};

use crate::error::ProblemError;

/// Moves a memory that was left at the other end of the stroke towards the memory of a stage that settled where the session begins.
/// `begin` begins a trial with a memory at the session's first sample; the trial then follows without a pause.
pub(super) fn set_initial_state(
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

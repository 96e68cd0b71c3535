//! The stages: each prepared once from parameters and effects, then run on any number of trials without allocating.

mod actuation;
mod chain;
mod held;
mod muscle;
mod openings;
mod pneumatics;
mod reference;
mod sensing;

pub use actuation::Actuation;
pub use chain::{Chain, ChainMemory, Recorded};
pub use held::{Held, Setting};
pub use muscle::Muscle;
pub use openings::Openings;
pub use pneumatics::Pneumatics;
pub use reference::Reference;
pub use sensing::{Bridge, Sensing};
pub(crate) use sensing::{Sites, pick};

use crate::SimError;

/// `Ok` when `found` values are `expected`.
pub(crate) fn check_length(
    name: &'static str,
    expected: usize,
    found: usize,
) -> Result<(), SimError> {
    if expected == found { Ok(()) } else { Err(SimError::Length { name, expected, found }) }
}

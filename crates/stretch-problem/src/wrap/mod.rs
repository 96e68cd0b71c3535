//! Wrappers: what may stand in front of or behind a stage that nobody can look into.
//!
//! One literal is one kind of wrapper; a kind at a place (an input or the output of a stage) is an effect.

mod catalogue;
mod extent;
mod forces;
mod kind;
mod loops;
mod place;
mod scales;
mod times;

pub use catalogue::{wrapper_named, wrappers};
pub use extent::Extent;
pub use kind::{Beside, Family, Measure, Side, Starts, Wrapper};
pub(crate) use place::{Among, Placed, Site, Trials, placed};

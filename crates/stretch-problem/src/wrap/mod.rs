//! Wrappers: what may stand in front of or behind a stage that nobody can look into.
//!
//! A [kind of effect](stretch_effects::Kind) at a place (an input or the output of a stage) is a wrapper.

mod place;

pub(crate) use place::{Among, Placed, Site, Trials, placed};

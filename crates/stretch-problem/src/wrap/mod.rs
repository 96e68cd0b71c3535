//! Wrappers: effects in front of or behind a stage of a black box.
//!
//! A [kind of effect](stretch_effects::Kind) at a place (an input or the output of a stage) is a wrapper.

mod place;

pub(crate) use place::{Among, Placed, Site, Trials, placed};

//! The aggregates as SQL sees them, against the fits that they are made of.

mod damage;
mod groups;
mod refusals;
mod support;
mod truth;

//! The search for the set of effects that the simulator lacks.
//!
//! Input: a prepared problem and the thresholds. Output: [`selection::Found`], the best set of
//! effects with its alternatives, and every set that was fitted ([`sets`]). Effects are screened
//! with one simulation per start ([`screen`]); the promising ones are fitted ([`sets`]) and added
//! if they meet the criteria ([`acceptance`]). Two other explanations are compared ([`variants`]):
//! commands that switch between rows, and other sizes of drift and offsets.
//! Imports: `numerics`, `problem`, `fit`.

pub(crate) mod acceptance;
pub(crate) mod screen;
pub(crate) mod selection;
pub(crate) mod sets;
pub(crate) mod variants;

#[cfg(test)]
mod tests;

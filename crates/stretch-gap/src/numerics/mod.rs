//! Arithmetic that knows nothing of simulators.
//!
//! In: numbers. Out: factors of normal matrices and least squares within a box ([`linear`], [`arrowhead`]), seeded random
//! numbers ([`random`]), rates ([`differences`]), and elapsed seconds ([`stopwatch`]).
//! Nothing of the crate is imported here.

pub(crate) mod arrowhead;
pub(crate) mod differences;
pub(crate) mod linear;
pub(crate) mod random;
pub(crate) mod stopwatch;

#[cfg(test)]
mod tests;

//! Arithmetic that is independent of simulators.
//!
//! Input: numbers. Output: factors of normal matrices and least squares within a box ([`linear`]),
//! seeded random numbers ([`random`]) and elapsed seconds ([`stopwatch`]). This module imports no
//! other module of the crate.

pub(crate) mod linear;
pub(crate) mod random;
pub(crate) mod stopwatch;

#[cfg(test)]
mod tests;

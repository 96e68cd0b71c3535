//! What a receptor over converter codes answers.

use stretch_core::Branch;

use crate::Domain;

/// What a [`CodeReceptor`](super::CodeReceptor) answers for one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CodeReading<E> {
    /// The estimated reference: in [`Fixed`](super::Fixed) thousandths of its unit
    /// (micrometres for a reference in millimetres), else the unit itself.
    pub estimate: E,
    /// The branch that was evaluated.
    pub branch: Branch,
    /// Whether the inputs lay where the calibration was fitted.
    pub domain: Domain,
}

//! The answer of a receptor over converter codes.

use stretch_core::Branch;

use crate::Domain;

/// The answer of a [`CodeReceptor`](super::CodeReceptor) for one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CodeReading<E> {
    /// The estimated reference. In [`Fixed`](super::Fixed) arithmetic it is in thousandths of the reference's unit
    /// (micrometres for a reference in millimetres), otherwise in that unit.
    pub estimate: E,
    /// The branch that was evaluated.
    pub branch: Branch,
    /// Whether the inputs lay in the calibrated domain.
    pub domain: Domain,
}

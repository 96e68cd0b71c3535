//! The answer of a receptor over converter codes.

use stretch_core::Branch;

use crate::Domain;

/// The answer of a [`FixedReceptor`](super::FixedReceptor) for one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CodeReading<E> {
    /// The estimated reference: an integer in thousandths of the reference's unit (micrometres for a reference in
    /// millimetres), a float in that unit.
    pub estimate: E,
    /// The branch that was evaluated.
    pub branch: Branch,
    /// Whether the inputs lay in the calibrated domain.
    pub domain: Domain,
}

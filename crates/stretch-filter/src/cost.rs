//! What a live step costs.

/// Arithmetic of one live step and the numbers kept between two steps.
///
/// On a core without a floating-point unit multiply each by the price of a
/// soft-float operation (about 50 instructions a product and 80 a sum on a
/// Cortex-M3) to see the budget that a design needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct Cost {
    /// Products a sample.
    pub multiplications: usize,
    /// Sums and differences a sample.
    pub additions: usize,
    /// Floating-point numbers in the memory.
    pub state: usize,
}

impl Cost {
    pub(crate) const fn new(multiplications: usize, additions: usize, state: usize) -> Self {
        Self { multiplications, additions, state }
    }
}

//! Cost of a live step.

/// Number of operations in one live step, and of values kept between two steps.
///
/// On a core without a floating-point unit, multiply these by the cost of a soft-float operation to
/// get the cost of a step. On a Cortex-M3 a product takes about 48 instructions, a sum about 77.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Cost {
    /// Products per sample.
    pub multiplications: usize,
    /// Sums and differences per sample.
    pub additions: usize,
    /// Floating-point numbers in the memory.
    pub state: usize,
}

impl Cost {
    pub(crate) const fn new(multiplications: usize, additions: usize, state: usize) -> Self {
        Self { multiplications, additions, state }
    }
}

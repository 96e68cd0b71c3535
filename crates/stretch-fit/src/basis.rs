//! Columns and rows of the design matrix for the terms of a degree.

use stretch_core::{Degree, Real};

/// Returns the powers of each term as an array, because iterating over an array is faster than
/// computing the powers.
pub(crate) fn exponents<const TERMS: usize>(degree: Degree) -> [(u8, u8); TERMS] {
    let mut terms = [(0, 0); TERMS];
    for (place, term) in terms.iter_mut().zip(degree.exponents()) {
        *place = term;
    }
    terms
}

/// Returns the index of a term in the order of `Degree::exponents`.
pub(crate) fn position(degree: Degree, term: (u8, u8)) -> Option<usize> {
    degree.exponents().position(|t| t == term)
}

/// A table that gives, for every column, the earlier column and the factor of which it is the
/// product.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Basis<const TERMS: usize> {
    degree: Degree,
    /// `(index of the earlier term, whether the factor is the voltage)`; the first entry is unused.
    steps: [(u8, bool); TERMS],
}

impl<const TERMS: usize> Basis<TERMS> {
    /// Creates the table of a degree, which has at most `TERMS` terms.
    pub(crate) fn new(degree: Degree) -> Self {
        let terms = degree.terms().min(TERMS);
        // each term is an earlier term, times the rate or the voltage
        let powers = exponents::<TERMS>(degree);
        let mut steps = [(0, false); TERMS];
        for k in 1..terms {
            let (i, j) = powers[k];
            let by_volts = j > 0;
            let lower = if by_volts { (i, j - 1) } else { (i - 1, j) };
            let parent = powers[..k].iter().position(|&term| term == lower);
            steps[k] = (parent.unwrap_or(0) as u8, by_volts);
        }
        Self { degree, steps }
    }

    pub(crate) fn degree(&self) -> Degree {
        self.degree
    }

    pub(crate) fn terms(&self) -> usize {
        self.degree.terms().min(TERMS)
    }

    /// Writes the columns for many samples to `block`. The column of the constant term is `one`
    /// (the square roots of the weights).
    #[inline(always)]
    pub(crate) fn columns<T: Real, const ROWS: usize>(
        &self,
        one: &[T; ROWS],
        rate: &[T; ROWS],
        volts: &[T; ROWS],
        block: &mut [[T; ROWS]; TERMS],
    ) {
        let terms = self.terms();
        if terms > 0 {
            block[0] = *one;
        }
        for k in 1..terms {
            let (parent, by_volts) = self.steps[k];
            let factor = if by_volts { volts } else { rate };
            let (before, this) = block.split_at_mut(k);
            let parent = &before[usize::from(parent).min(k - 1)];
            for row in 0..ROWS {
                this[0][row] = parent[row] * factor[row];
            }
        }
    }

    /// Returns the row of one sample, in the first `terms` places.
    pub(crate) fn row<T: Real>(&self, rate: T, volts: T) -> [T; TERMS] {
        let mut row = [T::zero(); TERMS];
        if TERMS > 0 {
            row[0] = T::one();
        }
        for k in 1..self.terms() {
            let (parent, by_volts) = self.steps[k];
            row[k] = row[usize::from(parent)] * if by_volts { volts } else { rate };
        }
        row
    }

    /// Returns the largest allowed rate or voltage, a power of two. Up to it, sums of squared
    /// powers cannot overflow.
    pub(crate) fn most<T: Real>(&self) -> T {
        let exponent = entry_exponent::<T>() / i32::from(self.degree.total().max(1));
        power_of_two(exponent)
    }
}

/// Returns the exponent of the largest allowed entry of a row, as a power of 2. Up to it, sums of
/// squares stay finite for ten million rows (`f32`) or any number of rows (`f64`), with or without
/// centring.
pub(crate) fn entry_exponent<T: Real>() -> i32 {
    // f32 overflows at 2^128, f64 at 2^1024.
    if T::max_value().as_f64() < 1e100 { 45 } else { 480 }
}

/// Returns `2^n`, exactly.
pub(crate) fn power_of_two<T: Real>(n: i32) -> T {
    let mut x = T::one();
    let two = T::one() + T::one();
    for _ in 0..n {
        x = x * two;
    }
    x
}

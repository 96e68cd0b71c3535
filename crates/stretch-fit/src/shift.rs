//! Moving the voltage's origin.
//!
//! Powers of raw volts that vary little beside their mean are nearly parallel
//! (1.23 to 1.25 V: condition 1e8). Powers of `volts - centre` are not, and
//! with a centre near the data the subtraction is exact. Terms that share a
//! power of the rate turn into each other by the binomial theorem; in the
//! order of `Degree::exponents` that is a product with an upper triangle, so a
//! triangular factor stays triangular whatever its centre.

// Triangles are walked by index, as in the textbooks.
#![allow(clippy::needless_range_loop)]

use stretch_core::{Degree, MAX_DEGREE, Real};

use crate::basis::exponents;

/// `C(n, k)` for powers up to 5.
fn binomial(n: u8, k: u8) -> f64 {
    (0..k).fold(1.0, |c, m| c * f64::from(n - m) / f64::from(m + 1))
}

/// The upper triangle `S` with `(columns in v + by) = (columns in v) S`.
///
/// For coefficients of one surface: those in `v` are `S` times those in
/// `v + by`.
pub(crate) fn shift<T: Real, const TERMS: usize>(degree: Degree, by: T) -> [[T; TERMS]; TERMS] {
    let terms = exponents::<TERMS>(degree);
    let mut powers = [T::one(); MAX_DEGREE + 1];
    for j in 1..powers.len() {
        powers[j] = powers[j - 1] * by;
    }
    let mut s = [[T::zero(); TERMS]; TERMS];
    for row in 0..degree.terms().min(TERMS) {
        let (i, m) = terms[row];
        for column in row..degree.terms().min(TERMS) {
            let (k, j) = terms[column];
            if k == i && j >= m {
                s[row][column] = T::from_f64(binomial(j, m)) * powers[usize::from(j - m)];
            }
        }
    }
    s
}

/// The product of two upper triangles.
pub(crate) fn product<T: Real, const TERMS: usize>(
    terms: usize,
    a: &[[T; TERMS]; TERMS],
    b: &[[T; TERMS]; TERMS],
) -> [[T; TERMS]; TERMS] {
    let mut c = [[T::zero(); TERMS]; TERMS];
    for row in 0..terms {
        for column in row..terms {
            let mut sum = T::zero();
            for k in row..=column {
                sum = sum + a[row][k] * b[k][column];
            }
            c[row][column] = sum;
        }
    }
    c
}

/// An upper triangle times a vector.
pub(crate) fn apply<T: Real, const TERMS: usize>(
    terms: usize,
    a: &[[T; TERMS]; TERMS],
    x: &[T; TERMS],
) -> [T; TERMS] {
    let mut y = [T::zero(); TERMS];
    for row in 0..terms {
        for k in row..terms {
            y[row] = y[row] + a[row][k] * x[k];
        }
    }
    y
}

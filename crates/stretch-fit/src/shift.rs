//! Conversion of polynomials to another origin of the voltage.
//!
//! If raw volts vary little compared with their mean, their powers are nearly linearly dependent
//! (1.23 to 1.25 V: condition 1e8). Powers of `volts - centre` are not, and with a centre near the
//! data the subtraction is exact. The conversion follows from the binomial theorem, for terms with
//! the same power of the rate. In the order of `Degree::exponents` it is a product with an upper
//! triangular matrix, so a triangular factor stays triangular for any centre.

// Loops over triangles use indices, as in textbooks.
#![allow(clippy::needless_range_loop)]

use stretch_core::{Degree, MAX_DEGREE, Real};

use crate::basis::exponents;

const POWERS: usize = MAX_DEGREE + 1;

/// `C(n, k)` for all powers: Pascal's triangle.
const BINOMIALS: [[f64; POWERS]; POWERS] = {
    let mut c = [[0.0; POWERS]; POWERS];
    let mut n = 0;
    while n < POWERS {
        c[n][0] = 1.0;
        let mut k = 1;
        while k <= n {
            c[n][k] = c[n - 1][k - 1] + c[n - 1][k];
            k += 1;
        }
        n += 1;
    }
    c
};

/// Returns the upper triangular matrix `S` with `(columns in v + by) = (columns in v) S`.
///
/// The coefficients of a surface over `v` are `S` times its coefficients over `v + by`.
pub(crate) fn shift<T: Real, const TERMS: usize>(degree: Degree, by: T) -> [[T; TERMS]; TERMS] {
    let terms = exponents::<TERMS>(degree);
    let mut powers = [T::one(); POWERS];
    for j in 1..powers.len() {
        powers[j] = powers[j - 1] * by;
    }
    let mut s = [[T::zero(); TERMS]; TERMS];
    for row in 0..degree.terms().min(TERMS) {
        let (i, m) = terms[row];
        for column in row..degree.terms().min(TERMS) {
            let (k, j) = terms[column];
            if k == i && j >= m {
                let (j, m) = (usize::from(j), usize::from(m));
                s[row][column] = T::from_f64(BINOMIALS[j][m]) * powers[j - m];
            }
        }
    }
    s
}

/// Returns the product of two upper triangular matrices.
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

/// Returns the product of an upper triangular matrix and a vector.
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

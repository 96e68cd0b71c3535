//! Taps of Savitzky-Golay rate estimators as exact integers.
//!
//! A tap of a Savitzky-Golay filter of degree `d` is a polynomial of degree `d`
//! in the lag j, so the output is a sum of `d + 1` *moments* of the window,
//!
//! ```text
//! B_k = sum over j = 0 .. n-1 of C(j, k) x[now - j],      C: binomial coefficient
//! y   = (T_0 B_0 + ... + T_d B_d) / D
//! ```
//!
//! with integers T and D. With A_kl = sum of C(j, k) C(j, l) and d_k = C'(delay, k), least squares
//! gives T/D = -A^-1 d. This is solved exactly, in integers, at compile time.

/// The highest degree of a fixed-point Savitzky-Golay filter.
pub const MAX_FIXED_SG_DEGREE: usize = 3;

pub(crate) const MOMENTS: usize = MAX_FIXED_SG_DEGREE + 1;

/// The integer constants of one filter shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FixedTaps {
    /// T_k.
    pub weights: [i32; MOMENTS],
    /// D: the weighted sum divided by D is the change per sample.
    pub denominator: i64,
    /// Sum of the magnitudes of the taps, times D.
    pub total: i128,
}

/// C(n, k).
pub(crate) const fn choose(n: usize, k: usize) -> i128 {
    let (mut result, mut i) = (1, 0);
    while i < k {
        if n <= i {
            return 0;
        }
        result = result * (n - i) as i128 / (i + 1) as i128;
        i += 1;
    }
    result
}

const fn gcd(a: i128, b: i128) -> i128 {
    let (mut a, mut b) = (a.abs(), b.abs());
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

/// Returns 6 C'(x, k), which is an integer for every k up to 3.
const fn slope_of_choose(x: i128, k: usize) -> i128 {
    match k {
        0 => 0,
        1 => 6,
        2 => 3 * (2 * x - 1),
        _ => 3 * x * x - 6 * x + 2,
    }
}

impl FixedTaps {
    /// Computes the constants of a shape. Needs `1 <= degree <= 3`, `degree < window` and
    /// `delay < window`. Compilation fails if an integer does not fit.
    pub(crate) const fn of(window: usize, degree: usize, delay: usize) -> Self {
        let terms = degree + 1;
        // the normal equations, right-hand side in the last column
        let mut rows = [[0i128; MOMENTS + 1]; MOMENTS];
        let mut k = 0;
        while k < terms {
            let mut l = 0;
            while l < terms {
                let mut j = 0;
                while j < window {
                    rows[k][l] += choose(j, k) * choose(j, l);
                    j += 1;
                }
                l += 1;
            }
            rows[k][MOMENTS] = -slope_of_choose(delay as i128, k);
            k += 1;
        }
        rows = eliminate(rows, terms);
        // T_k = rows[k][last] / (6 rows[k][k]), over their least common denominator
        let mut denominator = 1;
        let mut k = 0;
        while k < terms {
            let own = 6 * rows[k][k];
            let reduced = (own / gcd(own, rows[k][MOMENTS])).abs();
            denominator = denominator / gcd(denominator, reduced) * reduced;
            k += 1;
        }
        let mut weights = [0; MOMENTS];
        let mut wide = [0i128; MOMENTS];
        k = 0;
        while k < terms {
            wide[k] = rows[k][MOMENTS] * denominator / (6 * rows[k][k]);
            assert!(wide[k].abs() <= i32::MAX as i128, "the taps of this shape do not fit 32 bits");
            weights[k] = wide[k] as i32;
            k += 1;
        }
        assert!(denominator <= i64::MAX as i128, "the taps of this shape do not fit 64 bits");
        let mut total = 0;
        let mut j = 0;
        while j < window {
            total += tap(&wide, j).abs();
            j += 1;
        }
        Self { weights, denominator: denominator as i64, total }
    }
}

/// Returns the tap at lag `j`, times the denominator.
const fn tap(weights: &[i128; MOMENTS], j: usize) -> i128 {
    let (mut sum, mut k) = (0, 0);
    while k < MOMENTS {
        sum += weights[k] * choose(j, k);
        k += 1;
    }
    sum
}

/// Performs Gauss-Jordan elimination without fractions. Every row is divided by its common factor.
const fn eliminate(
    mut rows: [[i128; MOMENTS + 1]; MOMENTS],
    terms: usize,
) -> [[i128; MOMENTS + 1]; MOMENTS] {
    let mut pivot = 0;
    while pivot < terms {
        let mut row = 0;
        while row < terms {
            if row != pivot {
                let (own, other) = (rows[pivot][pivot], rows[row][pivot]);
                let (mut column, mut common) = (0, 0);
                while column <= MOMENTS {
                    rows[row][column] = rows[row][column] * own - rows[pivot][column] * other;
                    common = gcd(common, rows[row][column]);
                    column += 1;
                }
                column = 0;
                while column <= MOMENTS {
                    rows[row][column] /= common;
                    column += 1;
                }
            }
            row += 1;
        }
        pivot += 1;
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gram;

    #[test]
    fn the_eleven_point_parabola_is_the_textbook_one() {
        let taps = FixedTaps::of(11, 2, 0);
        assert_eq!(taps.denominator, 4290);
        assert_eq!(taps.weights, [945, -489, 100, 0]);
        let wide = taps.weights.map(i128::from);
        let numerators = core::array::from_fn(|j| tap(&wide, j));
        assert_eq!(numerators, [945, 456, 67, -222, -411, -500, -489, -378, -167, 144, 555]);
        assert_eq!(taps.total, 4334);
    }

    #[test]
    fn every_shape_agrees_with_the_orthogonal_polynomials() {
        for degree in 1..=MAX_FIXED_SG_DEGREE {
            for window in degree + 1..=25 {
                for delay in [0, window / 2, window - 1] {
                    let taps = FixedTaps::of(window, degree, delay);
                    let wide = taps.weights.map(i128::from);
                    let largest = taps.total as f64 / taps.denominator as f64;
                    gram::taps_into(window, degree, 1, delay, 1.0, |lag, expected| {
                        let exact = tap(&wide, lag) as f64 / taps.denominator as f64;
                        let error = (exact - expected).abs();
                        assert!(error <= testkit::tolerance::TAPS * largest, "{window} {degree}");
                    });
                }
            }
        }
    }
}

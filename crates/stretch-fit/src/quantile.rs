//! Quantiles of Student's t and of Fisher's F, for bounds.
//!
//! The distribution functions are statrs' incomplete beta; its inverse is not
//! used, being wrong by some per cent at few degrees of freedom (0.19.1). The
//! functions are monotone, so bisection finds the quantile to the last bits.

use statrs::function::{beta::checked_beta_reg, erf::erfc_inv};

/// From here on the expansion around the normal quantile is exact to `f64`.
const MANY: u64 = 1000;

/// Halvings: enough to bring any starting interval down to one rounding.
const HALVINGS: u32 = 1100;

/// The quantile `t` with `P(|x| <= t) = level` for Student's t of `dof`.
///
/// Beyond a thousand degrees of freedom by the expansion of Abramowitz and
/// Stegun 26.7.5, whose next term is of order `dof^-5`.
///
/// ```
/// let t = stretch_fit::student_two_sided(0.95, 10);
/// assert!((t - 2.228).abs() < 1e-3);
/// ```
pub fn student_two_sided(level: f64, dof: u64) -> f64 {
    let n = dof as f64;
    if dof < MANY {
        // P(|x| > t) is the incomplete beta of a = n/2, b = 1/2 at n/(n + t^2).
        return root_of(1.0 - level, |t| beta(0.5 * n, 0.5, n / (n + t * t)));
    }
    // P(|x| > z) = 1 - level
    let z = core::f64::consts::SQRT_2 * erfc_inv(1.0 - level);
    let z2 = z * z;
    let g1 = (z2 + 1.0) * z / 4.0;
    let g2 = ((5.0 * z2 + 16.0) * z2 + 3.0) * z / 96.0;
    let g3 = (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) * z / 384.0;
    let g4 = ((((79.0 * z2 + 776.0) * z2 + 1482.0) * z2 - 1920.0) * z2 - 945.0) * z / 92160.0;
    z + (g1 + (g2 + (g3 + g4 / n) / n) / n) / n
}

/// The quantile at `level` of Fisher's F of `terms` and `dof`.
pub(crate) fn fisher(level: f64, terms: u64, dof: u64) -> f64 {
    let (p, n) = (terms as f64, dof as f64);
    root_of(1.0 - level, |f| beta(0.5 * n, 0.5 * p, n / (n + p * f)))
}

fn beta(a: f64, b: f64, x: f64) -> f64 {
    checked_beta_reg(a, b, x).unwrap_or(f64::NAN)
}

/// The `x >= 0` at which a falling `tail` is `wanted`; NaN if there is none.
fn root_of(wanted: f64, tail: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while tail(high) > wanted && high < f64::MAX / 4.0 {
        low = high;
        high *= 2.0;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if tail(middle) > wanted {
            low = middle;
        } else {
            high = middle;
        }
    }
    if tail(high).is_nan() { f64::NAN } else { 0.5 * (low + high) }
}

#[cfg(test)]
mod tests {
    use approx::relative_eq;

    use super::{fisher, student_two_sided};
    use testkit::{tolerance::FIT_QUANTILE, vectors::columns};

    #[test]
    fn quantiles_agree_with_sixty_digits() {
        let table = columns("fit/quantiles.csv");
        for (row, expected) in table["t"].iter().enumerate() {
            let [level, terms, dof] = ["level", "terms", "dof"].map(|name| table[name][row]);
            let near = |a: f64, b| relative_eq!(a, b, epsilon = 0.0, max_relative = FIT_QUANTILE);
            let t = student_two_sided(level, dof as u64);
            assert!(near(t, *expected), "t at {level} of {dof}: {t:?}");
            let f = fisher(level, terms as u64, dof as u64);
            assert!(near(f, table["f"][row]), "F at {level} of {terms}, {dof}: {f:?}");
        }
    }

    #[test]
    fn extreme_levels_and_counts_stay_finite() {
        for level in [1e-300, 1e-9, 0.5, 1.0 - 1e-15] {
            for dof in [1, 2, 999, 1000, u64::MAX] {
                assert!(student_two_sided(level, dof).is_finite(), "t at {level:e} of {dof}");
                let f = fisher(level, 21, dof);
                assert!(f.is_finite() && f >= 0.0, "F at {level:e} of {dof}: {f}");
            }
        }
    }
}

//! Quantiles of Fisher's F, for confidence bounds.
//!
//! The distribution function uses the incomplete beta function of statrs. Its inverse in statrs
//! (0.19.1) is not used, because it is wrong by some per cent at few degrees of freedom. The
//! distribution function is monotone, so bisection finds the quantile to the last bits.

use statrs::function::beta::checked_beta_reg;

/// Largest number of bisection steps, enough to reduce any starting interval to neighbouring
/// floats.
const HALVINGS: u32 = 1100;

/// Returns the quantile at `level` of Fisher's F with `terms` and `dof` degrees of freedom.
pub(crate) fn fisher(level: f64, terms: u64, dof: u64) -> f64 {
    let (p, n) = (terms as f64, dof as f64);
    root_of(1.0 - level, |f| beta(0.5 * n, 0.5 * p, n / (n + p * f)))
}

fn beta(a: f64, b: f64, x: f64) -> f64 {
    checked_beta_reg(a, b, x).unwrap_or(f64::NAN)
}

/// Returns the `x >= 0` at which a falling function `tail` has the value `wanted`; NaN if `tail` is
/// NaN.
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

    use super::fisher;
    use stretch_metrics::student_t::critical;
    use testkit::{tolerance::FIT_QUANTILE, vectors::columns};

    #[test]
    fn quantiles_agree_with_sixty_digits() {
        let table = columns("fit/quantiles.csv");
        for (row, expected) in table["t"].iter().enumerate() {
            let [level, terms, dof] = ["level", "terms", "dof"].map(|name| table[name][row]);
            let near = |a: f64, b| relative_eq!(a, b, epsilon = 0.0, max_relative = FIT_QUANTILE);
            let t = critical(1.0 - level, dof);
            assert!(near(t, *expected), "t at {level} of {dof}: {t:?}");
            let f = fisher(level, terms as u64, dof as u64);
            assert!(near(f, table["f"][row]), "F at {level} of {terms}, {dof}: {f:?}");
        }
    }

    #[test]
    fn extreme_levels_and_counts_stay_finite() {
        for level in [1e-300, 1e-9, 0.5, 1.0 - 1e-15] {
            for dof in [1, 2, 999, 1000, u64::MAX] {
                let t = critical(1.0 - level, dof as f64);
                assert!(t.is_finite(), "t at {level:e} of {dof}");
                let f = fisher(level, 21, dof);
                assert!(f.is_finite() && f >= 0.0, "F at {level:e} of {dof}: {f}");
            }
        }
    }
}

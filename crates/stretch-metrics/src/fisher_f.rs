//! Critical values of Fisher's F distribution.
//!
//! P(F >= f) = I_x(n/2, p/2) with x = n / (n + p f), for p and n degrees of freedom.

use crate::beta::{ln_beta, root, tail_at};

/// Returns the f with P(F >= f) = `p`, for `terms` and `dof` degrees of freedom; NaN if `p` is outside 0..=1 or a number of
/// degrees of freedom is 0, infinite if `p` is 0.
///
/// ```
/// use stretch_metrics::fisher_f::critical;
/// // With one term, F is the square of Student's t.
/// let t = stretch_metrics::student_t::critical(0.05, 7.0);
/// approx::assert_relative_eq!(critical(0.05, 1, 7), t * t, max_relative = 1e-12);
/// ```
pub fn critical(p: f64, terms: u16, dof: u64) -> f64 {
    if !(0.0..=1.0).contains(&p) || terms == 0 || dof == 0 {
        return f64::NAN;
    }
    let (numerator, denominator) = (f64::from(terms), dof as f64);
    let (a, b, ln_beta) = (0.5 * denominator, 0.5 * numerator, ln_beta(0.5 * denominator, terms));
    let per_root = libm::sqrt(numerator / denominator);
    root(|f| tail_at(libm::sqrt(f) * per_root, a, b, ln_beta).ln(), libm::log(p))
}

//! Quantiles of Student's t and of Fisher's F.

use statrs::distribution::{ContinuousCDF, FisherSnedecor, StudentsT};
use statrs::function::erf::erfc_inv;

/// From here on the expansion around the normal quantile is exact to `f64`.
const MANY: u64 = 1000;

/// The quantile `t` with `P(|x| <= t) = level` for Student's t of `dof`.
///
/// Beyond [`MANY`] degrees of freedom by the expansion of Abramowitz and
/// Stegun 26.7.5, whose next term is of order `dof^-5`.
pub(crate) fn student_two_sided(level: f64, dof: u64) -> f64 {
    let dof_f = dof as f64;
    if dof < MANY {
        return match StudentsT::new(0.0, 1.0, dof_f) {
            Ok(t) => t.inverse_cdf(0.5 + 0.5 * level),
            Err(_) => f64::NAN,
        };
    }
    let z = normal_two_sided(level);
    let z2 = z * z;
    let g1 = (z2 + 1.0) * z / 4.0;
    let g2 = ((5.0 * z2 + 16.0) * z2 + 3.0) * z / 96.0;
    let g3 = (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) * z / 384.0;
    let g4 = ((((79.0 * z2 + 776.0) * z2 + 1482.0) * z2 - 1920.0) * z2 - 945.0) * z / 92160.0;
    z + (g1 + (g2 + (g3 + g4 / dof_f) / dof_f) / dof_f) / dof_f
}

/// The quantile `z` with `P(|x| <= z) = level` for the normal distribution.
fn normal_two_sided(level: f64) -> f64 {
    core::f64::consts::SQRT_2 * erfc_inv(1.0 - level)
}

/// The quantile at `level` of Fisher's F of `terms` and `dof`.
pub(crate) fn fisher(level: f64, terms: u64, dof: u64) -> f64 {
    match FisherSnedecor::new(terms as f64, dof as f64) {
        Ok(f) => f.inverse_cdf(level),
        Err(_) => f64::NAN,
    }
}

//! The static law of the muscle, solved once and tabulated.

use crate::params::{Key, RigParams};

/// Number of intervals per reference pressure.
const DENSITY: usize = 128;
/// Largest number of reference pressures in the table.
const MOST: f64 = 16.0;

/// Static contraction of the muscle without a load, as a function of the gauge pressure p. The contraction is k_s =
/// k_max x, and x solves p/P_ref = a0 (1 - exp(-a1 x)) exp(a3 x^2); for p <= 0, x is 0.
///
/// The inverse is tabulated by piecewise cubics; see the crate's tests for its error. Contraction
/// is constant beyond 1.5 times the supply's or the reference pressure.
#[derive(Debug, Clone)]
pub struct StaticLaw {
    per_kpa: f64,
    cubics: Vec<[f64; 4]>,
    last: f64,
}

impl StaticLaw {
    /// Solves the law for a rig.
    pub fn new(params: &RigParams) -> Self {
        let k_max = params[Key::KMax];
        let law = |x: f64| relative_pressure(params, x);
        let h = 1.0 / DENSITY as f64;
        let span = (1.5 * (params[Key::PS] / params[Key::PRef]).max(1.0)).clamp(1.0, MOST);
        let count = (span * DENSITY as f64).ceil() as usize;
        let (mut x, mut slope) = (0.0, 1.0 / law(0.0).1);
        let mut cubics = Vec::with_capacity(count);
        for i in 0..count {
            let goal = (i + 1) as f64 * h;
            let mut next = x + slope * h;
            let mut rise = 1.0;
            for _ in 0..40 {
                let (u, du) = law(next);
                rise = du;
                let change = (goal - u) / du;
                next += change;
                if change.abs() <= 1e-9 * (1.0 + next) {
                    // Newton's method squares the relative error, so the next change would be below rounding.
                    rise = law(next).1;
                    break;
                }
            }
            let next_slope = 1.0 / rise;
            let (d0, d1, rise) = (slope * h, next_slope * h, next - x);
            cubics
                .push([x, d0, 3.0 * rise - 2.0 * d0 - d1, d0 + d1 - 2.0 * rise].map(|c| k_max * c));
            (x, slope) = (next, next_slope);
        }
        Self { per_kpa: 1e3 * DENSITY as f64 / params[Key::PRef], last: k_max * x, cubics }
    }

    /// Static contraction at a gauge pressure in kPa.
    #[inline]
    pub fn contraction(&self, pressure_kpa: f64) -> f64 {
        let u = pressure_kpa * self.per_kpa;
        if u.is_nan() || u <= 0.0 {
            return 0.0;
        }
        match self.cubics.get(u as usize) {
            Some([a, b, c, d]) => {
                let t = u - (u as usize) as f64;
                a + t * (b + t * (c + t * d))
            }
            None => self.last,
        }
    }
}

/// Pressure, relative to the reference pressure, at the relative contraction x, and its slope.
fn relative_pressure(params: &RigParams, x: f64) -> (f64, f64) {
    let [a0, a1, a3] = [params[Key::A0], params[Key::A1], params[Key::A3]];
    let gone = libm::exp(-a1 * x);
    let stiff = a0 * libm::exp(a3 * x * x);
    let u = stiff * (1.0 - gone);
    (u, stiff * a1 * gone + 2.0 * a3 * x * u)
}

/// Gauge pressure, kPa, at which a muscle without a load rests at a length, mm: the inverse of [`StaticLaw`]. It is 0 for
/// a muscle that is longer than at rest.
///
/// ```
/// use stretch_sim::{Key, RigParams, StaticLaw, static_kpa};
/// let params = RigParams::default();
/// let length_mm = params[Key::L0] * (1.0 - StaticLaw::new(&params).contraction(400.0));
/// approx::assert_abs_diff_eq!(static_kpa(&params, length_mm), 400.0, epsilon = 1e-3);
/// assert_eq!(static_kpa(&params, params[Key::L0] + 1.0), 0.0);
/// ```
pub fn static_kpa(params: &RigParams, length_mm: f64) -> f64 {
    let x = (1.0 - length_mm / params[Key::L0]) / params[Key::KMax];
    (1e-3 * params[Key::PRef] * relative_pressure(params, x).0).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverts_the_law() {
        let params = RigParams::default();
        let law = StaticLaw::new(&params);
        let mut worst: f64 = 0.0;
        for i in 0..4000 {
            let x = i as f64 * 3e-4;
            let u = params[Key::A0]
                * (1.0 - (-params[Key::A1] * x).exp())
                * (params[Key::A3] * x * x).exp();
            worst = worst.max((law.contraction(620.0 * u) / params[Key::KMax] - x).abs());
        }
        assert!(worst < testkit::tolerance::STATIC_LAW, "{worst:e}");
        assert_eq!(law.contraction(-3.0), 0.0);
        assert_eq!(law.contraction(f64::NAN), 0.0);
        assert!(law.contraction(1e9).is_finite());
        let full = law.contraction(620.0) / params[Key::KMax];
        approx::assert_abs_diff_eq!(full, 1.0176, epsilon = testkit::tolerance::K_MAX_DIGITS);
    }
}

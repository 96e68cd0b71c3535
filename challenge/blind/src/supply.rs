//! A drawn supply that sags under load: how much a load lowers it, and how it recovers.

use crate::curve::{Curve, weights};
use crate::family::Family;
use crate::laws::{rising, sign};
use crate::random::RandomGenerator;

/// Flow at which the sag is scaled, kg/s.
const Q_REF: f64 = 6e-4;

/// Pressure missing behind the regulator.
#[derive(Debug, Clone)]
pub(crate) struct Sag {
    /// Sag at rest under the reference flow, Pa.
    scale: f64,
    /// Sag over flow; table over 0 .. 2 of the reference flow.
    load: Curve,
    /// Share, time constants falling and recovering in s, state in Pa.
    parts: Vec<(f64, f64, f64, f64)>,
    /// Power of the sag that drives the recovery.
    power: f64,
}

impl Sag {
    /// A sag of `strength` Pa s/kg at the reference flow.
    pub(crate) fn draw(family: Family, strength: f64, random: &mut RandomGenerator) -> Self {
        let tau = random.log_between(0.25, 0.9);
        let mut load = Curve::table(|x| 2.0 * x);
        let mut parts = vec![(1.0, tau, tau, 0.0)];
        let mut power = 1.0;
        match family {
            Family::Written => {}
            Family::Splines => {
                load = rising(family, random);
                // 1 at the reference flow, the middle of the table.
                let middle = load.at(0.5);
                load = load.times(1.0 / middle);
            }
            Family::Spectra => {
                let count = 2 + random.below(2);
                let shares = weights(count, 0.6, random);
                let part = |w| {
                    let tau = random.log_between(0.08, 3.0);
                    (w, tau, tau, 0.0)
                };
                parts = shares.into_iter().map(part).collect();
            }
            Family::RateLaws => power = random.log_between(0.5, 2.0),
            Family::Asymmetric => {
                let ratio = random.log_between(1.5, 4.0).powf(sign(random)).sqrt();
                parts = vec![(1.0, tau / ratio, tau * ratio, 0.0)];
            }
        }
        Self { scale: strength * Q_REF, load, parts, power }
    }

    /// No load for long.
    pub(crate) fn reset(&mut self) {
        self.parts.iter_mut().for_each(|part| part.3 = 0.0);
    }

    /// Pressure missing after `h` s of a flow in kg/s, Pa.
    pub(crate) fn push(&mut self, flow: f64, h: f64) -> f64 {
        let drawn = self.scale * self.load.at(flow / (2.0 * Q_REF));
        let mut sum = 0.0;
        for (share, falling, recovering, at) in &mut self.parts {
            let back = if self.power == 1.0 {
                *at
            } else {
                // The root is straight below a thousandth: its slope there would be infinite.
                let x = *at / self.scale;
                self.scale * x * (x.abs() + 1e-3).powf(self.power - 1.0)
            };
            let tau = if drawn > *at { *falling } else { *recovering };
            *at += (drawn - back) * h / (tau + 0.5 * h);
            sum += *share * *at;
        }
        sum.max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::abs_diff_eq;
    use testkit::tolerance::BLIND_DRAWN;

    #[test]
    fn a_steady_load_draws_down_what_the_strength_says_and_it_comes_back() {
        let mut random = RandomGenerator::new(9, 4);
        for family in Family::ALL {
            for _ in 0..20 {
                let mut sag = Sag::draw(family, 1e8, &mut random);
                let drawn = (0..40_000).map(|_| sag.push(Q_REF, 1e-3)).last().expect("steps");
                let settled = abs_diff_eq!(drawn, 6e4, epsilon = BLIND_DRAWN * 6e4);
                assert!(settled, "{family} {drawn}");
                let left = (0..60_000).map(|_| sag.push(0.0, 1e-3)).last().expect("steps");
                assert!(left < 0.08 * drawn, "{family} {left}");
            }
        }
    }
}

//! Relaxation: a few time constants; drawn as spectra of them, rates that depend on how far there is to go, and
//! ones that differ by direction.

use crate::curve::{Wiggle, weights};
use crate::effect::Cause;
use crate::family::Family;
use crate::laws::sign;
use crate::random::RandomGenerator;

/// One lag: its share, its time constants rising and falling in s, its state.
#[derive(Debug, Clone, Copy)]
struct Part {
    share: f64,
    rising_s: f64,
    falling_s: f64,
    at: f64,
}

impl Part {
    fn even(share: f64, tau_s: f64) -> Self {
        Self { share, rising_s: tau_s, falling_s: tau_s, at: 0.0 }
    }
}

/// Weighted sum of lags; shares sum to 1.
#[derive(Debug, Clone)]
pub(crate) struct Relaxation {
    parts: Vec<Part>,
    /// Distance at which a lag runs twice as fast, and the power of that; 0 where it never does.
    hurry: (f64, f64),
    settled: bool,
}

impl Relaxation {
    /// The lags of a cause around `tau` s; `scale` is the span of the input.
    pub(crate) fn of(cause: &Cause, tau: f64, scale: f64) -> Self {
        match cause.is_drawn() {
            true => Self::draw(cause.family, tau, scale, &mut cause.random(3)),
            false => Self::written(cause.form, tau),
        }
    }

    /// Form 0: two time constants around `tau` s; else four, spread as a power law would be.
    fn written(form: usize, tau: f64) -> Self {
        let shape: &[(f64, f64)] = match form {
            0 => &[(0.55, 0.45), (2.2, 0.55)],
            _ => &[(0.25, 0.28), (0.7, 0.26), (1.8, 0.24), (5.0, 0.22)],
        };
        let part = |&(scale, share): &(f64, f64)| Part::even(share, tau * scale);
        Self { parts: shape.iter().map(part).collect(), hurry: (0.0, 1.0), settled: false }
    }

    /// Lags of a family around `tau` s; `scale` is the span of the input.
    pub(crate) fn draw(family: Family, tau: f64, scale: f64, random: &mut RandomGenerator) -> Self {
        let mut hurry = (0.0, 1.0);
        let even = |parts: Vec<(f64, f64)>| -> Vec<Part> {
            let total: f64 = parts.iter().map(|p| p.1).sum();
            parts.iter().map(|&(s, w)| Part::even(w / total, tau * s)).collect()
        };
        let mut parts = match family {
            Family::Written => even(vec![(1.0, 1.0)]),
            // A continuous spectrum whose logarithm is a random spline over 1.6 decades.
            Family::Splines => {
                let density = Wiggle::draw(4, 0.8, random);
                let at = |i: i32| f64::from(i) / 6.0;
                even(
                    (0..7)
                        .map(|i| (10f64.powf(1.6 * at(i) - 0.8), density.at(at(i)).exp()))
                        .collect(),
                )
            }
            // A few of them anywhere in two decades, or a power law.
            Family::Spectra if random.unit() < 0.5 => {
                let count = 2 + random.below(4);
                let shares = weights(count, 0.8, random);
                even(shares.into_iter().map(|w| (random.log_between(0.12, 8.0), w)).collect())
            }
            Family::Spectra => {
                let power = random.between(-0.5, 0.5);
                let scale = |i: i32| 10f64.powf(0.5 * f64::from(i) - 1.0);
                even((0..5).map(|i| (scale(i), scale(i).powf(power))).collect())
            }
            Family::RateLaws => {
                hurry = (scale * random.log_between(0.02, 0.2), random.between(0.5, 2.0));
                let second = random.log_between(1.0, 4.0);
                let share = random.between(0.4, 1.0);
                even(vec![(1.5, share), (1.5 * second, 1.0 - share)])
            }
            Family::Asymmetric => {
                let apart = random.log_between(1.0, 3.0);
                even(vec![(1.0 / apart, 0.5), (apart, 0.5)])
            }
        };
        if family == Family::Asymmetric {
            let ratio = random.log_between(1.4, 2.6).powf(sign(random)).sqrt();
            for part in &mut parts {
                part.rising_s *= ratio;
                part.falling_s /= ratio;
            }
        }
        Self { parts, hurry, settled: false }
    }

    /// Advances by `h` seconds at input `x` (starts settled); gives the lagged value.
    pub(crate) fn push(&mut self, x: f64, h: f64) -> f64 {
        if !self.settled {
            self.parts.iter_mut().for_each(|part| part.at = x);
            self.settled = true;
        }
        let (scale, power) = self.hurry;
        self.parts
            .iter_mut()
            .map(|part| {
                let way = x - part.at;
                let tau = if way > 0.0 { part.rising_s } else { part.falling_s };
                let faster = if scale > 0.0 { 1.0 + (way.abs() / scale).powf(power) } else { 1.0 };
                part.at += way * (h * faster / (tau + 0.5 * h * faster)).min(1.0);
                part.share * part.at
            })
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{abs_diff_eq, assert_relative_eq};
    use testkit::tolerance::{BLIND_RELAXED, BLIND_SETTLED};

    #[test]
    fn lags_settle_at_their_input() {
        for form in 0..2 {
            let mut lags = Relaxation::written(form, 0.1);
            assert_eq!(lags.push(0.0, 1e-3), 0.0);
            let mut last = 0.0;
            for _ in 0..20_000 {
                last = lags.push(1.0, 1e-3);
            }
            assert_relative_eq!(last, 1.0, epsilon = 0.0, max_relative = BLIND_SETTLED);
        }
    }

    #[test]
    fn lags_stay_between_and_settle_at_their_input() {
        let mut random = RandomGenerator::new(9, 2);
        for family in Family::ALL {
            for _ in 0..40 {
                let mut lags = Relaxation::draw(family, 0.1, 1.0, &mut random);
                assert_eq!(lags.push(0.0, 1e-3), 0.0);
                let mut last = 0.0;
                for _ in 0..20_000 {
                    let next = lags.push(1.0, 1e-3);
                    assert!(next >= last - 1e-12 && next <= 1.0 + 1e-9, "{family}");
                    last = next;
                }
                // The slowest part is eight to ten times 0.1 s: exp(-20) is left.
                assert!(abs_diff_eq!(last, 1.0, epsilon = BLIND_RELAXED), "{family} {last}");
            }
        }
    }
}

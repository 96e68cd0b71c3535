//! Lags: relaxation and low-pass filters. The hand-written forms have a few time constants. The drawn forms have
//! spectra of time constants, kernels of any shape, rates that depend on the distance from the target, or rates that
//! depend on the direction.

use crate::curve::{Wiggle, weights};
use crate::effect::{Cause, Family};
use crate::laws::sign;
use crate::random::RandomGenerator;

/// One first-order lag: its share of the sum, its time constants while rising and while falling
/// (s), and its state.
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

/// Weighted sum of lags in parallel or in series; the shares sum to 1.
#[derive(Debug, Clone)]
pub(crate) struct Lags {
    parts: Vec<Part>,
    in_a_row: bool,
    /// Whether the lags are exact for an input that is constant over a step.
    is_exact: bool,
    /// Distance from the target at which a lag is twice as fast, and the exponent of this
    /// dependence. A distance of 0 means that the rate is constant.
    hurry: (f64, f64),
    settled: bool,
    /// Dead time after the lags, s, and the past values that it needs.
    dead_s: f64,
    late: Vec<f64>,
}

impl Lags {
    /// Creates lags from pairs of a time constant (s) and a share.
    fn new(parts: impl IntoIterator<Item = (f64, f64)>, in_a_row: bool) -> Self {
        let parts = parts.into_iter().map(|(tau_s, share)| Part::even(share, tau_s)).collect();
        let (hurry, dead_s) = ((0.0, 1.0), 0.0);
        Self { parts, in_a_row, is_exact: false, hurry, settled: false, dead_s, late: Vec::new() }
    }

    /// Returns the relaxation of a cause with time constants around `tau` s; `scale` is the span of
    /// the input.
    pub(crate) fn relaxation(cause: &Cause, tau: f64, scale: f64) -> Self {
        match cause.is_drawn() {
            true => Self::draw_relaxation(cause.family, tau, scale, &mut cause.random(3)),
            false => Self::written_relaxation(cause.form, tau),
        }
    }

    /// Returns a hand-written form: 0 has two time constants around `tau` s, any other has four,
    /// which approximate a power law.
    fn written_relaxation(form: usize, tau: f64) -> Self {
        let shape: &[(f64, f64)] = match form {
            0 => &[(0.55, 0.45), (2.2, 0.55)],
            _ => &[(0.25, 0.28), (0.7, 0.26), (1.8, 0.24), (5.0, 0.22)],
        };
        Self::new(shape.iter().map(|(scale, share)| (tau * scale, *share)), false)
    }

    /// Draws lags of a family with time constants around `tau` s; `scale` is the span of the input.
    fn draw_relaxation(family: Family, tau: f64, scale: f64, random: &mut RandomGenerator) -> Self {
        let mut hurry = (0.0, 1.0);
        let raw: Vec<(f64, f64)> = match family {
            Family::Written => vec![(1.0, 1.0)],
            // A continuous spectrum whose logarithm is a random spline over 1.6 decades.
            Family::Splines => {
                let density = Wiggle::draw(4, 0.8, random);
                let at = |i: i32| f64::from(i) / 6.0;
                (0..7).map(|i| (10f64.powf(1.6 * at(i) - 0.8), density.at(at(i)).exp())).collect()
            }
            // Two to five time constants anywhere in two decades, or (below) a power law.
            Family::Spectra if random.unit() < 0.5 => {
                let count = 2 + random.below(4);
                let shares = weights(count, 0.8, random);
                shares.into_iter().map(|w| (random.log_between(0.12, 8.0), w)).collect()
            }
            Family::Spectra => {
                let power = random.between(-0.5, 0.5);
                let scale = |i: i32| 10f64.powf(0.5 * f64::from(i) - 1.0);
                (0..5).map(|i| (scale(i), scale(i).powf(power))).collect()
            }
            Family::RateLaws => {
                hurry = (scale * random.log_between(0.02, 0.2), random.between(0.5, 2.0));
                let second = random.log_between(1.0, 4.0);
                let share = random.between(0.4, 1.0);
                vec![(1.5, share), (1.5 * second, 1.0 - share)]
            }
            Family::Asymmetric => {
                let apart = random.log_between(1.0, 3.0);
                vec![(1.0 / apart, 0.5), (apart, 0.5)]
            }
        };
        let total: f64 = raw.iter().map(|p| p.1).sum();
        let mut lags = Self::new(raw.iter().map(|(s, w)| (tau * s, w / total)), false);
        lags.hurry = hurry;
        if family == Family::Asymmetric {
            let ratio = random.log_between(1.4, 2.6).powf(sign(random)).sqrt();
            for part in &mut lags.parts {
                part.rising_s *= ratio;
                part.falling_s /= ratio;
            }
        }
        lags
    }

    /// Returns the low pass of a cause. The strength is its mean delay, s.
    pub(crate) fn low_pass(cause: &Cause) -> Self {
        let tau = cause.strength;
        if cause.is_drawn() {
            return Self::draw_low_pass(cause.family, tau, &mut cause.random(1));
        }
        let (parts, dead_s): (&[_], _) = match cause.form {
            0 => (&[(0.7 * tau, 0.0), (0.3 * tau, 1.0)], 0.0),
            _ => (&[(0.85 * tau, 1.0)], 0.15 * tau),
        };
        Self { is_exact: true, dead_s, ..Self::new(parts.iter().copied(), true) }
    }

    /// Draws a low pass whose mean delay is `delay` s.
    fn draw_low_pass(family: Family, delay: f64, random: &mut RandomGenerator) -> Self {
        let mut lags = match family {
            Family::Written => Self::new([(1.0, 1.0)], true),
            // The kernel of four equal poles in series, whose outputs are summed with separate
            // weights.
            Family::Splines => {
                Self::new(weights(4, 0.8, random).into_iter().map(|w| (1.0, w)), true)
            }
            // Two to five poles in parallel, spread over more than a decade.
            Family::Spectra => {
                let count = 2 + random.below(4);
                let poles: Vec<f64> = (0..count).map(|_| random.log_between(0.25, 4.0)).collect();
                Self::new(poles.into_iter().zip(weights(count, 0.6, random)), false)
            }
            // Two to four poles in series, whose time constants have random ratios.
            Family::RateLaws => {
                let order = 2 + random.below(3);
                let poles = weights(order, 0.8, random).into_iter().enumerate();
                Self::new(poles.map(|(i, p)| (p, f64::from(i + 1 == order))), true)
            }
            // The rise is slower than the fall, or faster.
            Family::Asymmetric => {
                let mut one = Self::new([(1.0, 1.0)], true);
                let ratio = random.log_between(1.2, 1.8).powf(sign(random)).sqrt();
                (one.parts[0].rising_s, one.parts[0].falling_s) = (ratio, 1.0 / ratio);
                one
            }
        };
        let mut sum = 0.0;
        let delays = lags.parts.iter().map(|part| {
            let own = 0.5 * (part.rising_s + part.falling_s);
            sum = if lags.in_a_row { sum + own } else { own };
            part.share * sum
        });
        let scale = delay / delays.sum::<f64>();
        for part in &mut lags.parts {
            part.rising_s *= scale;
            part.falling_s *= scale;
        }
        lags
    }

    /// Clears the state: the lags start settled at the next input.
    pub(crate) fn reset(&mut self) {
        self.settled = false;
        self.late.clear();
    }

    /// Advances by `h` seconds at the input `x` and returns the lagged value. The lags start
    /// settled.
    pub(crate) fn push(&mut self, x: f64, h: f64) -> f64 {
        if !self.settled {
            self.parts.iter_mut().for_each(|part| part.at = x);
            self.settled = true;
        }
        let (scale, power) = self.hurry;
        let (mut input, mut sum) = (x, 0.0);
        for part in &mut self.parts {
            let way = input - part.at;
            let tau = if way > 0.0 { part.rising_s } else { part.falling_s };
            let faster = if scale > 0.0 { 1.0 + (way.abs() / scale).powf(power) } else { 1.0 };
            part.at += way
                * match self.is_exact {
                    true => 1.0 - (-h / tau).exp(),
                    false => (h * faster / (tau + 0.5 * h * faster)).min(1.0),
                };
            sum += part.share * part.at;
            if self.in_a_row {
                input = part.at;
            }
        }
        if self.dead_s == 0.0 {
            return sum;
        }
        // Returns the value one dead time ago, by linear interpolation; before that time, the first
        // value.
        self.late.push(sum);
        let last = self.late.len() - 1;
        let at = (last as f64 - self.dead_s / h).max(0.0);
        let low = at as usize;
        let (early, next) = (self.late[low], self.late[(low + 1).min(last)]);
        early + (next - early) * (at - low as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{abs_diff_eq, assert_relative_eq};
    use testkit::tolerance::{
        BLIND_DELAY_S, BLIND_NO_FILTER, BLIND_RELAXED, BLIND_SETTLED, BLIND_UNEVEN_S,
    };

    #[test]
    fn lags_settle_at_their_input() {
        for form in 0..2 {
            let mut lags = Lags::written_relaxation(form, 0.1);
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
                let mut lags = Lags::draw_relaxation(family, 0.1, 1.0, &mut random);
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

    #[test]
    fn the_mean_delay_is_the_one_asked_for_and_none_is_no_filter() {
        let mut random = RandomGenerator::new(9, 3);
        for family in Family::ALL {
            for _ in 0..20 {
                let mut filter = Lags::draw_low_pass(family, 0.05, &mut random);
                filter.push(0.0, 1e-4);
                // The delay is the integral of 1 minus the step response. Lags that depend on the
                // direction rise with the time constant for rising.
                let delay: f64 = (0..40_000).map(|_| (1.0 - filter.push(1.0, 1e-4)) * 1e-4).sum();
                let uneven =
                    if family == Family::Asymmetric { BLIND_UNEVEN_S } else { BLIND_DELAY_S };
                assert!(abs_diff_eq!(delay, 0.05, epsilon = uneven), "{family} {delay}");
                let mut none = Lags::draw_low_pass(family, 1e-9, &mut random);
                none.push(0.0, 1e-3);
                let passed = none.push(1.0, 1e-3);
                assert!(abs_diff_eq!(passed, 1.0, epsilon = BLIND_NO_FILTER), "{family}");
            }
        }
    }
}

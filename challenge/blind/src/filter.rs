//! Drawn low-pass filters: of any order, with a kernel of any shape, of spread poles, or uneven.

use crate::curve::weights;
use crate::family::Family;
use crate::laws::sign;
use crate::random::RandomGenerator;

/// First-order lags in series or in parallel, and the weight of each.
#[derive(Debug, Clone)]
pub(crate) struct LowPass {
    /// Time constants rising and falling, s.
    poles: Vec<(f64, f64)>,
    taps: Vec<f64>,
    in_a_row: bool,
    at: Option<Vec<f64>>,
}

impl LowPass {
    /// A filter whose mean delay is `delay` s.
    pub(crate) fn draw(family: Family, delay: f64, random: &mut RandomGenerator) -> Self {
        let mut filter = match family {
            Family::Written => Self::of(vec![1.0], vec![1.0], true),
            // The kernel of four equal poles in series, whose outputs are summed with separate
            // weights.
            Family::Splines => Self::of(vec![1.0; 4], weights(4, 0.8, random), true),
            // Poles side by side over more than a decade.
            Family::Spectra => {
                let count = 2 + random.below(4);
                let poles = (0..count).map(|_| random.log_between(0.25, 4.0)).collect();
                Self::of(poles, weights(count, 0.6, random), false)
            }
            // Two to four poles in a row, shared out at random.
            Family::RateLaws => {
                let order = 2 + random.below(3);
                let mut taps = vec![0.0; order];
                taps[order - 1] = 1.0;
                Self::of(weights(order, 0.8, random), taps, true)
            }
            // Rises slower than it falls, or the other way round.
            Family::Asymmetric => {
                let mut one = Self::of(vec![1.0], vec![1.0], true);
                let ratio = random.log_between(1.2, 1.8).powf(sign(random)).sqrt();
                one.poles[0] = (ratio, 1.0 / ratio);
                one
            }
        };
        let scale = delay / filter.mean_delay();
        filter.poles.iter_mut().for_each(|p| *p = (p.0 * scale, p.1 * scale));
        filter
    }

    fn of(poles: Vec<f64>, taps: Vec<f64>, in_a_row: bool) -> Self {
        Self { poles: poles.into_iter().map(|p| (p, p)).collect(), taps, in_a_row, at: None }
    }

    fn mean_delay(&self) -> f64 {
        let mut sum = 0.0;
        let parts = self.poles.iter().zip(&self.taps).map(|((up, down), tap)| {
            let own = 0.5 * (up + down);
            sum = if self.in_a_row { sum + own } else { own };
            tap * sum
        });
        parts.sum()
    }

    /// Forgets what it heard.
    pub(crate) fn reset(&mut self) {
        self.at = None;
    }

    /// Feeds the next value, `h` s after the last (the first one settles it).
    pub(crate) fn push(&mut self, v: f64, h: f64) -> f64 {
        let at = self.at.get_or_insert_with(|| vec![v; self.poles.len()]);
        let mut input = v;
        let mut heard = 0.0;
        for ((z, (rising, falling)), tap) in at.iter_mut().zip(&self.poles).zip(&self.taps) {
            let tau = if input > *z { rising } else { falling };
            *z += (input - *z) * (h / (tau + 0.5 * h)).min(1.0);
            heard += tap * *z;
            if self.in_a_row {
                input = *z;
            }
        }
        heard
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::abs_diff_eq;
    use testkit::tolerance::{BLIND_DELAY_S, BLIND_NO_FILTER, BLIND_UNEVEN_S};

    #[test]
    fn the_mean_delay_is_the_one_asked_for_and_none_is_no_filter() {
        let mut random = RandomGenerator::new(9, 3);
        for family in Family::ALL {
            for _ in 0..20 {
                let mut filter = LowPass::draw(family, 0.05, &mut random);
                filter.push(0.0, 1e-4);
                // Integral of 1 - step response; uneven ones rise with their own constant.
                let delay: f64 = (0..40_000).map(|_| (1.0 - filter.push(1.0, 1e-4)) * 1e-4).sum();
                let uneven =
                    if family == Family::Asymmetric { BLIND_UNEVEN_S } else { BLIND_DELAY_S };
                assert!(abs_diff_eq!(delay, 0.05, epsilon = uneven), "{family} {delay}");
                let mut none = LowPass::draw(family, 1e-9, &mut random);
                none.push(0.0, 1e-3);
                let passed = none.push(1.0, 1e-3);
                assert!(abs_diff_eq!(passed, 1.0, epsilon = BLIND_NO_FILTER), "{family}");
            }
        }
    }
}

//! Memories in other forms: friction loops by Dahl, Bouc and Wen, and slip elements of spread
//! strength; relaxation by several time constants. Drawn ones are passed on to.

use crate::effect::Cause;
use crate::friction::Friction;
use crate::relaxation::Relaxation;

/// How a friction loop turns at a reversal.
#[derive(Debug, Clone)]
enum Law {
    /// Drawn from a family.
    Drawn(Friction),
    /// dz = dx (1 - sgn(dx) z / r)^n (Dahl 1968).
    Dahl { exponent: f64 },
    /// dz = dx (1 - (g + (1 - g) sgn(dx z)) |z / r|^n) (Wen 1976).
    BoucWen { exponent: f64, share: f64 },
    /// Sum of slip elements; each element's share and reach, in units of the loop's.
    Slip { reach: [f64; 6], state: [f64; 6] },
}

/// A rate-independent loop: follows a change at first with slope 1, then stays at its reach.
#[derive(Debug, Clone)]
pub(crate) struct Loop {
    law: Law,
    reach: f64,
    z: f64,
    last: Option<f64>,
}

impl Loop {
    /// Form 0 is Dahl's, 1 Bouc's and Wen's, else slip elements; `reach` is where it saturates.
    /// `spread` in 0..1 sets what the form leaves open; `sharp` loops turn within their reach.
    pub(crate) fn new(form: usize, reach: f64, spread: f64, sharp: bool) -> Self {
        let law = match form {
            0 if sharp => Law::Dahl { exponent: 0.35 + 0.3 * spread },
            0 => Law::Dahl { exponent: 0.9 + 0.5 * spread },
            1 if sharp => Law::BoucWen { exponent: 2.5 + 2.0 * spread, share: 0.65 },
            1 => Law::BoucWen { exponent: 1.2 + 0.6 * spread, share: 0.6 },
            _ => {
                let width = if sharp { 0.25 } else { 1.1 + 0.4 * spread };
                // Quantiles of a log-uniform spread, scaled so that they sum to six reaches.
                let raw: [f64; 6] =
                    std::array::from_fn(|i| (width * (2.0 * (i as f64 + 0.5) / 6.0 - 1.0)).exp());
                let mean = raw.iter().sum::<f64>() / 6.0;
                Law::Slip { reach: raw.map(|r| r / mean), state: [0.0; 6] }
            }
        };
        Self { law, reach, z: 0.0, last: None }
    }

    /// The loop of a cause.
    pub(crate) fn of(cause: &Cause, reach: f64, sharp: bool) -> Self {
        if !cause.is_drawn() {
            return Self::new(cause.form, reach, cause.aux[1], sharp);
        }
        let law = Law::Drawn(Friction::draw(cause.family, reach, sharp, &mut cause.random(2)));
        Self { law, reach, z: 0.0, last: None }
    }

    /// Feeds the next value of the driving quantity, `h` seconds after the last; gives z, at most
    /// the reach in size.
    pub(crate) fn push(&mut self, x: f64, h: f64) -> f64 {
        if let Law::Drawn(friction) = &mut self.law {
            return friction.push(x, h);
        }
        let dx = x - self.last.replace(x).unwrap_or(x);
        if dx == 0.0 || self.reach <= 0.0 {
            return self.z;
        }
        let direction = dx.signum();
        if let Law::Slip { reach, state } = &mut self.law {
            let mut sum = 0.0;
            for (s, r) in state.iter_mut().zip(reach) {
                let limit = *r * self.reach;
                *s = (*s + dx).clamp(-limit, limit);
                sum += *s;
            }
            self.z = sum / 6.0;
            return self.z;
        }
        let pieces = (dx.abs() / (0.05 * self.reach)).ceil().clamp(1.0, 80.0);
        let step = dx / pieces;
        for _ in 0..pieces as usize {
            let ratio = self.z / self.reach;
            let slope = match self.law {
                Law::Dahl { exponent } => (1.0 - direction * ratio).max(0.0).powf(exponent),
                Law::BoucWen { exponent, share } => {
                    let turn = share + (1.0 - share) * (direction * self.z).signum();
                    1.0 - turn * ratio.abs().powf(exponent)
                }
                Law::Slip { .. } | Law::Drawn(_) => 0.0,
            };
            self.z = (self.z + step * slope).clamp(-self.reach, self.reach);
        }
        self.z
    }
}

/// Weighted sum of first-order lags.
#[derive(Debug, Clone)]
pub(crate) struct Lags {
    drawn: Option<Relaxation>,
    parts: Vec<(f64, f64, f64)>,
    settled: bool,
}

impl Lags {
    /// Form 0: two time constants around `tau`; else four, spread as a power law would be.
    pub(crate) fn new(form: usize, tau: f64) -> Self {
        let shape: &[(f64, f64)] = match form {
            0 => &[(0.55, 0.45), (2.2, 0.55)],
            _ => &[(0.25, 0.28), (0.7, 0.26), (1.8, 0.24), (5.0, 0.22)],
        };
        let parts = shape.iter().map(|&(scale, weight)| (tau * scale, weight, 0.0)).collect();
        Self { drawn: None, parts, settled: false }
    }

    /// The lags of a cause around `tau`; `scale` is the span of what is fed.
    pub(crate) fn of(cause: &Cause, tau: f64, scale: f64) -> Self {
        let drawn = cause
            .is_drawn()
            .then(|| Relaxation::draw(cause.family, tau, scale, &mut cause.random(3)));
        Self { drawn, ..Self::new(cause.form, tau) }
    }

    /// Advances by `h` seconds at input `x` (starts settled); gives the lagged value.
    pub(crate) fn push(&mut self, x: f64, h: f64) -> f64 {
        if let Some(drawn) = &mut self.drawn {
            return drawn.push(x, h);
        }
        if !self.settled {
            self.parts.iter_mut().for_each(|part| part.2 = x);
            self.settled = true;
        }
        self.parts
            .iter_mut()
            .map(|(tau, weight, z)| {
                *z += (x - *z) * (h / (*tau + 0.5 * h)).min(1.0);
                *weight * *z
            })
            .sum()
    }
}

/// max(x, floor), rounded off by a parabola of half-width `width`.
pub(crate) fn at_least(x: f64, floor: f64, width: f64) -> f64 {
    let above = x - floor;
    if above >= width {
        x
    } else if above <= -width {
        floor
    } else {
        floor + (above + width).powi(2) / (4.0 * width)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{abs_diff_eq, assert_relative_eq};
    use testkit::tolerance::{BLIND_LOOP_ELASTIC, BLIND_SETTLED, F64_ROUNDING};

    #[test]
    fn loops_start_elastic_and_saturate_at_their_reach() {
        for form in 0..3 {
            for sharp in [false, true] {
                let mut element = Loop::new(form, 0.02, 0.5, sharp);
                element.push(0.0, 1e-3);
                let early = element.push(1e-5, 1e-3);
                let elastic = abs_diff_eq!(early, 1e-5, epsilon = BLIND_LOOP_ELASTIC * 1e-5);
                assert!(elastic, "{form} {sharp} {early}");
                for i in 1..400 {
                    element.push(1e-5 + 0.001 * f64::from(i), 1e-3);
                }
                let up = element.push(0.4, 1e-3);
                assert!(up <= 0.02 + 1e-12 && up > 0.019, "{form} {sharp} {up}");
                let turned = element.push(0.4 - 0.005, 1e-3);
                assert!(turned < up, "{form}: nothing happens at a reversal");
            }
        }
    }

    #[test]
    fn lags_settle_at_their_input() {
        for form in 0..2 {
            let mut lags = Lags::new(form, 0.1);
            assert_eq!(lags.push(0.0, 1e-3), 0.0);
            let mut last = 0.0;
            for _ in 0..20_000 {
                last = lags.push(1.0, 1e-3);
            }
            assert_relative_eq!(last, 1.0, epsilon = 0.0, max_relative = BLIND_SETTLED);
        }
    }

    #[test]
    fn knee_is_the_greater_far_from_it() {
        assert_eq!(at_least(1.0, 0.0, 0.1), 1.0);
        assert_eq!(at_least(-1.0, 0.0, 0.1), 0.0);
        assert_relative_eq!(
            at_least(0.0, 0.0, 0.1),
            0.025,
            epsilon = 0.0,
            max_relative = F64_ROUNDING
        );
        assert_eq!(at_least(-0.5, 0.0, 0.0), 0.0);
    }
}

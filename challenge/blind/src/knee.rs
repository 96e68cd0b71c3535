//! Knees of any shape: functions that do not, or hardly, fall below a floor.

use crate::curve::Curve;
use crate::family::Family;
use crate::laws::rising;
use crate::random::RandomGenerator;

/// max(x, floor) whose slope goes from a small rest to 1 over a width, as a drawn law rises.
#[derive(Debug, Clone)]
pub(crate) struct Knee {
    /// Integral of the slope over -1..1 in units of the half-width (x = (u + 1) / 2).
    turn: Curve,
    /// Shift of the knee's middle with which the far line passes through the floor.
    offset: f64,
    width: f64,
    /// Slope that is left below the floor.
    rest: f64,
}

impl Knee {
    /// A knee with a half-width log-uniform between `low` and `high`.
    pub(crate) fn draw(family: Family, low: f64, high: f64, random: &mut RandomGenerator) -> Self {
        let slope = rising(family, random);
        // Twice: u runs over an interval of length 2.
        let turn = slope.integral().times(2.0);
        let offset = 1.0 - turn.at(1.0);
        let rest = match family {
            Family::RateLaws => random.between(0.0, 0.06),
            Family::Asymmetric if random.unit() < 0.5 => random.between(0.01, 0.08),
            _ => 0.0,
        };
        Self { turn, offset, width: random.log_between(low, high), rest }
    }

    /// The same knee, no wider than `most`.
    pub(crate) fn within(self, most: f64) -> Self {
        Self { width: self.width.min(most), ..self }
    }

    /// What is left of `x` over a floor.
    pub(crate) fn at_least(&self, x: f64, floor: f64) -> f64 {
        let above = x - floor;
        let u = above / self.width + self.offset;
        let kept = if u >= 1.0 {
            above
        } else if u <= -1.0 {
            0.0
        } else {
            self.width * self.turn.at(0.5 * (u + 1.0))
        };
        floor + (1.0 - self.rest) * kept + self.rest * above
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
    use approx::{assert_abs_diff_eq, assert_relative_eq};
    use testkit::tolerance::{BLIND_CURVE, F64_ROUNDING};

    #[test]
    fn knees_are_continuous_and_monotone_and_leave_what_is_far_above() {
        let mut random = RandomGenerator::new(6, 1);
        for family in Family::ALL {
            for _ in 0..40 {
                let knee = Knee::draw(family, 0.01, 0.1, &mut random);
                let mut last = knee.at_least(-1.0, 0.2);
                assert!(last >= 0.2 - 0.08 * 1.2 - 1e-12);
                for i in 1..=4000 {
                    let x = -1.0 + f64::from(i) * 5e-4;
                    let y = knee.at_least(x, 0.2);
                    // A slope between 0 and 1.
                    assert!(y >= last - 1e-12 && y <= last + 5e-4 + 1e-9, "{family} {x}");
                    last = y;
                }
                assert_abs_diff_eq!(knee.at_least(0.9, 0.2), 0.9, epsilon = BLIND_CURVE);
            }
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

//! Effects of the electrical side that a static curve does not describe: knees, clipping and
//! softening.

use crate::curve::Curve;
use crate::effect::{Cause, Family};
use crate::laws::{Law, rising, settling};
use crate::random::RandomGenerator;

/// A rounded max(x, floor): a function that falls below a floor not at all or only slightly.
#[derive(Debug, Clone)]
pub(crate) enum Knee {
    /// The corner is a parabola of this half-width.
    Parabola(f64),
    /// The slope rises from a small value (`rest`) to 1 over a width. The shape of this rise is a
    /// randomly drawn curve.
    Drawn {
        /// Integral of the slope over u from -1 to 1, in half-widths, as a table over (u + 1) / 2.
        turn: Curve,
        /// Shift of the knee's middle, in half-widths. With this shift, the line far above the knee
        /// is y = x.
        offset: f64,
        width: f64,
        /// Slope below the floor.
        rest: f64,
    },
}

impl Knee {
    /// Returns the knee in the strain of a sleeve that goes slack.
    pub(crate) fn of_slack(c: &Cause) -> Self {
        match (c.is_drawn(), c.form) {
            (true, _) => Self::draw(c.family, 0.003, 0.04, c.strength, &mut c.random(1)),
            (false, 0) => Self::Parabola(0.0),
            (false, _) => Self::Parabola(0.012_f64.min(c.strength)),
        }
    }

    /// Draws a knee whose half-width is log-uniform between `low` and `high`, and at most `most`.
    fn draw(family: Family, low: f64, high: f64, most: f64, random: &mut RandomGenerator) -> Self {
        let slope = rising(family, random);
        // The factor of 2 is the length of the interval of u.
        let turn = slope.integral().times(2.0);
        let offset = 1.0 - turn.at(1.0);
        let rest = match family {
            Family::RateLaws => random.between(0.0, 0.06),
            Family::Asymmetric if random.unit() < 0.5 => random.between(0.01, 0.08),
            _ => 0.0,
        };
        Self::Drawn { turn, offset, width: random.log_between(low, high).min(most), rest }
    }

    /// Returns the rounded max(x, floor).
    pub(crate) fn at_least(&self, x: f64, floor: f64) -> f64 {
        let above = x - floor;
        match self {
            Self::Parabola(width) if above >= *width => x,
            Self::Parabola(width) if above <= -width => floor,
            Self::Parabola(width) => floor + (above + width).powi(2) / (4.0 * width),
            Self::Drawn { turn, offset, width, rest } => {
                let u = above / width + offset;
                let kept = if u >= 1.0 {
                    above
                } else if u <= -1.0 {
                    0.0
                } else {
                    width * turn.at(0.5 * (u + 1.0))
                };
                floor + (1.0 - rest) * kept + rest * above
            }
        }
    }
}

/// An amplifier that clips at the top, the bottom, or both.
#[derive(Debug, Clone)]
pub(crate) struct Saturation {
    knee: Knee,
    /// Distance of the clipping levels from the ends of the range, at top and bottom, V; `None` if
    /// that end is not clipped.
    top: Option<f64>,
    bottom: Option<f64>,
}

impl Saturation {
    pub(crate) fn of(c: &Cause) -> Self {
        let strength = c.strength;
        if !c.is_drawn() {
            let width = if c.form == 1 { 0.05_f64.min(strength) } else { 0.0 };
            let is_low = c.form == 2;
            let (top, bottom) = ((!is_low).then_some(strength), is_low.then_some(strength));
            return Self { knee: Knee::Parabola(width), top, bottom };
        }
        let mut random = c.random(1);
        let knee = Knee::draw(c.family, 0.008, 0.15, 0.5 * strength, &mut random);
        let both = if c.family == Family::Asymmetric { 0.5 } else { 0.15 };
        let (top, bottom) = match random.unit() {
            x if x < both => (Some(strength), Some(random.between(0.3, 0.9) * strength)),
            x if x < both + 0.65 * (1.0 - both) => (Some(strength), None),
            _ => (None, Some(strength)),
        };
        Self { knee, top, bottom }
    }

    /// Clips a voltage whose nominal range is from `bottom` to `top`.
    pub(crate) fn clip(&self, volts: f64, bottom: f64, top: f64) -> f64 {
        let mut v = volts;
        if let Some(depth) = self.top {
            v = -self.knee.at_least(-v, depth - top);
        }
        if let Some(depth) = self.bottom {
            v = self.knee.at_least(v, bottom + depth);
        }
        v
    }
}

/// A gauge whose response weakens with the distance travelled.
#[derive(Debug, Clone)]
pub(crate) struct Softening {
    strength: f64,
    law: Law,
    /// Scale of the travel over which the response weakens, and the travel so far.
    turn: f64,
    travel: f64,
    /// Weight of travel while the gauge is stretched. Travel in the other direction has the weight
    /// 2 - `stretching`.
    stretching: f64,
    /// Time constant with which past travel decays, s.
    memory_s: f64,
}

impl Softening {
    pub(crate) fn of(c: &Cause) -> Self {
        let written: [fn(f64) -> f64; 2] =
            [|turns| 1.0 - (1.0 + turns / 0.8).powf(-0.8), |turns| turns / (0.6 + turns)];
        let mut softening = Self {
            strength: c.strength,
            law: Law::Written(written[c.form]),
            turn: c.log_aux(0, 0.5, 12.0),
            travel: 0.0,
            stretching: 1.0,
            memory_s: f64::INFINITY,
        };
        if c.is_drawn() {
            let mut random = c.random(1);
            softening.law = Law::Drawn(settling(c.family, &mut random));
            if c.family == Family::Asymmetric {
                softening.stretching = 2.0 * f64::from(random.unit() < 0.5);
            }
            if c.family == Family::RateLaws {
                softening.memory_s = random.log_between(500.0, 5000.0);
            }
        }
        softening
    }

    /// Begins a session: sets the travel to 0.
    pub(crate) fn begin_session(&mut self) {
        self.travel = 0.0;
    }

    /// Adds a change of strain that took `h` s. Returns the share of the response that the gauge
    /// has lost.
    pub(crate) fn push(&mut self, moved: f64, h: f64) -> f64 {
        let counts = if moved > 0.0 { self.stretching } else { 2.0 - self.stretching };
        self.travel += counts * moved.abs() - self.travel * h / self.memory_s;
        let turns = self.travel / self.turn;
        self.strength
            * match &self.law {
                Law::Drawn(law) => law.at(-(-turns).exp_m1()),
                Law::Written(law) => law(turns),
            }
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
                let knee = Knee::draw(family, 0.01, 0.1, 1.0, &mut random);
                let mut last = knee.at_least(-1.0, 0.2);
                assert!(last >= 0.2 - 0.08 * 1.2 - 1e-12);
                for i in 1..=4000 {
                    let x = -1.0 + f64::from(i) * 5e-4;
                    let y = knee.at_least(x, 0.2);
                    // The slope is between 0 and 1.
                    assert!(y >= last - 1e-12 && y <= last + 5e-4 + 1e-9, "{family} {x}");
                    last = y;
                }
                assert_abs_diff_eq!(knee.at_least(0.9, 0.2), 0.9, epsilon = BLIND_CURVE);
            }
        }
    }

    #[test]
    fn knee_is_the_greater_far_from_it() {
        assert_eq!(Knee::Parabola(0.1).at_least(1.0, 0.0), 1.0);
        assert_eq!(Knee::Parabola(0.1).at_least(-1.0, 0.0), 0.0);
        assert_relative_eq!(
            Knee::Parabola(0.1).at_least(0.0, 0.0),
            0.025,
            epsilon = 0.0,
            max_relative = F64_ROUNDING
        );
        assert_eq!(Knee::Parabola(0.0).at_least(-0.5, 0.0), 0.0);
    }
}

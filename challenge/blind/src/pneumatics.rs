//! Laws of the pneumatics: delays of the valves, dead bands of any shape, and a supply pressure that falls
//! under load.

use crate::curve::{Curve, weights};
use crate::effect::Cause;
use crate::effect::Family;
use crate::laws::{rising, sign};
use crate::random::RandomGenerator;

/// The delay between a command and the opening of a valve.
#[derive(Debug, Clone)]
pub(crate) enum Delay {
    /// The delay depends on the commanded opening: delay in units of the mean, as a function of the
    /// opening.
    Graded(Curve),
    /// The valve has several seats, each with a share of the conductance and a delay.
    Spread(Vec<(f64, f64)>),
    /// The share `dead` of the delay is a dead time, the rest a first-order lag.
    Lagged { dead: f64 },
    /// Separate delays of inlet and outlet, each for opening and closing.
    Sided([[f64; 2]; 2]),
}

impl Delay {
    /// Returns the delay of a cause.
    pub(crate) fn of(cause: &Cause) -> Self {
        match (cause.is_drawn(), cause.form) {
            (true, _) => Self::draw(cause.family, &mut cause.random(1)),
            (false, 0) => Self::Lagged { dead: 0.65 },
            (false, 1) => Self::Sided([[1.25, 0.75]; 2]),
            (false, _) => Self::Sided([[0.8; 2], [1.2; 2]]),
        }
    }

    /// Draws a delay of a family, with mean 1.
    fn draw(family: Family, random: &mut RandomGenerator) -> Self {
        match family {
            Family::Written => Self::Spread(vec![(1.0, 1.0)]),
            Family::Splines => {
                let law = rising(family, random);
                let span = sign(random) * random.between(0.2, 0.6);
                let mean = law.mean();
                Self::Graded(Curve::table(|u| 1.0 + span * (law.at(u) - mean)))
            }
            Family::Spectra => {
                let count = 3 + random.below(2);
                let shares = weights(count, 0.5, random);
                let raw: Vec<f64> = (0..count).map(|_| random.between(0.5, 1.6)).collect();
                let mean: f64 = shares.iter().zip(&raw).map(|(w, d)| w * d).sum();
                Self::Spread(shares.into_iter().zip(raw).map(|(w, d)| (w, d / mean)).collect())
            }
            Family::RateLaws => Self::Lagged { dead: random.between(0.35, 0.9) },
            Family::Asymmetric => {
                let raw: [[f64; 2]; 2] =
                    std::array::from_fn(|_| std::array::from_fn(|_| random.between(0.6, 1.4)));
                let mean = raw.iter().flatten().sum::<f64>() / 4.0;
                Self::Sided(raw.map(|side| side.map(|d| d / mean)))
            }
        }
    }

    /// Returns the mean conductance of a valve over a step of `h` s. `opening` is the current
    /// command. `late` returns the mean conductance of the command a number of seconds ago. `lag`
    /// is the state of the valve.
    pub(crate) fn share(
        &self,
        strength: f64,
        (side, opening, h): (usize, f64, f64),
        late: impl Fn(f64) -> f64,
        lag: &mut f64,
    ) -> f64 {
        match self {
            Self::Graded(delay) => late(strength * delay.at(opening)),
            Self::Spread(seats) => seats.iter().map(|(w, d)| w * late(strength * d)).sum(),
            Self::Lagged { dead } => {
                let target = late(dead * strength);
                let tau = (1.0 - dead) * strength;
                let decay = (-h / tau).exp();
                let mean = target + (*lag - target) * (1.0 - decay) * tau / h;
                *lag = target + (*lag - target) * decay;
                mean
            }
            Self::Sided(factors) => {
                let [opens, closes] = factors[side].map(|f| late(f * strength));
                // A valve that opens more slowly than it closes is open if both delayed commands
                // are. A valve that closes more slowly is open if either of them is.
                if factors[side][0] > factors[side][1] {
                    opens.min(closes)
                } else {
                    opens.max(closes)
                }
            }
        }
    }
}

/// A dead band: the part of a small opening that has no effect.
#[derive(Debug, Clone)]
pub(crate) enum DeadBand {
    /// The opening is shifted, or (`is_gradual`) the spool lifts gradually, so that the slowest ramp still has an
    /// effect. `sides` are the bands of inlet and outlet in units of the strength.
    Written { is_gradual: bool, sides: [f64; 2] },
    /// The lost opening as a function of the opening, both in units of the band: a table over 0 to 4, at whose end
    /// it is 1. `sides` are the bands of inlet and outlet in units of their mean.
    Drawn { lost: Curve, sides: [f64; 2] },
}

impl DeadBand {
    /// Returns the dead band of a cause.
    pub(crate) fn of(c: &Cause) -> Self {
        match c.is_drawn() {
            true => Self::draw(c.family, &mut c.random(1)),
            // The bands of the two valves differ slightly.
            false => Self::Written { is_gradual: c.form > 0, sides: [1.0, 0.8 + 0.4 * c.aux[0]] },
        }
    }

    fn draw(family: Family, random: &mut RandomGenerator) -> Self {
        let mut sides = [1.0, random.between(0.85, 1.15)];
        // The valve is shut up to `begin` bands. Above that, the slope rises to 1 along a randomly
        // drawn curve.
        let begin = if random.unit() < 0.6 { random.between(0.3, 0.85) } else { 0.0 };
        let mut law = rising(family, random);
        let mut long = (1.0 - begin) / (1.0 - law.mean());
        if family == Family::Asymmetric {
            // The edge is abrupt, and the bands of the two valves differ much.
            sides = [random.between(0.6, 1.4), random.between(0.6, 1.4)];
            law = Curve::table(|_| 0.0);
            long = 1.0 - begin;
        }
        let passed = law.integral();
        let lost = Curve::table(|x| {
            let z = 4.0 * x;
            let within = ((z - begin) / long).clamp(0.0, 1.0);
            z.min(begin) + long * (within - passed.at(within))
        });
        let end = lost.at(1.0);
        Self::Drawn { lost: lost.times(1.0 / end), sides }
    }

    /// Returns the opening that remains after the dead band.
    pub(crate) fn pass(&self, u: f64, band: f64, side: usize) -> f64 {
        match self {
            Self::Written { is_gradual: false, sides } => (u - band * sides[side]).max(0.0),
            Self::Written { is_gradual: true, sides } => {
                let band = band * sides[side];
                u - band * (1.0 - (-u / band).exp())
            }
            Self::Drawn { lost, sides } => {
                let band = band * sides[side];
                (u - band * lost.at((u / (4.0 * band)).min(1.0))).max(0.0)
            }
        }
    }
}

/// Reference flow, at which the strength of the sag is defined, kg/s.
pub(crate) const Q_REF: f64 = 6e-4;

/// Sag: loss of pressure behind the regulator under flow.
#[derive(Debug, Clone)]
pub(crate) struct Sag {
    /// Steady sag at the reference flow, Pa.
    scale: f64,
    /// Steady sag as a function of the flow, relative to `scale`; a table over 0 to 2 reference
    /// flows.
    load: Curve,
    /// Share, time constants (s) while the pressure falls and recovers, and state (Pa).
    parts: Vec<(f64, f64, f64, f64)>,
    /// Exponent of the sag in the rate of the recovery.
    power: f64,
}

impl Sag {
    /// Draws a sag of `strength` Pa s/kg at the reference flow.
    pub(crate) fn draw(family: Family, strength: f64, random: &mut RandomGenerator) -> Self {
        let tau = random.log_between(0.25, 0.9);
        let mut load = Curve::table(|x| 2.0 * x);
        let mut parts = vec![(1.0, tau, tau, 0.0)];
        let mut power = 1.0;
        match family {
            Family::Written => {}
            Family::Splines => {
                load = rising(family, random);
                // The curve is scaled to 1 at the reference flow, which is the middle of the table.
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

    /// Sets the sag to 0, as after a long time without flow.
    pub(crate) fn reset(&mut self) {
        self.parts.iter_mut().for_each(|part| part.3 = 0.0);
    }

    /// Advances by `h` s with a flow in kg/s. Returns the sag, Pa.
    pub(crate) fn push(&mut self, flow: f64, h: f64) -> f64 {
        let drawn = self.scale * self.load.at(flow / (2.0 * Q_REF));
        let mut sum = 0.0;
        for (share, falling, recovering, at) in &mut self.parts {
            let back = if self.power == 1.0 {
                *at
            } else {
                // The offset of 1e-3 makes the power linear near 0, where its slope could be
                // infinite.
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
    use testkit::tolerance::{BLIND_BAND, BLIND_BAND_OFF, BLIND_DRAWN};

    #[test]
    fn dead_bands_never_fall_and_lose_one_band_of_what_is_far_open() {
        let mut random = RandomGenerator::new(9, 5);
        for family in Family::ALL {
            for _ in 0..40 {
                let band = DeadBand::draw(family, &mut random);
                let mut last = 0.0;
                for i in 0..=1000 {
                    let left = band.pass(f64::from(i) / 1000.0, 0.05, 0);
                    assert!(left >= last - 1e-12 && left >= 0.0, "{family} {i} {left} {last}");
                    last = left;
                }
                let DeadBand::Drawn { sides, .. } = &band else { unreachable!("it is drawn") };
                let open = 1.0 - 0.05 * sides[0];
                assert!(abs_diff_eq!(last, open, epsilon = BLIND_BAND), "{family} {last}");
                let off = band.pass(0.4, 1e-9, 1);
                assert!(abs_diff_eq!(off, 0.4, epsilon = BLIND_BAND_OFF), "{family}: {off}");
            }
        }
    }

    #[test]
    fn a_step_arrives_after_the_mean_delay() {
        let mut random = RandomGenerator::new(9, 6);
        let h = 1e-4;
        for family in Family::ALL {
            for _ in 0..20 {
                let delay = Delay::draw(family, &mut random);
                let mut lag = 0.0;
                let missing = |side| {
                    (0..5000)
                        .map(|i| {
                            let t = f64::from(i) * h;
                            let late = |d: f64| if t >= d { 1.0 } else { 0.0 };
                            (1.0 - delay.share(0.04, (side, 1.0, h), late, &mut lag)) * h
                        })
                        .sum::<f64>()
                };
                let mut missing = missing;
                let seconds = missing(0);
                assert!((0.5 * 0.04..1.7 * 0.04).contains(&seconds), "{family} {seconds}");
            }
        }
    }

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

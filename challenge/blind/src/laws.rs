//! Static laws drawn from function spaces: rising curves, bumps, drifts and damping.

use crate::curve::{Curve, Wiggle, weights};
use crate::effect::{Causes, Family, Kind};
use crate::random::RandomGenerator;

/// A static law of a cause: a table if it is drawn, a formula if it is written.
#[derive(Debug, Clone)]
pub(crate) enum Law {
    Drawn(Curve),
    Written(fn(f64) -> f64),
}

impl Law {
    /// Returns the signed strength of an active cause, and its law: drawn by `draw` from its family, or one of its
    /// two hand-written forms. `None` if the cause is not active.
    pub(crate) fn find(
        causes: &Causes,
        kind: Kind,
        draw: fn(Family, &mut RandomGenerator) -> Curve,
        written: [fn(f64) -> f64; 2],
    ) -> Option<(f64, Self)> {
        let c = causes.find(kind)?;
        let law = match c.is_drawn() {
            true => Self::Drawn(draw(c.family, &mut c.random(1))),
            false => Self::Written(written[c.form]),
        };
        Some((c.signed(), law))
    }

    /// Value at `x`.
    pub(crate) fn at(&self, x: f64) -> f64 {
        match self {
            Self::Drawn(curve) => curve.at(x),
            Self::Written(formula) => formula(x),
        }
    }
}

/// A random sign.
pub(crate) fn sign(random: &mut RandomGenerator) -> f64 {
    if random.unit() < 0.5 { -1.0 } else { 1.0 }
}

/// Draws a law that rises from (0, 0) to (1, 1) and never falls.
pub(crate) fn rising(family: Family, random: &mut RandomGenerator) -> Curve {
    match family {
        Family::Written => Curve::table(|x| x),
        Family::Splines => {
            let slope = Wiggle::draw(4 + random.below(4), 0.6, random);
            Curve::risen(|x| slope.at(x).exp())
        }
        // A sum of exponentials that saturate or grow, each with a separate scale.
        Family::Spectra => {
            let count = 3 + random.below(4);
            let parts: Vec<(f64, f64)> = weights(count, 0.8, random)
                .into_iter()
                .map(|w| (w, sign(random) * random.log_between(0.12, 2.0)))
                .collect();
            Curve::table(move |x| {
                parts.iter().map(|(w, s)| w * (-x / s).exp_m1() / (-1.0 / s).exp_m1()).sum()
            })
        }
        // The solution of df/dx = (1 + c f)^m, or a power of x.
        Family::RateLaws => {
            if random.unit() < 0.4 {
                let exponent = random.log_between(0.6, 1.8);
                return Curve::table(|x| x.powf(exponent));
            }
            let (c, m) = (random.between(-0.75, 1.5), random.between(0.5, 2.5));
            let steps = 4000;
            let mut f = 0.0;
            let mut path = vec![0.0];
            for _ in 0..steps {
                // The right side is positive up to f = 1, because 1 + c f > 0.
                f += (1.0 + c * f).max(0.05).powf(m) / f64::from(steps) * reach(c, m);
                path.push(f);
            }
            let top = f;
            Curve::table(|x| path[(x * f64::from(steps)) as usize] / top)
        }
        // A curve with one or two kinks, or with different exponents on the two sides of a point.
        Family::Asymmetric => {
            let at = random.between(0.25, 0.75);
            if random.unit() < 0.5 {
                let ratio = random.log_between(1.5, 3.5).powf(sign(random));
                let other = (random.between(0.1, 0.9), random.log_between(0.7, 1.4));
                return Curve::risen(|x| {
                    (if x < at { 1.0 } else { ratio }) * if x < other.0 { 1.0 } else { other.1 }
                });
            }
            let (below, above) = (random.log_between(0.6, 1.7), random.log_between(0.6, 1.7));
            let middle = at + random.between(-0.1, 0.1);
            Curve::table(|x| {
                if x < at {
                    middle * (x / at).powf(below)
                } else {
                    1.0 - (1.0 - middle) * ((1.0 - x) / (1.0 - at)).powf(above)
                }
            })
        }
    }
}

/// Length in x after which df/dx = (1 + c f)^m has brought f from 0 to about 1.
fn reach(c: f64, m: f64) -> f64 {
    let cells = 64;
    let inverse = |i: i32| (1.0 + c * (f64::from(i) + 0.5) / f64::from(cells)).powf(-m);
    (0..cells).map(inverse).sum::<f64>() / f64::from(cells)
}

/// Draws a bump over 0..1 with the largest absolute value 1, near 0 at both ends.
pub(crate) fn bump(family: Family, random: &mut RandomGenerator) -> Curve {
    let raw = match family {
        Family::Written => Curve::table(|x| 4.0 * x * (1.0 - x)),
        Family::Splines => {
            let height = Wiggle::draw(5, 0.45, random);
            let lift = Wiggle::draw(3, 0.05, random);
            Curve::table(|x| 4.0 * x * (1.0 - x) * height.at(x).exp() + lift.at(x))
        }
        Family::Spectra => {
            let modes: Vec<f64> =
                (2..7).map(|k| 0.4 * random.gauss() / f64::from(k).powf(1.2)).collect();
            Curve::table(|x| {
                let wave = |k: usize| (std::f64::consts::PI * k as f64 * x).sin();
                wave(1) + modes.iter().enumerate().map(|(i, a)| a * wave(i + 2)).sum::<f64>()
            })
        }
        Family::RateLaws => {
            let (p, q) = (random.log_between(0.6, 1.7), random.log_between(0.6, 1.7));
            Curve::table(|x| x.powf(p) * (1.0 - x).powf(q))
        }
        // A rounded triangle whose top is not in the middle, with a flat part on one side.
        Family::Asymmetric => {
            let top = random.between(0.28, 0.72);
            let flat = random.between(0.0, 0.2);
            let round = random.between(1.2, 2.2);
            let low = random.unit() < 0.5;
            Curve::table(|x| {
                let x = if low { x } else { 1.0 - x };
                let side = if x < top {
                    (x - flat).max(0.0) / (top - flat)
                } else {
                    (1.0 - x) / (1.0 - top)
                };
                1.0 - (1.0 - side).powf(round)
            })
        }
    };
    let size = raw.size();
    raw.times(1.0 / size)
}

/// Draws the course of a settling process as a function of s = 1 - exp(-t/tau). It rises from (0,
/// 0) to (1, 1).
///
/// A sum of exponentials in t is a sum of powers of 1 - s.
pub(crate) fn settling(family: Family, random: &mut RandomGenerator) -> Curve {
    match family {
        Family::Spectra => {
            let count = 2 + random.below(4);
            let parts: Vec<(f64, f64)> = weights(count, 0.7, random)
                .into_iter()
                .map(|w| (w, random.log_between(0.25, 5.0)))
                .collect();
            Curve::table(|s| {
                1.0 - parts.iter().map(|(w, scale)| w * (1.0 - s).powf(1.0 / scale)).sum::<f64>()
            })
        }
        // The solution of dx/dt = -x^n, a hyperbola or another power law: (1 + t / (m tau))^-m.
        Family::RateLaws => {
            let m = random.log_between(0.4, 3.0);
            // The table ends after twenty time constants.
            let reached = |s: f64| 1.0 - (1.0 - (1.0 - s).max(1e-9).ln() / m).powf(-m);
            Curve::table(|s| reached(s) / reached(1.0))
        }
        other => rising(other, random),
    }
}

/// Draws a drift over 0..1 that usually goes from 0 to 1.
pub(crate) fn path(family: Family, random: &mut RandomGenerator) -> Curve {
    let raw = match family {
        Family::Written => Curve::table(|x| x),
        Family::Splines => {
            let trend = rising(family, random);
            let wiggle = Wiggle::draw(7, 0.08, random);
            let begin = wiggle.at(0.0);
            Curve::table(|x| trend.at(x) + wiggle.at(x) - begin)
        }
        Family::Spectra => settling(family, random),
        // Integrated Ornstein-Uhlenbeck: the rate of the drift is a random process.
        Family::RateLaws => {
            let (mut rate, decay) = (random.gauss(), random.between(0.9, 0.99));
            let rates: Vec<f64> = (0..200)
                .map(|_| {
                    rate = rate * decay + (1.0 - decay * decay).sqrt() * random.gauss();
                    1.0 + 0.6 * rate
                })
                .collect();
            let mut sum = 0.0;
            let mut walk = vec![0.0];
            for rate in rates {
                sum += rate / 200.0;
                walk.push(sum);
            }
            Curve::table(|x| walk[(x * 200.0) as usize])
        }
        // Two rates, and a stretch at rest.
        Family::Asymmetric => {
            let (rest, long) = (random.between(0.1, 0.7), random.between(0.1, 0.25));
            let ratio = random.log_between(0.4, 2.5);
            Curve::risen(|x| match x {
                x if x < rest => 1.0,
                x if x < rest + long => 0.02,
                _ => ratio,
            })
        }
    };
    let end = raw.at(1.0);
    // A drift that returns towards 0 is divided by its largest absolute value instead of its end
    // value.
    let scale = if end.abs() > 0.4 * raw.size() { end } else { raw.size() };
    raw.times(1.0 / scale)
}

/// Draws a damping force, in the form of a damping ratio times the speed u. u is in tenths of the
/// natural angular frequency (1/s); the table covers u from -2 to 2 with x = (u + 2) / 4.
pub(crate) fn damping(family: Family, random: &mut RandomGenerator) -> Curve {
    let base = random.between(0.16, 0.3);
    let over = |force: &dyn Fn(f64) -> f64| Curve::table(|x| force(4.0 * x - 2.0));
    match family {
        Family::Written => over(&|u| 0.25 * u),
        Family::Splines => {
            let ratio = Wiggle::draw(5, 0.35, random);
            over(&|u| base * ratio.at(u.abs() / 2.0).exp() * u)
        }
        Family::Spectra => {
            let w = weights(4, 0.7, random);
            over(&|u| {
                let terms = [0.5, 1.0, 1.5, 2.0].iter().zip(&w);
                // The offset of 0.05 makes the square root linear near rest, where its slope would
                // be infinite.
                base * u * terms.map(|(n, w)| w * (u.abs() + 0.05).powf(n - 1.0)).sum::<f64>()
            })
        }
        Family::RateLaws => {
            let (viscous, square) = (random.between(0.4, 1.0), random.between(0.0, 0.6));
            let coulomb = random.between(0.005, 0.03);
            over(&|u| base * u * (viscous + square * u.abs()) + coulomb * (u / 0.1).tanh())
        }
        Family::Asymmetric => {
            let ratio = random.log_between(1.4, 3.0).powf(sign(random)).sqrt();
            over(&|u| base * u * if u > 0.0 { ratio } else { 1.0 / ratio })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{abs_diff_eq, relative_eq};
    use testkit::tolerance::{BLIND_CURVE, BLIND_LAW_END, BLIND_LAW_START};

    #[test]
    fn rising_laws_rise_from_nought_to_one() {
        let mut random = RandomGenerator::new(4, 4);
        for family in Family::ALL {
            for draw in 0..60 {
                for law in [rising(family, &mut random), settling(family, &mut random)] {
                    let (start, end) = (law.at(0.0), law.at(1.0));
                    let from = abs_diff_eq!(start, 0.0, epsilon = BLIND_LAW_START);
                    assert!(from, "{family} {draw} {start}");
                    let to = relative_eq!(end, 1.0, epsilon = 0.0, max_relative = BLIND_LAW_END);
                    assert!(to, "{family} {draw} {end}");
                    for i in 0..400 {
                        let x = f64::from(i) / 400.0;
                        let (a, b) = (law.at(x), law.at(x + 1.0 / 400.0));
                        assert!(b >= a - 1e-12, "{family} {draw}: {a} then {b} at {x}");
                    }
                }
            }
        }
    }

    #[test]
    fn bumps_are_of_size_one_and_paths_end_away_from_where_they_began() {
        let mut random = RandomGenerator::new(4, 5);
        for family in Family::ALL {
            for _ in 0..60 {
                let bump = bump(family, &mut random);
                assert!(abs_diff_eq!(bump.size(), 1.0, epsilon = BLIND_CURVE), "{family}");
                assert!(bump.at(0.0).abs() < 0.4 && bump.at(1.0).abs() < 0.4, "{family}");
                assert!(bump.mean().abs() > 0.2, "{family}: {}", bump.mean());
                let path = path(family, &mut random);
                assert!(abs_diff_eq!(path.at(0.0), 0.0, epsilon = BLIND_LAW_START), "{family}");
                assert!(path.size() < 3.0, "{family}");
            }
        }
    }

    #[test]
    fn damping_always_brakes() {
        let mut random = RandomGenerator::new(4, 6);
        for family in Family::ALL {
            for _ in 0..60 {
                let force = damping(family, &mut random);
                for u in [-2.0, -0.7, -0.05, 0.05, 0.4, 1.9] {
                    assert!(force.at((u + 2.0) / 4.0) * u > 0.0, "{family} {u}");
                }
            }
        }
    }

    #[test]
    fn families_differ() {
        for f in [rising, bump, settling, path, damping] {
            let laws: Vec<Curve> = Family::ALL
                .into_iter()
                .map(|family| f(family, &mut RandomGenerator::new(4, 7)))
                .collect();
            for (i, a) in laws.iter().enumerate() {
                for b in &laws[i + 1..] {
                    let apart =
                        (0..50).map(|k| (a.at(k as f64 / 50.0) - b.at(k as f64 / 50.0)).abs());
                    assert!(apart.fold(0.0, f64::max) > 1e-3);
                }
            }
        }
    }
}

//! Friction loops. The hand-written forms are those of Dahl, of Bouc and Wen, and sums of six slip
//! elements. The drawn forms are sums of plays with random radii, rate laws, and plays whose reach
//! depends on the direction.

use crate::curve::{Wiggle, weights};
use crate::effect::Cause;
use crate::effect::Family;
use crate::laws::sign;
use crate::random::RandomGenerator;

/// One play operator: its share of the sum, its reach while x rises and while x falls, and its
/// state.
#[derive(Debug, Clone, Copy)]
struct Element {
    share: f64,
    up: f64,
    down: f64,
    at: f64,
}

/// The course of the loop after a reversal.
#[derive(Debug, Clone)]
enum Law {
    /// z is the sum of share (x - play(x, r)) over the elements, divided by `whole`.
    Plays { elements: Vec<Element>, whole: f64 },
    /// Bouc and Wen: dz = dx (1 - turn |z / r|^n), turn = a + (1 - a) sgn(dx z). Dahl: dz = dx (1 -
    /// sgn(dx) z / r)^n. The reach r is larger at low speed (Stribeck effect, as in the LuGre
    /// model).
    Rate { dahl: bool, exponent: f64, share: f64, rest: f64, speed: f64, z: f64 },
}

/// A loop. After a reversal its output first changes as much as the input, and then saturates at
/// `reach`.
#[derive(Debug, Clone)]
pub(crate) struct Friction {
    law: Law,
    reach: f64,
    last: Option<f64>,
}

impl Friction {
    /// Returns the loop of a cause.
    pub(crate) fn of(cause: &Cause, reach: f64, sharp: bool) -> Self {
        match cause.is_drawn() {
            true => Self::draw(cause.family, reach, sharp, &mut cause.random(2)),
            false => Self::written(cause.form, reach, cause.aux[1], sharp),
        }
    }

    /// Returns the strength of a cause, and a loop whose reach is a strain.
    pub(crate) fn with_strength(cause: &Cause) -> (f64, Self) {
        (cause.strength, Self::of(cause, 0.58 * cause.log_aux(0, 0.006, 0.05), false))
    }

    /// Returns a hand-written form: 0 is that of Dahl (1968), 1 that of Bouc and Wen (1976), any
    /// other six slip elements. The loop saturates at `reach`. `spread` (0 to 1) sets the secondary
    /// parameter of the form. A `sharp` loop changes direction within its reach, as a backlash
    /// does.
    fn written(form: usize, reach: f64, spread: f64, sharp: bool) -> Self {
        let rate = |dahl, exponent, share| Law::Rate {
            dahl,
            exponent,
            share,
            rest: 0.0,
            speed: 1.0,
            z: 0.0,
        };
        let law = match form {
            0 if sharp => rate(true, 0.35 + 0.3 * spread, 0.0),
            0 => rate(true, 0.9 + 0.5 * spread, 0.0),
            1 if sharp => rate(false, 2.5 + 2.0 * spread, 0.65),
            1 => rate(false, 1.2 + 0.6 * spread, 0.6),
            _ => {
                let width = if sharp { 0.25 } else { 1.1 + 0.4 * spread };
                // The radii are quantiles of a log-uniform distribution, scaled such that their sum
                // is six reaches.
                let raw: [f64; 6] =
                    std::array::from_fn(|i| (width * (2.0 * (i as f64 + 0.5) / 6.0 - 1.0)).exp());
                let mean = raw.iter().sum::<f64>() / 6.0;
                let element =
                    |r: f64| Element { share: 1.0, up: r / mean, down: r / mean, at: 0.0 };
                Law::Plays { elements: raw.map(element).to_vec(), whole: 6.0 }
            }
        };
        Self { law, reach, last: None }
    }

    /// Draws a loop of a family; for `sharp` see `written`.
    pub(crate) fn draw(
        family: Family,
        reach: f64,
        sharp: bool,
        random: &mut RandomGenerator,
    ) -> Self {
        let law = match family {
            Family::RateLaws => Self::rate(sharp, random),
            _ => Law::Plays { elements: plays(family, sharp, random), whole: 1.0 },
        };
        Self { law, reach, last: None }
    }

    fn rate(sharp: bool, random: &mut RandomGenerator) -> Law {
        let dahl = random.unit() < 0.5;
        let exponent = match (dahl, sharp) {
            (true, true) => random.between(0.3, 0.8),
            (true, false) => random.between(0.7, 2.0),
            (false, true) => random.between(2.0, 6.0),
            (false, false) => random.between(1.0, 2.5),
        };
        let share = random.between(0.5, 0.9);
        let rest = if random.unit() < 0.5 { random.between(0.1, 0.4) } else { 0.0 };
        // The speed is in reaches per second.
        let speed = random.log_between(2.0, 40.0);
        Law::Rate { dahl, exponent, share, rest, speed, z: 0.0 }
    }

    /// Advances to the next input, `h` seconds after the last one. Returns the part of the input
    /// that friction holds back.
    pub(crate) fn push(&mut self, x: f64, h: f64) -> f64 {
        let dx = x - self.last.replace(x).unwrap_or(x);
        if self.reach <= 0.0 {
            return 0.0;
        }
        match &mut self.law {
            Law::Plays { elements, whole } => {
                let reach = self.reach;
                let held = elements.iter_mut().map(|e| {
                    e.at = (e.at + dx).clamp(-e.down * reach, e.up * reach);
                    e.share * e.at
                });
                held.sum::<f64>() / *whole
            }
            Law::Rate { dahl, exponent, share, rest, speed, z } => {
                let slow = dx / (h * self.reach * *speed);
                let reach = self.reach * (1.0 + *rest * ((-slow * slow).exp() - 0.5));
                let direction = dx.signum();
                let pieces = (dx.abs() / (0.05 * self.reach)).ceil().clamp(1.0, 80.0);
                for _ in 0..pieces as usize {
                    let slope = if *dahl {
                        (1.0 - direction * *z / reach).max(0.0).powf(*exponent)
                    } else {
                        let turn = *share + (1.0 - *share) * (direction * *z).signum();
                        1.0 - turn * (*z / reach).abs().powf(*exponent)
                    };
                    *z = (*z + dx / pieces * slope).clamp(-reach, reach);
                }
                *z
            }
        }
    }
}

/// Draws plays whose shares sum to 1 and whose mean reach is 1.
fn plays(family: Family, sharp: bool, random: &mut RandomGenerator) -> Vec<Element> {
    let mut radii: Vec<(f64, f64)> = match family {
        // The logarithm of the density of the radii is a random spline.
        Family::Splines => {
            let (low, high) = if sharp { (0.6, 1.4) } else { (0.1, 2.2) };
            let density = Wiggle::draw(4, 0.8, random);
            let at = |i: usize| (i as f64 + 0.5) / 10.0;
            (0..10).map(|i| (low + (high - low) * at(i), density.at(at(i)).exp())).collect()
        }
        // The shares follow a power law of the radius, multiplied by random weights.
        Family::Spectra => {
            let decades = if sharp { random.between(0.15, 0.4) } else { random.between(0.7, 1.6) };
            let power = random.between(-0.4, 1.0);
            let shaken = weights(8, 0.5, random);
            let radius = |i: usize| 10f64.powf(decades * (i as f64 / 7.0 - 0.5));
            (0..8).map(|i| (radius(i), shaken[i] * radius(i).powf(-power))).collect()
        }
        _ => {
            let spread = if sharp { 0.12 } else { random.between(0.4, 0.9) };
            (0..5).map(|i| (10f64.powf(spread * (f64::from(i) / 4.0 - 0.5)), 0.2)).collect()
        }
    };
    let total: f64 = radii.iter().map(|r| r.1).sum();
    let mean: f64 = radii.iter().map(|r| r.0 * r.1).sum::<f64>() / total;
    radii.iter_mut().for_each(|r| *r = (r.0 / mean, r.1 / total));
    let lean =
        if family == Family::Asymmetric { sign(random) * random.between(0.2, 0.5) } else { 0.0 };
    radii
        .into_iter()
        .map(|(radius, share)| {
            let own = lean * if lean == 0.0 { 0.0 } else { random.between(0.7, 1.3) };
            Element { share, up: radius * (1.0 + own), down: radius * (1.0 - own), at: 0.0 }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::abs_diff_eq;
    use testkit::tolerance::{BLIND_ELASTIC, BLIND_LOOP_ELASTIC};

    #[test]
    fn loops_start_elastic_and_saturate_at_their_reach() {
        for form in 0..3 {
            for sharp in [false, true] {
                let mut element = Friction::written(form, 0.02, 0.5, sharp);
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
    fn loops_start_elastic_turn_at_a_reversal_and_stay_within_their_reach() {
        let mut random = RandomGenerator::new(9, 1);
        for family in &Family::ALL[1..] {
            for draw in 0..40 {
                let sharp = draw % 2 == 0;
                let mut one = Friction::draw(*family, 0.02, sharp, &mut random);
                one.push(0.0, 1e-3);
                let early = one.push(1e-6, 1e-3);
                let elastic = abs_diff_eq!(early, 1e-6, epsilon = BLIND_ELASTIC * 1e-6);
                assert!(elastic, "{family} {early}");
                let mut up = 0.0;
                for i in 1..400 {
                    up = one.push(1e-6 + 0.001 * f64::from(i), 1e-3);
                }
                // The two directions may differ by 0.65 of the reach. The Stribeck effect adds less
                // than 0.2.
                assert!(up < 1.66 * 0.02 && up > 0.33 * 0.02, "{family} {up}");
                assert!(one.push(0.395, 1e-3) < up, "{family}: nothing at a reversal");
            }
        }
    }
}

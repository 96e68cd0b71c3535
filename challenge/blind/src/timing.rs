//! Timing errors and mains hum: a skew that drifts, and hum.

use crate::curve::{Wiggle, weights};
use crate::effect::Cause;
use crate::effect::Family;
use crate::random::RandomGenerator;

/// Longest session for which a drifting skew is tabulated, s; it is constant afterwards.
const LONGEST_S: f64 = 1000.0;

/// Delay of the recorded voltage, s: a mean and a drift around it.
#[derive(Debug, Clone)]
pub(crate) struct Skew {
    law: Law,
    /// Additional delay in this trial, s.
    trial: f64,
    cause: Cause,
}

#[derive(Debug, Clone)]
enum Law {
    /// A smooth random path over the session.
    Path(Wiggle),
    /// A sum of sines: amplitude, angular frequency in 1/s, phase.
    Waves(Vec<(f64, f64, f64)>),
    /// A clock that runs too fast or too slow; the delay grows from the start of each trial.
    Rate(f64),
    /// A random delay in each trial.
    Starts(f64),
}

impl Skew {
    /// Returns the skew of a cause.
    pub(crate) fn draw(cause: Cause) -> Self {
        let mut random = cause.random(1);
        let size = cause.strength * random.between(0.04, 0.12);
        let law = match cause.family {
            // A clock that is up to 80 ppm too fast or too slow, or (below) a clock whose error
            // oscillates.
            Family::Written if cause.form == 0 => {
                let most = (cause.strength / 0.02).min(1.0);
                Law::Rate(most * 8e-5 * (2.0 * cause.aux[0] - 1.0))
            }
            Family::Written => {
                Law::Waves(vec![(0.08 * cause.strength, 0.3 + 0.5 * cause.aux[0], 0.0)])
            }
            Family::Splines => Law::Path(Wiggle::draw(12, 0.7 * size, &mut random)),
            Family::Spectra => {
                let shares = weights(4, 0.7, &mut random);
                let mut wave = |w: f64| {
                    let omega = random.log_between(0.02, 2.0);
                    (1.4 * size * w, omega, random.between(0.0, std::f64::consts::TAU))
                };
                Law::Waves(shares.into_iter().map(&mut wave).collect())
            }
            Family::RateLaws => {
                let rate = 2e-4 * random.between(-1.0, 1.0);
                Law::Rate(rate * (cause.strength / 0.02).min(1.0))
            }
            Family::Asymmetric => Law::Starts(size),
        };
        Self { law, trial: 0.0, cause }
    }

    /// Begins a trial.
    pub(crate) fn begin(&mut self, trial: usize) {
        if let Law::Starts(size) = self.law {
            self.trial = size
                * RandomGenerator::new(self.cause.seed, 2000 + trial as u64).between(-1.0, 1.0);
        }
    }

    /// Returns the delay at `t` s of the trial and `session` s of the session.
    pub(crate) fn at(&self, t: f64, session: f64) -> f64 {
        let wander = match &self.law {
            Law::Path(path) => path.at(session / LONGEST_S),
            Law::Waves(waves) => {
                waves.iter().map(|(a, omega, phase)| a * (omega * session + phase).sin()).sum()
            }
            Law::Rate(rate) => rate * t,
            Law::Starts(_) => self.trial,
        };
        self.cause.signed() + wander
    }
}

/// Returns the mains hum at the samples of a trial, V. `offsets` are the delays of the samples
/// relative to the grid, s; empty if the samples are on the grid.
pub(crate) fn mains(cause: Cause, trial: usize, samples: usize, offsets: &[f64]) -> Vec<f64> {
    let mut shape = cause.random(1);
    let mut random = RandomGenerator::new(cause.seed, trial as u64);
    let is_slow = if cause.is_drawn() { cause.aux[0] < 0.5 } else { cause.form == 0 };
    let hertz = if is_slow { 50.0 } else { 60.0 };
    let (spread, memory_s) = match cause.is_drawn() {
        true => (shape.log_between(0.01, 0.08), shape.log_between(3.0, 60.0)),
        false => (0.03, 20.0),
    };
    // Orders and relative amplitudes of the harmonics.
    let harmonics: Vec<(f64, f64)> = match cause.family {
        Family::Written => vec![(3.0, 0.08)],
        Family::Splines => Vec::new(),
        Family::Spectra => {
            let sizes = [2.0, 3.0, 5.0, 7.0].map(|k| (k, 0.3 * shape.gauss() / k));
            sizes.to_vec()
        }
        Family::Asymmetric => vec![(2.0, shape.between(0.1, 0.3)), (4.0, shape.between(0.0, 0.1))],
        Family::RateLaws => vec![(3.0, -shape.between(0.05, 0.2))],
    };
    let swell = (cause.family == Family::Splines).then(|| Wiggle::draw(8, 0.25, &mut random));
    let mut phase = random.between(0.0, std::f64::consts::TAU);
    let mut wander = spread * random.gauss();
    let h = 0.01_f64;
    (0..samples)
        .map(|i| {
            wander +=
                -wander * h / memory_s + spread * (2.0 * h / memory_s).sqrt() * random.gauss();
            phase += std::f64::consts::TAU * (hertz + wander) * h;
            let late = offsets.get(i).copied().unwrap_or(0.0);
            let now = phase + std::f64::consts::TAU * hertz * late;
            let sum: f64 = harmonics.iter().map(|(k, a)| a * (k * now).sin()).sum();
            let size = swell.as_ref().map_or(1.0, |s| s.at(i as f64 / samples as f64).exp());
            cause.strength * size * (now.sin() + sum)
        })
        .collect()
}

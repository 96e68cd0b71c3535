//! Disturbances, drawn for each rig: noise, drift of the supply, start pressures, pauses, jitter of
//! the sampling times and missing rows.

use std::collections::BTreeMap;

use crate::random::RandomGenerator;
use crate::rig::{SIGMA_L, SIGMA_P, SIGMA_V};

/// Noise of one channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Noise {
    /// Standard deviation without outliers.
    pub(crate) sigma: f64,
    /// Share of the variance that is correlated, and the correlation time in samples.
    slow: f64,
    memory: f64,
    /// Degrees of freedom of Student's t; 0 for a Gaussian.
    freedom: usize,
    /// Probability that a sample is an outlier, and the size of outliers in multiples of `sigma`.
    outliers: f64,
    outlier_size: f64,
}

impl Noise {
    fn white(sigma: f64) -> Self {
        Self { sigma, slow: 0.0, memory: 1.0, freedom: 0, outliers: 0.0, outlier_size: 0.0 }
    }

    fn draw(sigma: f64, random: &mut RandomGenerator) -> Self {
        let mut noise = Self::white(sigma * random.log_between(0.5, 2.0));
        if random.unit() < 0.5 {
            noise.slow = random.between(0.1, 0.7);
            noise.memory = random.log_between(1.5, 30.0);
        }
        if random.unit() < 0.5 {
            noise.freedom = random.pick(&[3, 4, 5, 7, 10]);
        }
        if random.unit() < 0.4 {
            noise.outliers = random.log_between(1e-5, 3e-4);
            noise.outlier_size = random.log_between(8.0, 60.0);
        }
        noise
    }

    /// Draws the noise of `count` samples.
    pub(crate) fn samples(&self, count: usize, random: &mut RandomGenerator) -> Vec<f64> {
        let mut slow = if self.slow > 0.0 { random.gauss() } else { 0.0 };
        let keep = (-1.0 / self.memory).exp();
        (0..count)
            .map(|_| {
                let mut unit = random.gauss();
                if self.freedom > 0 {
                    let n = self.freedom as f64;
                    let square: f64 = (0..self.freedom).map(|_| random.gauss().powi(2)).sum();
                    // Without the last factor the variance would be n / (n - 2).
                    unit *= (n / square).sqrt() * ((n - 2.0) / n).sqrt();
                }
                if self.slow > 0.0 {
                    slow = keep * slow + (1.0 - keep * keep).sqrt() * random.gauss();
                    unit = (1.0 - self.slow).sqrt() * unit + self.slow.sqrt() * slow;
                }
                if self.outliers > 0.0 && random.unit() < self.outliers {
                    unit += self.outlier_size * if random.unit() < 0.5 { -1.0 } else { 1.0 };
                }
                self.sigma * unit
            })
            .collect()
    }
}

/// How the supply drifts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SupplyWander {
    /// Standard deviation as a share of the supply.
    sd: f64,
    memory_s: f64,
    /// Number of first-order lags in series: 1 gives an Ornstein-Uhlenbeck process, 2 and 3 give
    /// smoother processes.
    order: usize,
}

impl SupplyWander {
    /// Draws relative deviations of the supply at knots that are `step_s` apart.
    pub(crate) fn knots(
        &self,
        count: usize,
        step_s: f64,
        random: &mut RandomGenerator,
    ) -> Vec<f64> {
        // The lags in series have `memory_s` as the sum of their time constants.
        let keep = (-step_s * self.order as f64 / self.memory_s).exp();
        let through = |at: &mut [f64], mut x: f64| {
            for z in at.iter_mut() {
                *z = keep * *z + (1.0 - keep) * x;
                x = *z;
            }
            x
        };
        let settle = (20.0 / (1.0 - keep)).ceil() as usize;
        let mut at = vec![0.0; self.order];
        let response = (0..settle).map(|i| through(&mut at, if i == 0 { 1.0 } else { 0.0 }));
        let scale = self.sd / response.map(|x| x * x).sum::<f64>().sqrt();
        let mut at = vec![0.0; self.order];
        for _ in 0..settle {
            through(&mut at, random.gauss());
        }
        (0..count).map(|_| scale * through(&mut at, random.gauss())).collect()
    }
}

/// Deviations of the pressures from which trials start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StartErrors {
    /// Mean and standard deviation of the difference between supply and start pressure, as a share
    /// of the supply.
    full: (f64, f64),
    /// Mean start pressure of a vented chamber above the atmosphere, Pa.
    empty_pa: f64,
}

impl StartErrors {
    /// Draws the difference between the supply and the start pressure of a filled chamber, as a
    /// share of the supply. It is negative if the chamber starts above the supply.
    pub(crate) fn full(&self, random: &mut RandomGenerator) -> f64 {
        self.full.0 + self.full.1 * random.gauss()
    }

    /// Draws the start pressure of a vented chamber above the atmosphere, Pa.
    pub(crate) fn empty(&self, random: &mut RandomGenerator) -> f64 {
        -self.empty_pa * (1.0 - random.unit()).ln()
    }
}

/// All disturbances of one case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Surroundings {
    /// Noise of pressure in Pa, length in mm and voltage in V.
    pub(crate) noise: [Noise; 3],
    /// Whether a rig file states the noise.
    pub(crate) stated: bool,
    pub(crate) supply: SupplyWander,
    pub(crate) starts: StartErrors,
    /// Mean and spread of the pauses between trials, s.
    pause_s: (f64, f64),
    /// Standard deviation of the time between a sample and its place on the grid, s, and whether
    /// `time_s` holds the true times.
    jitter_s: f64,
    pub(crate) stamped: bool,
    /// Share of the rows that are missing, and the mean number of missing rows in a row.
    dropped: f64,
    in_a_row: f64,
}

impl Surroundings {
    pub(crate) fn draw(random: &mut RandomGenerator) -> Self {
        let stated = random.unit() < 0.5;
        let noise = [SIGMA_P, SIGMA_L, SIGMA_V].map(|sigma| Noise::draw(sigma, random));
        let supply = SupplyWander {
            sd: random.log_between(0.001, 0.005),
            memory_s: random.log_between(0.3, 30.0),
            order: 1 + random.below(3),
        };
        let starts = StartErrors {
            full: (random.between(-0.001, 0.003), random.log_between(3e-4, 3e-3)),
            empty_pa: random.log_between(20.0, 600.0),
        };
        let jitter_s = if random.unit() < 0.5 { random.log_between(2e-5, 3e-4) } else { 0.0 };
        let stamped = jitter_s > 0.0 && random.unit() < 0.5;
        let dropped = if random.unit() < 0.5 { random.log_between(1e-4, 1e-2) } else { 0.0 };
        Self {
            noise,
            stated,
            supply,
            starts,
            pause_s: (random.between(9.0, 20.0), random.between(0.0, 4.0)),
            jitter_s,
            stamped,
            dropped,
            in_a_row: if random.unit() < 0.5 { 1.0 } else { random.between(1.0, 6.0) },
        }
    }

    /// Returns the disturbances as the label lists them.
    pub(crate) fn facts(&self) -> BTreeMap<String, f64> {
        let mut facts: BTreeMap<String, f64> = [
            ("noise_stated", f64::from(u8::from(self.stated))),
            ("supply_sd", self.supply.sd),
            ("supply_memory_s", self.supply.memory_s),
            ("supply_order", self.supply.order as f64),
            ("start_full_mean", self.starts.full.0),
            ("start_full_sd", self.starts.full.1),
            ("start_empty_pa", self.starts.empty_pa),
            ("pause_mean_s", self.pause_s.0),
            ("pause_spread_s", self.pause_s.1),
            ("jitter_s", self.jitter_s),
            ("jitter_stamped", f64::from(u8::from(self.stamped))),
            ("dropped", self.dropped),
            ("dropped_in_a_row", self.in_a_row),
        ]
        .map(|(name, value)| (name.to_owned(), value))
        .into();
        for (noise, channel) in self.noise.iter().zip(["pressure", "length", "volts"]) {
            let own = [
                ("sigma", noise.sigma),
                ("slow_share", noise.slow),
                ("memory_samples", noise.memory),
                ("freedom", noise.freedom as f64),
                ("outliers", noise.outliers),
                ("outlier_size", noise.outlier_size),
            ];
            facts.extend(own.map(|(name, value)| (format!("{channel}_{name}"), value)));
        }
        facts
    }

    /// Draws the duration of a pause, s.
    pub(crate) fn pause(&self, random: &mut RandomGenerator) -> f64 {
        let (mean, spread) = self.pause_s;
        ((mean + spread * random.gauss()).clamp(8.0, 25.0) * 100.0).round() / 100.0
    }

    /// Delay of each sample relative to the grid, s; empty if all are on the grid.
    pub(crate) fn offsets(&self, count: usize, random: &mut RandomGenerator) -> Vec<f64> {
        if self.jitter_s == 0.0 {
            return Vec::new();
        }
        // The limit of 2 ms keeps the samples in order, because they are 10 ms apart.
        let late = |i| if i == 0 { 0.0 } else { self.jitter_s * random.gauss() };
        (0..count).map(late).map(|late: f64| late.clamp(-2e-3, 2e-3)).collect()
    }

    /// Draws which samples are missing; empty if no sample is. The first sample is always present.
    pub(crate) fn missing(&self, count: usize, random: &mut RandomGenerator) -> Vec<bool> {
        if self.dropped == 0.0 {
            return Vec::new();
        }
        let mut left = 0.0;
        (0..count)
            .map(|i| {
                if left < 0.5 && random.unit() < self.dropped / self.in_a_row {
                    // The length of a gap has a geometric distribution with the mean `in_a_row`.
                    let more = 1.0 - 1.0 / self.in_a_row;
                    left = if more > 0.0 {
                        1.0 + ((1.0 - random.unit()).ln() / more.ln()).floor()
                    } else {
                        1.0
                    };
                }
                let gone = left > 0.5 && i > 0;
                left = (left - 1.0).max(0.0);
                gone
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{abs_diff_eq, assert_abs_diff_eq};
    use testkit::tolerance::{BLIND_NOISE, BLIND_ROWS, BLIND_SUPPLY};

    fn sd(x: &[f64]) -> f64 {
        (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt()
    }

    #[test]
    fn noise_has_the_level_it_says_whatever_its_colour_and_tails() {
        let mut random = RandomGenerator::new(7, 1);
        for (slow, freedom) in [(0.0, 0), (0.5, 0), (0.0, 5), (0.5, 7)] {
            let noise = Noise { slow, memory: 5.0, freedom, ..Noise::white(0.3) };
            let x = noise.samples(200_000, &mut random);
            let level = abs_diff_eq!(sd(&x), 0.3, epsilon = BLIND_NOISE * 0.3);
            assert!(level, "{slow} {freedom}: {}", sd(&x));
            let lag: f64 = x.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / x.len() as f64 / 0.09;
            assert_abs_diff_eq!(lag, slow * (-0.2_f64).exp(), epsilon = BLIND_NOISE);
        }
    }

    #[test]
    fn the_supply_wanders_by_its_level_and_for_its_time() {
        let mut random = RandomGenerator::new(7, 2);
        for order in 1..=3 {
            for memory_s in [0.3, 5.0] {
                let wander = SupplyWander { sd: 0.003, memory_s, order };
                let x = wander.knots(400_000, 0.1, &mut random);
                let level = abs_diff_eq!(sd(&x), 0.003, epsilon = BLIND_SUPPLY * 0.003);
                assert!(level, "{order} {memory_s} {}", sd(&x));
                let lag = (memory_s / 0.1) as usize;
                let products = x.iter().zip(&x[lag..]).map(|(a, b)| a * b);
                let left = products.sum::<f64>() / x.len() as f64 / 0.003_f64.powi(2);
                // The autocorrelation at `memory_s` is exp(-1) for one lag, and (1 + n) exp(-n) or
                // similar for several lags.
                assert!((0.2..0.75).contains(&left), "{order} {memory_s} {left}");
            }
        }
    }

    #[test]
    fn as_many_rows_are_missing_as_are_said_to_be() {
        let mut random = RandomGenerator::new(7, 3);
        let mut drawn = Surroundings::draw(&mut random);
        for in_a_row in [1.0, 4.0] {
            drawn = Surroundings { dropped: 0.01, in_a_row, ..drawn };
            let gone = drawn.missing(400_000, &mut random);
            let share = gone.iter().filter(|&&g| g).count() as f64 / 400_000.0;
            assert!(!gone[0]);
            assert_abs_diff_eq!(share, 0.01, epsilon = BLIND_ROWS * 0.01);
        }
    }
}

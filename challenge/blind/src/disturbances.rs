//! Disturbances: everything that is neither the rig nor an effect, drawn for each rig.

use std::collections::BTreeMap;

use crate::random::RandomGenerator;
use crate::rig::{SIGMA_L, SIGMA_P, SIGMA_V};

/// Noise of one channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Noise {
    /// Standard deviation without outliers.
    pub(crate) sigma: f64,
    /// Share of the variance that is correlated, and over how many samples.
    slow: f64,
    memory: f64,
    /// Degrees of freedom of Student's t; 0 for a Gaussian.
    freedom: usize,
    /// Outliers a sample, and their size in sigma.
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

    /// Noise of so many samples.
    pub(crate) fn samples(&self, count: usize, random: &mut RandomGenerator) -> Vec<f64> {
        let mut slow = if self.slow > 0.0 { random.gauss() } else { 0.0 };
        let keep = (-1.0 / self.memory).exp();
        (0..count)
            .map(|_| {
                let mut unit = random.gauss();
                if self.freedom > 0 {
                    let n = self.freedom as f64;
                    let square: f64 = (0..self.freedom).map(|_| random.gauss().powi(2)).sum();
                    // Variance n / (n - 2) without the last factor.
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
    /// Lags in a row: 1 is an Ornstein-Uhlenbeck process, 2 and 3 are smoother.
    order: usize,
}

impl SupplyWander {
    /// Relative deviations of the supply, at knots `step_s` apart.
    pub(crate) fn knots(
        &self,
        count: usize,
        step_s: f64,
        random: &mut RandomGenerator,
    ) -> Vec<f64> {
        // Lags in a row share the memory.
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
    /// Mean and standard deviation below the supply, as a share of it.
    full: (f64, f64),
    /// Mean above the atmosphere, Pa.
    empty_pa: f64,
}

impl StartErrors {
    /// Share of the supply that a full start lacks (negative: has too much).
    pub(crate) fn full(&self, random: &mut RandomGenerator) -> f64 {
        self.full.0 + self.full.1 * random.gauss()
    }

    /// Pa above the atmosphere of an empty start.
    pub(crate) fn empty(&self, random: &mut RandomGenerator) -> f64 {
        -self.empty_pa * (1.0 - random.unit()).ln()
    }
}

/// Everything around a rig, of one case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Surroundings {
    /// Of pressure in Pa, length in mm, voltage in V.
    pub(crate) noise: [Noise; 3],
    /// Whether a rig file says how much noise there is.
    pub(crate) stated: bool,
    pub(crate) supply: SupplyWander,
    pub(crate) starts: StartErrors,
    /// Mean and spread of the pauses between trials, s.
    pause_s: (f64, f64),
    /// How far samples are off the grid (1 sd), s, and whether `time_s` says so.
    jitter_s: f64,
    pub(crate) stamped: bool,
    /// Share of the rows that are missing, and how many in a row.
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

    /// What the label says of it.
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

    /// One pause, s.
    pub(crate) fn pause(&self, random: &mut RandomGenerator) -> f64 {
        let (mean, spread) = self.pause_s;
        ((mean + spread * random.gauss()).clamp(8.0, 25.0) * 100.0).round() / 100.0
    }

    /// Delay of each sample relative to the grid, s; empty if all are on the grid.
    pub(crate) fn offsets(&self, count: usize, random: &mut RandomGenerator) -> Vec<f64> {
        if self.jitter_s == 0.0 {
            return Vec::new();
        }
        // The order of samples is kept: they are 10 ms apart.
        let late = |i| if i == 0 { 0.0 } else { self.jitter_s * random.gauss() };
        (0..count).map(late).map(|late: f64| late.clamp(-2e-3, 2e-3)).collect()
    }

    /// Which samples are missing; empty if none is. The first one is always present.
    pub(crate) fn missing(&self, count: usize, random: &mut RandomGenerator) -> Vec<bool> {
        if self.dropped == 0.0 {
            return Vec::new();
        }
        let mut left = 0.0;
        (0..count)
            .map(|i| {
                if left < 0.5 && random.unit() < self.dropped / self.in_a_row {
                    // A geometric length of this mean.
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
                // exp(-1) for one lag, (1 + n) exp(-n) and the like for several.
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

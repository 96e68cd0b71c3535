//! Describes the course in time of a residual that no recorded signal explains. There are four
//! courses: time stamps jitter, or the residual swings, jumps or drifts.
//!
//! The residual r of N samples is in multiples of the noise, over stretches without a break. A
//! course has to explain at least half of the power above the noise, sum r^2 - N. For jumps, the
//! changes d_i = r_(i+1) - r_i take the place of r, and their power above the noise is sum d^2 - 2
//! N. The first course in the table that explains enough is reported:
//!
//! | course | explained part | numbers |
//! | --- | --- | --- |
//! | jitters | noise that follows the rate, if this is the most likely cause: [`jitter`](super::jitter) | standard deviation of the time error |
//! | swings | sines of one frequency f, of any phase in each stretch: sum over stretches (2/n) \|sum r exp(-i 2 pi f t)\|^2 | f, and the amplitude |
//! | jumps | at least eight changes of more than six times the noise, each twice as large as the changes before and after: sum of their d_i^2 | number per second, and root mean square |
//! | drifts | reported if no other course explains enough | root mean square, and the time after which the autocorrelation has fallen to 1/e |
//!
//! A signal that moves with the simulated output is not reported as jumping: a signal that is late
//! by a constant time changes whenever the output steps. The changes of the output s_i, at the two
//! lags that explain most, must explain less than a quarter of what the jumps explain: (sum d_i
//! s_(i-k))^2 / sum s_i^2 for a lag of k samples.

use std::f64::consts::TAU;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stretch_data::in_digits;

use crate::missing::jitter::jitter_sd_s;

/// Share of the power above the noise that a course has to explain.
const SHARE: f64 = 0.5;
/// A change by more than this many multiples of the noise is a jump. By chance, one such change
/// occurs in a thousand recordings of 3e4 samples each.
const JUMP: f64 = 6.0;
/// A jump is at least this many times as large as the changes before and after it. Smooth courses
/// with little noise contain large changes, but these have neighbours of about the same size.
const ALONE: f64 = 2.0;
/// Smallest number of jumps.
const LEAST_JUMPS: usize = 8;
/// Share of the jumps' power that changes of the simulated output may explain.
const DRIVEN: f64 = 0.25;
/// Largest lag of the residual behind the simulated output, in samples.
const LAGS: usize = 200;
/// Smallest number of periods that a stretch must contain for a frequency to count.
const TURNS: f64 = 3.0;
/// Largest frequency, in periods per sample.
const QUICKEST: f64 = 0.4;

/// The course in time of a residual that no recorded signal explains, in the unit of its channel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Course {
    /// The time stamps jitter: the noise follows the rate of the channel.
    Jitters {
        /// Standard deviation of the time between a sample and its stamp, s.
        sd_s: f64,
    },
    /// The residual oscillates at one frequency.
    Swings {
        /// Frequency, Hz.
        hertz: f64,
        /// Amplitude.
        amplitude: f64,
    },
    /// The residual jumps.
    Jumps {
        /// Number of jumps per second.
        per_s: f64,
        /// Root mean square of a jump.
        size: f64,
    },
    /// The residual drifts.
    Drifts {
        /// Root mean square.
        size: f64,
        /// Correlation time, s.
        correlation_s: f64,
    },
}

impl Course {
    /// Returns the course of a residual in multiples of the noise. `noise` is the standard
    /// deviation of the noise in the unit of the channel, and `dt_s` the sample time. `shown` is
    /// the simulator's output at the same samples, also in multiples of the noise. `None` if there
    /// is only noise.
    pub(crate) fn of(
        stretches: &[&[f64]],
        shown: &[Vec<f64>],
        noise: f64,
        dt_s: f64,
    ) -> Option<Self> {
        let samples: usize = stretches.iter().map(|s| s.len()).sum();
        let squares: f64 = stretches.iter().copied().flatten().map(|r| r * r).sum();
        let above = squares - samples as f64;
        if above <= 0.0 {
            return None;
        }
        if let Some(sd_s) = jitter_sd_s(stretches, shown, dt_s, SHARE * above) {
            return Some(Self::Jitters { sd_s });
        }
        let swings = || {
            let (turns, taken) = strongest(stretches)?;
            let amplitude = noise * (2.0 * taken / samples as f64).sqrt();
            let hertz = turns / dt_s;
            (taken >= SHARE * above).then_some(Self::Swings { hertz, amplitude })
        };
        let drifts = || {
            let size = noise * (above / samples as f64).sqrt();
            Self::Drifts { size, correlation_s: dt_s * forgotten_after(stretches) as f64 }
        };
        Some(swings().or_else(|| jumps(stretches, shown, noise, dt_s)).unwrap_or_else(drifts))
    }

    /// Describes the course in words, with the unit of the channel.
    pub(crate) fn words(&self, unit: &str) -> String {
        let sized = |size: f64| format!("{} {unit}", in_digits(size, 3)).trim_end().to_owned();
        match *self {
            Self::Jitters { sd_s } => format!(
                "time stamps jitter by about {} ms, which is noise that follows the rate",
                in_digits(1e3 * sd_s, 3)
            ),
            Self::Swings { hertz, amplitude } => {
                format!(
                    "it oscillates at {} Hz with an amplitude of {}",
                    in_digits(hertz, 3),
                    sized(amplitude)
                )
            }
            Self::Jumps { per_s, size } => {
                format!(
                    "it jumps, about {} times a second, by {}",
                    in_digits(per_s, 3),
                    sized(size)
                )
            }
            Self::Drifts { size, correlation_s } => format!(
                "it varies by {}, with a correlation time of {} s",
                sized(size),
                in_digits(correlation_s, 3)
            ),
        }
    }
}

/// Returns the frequency, in periods per sample, whose sines explain most of the sum of squares,
/// and how much they explain.
fn strongest(stretches: &[&[f64]]) -> Option<(f64, f64)> {
    let longest = stretches.iter().map(|s| s.len()).max()? as f64;
    let step = 0.5 / longest;
    let count = (QUICKEST / step) as usize;
    let all = (1..=count).map(|i| step * i as f64).filter(|turns| turns * longest >= TURNS);
    let taken = |turns: f64| stretches.iter().map(|s| taken(s, turns)).sum::<f64>();
    all.map(|turns| (turns, taken(turns))).max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Returns the sum of squares that a sine explains in a stretch, (2/n) |sum r exp(-i w t)|^2, by
/// Goertzel's recursion (1958, doi 10.2307/2310304).
fn taken(stretch: &[f64], turns: f64) -> f64 {
    let twice = 2.0 * libm::cos(TAU * turns);
    let (mut last, mut before) = (0.0, 0.0);
    for r in stretch {
        (last, before) = (r + twice * last - before, last);
    }
    let power = last * last + before * before - twice * last * before;
    2.0 * power / stretch.len().max(1) as f64
}

/// Returns the changes from sample to sample.
fn changes(values: &[f64]) -> Vec<f64> {
    values.windows(2).map(|p| p[1] - p[0]).collect()
}

fn jumps(stretches: &[&[f64]], shown: &[Vec<f64>], noise: f64, dt_s: f64) -> Option<Course> {
    let changed: Vec<Vec<f64>> = stretches.iter().map(|s| changes(s)).collect();
    let count = changed.iter().map(Vec::len).sum::<usize>() as f64;
    let all: f64 = changed.iter().flatten().map(|d| d * d).sum();
    let is_alone = |d: &[f64]| d[1].abs() > JUMP.max(ALONE * d[0].abs().max(d[2].abs()));
    let alone = changed.iter().flat_map(|d| d.windows(3)).filter(|d| is_alone(d));
    let large: Vec<f64> = alone.map(|d| d[1] * d[1]).collect();
    let sum: f64 = large.iter().sum();
    let is_jumping = large.len() >= LEAST_JUMPS
        && sum >= SHARE * (all - 2.0 * count)
        && driven(&changed, shown) < DRIVEN * sum;
    is_jumping.then(|| Course::Jumps {
        per_s: large.len() as f64 / (count * dt_s),
        size: noise * (sum / large.len() as f64).sqrt(),
    })
}

/// Returns the sum of squares that changes of the simulated output explain in changes of the
/// residual, at the two lags that explain most.
fn driven(changed: &[Vec<f64>], shown: &[Vec<f64>]) -> f64 {
    let moved: Vec<Vec<f64>> = shown.iter().map(|s| changes(s)).collect();
    let squares: f64 = moved.iter().flatten().map(|s| s * s).sum();
    if squares == 0.0 {
        return 0.0;
    }
    let at = |lag: usize| {
        let pairs = changed.iter().zip(&moved).filter(|(d, _)| d.len() > lag);
        let product = pairs
            .map(|(d, s)| d[lag..].iter().zip(s).map(|(d, s)| d * s).sum::<f64>())
            .sum::<f64>();
        product * product / squares
    };
    let mut explained: Vec<f64> = (0..=LAGS).map(at).collect();
    explained.sort_by(|a, b| b.total_cmp(a));
    explained.iter().take(2).sum()
}

/// Returns the lag, in samples, at which the autocorrelation has fallen to 1/e of that at a lag of
/// one sample, which contains no white noise.
fn forgotten_after(stretches: &[&[f64]]) -> usize {
    let product = |lag: usize| -> f64 {
        let long = stretches.iter().filter(|s| s.len() > lag);
        long.map(|s| s[lag..].iter().zip(*s).map(|(a, b)| a * b).sum::<f64>()).sum()
    };
    let longest = stretches.iter().map(|s| s.len()).max().unwrap_or(0);
    let least = product(1) / std::f64::consts::E;
    let mut lag = 1;
    while lag < longest && product(lag) > least {
        // Try every lag up to 20, then proceed in steps of a twentieth of the lag.
        lag += 1 + lag / 20;
    }
    lag
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::random::RandomGenerator;

    const DT_S: f64 = 0.01;

    /// Returns a course plus white noise of standard deviation 1.
    fn beside_noise(course: impl Fn(usize) -> f64, seed: u64) -> Vec<f64> {
        let mut random = RandomGenerator::new(seed, 0);
        (0..12_000).map(|i| course(i) + random.gauss()).collect()
    }

    fn of(values: &[f64]) -> Option<Course> {
        let stretches: Vec<&[f64]> = values.chunks(6000).collect();
        // The simulated output is constant, so jitter of time stamps is invisible.
        let still: Vec<Vec<f64>> = stretches.iter().map(|s| vec![0.0; s.len()]).collect();
        Course::of(&stretches, &still, 0.002, DT_S)
    }

    #[test]
    fn a_swing_has_its_frequency_and_amplitude() {
        for (hertz, size) in [(0.07, 3.0), (0.7, 1.5), (11.3, 4.0)] {
            let found = of(&beside_noise(|i| size * libm::sin(TAU * hertz * DT_S * i as f64), 1));
            let Some(Course::Swings { hertz: f, amplitude }) = found else { panic!("{found:?}") };
            // Frequencies are tried in steps of half a period per longest stretch. Between two of
            // them, a sine explains less.
            assert!((f - hertz).abs() <= 0.5 / 60.0 + 1e-9, "{f} for {hertz}");
            assert!((amplitude / (0.002 * size) - 1.0).abs() < 0.25, "{amplitude} for {size}");
        }
    }

    /// Returns a course that switches between two levels, at each sample with the probability
    /// `share`.
    fn switching(share: f64, seed: u64) -> Vec<f64> {
        let mut random = RandomGenerator::new(seed, 1);
        let mut level = 0.0;
        let mut next = || {
            if random.unit() < share {
                level = 12.0 - level;
            }
            level
        };
        (0..12_000).map(|_| next()).collect()
    }

    /// Jumps that occur twice a second on average are counted and measured.
    #[test]
    fn jumps_are_counted_and_measured() {
        let course = switching(0.02, 3);
        let found = of(&beside_noise(|i| course[i], 2));
        let Some(Course::Jumps { per_s, size }) = found else { panic!("{found:?}") };
        // 240 jumps are expected, with a standard deviation of sqrt(240) = 15.
        assert!((1.6..2.4).contains(&per_s), "{per_s}");
        assert!((size / 0.024 - 1.0).abs() < 0.05, "{size}");
    }

    /// A delay, a lag, warming and dry friction follow the motion of the simulator. They are not
    /// described as jumps, whether the command steps or moves smoothly.
    #[test]
    fn what_follows_the_motion_does_not_jump() {
        let steps = |i: usize| if (i / 130).is_multiple_of(2) { 40.0 } else { -40.0 };
        let smooth = |i: usize| 400.0 * libm::sin(0.013 * i as f64) * libm::cos(0.0041 * i as f64);
        let kept = libm::exp(-1.0 / 15.0);
        for (command, shown) in [("steps", &steps as &dyn Fn(usize) -> f64), ("smooth", &smooth)] {
            let output: Vec<f64> = (0..12_000).map(shown).collect();
            let late = |i: usize| output[i.saturating_sub(7)] - output[i];
            let lagging: Vec<f64> = output
                .iter()
                .scan(output[0], |y, x| {
                    *y = kept * *y + (1.0 - kept) * x;
                    Some(*y - x)
                })
                .collect();
            let lag = |i: usize| lagging[i];
            let warming = |i: usize| 30.0 * (1.0 - libm::exp(-1e-3 * i as f64));
            let friction = |i: usize| 9.0 * (output[i] - output[i.saturating_sub(1)]).signum();
            let courses: [(&str, &dyn Fn(usize) -> f64); 4] =
                [("delay", &late), ("lag", &lag), ("warming", &warming), ("friction", &friction)];
            for (seed, (name, course)) in (20..).zip(courses) {
                let values = beside_noise(course, seed);
                let stretches: Vec<&[f64]> = values.chunks(6000).collect();
                let shown: Vec<Vec<f64>> = output.chunks(6000).map(<[f64]>::to_vec).collect();
                let found = Course::of(&stretches, &shown, 0.002, DT_S);
                assert!(
                    !matches!(found, Some(Course::Jumps { .. })),
                    "{name}, {command}: {found:?}"
                );
            }
        }
    }

    /// Jumps at random times are reported although the simulator moves in steps.
    #[test]
    fn jumps_apart_from_the_motion_are_reported() {
        let course = switching(0.01, 7);
        let values = beside_noise(|i| course[i], 8);
        let stretches: Vec<&[f64]> = values.chunks(6000).collect();
        let steps = |i: usize| if (i / 130).is_multiple_of(2) { 40.0 } else { -40.0 };
        let shown: Vec<f64> = (0..12_000).map(steps).collect();
        let shown: Vec<Vec<f64>> = shown.chunks(6000).map(<[f64]>::to_vec).collect();
        let found = Course::of(&stretches, &shown, 0.002, DT_S);
        assert!(matches!(found, Some(Course::Jumps { .. })), "{found:?}");
    }

    #[test]
    fn a_drift_has_its_time() {
        let mut random = RandomGenerator::new(5, 1);
        let kept = libm::exp(-DT_S / 0.8);
        let mut x = 0.0;
        let course: Vec<f64> = (0..12_000)
            .map(|_| {
                x = kept * x + (1.0 - kept * kept).sqrt() * random.gauss();
                3.0 * x
            })
            .collect();
        let found = of(&beside_noise(|i| course[i], 4));
        let Some(Course::Drifts { size, correlation_s }) = found else { panic!("{found:?}") };
        // 150 correlation times determine a variance to 10 %, and the correlation time to about 20
        // %.
        assert!((size / 0.006 - 1.0).abs() < 0.2, "{size}");
        assert!((0.5..1.2).contains(&correlation_s), "{correlation_s}");
    }

    #[test]
    fn noise_alone_has_no_course() {
        let quiet: Vec<f64> = beside_noise(|_| 0.0, 6).iter().map(|r| 0.9 * r).collect();
        assert_eq!(of(&quiet), None);
        assert_eq!(Course::of(&[], &[], 1.0, DT_S), None);
    }

    #[test]
    fn words_have_units() {
        let swing = Course::Swings { hertz: 0.7, amplitude: 0.012 };
        assert_eq!(swing.words("V"), "it oscillates at 0.7 Hz with an amplitude of 0.012 V");
        let jitter = Course::Jitters { sd_s: 0.0042 };
        let told = "time stamps jitter by about 4.2 ms, which is noise that follows the rate";
        assert_eq!(jitter.words("V"), told);
    }
}

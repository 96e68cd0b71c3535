//! Trials of simulated sessions, and faults of logs.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stretch_data::{Split, Trial};
use stretch_sim::{Rig, RunSettings, Session, TrialPlan};

/// A simulated session. For fitting: twelve ramps, an arbitrary trial and a pulse trial. For
/// testing: two arbitrary trials and a pulse trial.
pub(crate) struct Simulated {
    pub(crate) fit: Vec<Trial>,
    pub(crate) test: Vec<Trial>,
}

impl Simulated {
    pub(crate) fn new(rig: &Rig, seed: u64, noise: bool) -> anyhow::Result<Self> {
        let settings = RunSettings { seed, noise, ..RunSettings::default() };
        let mut session = Session::new(rig, &settings)?;
        let (mut fit, mut test) = (Vec::new(), Vec::new());
        for plan in TrialPlan::paper(seed) {
            let (entry, trial) = session.run(&plan)?;
            if entry.split == Split::Test { test.push(trial) } else { fit.push(trial) }
        }
        Ok(Self { fit, test })
    }

    /// Returns the paper's twelve ramps.
    pub(crate) fn ramps(&self) -> &[Trial] {
        &self.fit[..12]
    }

    pub(crate) fn arbitrary(&self) -> &[Trial] {
        &self.test[..2]
    }

    pub(crate) fn pulses(&self) -> &[Trial] {
        &self.test[2..]
    }
}

/// A fault of a log to which a calibration is applied. The calibration was fitted without the fault.
#[derive(Clone, Copy)]
pub(crate) enum Fault {
    /// White noise, relative to the signal's range.
    Noise(f64),
    /// Errors of the time stamps of up to this many seconds in both directions.
    Jitter(f64),
    /// Share of samples that are lost.
    Dropped(f64),
    /// Drift of the signal over the trial, relative to its range.
    Drift(f64),
}

impl Fault {
    pub(crate) fn apply(self, trial: &Trial, signal: &str, seed: u64) -> Trial {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut out = trial.clone();
        let values = trial.channel(signal).unwrap_or(&[]).to_vec();
        let (low, high) =
            values.iter().fold((f64::MAX, f64::MIN), |(a, b), &v| (a.min(v), b.max(v)));
        let span = high - low;
        match self {
            Self::Noise(share) => {
                for x in channel(&mut out, signal) {
                    // The sum of twelve uniform numbers minus 6 is nearly normal.
                    let normal: f64 = (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
                    *x += share * span * normal;
                }
            }
            Self::Jitter(seconds) => {
                // The sample is taken late or early, but its stamp shows the nominal time.
                let times = &trial.time_s;
                let moved: Vec<f64> = times
                    .iter()
                    .map(|t| {
                        between(times, &values, t + seconds * (2.0 * random.random::<f64>() - 1.0))
                    })
                    .collect();
                channel(&mut out, signal).copy_from_slice(&moved);
            }
            Self::Dropped(share) => {
                let kept: Vec<usize> =
                    (0..trial.len()).filter(|_| random.random::<f64>() >= share).collect();
                out.time_s = kept.iter().map(|&i| trial.time_s[i]).collect();
                for (own, whole) in out.channels.iter_mut().zip(&trial.channels) {
                    own.values = kept.iter().map(|&i| whole.values[i]).collect();
                }
            }
            Self::Drift(share) => {
                let n = trial.len() as f64;
                for (i, x) in channel(&mut out, signal).iter_mut().enumerate() {
                    *x += share * span * i as f64 / n;
                }
            }
        }
        out
    }
}

fn channel<'a>(trial: &'a mut Trial, name: &str) -> &'a mut [f64] {
    match trial.channels.iter_mut().find(|c| c.name == name) {
        Some(channel) => &mut channel.values,
        None => &mut [],
    }
}

fn between(times: &[f64], values: &[f64], at: f64) -> f64 {
    let next = times.partition_point(|&t| t < at).clamp(1, times.len() - 1);
    let (a, b) = (times[next - 1], times[next]);
    let share = ((at - a) / (b - a)).clamp(0.0, 1.0);
    values[next - 1] + share * (values[next] - values[next - 1])
}

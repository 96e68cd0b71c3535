//! How near a foretelling comes.

use serde::Serialize;
use stretch_gap::StageSpec;

use super::excited::Unexcited;

/// What a fixed simulator foretells of new recordings, beside what it foretells without its fix. Its serde form is the JSON of
/// `stretch foretell`, schema 1; traces are left out of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Foretold {
    /// Version of this schema: 1.
    pub schema: u32,
    /// Name of the problem.
    pub name: String,
    /// Effects of the fix.
    pub effects: Vec<String>,
    /// Sample time, s.
    pub dt_s: f64,
    /// The new recordings; a recording with a long gap has several parts.
    pub trials: Vec<ForetoldTrial>,
    /// What was noticed, in sentences.
    pub notes: Vec<String>,
}

/// A new recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ForetoldTrial {
    /// Its name.
    pub name: String,
    /// How long it is, s.
    pub seconds: f64,
    /// Its outputs, in the order of the stages.
    pub outputs: Vec<ForetoldOutput>,
    /// Where the fix must not be believed: what the fitted recordings did not excite.
    pub unexcited: Vec<Unexcited>,
}

/// An output of a new recording, measured and foretold.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ForetoldOutput {
    /// The stage.
    pub stage: String,
    /// Column of the output.
    pub column: String,
    /// Unit of the output.
    pub unit: String,
    /// Noise of the output, one standard deviation.
    pub noise: f64,
    /// Root mean square error with the fix, in the unit.
    pub rmse: f64,
    /// The same without the fix, parameters re-tuned.
    pub rmse_without: f64,
    /// Root mean square error with the fix in multiples of the noise.
    pub times_noise: f64,
    /// The same without the fix.
    pub times_noise_without: f64,
    /// Error with the fix over error without it: below 1 the fix helps.
    pub ratio: f64,
    /// The measured samples.
    #[serde(skip)]
    pub measured: Vec<f64>,
    /// What the fix foretells.
    #[serde(skip)]
    pub with: Vec<f64>,
    /// What the re-tuned nominal foretells.
    #[serde(skip)]
    pub without: Vec<f64>,
}

impl ForetoldOutput {
    /// Scores samples: measured, foretold with the fix, and without.
    pub(super) fn new(spec: &StageSpec, noise: f64, samples: [Vec<f64>; 3]) -> Self {
        let [measured, with, without] = samples;
        let (rmse, rmse_without) = (rms(&measured, &with), rms(&measured, &without));
        let in_noise = |rmse: f64| rmse / noise.max(f64::MIN_POSITIVE);
        Self {
            stage: spec.name.clone(),
            column: spec.channel.clone(),
            unit: spec.unit.clone(),
            noise,
            rmse,
            rmse_without,
            times_noise: in_noise(rmse),
            times_noise_without: in_noise(rmse_without),
            ratio: rmse / rmse_without.max(f64::MIN_POSITIVE),
            measured,
            with,
            without,
        }
    }
}

fn rms(a: &[f64], b: &[f64]) -> f64 {
    let squares: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
    (squares / a.len().max(1) as f64).sqrt()
}

impl Foretold {
    /// All outputs of all recordings.
    pub fn outputs(&self) -> impl Iterator<Item = &ForetoldOutput> {
        self.trials.iter().flat_map(|trial| &trial.outputs)
    }

    /// The greatest error with the fix of any output of any recording, in multiples of the noise: what `--fail-above` looks at.
    pub fn worst(&self) -> f64 {
        self.outputs().map(|output| output.times_noise).fold(0.0, f64::max)
    }

    /// Geometric mean of the ratios of the errors.
    pub fn ratio(&self) -> f64 {
        let (sum, count) =
            self.outputs().fold((0.0, 0.0), |(sum, n), o| (sum + o.ratio.ln(), n + 1.0));
        if count > 0.0 { f64::exp(sum / count) } else { f64::NAN }
    }

    /// The result in a sentence.
    pub fn sentence(&self) -> String {
        let all = self.outputs().count();
        let helped = self.outputs().filter(|o| o.ratio < 1.0).count();
        let left = self.trials.iter().filter(|t| !t.unexcited.is_empty()).count();
        let beyond = match left {
            0 => "; nothing goes beyond what was fitted".to_owned(),
            left => format!("; {left} of {} go beyond what was fitted", count(self.trials.len())),
        };
        format!(
            "with {} the simulator foretells {helped} of {all} outputs of {} better than re-tuned without: its error is {:.2} of that one's (geometric mean), {:.1} times the noise at most{beyond}",
            self.effects.join(" and "),
            count(self.trials.len()),
            self.ratio(),
            self.worst(),
        )
    }
}

/// `1 new recording`, `2 new recordings`.
fn count(recordings: usize) -> String {
    format!("{recordings} new recording{}", if recordings == 1 { "" } else { "s" })
}

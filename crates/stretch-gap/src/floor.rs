//! The floor of every stage: what no deterministic model could remove.
//!
//! ```text
//! sigma_i^2 = sigma_own^2 + mean over draws and neighbours of (f(x + noise)_i - f(x)_i)^2
//! ```
//!
//! Teacher forcing feeds a stage f with a *measured* input x, whose noise the stage transmits: an error in variables, which would pose
//! as a gap where the output is steep.

use rayon::prelude::*;
use stretch_filter::log::second_differences;

use crate::{
    error::GapError,
    frame::{Frame, Role},
    noise::Noise,
    runs::Runs,
    simulator::{Model, Run, Simulator},
};

/// Floor of one stage.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Floor {
    /// One standard deviation at every sample of all trials, in the unit of the output; infinite where nothing was measured.
    pub(crate) sd: Vec<f64>,
    /// Root mean square of it.
    pub(crate) rms: f64,
    pub(crate) source: String,
}

/// Draws of the inputs' noise.
const DRAWS: u64 = 12;
/// Half-width over which what arrives of them is averaged, in samples.
const NEAR: usize = 12;

/// Classes of speed that jitter is looked for in, and the share of the noise's variance from which it counts.
const SPEEDS: usize = 10;
const LEAST_JITTER: f64 = 0.05;
/// Lower quartile of a squared normal variable: what a model bends wrongly, it bends in few samples by much.
const QUARTER: f64 = 0.1015;

/// Floors of all stages around a model.
///
/// The variance of the floor is that of the output's own noise, known or taken from the record's second differences,
/// plus the *noise transmitted*: what of the measured input's noise arrives at the output, by Monte Carlo with the
/// same draws for every model. It is larger where the output is steep or the input too quick to be smoothed, so the floor is one
/// of every sample.
pub(crate) fn floors_of(
    runs: &Runs<'_>,
    frame: &Frame,
    model: &Model,
    seed: u64,
) -> Result<Vec<Floor>, GapError> {
    let stages = 0..runs.simulator().stages().len();
    stages.into_par_iter().map(|stage| floor(runs, frame, stage, model, seed)).collect()
}

fn floor(
    runs: &Runs<'_>,
    frame: &Frame,
    stage: usize,
    model: &Model,
    seed: u64,
) -> Result<Floor, GapError> {
    let simulator = runs.simulator();
    let arrived = transmitted(runs, stage, model, seed)?;
    let samples = arrived.len();
    let noise = match &simulator.stages()[stage].noise {
        Some(noise) => noise.clone(),
        None => of_record(simulator, frame, stage),
    };
    let (own, mut source) = (noise.sd().powi(2), noise.source().to_owned());
    let jitter = jitter(runs, frame, stage, model, &arrived, own)?;
    let mean = (arrived.iter().sum::<f64>() + jitter.iter().sum::<f64>()) / samples.max(1) as f64;
    if arrived.iter().any(|a| *a > 1e-4 * own) {
        source += ", and the measured input's noise";
    }
    if !jitter.is_empty() {
        source += ", and jitter of the clock";
    }
    let mut sd = Vec::with_capacity(samples);
    let mut begin = 0;
    for trial in simulator.trials() {
        let part = &arrived[begin..begin + trial.samples];
        let shaken = jitter.get(begin..begin + trial.samples).unwrap_or(&[]);
        begin += trial.samples;
        for i in 0..part.len() {
            // A dozen draws tell a variance to 40 % only: neighbours of the same trial lend theirs.
            let near = &part[i.saturating_sub(NEAR)..(i + NEAR + 1).min(part.len())];
            let local = near.iter().sum::<f64>() / near.len() as f64;
            let shaken = shaken.get(i).copied().unwrap_or(0.0);
            sd.push((own + local + shaken).sqrt().max(1e-12));
        }
    }
    // What was not measured weighs nothing.
    for (sd, _) in sd.iter_mut().zip(simulator.is_lost()).filter(|(_, lost)| **lost) {
        *sd = f64::INFINITY;
    }
    Ok(Floor { sd, rms: (own + mean).sqrt().max(1e-12), source })
}

/// Variance that jitter of the sampling clock causes at every sample; empty where there is none to speak of.
///
/// A sample taken a time d too late is off by x' d, x' the slope of the output: the residual's second differences have the
/// variance 6 (sigma^2 + x'^2 sigma_d^2), beside what arrives of the input's noise. Lower quartiles in classes of equal count of |x'|
/// tell sigma_d from the slowest to the quickest.
fn jitter(
    runs: &Runs<'_>,
    frame: &Frame,
    stage: usize,
    model: &Model,
    arrived: &[f64],
    own: f64,
) -> Result<Vec<f64>, GapError> {
    let simulator = runs.simulator();
    let output = runs.output(stage, model, simulator.trials().len())?;
    let measured = simulator.measured(stage);
    let slope = |i: usize| 0.5 * (output[i + 1] - output[i - 1]);
    // Slope, squared second difference, and what of the input's noise is known to arrive.
    let mut seen: Vec<(f64, f64, f64)> = Vec::new();
    for segment in frame.segments.iter().filter(|s| s.role != Role::Test) {
        let residual: Vec<f64> =
            (segment.from..segment.to).map(|i| measured[i] - output[i]).collect();
        for (k, bend) in second_differences(&residual).enumerate() {
            let i = segment.from + k + 1;
            if i + 1 < segment.to {
                seen.push((slope(i).abs(), bend * bend, arrived[i]));
            }
        }
    }
    seen.sort_by(|a, b| a.0.total_cmp(&b.0));
    let classes = seen.chunks((seen.len() / SPEEDS).max(1)).map(|class| {
        let mut squares: Vec<f64> = class.iter().map(|c| c.1).collect();
        let at = squares.len() / 4;
        let quarter = *squares.select_nth_unstable_by(at, f64::total_cmp).1;
        let mean = |of: fn(&(f64, f64, f64)) -> f64| {
            class.iter().map(of).sum::<f64>() / class.len() as f64
        };
        (mean(|c| c.0 * c.0), quarter / 6.0 / QUARTER - mean(|c| c.2))
    });
    let classes: Vec<(f64, f64)> = classes.collect();
    let (slow, quick) = classes.split_at(classes.len() / 2);
    let mean = |part: &[(f64, f64)], of: fn(&(f64, f64)) -> f64| {
        part.iter().map(of).sum::<f64>() / part.len().max(1) as f64
    };
    let (noise, speed) = (mean(slow, |c| c.1), mean(slow, |c| c.0));
    // The median of the classes' answers: one in which the model bends the wrong way does not count.
    let mut answers: Vec<f64> = quick.iter().map(|c| (c.1 - noise) / (c.0 - speed)).collect();
    answers.sort_by(f64::total_cmp);
    let variance = answers.get(answers.len() / 2).copied().unwrap_or(0.0);
    let largest = quick.iter().map(|c| c.0).fold(0.0, f64::max) * variance;
    if !(largest.is_finite() && largest > LEAST_JITTER * own) {
        return Ok(Vec::new());
    }
    let at = |i: usize| if i == 0 || i + 1 == output.len() { 0.0 } else { slope(i) };
    Ok((0..output.len()).map(|i| at(i).powi(2) * variance).collect())
}

/// Variance that the measured input's noise causes at every sample of the output.
fn transmitted(
    runs: &Runs<'_>,
    stage: usize,
    model: &Model,
    seed: u64,
) -> Result<Vec<f64>, GapError> {
    let trials = runs.simulator().trials().len();
    let run = Run { stage, model, trials, shake: None, step: 1.0 };
    let plain = runs.run(run)?;
    let mut arrived = vec![0.0; plain.len()];
    for draw in 0..DRAWS {
        let shaken = runs.run(Run { shake: Some(seed + 1000 * draw), ..run })?;
        let mut any = false;
        for ((sum, a), b) in arrived.iter_mut().zip(&plain).zip(&shaken) {
            *sum += (a - b) * (a - b) / DRAWS as f64;
            any |= a != b;
        }
        // A stage whose input is commanded transmits nothing.
        if !any {
            break;
        }
    }
    Ok(arrived)
}

/// Noise of the output of a stage, from the samples that may be looked at.
fn of_record(simulator: &dyn Simulator, frame: &Frame, stage: usize) -> Noise {
    let measured = simulator.measured(stage);
    let segments = frame.segments.iter().filter(|s| s.role != Role::Test);
    Noise::of_differences(segments.map(|s| &measured[s.from..s.to]), simulator.dt_s())
}

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
    runs::Runs,
    simulator::{Model, Run, Simulator},
};

/// Floor of one stage.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Floor {
    /// One standard deviation at every sample of all trials, in the unit of the output.
    pub(crate) sd: Vec<f64>,
    /// Root mean square of it.
    pub(crate) rms: f64,
    pub(crate) source: String,
}

/// Draws of the inputs' noise.
const DRAWS: u64 = 12;
/// Half-width over which what arrives of them is averaged, in samples.
const NEAR: usize = 12;

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
    let (own, mut source) = match simulator.stages()[stage].noise {
        Some(noise) => (noise * noise, "known noise of the channel".to_owned()),
        None => (of_record(simulator, frame, stage), "second differences of the record".to_owned()),
    };
    let mean = arrived.iter().sum::<f64>() / samples.max(1) as f64;
    if mean > 1e-4 * own {
        source += ", and the measured input's noise";
    }
    let mut sd = Vec::with_capacity(samples);
    let mut begin = 0;
    for trial in simulator.trials() {
        let part = &arrived[begin..begin + trial.samples];
        begin += trial.samples;
        for i in 0..part.len() {
            // A dozen draws tell a variance to 40 % only: neighbours of the same trial lend theirs.
            let near = &part[i.saturating_sub(NEAR)..(i + NEAR + 1).min(part.len())];
            let local = near.iter().sum::<f64>() / near.len() as f64;
            sd.push((own + local).sqrt().max(1e-12));
        }
    }
    Ok(Floor { sd, rms: (own + mean).sqrt().max(1e-12), source })
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

/// Noise variance of the output of a stage, from the samples that may be looked at.
fn of_record(simulator: &dyn Simulator, frame: &Frame, stage: usize) -> f64 {
    let measured = simulator.measured(stage);
    let segments = frame.segments.iter().filter(|s| s.role != Role::Test);
    noise_variance(segments.map(|s| &measured[s.from..s.to]), simulator.dt_s())
}

/// Noise variance of a record: a sixth of the median square of its second differences, corrected for the median of a
/// normal variable's square; robust against what the motion adds. What the mains add is not noise: in every second
/// the waves of 50 and 60 Hz are taken out before.
///
/// Second differences d_i = x_(i-1) - 2 x_i + x_(i+1) of white noise have the variance (1 + 4 + 1) sigma^2, and the median of a squared
/// normal variable is 0.4549 of its mean: sigma^2 = median(d^2)/(6 * 0.4549). `dt_s` is the sample time, s; the answer has the unit of the
/// record squared.
///
/// ```
/// use stretch_gap::{Dice, noise_variance};
/// let mut dice = Dice::new(1, 0);
/// let record: Vec<f64> = (0..20_000).map(|i| (1e-3 * f64::from(i)).sin() + 0.2 * dice.gauss()).collect();
/// let sd = noise_variance([record.as_slice()].into_iter(), 0.01).sqrt();
/// assert!((sd - 0.2).abs() < 0.01);
/// ```
pub fn noise_variance<'a>(stretches: impl Iterator<Item = &'a [f64]>, dt_s: f64) -> f64 {
    let window = ((1.0 / dt_s).round() as usize).max(30);
    let mut squares: Vec<f64> = Vec::new();
    for stretch in stretches {
        let mut bends: Vec<f64> = second_differences(stretch).collect();
        for part in bends.chunks_mut(window) {
            let taken = take_waves_out(part, dt_s) / part.len() as f64;
            squares.extend(part.iter().map(|x| x * x / (1.0 - taken.min(0.5))));
        }
    }
    if squares.is_empty() {
        return 1e-12;
    }
    let mean = squares.iter().sum::<f64>() / squares.len() as f64 / 6.0;
    let middle = squares.len() / 2;
    let median = *squares.select_nth_unstable_by(middle, f64::total_cmp).1 / 6.0 / 0.4549;
    // A coarse converter makes the median 0.
    if median > 1e-3 * mean { median } else { mean.max(1e-18) }
}

/// Takes the waves of the mains out of a second of second differences, one after the other; how many samples' worth of
/// white noise went with them.
fn take_waves_out(values: &mut [f64], dt_s: f64) -> f64 {
    let mut taken = 0.0;
    for hertz in [50.0, 60.0] {
        let turns: f64 = hertz * dt_s;
        let shown = (turns - turns.round()).abs();
        // What shows as a slow wave cannot be told from motion.
        if shown < 0.15 || values.len() < 20 {
            continue;
        }
        for phase in [0.0, 0.25] {
            let wave = |i: usize| (std::f64::consts::TAU * (shown * i as f64 + phase)).cos();
            let power: f64 = (0..values.len()).map(|i| wave(i).powi(2)).sum();
            // At half the sample rate there is one wave only.
            if power < 1e-6 * values.len() as f64 {
                continue;
            }
            let size = values.iter().enumerate().map(|(i, x)| x * wave(i)).sum::<f64>() / power;
            values.iter_mut().enumerate().for_each(|(i, x)| *x -= size * wave(i));
            // Of white noise, second differences hold (2 - 2 cos)^2 of each wave, and 6 on the average.
            taken += (2.0 - 2.0 * (std::f64::consts::TAU * shown).cos()).powi(2) / 6.0;
        }
    }
    taken
}

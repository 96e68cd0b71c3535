//! Estimates the noise of every stage: the part of its output that no deterministic model could
//! reproduce.
//!
//! ```text
//! sigma_i^2 = sigma_own^2 + mean over draws and neighbours of (f(x + noise)_i - f(x)_i)^2
//! ```
//!
//! sigma_own is the noise of the output itself. The second part is the transmitted noise: a stage f
//! runs on its *measured* input x (teacher forcing) and passes the noise of x on to its output.
//! Without this part, the noise of the input would look like a gap where the output is steep.

use rayon::prelude::*;

use crate::{
    fit::isolated_outliers::isolated,
    problem::{
        error::GapError,
        noise::Noise,
        runs::Runs,
        sample_roles::SampleRoles,
        simulator::{Model, Run, Simulator},
        spec::TrialSpec,
    },
};

/// Noise of one stage.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NoiseLevel {
    /// One standard deviation at every sample of all trials, in the unit of the output; infinite where nothing was measured and where a
    /// sample [is isolated](crate::fit::isolated_outliers).
    pub(crate) sd: Vec<f64>,
    /// Root mean square of the noise.
    pub(crate) rms: f64,
    pub(crate) source: String,
    /// Relative standard deviation with which the variance of the output's own noise is known.
    pub(crate) known_to: f64,
    /// Number of samples that [are isolated](crate::fit::isolated_outliers).
    pub(crate) isolated: usize,
}

/// Number of draws of the noise of the inputs.
const DRAWS: u64 = 12;
/// Half-width over which the transmitted variance is averaged, in samples.
const NEAR: usize = 12;

/// Computes the noise of all stages around a model.
///
/// The variance is a sum of two parts. The first is the output's own noise: known, or estimated from the second
/// differences of the recording, or from those of the residual if these are clearly smaller. The second is the
/// *transmitted noise*, the part of the measured input's noise that reaches the output. It is computed by Monte Carlo
/// with the same draws for every model. It differs from sample to sample, because it is larger where the output is
/// steep or the input is too fast to be smoothed.
pub(crate) fn noise_levels(
    runs: &Runs<'_>,
    roles: &SampleRoles,
    model: &Model,
    seed: u64,
) -> Result<Vec<NoiseLevel>, GapError> {
    let stages = 0..runs.simulator().stages().len();
    stages.into_par_iter().map(|stage| noise_level(runs, roles, stage, model, seed)).collect()
}

fn noise_level(
    runs: &Runs<'_>,
    roles: &SampleRoles,
    stage: usize,
    model: &Model,
    seed: u64,
) -> Result<NoiseLevel, GapError> {
    let simulator = runs.simulator();
    let output = runs.output(stage, model, simulator.trials().len())?;
    let arrived = transmitted(runs, stage, model, &output, seed)?;
    let samples = arrived.len();
    let noise = match &simulator.stages()[stage].noise {
        Some(noise) => noise.clone(),
        None => of_record(simulator, roles, stage),
    };
    let left = simulator.measured(stage).iter().zip(&output).map(|(m, s)| m - s);
    let left: Vec<f64> = left.collect();
    let looked = roles.looked_at().map(|s| &left[s.from..s.to]);
    let noise = noise.at_most_left(looked, simulator.dt_s());
    let (own, mut source) = (noise.sd().powi(2), noise.source().to_owned());
    let known_to = noise.known_to();
    let mean = arrived.iter().sum::<f64>() / samples.max(1) as f64;
    if mean > 1e-4 * own {
        source += ", and the measured input's noise";
    }
    let trials = TrialSpec::ranges(simulator.trials());
    let mut sd = Vec::with_capacity(samples);
    for trial in &trials {
        let part = &arrived[trial.clone()];
        for i in 0..part.len() {
            // Twelve draws determine a variance only to 40 %, so average over neighbouring samples
            // in the same trial.
            let near = &part[i.saturating_sub(NEAR)..(i + NEAR + 1).min(part.len())];
            let local = near.iter().sum::<f64>() / near.len() as f64;
            sd.push((own + local).sqrt().max(1e-12));
        }
    }
    // Samples that were not measured get no weight; nor do isolated outliers (below).
    for (sd, _) in sd.iter_mut().zip(&simulator.record().is_lost).filter(|(_, lost)| **lost) {
        *sd = f64::INFINITY;
    }
    let apart = simulator.measured(stage).iter().zip(&output).zip(&sd);
    let residual: Vec<f64> = apart.map(|((m, s), sd)| (m - s) / sd).collect();
    let pairs = output.iter().zip(output.iter().skip(1)).zip(&sd[1.min(samples)..]);
    let moves: Vec<f64> =
        std::iter::once(0.0).chain(pairs.map(|((a, b), sd)| (b - a) / sd)).collect();
    let alone = isolated(&residual, &moves, trials.into_iter());
    alone.iter().for_each(|&i| sd[i] = f64::INFINITY);
    let (rms, isolated) = ((own + mean).sqrt().max(1e-12), alone.len());
    Ok(NoiseLevel { sd, rms, source, known_to, isolated })
}

/// Returns the variance that the measured input's noise causes at every sample of the output.
/// `undisturbed` is the output without this noise.
fn transmitted(
    runs: &Runs<'_>,
    stage: usize,
    model: &Model,
    undisturbed: &[f64],
    seed: u64,
) -> Result<Vec<f64>, GapError> {
    let trials = runs.simulator().trials().len();
    let run = Run::exact(stage, model, trials);
    let mut arrived = vec![0.0; undisturbed.len()];
    for draw in 0..DRAWS {
        let other = runs.run(Run { input_noise: Some(seed + 1000 * draw), ..run })?;
        let mut any = false;
        for ((sum, a), b) in arrived.iter_mut().zip(undisturbed).zip(&other) {
            *sum += (a - b) * (a - b) / DRAWS as f64;
            any |= a != b;
        }
        // A stage whose input is a command transmits no noise.
        if !any {
            break;
        }
    }
    Ok(arrived)
}

/// Estimates the noise of a stage's output from the samples that are not test samples.
fn of_record(simulator: &dyn Simulator, roles: &SampleRoles, stage: usize) -> Noise {
    let measured = simulator.measured(stage);
    Noise::of_differences(roles.looked_at().map(|s| &measured[s.from..s.to]), simulator.dt_s())
}

//! The floor of every stage: what no deterministic model could remove.

use rayon::prelude::*;

use crate::{
    error::GapError,
    frame::{Frame, Role},
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

/// Known noise of the output (else from second differences of the record), and what of the inputs' noise arrives: more
/// where the output is steep or the input too quick to be smoothed.
pub(crate) fn floors_of(
    simulator: &dyn Simulator,
    frame: &Frame,
    model: &Model,
    seed: u64,
) -> Result<Vec<Floor>, GapError> {
    (0..simulator.stages().len())
        .into_par_iter()
        .map(|stage| floor(simulator, frame, stage, model, seed))
        .collect()
}

fn floor(
    simulator: &dyn Simulator,
    frame: &Frame,
    stage: usize,
    model: &Model,
    seed: u64,
) -> Result<Floor, GapError> {
    let trials = simulator.trials().len();
    let samples = frame.samples(trials);
    let run = Run { stage, model, trials, shake: None, step: 1.0 };
    let mut plain = vec![0.0; samples];
    simulator.simulate(run, &mut plain)?;
    let mut arrived = vec![0.0; samples];
    for draw in 0..DRAWS {
        let mut shaken = vec![0.0; samples];
        simulator.simulate(Run { shake: Some(seed + 1000 * draw), ..run }, &mut shaken)?;
        let mut any = false;
        for ((sum, a), b) in arrived.iter_mut().zip(&plain).zip(&shaken) {
            *sum += (a - b) * (a - b) / DRAWS as f64;
            any |= a != b;
        }
        if !any {
            break;
        }
    }
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
            let near = &part[i.saturating_sub(NEAR)..(i + NEAR + 1).min(part.len())];
            let local = near.iter().sum::<f64>() / near.len() as f64;
            sd.push((own + local).sqrt().max(1e-12));
        }
    }
    Ok(Floor { sd, rms: (own + mean).sqrt().max(1e-12), source })
}

/// Noise variance of a record: a sixth of the median square of its second differences, corrected for the median of a
/// normal variable's square; robust against what the motion adds.
fn of_record(simulator: &dyn Simulator, frame: &Frame, stage: usize) -> f64 {
    let measured = simulator.measured(stage);
    let mut squares: Vec<f64> = frame
        .segments
        .iter()
        .filter(|s| s.role != Role::Test)
        .flat_map(|s| measured[s.from..s.to].windows(3))
        .map(|w| (w[0] - 2.0 * w[1] + w[2]).powi(2))
        .collect();
    if squares.is_empty() {
        return 1e-12;
    }
    squares.sort_by(f64::total_cmp);
    let median = squares[squares.len() / 2] / 6.0 / 0.4549;
    let mean = squares.iter().sum::<f64>() / squares.len() as f64 / 6.0;
    // A coarse converter makes the median 0.
    if median > 1e-3 * mean { median } else { mean.max(1e-18) }
}

//! The floor of every stage: what no deterministic model could remove.

use crate::{
    error::GapError,
    frame::{Frame, Role},
    simulator::{Model, Run, Simulator},
};

/// Floor of one stage.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Floor {
    /// One standard deviation, in the unit of the output.
    pub(crate) sd: f64,
    pub(crate) source: String,
}

/// Known noise of the output (else from second differences of the record), and what of the inputs' noise arrives.
pub(crate) fn floors(
    simulator: &dyn Simulator,
    frame: &Frame,
    model: &Model,
    seed: u64,
) -> Result<Vec<Floor>, GapError> {
    let trials = frame.fit_trials;
    let samples = frame.samples(trials);
    let mut floors = Vec::new();
    for (stage, spec) in simulator.stages().iter().enumerate() {
        let mut plain = vec![0.0; samples];
        let mut shaken = vec![0.0; samples];
        let run = Run { stage, model, trials, shake: None, step: 1.0 };
        simulator.simulate(run, &mut plain)?;
        simulator.simulate(Run { shake: Some(seed), ..run }, &mut shaken)?;
        let square: f64 = plain.iter().zip(&shaken).map(|(a, b)| (a - b) * (a - b)).sum();
        let arrived = square / samples.max(1) as f64;
        let (own, mut source) = match spec.noise {
            Some(noise) => (noise * noise, "known noise of the channel".to_owned()),
            None => {
                (of_record(simulator, frame, stage), "second differences of the record".to_owned())
            }
        };
        if arrived > 1e-4 * own {
            source += ", and the measured input's noise";
        }
        floors.push(Floor { sd: (own + arrived).sqrt().max(1e-12), source });
    }
    Ok(floors)
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

//! Tests on synthetic signals: each term, the library of terms, the odds that a sum of terms
//! explains a residual rather than coloured noise, and the texts of proposals.

mod shelf;
mod terms;
mod weighing;
mod words;

use crate::{
    missing::{
        SignalScale,
        term_inputs::{Signal, TermInputs, central_differences},
    },
    problem::sample_roles::{Role, SampleRoles, Segment},
};
use stretch_effects::Grid;

/// Sample time, s.
const DT_S: f64 = 0.01;

/// A signal whose rate is computed by central differences.
fn signal(name: &str, x: Vec<f64>, is_command: bool) -> Signal {
    let v = central_differences(&x, DT_S);
    let (name, unit) = (name.to_owned(), "mm".to_owned());
    let spec = SignalScale { name, unit, offset: 40.0, scale: 25.0, rate_per_s: 1.0, is_command };
    Signal { spec, x, v }
}

/// Signals over trials with the given numbers of samples, starting one minute apart.
fn inputs(signals: Vec<Signal>, samples: &[usize]) -> TermInputs {
    let mut end = 0;
    let trials: Vec<std::ops::Range<usize>> = samples
        .iter()
        .map(|samples| {
            end += samples;
            end - samples..end
        })
        .collect();
    TermInputs {
        signals,
        starts_s: (0..trials.len()).map(|i| 60.0 * i as f64).collect(),
        trial_s: DT_S * samples[0] as f64,
        session_s: 60.0 * trials.len() as f64,
        recorded_s: DT_S * samples[0] as f64,
        trials,
        grid: Grid::samples(DT_S).expect("a grid"),
    }
}

/// Roles in which each trial is fitted, except its last `held` samples, which are held out.
fn roles(samples: &[usize], held: usize) -> SampleRoles {
    let mut end = 0;
    let mut segments = Vec::new();
    for (trial, samples) in samples.iter().enumerate() {
        let from = end;
        end += samples;
        segments.push(Segment { trial, from, to: end - held, role: Role::Fit });
        if held > 0 {
            segments.push(Segment { trial, from: end - held, to: end, role: Role::Held });
        }
    }
    SampleRoles { segments, block: 50, fit_trials: samples.len(), borrowed_test: false }
}

/// A wave between 0 and 1 that starts at 0, with a period of 314 samples.
fn wave(samples: usize) -> Vec<f64> {
    (0..samples).map(|i| 0.5 - 0.5 * (0.02 * i as f64).cos()).collect()
}

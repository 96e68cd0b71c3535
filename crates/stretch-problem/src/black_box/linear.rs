//! A stage of a black box, linearised in its nominal parameters, to predict a run from a run with similar parameters.
//!
//! ```text
//! y(p) = y(p_near) + sum over i of J_i (p_i - p_near,i),     J_i = (y(p_0 + d_i) - y(p_0))/d_i
//! ```
//!
//! J is computed at p_0 and kept while fits stay near p_0 (a chord method). The run at p_near is exact. A trial point
//! of a fit therefore costs no run if it is a small step from an exact run. The values that a diagnosis reports come
//! from exact runs.

use std::sync::Arc;

use stretch_gap::ParameterSpec;

use crate::black_box::runs::Inner;

/// Step of a finite difference, in tolerances.
const STEP: f64 = 0.1;
/// Greatest change of a parameter for which a linearisation is reused, in tolerances.
const SERVES: f64 = 0.5;

/// Sensitivities of the output of one stage.
#[derive(Debug, Clone)]
pub(crate) struct Linear {
    at: Inner,
    /// For each parameter: its index, and the change of the output for one unit of the parameter.
    columns: Vec<(usize, Vec<f64>)>,
}

/// A parameter moved by a step.
#[derive(Debug, Clone)]
pub(crate) struct Move {
    pub(crate) parameter: usize,
    pub(crate) step: f64,
    pub(crate) inner: Inner,
}

impl Linear {
    /// The runs that a linearisation takes in addition to the run at p_0: each run moves one
    /// parameter that has a tolerance, downwards if an upward step would exceed its upper bound.
    pub(crate) fn moves(at: &Inner, own: &[usize], specs: &[ParameterSpec]) -> Vec<Move> {
        let tuned = own.iter().copied().filter(|&p| specs[p].sd > 0.0);
        tuned
            .map(|parameter| {
                let (spec, value) = (&specs[parameter], at.parameters[parameter]);
                let up = value + STEP * spec.sd;
                let step = if up > spec.greatest { -STEP * spec.sd } else { STEP * spec.sd };
                let mut inner = at.clone();
                inner.parameters[parameter] = value + step;
                // The step after rounding.
                Move { parameter, step: inner.parameters[parameter] - value, inner }
            })
            .collect()
    }

    /// Computes the linearisation from the outputs of the run at p_0 and of its moves.
    pub(crate) fn of(at: Inner, moves: &[Move], outputs: &[Arc<Vec<f64>>]) -> Self {
        let (unmoved, moved) = (&outputs[0], &outputs[1..]);
        let column = |(m, there): (&Move, &Arc<Vec<f64>>)| {
            let slopes = there.iter().zip(unmoved.iter()).map(|(a, b)| (a - b) / m.step);
            (m.parameter, slopes.collect())
        };
        Self { columns: moves.iter().zip(moved).map(column).collect(), at }
    }

    /// Number of trials that the linearisation covers.
    pub(crate) fn trials(&self) -> usize {
        self.at.trials
    }

    /// Whether the linearisation can be reused for another run. It covers the run's trials, effects
    /// and inputs are the same, and the stage's own parameters differ by at most half a tolerance.
    pub(crate) fn serves(&self, run: &Inner, own: &[usize], specs: &[ParameterSpec]) -> bool {
        let apart = |p: usize| (self.at.parameters[p] - run.parameters[p]).abs();
        let how = |inner: &Inner| -> Vec<(usize, Vec<u64>)> {
            inner.altered.iter().map(|a| (a.stage, a.how.clone())).collect()
        };
        self.at.trials >= run.trials
            && self.at.effects == run.effects
            && how(&self.at) == how(run)
            && own.iter().all(|&p| apart(p) <= SERVES * specs[p].sd)
    }

    /// Adds the change that follows from differences of the parameters to an output.
    pub(crate) fn shift(&self, apart: &[f64], out: &mut [f64]) {
        for (parameter, column) in self.columns.iter().filter(|(p, _)| apart[*p] != 0.0) {
            let by = apart[*parameter];
            out.iter_mut().zip(column).for_each(|(y, slope)| *y += by * slope);
        }
    }
}

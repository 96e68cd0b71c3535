//! A stage of a black box, linearised in its nominal parameters: what a run near by is told with.
//!
//! ```text
//! y(p) = y(p_near) + sum over i of J_i (p_i - p_near,i),     J_i = (y(p_0 + d_i) - y(p_0))/d_i
//! ```
//!
//! with J taken at p_0 and kept while fits stay around it (a chord). The run at p_near is exact. A probe of a fit, a small step from a
//! run that was just made, so costs no run; what is told in the end stands on exact runs.

use std::sync::Arc;

use stretch_gap::ParameterSpec;

use crate::black_box::runs::Inner;

/// Step of a difference, in tolerances.
const STEP: f64 = 0.1;
/// Tolerances within which a linearisation serves as it is.
const SERVES: f64 = 0.5;

/// Sensitivities of one stage.
#[derive(Debug, Clone)]
pub(crate) struct Linear {
    at: Inner,
    /// By parameter: its index, and the change of the output for one unit of it.
    columns: Vec<(usize, Vec<f64>)>,
}

/// A parameter moved by a step.
#[derive(Debug, Clone)]
pub(crate) struct Move {
    parameter: usize,
    step: f64,
    pub(crate) inner: Inner,
}

impl Linear {
    /// The runs beside one that it takes: each parameter that has a tolerance moved alone, downwards at its upper bound.
    pub(crate) fn moves(at: &Inner, own: &[usize], specs: &[ParameterSpec]) -> Vec<Move> {
        let tuned = own.iter().copied().filter(|&p| specs[p].sd > 0.0);
        tuned
            .map(|parameter| {
                let (spec, value) = (&specs[parameter], at.parameters[parameter]);
                let up = value + STEP * spec.sd;
                let step = if up > spec.greatest { -STEP * spec.sd } else { STEP * spec.sd };
                let mut inner = at.clone();
                inner.parameters[parameter] = value + step;
                // What was really added.
                Move { parameter, step: inner.parameters[parameter] - value, inner }
            })
            .collect()
    }

    /// From the outputs of the run itself and of its moves.
    pub(crate) fn of(at: Inner, moves: &[Move], outputs: &[Arc<Vec<f64>>]) -> Self {
        let (plain, moved) = (&outputs[0], &outputs[1..]);
        let column = |(m, there): (&Move, &Arc<Vec<f64>>)| {
            let slopes = there.iter().zip(plain.iter()).map(|(a, b)| (a - b) / m.step);
            (m.parameter, slopes.collect())
        };
        Self { columns: moves.iter().zip(moved).map(column).collect(), at }
    }

    /// Trials that it reaches over.
    pub(crate) fn trials(&self) -> usize {
        self.at.trials
    }

    /// Whether it does for a run as well: the same but for parameters within half a tolerance.
    pub(crate) fn serves(&self, run: &Inner, specs: &[ParameterSpec]) -> bool {
        let pairs = self.at.parameters.iter().zip(&run.parameters).zip(specs);
        let how = |inner: &Inner| inner.inputs.as_ref().map(|(_, how)| how.clone());
        self.at.trials >= run.trials
            && self.at.effects == run.effects
            && how(&self.at) == how(run)
            && pairs.into_iter().all(|((a, b), spec)| (a - b).abs() <= SERVES * spec.sd)
    }

    /// Moves an output by differences of the parameters.
    pub(crate) fn go(&self, apart: &[f64], out: &mut [f64]) {
        for (parameter, column) in self.columns.iter().filter(|(p, _)| apart[*p] != 0.0) {
            let by = apart[*parameter];
            out.iter_mut().zip(column).for_each(|(y, slope)| *y += by * slope);
        }
    }
}

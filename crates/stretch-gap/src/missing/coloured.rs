//! Decides whether a residual is a function of the recorded signals, or random in time. Two
//! hypotheses are compared on held-out samples, to which neither was fitted.
//!
//! | hypothesis | residual |
//! | --- | --- |
//! | function | a sum of terms (either many or a few) plus a stationary coloured process |
//! | coloured | a stationary coloured process alone, which depends on no recorded signal |
//!
//! Both processes are autoregressions of means over 0.1 s with a memory of 0.5 s. Their weights are
//! estimated from the fitted samples by least squares (Box and Jenkins 1970, chapter 7). With the
//! errors e of their one-step predictions in the held-out samples, and the variance s^2 of these
//! errors in the fitted samples, the score is
//!
//! ```text
//! L = -0.5 sum (ln 2 pi s^2 + e^2/s^2)
//! ```
//!
//! A function of slow signals is slow, so a coloured process predicts it, too, but not better than
//! the function does. If the residual switches or jumps independently of the signals, no term
//! improves the prediction. k terms that were chosen from a library of M cost k ln M.

use nalgebra::{DMatrix, DVector};

use crate::{
    numerics::linear::Cholesky,
    problem::sample_roles::{Role, SampleRoles},
};

/// Order of the autoregression.
const ORDER: usize = 5;
/// Number of means per block.
const PER_BLOCK: usize = 5;

/// Returns ln of the odds of a function against the coloured process alone, nats. `alone` is the
/// residual, `beside` the residual minus the function, both over whole segments and without
/// nuisances. `chosen` terms were chosen from `of`.
pub(crate) fn odds(
    roles: &SampleRoles,
    alone: &[f64],
    beside: &[f64],
    chosen: usize,
    of: usize,
) -> f64 {
    log_score(roles, beside) - log_score(roles, alone) - chosen as f64 * (of as f64).ln()
}

/// Returns L of the module documentation for the held-out samples.
fn log_score(roles: &SampleRoles, residual: &[f64]) -> f64 {
    let count = (roles.block / PER_BLOCK).max(1);
    let means = |role: Role| -> Vec<Vec<f64>> {
        let parts = roles.of_role(role).filter(|s| s.to <= residual.len());
        let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
        parts.map(|s| residual[s.from..s.to].chunks_exact(count).map(mean).collect()).collect()
    };
    let fitted = means(Role::Fit);
    // If there are no held-out samples, both hypotheses are scored on the fitted samples; only the
    // cost of the choice then guards against chance.
    let held = if roles.count(Role::Held) > 0 { means(Role::Held) } else { fitted.clone() };
    let weights = autoregression(&fitted);
    let (mut sum, mut n) = (0.0, 0.0);
    for e in fitted.iter().flat_map(|part| innovations(part, &weights)) {
        sum += e * e;
        n += 1.0;
    }
    let variance = (sum / f64::max(n, 1.0)).max(1e-12);
    let one = |e: f64| -0.5 * ((std::f64::consts::TAU * variance).ln() + e * e / variance);
    held.iter().flat_map(|part| innovations(part, &weights)).map(one).sum()
}

/// Returns the weights of the last [`ORDER`] means and of a constant, by least squares.
pub(super) fn autoregression(parts: &[Vec<f64>]) -> Vec<f64> {
    let n = ORDER + 1;
    let (mut normal, mut right) = (DMatrix::zeros(n, n), DVector::zeros(n));
    for window in parts.iter().flat_map(|part| part.windows(ORDER + 1)) {
        let row = DVector::from_fn(n, |i, _| if i < ORDER { window[i] } else { 1.0 });
        normal.ger(1.0, &row, &row, 1.0);
        right.axpy(window[ORDER], &row, 1.0);
    }
    let mut weights: Vec<f64> = right.iter().copied().collect();
    Cholesky::of(normal).solve(&mut weights);
    weights
}

/// Returns the part of the residual that the weights do not predict.
pub(super) fn innovations<'a>(
    part: &'a [f64],
    weights: &'a [f64],
) -> impl Iterator<Item = f64> + 'a {
    part.windows(ORDER + 1).map(move |window| {
        let told: f64 = window[..ORDER].iter().zip(weights).map(|(x, w)| x * w).sum();
        window[ORDER] - told - weights[ORDER]
    })
}

//! Decides whether a residual is a function of what was recorded, or random in time. Two hypotheses
//! are weighed on samples that neither was fitted to.
//!
//! | hypothesis | residual |
//! | --- | --- |
//! | function | many terms at once, or a few, and a stationary coloured process of what they leave |
//! | coloured | a stationary coloured process alone, that looks at no input |
//!
//! Both processes are autoregressions, fitted by least squares on the fitted samples (Box and
//! Jenkins 1970, chapter 7) to means over a tenth of a second, with a memory of 0.5 s. Their
//! one-step predictions of the held-out samples are scored by
//!
//! ```text
//! L = -0.5 sum (ln 2 pi s^2 + e^2/s^2)
//! ```
//!
//! A function of slow inputs is slow, so a coloured process predicts it, too, but no better than
//! the function does. Noise that switches or jumps independently is predicted no better by any
//! term. A sum of k terms was chosen from a library of M, which costs ln M for each.

use nalgebra::{DMatrix, DVector};

use crate::{
    numerics::linear::Cholesky,
    problem::sample_roles::{Role, SampleRoles},
};

/// Order of the autoregression.
const ORDER: usize = 5;
/// Means per block.
const PER_BLOCK: usize = 5;

/// ln of the odds of a function against the coloured process alone, nats; both residuals over whole
/// segments, without nuisances.
pub(crate) fn odds(
    roles: &SampleRoles,
    alone: &[f64],
    beside: &[f64],
    chosen: usize,
    of: usize,
) -> f64 {
    log_score(roles, beside) - log_score(roles, alone) - chosen as f64 * (of as f64).ln()
}

/// L of the held-out samples.
fn log_score(roles: &SampleRoles, residual: &[f64]) -> f64 {
    let count = (roles.block / PER_BLOCK).max(1);
    let means = |role: Role| -> Vec<Vec<f64>> {
        let parts = roles.of_role(role).filter(|s| s.to <= residual.len());
        let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
        parts.map(|s| residual[s.from..s.to].chunks_exact(count).map(mean).collect()).collect()
    };
    let fitted = means(Role::Fit);
    // Without held-out samples both are scored on the fitted ones; only the cost of the choice is
    // left.
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

/// Weights of the last [`ORDER`] means and a constant, by least squares.
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

/// Residual that the weights do not predict.
pub(super) fn innovations<'a>(
    part: &'a [f64],
    weights: &'a [f64],
) -> impl Iterator<Item = f64> + 'a {
    part.windows(ORDER + 1).map(move |window| {
        let told: f64 = window[..ORDER].iter().zip(weights).map(|(x, w)| x * w).sum();
        window[ORDER] - told - weights[ORDER]
    })
}

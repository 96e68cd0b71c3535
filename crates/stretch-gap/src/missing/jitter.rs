//! Tests whether time stamps jitter. If they do, the noise follows the rate of the signal.
//!
//! A sample that is taken at a random time away from its stamp shows the signal of that time. In
//! addition to the noise of the sensor, r then has a part of the standard deviation `sd_s |dy/dt|`
//! that is independent of the previous sample. What an autoregression does not predict of r,
//!
//! ```text
//! e_i = r_i - sum w_k r_{i-k},   var e_i = a + b g_i,   g_i = v_i^2 + sum w_k^2 v_{i-k}^2
//! ```
//!
//! with v the rate of the simulated output, has b = `sd_s`^2 if time stamps jitter, whatever the
//! colour of the rest. Three hypotheses are weighed by their likelihoods at their best scales:
//!
//! | hypothesis | scale of e |
//! | --- | --- |
//! | constant | a |
//! | by level | a + b (y - mean)^2: a sensor whose noise grows with its value |
//! | jitter | a + b g |
//!
//! In all three, e follows Student's t with 3, 10 or 1e6 (Gaussian) degrees of freedom, so that a
//! few jumps do not count as scale (Lange, Little and Taylor 1989, doi
//! 10.1080/01621459.1989.10478852). The second parameter costs half of ln n. Jitter is accepted if
//! it is the most likely cause and if it explains as large a share of the residual beyond the noise
//! as a [course in time](super::course) has to explain. Errors of samples that are late, or wrong
//! whenever the signal moves, are predicted by the previous sample and leave little in e.

use crate::missing::{
    coloured::{autoregression, innovations},
    term_inputs::central_differences,
};

/// Degrees of freedom; the last is Gaussian.
const DEGREES: [f64; 3] = [3.0, 10.0, 1e6];
/// Logarithms of b over a at the mean of the regressor: jitter from a hundredth of the noise's
/// variance to a million times it.
const RATIOS: [f64; 2] = [-4.6, 13.8];
/// Steps of a golden section over these logarithms, which determine them to a hundredth, and steps
/// of the fixed-point iteration of the scale.
const SECTIONS: usize = 16;
const ROUNDS: usize = 12;
/// Fewest samples for a comparison: a scale, a slope, and the weights of the past have to be
/// estimated.
const LEAST: usize = 60;

/// Standard deviation of the time between samples and their stamps, s; `None` if something else
/// explains the residual better.
///
/// `stretches` are residuals in multiples of the noise; `shown` is the simulated value of each
/// sample in the same unit; `dt_s` is the sample time. Jitter has to explain a sum of squares of
/// `least`.
pub(super) fn jitter_sd_s(
    stretches: &[&[f64]],
    shown: &[Vec<f64>],
    dt_s: f64,
    least: f64,
) -> Option<f64> {
    let parts: Vec<Vec<f64>> = stretches.iter().map(|s| s.to_vec()).collect();
    let rates: Vec<Vec<f64>> = shown.iter().map(|y| central_differences(y, dt_s)).collect();
    let weights = autoregression(&parts);
    let order = weights.len() - 1;
    let e: Vec<f64> = parts.iter().flat_map(|part| innovations(part, &weights)).collect();
    let n = e.len() as f64;
    let all = || shown.iter().flatten();
    let mean = all().sum::<f64>() / all().count().max(1) as f64;
    let by_rate = |window: &[f64]| {
        let past = window[..order].iter().zip(&weights).map(|(v, w)| (w * v) * (w * v));
        window[order] * window[order] + past.sum::<f64>()
    };
    let g: Vec<f64> = rates.iter().flat_map(|v| v.windows(order + 1)).map(by_rate).collect();
    let by_level = |window: &[f64]| (window[order] - mean).powi(2);
    let level: Vec<f64> = shown.iter().flat_map(|y| y.windows(order + 1)).map(by_level).collect();
    let is_usable = |x: &[f64]| x.iter().sum::<f64>() > 0.0 && x.iter().all(|x| x.is_finite());
    if e.len() < LEAST || !is_usable(&g) || !e.iter().all(|e| e.is_finite()) {
        return None;
    }
    let cost = 0.5 * n.ln();
    let constant = best(&e, None).log_likelihood;
    let jitter = best(&e, Some(&g));
    let leveled = if is_usable(&level) { best(&e, Some(&level)).log_likelihood } else { constant };
    if jitter.log_likelihood - cost <= constant || jitter.log_likelihood <= leveled {
        return None;
    }
    let variance_s2 = jitter.slope;
    let made: f64 = variance_s2 * rates.iter().flatten().map(|v| v * v).sum::<f64>();
    (made >= least).then(|| variance_s2.sqrt())
}

/// A hypothesis at its best scale.
struct Scaled {
    log_likelihood: f64,
    /// Variance per unit of the regressor.
    slope: f64,
}

/// The best over all degrees of freedom and, with a regressor, over all ratios.
fn best(e: &[f64], by: Option<&[f64]>) -> Scaled {
    let mean = by.map_or(1.0, |by| by.iter().sum::<f64>() / by.len() as f64);
    let one = |degrees: f64| {
        let at = |log_ratio: f64| {
            let ratio = log_ratio.exp() / mean;
            let shape = |i: usize| 1.0 + by.map_or(0.0, |by| ratio * by[i]);
            let (log_likelihood, scale) = scaled(e, shape, degrees);
            // The variance of Student's t.
            Scaled { log_likelihood, slope: ratio * scale * degrees / (degrees - 2.0) }
        };
        if by.is_none() { at(RATIOS[0]) } else { section(at) }
    };
    let all = DEGREES.into_iter().map(one);
    all.max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood)).expect("there are degrees")
}

/// The greatest likelihood over the ratios, by golden section.
fn section(at: impl Fn(f64) -> Scaled) -> Scaled {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let [mut low, mut high] = RATIOS;
    let (mut left, mut right) = (high - golden * (high - low), low + golden * (high - low));
    let (mut a, mut b) = (at(left), at(right));
    for _ in 0..SECTIONS {
        if a.log_likelihood >= b.log_likelihood {
            (high, right, b) = (right, left, a);
            left = high - golden * (high - low);
            a = at(left);
        } else {
            (low, left, a) = (left, right, b);
            right = low + golden * (high - low);
            b = at(right);
        }
    }
    if a.log_likelihood >= b.log_likelihood { a } else { b }
}

/// ln of the likelihood of Student's t with the variance scale times a shape, without the constant
/// of its degrees of freedom, and the most likely scale by a fixed-point iteration.
fn scaled(e: &[f64], shape: impl Fn(usize) -> f64, degrees: f64) -> (f64, f64) {
    let n = e.len() as f64;
    let squares: Vec<f64> = e.iter().enumerate().map(|(i, e)| e * e / shape(i)).collect();
    let mut scale = (squares.iter().sum::<f64>() / n).max(f64::MIN_POSITIVE);
    for _ in 0..ROUNDS {
        let weighed = squares.iter().map(|s| s * (degrees + 1.0) / (degrees + s / scale));
        scale = (weighed.sum::<f64>() / n).max(f64::MIN_POSITIVE);
    }
    let one = |(i, s): (usize, &f64)| {
        -0.5 * (shape(i) * scale).ln() - 0.5 * (degrees + 1.0) * (s / scale / degrees).ln_1p()
    };
    let constant = libm::lgamma(0.5 * (degrees + 1.0))
        - libm::lgamma(0.5 * degrees)
        - 0.5 * (degrees * std::f64::consts::PI).ln();
    (squares.iter().enumerate().map(one).sum::<f64>() + n * constant, scale)
}

#[cfg(test)]
mod tests;

//! Tests whether time stamps jitter. If they do, the noise follows the rate of the signal.
//!
//! If a sample is taken at another time than its time stamp says, it shows the signal y at that
//! time. If this time error is random with the standard deviation `sd_s`, the residual r contains,
//! in addition to the noise of the sensor, a part of the standard deviation `sd_s |dy/dt|` that is
//! independent of the previous sample. An autoregression with the weights w does not predict this
//! part. Its error is
//!
//! ```text
//! e_i = r_i - sum w_k r_{i-k},   var e_i = a + b g_i,   g_i = v_i^2 + sum w_k^2 v_{i-k}^2
//! ```
//!
//! where v is the rate of the simulated output. If time stamps jitter, b is `sd_s`^2, whatever the
//! spectrum of the rest of the residual is. Three hypotheses about the scale of e are compared by
//! their likelihoods, each with its best values of a and b:
//!
//! | hypothesis | scale of e |
//! | --- | --- |
//! | constant | a |
//! | by level | a + b (y - mean)^2: a sensor whose noise grows with its value |
//! | jitter | a + b g |
//!
//! In all hypotheses, e follows Student's t distribution with 3, 10 or 1e6 (Gaussian) degrees of
//! freedom, so that a few jumps do not change the scale much (Lange, Little and Taylor 1989, doi
//! 10.1080/01621459.1989.10478852). For n samples, the parameter b costs half of ln n. Jitter is
//! accepted if it is the most likely hypothesis and if it explains half of the residual's power
//! above the noise, as every [course in time](super::course) must. Constant delays and other errors
//! that persist while the signal moves are predicted from the previous samples and leave little in
//! e.

use crate::missing::{
    coloured::{autoregression, innovations},
    term_inputs::central_differences,
};

/// Degrees of freedom; the last is Gaussian.
const DEGREES: [f64; 3] = [3.0, 10.0, 1e6];
/// Range of the logarithm of b/a times the mean of the regressor: jitter from a hundredth of the
/// noise's variance to a million times this variance.
const RATIOS: [f64; 2] = [-4.6, 13.8];
/// Number of steps of a golden-section search over the range [`RATIOS`], which determine the
/// logarithm to about 0.01; and number of steps of the fixed-point iteration for the scale.
const SECTIONS: usize = 16;
const ROUNDS: usize = 12;
/// Smallest number of samples for the test: a scale, a slope, and the weights of the autoregression
/// have to be estimated.
const LEAST: usize = 60;

/// Returns the standard deviation of the time between samples and their time stamps, s; `None` if
/// another hypothesis explains the residual better.
///
/// `stretches` are residuals in multiples of the noise. `shown` holds the simulated value of each
/// sample in the same unit, and `dt_s` is the sample time. Jitter has to explain a sum of squares
/// of at least `least`.
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

/// A hypothesis with its most likely scale.
struct Scaled {
    log_likelihood: f64,
    /// Variance per unit of the regressor.
    slope: f64,
}

/// Returns the most likely hypothesis over all degrees of freedom and, if there is a regressor,
/// over all ratios.
fn best(e: &[f64], by: Option<&[f64]>) -> Scaled {
    let mean = by.map_or(1.0, |by| by.iter().sum::<f64>() / by.len() as f64);
    let one = |degrees: f64| {
        let at = |log_ratio: f64| {
            let ratio = log_ratio.exp() / mean;
            let shape = |i: usize| 1.0 + by.map_or(0.0, |by| ratio * by[i]);
            let (log_likelihood, scale) = scaled(e, shape, degrees);
            // Student's t with scale 1 has the variance degrees/(degrees - 2).
            Scaled { log_likelihood, slope: ratio * scale * degrees / (degrees - 2.0) }
        };
        if by.is_none() { at(RATIOS[0]) } else { section(at) }
    };
    let all = DEGREES.into_iter().map(one);
    all.max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood)).expect("there are degrees")
}

/// Returns the hypothesis with the greatest likelihood over the ratios, by golden-section search.
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

/// Returns the logarithm of the likelihood of `e` under Student's t, and the most likely scale, by
/// a fixed-point iteration. The squared width of the distribution is the scale times `shape` of the
/// sample.
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

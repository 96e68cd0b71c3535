//! Tests whether fitted values are the same in all runs.
//!
//! The test statistic is Cochran's Q of the values x_i with variances v_i and weights w_i = 1/v_i:
//!
//! ```text
//! Q = sum w_i (x_i - m)^2,     m = sum w_i x_i/sum w_i,     chi-square with n - 1 degrees of freedom where all are the same
//! ```
//!
//! Probabilities are corrected for the number of tests so that the false discovery rate is at most
//! 5 % (Benjamini and Hochberg 1995, doi 10.1111/j.2517-6161.1995.tb02031.x).

use serde::Serialize;
use statrs::function::{erf::erfc, gamma::checked_gamma_ur};
use stretch_gap::{SampleFit, SampleValue};

/// False discovery rate.
const RATE: f64 = 0.05;

/// Test of whether a value is the same in all runs that determine it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Heterogeneity {
    /// Name of the value.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Mean of the runs, weighted by the inverse variance of each.
    pub mean: f64,
    /// Smallest and largest value over the runs that determine it.
    pub range: [f64; 2],
    /// Number of runs that determine it.
    pub runs: usize,
    /// Cochran's Q.
    pub q: f64,
    /// Share of the scatter that the uncertainties of the runs do not explain: max(0, 1 - (n -
    /// 1)/Q).
    pub i_squared: f64,
    /// Probability of a greater Q if all runs have the same value.
    pub p: f64,
    /// `p`, corrected for the number of values.
    pub p_corrected: f64,
    /// Whether the runs disagree.
    pub differs: bool,
}

impl Heterogeneity {
    /// Returns the result of the test as a sentence.
    pub fn sentence(&self) -> String {
        let [low, high] = self.range;
        let spread = 100.0 * (high - low) / self.mean.abs().max(f64::MIN_POSITIVE);
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        format!(
            "{} differs from run to run: {low:.4} to {high:.4}{unit} ({spread:.0} % of its mean) over {} runs, P = {:.1e}",
            self.name, self.runs, self.p_corrected
        )
    }
}

/// A run that differs from the others, which agree with one another in at least one of these values. Its set-up is
/// probably different.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Apart {
    /// Name of the run.
    pub run: String,
    /// Names of the values in which it differs.
    pub values: Vec<String>,
    /// For each value, its distance from the mean of the other runs, in standard deviations.
    pub deviations: Vec<f64>,
}

impl Apart {
    /// Returns the deviations of the run as a sentence.
    pub fn sentence(&self) -> String {
        let each = self.values.iter().zip(&self.deviations);
        let each: Vec<String> = each.map(|(name, z)| format!("{name} ({z:+.1} sd)")).collect();
        format!(
            "{} differs from the others in {}; the other runs agree without it, so its set-up is probably different",
            self.run,
            each.join(", ")
        )
    }
}

/// A run that was fitted by itself, with its name.
type Run = (String, SampleFit);

/// Estimate of a value from one run: index of the run, value on the scale of the fit, variance.
type Estimate = (usize, f64, f64);

fn estimates(runs: &[Run], value: usize) -> Vec<Estimate> {
    let one = |(i, (_, fit)): (usize, &Run)| fit.values[value].estimate.map(|(x, v)| (i, x, v));
    runs.iter().enumerate().filter_map(one).collect()
}

/// Returns the fitted values of the first run; all runs have the same values in the same order.
fn fitted(runs: &[Run]) -> &[SampleValue] {
    runs.first().map_or(&[], |(_, fit)| &fit.values)
}

/// Weighted mean, its variance, and Q.
fn pooled(estimates: &[Estimate]) -> (f64, f64, f64) {
    let weight: f64 = estimates.iter().map(|(_, _, v)| 1.0 / v).sum();
    let mean = estimates.iter().map(|(_, x, v)| x / v).sum::<f64>() / weight;
    let q = estimates.iter().map(|(_, x, v)| (x - mean) * (x - mean) / v).sum();
    (mean, 1.0 / weight, q)
}

/// Probability of a greater chi-square.
fn beyond(q: f64, degrees: usize) -> f64 {
    checked_gamma_ur(0.5 * degrees as f64, 0.5 * q).unwrap_or(1.0)
}

/// Tests for each value whether the runs agree.
pub(super) fn values(runs: &[Run]) -> Vec<Heterogeneity> {
    let mut out = Vec::new();
    for (i, value) in fitted(runs).iter().enumerate() {
        let estimates = estimates(runs, i);
        if estimates.len() < 2 {
            continue;
        }
        let (mean, _, q) = pooled(&estimates);
        let ends = estimates.iter().map(|(_, x, _)| value.at(*x));
        let range = ends.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)]);
        let degrees = estimates.len() - 1;
        out.push(Heterogeneity {
            name: value.identified.name.clone(),
            unit: value.identified.unit.clone(),
            mean: value.at(mean),
            range,
            runs: estimates.len(),
            q,
            i_squared: (1.0 - degrees as f64 / q).max(0.0),
            p: beyond(q, degrees),
            p_corrected: 1.0,
            differs: false,
        });
    }
    let corrected = q_values(&out.iter().map(|h| h.p).collect::<Vec<_>>());
    for (one, p) in out.iter_mut().zip(corrected) {
        (one.p_corrected, one.differs) = (p, p < RATE);
    }
    out
}

/// Runs that differ from the mean of the others.
pub(super) fn apart(runs: &[Run]) -> Vec<Apart> {
    let mut asked: Vec<(usize, usize, f64, bool)> = Vec::new();
    for value in 0..fitted(runs).len() {
        let estimates = estimates(runs, value);
        // If two runs differ, either may be the odd one.
        if estimates.len() < 3 {
            continue;
        }
        for (run, x, v) in &estimates {
            let rest: Vec<Estimate> =
                estimates.iter().copied().filter(|(r, ..)| r != run).collect();
            let (mean, variance, q) = pooled(&rest);
            let agree = beyond(q, rest.len() - 1) > RATE;
            asked.push((*run, value, (x - mean) / (v + variance).sqrt(), agree));
        }
    }
    let p: Vec<f64> =
        asked.iter().map(|(_, _, z, _)| erfc(z.abs() / std::f64::consts::SQRT_2)).collect();
    let found = asked.iter().zip(q_values(&p)).filter(|(_, p)| *p < RATE);
    let found: Vec<_> = found.map(|(one, _)| *one).collect();
    let of_run = |run: usize| {
        let own: Vec<_> = found.iter().filter(|(r, ..)| *r == run).collect();
        // One run cannot be judged by others that disagree among themselves.
        own.iter().any(|(.., agree)| *agree).then(|| Apart {
            run: runs[run].0.clone(),
            values: own.iter().map(|(_, v, ..)| fitted(runs)[*v].identified.name.clone()).collect(),
            deviations: own.iter().map(|(_, _, z, _)| *z).collect(),
        })
    };
    (0..runs.len()).filter_map(of_run).collect()
}

/// Corrects probabilities for their number. Returns for each its q-value, the least false discovery
/// rate at which it would count as a discovery (Benjamini and Hochberg). The tests have to be
/// independent or positively correlated.
pub fn q_values(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|a, b| p[*b].total_cmp(&p[*a]));
    let (mut out, mut least) = (vec![1.0; p.len()], 1.0_f64);
    for (behind, i) in order.into_iter().enumerate() {
        let rank = p.len() - behind;
        least = least.min(p[i] * p.len() as f64 / rank as f64);
        out[i] = least;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corrected_probabilities_are_those_of_benjamini_and_hochberg() {
        // The example of Benjamini and Hochberg: 4 of the 15 hypotheses are rejected.
        let p = [0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240];
        let p = [&p[..], &[0.4262, 0.5719, 0.6528, 0.7590, 1.0]].concat();
        let found = q_values(&p).iter().filter(|p| **p < 0.05).count();
        assert_eq!(found, 4);
        // R: p.adjust(c(0.01, 0.02, 0.03, 0.04, 0.05), "BH"), and unordered values with ties.
        let q = q_values(&[0.01, 0.02, 0.03, 0.04, 0.05]);
        assert!(q.iter().all(|q| (q - 0.05).abs() < 1e-15), "{q:?}");
        let q = q_values(&[0.9, 0.001, 0.04, 0.001]);
        for (q, expected) in q.iter().zip([0.9, 0.002, 0.16 / 3.0, 0.002]) {
            assert!((q - expected).abs() < 1e-15, "{q} {expected}");
        }
        assert!(q_values(&[]).is_empty());
    }

    #[test]
    fn the_tail_of_a_chi_square_is_that_of_the_tables() {
        assert!((beyond(3.841, 1) - 0.05).abs() < 1e-4 && (beyond(18.307, 10) - 0.05).abs() < 1e-4);
    }
}

//! Calibration of the posterior: the thresholds under which the sealed truths are likeliest.
//!
//! A diagnosis lists every hypothesis with its score and with what it leaves, so that its probabilities under other thresholds are known without
//! another diagnosis. The mean of ln P(truth) over labelled cases, every kind of case with the same weight, is raised one threshold at a time.

use std::collections::{BTreeMap, BTreeSet};

use stretch_blind::{COUNTED_EXCESS, CaseKind, Label, are_twins};
use stretch_gap::{Candidate, Diagnosis, Thresholds, VerdictKind};

/// Probability of a truth that is no candidate.
const NOT_LISTED: f64 = 1e-3;
/// Least temperature, nats: other rigs bend the forms in ways that no generator of ours does, and twins are as good as alike then.
const COLDEST: f64 = 5.0;
/// Factors that a threshold is multiplied by in turn, the finest last, and rounds over all thresholds with each.
const FACTORS: [f64; 3] = [2.0, 1.3, 1.1];
const ROUNDS: usize = 8;

/// A label, and what the diagnosis said of its case.
pub type Case = (Label, Diagnosis);

/// Thresholds of labelled cases that were diagnosed; those that steer the search stay as they are.
pub fn calibrated(cases: &[&Case]) -> Thresholds {
    let mut kinds: BTreeMap<CaseKind, Vec<(&Diagnosis, Vec<usize>)>> = BTreeMap::new();
    for (label, diagnosis) in cases.iter().filter(|(label, d)| is_counted(label, d)) {
        kinds.entry(label.kind).or_default().push((diagnosis, truth(label, diagnosis)));
    }
    let likelihood = |thresholds: &Thresholds| -> f64 {
        let one = |(diagnosis, truth): &(&Diagnosis, Vec<usize>)| {
            let all = diagnosis.probabilities(thresholds);
            truth.iter().map(|&i| all[i]).sum::<f64>().max(NOT_LISTED).ln()
        };
        let mean = |cases: &Vec<_>| cases.iter().map(one).sum::<f64>() / cases.len() as f64;
        kinds.values().map(mean).sum::<f64>() / kinds.len().max(1) as f64
    };
    let mut best = Thresholds::frozen();
    let mut most = likelihood(&best);
    eprintln!("mean ln P(truth) of {} kinds: {most:.4} as they are", kinds.len());
    for factor in FACTORS {
        for _ in 0..ROUNDS {
            for threshold in [temperature, rho, excess, share, soft, odds] {
                for factor in [factor, 1.0 / factor] {
                    let mut other = best;
                    *threshold(&mut other) *= factor;
                    other.temperature = other.temperature.max(COLDEST);
                    let found = likelihood(&other);
                    if found > most {
                        (best, most) = (other, found);
                    }
                }
            }
        }
    }
    eprintln!("mean ln P(truth): {most:.4} calibrated");
    for threshold in [temperature, rho, excess, share, soft, odds] {
        let value = threshold(&mut best);
        *value = rounded(*value);
    }
    best
}

fn temperature(t: &mut Thresholds) -> &mut f64 {
    &mut t.temperature
}

fn rho(t: &mut Thresholds) -> &mut f64 {
    &mut t.rho
}

fn excess(t: &mut Thresholds) -> &mut f64 {
    &mut t.unknown_excess
}

fn share(t: &mut Thresholds) -> &mut f64 {
    &mut t.unknown_share
}

fn soft(t: &mut Thresholds) -> &mut f64 {
    &mut t.unknown_soft
}

fn odds(t: &mut Thresholds) -> &mut f64 {
    &mut t.unknown_odds
}

/// Whether a case says something of the sum: its cause shows, and the record is not what is wrong.
fn is_counted(label: &Label, diagnosis: &Diagnosis) -> bool {
    let shows = label.kind == CaseKind::Null || label.excess >= COUNTED_EXCESS;
    shows && diagnosis.verdict != VerdictKind::Record
}

/// Indices of the candidates that are the truth; none where it is not listed.
fn truth(label: &Label, diagnosis: &Diagnosis) -> Vec<usize> {
    let named: BTreeSet<&String> = label.effects.iter().collect();
    let is_twin = |c: &Candidate| {
        c.effects.len() == 1 && are_twins(&c.effects[0], &label.effects[0], label.pressure_column)
    };
    let is_true = |c: &Candidate| match label.kind {
        CaseKind::Null => c.effects.is_empty(),
        CaseKind::OutOfCatalogue => c.effects == ["unknown"],
        CaseKind::Struck => c.effects == ["unknown"] || is_twin(c),
        CaseKind::Single | CaseKind::Compound => c.effects.iter().collect::<BTreeSet<_>>() == named,
        CaseKind::Dominant => label.dominant.as_ref().is_some_and(|d| c.effects.contains(d)),
    };
    (0..diagnosis.candidates.len()).filter(|&i| is_true(&diagnosis.candidates[i])).collect()
}

/// To three digits.
fn rounded(x: f64) -> f64 {
    let unit = 10.0_f64.powi(x.abs().max(1e-9).log10().floor() as i32 - 2);
    (x / unit).round() * unit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits_stay() {
        for (x, expected) in [(0.123_456, 0.123), (145.67, 146.0), (5.0, 5.0), (0.001_999, 0.002)] {
            assert!((rounded(x) - expected).abs() < 1e-9, "{x}");
        }
    }
}

//! Calibration of what turns scores into probabilities and gaps into `unknown`.

use stretch_blind::{COUNTED_EXCESS, CaseKind, Label, are_twins};
use stretch_gap::{Diagnosis, Excess, Thresholds, VerdictKind};

/// Probability of a truth that is no candidate.
const NOT_LISTED: f64 = 1e-3;
/// Least temperature, nats: other rigs bend the forms in ways that no generator of ours does, and twins are as good as alike then.
const COLDEST: f64 = 5.0;
/// Widths of the border between known and unknown that are tried, in logarithms of the excess left; the first is the one that the border is
/// laid by: a sharp one would follow single cases.
const SOFT: [f64; 6] = [0.2, 0.3, 0.45, 0.7, 1.0, 1.5];
/// Odds of `unknown` at its border that are tried.
const ODDS: [f64; 6] = [0.05, 0.1, 0.165, 0.3, 0.55, 1.0];
/// Room for rigs that no generator of ours made: `unknown` begins at this many times the greatest gap of a null that was called so.
const ROOM: f64 = 1.5;
/// Excess below which nothing is called unknown: the noise is known to a twentieth.
const LEAST_UNKNOWN: f64 = 0.05;
/// What a false `unknown` costs, in overlooked ones.
const DEAR: f64 = 3.0;

/// Thresholds of labelled cases that were diagnosed; those that steer the search stay as they are.
pub fn calibrated(cases: &[&Case]) -> Thresholds {
    let (temperature, rho) = probabilities(cases);
    let (unknown_excess, unknown_share, unknown_soft, unknown_odds) = unknowns(cases);
    Thresholds {
        temperature,
        rho,
        unknown_excess,
        unknown_share,
        unknown_soft,
        unknown_odds,
        ..Thresholds::frozen()
    }
}

/// A label, and what the diagnosis said of its case.
pub type Case = (Label, Diagnosis);

/// Temperature and its growth under which the truths of single effects are most likely.
fn probabilities(cases: &[&Case]) -> (f64, f64) {
    let null_excess = Thresholds::frozen().null_excess;
    let singles: Vec<(Vec<f64>, Option<usize>, f64)> = cases
        .iter()
        .filter(|case| {
            let (label, d) = (&case.0, &case.1);
            label.kind == CaseKind::Single
                && label.excess >= COUNTED_EXCESS
                && d.candidates.first().is_some_and(|c| c.effects.len() == 1)
        })
        .map(|case| {
            let (label, d) = (&case.0, &case.1);
            let known = d.candidates.iter().filter(|c| c.effects != ["unknown"]);
            let scores = known.map(|c| c.score).collect();
            let truth =
                d.candidates.iter().position(|c| c.effects.first() == label.effects.first());
            (scores, truth, d.gap.left / d.gap.retuned.max(null_excess))
        })
        .collect();
    let likelihood = |t: f64, rho: f64| -> f64 {
        let one = |(scores, truth, share): &(Vec<f64>, Option<usize>, f64)| {
            let top = scores.iter().copied().fold(0.0, f64::max);
            let odds = scores.iter().map(|s| ((s - top) / (t + rho * share)).exp());
            let all: f64 = odds.clone().sum();
            let own = truth.and_then(|at| odds.clone().nth(at)).unwrap_or(0.0);
            (own / all).max(NOT_LISTED).ln()
        };
        singles.iter().map(one).sum()
    };
    let temperatures = (0..16).map(|i| COLDEST * 1.25_f64.powi(i));
    let grid = temperatures.flat_map(|t| (0..50).map(move |i| (t, 10.0 * f64::from(i))));
    let best = grid.max_by(|a, b| likelihood(a.0, a.1).total_cmp(&likelihood(b.0, b.1)));
    let (t, rho) = best.unwrap_or((2.0, 100.0));
    eprintln!(
        "{} singles, mean log probability {:.4}",
        singles.len(),
        likelihood(t, rho) / singles.len() as f64
    );
    // What stands at an end of its grid is a bound, not an estimate.
    if t <= COLDEST {
        eprintln!("the temperature stands at the coldest that is tried, {COLDEST} nats");
    }
    (round(t), round(rho))
}

/// Excess (reduced chi-square minus one) and share of it that model discrepancy may leave, between cases that an effect explains and those that none does.
fn unknowns(cases: &[&Case]) -> (f64, f64, f64, f64) {
    let is_counted = |label: &Label, d: &Diagnosis| {
        label.excess >= COUNTED_EXCESS && d.gap.retuned > Thresholds::frozen().null_excess
    };
    let mut explained = Vec::new();
    let mut foreign = Vec::new();
    let mut nulls = Vec::new();
    for (label, d) in cases.iter().map(|case| (&case.0, &case.1)) {
        let Some(best) = d.candidates.first() else { continue };
        let of = |name: &String| best.effects.contains(name);
        match label.kind {
            CaseKind::Null => {
                let is_called = d.verdict == VerdictKind::Unknown;
                // What is called noise has no gap to be called unknown.
                nulls.push(if is_called { d.gap } else { Excess { left: 0.0, ..d.gap } });
            }
            CaseKind::OutOfCatalogue if is_counted(label, d) => foreign.push(d.gap),
            CaseKind::Struck if is_counted(label, d) => {
                let truth = &label.effects[0];
                if !best.effects.iter().any(|e| are_twins(e, truth, label.pressure_column)) {
                    foreign.push(d.gap);
                }
            }
            CaseKind::Single | CaseKind::Compound | CaseKind::Dominant
                if is_counted(label, d)
                    && d.verdict != VerdictKind::Parameters
                    && (label.effects.iter().take(2).all(of)
                        || label.dominant.as_ref().is_some_and(of)) =>
            {
                explained.push(d.gap);
            }
            _ => {}
        }
    }
    let of = |g: &Excess, excess: f64, share: f64, soft: f64| {
        let beyond = (g.left.max(1e-6) / (excess + share * g.retuned)).ln();
        1.0 / (1.0 + (-beyond / soft).exp())
    };
    let called = |gaps: &[Excess], excess: f64, share: f64| -> f64 {
        let sum: f64 = gaps.iter().map(|g| of(g, excess, share, SOFT[0])).sum();
        sum / gaps.len().max(1) as f64
    };
    let gain = |excess: f64, share: f64| {
        called(&foreign, excess, share)
            - DEAR * (called(&explained, excess, share) + called(&nulls, excess, share))
    };
    let least = (ROOM * nulls.iter().map(|gap| gap.left).fold(0.0, f64::max)).max(LEAST_UNKNOWN);
    let excesses = (0..20).map(|i| least * 1.1_f64.powi(i));
    let grid = excesses.flat_map(|e| (0..50).map(move |i| (e, 0.004 * f64::from(i))));
    let best = grid.max_by(|a, b| gain(a.0, a.1).total_cmp(&gain(b.0, b.1)));
    let (excess, share) = best.unwrap_or((0.1, 0.08));
    eprintln!(
        "called unknown: {:.3} of {} foreign, {:.3} of {} explained, {:.3} of {} nulls",
        called(&foreign, excess, share),
        foreign.len(),
        called(&explained, excess, share),
        explained.len(),
        called(&nulls, excess, share),
        nulls.len()
    );
    // Width and odds under which the truths are likeliest.
    let likelihood = |soft: f64, odds: f64| -> f64 {
        let ln = |p: f64| p.clamp(NOT_LISTED, 1.0).ln();
        let of = |g: &Excess| {
            let beyond = (g.left.max(1e-6) / (excess + share * g.retuned)).ln();
            let odds = odds * (beyond / soft).exp();
            odds / (1.0 + odds)
        };
        let is: f64 = foreign.iter().map(|g| ln(of(g))).sum();
        is + explained.iter().chain(&nulls).map(|g| ln(1.0 - of(g))).sum::<f64>()
    };
    let grid = SOFT.into_iter().flat_map(|soft| ODDS.map(|odds| (soft, odds)));
    let best = grid.max_by(|a, b| likelihood(a.0, a.1).total_cmp(&likelihood(b.0, b.1)));
    let (soft, odds) = best.unwrap_or((SOFT[0], 1.0));
    (round(excess), round(share), soft, odds)
}

/// To three digits behind the point.
fn round(x: f64) -> f64 {
    (1e3 * x).round() / 1e3
}

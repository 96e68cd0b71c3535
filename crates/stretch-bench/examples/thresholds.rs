//! Calibrates what turns scores into probabilities and gaps into `unknown`, on labelled cases that were diagnosed:
//! `cargo run --release -p stretch-bench --example thresholds -- [--write] FOLDER...`.
//!
//! `stretch blind make` and `stretch blind run` make such folders, `dev_score` too. The thresholds that steer the search
//! itself (`null_excess`, `rise`, `share`, `mismatch`) act while a case is diagnosed: they are kept as they are.

use std::{fs, path::Path};

use stretch_blind::{COUNTED_EXCESS, CaseKind, Label, Seal, are_twins};
use stretch_gap::{Diagnosis, Thresholds, VerdictKind};

/// Probability of a truth that is no candidate.
const NOT_LISTED: f64 = 1e-3;
/// Least temperature, nats: other rigs bend the forms in ways that no generator of ours does, and twins are as good as alike then.
const COLDEST: f64 = 5.0;
/// Width of the border between known and unknown, in logarithms of the excess left: a sharp one would follow single cases.
const SOFT: f64 = 0.2;
/// Room for rigs that no generator of ours made: `unknown` begins at this many times the greatest gap of a null.
const ROOM: f64 = 1.5;
/// What a false `unknown` costs, in overlooked ones.
const DEAR: f64 = 3.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut folders: Vec<String> = std::env::args().skip(1).collect();
    let is_written = folders.first().is_some_and(|a| a == "--write");
    if is_written {
        folders.remove(0);
    }
    if folders.is_empty() {
        eprintln!("usage: thresholds [--write] FOLDER...");
        std::process::exit(2);
    }
    let mut cases = Vec::new();
    let mut seeds = Vec::new();
    for folder in &folders {
        let (_, truth) = Seal::open(Path::new(folder))?;
        seeds.extend(truth.seed.map(|seed| seed.to_string()));
        for (name, label) in truth.cases {
            let file = Path::new(folder).join(&name).join("diagnosis.json");
            if let Ok(text) = fs::read_to_string(&file) {
                cases.push((label, serde_json::from_str::<Diagnosis>(&text)?));
            }
        }
    }
    let before = Thresholds::frozen();
    let (temperature, rho) = probabilities(&cases);
    let (unknown_excess, unknown_share) = unknowns(&cases);
    let after = Thresholds { temperature, rho, unknown_excess, unknown_share, ..before };
    let text = format!(
        "# temperature, rho, unknown_excess and unknown_share: calibrated on {} development cases, seeds {}, with\n\
         #   cargo run --release -p stretch-bench --example thresholds -- --write FOLDER...\n\
         # The others steer the search; they were set while such cases were looked at.\n{}",
        cases.len(),
        seeds.join(", "),
        toml::to_string(&after)?
    );
    print!("{text}");
    if is_written {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../stretch-gap/thresholds.toml");
        fs::write(path, text)?;
    }
    Ok(())
}

type Case = (Label, Diagnosis);

/// Temperature and its growth under which the truths of single effects are most likely.
fn probabilities(cases: &[Case]) -> (f64, f64) {
    let null_excess = Thresholds::frozen().null_excess;
    let singles: Vec<(Vec<f64>, Option<usize>, f64)> = cases
        .iter()
        .filter(|(label, d)| {
            label.kind == CaseKind::Single
                && label.excess >= COUNTED_EXCESS
                && d.candidates.first().is_some_and(|c| c.effects.len() == 1)
        })
        .map(|(label, d)| {
            let scores = d.candidates.iter().map(|c| c.score).collect();
            let truth = d.candidates.iter().position(|c| c.effects[0] == label.effects[0]);
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
    (round(t), round(rho))
}

/// Excess and share of it that mismatch of form may leave, between cases that an effect explains and those that none does.
fn unknowns(cases: &[Case]) -> (f64, f64) {
    let is_counted = |label: &Label, d: &Diagnosis| {
        label.excess >= COUNTED_EXCESS && d.gap.retuned > Thresholds::frozen().null_excess
    };
    let mut explained = Vec::new();
    let mut foreign = Vec::new();
    let mut nulls = Vec::new();
    for (label, d) in cases {
        let Some(best) = d.candidates.first() else { continue };
        let of = |name: &String| best.effects.contains(name);
        match label.kind {
            CaseKind::Null => nulls.push(d.gap),
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
    let called = |gaps: &[stretch_gap::Excess], excess: f64, share: f64| -> f64 {
        let one = |g: &stretch_gap::Excess| {
            let beyond = (g.left.max(1e-6) / (excess + share * g.retuned)).ln();
            1.0 / (1.0 + (-beyond / SOFT).exp())
        };
        gaps.iter().map(one).sum::<f64>() / gaps.len().max(1) as f64
    };
    let worth = |excess: f64, share: f64| {
        called(&foreign, excess, share)
            - DEAR * (called(&explained, excess, share) + called(&nulls, excess, share))
    };
    let least = ROOM * nulls.iter().map(|gap| gap.left).fold(0.0, f64::max);
    let excesses = (0..20).map(|i| least * 1.1_f64.powi(i));
    let grid = excesses.flat_map(|e| (0..50).map(move |i| (e, 0.004 * f64::from(i))));
    let best = grid.max_by(|a, b| worth(a.0, a.1).total_cmp(&worth(b.0, b.1)));
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
    (round(excess), round(share))
}

/// To three digits behind the point.
fn round(x: f64) -> f64 {
    (1e3 * x).round() / 1e3
}

//! Computes the scatter of results for nulls: rigs without effects, with parameters within their
//! tolerances.

use std::{fmt::Write, num::NonZeroUsize, ops::Range};

use stretch_gap::{Diagnosis, Options, Thresholds, VerdictKind};

use stretch_challenge::shared_out;

use crate::simulated::{Protocol, Source};

/// Result of one null.
struct Null {
    /// Excess of the re-tuned nominal simulator.
    excess: f64,
    /// Highest score of a single effect, nats, and its name; `None` if no effect closes anything.
    best: Option<(f64, String)>,
    /// Verdict of the program.
    verdict: VerdictKind,
    named: Vec<String>,
}

/// Returns thresholds without acceptance criteria: the effect with the highest score is accepted,
/// whatever share of the gap it closes.
fn without_criteria() -> Thresholds {
    let none = f64::NEG_INFINITY;
    Thresholds {
        rise: none,
        faint_rise: none,
        share: 0.0,
        model_discrepancy: 0.0,
        ..Thresholds::frozen()
    }
}

fn null(seed: u64, protocol: Protocol) -> anyhow::Result<Null> {
    let source = Source { seed, effect: None };
    let Diagnosis { gap, answer, .. } = source.diagnosed(protocol, Options::default())?;
    let (verdict, named) = (answer.kind(), answer.named());
    let loose = source.diagnosed(
        protocol,
        Options { depth: NonZeroUsize::MIN, thresholds: without_criteria(), ..Options::default() },
    )?;
    // The candidate `unknown` and the empty set are not effects.
    let singles =
        loose.candidates.iter().filter(|c| c.effects.len() == 1 && !c.parameters.is_empty());
    let best = singles.max_by(|a, b| a.score.total_cmp(&b.score));
    let best = best.map(|c| (c.score, c.effects[0].clone()));
    eprintln!(
        "null {seed}, {}: {:.4}, {best:?}, {verdict:?} {named:?}",
        protocol.name(),
        gap.retuned
    );
    Ok(Null { excess: gap.retuned, best, verdict, named })
}

/// Returns the table of the null band.
pub(crate) fn band(seeds: Range<u64>) -> anyhow::Result<String> {
    let each = seeds.clone().count();
    let jobs = Protocol::ALL.len() * each;
    let all = shared_out(rayon::current_num_threads(), jobs, |at| {
        null(seeds.start + (at % each) as u64, Protocol::ALL[at / each])
    })?;
    let mut text = format!("Nulls, seeds {} .. {}\n\n", seeds.start, seeds.end - 1);
    text.push_str("| protocol | excess: median | 90 % | greatest | score of the best false effect, nats: median | 90 % | greatest | verdict `none` | other verdicts |\n");
    text.push_str("|---|---|---|---|---|---|---|---|---|\n");
    for (protocol, nulls) in Protocol::ALL.iter().zip(all.chunks(each.max(1))) {
        let excess = quantiles(nulls.iter().map(|n| n.excess).collect());
        // An effect that closes nothing has no score, so it cannot be the largest.
        let scores = nulls.iter().map(|n| n.best.as_ref().map_or(f64::NEG_INFINITY, |b| b.0));
        let scores = quantiles(scores.collect());
        let is_none = |n: &&Null| matches!(n.verdict, VerdictKind::NoGap | VerdictKind::Parameters);
        let none = nulls.iter().filter(is_none).count();
        let others: Vec<String> = nulls
            .iter()
            .filter(|n| !is_none(n))
            .map(|n| format!("{:?} {}", n.verdict, n.named.join(" + ")).trim().to_lowercase())
            .collect();
        let others = if others.is_empty() { "-".into() } else { others.join(", ") };
        let [a, b, c] = excess.map(|x| format!("{x:.4}"));
        let shown = |x: f64| if x.is_finite() { format!("{x:.1}") } else { "none".into() };
        let [d, e, f] = scores.map(shown);
        let by_score = |a: &&(f64, String), b: &&(f64, String)| a.0.total_cmp(&b.0);
        let greatest = nulls.iter().filter_map(|n| n.best.as_ref()).max_by(by_score);
        let whose = greatest.map_or("-", |(_, effect)| effect.as_str());
        let name = protocol.name();
        writeln!(
            text,
            "| {name} | {a} | {b} | {c} | {d} | {e} | {f} ({whose}) | {none} of {each} | {others} |"
        )?;
    }
    Ok(text)
}

/// Returns the median, the 0.9 quantile and the maximum. The quantile q of n numbers is the number
/// with the rank q n, rounded up.
fn quantiles(mut numbers: Vec<f64>) -> [f64; 3] {
    numbers.sort_by(f64::total_cmp);
    let at = |q: f64| {
        let rank = (q * numbers.len() as f64).ceil() as usize;
        numbers.get(rank.saturating_sub(1)).copied().unwrap_or(f64::NAN)
    };
    [at(0.5), at(0.9), at(1.0)]
}

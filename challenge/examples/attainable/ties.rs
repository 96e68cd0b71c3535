//! Finds effects that cannot be distinguished: tests every effect of the catalogue at two
//! strengths.

use std::{
    fmt::{Display, Formatter, Write},
    num::NonZeroUsize,
    ops::Range,
};

use stretch_gap::{Diagnosis, Options, VerdictKind};
use stretch_sim::{Catalogue, Effect};

use stretch_challenge::shared_out;

use crate::{simulated::Protocol, strength::Strengths};

/// Targets of the excess: a weak and a strong effect.
const AIMS: [f64; 2] = [0.55, 10.0];
/// Protocols that are compared.
const PROTOCOLS: [Protocol; 2] = [Protocol::Paper, Protocol::Plus];

/// The table lists the best other effect if its score differs from that of the true effect by less
/// than this, nats. At a temperature of five nats, a difference of 30 nats is a ratio of 1/400 of
/// the probabilities.
const NEAR_NATS: f64 = 30.0;

/// Result of one session.
#[derive(Debug)]
struct Said {
    /// Text in the table.
    answer: String,
    /// The best other effect, and its score minus that of the true effect, nats.
    nearest: Option<(String, f64)>,
}

/// One effect at one strength: its excess, and the result by protocol.
#[derive(Debug)]
struct Cell {
    excess: f64,
    said: [Said; 2],
}

/// The weak and the strong effect.
type Row = [Cell; 2];

impl Said {
    fn of(truth: &str, diagnosis: &Diagnosis) -> Self {
        Self { answer: answer(truth, diagnosis), nearest: nearest(truth, diagnosis) }
    }
}

/// Describes whether the true effect is named alone, in a tie, or not at all.
fn answer(truth: &str, diagnosis: &Diagnosis) -> String {
    let answer = &diagnosis.answer;
    let (named, tied, gross) = (answer.named(), answer.tied(), answer.gross());
    let is_truth = |name: &&String| *name == truth;
    let all = || named.iter().chain(&tied);
    let others: Vec<&str> = all().filter(|n| !is_truth(n)).map(String::as_str).collect();
    let others = others.join(", ");
    if let Some(error) = gross.first() {
        return format!("record: {:?}", error.what).to_lowercase();
    }
    match (all().any(|n| is_truth(&n)), others.is_empty(), answer.kind()) {
        (true, true, _) => "alone".into(),
        (true, false, _) => format!("tied: {others}"),
        (false, false, _) => format!("other: {others}"),
        (_, _, VerdictKind::Unknown) => "unknown".into(),
        _ => "nothing".into(),
    }
}

fn nearest(truth: &str, diagnosis: &Diagnosis) -> Option<(String, f64)> {
    // The last candidate represents causes outside the catalogue, and has no parameters.
    let effects = diagnosis.candidates.iter().filter(|c| !c.parameters.is_empty());
    let (own, others): (Vec<_>, Vec<_>) =
        effects.partition(|c| c.effects.iter().any(|e| e == truth));
    let best = others.into_iter().max_by(|a, b| a.score.total_cmp(&b.score))?;
    // If the true effect was not fitted, its score is 0.
    let truth = own.first().map_or(0.0, |c| c.score);
    Some((best.effects.join(" + "), best.score - truth))
}

/// Tests one effect on one rig at both strengths.
fn row(effect: &'static Effect, seed: u64) -> anyhow::Result<Row> {
    let mut strengths = Strengths::of(effect, seed);
    let cell = |aim| -> anyhow::Result<Cell> {
        let (source, excess) = strengths.near(aim)?;
        let one = |protocol: Protocol| -> anyhow::Result<Said> {
            let options = Options { depth: NonZeroUsize::MIN, ..Options::default() };
            let diagnosis = source.diagnosed(protocol, options)?;
            let said = Said::of(effect.name, &diagnosis);
            let values = source.effect.as_ref().map(|e| &e.1[..]).unwrap_or(&[]);
            let (name, protocol) = (effect.name, protocol.name());
            eprintln!("{name} {values:?} seed {seed}, {protocol}: {excess:.2}, {said:?}");
            Ok(said)
        };
        Ok(Cell { excess, said: [one(PROTOCOLS[0])?, one(PROTOCOLS[1])?] })
    };
    let [weak, strong] = AIMS.map(cell);
    Ok([weak?, strong?])
}

/// Returns the table of ties, one row per effect. If the results of several seeds differ, the cell
/// lists each of them.
pub(crate) fn matrix(seeds: Range<u64>) -> anyhow::Result<String> {
    let effects: Vec<&'static Effect> = Catalogue::default().iter().collect();
    let each = seeds.clone().count();
    let rows = shared_out(rayon::current_num_threads(), effects.len() * each, |at| {
        row(effects[at / each], seeds.start + (at % each) as u64)
    })?;
    let mut text = format!("Effects, seeds {} .. {}\n\n", seeds.start, seeds.end - 1);
    text.push_str("| effect | excess, weak | paper | paper+ | strong | paper | paper+ |\n");
    text.push_str("|---|---|---|---|---|---|---|\n");
    for (effect, rows) in effects.iter().zip(rows.chunks(each.max(1))) {
        write!(text, "| {} |", effect.name)?;
        for (strength, places) in [2, 1].into_iter().enumerate() {
            let cells = || rows.iter().map(|row| &row[strength]);
            let excess = in_one(cells().map(|c| format!("{:.places$}", c.excess)));
            let said = |at: usize| in_one(cells().map(|c| c.said[at].to_string()));
            write!(text, " {excess} | {} | {} |", said(0), said(1))?;
        }
        text.push('\n');
    }
    Ok(text)
}

/// Joins the results of sessions; equal neighbours are listed once.
fn in_one(answer: impl Iterator<Item = String>) -> String {
    let mut answer: Vec<String> = answer.collect();
    answer.dedup();
    answer.join("; ")
}

impl Display for Said {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.answer)?;
        match self.nearest.as_ref().filter(|(_, nats)| nats.abs() < NEAR_NATS) {
            Some((name, nats)) if self.answer.ends_with(name) => write!(f, " ({nats:+.0})"),
            Some((name, nats)) => write!(f, " ({name} {nats:+.0})"),
            None => Ok(()),
        }
    }
}

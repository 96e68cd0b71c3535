//! Counts the answers for all recordings.

use std::fmt::Write;

use stretch_gap::{Diagnosis, VerdictKind};

use super::inject::{ALL, Injection};

/// Answer for one recording.
#[derive(Debug)]
pub(crate) struct Said {
    pub(crate) diagnosis: Diagnosis,
    /// Notes from reading the recording.
    pub(crate) noticed: Vec<String>,
}

impl Said {
    /// Returns verdict, names, shares and alternatives in one line.
    pub(crate) fn in_short(&self) -> String {
        let d = &self.diagnosis;
        let shares: Vec<String> =
            d.shares.iter().map(|s| format!("{} {:.2}", s.effect, s.closes)).collect();
        let gross: Vec<&str> = d.answer.gross().iter().map(|g| g.sentence.as_str()).collect();
        format!(
            "{:?}, named {:?}, tied {:?}, shares {shares:?}, 95 % {:?}, {gross:?}, {:.1} s",
            d.verdict(),
            d.named(),
            d.answer.tied(),
            d.ambiguous,
            d.runtime_s
        )
    }

    /// Whether one of the names occurs in each of the [`PLACES`].
    fn places(&self, names: &[&str]) -> [bool; 5] {
        let d = &self.diagnosis;
        let is = |name: &String| names.contains(&name.as_str());
        [
            d.named().iter().any(is),
            d.answer.tied().iter().any(is),
            d.ambiguous.iter().any(is),
            d.candidates.first().is_some_and(|c| c.effects.iter().any(is)),
            self.largest().is_some_and(is),
        ]
    }

    /// Returns the effect of the best set that closes most; `None` if no effect closes anything.
    fn largest(&self) -> Option<&String> {
        let closing = self.diagnosis.shares.iter().filter(|s| s.closes > 0.0);
        closing.max_by(|a, b| a.closes.total_cmp(&b.closes)).map(|s| &s.effect)
    }

    /// Returns a parameter of an effect, from the most probable candidate that contains the effect.
    fn size(&self, effect: &str, parameter: &str) -> Option<f64> {
        let with = |name: &String| name == effect;
        let best = self.diagnosis.candidates.iter().find(|c| c.effects.iter().any(with))?;
        let own = best.parameters.iter().find(|p| p.effect == effect && p.name == parameter);
        own.map(|p| p.value)
    }

    /// Whether a named effect is none of these: the added effect, its similar effects (`kin`), and
    /// the 95 % set of the unchanged recording.
    fn names_strangely(&self, injection: &Injection, before: &Said) -> bool {
        let is_known = |name: &String| {
            name == injection.name
                || injection.kin.contains(&name.as_str())
                || before.diagnosis.ambiguous.contains(name)
        };
        !self.diagnosis.named().iter().all(is_known)
    }

    /// Whether a note says that the signal stays at its largest value.
    fn stands(&self) -> bool {
        self.noticed.iter().any(|n| n.contains("stands at its greatest"))
    }
}

/// Places in an answer where a name can occur.
const PLACES: [&str; 5] = ["named", "in a tie", "95 % set", "best set", "largest part"];
/// The counted verdicts.
const VERDICTS: [&str; 5] = ["effect", "partial", "unknown", "record", "none"];

/// Returns the tables, from the diagnoses of the unchanged recordings and of each effect at each
/// strength.
pub(crate) fn tables(untouched: &[Said], injected: &[&[Said]]) -> String {
    let mut text = String::new();
    let rows = || ALL.iter().flat_map(|i| i.strengths.map(|s| (i, s))).zip(injected);
    heading(&mut text, "The effect's own name", &PLACES);
    for ((injection, strength), said) in rows() {
        let cells = found(&[injection.name], untouched, said);
        line(&mut text, &injection.in_words(strength), &cells);
    }
    heading(&mut text, "Its own name or one of its kin", &PLACES);
    for ((injection, strength), said) in rows() {
        let names = [&[injection.name], injection.kin].concat();
        line(&mut text, &injection.in_words(strength), &found(&names, untouched, said));
    }
    heading(&mut text, "Verdicts", &VERDICTS);
    line(&mut text, "untouched", &verdicts(untouched).map(|n| n.to_string()));
    for ((injection, strength), said) in rows() {
        let cells = verdicts(said).map(|n| n.to_string());
        line(&mut text, &injection.in_words(strength), &cells);
    }
    let columns = [
        "size grows by, median",
        "records",
        "gap, times",
        "stands at its top",
        "another largest part",
        "strange name",
    ];
    heading(&mut text, "What else changes", &columns);
    for ((injection, strength), said) in rows() {
        line(&mut text, &injection.in_words(strength), &changes(injection, untouched, said));
    }
    text
}

fn heading(text: &mut String, title: &str, columns: &[&str]) {
    let rule = "| --- ".repeat(columns.len());
    // Writing to a string cannot fail.
    let _ = writeln!(text, "\n{title}\n\n| injected | {} |\n| --- {rule}|", columns.join(" | "));
}

fn line(text: &mut String, what: &str, cells: &[String]) {
    let _ = writeln!(text, "| {what} | {} |", cells.join(" | "));
}

/// Returns for each place the number of recordings in which one of the names occurs; the number
/// before the effect was added is in brackets.
fn found(names: &[&str], untouched: &[Said], said: &[Said]) -> [String; 5] {
    let count = |all: &[Said], at: usize| all.iter().filter(|one| one.places(names)[at]).count();
    std::array::from_fn(|at| format!("{} ({})", count(said, at), count(untouched, at)))
}

fn verdicts(said: &[Said]) -> [usize; 5] {
    let mut counts = [0; 5];
    for one in said {
        counts[match one.diagnosis.verdict() {
            VerdictKind::Effect => 0,
            VerdictKind::Partial => 1,
            VerdictKind::Unknown => 2,
            VerdictKind::Record => 3,
            VerdictKind::NoGap | VerdictKind::Parameters => 4,
        }] += 1;
    }
    counts
}

/// Returns the changes by an effect: median increase of the fitted strength, number of recordings
/// in which it was fitted, median factor of the gap; and the numbers of recordings in which a note
/// says that the signal stays at its top, the effect that closes most changed, and a new name
/// appeared.
fn changes(injection: &Injection, untouched: &[Said], said: &[Said]) -> [String; 6] {
    let pairs = || untouched.iter().zip(said);
    let mut grown: Vec<f64> = match injection.size {
        None => Vec::new(),
        Some((parameter, unit)) => pairs()
            .filter_map(|(before, after)| {
                let before = before.size(injection.name, parameter).unwrap_or(0.0);
                Some(unit * (after.size(injection.name, parameter)? - before))
            })
            .collect(),
    };
    let count = grown.len();
    let mut gaps: Vec<f64> =
        pairs().map(|(b, a)| a.diagnosis.gap.retuned / b.diagnosis.gap.retuned).collect();
    [
        median(&mut grown).map_or("-".into(), |x| format!("{x:.1}")),
        count.to_string(),
        median(&mut gaps).map_or("-".into(), |x| format!("{x:.2}")),
        said.iter().filter(|one| one.stands()).count().to_string(),
        pairs().filter(|(b, a)| b.largest() != a.largest()).count().to_string(),
        pairs().filter(|(b, a)| a.names_strangely(injection, b)).count().to_string(),
    ]
}

fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let (low, high) = (values.len().checked_sub(1)? / 2, values.len() / 2);
    Some(0.5 * (values[low] + values[high]))
}

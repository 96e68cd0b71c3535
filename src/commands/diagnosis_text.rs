//! A diagnosis as text on a terminal.

use std::fmt::Write;

use stretch_data::listed;
use stretch_gap::{Candidate, Diagnosis, Knowledge, SliceGap, VerdictKind, Where};
use stretch_problem::{Implementation, effect_in_words, notation};
use stretch_report::{
    Table, baseline_table, candidate_numbers_table, candidate_table, stage_table, times,
    transfer_in_words, transfer_table,
};

use crate::table::{number, table};

/// Most slices that are listed.
const SLICES: usize = 8;
/// Most candidates that are listed.
const CANDIDATES: usize = 6;

/// Everything behind the sentence: where, which, how far, and what to do next; with every parameter that these data do not
/// determine, and the numbers of every candidate, where `is_verbose` says so.
pub(crate) fn text(
    diagnosis: &Diagnosis,
    implementations: &[Implementation],
    is_verbose: bool,
) -> String {
    let mut out = String::new();
    for one in implementations {
        put(&mut out, &format!("  {}: {}", named(one, diagnosis), one.words));
    }
    if let Some(proposed) = diagnosis.proposed.as_ref().filter(|p| !p.equation.is_empty()) {
        put(&mut out, &format!("  proposed, on the {}: {}", proposed.acts, proposed.equation));
    }
    for gross in &diagnosis.gross {
        put(&mut out, &format!("  {}; {}", gross.sentence, gross.hint));
    }
    let rows = diagnosis.rows_used;
    if rows.used < rows.read {
        let share = percent(rows.share());
        put(&mut out, &format!("It stands on {} of {} rows ({share}).", rows.used, rows.read));
    }
    stages(&mut out, diagnosis);
    slices(&mut out, diagnosis);
    candidates(&mut out, diagnosis, is_verbose);
    parameters(&mut out, diagnosis);
    identifiability(&mut out, diagnosis, is_verbose);
    implement(&mut out, implementations, diagnosis);
    transfer(&mut out, diagnosis);
    baselines(&mut out, diagnosis);
    next(&mut out, diagnosis);
    if let Some(runs) = diagnosis.model_runs {
        put(
            &mut out,
            &format!(
                "\n{} model runs, {} simulations of stages.",
                runs.count, diagnosis.simulations
            ),
        );
    }
    if !diagnosis.notes.is_empty() {
        put(&mut out, "\nNoticed:");
        for note in &diagnosis.notes {
            put(&mut out, &format!("- {note}"));
        }
    }
    out.trim_end().to_owned()
}

/// What an effect is, and the name by which options and files call it.
fn named(one: &Implementation, diagnosis: &Diagnosis) -> String {
    match effect_in_words(&one.name, diagnosis) {
        words if words == one.name => words,
        words => format!("{words} ({})", one.name),
    }
}

fn put(out: &mut String, line: &str) {
    // a string takes every write
    let _ = writeln!(out, "{line}");
}

/// A share as in the report.
fn percent(share: f64) -> String {
    unbroken(&stretch_report::percent(share))
}

/// A text of a page: its spaces are those of a terminal.
fn unbroken(text: &str) -> String {
    text.replace('\u{a0}', " ")
}

/// A table of the report: the same words and numbers.
fn put_table(out: &mut String, report: &Table) {
    put(out, &format!("\n{}:", unbroken(&report.caption)));
    put(out, &drawn(report));
}

/// A table of a report with its caption.
pub(super) fn table_text(report: &Table) -> String {
    format!("{}:\n{}", unbroken(&report.caption), drawn(report))
}

fn drawn(report: &Table) -> String {
    let head: Vec<&str> = report.head.iter().map(String::as_str).collect();
    let rows = report.rows.iter().map(|row| row.iter().map(|cell| unbroken(cell)).collect());
    table(&head, rows)
}

fn stages(out: &mut String, diagnosis: &Diagnosis) {
    let Where { stages, end_to_end, .. } = &diagnosis.location;
    let mut report = stage_table(stages, !diagnosis.named.is_empty());
    report.head.push("Share".to_owned());
    for (row, stage) in report.rows.iter_mut().zip(stages) {
        row.push(percent(stage.share));
    }
    put(out, "\nWhere, stage by stage on its measured input.");
    put(out, &format!("{}; its share of the gap:", unbroken(&report.caption)));
    put(out, &drawn(&report));
    if !end_to_end.is_empty() {
        let shares = end_to_end.iter().map(|e| format!("{} {}", e.stage, percent(e.share)));
        let shares: Vec<String> = shares.collect();
        put(out, &format!("Of the gap at the end, from the commands alone: {}.", listed(&shares)));
    }
}

fn slices(out: &mut String, diagnosis: &Diagnosis) {
    // of those that agree one in twenty stands out by chance
    let agrees = matches!(diagnosis.verdict, VerdictKind::NoGap | VerdictKind::Parameters);
    if agrees && !diagnosis.is_faint() {
        return;
    }
    let mut loud: Vec<&SliceGap> =
        diagnosis.location.slices.iter().filter(|s| s.stands_out && s.by != "trial").collect();
    loud.sort_by(|a, b| b.excess.total_cmp(&a.excess));
    if loud.is_empty() {
        return;
    }
    put(out, "\nWhere it stands out, in multiples of the noise, re-tuned, all trials:");
    let left = |excess: f64| unbroken(&times(excess));
    let rows = loud.iter().take(SLICES).map(|s| {
        let [low, high] = s.excess_ci;
        vec![
            format!("{}, {}: {}", s.stage, s.by, s.slice),
            percent(s.share),
            left(s.excess),
            format!("{} .. {}", left(low), left(high)),
        ]
    });
    put(out, &table(&["Slice", "Share of the gap", "Left", "95 % interval"], rows));
    if loud.len() > SLICES {
        put(out, &format!("({} more in the JSON and the report)", loud.len() - SLICES));
    }
}

fn candidates(out: &mut String, diagnosis: &Diagnosis, is_verbose: bool) {
    let shown: Vec<&Candidate> =
        diagnosis.candidates.iter().filter(|c| !c.effects.is_empty()).collect();
    if shown.is_empty() || diagnosis.verdict == VerdictKind::NoGap {
        return;
    }
    let shown: Vec<Candidate> = shown.into_iter().take(CANDIDATES).cloned().collect();
    put_table(out, &candidate_table(&shown));
    if is_verbose {
        put_table(out, &candidate_numbers_table(&shown, &diagnosis.stabilities));
    }
    // effects of one set belong together, so that a rival is only an effect that may replace one of them
    let Diagnosis { named, ambiguous, .. } = diagnosis;
    let rivals: Vec<&String> = ambiguous.iter().filter(|name| !named.contains(name)).collect();
    match (named.as_slice(), rivals.as_slice()) {
        (_, []) | ([], [_]) => {}
        ([], rivals) => put(
            out,
            &format!("Not told apart by these data, with 95 % probability: {}.", listed(rivals)),
        ),
        (named, rivals) => put(
            out,
            &format!(
                "These data cannot tell {} from {} with 95 % probability.",
                listed(named),
                listed(rivals)
            ),
        ),
    }
}

/// What is named, as something to type.
fn implement(out: &mut String, all: &[Implementation], diagnosis: &Diagnosis) {
    if all.is_empty() {
        return;
    }
    put(out, "\nTo implement (--snippets DIR or the report has the code in C, Python and MATLAB):");
    for one in all {
        put(out, &format!("- {}: {}", named(one, diagnosis), one.equation()));
        if let Some(sketch) = &one.sketch {
            for q in &sketch.inputs {
                put(out, &format!("  {q}"));
            }
            put(out, &format!("  state: {}", one.state()));
        }
    }
    if let Some(words) = notation(all.iter().map(|one| one.formula.as_str())) {
        put(out, words);
    }
}

fn parameters(out: &mut String, diagnosis: &Diagnosis) {
    let moved: Vec<_> = diagnosis
        .parameters
        .iter()
        .filter(|p| p.is_evidence && (p.sigmas.abs() > 1.0 || bent(p) > 1.0))
        .collect();
    if moved.is_empty() || diagnosis.verdict == VerdictKind::NoGap {
        return;
    }
    put(out, "\nNominal parameters that moved by more than their tolerance:");
    let rows = moved.iter().map(|p| {
        vec![
            p.name.clone(),
            number(p.nominal),
            number(p.fitted),
            format!("{:+.1}", p.sigmas),
            if diagnosis.named.is_empty() { "-".to_owned() } else { number(p.bent) },
        ]
    });
    let header =
        ["parameter", "as shipped", "re-tuned", "tolerances", "bent to, without the effect"];
    put(out, &table(&header, rows));
}

/// How many nominal parameters the data determine, and with every detail what is wrong with the others.
fn identifiability(out: &mut String, diagnosis: &Diagnosis, is_verbose: bool) {
    let all = &diagnosis.identifiability;
    if all.is_empty() {
        return;
    }
    let known = all.iter().filter(|p| p.knowledge == Knowledge::Determined).count();
    let others: Vec<String> = all.iter().filter_map(stretch_gap::Identified::sentence).collect();
    let more = if is_verbose || others.is_empty() {
        ""
    } else {
        " -v says what is wrong with the others."
    };
    put(
        out,
        &format!(
            "\nOf {} nominal parameters these data determine {known} to a third of their tolerance or better.{more}",
            all.len()
        ),
    );
    for sentence in others.iter().filter(|_| is_verbose) {
        put(out, &format!("- {sentence}"));
    }
}

/// How far a parameter was bent to hide the effect, in tolerances.
fn bent(p: &stretch_gap::ParameterShift) -> f64 {
    let tolerance = (p.fitted - p.nominal) / p.sigmas;
    let far = ((p.bent - p.fitted) / tolerance).abs();
    if far.is_finite() { far } else { 0.0 }
}

fn transfer(out: &mut String, diagnosis: &Diagnosis) {
    let Some(transfer) = &diagnosis.transfer else { return };
    put_table(out, &transfer_table(transfer));
    if let Some(words) = transfer_in_words(transfer) {
        put(out, &words);
    }
}

fn baselines(out: &mut String, diagnosis: &Diagnosis) {
    let Some(said) = &diagnosis.baselines else { return };
    put_table(out, &baseline_table(said));
}

fn next(out: &mut String, diagnosis: &Diagnosis) {
    let Some(next) = &diagnosis.next_experiment else { return };
    put(
        out,
        &format!(
            "\nNext experiment: {} ({:.1} min) would tell {} apart: they differ by {} times the noise. {}",
            next.name,
            next.minutes,
            listed(&next.separates),
            number(next.d),
            next.why
        ),
    );
}

//! Output of a diagnosis: text for a terminal, a file with the corrected model, and code of the
//! named effects.

use std::path::Path;

use stretch_data::{
    files::{Outputs, write_whole},
    listed,
};
use stretch_gap::{Answer, Diagnosis, Knowledge, ParameterShift, SliceGap, VerdictKind, Where};
use stretch_problem::{ByTrial, Examined, Fixed, Implementation, effect_in_words, notation};
use stretch_report::{
    Table, candidate_numbers_table, candidate_table, difference_table, run_table, stage_table,
    times, transfer_in_words, transfer_table,
};
use stretch_sim::Language;

use super::shared::{say, stage_text};
use crate::{
    display::is_quiet,
    table::{drawn, number, table, table_text, unbroken},
};

/// Largest number of slices that are listed.
const SLICES: usize = 8;

/// Returns all details of a diagnosis: where the gap is, which effects explain it, how much they
/// explain, and what to do next. With `is_verbose`, also every parameter that the data do not
/// determine, and the numbers of every candidate.
pub(crate) fn text(
    diagnosis: &Diagnosis,
    implementations: &[Implementation],
    is_verbose: bool,
) -> String {
    let mut out = Vec::new();
    for one in implementations {
        out.push(format!("  {}: {}", named(one, diagnosis), one.words));
    }
    out.extend(diagnosis.proposed_in_words());
    for gross in diagnosis.answer.gross() {
        out.push(format!("  {}; {}", gross.sentence, gross.hint));
    }
    let rows = diagnosis.rows_used;
    if rows.used < rows.read {
        let share = percent(rows.share());
        out.push(format!(
            "The diagnosis is based on {} of {} rows ({share}).",
            rows.used, rows.read
        ));
    }
    stages(&mut out, diagnosis);
    slices(&mut out, diagnosis);
    candidates(&mut out, diagnosis, is_verbose);
    if diagnosis.verdict() != VerdictKind::NoGap {
        parameters(&mut out, &diagnosis.parameters, !diagnosis.named().is_empty());
    }
    identifiability(&mut out, diagnosis, is_verbose);
    implement(&mut out, implementations, diagnosis);
    transfer(&mut out, diagnosis);
    next(&mut out, diagnosis);
    if let Some(runs) = diagnosis.model_runs {
        out.push(format!(
            "\n{} model runs, {} simulations of stages.",
            runs.count, diagnosis.simulations
        ));
    }
    // Doubts are printed before the sentence.
    let notes = diagnosis.notes.iter().filter(|note| !note.code.is_reservation());
    let notes: Vec<_> = notes.collect();
    if !notes.is_empty() {
        out.push("\nNotes:".to_owned());
        out.extend(notes.into_iter().map(|note| format!("- {note}")));
    }
    out.join("\n").trim_end().to_owned()
}

/// Returns an effect in words, with the name used in options and files.
fn named(one: &Implementation, diagnosis: &Diagnosis) -> String {
    match effect_in_words(&one.name, diagnosis) {
        words if words == one.name => words,
        words => format!("{words} ({})", one.name),
    }
}

/// Formats a share as in the report.
fn percent(share: f64) -> String {
    unbroken(&stretch_report::percent(share))
}

/// Appends a table of the report.
fn put_table(out: &mut Vec<String>, report: &Table) {
    out.push(format!("\n{}", table_text(report)));
}

fn stages(out: &mut Vec<String>, diagnosis: &Diagnosis) {
    let Where { stages, end_to_end, .. } = &diagnosis.location;
    let mut report = stage_table(stages, !diagnosis.named().is_empty());
    report.head.push("Share".to_owned());
    for (row, stage) in report.rows.iter_mut().zip(stages) {
        row.push(percent(stage.share));
    }
    out.push("\nLocation of the gap: each stage is simulated from its measured input.".to_owned());
    out.push(format!("{}; share of the gap:", unbroken(&report.caption)));
    out.push(drawn(&report));
    if !end_to_end.is_empty() {
        let shares = end_to_end.iter().map(|e| format!("{} {}", e.stage, percent(e.share)));
        let shares: Vec<String> = shares.collect();
        out.push(format!(
            "Shares of the gap at the last output, simulated from the commands alone: {}.",
            listed(&shares)
        ));
    }
}

fn slices(out: &mut Vec<String>, diagnosis: &Diagnosis) {
    // The tables are left out if simulator and recording agree, because one slice in twenty still deviates by chance.
    if diagnosis.answer.agrees() && !matches!(diagnosis.answer, Answer::Faint { .. }) {
        return;
    }
    let mut loud: Vec<&SliceGap> =
        diagnosis.location.slices.iter().filter(|s| s.stands_out && s.by != "trial").collect();
    loud.sort_by(|a, b| b.excess.total_cmp(&a.excess));
    if loud.is_empty() {
        return;
    }
    out.push("\nParts of the data with the largest gap, in multiples of the noise (re-tuned, all trials):".to_owned());
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
    out.push(table(&["Slice", "Share of the gap", "Remaining", "95 % interval"], rows));
    if loud.len() > SLICES {
        out.push(format!("({} more in the JSON and the report)", loud.len() - SLICES));
    }
}

fn candidates(out: &mut Vec<String>, diagnosis: &Diagnosis, is_verbose: bool) {
    let all = &diagnosis.candidates;
    if all.is_empty() || diagnosis.verdict() == VerdictKind::NoGap {
        return;
    }
    put_table(out, &candidate_table(all));
    if is_verbose {
        put_table(out, &candidate_numbers_table(all, &diagnosis.stabilities));
    }
    out.extend(diagnosis.rivals_in_words());
}

/// Lists equation and state of each named effect, for implementing it.
fn implement(out: &mut Vec<String>, all: &[Implementation], diagnosis: &Diagnosis) {
    if all.is_empty() {
        return;
    }
    out.push(
        "\nTo implement (--snippets DIR or the report has the code in C, Python and MATLAB):"
            .to_owned(),
    );
    for one in all {
        out.push(format!("- {}: {}", named(one, diagnosis), one.equation()));
        if let Some(sketch) = &one.sketch {
            for q in &sketch.inputs {
                out.push(format!("  {q}"));
            }
            out.push(format!("  state: {}", one.state()));
        }
    }
    if let Some(words) = notation(all.iter().map(|one| one.formula.as_str())) {
        out.push(words.to_owned());
    }
}

/// Lists the nominal parameters that changed by more than their tolerance, in the model with the
/// named effects (`is_named`) or without effects.
fn parameters(out: &mut Vec<String>, shifts: &[ParameterShift], is_named: bool) {
    let has_moved = |p: &&ParameterShift| p.sigmas.abs() > 1.0 || p.bent_sigmas.abs() > 1.0;
    let moved: Vec<&ParameterShift> = shifts.iter().filter(has_moved).collect();
    if moved.is_empty() {
        return;
    }
    let fits = if is_named { ", with the effect or without it" } else { "" };
    out.push(format!("\nNominal parameters that changed by more than their tolerance{fits}:"));
    let rows = moved.iter().map(|p| {
        let mut row = vec![p.name.clone(), number(p.nominal), number(p.fitted)];
        row.push(format!("{:+.1}", p.sigmas));
        if is_named {
            row.extend([number(p.bent), format!("{:+.1}", p.bent_sigmas)]);
        }
        row
    });
    let header = [
        "parameter",
        "nominal",
        "re-tuned",
        "change, tolerances",
        "re-tuned without the effect",
        "change, tolerances",
    ];
    out.push(table(&header[..if is_named { 6 } else { 4 }], rows));
}

/// Reports how many nominal parameters the data determine and, with `is_verbose`, why the others
/// are not determined.
fn identifiability(out: &mut Vec<String>, diagnosis: &Diagnosis, is_verbose: bool) {
    let all = &diagnosis.identifiability;
    if all.is_empty() {
        return;
    }
    let known = all.iter().filter(|p| p.knowledge == Knowledge::Determined).count();
    let others: Vec<String> = all.iter().filter_map(stretch_gap::Identified::sentence).collect();
    let more =
        if is_verbose || others.is_empty() { "" } else { " -v lists the reasons for the others." };
    out.push(format!(
            "\nThese data determine {known} of {} nominal parameters to a third of their tolerance or better.{more}",
            all.len()
        ));
    for sentence in others.iter().filter(|_| is_verbose) {
        out.push(format!("- {sentence}"));
    }
}

fn transfer(out: &mut Vec<String>, diagnosis: &Diagnosis) {
    let Some(transfer) = &diagnosis.transfer else { return };
    put_table(out, &transfer_table(transfer));
    if let Some(words) = transfer_in_words(transfer) {
        out.push(words);
    }
}

fn next(out: &mut Vec<String>, diagnosis: &Diagnosis) {
    out.extend(diagnosis.next_experiment.iter().map(|next| match next.separates.is_empty() {
        true => format!("\n{}", next.in_words()),
        false => format!("\nNext experiment: {}", next.in_words()),
    }));
}

/// Prints which runs disagree and in which parameters, unless the option `-q` is set.
pub(super) fn print_by_trial(by_trial: &ByTrial) -> anyhow::Result<()> {
    if is_quiet() {
        return Ok(());
    }
    by_trial.sentences().iter().try_for_each(|sentence| say(format!("\n{sentence}")))?;
    say(format!("\n{}", table_text(&difference_table(by_trial))))?;
    say(format!("\n{}", table_text(&run_table(by_trial))))
}

/// Writes the corrected rig or problem file, if there is one, and returns a message about it.
pub(super) fn write_fix(
    outputs: &mut Outputs,
    path: &Path,
    examined: &Examined,
) -> anyhow::Result<String> {
    let shown = path.display();
    let mut fix = match &examined.fix {
        Err(why) => return Ok(format!("{shown} is not written: {why}")),
        Ok(fix) => fix.clone(),
    };
    let Examined { name, seed, .. } = examined;
    let from =
        format!("Found by stretch {} diagnose {name}, seed {seed}.", env!("CARGO_PKG_VERSION"));
    fix.remarks.head.insert(0, from);
    let is_there = path.exists();
    stage_text(outputs, path, &fix.text(path))?;
    let what = match fix.file {
        Fixed::Rig(_) => "the rig",
        Fixed::Problem(_) => "the problem",
    };
    let with = if fix.effects.is_empty() { "no effect".to_owned() } else { listed(&fix.effects) };
    let replaced = if is_there { ", replacing the existing file" } else { "" };
    Ok(format!("wrote {shown}: {what} re-tuned, with {with}{replaced}"))
}

/// Writes the code of the named effects, if there is any, and returns a message about it.
pub(super) fn write_snippets(
    outputs: &mut Outputs,
    folder: &Path,
    all: &[Implementation],
) -> anyhow::Result<String> {
    let shown = folder.display();
    let mut files = Vec::new();
    for one in all {
        for language in Language::ALL {
            let name = format!("{}.{}", Language::identifier(&one.name), language.ending());
            files.extend(one.code(language).map(|code| (name, code)));
        }
    }
    if files.is_empty() {
        let why = if all.is_empty() {
            "no effect is named"
        } else {
            "no code is available for the named effects"
        };
        return Ok(format!("{shown} is not written: {why}"));
    }
    outputs.folder(folder, false, |folder| {
        files.iter().try_for_each(|(name, code)| {
            write_whole(folder.join(name), |out| out.write_all(code.as_bytes()))
        })
    })?;
    Ok(format!("wrote {shown}: {} files", files.len()))
}

#[cfg(test)]
mod tests {
    use stretch_gap::ParameterShift;

    /// If a parameter changed only in the fit without the effect, the change is in the column of that fit.
    #[test]
    fn changes_of_both_fits_are_listed() {
        let shift = |name: &str, sigmas, bent_sigmas| ParameterShift {
            name: name.to_owned(),
            unit: String::new(),
            nominal: 2.0,
            fitted: 2.0 + 0.1 * sigmas,
            sd: 0.01,
            sigmas,
            bent: 2.0 + 0.1 * bent_sigmas,
            bent_sigmas,
            is_evidence: true,
        };
        let shifts =
            [shift("hidden", 0.0, 3.0), shift("kept", 0.2, -0.2), shift("moved", -2.0, 0.1)];
        let mut out = Vec::new();
        super::parameters(&mut out, &shifts, true);
        let text = out.join("\n");
        assert!(text.contains("+0.0") && text.contains("+3.0") && text.contains("-2.0"), "{text}");
        assert!(!text.contains("kept"), "{text}");
        let mut alone = Vec::new();
        super::parameters(&mut alone, &shifts[..1], false);
        assert!(!alone.join("\n").contains("effect"), "{alone:?}");
    }
}

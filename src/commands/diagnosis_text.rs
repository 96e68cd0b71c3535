//! A diagnosis as text on a terminal.

use std::fmt::Write;

use stretch_bench::Implementation;
use stretch_blind::method_in_words;
use stretch_gap::{Candidate, Diagnosis, Knowledge, SliceGap, VerdictKind};
use stretch_report::{effect_in_words, listed, methods, transfer_in_words};

use crate::table::{number, table};

/// Most slices that are listed.
const SLICES: usize = 8;
/// Most candidates that are listed.
const CANDIDATES: usize = 6;

/// Everything behind the sentence: where, which, how far, and what to do next.
pub(crate) fn text(diagnosis: &Diagnosis, implementations: &[Implementation]) -> String {
    let mut out = String::new();
    for name in &diagnosis.named {
        if let Some(words) = effect_in_words(name) {
            put(&mut out, &format!("  {name}: {words}"));
        }
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
    candidates(&mut out, diagnosis);
    parameters(&mut out, diagnosis);
    identifiability(&mut out, diagnosis);
    implement(&mut out, implementations);
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

fn put(out: &mut String, line: &str) {
    // a string takes every write
    let _ = writeln!(out, "{line}");
}

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

fn stages(out: &mut String, diagnosis: &Diagnosis) {
    put(out, "\nWhere, stage by stage on its measured input (gaps on test trials, in floors):");
    let end_to_end = &diagnosis.location.end_to_end;
    let mut header =
        vec!["stage", "share", "as shipped", "re-tuned", "with effect", "left", "floor"];
    if !end_to_end.is_empty() {
        header.push("end to end");
    }
    let rows = diagnosis.location.stages.iter().map(|s| {
        let mut row = vec![
            s.stage.clone(),
            percent(s.share),
            number(s.raw),
            number(s.excess),
            if diagnosis.named.is_empty() { "-".to_owned() } else { number(s.after) },
            format!("{} {}", number(s.rms), s.unit),
            format!("{} {}", number(s.floor), s.unit),
        ];
        let share = end_to_end.iter().find(|e| e.stage == s.stage);
        row.extend(share.map(|e| percent(e.share)));
        row
    });
    put(out, &table(&header, rows));
}

fn slices(out: &mut String, diagnosis: &Diagnosis) {
    let mut loud: Vec<&SliceGap> =
        diagnosis.location.slices.iter().filter(|s| s.stands_out && s.by != "trial").collect();
    loud.sort_by(|a, b| b.excess.total_cmp(&a.excess));
    if loud.is_empty() {
        return;
    }
    put(out, "\nWhere it stands out (all trials, re-tuned):");
    let rows = loud.iter().take(SLICES).map(|s| {
        let [low, high] = s.excess_ci;
        vec![
            format!("{}, {}: {}", s.stage, s.by, s.slice),
            percent(s.share),
            number(s.excess),
            format!("{} .. {}", number(low), number(high)),
        ]
    });
    put(out, &table(&["slice", "share", "gap", "95 % interval"], rows));
    if loud.len() > SLICES {
        put(out, &format!("({} more in the JSON and the report)", loud.len() - SLICES));
    }
}

fn candidates(out: &mut String, diagnosis: &Diagnosis) {
    let shown: Vec<&Candidate> =
        diagnosis.candidates.iter().filter(|c| !c.effects.is_empty()).collect();
    if shown.is_empty() || diagnosis.verdict == VerdictKind::NoGap {
        return;
    }
    put(out, "\nWhich:");
    let rows = shown.iter().take(CANDIDATES).map(|c| {
        let [low, high] = c.closed_ci;
        let values: Vec<String> = c
            .parameters
            .iter()
            .map(|p| {
                let unit = if p.unit == "1" { String::new() } else { format!(" {}", p.unit) };
                format!("{} = {}{unit} +- {}", p.name, number(p.value), number(p.sd))
            })
            .collect();
        vec![
            c.effects.join(" + "),
            format!("{:.3}", c.probability),
            format!("{} -> {}", number(c.gap_before), number(c.gap_after)),
            percent(c.closed),
            format!("{} .. {}", percent(low), percent(high)),
            values.join(", "),
        ]
    });
    let header = ["effects", "probability", "gap", "closes", "95 % interval", "parameters"];
    put(out, &table(&header, rows));
    if diagnosis.ambiguous.len() > 1 {
        put(
            out,
            &format!("95 % set, not told apart by these data: {}.", listed(&diagnosis.ambiguous)),
        );
    }
}

/// What is named, as something to type.
fn implement(out: &mut String, all: &[Implementation]) {
    if all.is_empty() {
        return;
    }
    put(out, "\nTo implement (--snippets DIR or the report has the code in C, Python and MATLAB):");
    for one in all {
        put(out, &format!("- {}: {}", one.effect.name, one.equation()));
        if let Some(sketch) = &one.sketch {
            for q in &sketch.inputs {
                put(out, &format!("  {q}"));
            }
            put(out, &format!("  state: {}", one.state()));
        }
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

/// Which nominal parameters the data determine, and what is wrong with the others.
fn identifiability(out: &mut String, diagnosis: &Diagnosis) {
    let all = &diagnosis.identifiability;
    if all.is_empty() {
        return;
    }
    let known = all.iter().filter(|p| p.knowledge == Knowledge::Determined).count();
    put(
        out,
        &format!(
            "\nOf {} nominal parameters these data determine {known} to a third of their tolerance or better.",
            all.len()
        ),
    );
    for sentence in all.iter().filter_map(stretch_gap::Identified::sentence) {
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
    put(
        out,
        "\nWhat it costs: error on measured trials of a calibration trained elsewhere, % of full scale",
    );
    let rows = [("linear", transfer.linear), ("poly13", transfer.poly13)].map(|(name, e)| {
        vec![name.to_owned(), number(e.real), number(e.sim), number(e.sim_with_effect)]
    });
    let header = ["calibration", "trained on measured", "in the simulator", "with the effect"];
    put(out, &table(&header, rows));
    if let Some(words) = transfer_in_words(transfer) {
        put(out, &words);
    }
}

fn baselines(out: &mut String, diagnosis: &Diagnosis) {
    let Some(said) = &diagnosis.baselines else { return };
    put(out, "\nWhat simpler methods would have said:");
    let rows = methods(said).map(|(method, name)| {
        vec![method_in_words(method).to_owned(), name.unwrap_or("nothing").to_owned()]
    });
    put(out, &table(&["method", "names"], rows));
}

fn next(out: &mut String, diagnosis: &Diagnosis) {
    let Some(next) = &diagnosis.next_experiment else { return };
    put(
        out,
        &format!(
            "\nNext experiment: {} ({:.1} min) would tell {} apart: they differ by {} floors. {}",
            next.name,
            next.minutes,
            listed(&next.separates),
            number(next.d),
            next.why
        ),
    );
}

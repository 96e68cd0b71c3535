//! A score as text: the table of figures, then every miss.

use std::fmt;

use crate::rate::Rate;
use crate::score::Score;

fn row(f: &mut fmt::Formatter<'_>, what: &str, rate: &Rate) -> fmt::Result {
    match (rate.share(), rate.wilson()) {
        (Some(share), Some((low, high))) => {
            let Rate { hits, cases } = rate;
            writeln!(f, "| {what} | {share:.3} | {hits} of {cases} | {low:.3} .. {high:.3} |")
        }
        _ => writeln!(f, "| {what} | - | no case | |"),
    }
}

fn number(f: &mut fmt::Formatter<'_>, what: &str, value: Option<f64>) -> fmt::Result {
    match value {
        Some(value) => writeln!(f, "| {what} | {value:.3} | | |"),
        None => writeln!(f, "| {what} | - | no case | |"),
    }
}

/// A simpler method in words.
#[must_use]
pub fn method_in_words(method: &str) -> &str {
    match method {
        "largest_drop" => "largest drop of the error, parameters as shipped",
        "signature" => "likeness of a one-step signature",
        "bic" => "BIC alone",
        other => other,
    }
}

/// This diagnosis and the simpler methods on the same cases.
fn methods(f: &mut fmt::Formatter<'_>, score: &Score) -> fmt::Result {
    let cell = |rate: &Rate| rate.cell(3, "no case");
    writeln!(f, "\n| method | top-1 | above 10 | names something on nulls |")?;
    writeln!(f, "| --- | --- | --- | --- |")?;
    let mut row = |name: &str, top1: &Rate, above: &Rate, nulls: &Rate| {
        writeln!(f, "| {name} | {} | {} | {} |", cell(top1), cell(above), cell(nulls))
    };
    let s = &score.singles;
    row("this diagnosis", &s.top1, &s.top1_above_10, &score.false_names)?;
    score.baselines.iter().try_for_each(|(name, b)| {
        row(method_in_words(name), &b.top1, &b.top1_above_10, &b.false_names)
    })
}

/// The families of forms, a row each.
fn families(f: &mut fmt::Formatter<'_>, score: &Score) -> fmt::Result {
    writeln!(
        f,
        "\n| family | exactly the one named | first name | stage | set covers | both; one of two | \
         dominant | alarms on nulls | foreign unknown | struck | ECE |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    )?;
    for (family, row) in &score.families {
        let cells = |rates: &[Rate]| rates.iter().map(|r| r.cell(2, "-")).collect::<Vec<_>>();
        let singles = [row.exact, row.top1, row.stage, row.set_covers_all];
        let others = [row.strongest_named, row.false_alarms, row.foreign_caught, row.struck];
        writeln!(
            f,
            "| {family} | {} | {} | {} | {} |",
            cells(&singles).join(" | "),
            cells(&[row.both_named, row.one_named]).join("; "),
            cells(&others).join(" | "),
            row.ece.map_or_else(|| "-".to_owned(), |e| format!("{e:.3}")),
        )?;
    }
    Ok(())
}

impl fmt::Display for Score {
    /// A Markdown table of every figure with Wilson's intervals, then a table of the methods if
    /// simpler ones ran, then the misses.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let s = &self.singles;
        writeln!(f, "| figure | value | count | 95 % interval |\n| --- | --- | --- | --- |")?;
        row(f, "top-1 at excess >= 0.1", &s.top1)?;
        row(f, "top-1 above 10", &s.top1_above_10)?;
        row(f, "top-1 from 1 to 10", &s.top1_1_to_10)?;
        row(f, "top-1 from 0.1 to 1", &s.top1_below_1)?;
        row(f, "top-1, twins pooled", &s.top1_twins)?;
        row(f, "first name, ties not counted", &s.first_name)?;
        row(f, "exactly the one effect named, a declared tie counted right", &s.exact)?;
        if s.tied.hits > 0 {
            row(f, "ties declared", &s.tied)?;
            number(f, "mean names in a tie", s.tie_size)?;
        }
        if s.partial.hits > 0 {
            row(f, "called a part of the gap", &s.partial)?;
        }
        if s.false_record.hits > 0 {
            row(f, "called an error of the recording", &s.false_record)?;
        }
        row(f, "stage", &s.stage)?;
        row(f, "95 % set covers (sets not empty)", &s.set_covers)?;
        row(f, "95 % set covers (empty = miss)", &s.set_covers_all)?;
        number(f, "mean size of the 95 % set", s.set_size)?;
        row(f, "sets of one right", &s.singletons_right)?;
        row(f, "false unknowns", &s.false_unknown)?;
        row(f, "overlooked", &s.overlooked)?;
        row(f, "fainter than 0.1 and named: right", &s.faint_named)?;
        row(f, "false alarms on nulls", &self.false_alarms)?;
        row(f, "false names on nulls", &self.false_names)?;
        number(f, "expected calibration error", self.calibration.ece)?;
        if self.calibration_unknown.ece.is_some() {
            number(f, "calibration error of unknown", self.calibration_unknown.ece)?;
        }
        row(f, "compounds: both named", &self.compounds.all_named)?;
        row(f, "compounds: one named", &self.compounds.one_named)?;
        row(f, "compounds: precision", &self.compounds.precision)?;
        row(f, "compounds: recall", &self.compounds.recall)?;
        row(f, "dominant named", &self.dominants.strongest_named)?;
        row(f, "dominant and small: precision", &self.dominants.precision)?;
        row(f, "dominant and small: recall", &self.dominants.recall)?;
        row(f, "out of the catalogue: unknown", &self.foreign_caught)?;
        row(f, "out of the catalogue: a name", &self.foreign_named)?;
        row(f, "out of the catalogue: stage", &self.foreign_stage)?;
        row(f, "struck out: unknown or twin", &self.struck.unknown_or_twin)?;
        row(f, "struck out, no twin: unknown", &self.struck.unknown_no_twin)?;
        row(f, "struck out, nothing closes 85 %: unknown", &self.struck.unknown_no_stand_in)?;
        row(f, "struck out: wrong name", &self.struck.wrong_name)?;
        number(f, "median closed gap, named rightly", self.closed)?;
        number(f, "median closed gap, all singles", self.closed_all)?;
        number(f, "median closed gap beside the oracle", self.closed_beside_oracle)?;
        number(f, "median closed gap of the oracle", self.closed_oracle)?;
        if let Some((median, p95, most)) = self.runtime_s {
            writeln!(
                f,
                "| time, s: median, 95th percentile, greatest | {median:.2} | {p95:.2} | {most:.2} |"
            )?;
        }
        if let Some((low, high)) = self.false_alarms.exact() {
            writeln!(f, "\nFalse alarms, exact 95 % interval: {low:.4} .. {high:.4}.")?;
        }
        if !self.baselines.is_empty() {
            methods(f, self)?;
        }
        if !self.families.is_empty() {
            families(f, self)?;
        }
        if !self.unanswered.is_empty() {
            writeln!(f, "\nUnanswered: {}.", self.unanswered.join(", "))?;
        }
        writeln!(f, "\n{} wrong of {}:\n", self.misses.len(), self.cases)?;
        for miss in &self.misses {
            let truth =
                if miss.truth.is_empty() { "nothing".into() } else { miss.truth.join(" + ") };
            let named = if miss.named.is_empty() { "-".into() } else { miss.named.join(" + ") };
            writeln!(
                f,
                "- {} ({}, excess {:.2}{}): {truth}; said {}: {named}{}",
                miss.case,
                miss.kind.name(),
                miss.excess,
                if miss.pressure_column { "" } else { ", no pressure" },
                miss.verdict,
                if miss.in_set && !miss.truth.is_empty() { "; truth in the 95 % set" } else { "" },
            )?;
        }
        Ok(())
    }
}

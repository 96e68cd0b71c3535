//! A calibration as text on a terminal.

use stretch_calibrate::{Calibrated, Candidate, FitReport, MODELS_IN_WORDS, ModelChoice, ModelRow};
use stretch_data::unit_of;
use stretch_report::{order_table, signal_table};

use super::shared::{say, say_first, tell};
use crate::display::is_verbose;
use crate::table::{maybe, number, table, table_text};

/// Heading of the column with the excess of a model's mean squared error over that of the best
/// model.
const SQUARED_EXCESS: &str = "MSE above best";

/// Headings of the columns for single kinds of trial.
const KINDS: [&str; 3] = ["arbitrary", "pulses", "ramps"];

/// Prints the models that `auto` compared. Columns without values are left out.
pub(super) fn print_models(choice: &ModelChoice, reference: &str) -> anyhow::Result<()> {
    say_first(format!("Chosen: {}.", choice.why))?;
    let unit = unit_of(reference);
    let unit = if unit.is_empty() { unit } else { format!(" in {unit}") };
    say(format!("Models, RMSE{unit} on trials left out of the fit:"))?;
    let row = |r: &ModelRow| {
        if let Some(problem) = &r.problem {
            return vec![r.model.clone(), problem.clone()];
        }
        let excess =
            |(mean, error): (f64, f64)| format!("{} \u{b1} {}", number(mean), number(error));
        vec![
            r.model.clone(),
            maybe(r.rmse),
            maybe(r.rmse_arbitrary),
            maybe(r.rmse_pulses),
            maybe(r.rmse_ramps),
            r.lag_s.map_or("-".to_owned(), |lag| format!("{:.0}", 1e3 * lag)),
            maybe(r.worst),
            r.parameters.to_string(),
            instructions(r),
            r.excess.map_or("-".to_owned(), excess),
            if r.model == choice.model.to_string() { "chosen".to_owned() } else { String::new() },
        ]
    };
    let header = [
        "model",
        "all",
        KINDS[0],
        KINDS[1],
        KINDS[2],
        "delay ms",
        "worst",
        "coefficients",
        "M3 instr.",
        SQUARED_EXCESS,
        "",
    ];
    let rows: Vec<Vec<String>> = choice.rows.iter().map(row).collect();
    let has_values = |i: &usize| rows.iter().any(|row| row.get(*i).is_some_and(|cell| cell != "-"));
    // with trials of one kind only, the column of that kind repeats the first one
    let is_kind = |i: &usize| KINDS.contains(&header[*i]);
    let has_kinds = (0..header.len()).filter(|i| is_kind(i) && has_values(i)).count() > 1;
    let is_shown = |i: &usize| {
        has_values(i)
            && (is_verbose() || header[*i] != SQUARED_EXCESS)
            && (has_kinds || !is_kind(i))
    };
    let columns: Vec<usize> = (0..header.len()).filter(is_shown).collect();
    let picked = |row: &Vec<String>| columns.iter().filter_map(|i| row.get(*i).cloned()).collect();
    let header: Vec<&str> = columns.iter().map(|i| header[*i]).collect();
    say(table(&header, rows.iter().map(picked)))?;
    if is_verbose() {
        say(format!("Models: {}.", MODELS_IN_WORDS))?;
        say(
            "worst: the largest error. coefficients: their number. M3 instr.: measured instructions per sample on a Cortex-M3, f32 (fixed point). \
             MSE above best: mean squared error minus that of the best model. \u{b1}: one standard error.",
        )?;
    }
    Ok(())
}

/// Formats the instruction count from volts in `f32`, and in fixed point if the model has such a
/// form.
fn instructions(row: &ModelRow) -> String {
    match (row.m3_instructions, row.m3_instructions_fixed) {
        (Some(float), Some(fixed)) => format!("{float:.0} ({fixed:.0})"),
        (Some(float), None) => format!("{float:.0}"),
        _ => "-".to_owned(),
    }
}

/// Prints the tables of a calibration. With `-v`, prints everything that the paper of the published
/// method lists.
pub(super) fn print(calibrated: &Calibrated, ranking: &[Candidate]) -> anyhow::Result<()> {
    print_fits(calibrated, ranking)?;
    if is_verbose() {
        print_coefficients(calibrated)?;
    }
    print_notes(calibrated)
}

/// Prints the quality of each fit.
fn print_fits(calibrated: &Calibrated, ranking: &[Candidate]) -> anyhow::Result<()> {
    if !ranking.is_empty() {
        say(table_text(&signal_table(ranking)))?;
    }
    let row = |fit: &FitReport| {
        vec![
            fit.name.clone(),
            fit.model.clone(),
            fit.samples.to_string(),
            format!("{:.4}", fit.r_squared),
            number(100.0 * fit.rmse),
            number(fit.condition),
        ]
    };
    let header = ["fit", "model", "samples", "R^2", "RMSE % of range", "condition"];
    say(table(&header, calibrated.fits.iter().map(row)))
}

fn print_notes(calibrated: &Calibrated) -> anyhow::Result<()> {
    for note in &calibrated.notes {
        tell(format!("note: {note}"))?;
    }
    Ok(())
}

/// Prints the coefficients of each fit, and the orders among which it was chosen.
fn print_coefficients(calibrated: &Calibrated) -> anyhow::Result<()> {
    say("Coefficients (normalised rate r, signal V) with 95 % bounds:")?;
    let rows = calibrated.fits.iter().flat_map(|fit| {
        fit.coefficients.iter().map(|c| {
            vec![
                format!("{} {}", fit.name, c.name),
                number(c.estimate),
                number(c.lower),
                number(c.upper),
            ]
        })
    });
    say(table(&["coefficient", "estimate", "lower", "upper"], rows))?;
    // If there is only one order, there is nothing to compare.
    let mut fits = calibrated.fits.iter().filter(|fit| fit.orders.len() > 1);
    fits.try_for_each(|fit| say(table_text(&order_table(fit))))
}

//! A calibration as text on a terminal.

use stretch_calibrate::{
    Calibrated, Candidate, FitReport, MODELS_IN_WORDS, Memory, ModelChoice, ModelKind, ModelRow,
};
use stretch_data::unit_of;
use stretch_report::{order_table, signal_table};

use crate::display::is_verbose;
use crate::table::{maybe, number, table, table_text};

/// Heading of the column with the excess of a model's mean squared error over that of the best
/// model.
const SQUARED_EXCESS: &str = "MSE above best";

/// Headings of the columns for single kinds of trial.
const KINDS: [&str; 3] = ["arbitrary", "pulses", "ramps"];

/// Number of models that are shown without `-v`.
const SHOWN: usize = 8;

/// Returns the models that `auto` compared as a table, with the chosen model first. Also says which model can be
/// exported to C. Without `-v`, only the best models are shown.
pub(super) fn blocks_of_models(choice: &ModelChoice, reference: &str) -> Vec<String> {
    let chosen = choice.model.to_string();
    let (own, others): (Vec<&ModelRow>, Vec<_>) =
        choice.rows.iter().partition(|row| row.model == chosen);
    let most = if is_verbose() { usize::MAX } else { SHOWN };
    let shown: Vec<&ModelRow> = own.into_iter().chain(others).take(most).collect();
    let unit = unit_of(reference);
    let unit = if unit.is_empty() { unit } else { format!(" in {unit}") };
    let count = match choice.rows.len() {
        all if all > shown.len() => format!("; {} of {all} models", shown.len()),
        _ => String::new(),
    };
    let mut blocks: Vec<String> = on_this_computer(choice, reference).into_iter().collect();
    blocks.push(format!(
        "RMSE{unit} on {} left out of the fit (* chosen{count}):\n{}",
        choice.left_out,
        table_of_models(&shown, &chosen)
    ));
    if is_verbose() {
        blocks.push(format!("Models: {MODELS_IN_WORDS}."));
        blocks.push(
            "worst: the largest error. coefficients: their number. instructions: measured for one sample, with f32 and, in brackets, in fixed point. \
             MSE above best: mean squared error minus that of the best model. \u{b1}: one standard error."
                .to_owned(),
        );
        let problems =
            choice.rows.iter().filter_map(|row| Some((&row.model, row.problem.as_ref()?)));
        blocks.extend(
            problems.map(|(model, problem)| format!("{model} cannot be fitted: {problem}")),
        );
    }
    blocks
}

/// Headings of the table of fits. Without `-v`, only the first four columns are shown, because the sentence above the
/// table has the error.
const FITS: [&str; 6] =
    ["fit", "model", "samples", "R^2", "residual SD, % of range", "condition number"];

/// Number of signals that are listed without `-v`.
const MOST_SIGNALS: usize = 12;

/// Whether `stretch export --c` writes a model.
fn exports_to_c(model: &str) -> bool {
    let kind: Result<ModelKind, _> = model.parse();
    !matches!(kind, Ok(ModelKind::Remembering { kind: Memory::History, .. }))
}

/// If the chosen model has no C code, returns a sentence that names the best model with C code.
fn on_this_computer(choice: &ModelChoice, reference: &str) -> Option<String> {
    let chosen = choice.model.to_string();
    if exports_to_c(&chosen) {
        return None;
    }
    let best = choice.rows.iter().find(|row| exports_to_c(&row.model) && row.rmse.is_some())?;
    let error = format!("{} {}", maybe(best.rmse), unit_of(reference));
    Some(format!(
        "{chosen} runs on a computer and in Rust only; the best model that exports to C is {} (RMSE {}).",
        best.model,
        error.trim_end()
    ))
}

/// Formats models as a table. Columns without values are left out.
fn table_of_models(rows: &[&ModelRow], chosen: &str) -> String {
    let row = |r: &&ModelRow| {
        let name = if r.model == chosen { format!("{} *", r.model) } else { r.model.clone() };
        if r.problem.is_some() {
            return vec![name, "not fitted".to_owned()];
        }
        let excess =
            |(mean, error): (f64, f64)| format!("{} \u{b1} {}", number(mean), number(error));
        vec![
            name,
            maybe(r.rmse),
            maybe(r.rmse_arbitrary),
            maybe(r.rmse_pulses),
            maybe(r.rmse_ramps),
            r.lag_s.map_or("-".to_owned(), |lag| format!("{:.0}", (1e3 * lag).round() + 0.0)),
            maybe(r.worst),
            r.parameters.to_string(),
            instructions(r),
            r.excess.map_or("-".to_owned(), excess),
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
        "instructions on a Cortex-M3 (fixed point)",
        SQUARED_EXCESS,
    ];
    let rows: Vec<Vec<String>> = rows.iter().map(row).collect();
    let has_values = |i: &usize| rows.iter().any(|row| row.get(*i).is_some_and(|cell| cell != "-"));
    // if all trials are of one kind, the column of that kind repeats the first column
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
    table(&header, rows.iter().map(picked))
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

/// Formats candidate signals in one line, best first.
fn line_of_signals(ranking: &[Candidate]) -> String {
    let (shown, others) = ranking.split_at(ranking.len().min(MOST_SIGNALS));
    let one = |c: &Candidate| {
        let error = c.cross_validated_rmse.map(|rmse| number(100.0 * rmse));
        format!("{} {}", c.signal, error.unwrap_or_else(|| "not fitted".to_owned()))
    };
    let shown: Vec<String> = shown.iter().map(one).collect();
    let more =
        if others.is_empty() { String::new() } else { format!(", and {} more", others.len()) };
    format!("Cross-validated RMSE of the signals, % of range: {}{more}.", shown.join(", "))
}

/// Returns notes as paragraphs.
pub(super) fn blocks_of_notes(notes: &[String]) -> impl Iterator<Item = String> {
    notes.iter().map(|note| format!("note: {note}"))
}

/// Returns the tables of a calibration, with the quality of each fit unless its model was
/// `chosen` from a table. With `-v`, they contain everything that the paper of the published method
/// lists.
pub(super) fn blocks_of_calibration(
    calibrated: &Calibrated,
    ranking: &[Candidate],
    chosen: bool,
) -> Vec<String> {
    let mut blocks = Vec::new();
    match ranking {
        [] => {}
        _ if is_verbose() => blocks.push(table_text(&signal_table(ranking))),
        _ => blocks.push(line_of_signals(ranking)),
    }
    blocks.extend((!chosen || is_verbose()).then(|| table_of_fits(calibrated)));
    if is_verbose() {
        blocks.extend(coefficients(calibrated));
    }
    blocks
}

/// Formats the quality of each fit.
fn table_of_fits(calibrated: &Calibrated) -> String {
    let shown = if is_verbose() { FITS.len() } else { 4 };
    let row = |fit: &FitReport| {
        let mut cells = vec![
            fit.name.clone(),
            fit.model.clone(),
            fit.samples.to_string(),
            format!("{:.4}", fit.r_squared),
            number(100.0 * fit.rmse),
            number(fit.condition),
        ];
        cells.truncate(shown);
        cells
    };
    let table = table(&FITS[..shown], calibrated.fits.iter().map(row));
    let words = "residual SD: standard deviation of the residuals of the fit. It exceeds their RMSE, because the number of coefficients \
                 is subtracted from that of the samples. condition number: a large one means that the data hardly determine \
                 the coefficients.";
    if is_verbose() { format!("{table}\n{words}") } else { table }
}

/// Formats the coefficients of each fit, and the orders among which it was chosen.
fn coefficients(calibrated: &Calibrated) -> Vec<String> {
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
    let coefficients = table(&["coefficient", "estimate", "lower", "upper"], rows);
    let mut blocks = vec![format!(
        "Coefficients (normalised rate r, signal V) with 95 % bounds:\n{coefficients}"
    )];
    // If there is only one order, there is nothing to compare.
    let fits = calibrated.fits.iter().filter(|fit| fit.orders.len() > 1);
    blocks.extend(fits.map(|fit| table_text(&order_table(fit))));
    blocks
}

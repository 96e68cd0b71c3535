//! The report of a foretelling: new recordings, measured and simulated with a fix and without.

use std::ops::Range;

use stretch_problem::{Foretold, ForetoldOutput, ForetoldTrial, Unexcited};

use super::{
    canvas::Ink,
    figure::{Figure, FigureSize, lines_figure},
    gap_figures::{AFTER, BEFORE},
    markup::number,
    page::{Page, Table},
    thin::{curve, extent},
};

/// Seconds of the closer look.
const WINDOW_S: f64 = 8.0;
/// Parts that go beyond what was fitted and are told one by one.
const PARTS: usize = 6;

/// The report as a page.
pub fn foretell_page(foretold: &Foretold) -> String {
    let mut page = Page::new(&format!("Foretold: {}", foretold.name), &foretold.sentence());
    page.facts(&[
        ("Effects of the fix", foretold.effects.join(", ")),
        ("Error, with over without", number(foretold.ratio(), 3)),
        ("Largest error", format!("{} times the noise", number(foretold.worst(), 3))),
    ]);
    page.list(&foretold.notes);
    page.section(
        "How near it comes",
        "Root mean square errors of recordings that were not fitted. Without: the simulator with its parameters re-tuned alone. A ratio below 1 is what the fix is good for.",
    );
    page.table(&foretell_table(foretold));
    for trial in &foretold.trials {
        of_trial(&mut page, foretold, trial);
    }
    page.finish()
}

/// Errors of every output of every recording.
pub fn foretell_table(foretold: &Foretold) -> Table {
    let head =
        ["recording", "output", "unit", "with", "without", "ratio", "times noise", "without it"];
    let of = |trial: &ForetoldTrial, o: &ForetoldOutput| {
        let numbers = [o.rmse, o.rmse_without, o.ratio, o.times_noise, o.times_noise_without];
        let texts = [trial.name.clone(), o.column.clone(), o.unit.clone()];
        texts.into_iter().chain(numbers.map(|x| number(x, 3))).collect::<Vec<String>>()
    };
    let rows = foretold.trials.iter().flat_map(|t| t.outputs.iter().map(move |o| of(t, o)));
    Table::new("Root mean square errors of what was foretold", &head, rows.collect::<Vec<_>>())
}

fn of_trial(page: &mut Page, foretold: &Foretold, trial: &ForetoldTrial) {
    let intro = match trial.unexcited.is_empty() {
        true => "All of it lies within what was fitted.",
        false => {
            "Parts go beyond what was fitted: there the fix must not be believed. They are marked below the curves."
        }
    };
    page.section(&trial.name, intro);
    page.list(&trial.unexcited.iter().map(told).collect::<Vec<_>>());
    for output in &trial.outputs {
        let whole = 0.0..trial.seconds;
        page.figure(
            &traces(foretold, trial, output, &whole),
            &format!("{}: the whole recording.", output.stage),
        );
        if trial.seconds > 2.0 * WINDOW_S {
            let look = closest(output, foretold.dt_s);
            let caption =
                format!("{}: where the simulator without the fix errs most.", output.stage);
            page.figure(&traces(foretold, trial, output, &look), &caption);
        }
    }
}

/// In which way, and where.
fn told(unexcited: &Unexcited) -> String {
    let part = |[from, to]: &[f64; 2]| format!("{from:.2} to {to:.2} s");
    let parts: Vec<String> = unexcited.parts.iter().take(PARTS).map(part).collect();
    let more = unexcited.parts.len().saturating_sub(PARTS);
    let more = if more > 0 { format!(", and {more} parts more") } else { String::new() };
    format!("{} ({}{more})", unexcited.sentence(), parts.join(", "))
}

/// The window with the largest error without the fix.
fn closest(output: &ForetoldOutput, dt_s: f64) -> Range<f64> {
    let length = (WINDOW_S / dt_s) as usize;
    let apart = output.measured.iter().zip(&output.without);
    let squares: Vec<f64> = apart.map(|(m, s)| (m - s) * (m - s)).collect();
    let step = (length / 16).max(1);
    let sum = |from: usize| squares[from..from + length].iter().sum::<f64>();
    let starts = (0..=squares.len().saturating_sub(length) / step).map(|k| k * step);
    let whole = starts.filter(|from| from + length <= squares.len());
    let from = whole.max_by(|a, b| sum(*a).total_cmp(&sum(*b))).unwrap_or(0);
    from as f64 * dt_s..(from + length) as f64 * dt_s
}

fn traces(
    foretold: &Foretold,
    trial: &ForetoldTrial,
    output: &ForetoldOutput,
    window: &Range<f64>,
) -> Figure {
    let time: Vec<f64> = (0..output.measured.len()).map(|i| i as f64 * foretold.dt_s).collect();
    let all = [&output.measured, &output.without, &output.with];
    let span = extent(all.iter().flat_map(|x| x.iter().copied())).unwrap_or(0.0..1.0);
    let below = span.start - 0.06 * (span.end - span.start);
    let is_beyond = |t: &f64| {
        let mut parts = trial.unexcited.iter().flat_map(|u| &u.parts);
        parts.any(|[from, to]| (from - foretold.dt_s..=to + foretold.dt_s).contains(t))
    };
    let mark: Vec<f64> = time.iter().map(|t| if is_beyond(t) { below } else { f64::NAN }).collect();
    let lines = [
        (Ink::Truth, 3.2, &output.measured),
        (BEFORE, 1.5, &output.without),
        (AFTER, 1.5, &output.with),
        (Ink::High, 5.0, &mark),
    ];
    let thin = |bins: usize| {
        lines.iter().map(|(ink, w, y)| (*ink, *w, curve(&time, y, window, bins))).collect()
    };
    let frames = [
        (FigureSize { width: 400, height: 250 }, thin(360)),
        (FigureSize { width: 880, height: 280 }, thin(750)),
    ];
    let name = match output.unit.is_empty() {
        true => output.column.clone(),
        false => format!("{}, {}", output.column, output.unit),
    };
    let mut legend = vec![
        (Ink::Truth, "measured".to_owned()),
        (BEFORE, "foretold without the fix".to_owned()),
        (AFTER, format!("foretold with {}", foretold.effects.join(" and "))),
    ];
    if !trial.unexcited.is_empty() {
        legend.push((Ink::High, "beyond what was fitted".to_owned()));
    }
    let axes = (window, 0.06, ["time in the recording, s", &*name]);
    lines_figure(&format!("{name} over time, foretold"), axes, frames, "There is no number here.")
        .legend(legend)
}

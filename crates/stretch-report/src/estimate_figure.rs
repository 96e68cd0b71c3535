//! Estimates against the reference over time.

use std::ops::Range;

use stretch_calibrate::{Evaluation, TrialErrors};

use super::{
    canvas::Ink,
    figure::{Figure, FigureSize, lines_figure},
    live::TimePlot,
    markup::{number, with_unit},
    thin::extent,
};

/// Length of the window of [`closest_look`], in seconds.
const WINDOW_S: f64 = 8.0;

/// Draws a trial over its whole time; `names` are the names of the methods.
pub(crate) fn estimate_figure(
    evaluation: &Evaluation,
    trial: &TrialErrors,
    names: &[String],
) -> Figure {
    match extent(trial.time_s.iter().copied()) {
        Some(time) if time.end > time.start => window_figure(evaluation, trial, names, &time)
            .live(live(evaluation, trial, names, liveliest(trial).unwrap_or(time), true)),
        _ => Figure::missing("The trial is too short to draw."),
    }
}

/// Draws the seconds of a trial in which the reference moves most.
pub(crate) fn closest_look(
    evaluation: &Evaluation,
    trial: &TrialErrors,
    names: &[String],
) -> Figure {
    match liveliest(trial) {
        Some(window) => window_figure(evaluation, trial, names, &window)
            .live(live(evaluation, trial, names, window, false)),
        None => Figure::missing("The trial is too short for a closer look."),
    }
}

/// Returns the curves of a trial for the page's script. The closer look holds the curves; the figure of the whole
/// recording marks the window that is shown.
fn live(
    evaluation: &Evaluation,
    trial: &TrialErrors,
    names: &[String],
    view: Range<f64>,
    is_second: bool,
) -> Option<String> {
    let is_whole = is_second && liveliest(trial).is_some();
    let estimates = trial.estimates.iter().zip(names).enumerate();
    let lines = std::iter::once(("reference", Ink::Truth, 2.8, &trial.reference[..]))
        .chain(estimates.map(|(i, (y, name))| (name.as_str(), Ink::of(i), 1.4, &y[..])));
    let y_label = y_label(evaluation);
    TimePlot {
        link: trial.trial.clone(),
        labels: ["time, s", &y_label],
        unit: &evaluation.unit,
        height: FigureSize::WIDE.height,
        time: &trial.time_s,
        view,
        is_whole,
        lines: lines.collect(),
        keys: Vec::new(),
        moves: None,
    }
    .json()
}

fn y_label(evaluation: &Evaluation) -> String {
    let label = with_unit("reference and estimates,", &evaluation.unit);
    label.trim_end_matches(',').to_owned()
}

fn window_figure(
    evaluation: &Evaluation,
    trial: &TrialErrors,
    names: &[String],
    window: &Range<f64>,
) -> Figure {
    // the reference is a broad line below, so that a correct estimate lies inside it
    let broad = if window.end - window.start > 2.0 * WINDOW_S { 2.0 } else { 3.4 };
    let estimates = trial.estimates.iter().enumerate();
    let mut lines = vec![(Ink::Truth, broad, &trial.reference[..])];
    lines.extend(estimates.map(|(i, y)| (Ink::of(i), 1.4, &y[..])));
    let from_to = [window.start, window.end].map(|t| number(t, 3)).join(" to ");
    let description = format!(
        "Reference and estimates of {} over time, from {from_to} s; unit: {}",
        trial.trial, evaluation.unit
    );
    let y_label = y_label(evaluation);
    let axes = (window, 0.04, ["time, s", &*y_label]);
    let heights = [FigureSize::NARROW, FigureSize::WIDE].map(|frame| frame.height);
    let missing = "Reference and estimates have no values here.";
    let methods = names.iter().enumerate().map(|(i, name)| (Ink::of(i), name.clone()));
    let figure = lines_figure(&description, axes, heights, (&trial.time_s, &lines), missing);
    if figure.missing.is_some() {
        return figure;
    }
    figure.legend([(Ink::Truth, "reference".to_owned())]).legend(methods)
}

/// The window of [`WINDOW_S`] in which the reference travels farthest, in the
/// middle half of the trial: neither its start nor its end.
pub(crate) fn liveliest(trial: &TrialErrors) -> Option<Range<f64>> {
    let span = extent(trial.time_s.iter().copied())?;
    let length = span.end - span.start;
    if length <= WINDOW_S {
        return None;
    }
    let travel = |from: f64| {
        let inside = |t: f64| t >= from && t < from + WINDOW_S;
        let steps = trial.time_s.iter().zip(trial.reference.windows(2));
        let sum: f64 = steps
            .filter(|(t, _)| inside(**t))
            .map(|(_, w)| (w[1] - w[0]).abs())
            .filter(|step| step.is_finite())
            .sum();
        sum
    };
    let (first, last) = (span.start + 0.25 * length, span.start + 0.75 * length - WINDOW_S);
    let (first, last) =
        if last > first { (first, last) } else { (span.start, span.end - WINDOW_S) };
    let candidates = (0..=12).map(|k| first + (last - first) * f64::from(k) / 12.0);
    let best = candidates.max_by(|a, b| travel(*a).total_cmp(&travel(*b)))?;
    let start = best.floor().max(span.start);
    Some(start..start + WINDOW_S)
}

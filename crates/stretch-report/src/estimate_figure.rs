//! Estimates against the reference over time.

use std::ops::Range;

use stretch_calibrate::{Evaluation, TrialErrors};

use super::{
    canvas::Ink,
    figure::{Figure, FigureSize},
    markup::{labelled, number},
    thin::extent,
    time_figure::TimePlot,
};

/// Length of the window of [`closest_look`], in seconds.
const WINDOW_S: f64 = 8.0;

/// Draws a trial over its whole time; `names` are the names of the methods. If there is a closer look, its figure holds
/// the curves, and this figure marks the window that is shown.
pub(crate) fn estimate_figure(
    evaluation: &Evaluation,
    trial: &TrialErrors,
    names: &[String],
) -> Figure {
    let closer = liveliest(trial);
    match extent(trial.time_s.iter().copied()) {
        Some(time) if time.end > time.start => {
            let view = closer.clone().unwrap_or_else(|| time.clone());
            window_figure(evaluation, trial, names, (&time, view, closer.is_some()))
        }
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
        Some(window) => window_figure(evaluation, trial, names, (&window, window.clone(), false)),
        None => Figure::missing("The trial is too short for a closer look."),
    }
}

fn window_figure(
    evaluation: &Evaluation,
    trial: &TrialErrors,
    names: &[String],
    (drawn, view, is_whole): (&Range<f64>, Range<f64>, bool),
) -> Figure {
    // the reference is a broad line below, so that a correct estimate lies inside it
    let broad = if drawn.end - drawn.start > 2.0 * WINDOW_S { 2.0 } else { 3.4 };
    let estimates = trial.estimates.iter().zip(names).enumerate();
    let lines = std::iter::once(("reference", Ink::Truth, broad, &trial.reference[..]))
        .chain(estimates.map(|(i, (y, name))| (name.as_str(), Ink::of(i), 1.4, &y[..])));
    let from_to = [drawn.start, drawn.end].map(|t| number(t, 3)).join(" to ");
    let description = format!(
        "Reference and estimates of {} over time, from {from_to} s; unit: {}",
        trial.trial, evaluation.unit
    );
    let plot = TimePlot {
        link: &trial.trial,
        labels: ["time, s", &labelled("reference and estimates", &evaluation.unit)],
        unit: &evaluation.unit,
        height: FigureSize::WIDE.height,
        time: &trial.time_s,
        drawn,
        view,
        is_whole,
        lines: lines.collect(),
        keys: Vec::new(),
        moves: None,
    };
    plot.figure(&description, "Reference and estimates have no values here.")
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

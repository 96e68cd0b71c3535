//! Measured and simulated signals, before and after the correction, and residuals against level and rate.

use std::ops::Range;

use stretch_gap::{Diagnosis, Role, StageEvidence};

use super::{
    bar_figure::GAP,
    canvas::Ink,
    dots_figure::{Dots, Shared, dots_figure},
    figure::Figure,
    markup::labelled,
    subject::Subject,
    thin::{padded, quantile, sorted},
    time_figure::TimePlot,
};

/// Length of the window that is drawn, s.
const WINDOW_S: f64 = 8.0;
/// Largest number of dots of a panel.
const DOTS: usize = 900;
/// Number of samples on each side of a sample in the difference that gives its rate.
const REACH: usize = 10;

/// Colour of the re-tuned simulator.
pub(crate) const BEFORE: Ink = Ink::Second;
/// Colour of the simulator with the effect.
pub(crate) const AFTER: Ink = Ink::Third;

/// Whether there is an effect to draw in addition to the re-tuned simulator.
pub(crate) fn has_after(subject: &Subject<'_>) -> bool {
    !subject.evidence.best.effects.is_empty()
}

/// Name of the curve of the simulator with the effect.
pub(crate) fn after_name(diagnosis: &Diagnosis) -> String {
    match &diagnosis.named()[..] {
        [] => "with the best effects of the catalogue".to_owned(),
        [one] => format!("with {one}"),
        // a legend of three names is longer than a phone is wide
        _ => "with the effects that are missing".to_owned(),
    }
}

/// The test trial that is drawn.
pub(crate) struct Shown {
    /// Name of the trial.
    pub(crate) name: String,
    /// Indices of the trial's samples in the concatenation of all trials.
    pub(crate) samples: Range<usize>,
    /// Times of `samples`, s.
    pub(crate) time_s: Vec<f64>,
    /// The time window that is shown first, s.
    pub(crate) window: Range<f64>,
}

/// Eight seconds of a test trial: output and residual.
pub(crate) fn trace_figures(
    subject: &Subject<'_>,
    stage: usize,
    shown: &Shown,
) -> (Figure, Figure) {
    let Shown { samples: trial, time_s: time, window, .. } = shown;
    let (evidence, spec) = (&subject.evidence.stages[stage], &subject.simulator.stages()[stage]);
    let measured = &subject.simulator.measured(stage)[trial.clone()];
    let [retuned, with] = [
        "simulated, parameters re-tuned".to_owned(),
        format!("simulated, {}", after_name(subject.diagnosis)),
    ];
    let mut lines = vec![
        ("measured", Ink::Truth, 3.2, measured),
        (&*retuned, BEFORE, 1.5, &evidence.retuned[trial.clone()]),
    ];
    let mut left = vec![(&*retuned, BEFORE, 1.4, &evidence.residual_retuned[trial.clone()])];
    if has_after(subject) {
        lines.push((&*with, AFTER, 1.5, &evidence.after[trial.clone()]));
        left.push((&*with, AFTER, 1.4, &evidence.residual_after[trial.clone()]));
    }
    let name = labelled(&spec.channel, &spec.unit);
    let motion = subject.simulator.motion().values;
    let rates = rates(subject, motion);
    let keys = [("level", motion), ("rate", &rates[..])]
        .map(|(key, values)| (key, values.get(trial.clone()).unwrap_or_default()));
    let figure = |name: &str, plot: TimePlot<'_>| {
        let description = format!("{name} over time, eight seconds of a test trial");
        plot.figure(&description, "There are no values to draw here.")
    };
    let plot = TimePlot {
        link: GAP,
        labels: [TIME, &name],
        unit: &spec.unit,
        height: 280,
        time,
        drawn: window,
        view: window.clone(),
        is_whole: false,
        lines,
        keys: keys.to_vec(),
        moves: Some("out"),
    };
    let left = TimePlot {
        labels: [TIME, LEFT],
        unit: "\u{d7} the noise",
        height: 190,
        view: window.clone(),
        lines: left,
        keys: Vec::new(),
        moves: Some("left"),
        ..plot
    };
    (figure(&name, plot), figure(LEFT, left))
}

/// The test trial with the largest gap, and the eight seconds of that trial with the largest error of the re-tuned
/// simulator.
pub(crate) fn shown(subject: &Subject<'_>, stage: usize) -> Option<Shown> {
    let segment = worst_segment(subject, stage)?;
    let dt_s = subject.simulator.dt_s();
    let range = segment.from..segment.to;
    let trials = subject.simulator.trials();
    let begin: usize = trials[..segment.trial].iter().map(|t| t.samples).sum();
    let time: Vec<f64> = range.clone().map(|i| (i - begin) as f64 * dt_s).collect();
    let residual = &subject.evidence.stages[stage].residual_retuned[range.clone()];
    let look = worst_window(residual, dt_s)?;
    let (start, end) = (time[look.start], time[look.end - 1]);
    let name = trials[segment.trial].name.clone();
    (end > start).then_some(Shown { name, samples: range, time_s: time, window: start..end })
}

/// The eight seconds with the largest error.
pub(crate) fn worst_window(error: &[f64], dt_s: f64) -> Option<Range<usize>> {
    let length = ((WINDOW_S / dt_s) as usize).max(1).min(error.len());
    let step = (length / 16).max(1);
    let sum = |from: usize| error[from..from + length].iter().map(|r| r * r).sum::<f64>();
    let starts = (0..=(error.len() - length) / step).map(|k| k * step);
    let from = starts.max_by(|a, b| sum(*a).total_cmp(&sum(*b)))?;
    Some(from..from + length)
}

fn worst_segment<'a>(subject: &'a Subject<'_>, stage: usize) -> Option<&'a stretch_gap::Segment> {
    let residual = &subject.evidence.stages[stage].residual_retuned;
    let gap = |s: &stretch_gap::Segment| {
        let part = &residual[s.from..s.to];
        part.iter().map(|r| r * r).sum::<f64>() / part.len().max(1) as f64
    };
    let tests = subject.evidence.roles.of_role(Role::Test).filter(|s| s.to - s.from > 20);
    tests.max_by(|a, b| gap(a).total_cmp(&gap(b)))
}

const TIME: &str = "time in the trial, s";
/// Label of the axis of residuals.
const LEFT: &str = "measured \u{2212} simulated, multiples of the noise";

/// The quantity against which the residual is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Against {
    /// The level of the motion.
    Level,
    /// The rate of the motion.
    Rate,
}

/// The residual of one stage over all trials, before and after the correction, one panel each.
pub(crate) fn left_figure(subject: &Subject<'_>, stage: usize, against: Against) -> Figure {
    let motion = subject.simulator.motion();
    let evidence = &subject.evidence.stages[stage];
    let (by, place, unit) = match against {
        Against::Level => ("level", motion.values.to_vec(), motion.unit.to_owned()),
        Against::Rate => {
            let unit = if motion.unit.is_empty() { "1" } else { motion.unit };
            ("rate", rates(subject, motion.values), format!("{unit}/s"))
        }
    };
    let x_label = format!("{by}, {unit}");
    let panels = panels(subject, evidence, &place);
    let sizes = sorted(panels.iter().flat_map(|p| &p.points).map(|(_, r)| r.abs()));
    let places = sorted(place.iter().copied());
    let most = 1.05 * quantile(&sizes, 0.998).max(3.0);
    let x = match against {
        Against::Level => padded(&(quantile(&places, 0.0)..quantile(&places, 1.0)), 0.02),
        Against::Rate => quantile(&places, 0.003)..quantile(&places, 0.997),
    };
    if !(most.is_finite() && x.end > x.start) {
        return Figure::missing("There is no motion to draw against.");
    }
    let description =
        format!("Measured minus simulated in multiples of the noise against {x_label}");
    let against = Shared {
        x,
        x_label: &x_label,
        names: [by, &unit, "\u{d7} the noise"],
        most,
        dots: DOTS,
        brush: (GAP, Some(by)),
    };
    dots_figure(&description, &against, &panels)
}

fn panels(subject: &Subject<'_>, evidence: &StageEvidence, place: &[f64]) -> Vec<Dots> {
    let panel = |ink, name: &str, residual: &[f64]| Dots {
        ink,
        name: format!("left {name}"),
        y_label: format!("{name}, multiples of the noise"),
        points: place.iter().copied().zip(residual.iter().copied()).collect(),
    };
    let mut panels = vec![panel(BEFORE, "before", &evidence.residual_retuned)];
    if has_after(subject) {
        panels.push(panel(AFTER, "after", &evidence.residual_after));
    }
    panels
}

/// Slopes over twenty-one samples, within each trial; NaN at the ends.
fn rates(subject: &Subject<'_>, values: &[f64]) -> Vec<f64> {
    let dt_s = subject.simulator.dt_s();
    let mut rates = vec![f64::NAN; values.len()];
    let mut from = 0;
    for trial in subject.simulator.trials() {
        let to = (from + trial.samples).min(values.len());
        for i in from + REACH..to.saturating_sub(REACH) {
            let slope: f64 = (1..=REACH).map(|k| k as f64 * (values[i + k] - values[i - k])).sum();
            let squares: f64 = (1..=REACH).map(|k| 2.0 * (k * k) as f64).sum();
            rates[i] = slope / squares / dt_s;
        }
        from = to;
    }
    rates
}

//! Measured against simulated, before and after; what is left against level and rate.

use std::ops::Range;

use plotters::prelude::*;
use stretch_gap::{Diagnosis, Role, StageEvidence};

use super::{
    bar_figure::GAP,
    canvas::Ink,
    figure::{Area, Axes, Figure, Frame, dot, plot, px, stroke},
    live::{Panel, TimePlot, scatter_json},
    subject::Subject,
    thin::{binned, curve, extent, padded, quantile, sample, sorted},
};

/// Length of the window that is drawn, s.
const WINDOW_S: f64 = 8.0;
/// Parts of the axis with a median of their own, and dots in all.
const SLOTS: usize = 24;
const DOTS: usize = 900;
/// Samples on each side of a rate.
const REACH: usize = 10;

/// Colours of the measurement, the re-tuned simulator, and the one with the effect.
pub(crate) const BEFORE: Ink = Ink::Second;
/// With the effect.
pub(crate) const AFTER: Ink = Ink::Third;

/// Its ink, its width in pixels, and its pieces.
type Line = (Ink, f64, Vec<Vec<(f64, f64)>>);

/// The stage with the largest gap.
pub(crate) fn worst(diagnosis: &Diagnosis) -> usize {
    let stages = diagnosis.location.stages.iter().enumerate();
    stages.max_by(|a, b| a.1.share.total_cmp(&b.1.share)).map_or(0, |(i, _)| i)
}

/// Whether there is an effect to draw beside the re-tuned simulator.
pub(crate) fn has_after(subject: &Subject<'_>) -> bool {
    !subject.evidence.best.effects.is_empty()
}

/// What the curves are called.
pub(crate) fn after_name(diagnosis: &Diagnosis) -> String {
    if diagnosis.named.is_empty() {
        "with the best effects of the catalogue".to_owned()
    } else {
        format!("with {}", diagnosis.named.join(" and "))
    }
}

/// The eight seconds of a test trial in which the re-tuned simulator is farthest off: output, and what is left.
pub(crate) fn trace_figures(subject: &Subject<'_>, stage: usize) -> (Figure, Figure, String) {
    let Some((trial, time, window)) = window(subject, stage) else {
        let missing = || Figure::missing("There is no test trial to draw.");
        return (missing(), missing(), String::new());
    };
    let (evidence, spec) = (&subject.evidence.stages[stage], &subject.simulator.stages()[stage]);
    let span = trial.clone();
    let measured = &subject.simulator.measured(stage)[trial.clone()];
    let after = has_after(subject);
    let mut lines = vec![
        (Ink::Truth, 3.2, measured.to_vec()),
        (BEFORE, 1.5, evidence.retuned[trial.clone()].to_vec()),
    ];
    let mut left = vec![(BEFORE, 1.4, evidence.residual_retuned[trial.clone()].to_vec())];
    let mut legend = vec![
        (Ink::Truth, "measured".to_owned()),
        (BEFORE, "simulated, parameters re-tuned".to_owned()),
    ];
    if after {
        lines.push((AFTER, 1.5, evidence.after[trial.clone()].to_vec()));
        left.push((AFTER, 1.4, evidence.residual_after[trial].to_vec()));
        legend.push((AFTER, format!("simulated, {}", after_name(subject.diagnosis))));
    }
    let name = if spec.unit.is_empty() {
        spec.channel.clone()
    } else {
        format!("{}, {}", spec.channel, spec.unit)
    };
    let motion = subject.simulator.motion().values;
    let keys = [("level", motion.to_vec()), ("rate", rates(subject, motion))]
        .map(|(key, values)| (key, values.get(span.clone()).unwrap_or_default().to_vec()));
    let names: Vec<&str> = legend.iter().map(|(_, name)| name.as_str()).collect();
    let live = |lines: &[(Ink, f64, Vec<f64>)], names: &[&str], is_first: bool| {
        let lines = lines.iter().zip(names).map(|((ink, w, y), name)| (*name, *ink, *w, &y[..]));
        TimePlot {
            link: GAP.to_owned(),
            labels: ["time in the trial, s", if is_first { &name } else { LEFT }],
            unit: if is_first { &spec.unit } else { "\u{d7} the noise" },
            height: if is_first { 280 } else { 190 },
            time: &time,
            view: window.clone(),
            is_whole: false,
            lines: lines.collect(),
            keys: keys.iter().filter(|_| is_first).map(|(key, y)| (*key, &y[..])).collect(),
        }
        .json()
    };
    let (told, told_left) = (live(&lines, &names, true), live(&left, &names[1..], false));
    let left_legend = legend[1..].to_vec();
    let top = lines_figure(&time, &lines, &window, &name, 280).legend(legend).live(told);
    let below = lines_figure(&time, &left, &window, LEFT, 190).legend(left_legend).live(told_left);
    let trial_name = trial_name(subject, stage);
    (top, below, trial_name)
}

fn lines_figure(
    time: &[f64],
    lines: &[(Ink, f64, Vec<f64>)],
    window: &Range<f64>,
    y_label: &str,
    height: u32,
) -> Figure {
    let thin = |bins: usize| -> Vec<Line> {
        lines.iter().map(|(ink, w, y)| (*ink, *w, curve(time, y, window, bins))).collect()
    };
    let wide = thin(750);
    let points = wide.iter().flat_map(|(_, _, pieces)| pieces.iter().flatten()).map(|p| p.1);
    let Some(y) = extent(points) else {
        return Figure::missing("There is no number here.");
    };
    let axes = Axes {
        x: window.clone(),
        y: padded(&y, 0.06),
        x_label: "time in the trial, s".to_owned(),
        y_label: y_label.to_owned(),
        is_log: false,
    };
    let draw = |lines: Vec<Line>| {
        let axes = &axes;
        move |area: &Area<'_>| {
            plot(area, axes, |chart| {
                for (ink, width, pieces) in lines {
                    for piece in pieces {
                        chart.draw_series(LineSeries::new(piece, stroke(ink.color(), width)))?;
                    }
                }
                Ok(())
            })
        }
    };
    Figure::new(&format!("{y_label} over time, eight seconds of a test trial"))
        .draw(Frame { width: 400, height: height.min(250) }, draw(thin(360)))
        .draw(Frame { width: 880, height }, draw(wide))
}

/// Samples of the test trial with the largest gap, its times, and the window.
fn window(subject: &Subject<'_>, stage: usize) -> Option<(Range<usize>, Vec<f64>, Range<f64>)> {
    let segment = worst_segment(subject, stage)?;
    let dt_s = subject.simulator.dt_s();
    let range = segment.from..segment.to;
    let begin = begin_of(subject, segment.trial);
    let time: Vec<f64> = range.clone().map(|i| (i - begin) as f64 * dt_s).collect();
    let residual = &subject.evidence.stages[stage].residual_retuned[range.clone()];
    let length = ((WINDOW_S / dt_s) as usize).min(residual.len());
    let step = (length / 16).max(1);
    let sum = |from: usize| residual[from..from + length].iter().map(|r| r * r).sum::<f64>();
    let starts = (0..=(residual.len() - length) / step).map(|k| k * step);
    let from = starts.max_by(|a, b| sum(*a).total_cmp(&sum(*b)))?;
    let (start, end) = (time[from], time[(from + length).min(time.len()) - 1]);
    (end > start).then_some((range, time, start..end))
}

fn worst_segment<'a>(subject: &'a Subject<'_>, stage: usize) -> Option<&'a stretch_gap::Segment> {
    let residual = &subject.evidence.stages[stage].residual_retuned;
    let gap = |s: &stretch_gap::Segment| {
        let part = &residual[s.from..s.to];
        part.iter().map(|r| r * r).sum::<f64>() / part.len().max(1) as f64
    };
    let tests = subject.evidence.frame.of_role(Role::Test).filter(|s| s.to - s.from > 20);
    tests.max_by(|a, b| gap(a).total_cmp(&gap(b)))
}

fn trial_name(subject: &Subject<'_>, stage: usize) -> String {
    let segment = worst_segment(subject, stage);
    segment.map_or_else(String::new, |s| subject.simulator.trials()[s.trial].name.clone())
}

fn begin_of(subject: &Subject<'_>, trial: usize) -> usize {
    subject.simulator.trials()[..trial].iter().map(|t| t.samples).sum()
}

/// What is left, above its axis.
const LEFT: &str = "measured \u{2212} simulated, multiples of the noise";

/// What the residual is drawn against.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Against {
    /// The level of the motion.
    Level,
    /// Its rate.
    Rate,
}

/// What is left of one stage over all trials, before and after, one panel each.
pub(crate) fn left_figure(subject: &Subject<'_>, stage: usize, against: Against) -> Figure {
    let motion = subject.simulator.motion();
    let evidence = &subject.evidence.stages[stage];
    let place = match against {
        Against::Level => motion.values.to_vec(),
        Against::Rate => rates(subject, motion.values),
    };
    let unit = match against {
        Against::Level => motion.unit.to_owned(),
        Against::Rate => format!("{}/s", if motion.unit.is_empty() { "1" } else { motion.unit }),
    };
    let x_label = match against {
        Against::Level => format!("level, {unit}"),
        Against::Rate => format!("rate, {unit}"),
    };
    let panels = panels(subject, evidence, &place);
    let sizes = sorted(panels.iter().flat_map(|p| &p.2).map(|(_, r)| r.abs()));
    let places = sorted(place.iter().copied());
    let most = 1.05 * quantile(&sizes, 0.998).max(3.0);
    let x = match against {
        Against::Level => padded(&(quantile(&places, 0.0)..quantile(&places, 1.0)), 0.02),
        Against::Rate => quantile(&places, 0.003)..quantile(&places, 0.997),
    };
    if !(most.is_finite() && x.end > x.start) {
        return Figure::missing("There is no motion to draw against.");
    }
    let height = 165;
    let frame = Frame { width: 400, height: height * panels.len() as u32 + 20 };
    let description =
        format!("Measured minus simulated in multiples of the noise against {x_label}");
    let told: Vec<Panel> = (0..panels.len() as u32)
        .zip(&panels)
        .map(|(i, (_, name, _))| {
            let is_last = i as usize + 1 == panels.len();
            let ends = [i * height, (i + 1) * height + if is_last { 20 } else { 0 }];
            Panel::new(format!("left {name}"), ends, !is_last, [-most, most])
        })
        .collect();
    let by = match against {
        Against::Level => "level",
        Against::Rate => "rate",
    };
    let live = scatter_json(GAP, Some(by), &x, [by, &unit, "\u{d7} the noise"], &told);
    Figure::new(&description)
        .draw(frame, |area| {
            let mut rest = area.clone();
            for (i, (ink, name, points)) in panels.iter().enumerate() {
                let last = i + 1 == panels.len();
                let tall = if last { height + 20 } else { height };
                let (here, below) = rest.split_vertically(px(f64::from(tall)));
                rest = below;
                let axes = Axes {
                    x: x.clone(),
                    y: -most..most,
                    x_label: if last { x_label.clone() } else { String::new() },
                    y_label: format!("{name}, multiples of the noise"),
                    is_log: false,
                };
                let bins = binned(points, &x, SLOTS);
                plot(&here, &axes, |chart| {
                    let zero = [(x.start, 0.0), (x.end, 0.0)];
                    chart.draw_series(LineSeries::new(zero, stroke(Ink::Axis.color(), 1.0)))?;
                    let inside: Vec<_> = points
                        .iter()
                        .copied()
                        .filter(|(a, r)| x.contains(a) && r.abs() < most)
                        .collect();
                    let dots = spread_over(&inside, &x).into_iter();
                    chart.draw_series(dots.map(|at| Circle::new(at, px(0.9), dot(*ink, 0.5))))?;
                    let cut = |r: f64| r.clamp(-most, most);
                    if bins.len() > 1 {
                        let rim = bins.iter().map(|b| (b.x, cut(b.low)));
                        let back = bins.iter().rev().map(|b| (b.x, cut(b.high)));
                        let band: Vec<_> = rim.chain(back).collect();
                        chart.draw_series([Polygon::new(band, ink.faint(0.18))])?;
                        let median = bins.iter().map(|b| (b.x, cut(b.median)));
                        chart.draw_series(LineSeries::new(
                            median,
                            stroke(Ink::Truth.color(), 2.2),
                        ))?;
                    }
                    Ok(())
                })?;
            }
            Ok(())
        })
        .live(live)
}

/// Colour, name, and points of each panel.
type Cloud = (Ink, &'static str, Vec<(f64, f64)>);

fn panels(subject: &Subject<'_>, evidence: &StageEvidence, place: &[f64]) -> Vec<Cloud> {
    let join = |residual: &[f64]| place.iter().copied().zip(residual.iter().copied()).collect();
    let mut panels = vec![(BEFORE, "before", join(&evidence.residual_retuned))];
    if has_after(subject) {
        panels.push((AFTER, "after", join(&evidence.residual_after)));
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

/// Dots from every part of the axis: most samples of a session are at rest, in one place.
fn spread_over(points: &[(f64, f64)], span: &Range<f64>) -> Vec<(f64, f64)> {
    let width = (span.end - span.start) / SLOTS as f64;
    let mut slots = vec![Vec::new(); SLOTS];
    for &point in points {
        let index = ((point.0 - span.start) / width) as usize;
        slots[index.min(SLOTS - 1)].push(point);
    }
    slots.iter().flat_map(|slot| sample(slot, DOTS / SLOTS)).collect()
}

//! Where the errors are: against rate, against the reference, and how often.

use std::ops::Range;

use plotters::prelude::*;
use stretch_calibrate::Evaluation;

use super::{
    canvas::Ink,
    figure::{Axes, Figure, Frame, dot, plot, px, stroke},
    live::{Panel, scatter_json},
    markup::{number, with_unit},
    thin::{binned, extent, padded, quantile, sample, sorted},
};

/// Dots of one method at most.
const DOTS: usize = 720;

/// Parts of the axis that have dots and a median of their own.
const SLOTS: usize = 24;

/// Half the span of the difference that gives the reference's rate, in samples.
const REACH: usize = 5;

/// What errors are drawn against.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Against {
    /// The rate of the reference, by a central difference over eleven samples.
    Rate,
    /// The reference itself.
    Reference,
}

/// Errors (estimate minus reference) of all trials against `against`, one panel a method.
pub(crate) fn error_figure(evaluation: &Evaluation, names: &[String], against: Against) -> Figure {
    let methods = points(evaluation, names.len(), against);
    let errors = sorted(methods.iter().flatten().map(|(_, e)| e.abs()));
    let places = sorted(methods.iter().flatten().map(|(x, _)| *x));
    if errors.is_empty() {
        return Figure::missing("There is no error to draw: no sample has both values.");
    }
    let most = 1.05 * quantile(&errors, 0.995).max(f64::MIN_POSITIVE);
    let x = match against {
        Against::Rate => quantile(&places, 0.005)..quantile(&places, 0.995),
        Against::Reference => padded(&(quantile(&places, 0.0)..quantile(&places, 1.0)), 0.02),
    };
    let unit = &evaluation.unit;
    let x_label = match against {
        Against::Rate => per_second(unit),
        Against::Reference => joined("reference", unit),
    };
    let description = format!(
        "Error of {} against {x_label}: dots are samples, the line their median, the band 80 %",
        names.join(", ")
    );
    let panel = 165;
    let told: Vec<Panel> = (0..names.len() as u32)
        .zip(names)
        .map(|(i, name)| {
            let is_last = i as usize + 1 == names.len();
            let ends = [i * panel, (i + 1) * panel + if is_last { 20 } else { 0 }];
            Panel::new(format!("error of {name}"), ends, !is_last, [-most, most])
        })
        .collect();
    let (x_name, x_unit) = x_label.rsplit_once(", ").unwrap_or((&x_label, ""));
    let live = scatter_json("", None, &x, [x_name, x_unit, unit], &told);
    let frame = Frame { width: 400, height: panel * names.len() as u32 + 20 };
    Figure::new(&description)
        .draw(frame, |area| {
            let mut rest = area.clone();
            for (i, (name, points)) in names.iter().zip(&methods).enumerate() {
                let last = i + 1 == names.len();
                let height = if last { panel + 20 } else { panel };
                let (here, below) = rest.split_vertically(px(f64::from(height)));
                rest = below;
                let axes = Axes {
                    x: x.clone(),
                    y: -most..most,
                    x_label: if last { x_label.clone() } else { String::new() },
                    y_label: joined(&format!("{name}: error"), unit),
                    is_log: false,
                };
                let bins = binned(points, &x, SLOTS);
                let inside: Vec<_> = points
                    .iter()
                    .copied()
                    .filter(|(a, e)| x.contains(a) && e.abs() < most)
                    .collect();
                plot(&here, &axes, |chart| {
                    let ink = Ink::of(i);
                    let zero = [(x.start, 0.0), (x.end, 0.0)];
                    chart.draw_series(LineSeries::new(zero, stroke(Ink::Axis.color(), 1.0)))?;
                    let dots = spread_over(&inside, &x).into_iter();
                    chart.draw_series(dots.map(|at| Circle::new(at, px(0.9), dot(ink, 0.55))))?;
                    let cut = |e: f64| e.clamp(-most, most);
                    let rim = bins.iter().map(|b| (b.x, cut(b.low)));
                    let back = bins.iter().rev().map(|b| (b.x, cut(b.high)));
                    let band: Vec<_> = rim.chain(back).collect();
                    if bins.len() > 1 {
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

/// Dots from every part of the axis: most samples of a log are at rest, in one place.
fn spread_over(points: &[(f64, f64)], span: &Range<f64>) -> Vec<(f64, f64)> {
    let width = (span.end - span.start) / SLOTS as f64;
    let mut slots = vec![Vec::new(); SLOTS];
    for &point in points {
        let index = ((point.0 - span.start) / width) as usize;
        slots[index.min(SLOTS - 1)].push(point);
    }
    slots.iter().flat_map(|slot| sample(slot, DOTS / SLOTS)).collect()
}

/// How often each error occurs, one outline a method.
pub(crate) fn residual_figure(evaluation: &Evaluation, names: &[String]) -> Figure {
    let methods = points(evaluation, names.len(), Against::Reference);
    let size = sorted(methods.iter().flatten().map(|(_, e)| e.abs()));
    let most = quantile(&size, 0.995);
    if !(most > 0.0 && most.is_finite()) {
        return Figure::missing("There is no spread of errors to draw.");
    }
    let bins = 48;
    let width = 2.0 * most / bins as f64;
    let share = |points: &[(f64, f64)]| {
        let mut counts = vec![0.0; bins];
        for (_, e) in points.iter().filter(|(_, e)| e.abs() < most) {
            counts[(((e + most) / width) as usize).min(bins - 1)] += 100.0 / points.len() as f64;
        }
        counts
    };
    let shares: Vec<Vec<f64>> = methods.iter().map(|points| share(points)).collect();
    let top = extent(shares.iter().flatten().copied()).map_or(1.0, |span| span.end.max(1e-9));
    let axes = Axes {
        x: -most..most,
        y: 0.0..1.06 * top,
        x_label: joined("error", &evaluation.unit),
        y_label: format!("% of samples in {}", with_unit(&number(width, 2), &evaluation.unit)),
        is_log: false,
    };
    let description =
        format!("Histogram of the errors of {}; unit: {}", names.join(", "), evaluation.unit);
    let steps = |counts: &[f64]| -> Vec<(f64, f64)> {
        let edge = |i: usize| -most + i as f64 * width;
        let bars = counts.iter().enumerate();
        bars.flat_map(|(i, &c)| [(edge(i), c), (edge(i + 1), c)]).collect()
    };
    let draw = |area: &super::figure::Area<'_>| {
        plot(area, &axes, |chart| {
            for (i, counts) in shares.iter().enumerate() {
                let (ink, outline) = (Ink::of(i), steps(counts));
                chart.draw_series(AreaSeries::new(outline.clone(), 0.0, ink.faint(0.14)))?;
                chart.draw_series(LineSeries::new(outline, stroke(ink.color(), 1.8)))?;
            }
            Ok(())
        })
    };
    let legend = names.iter().enumerate().map(|(i, name)| (Ink::of(i), name.clone()));
    Figure::new(&description).draw(Frame::NARROW, draw).draw(Frame::WIDE, draw).legend(legend)
}

/// Places and errors of each method over all trials.
fn points(evaluation: &Evaluation, methods: usize, against: Against) -> Vec<Vec<(f64, f64)>> {
    let mut all = vec![Vec::new(); methods];
    for trial in &evaluation.trials {
        let places = match against {
            Against::Reference => trial.reference.clone(),
            Against::Rate => rates(&trial.time_s, &trial.reference),
        };
        for (points, estimates) in all.iter_mut().zip(&trial.estimates) {
            let pairs = places.iter().zip(&trial.reference).zip(estimates);
            points.extend(
                pairs
                    .map(|((&x, &truth), &estimate)| (x, estimate - truth))
                    .filter(|(x, e)| x.is_finite() && e.is_finite()),
            );
        }
    }
    all
}

/// Central differences of the reference over eleven samples; NaN at the ends.
fn rates(time_s: &[f64], values: &[f64]) -> Vec<f64> {
    let mut rates = vec![f64::NAN; values.len()];
    let spans = time_s.windows(2 * REACH + 1).zip(values.windows(2 * REACH + 1));
    for (rate, (t, y)) in rates.iter_mut().skip(REACH).zip(spans) {
        *rate = (y[2 * REACH] - y[0]) / (t[2 * REACH] - t[0]);
    }
    rates
}

fn joined(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name}, {unit}") }
}

fn per_second(unit: &str) -> String {
    let unit = if unit.is_empty() { "1" } else { unit };
    format!("rate of the reference, {unit}/s")
}

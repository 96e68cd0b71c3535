//! Errors against rate and reference, and the histogram of errors.

use plotters::prelude::*;
use stretch_calibrate::Evaluation;

use super::{
    canvas::Ink,
    dots_figure::{Dots, Shared, dots_figure},
    figure::{Axes, Figure, FigureSize, plot, stroke},
    markup::{labelled, number, with_unit},
    thin::{extent, padded, quantile, sorted},
};

/// Largest number of dots of one method.
const DOTS: usize = 720;

/// Half the span of the difference that gives the reference's rate, in samples.
const REACH: usize = 5;

/// The quantity against which errors are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Against {
    /// The rate of the reference, by a central difference over eleven samples.
    Rate,
    /// The reference itself.
    Reference,
}

/// Errors (estimate minus reference) of all trials against `against`, one panel for each method.
pub(crate) fn error_figure(evaluation: &Evaluation, names: &[String], against: Against) -> Figure {
    let methods = points(evaluation, names.len(), against);
    let errors = sorted(methods.iter().flatten().map(|(_, e)| e.abs()));
    let places = sorted(methods.iter().flatten().map(|(x, _)| *x));
    if errors.is_empty() {
        return Figure::missing("There is no error to draw: no sample has both values.");
    }
    let most = 1.05 * quantile(&errors, 0.995).max(f64::MIN_POSITIVE);
    let unit = &evaluation.unit;
    let between = |from, to| quantile(&places, from)..quantile(&places, to);
    let (x, x_label) = match against {
        Against::Rate => (between(0.005, 0.995), per_second(unit)),
        Against::Reference => (padded(&between(0.0, 1.0), 0.02), labelled("reference", unit)),
    };
    let description = format!(
        "Error of {} against {x_label}: dots are samples, the line their median, the band 80 %",
        names.join(", ")
    );
    let (x_name, x_unit) = x_label.rsplit_once(", ").unwrap_or((&x_label, ""));
    let against = Shared {
        x,
        x_label: &x_label,
        names: [x_name, x_unit, unit],
        most,
        dots: DOTS,
        brush: ("", None),
    };
    let panels: Vec<Dots> = (0..)
        .zip(names)
        .zip(methods)
        .map(|((i, name), points)| Dots {
            ink: Ink::of(i),
            name: format!("error of {name}"),
            y_label: labelled(&format!("{name}: error"), unit),
            points,
        })
        .collect();
    dots_figure(&description, &against, &panels)
}

/// Histogram of the errors, one outline for each method.
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
    let x_label = labelled("error", &evaluation.unit);
    let y_label = format!("% of samples in {}", with_unit(&number(width, 2), &evaluation.unit));
    let axes = Axes::new(-most..most, 0.0..1.06 * top, [&x_label, &y_label]);
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
    Figure::new(&description)
        .draw(FigureSize::NARROW, draw)
        .draw(FigureSize::WIDE, draw)
        .legend(legend)
}

/// Returns, for each method, the abscissa and the error of each sample of all trials.
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
pub(crate) fn rates(time_s: &[f64], values: &[f64]) -> Vec<f64> {
    let mut rates = vec![f64::NAN; values.len()];
    let spans = time_s.windows(2 * REACH + 1).zip(values.windows(2 * REACH + 1));
    for (rate, (t, y)) in rates.iter_mut().skip(REACH).zip(spans) {
        *rate = (y[2 * REACH] - y[0]) / (t[2 * REACH] - t[0]);
    }
    rates
}

fn per_second(unit: &str) -> String {
    let unit = if unit.is_empty() { "1" } else { unit };
    format!("rate of the reference, {unit}/s")
}

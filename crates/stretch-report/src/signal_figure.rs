//! The measured signal against the reference, which shows the hysteresis of the sensor, with a calibration over it.

use plotters::prelude::*;
use stretch_calibrate::{Evaluation, TrialErrors};

use super::{
    canvas::Ink,
    error_figure::rates,
    estimate_figure::liveliest,
    figure::{Axes, Figure, FigureSize, dot, plot, px, stroke},
    markup::labelled,
    thin::{extent, padded, quantile, sample, sample_in_order, sorted},
};

/// Largest number of dots of each direction.
const DOTS: usize = 700;

/// Largest number of points of the line of estimates.
const POINTS: usize = 600;

/// Samples slower than this share of the fastest rate are at rest: they have no direction.
pub(crate) const AT_REST: f64 = 0.05;

/// Draws the reference over the signal for the moving samples of all trials, coloured by direction. Adds the estimates
/// of one method for the seconds with the most motion of the trial `shown`.
pub(crate) fn signal_figure(
    evaluation: &Evaluation,
    shown: Option<&TrialErrors>,
    (method, name): (usize, &str),
    signal: &str,
) -> Figure {
    let [rising, falling] = directions(&evaluation.trials);
    let estimates = shown.map_or(Vec::new(), |trial| line(trial, method));
    let all = || rising.iter().chain(&falling).chain(estimates.iter().flatten());
    let (Some(x), Some(y)) = (extent(all().map(|p| p.0)), extent(all().map(|p| p.1))) else {
        return Figure::missing("No recording moves, so there is no loop to draw.");
    };
    let label = labelled("reference", &evaluation.unit);
    let axes = Axes::new(padded(&x, 0.02), padded(&y, 0.05), [signal, &label]);
    let legend = [
        (Ink::Low, "reference rises".to_owned()),
        (Ink::High, "reference falls".to_owned()),
        (Ink::Text, format!("estimate of {name}")),
    ];
    let description =
        format!("Reference against {signal}, by direction, with the estimates of {name}");
    let draw = |area: &super::figure::Area<'_>| {
        plot(area, &axes, |chart| {
            // The dots come last, because the line would cover a narrow loop.
            for run in &estimates {
                let points = sample_in_order(run, POINTS);
                chart.draw_series(LineSeries::new(points, stroke(Ink::Text.color(), 1.0)))?;
            }
            for (points, ink) in [(&rising, Ink::Low), (&falling, Ink::High)] {
                let dots = sample(points, DOTS).into_iter();
                chart.draw_series(dots.map(|at| Circle::new(at, px(1.5), dot(ink, 0.8))))?;
            }
            Ok(())
        })
    };
    Figure::new(&description)
        .draw(FigureSize::NARROW, draw)
        .draw(FigureSize::WIDE, draw)
        .legend(legend)
}

/// Signal and reference of the samples in motion, rising and falling.
fn directions(trials: &[TrialErrors]) -> [Vec<(f64, f64)>; 2] {
    let [mut rising, mut falling] = [Vec::new(), Vec::new()];
    let rated: Vec<Vec<f64>> = trials.iter().map(|t| rates(&t.time_s, &t.reference)).collect();
    let paces = sorted(rated.iter().flatten().map(|rate| rate.abs()));
    let at_rest = AT_REST * quantile(&paces, 0.99);
    for (trial, rates) in trials.iter().zip(rated) {
        for ((&x, &y), rate) in trial.signal.iter().zip(&trial.reference).zip(rates) {
            if x.is_finite() && y.is_finite() && rate.abs() > at_rest {
                if rate > 0.0 { &mut rising } else { &mut falling }.push((x, y));
            }
        }
    }
    [rising, falling]
}

/// Returns the estimates of a method over the signal, as unbroken pieces, in the seconds of a trial with the most
/// motion or in the whole of a short trial.
fn line(trial: &TrialErrors, method: usize) -> Vec<Vec<(f64, f64)>> {
    let seconds = liveliest(trial);
    let is_shown = |t: &f64| seconds.as_ref().is_none_or(|seconds| seconds.contains(t));
    let estimates = trial.estimates.get(method).map_or(&[][..], Vec::as_slice);
    let samples = trial.time_s.iter().zip(&trial.signal).zip(estimates);
    let shown: Vec<(f64, f64)> =
        samples.filter(|((t, _), _)| is_shown(t)).map(|((_, x), y)| (*x, *y)).collect();
    let pieces = shown.split(|(x, y)| !(x.is_finite() && y.is_finite()));
    pieces.filter(|piece| piece.len() > 1).map(<[_]>::to_vec).collect()
}

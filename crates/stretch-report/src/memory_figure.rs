//! The memory of a calibration: its step response, and its loops on triangular signals.

use plotters::prelude::*;
use stretch_calibrate::{Calibrated, LiveReceptor};
use stretch_core::{Calibration, Seconds};

use super::{
    canvas::Ink,
    figure::{Axes, Figure, FigureSize, plot, stroke},
    markup::labelled,
    thin::{extent, padded},
    time_figure::TimePlot,
};

/// Seconds of rest before a step, and at each of its two levels.
const HOLD_S: f64 = 5.0;
/// Periods of the triangles, slow to fast, s.
const PERIODS_S: [f64; 3] = [16.0, 4.0, 1.0];
const INKS: [Ink; 3] = [Ink::Low, Ink::Middle, Ink::High];

/// A signal on its grid of time, and the calibration's estimates; NaN where there is no estimate.
struct Answer {
    time_s: Vec<f64>,
    signal: Vec<f64>,
    estimate: Vec<f64>,
}

impl Answer {
    fn new(calibration: &Calibration, seconds: f64, share: impl Fn(f64) -> f64) -> Option<Self> {
        let mut live = LiveReceptor::new(calibration).ok()?;
        let (low, span) =
            (calibration.spec().signal_range.min(), calibration.spec().signal_range.span());
        let dt_s = calibration.spec().sample_rate_hz.period_s();
        let count = (seconds / dt_s).clamp(2.0, 200_000.0) as usize;
        let mut answer = Self { time_s: Vec::new(), signal: Vec::new(), estimate: Vec::new() };
        for n in 0..count {
            let t = n as f64 * dt_s;
            // the middle half of the calibrated range
            let signal = low + span * (0.25 + 0.5 * share(t));
            let reading = live.step(Seconds(t), signal);
            answer.estimate.push(reading.map_or(f64::NAN, |reading| reading.estimate));
            answer.time_s.push(t);
            answer.signal.push(signal);
        }
        answer.estimate.iter().any(|y| y.is_finite()).then_some(answer)
    }
}

/// The estimate after a step of the signal up and a step down.
pub(crate) fn step_figure(name: &str, calibrated: &Calibrated, unit: &str) -> Figure {
    let calibration = &calibrated.calibration;
    let up = |t: f64| if (HOLD_S..2.0 * HOLD_S).contains(&t) { 1.0 } else { 0.0 };
    let Some(answer) = Answer::new(calibration, 3.0 * HOLD_S, up) else {
        return Figure::missing(
            "This calibration needs more inputs than the signal, so it cannot be shown for the signal alone.",
        );
    };
    let drawn = 0.0..3.0 * HOLD_S;
    let plot = TimePlot {
        link: &format!("step of {name}"),
        labels: ["time, s", &labelled("estimate", unit)],
        unit,
        height: FigureSize::NARROW.height,
        time: &answer.time_s,
        drawn: &drawn,
        view: drawn.clone(),
        is_whole: false,
        lines: vec![("estimate", Ink::Third, 2.0, &answer.estimate)],
        keys: Vec::new(),
        moves: None,
    };
    let description = format!("Response of {name} to a step of the signal");
    plot.figure(&description, "There is no estimate to draw.").narrowest()
}

/// Draws the estimate over a triangular signal. For a model without memory this is a single line.
pub(crate) fn loop_figure(name: &str, calibrated: &Calibrated, unit: &str) -> Figure {
    let calibration = &calibrated.calibration;
    let loops: Vec<Vec<(f64, f64)>> = PERIODS_S
        .iter()
        .filter_map(|period_s| {
            let triangle = |t: f64| 1.0 - (2.0 * (t / period_s).fract() - 1.0).abs();
            let answer = Answer::new(calibration, 3.0 * period_s, triangle)?;
            let pairs = answer.time_s.iter().zip(&answer.signal).zip(&answer.estimate);
            // only the last period is drawn, because the initial state has decayed by then
            let last = pairs.filter(|((t, _), y)| **t >= 2.0 * period_s && y.is_finite());
            Some(last.map(|((_, x), y)| (*x, *y)).collect())
        })
        .collect();
    let all = || loops.iter().flatten();
    let (Some(x), Some(y)) = (extent(all().map(|p| p.0)), extent(all().map(|p| p.1))) else {
        return Figure::missing(
            "This calibration needs more inputs than the signal, so it cannot be shown for the signal alone.",
        );
    };
    let labels = [&*calibration.spec().signal.to_string(), &labelled("estimate", unit)];
    let axes = Axes::new(padded(&x, 0.02), padded(&y, 0.06), labels);
    let legend = PERIODS_S.iter().zip(INKS).map(|(s, ink)| (ink, format!("up and down in {s} s")));
    Figure::new(&format!("Estimate of {name} over the signal on triangles of three speeds"))
        .draw(FigureSize::NARROW, |area| {
            plot(area, &axes, |chart| {
                for (points, ink) in loops.iter().zip(INKS) {
                    let line = super::thin::sample_in_order(points, 400);
                    chart.draw_series(LineSeries::new(line, stroke(ink.color(), 1.8)))?;
                }
                Ok(())
            })
        })
        .legend(legend)
}

#[cfg(test)]
mod tests {
    use stretch_receptor::example_observer;

    use super::*;

    #[test]
    fn what_remembers_answers_a_step_and_a_triangle() {
        let calibration = example_observer();
        let up = |t: f64| if t > 5.0 { 1.0 } else { 0.0 };
        let answer = Answer::new(&calibration, 15.0, up).expect("it needs the signal alone");
        let near = |t: f64| answer.time_s.iter().position(|x| *x >= t).unwrap();
        let (before, after) = (answer.estimate[near(4.9)], answer.estimate[near(14.9)]);
        assert!((after - before).abs() > 1.0, "{before} {after}");
    }
}

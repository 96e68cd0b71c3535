//! A calibration surface cut at three rates, with the samples near each.

use std::ops::Range;

use plotters::prelude::*;

use super::{
    branch::BranchView,
    canvas::Ink,
    figure::{Axes, Figure, FigureSize, dot, plot, px, stroke},
    markup::number,
    thin::{padded, quantile, sample, sorted},
};

const INKS: [Ink; 3] = [Ink::Low, Ink::Middle, Ink::High];

/// Most dots of each third.
const DOTS: usize = 350;

/// Target over signal: the samples in motion by thirds of their rate, slow to
/// fast, and the surface at the median rate of each third.
pub(crate) fn slice_figure(view: &BranchView<'_>) -> Figure {
    let thirds = thirds(view);
    let [_, signal, target] = &view.labels;
    let curves: Vec<(f64, Vec<(f64, f64)>)> =
        thirds.iter().filter_map(|third| curve(view, third)).collect();
    let name = view.name().to_lowercase();
    let description = format!(
        "{target} against {signal} on the {name} branch: samples, and the surface at a slow, \
         a middle and a fast rate"
    );
    let (x, y) = (padded(&view.signal, 0.02), padded(&view.target, 0.05));
    let axes = Axes::new(x, y, [signal, target]);
    let paces = ["slow", "middle", "fast"];
    let legend = curves.iter().zip(INKS).zip(paces).map(|(((rate, _), ink), pace)| {
        let rate = number(*rate, 2);
        let unit = if view.labels[0].ends_with("per s") { " per s" } else { "" };
        (ink, format!("{pace}: {rate}{unit}"))
    });
    Figure::new(&description)
        .draw(FigureSize::NARROW, |area| {
            plot(area, &axes, |chart| {
                for (third, ink) in thirds.iter().zip(INKS) {
                    let dots = sample(third, DOTS).into_iter();
                    chart.draw_series(
                        dots.map(|[_, v, t]| Circle::new((v, t), px(1.0), dot(ink, 0.5))),
                    )?;
                }
                for ((_, curve), ink) in curves.iter().zip(INKS) {
                    let inside = |t: f64| axes.y.contains(&t);
                    for run in curve.split(|(_, t)| !inside(*t)) {
                        let line = LineSeries::new(run.to_vec(), stroke(ink.color(), 2.4));
                        chart.draw_series(line)?;
                    }
                }
                Ok(())
            })
        })
        .legend(legend)
}

/// The samples in motion in three equal parts by the size of their rate.
fn thirds(view: &BranchView<'_>) -> Vec<Vec<[f64; 3]>> {
    let at_rest = 0.05 * view.rate.start.abs().max(view.rate.end.abs());
    let mut by_pace: Vec<_> =
        view.cloud.iter().copied().filter(|sample| sample[0].abs() > at_rest).collect();
    by_pace.sort_by(|a, b| a[0].abs().total_cmp(&b[0].abs()));
    by_pace.chunks(by_pace.len().div_ceil(3).max(1)).map(<[_]>::to_vec).collect()
}

/// The median rate of a third, and the surface at that rate over the signals of the third.
fn curve(view: &BranchView<'_>, third: &[[f64; 3]]) -> Option<(f64, Vec<(f64, f64)>)> {
    let rates = sorted(third.iter().map(|s| s[0]));
    let signals = sorted(third.iter().map(|s| s[1]));
    let (rate, seen) = (
        quantile(&rates, 0.5),
        Range { start: quantile(&signals, 0.01), end: quantile(&signals, 0.99) },
    );
    let at = |k: i32| seen.start + (seen.end - seen.start) * f64::from(k) / 60.0;
    rate.is_finite().then(|| (rate, (0..=60).map(|k| (at(k), view.surface(rate, at(k)))).collect()))
}

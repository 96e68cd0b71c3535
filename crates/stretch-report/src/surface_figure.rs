//! A calibration surface with the samples it was fitted to: in space, for the page's script, and cut at three rates.

use plotters::{
    prelude::*,
    style::text_anchor::{HPos, VPos},
};

use super::{
    branch::BranchView,
    canvas::Ink,
    figure::{Axes, Figure, FigureSize, dot, plot, px, stroke, words},
    markup::number,
    signal_figure::AT_REST,
    thin::{padded, quantile, sample, sorted},
};

/// Cells along each side of the mesh.
const CELLS: usize = 18;

/// The surface in the region that samples support, with dots above and below. The page's script draws it; without the
/// script the cuts of [`slice_figure`] show the same surface.
pub(crate) fn surface_figure(view: &BranchView<'_>, ink: Ink) -> Figure {
    let name = view.name();
    let [rate, signal, target] = &view.labels;
    let description = format!(
        "Surface of the {name} branch in space: {target} over {signal} and {rate}, with the samples"
    );
    let legend = [(ink, format!("{name} surface")), (Ink::Truth, "samples of the fit".to_owned())];
    Figure::new(&description)
        .draw(FigureSize { width: 400, height: 40 }, |area| {
            let style = words(Ink::Text, HPos::Center, VPos::Center);
            let note = "This picture needs scripts. The cuts below do not.";
            area.draw(&Text::new(note, (px(200.0), px(20.0)), style))
        })
        .legend(legend)
        .live(live(view, ink))
}

/// Largest number of samples that a script shows with their distance to the surface.
const STEMS: usize = 400;

/// The surface as JSON: heights over the corners of its cells, and samples, in thousandths of the cube.
fn live(view: &BranchView<'_>, ink: Ink) -> String {
    let cube = Cube(view);
    let at = |i: usize| i as f64 / CELLS as f64;
    let thousandths = |x: f64| (1000.0 * x).round() as i64;
    let corners = (0..=CELLS).flat_map(|i| (0..=CELLS).map(move |j| (i, j)));
    let heights: Vec<Option<i64>> = corners
        .map(|(i, j)| cube.height(at(i), at(j)))
        .map(|z| INSIDE.contains(&z).then(|| thousandths(z)))
        .collect();
    let points: Vec<i64> = sample(&view.cloud, STEMS)
        .into_iter()
        .map(|[rate, signal, target]| (cube.u(signal), cube.r(rate), cube.z(target)))
        .filter(|(_, r, _)| (0.0..=1.0).contains(r))
        .flat_map(|(u, r, z)| [u, r, z, z - cube.height(u, r)].map(thousandths))
        .collect();
    let on: String = cube.supported().iter().map(|on| if *on { '1' } else { '0' }).collect();
    let signal = match view.falling {
        true => [view.signal.end, view.signal.start],
        false => [view.signal.start, view.signal.end],
    };
    let spans = [[view.rate.start, view.rate.end], signal, [view.target.start, view.target.end]];
    let axes: Vec<serde_json::Value> = view
        .labels
        .iter()
        .zip(spans)
        .map(|(label, span)| {
            let (name, unit) = label.rsplit_once(", ").unwrap_or((label, ""));
            serde_json::json!({"name": name, "unit": unit, "span": span})
        })
        .collect();
    serde_json::json!({
        "kind": "surface", "axes": axes, "ink": ink.class(), "cells": CELLS, "z": heights, "on": on,
        "points": points,
    })
    .to_string()
}

/// Range of heights that are drawn. It is limited because a polynomial may leave the box where samples are few.
const INSIDE: std::ops::RangeInclusive<f64> = -0.15..=1.15;

/// Conversion from the units of a view to coordinates of the unit cube.
struct Cube<'a>(&'a BranchView<'a>);

impl Cube<'_> {
    fn u(&self, signal: f64) -> f64 {
        let u = (signal - self.0.signal.start) / (self.0.signal.end - self.0.signal.start);
        if self.0.falling { 1.0 - u } else { u }
    }

    fn r(&self, rate: f64) -> f64 {
        (rate - self.0.rate.start) / (self.0.rate.end - self.0.rate.start)
    }

    fn z(&self, target: f64) -> f64 {
        (target - self.0.target.start) / (self.0.target.end - self.0.target.start)
    }

    /// Height of the surface over a point of the floor.
    fn height(&self, u: f64, r: f64) -> f64 {
        let along = if self.0.falling { 1.0 - u } else { u };
        let signal = self.0.signal.start + along * (self.0.signal.end - self.0.signal.start);
        let rate = self.0.rate.start + r * (self.0.rate.end - self.0.rate.start);
        self.z(self.0.surface(rate, signal))
    }

    /// For each cell, whether a sample lies in or near the cell; holes between samples are closed.
    fn supported(&self) -> Vec<bool> {
        let mut cells = vec![false; CELLS * CELLS];
        let cell = |x: f64| ((x * CELLS as f64) as usize).min(CELLS - 1);
        for &[rate, signal, _] in &self.0.cloud {
            let (u, r) = (self.u(signal), self.r(rate));
            if !(0.0..=1.0).contains(&r) {
                continue;
            }
            cells[cell(u) * CELLS + cell(r)] = true;
        }
        // two steps of dilation and one of erosion
        let out = |cells: Vec<bool>| near(&cells, |lit, _| lit > 0);
        let back = |cells: Vec<bool>| near(&cells, |lit, all| lit == all);
        back(out(out(cells)))
    }
}

/// Evaluates `say` for each cell. Its two arguments are the number of lit (true) cells among the cell and its
/// neighbours, and the total number of these cells.
fn near(cells: &[bool], say: impl Fn(usize, usize) -> bool) -> Vec<bool> {
    let reach = |i: usize| i.saturating_sub(1)..(i + 2).min(CELLS);
    let around = |c: usize| {
        let (rows, columns) = (reach(c / CELLS), reach(c % CELLS));
        let lit = |i: usize| columns.clone().filter(|j| cells[i * CELLS + j]).count();
        say(rows.clone().map(lit).sum(), rows.len() * columns.len())
    };
    (0..cells.len()).map(around).collect()
}

/// Inks of a slow, a middle and a fast rate.
const INKS: [Ink; 3] = [Ink::Low, Ink::Middle, Ink::High];

/// Largest number of dots of each third.
const SLICE_DOTS: usize = 350;

/// Target over signal: the samples in motion by thirds of their rate, slow to
/// fast, and the surface at the median rate of each third.
pub(crate) fn slice_figure(view: &BranchView<'_>) -> Figure {
    let thirds = thirds(view);
    let [_, signal, target] = &view.labels;
    let curves: Vec<(f64, Vec<(f64, f64)>)> =
        thirds.iter().filter_map(|third| curve(view, third)).collect();
    let name = view.name();
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
                    let dots = sample(third, SLICE_DOTS).into_iter();
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
    let at_rest = AT_REST * view.rate.start.abs().max(view.rate.end.abs());
    let mut by_pace: Vec<_> =
        view.cloud.iter().copied().filter(|sample| sample[0].abs() > at_rest).collect();
    by_pace.sort_by(|a, b| a[0].abs().total_cmp(&b[0].abs()));
    by_pace.chunks(by_pace.len().div_ceil(3).max(1)).map(<[_]>::to_vec).collect()
}

/// The median size of the rates of a third, with the sign that prevails on the branch, and the surface at that rate over
/// the signals of the third. Near a reversal, a branch also has rates of the other sign.
fn curve(view: &BranchView<'_>, third: &[[f64; 3]]) -> Option<(f64, Vec<(f64, f64)>)> {
    let sign = view.cloud.iter().map(|s| s[0]).sum::<f64>().signum();
    let rates = sorted(third.iter().map(|s| sign * s[0].abs()));
    let signals = sorted(third.iter().map(|s| s[1]));
    let (rate, seen) = (quantile(&rates, 0.5), quantile(&signals, 0.01)..quantile(&signals, 0.99));
    let at = |k: i32| seen.start + (seen.end - seen.start) * f64::from(k) / 60.0;
    rate.is_finite().then(|| (rate, (0..=60).map(|k| (at(k), view.surface(rate, at(k)))).collect()))
}

//! Draws samples as dots over a place (level or rate), with one panel for each series. Each panel also shows the
//! median of the samples and the band that contains 80 % of them.

use std::ops::Range;

use plotters::prelude::*;

use super::{
    canvas::Ink,
    figure::{Area, Axes, Drawn, Figure, FigureSize, dot, plot, px, stroke},
    live::{Panel, scatter_json},
    thin::{binned, sample},
};

/// Number of parts of the axis, each with its own dots and median.
const SLOTS: usize = 24;
/// Height of a panel, pixels; the last panel also holds the label of the axis.
const PANEL: u32 = 165;
const LABEL: u32 = 20;

/// One panel.
pub(crate) struct Dots {
    /// Colour of the dots and the band.
    pub(crate) ink: Ink,
    /// Name of the series on hovering.
    pub(crate) name: String,
    /// Label of the vertical axis.
    pub(crate) y_label: String,
    /// Place and value of each sample.
    pub(crate) points: Vec<(f64, f64)>,
}

/// Properties that the panels share.
pub(crate) struct Shared<'a> {
    /// The part of the axis that is drawn.
    pub(crate) x: Range<f64>,
    /// Label of the horizontal axis, below the last panel.
    pub(crate) x_label: &'a str,
    /// Name and unit of the place, and unit of the values, for hovering.
    pub(crate) names: [&'a str; 3],
    /// Largest magnitude of a value on a panel; values beyond have no dot.
    pub(crate) most: f64,
    /// Largest number of dots of a panel.
    pub(crate) dots: usize,
    /// Name of the group of figures in which a brush (a drag over the figure) picks samples, and the key by which it
    /// picks.
    pub(crate) brush: (&'a str, Option<&'a str>),
}

/// The panels, one below the other.
pub(crate) fn dots_figure(description: &str, against: &Shared<'_>, panels: &[Dots]) -> Figure {
    let most = against.most;
    let tall = |i: usize| PANEL + if i + 1 == panels.len() { LABEL } else { 0 };
    let live_panels: Vec<Panel> = (0_u32..)
        .zip(panels)
        .enumerate()
        .map(|(i, (above, panel))| {
            let ends = [above * PANEL, above * PANEL + tall(i)];
            Panel::new(panel.name.clone(), ends, i + 1 < panels.len(), [-most, most])
        })
        .collect();
    let (link, by) = against.brush;
    let live = scatter_json(link, by, &against.x, against.names, &live_panels);
    let frame = FigureSize { width: 400, height: PANEL * panels.len() as u32 + LABEL };
    Figure::new(description)
        .draw(frame, |area| {
            let mut rest = area.clone();
            for (i, panel) in panels.iter().enumerate() {
                let (here, below) = rest.split_vertically(px(f64::from(tall(i))));
                rest = below;
                draw(&here, against, panel, i + 1 == panels.len())?;
            }
            Ok(())
        })
        .live(live)
}

fn draw(area: &Area<'_>, against: &Shared<'_>, panel: &Dots, is_last: bool) -> Drawn {
    let (x, most) = (&against.x, against.most);
    let x_label = if is_last { against.x_label } else { "" };
    let axes = Axes::new(x.clone(), -most..most, [x_label, &panel.y_label]);
    let bins = binned(&panel.points, x, SLOTS);
    let cut = |y: f64| y.clamp(-most, most);
    plot(area, &axes, |chart| {
        let zero = [(x.start, 0.0), (x.end, 0.0)];
        chart.draw_series(LineSeries::new(zero, stroke(Ink::Axis.color(), 1.0)))?;
        let dots = spread_over(&panel.points, against).into_iter();
        chart.draw_series(dots.map(|at| Circle::new(at, px(0.9), dot(panel.ink, 0.55))))?;
        if bins.len() > 1 {
            let rim = bins.iter().map(|b| (b.x, cut(b.low)));
            let back = bins.iter().rev().map(|b| (b.x, cut(b.high)));
            let band: Vec<_> = rim.chain(back).collect();
            chart.draw_series([Polygon::new(band, panel.ink.faint(0.18))])?;
            let median = bins.iter().map(|b| (b.x, cut(b.median)));
            chart.draw_series(LineSeries::new(median, stroke(Ink::Truth.color(), 2.2)))?;
        }
        Ok(())
    })
}

/// Picks dots from every part of the axis. Otherwise most dots would be in one place, because most
/// samples of a recording are at rest.
fn spread_over(points: &[(f64, f64)], against: &Shared<'_>) -> Vec<(f64, f64)> {
    let x = &against.x;
    let width = (x.end - x.start) / SLOTS as f64;
    let mut slots = vec![Vec::new(); SLOTS];
    for &point in points.iter().filter(|(at, y)| x.contains(at) && y.abs() < against.most) {
        let index = ((point.0 - x.start) / width) as usize;
        slots[index.min(SLOTS - 1)].push(point);
    }
    slots.iter().flat_map(|slot| sample(slot, against.dots / SLOTS)).collect()
}

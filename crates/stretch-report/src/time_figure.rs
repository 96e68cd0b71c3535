//! Curves over time: a drawing in two frames, its legend, and the data for the page's script.

use std::ops::Range;

use plotters::prelude::*;

use super::{
    canvas::Ink,
    figure::{Axes, Figure, FigureSize, plot, stroke},
    live::time_json,
    thin::{curve, extent, padded},
};

/// A plot over time.
#[derive(Debug)]
pub(crate) struct TimePlot<'a> {
    /// Name of the group of plots that zoom together; empty for a plot without data for the script.
    pub(crate) link: &'a str,
    /// Labels of the horizontal and the vertical axis.
    pub(crate) labels: [&'a str; 2],
    /// Unit of the values.
    pub(crate) unit: &'a str,
    /// Height in pixels.
    pub(crate) height: u32,
    /// Times of the samples.
    pub(crate) time: &'a [f64],
    /// The window that is drawn.
    pub(crate) drawn: &'a Range<f64>,
    /// The first view of the script.
    pub(crate) view: Range<f64>,
    /// Whether the plot always shows the whole recording, draws the curves of the linked plots and marks their view.
    pub(crate) is_whole: bool,
    /// Name, colour, width in pixels, values.
    pub(crate) lines: Vec<(&'a str, Ink, f64, &'a [f64])>,
    /// Keys by which samples are picked, with their values.
    pub(crate) keys: Vec<(&'static str, &'a [f64])>,
    /// Effect of a varied parameter on the curves: `out` adds to a curve, `left` subtracts from it.
    pub(crate) moves: Option<&'static str>,
}

impl TimePlot<'_> {
    /// Draws the plot, the frame for phones first. The axes span all lines. `missing` is shown if the lines have no
    /// number.
    pub(crate) fn figure(&self, description: &str, missing: &str) -> Figure {
        let pieces = |bins: usize| {
            let thin = move |&(_, ink, width, y): &(&str, Ink, f64, &[f64])| {
                (ink, width, curve(self.time, y, self.drawn, bins))
            };
            self.lines.iter().map(thin).collect::<Vec<_>>()
        };
        let [for_phones, for_desktops] = [360, 750].map(pieces);
        let points = for_desktops.iter().flat_map(|(.., pieces)| pieces.iter().flatten());
        let Some(y) = extent(points.map(|(_, y)| *y)) else {
            return Figure::missing(missing);
        };
        let axes = Axes::new(self.drawn.clone(), padded(&y, 0.06), self.labels);
        let (phone, desktop) = (FigureSize::NARROW, FigureSize::WIDE);
        let frames = [
            (FigureSize { height: self.height.min(phone.height), ..phone }, for_phones),
            (FigureSize { height: self.height, ..desktop }, for_desktops),
        ];
        let figure = frames.into_iter().fold(Figure::new(description), |figure, (frame, lines)| {
            figure.draw(frame, |area| {
                plot(area, &axes, |chart| {
                    for (ink, width, pieces) in lines {
                        for piece in pieces {
                            let style = stroke(ink.color(), width);
                            chart.draw_series(LineSeries::new(piece, style))?;
                        }
                    }
                    Ok(())
                })
            })
        });
        let legend = self.lines.iter().map(|(name, ink, ..)| (*ink, (*name).to_owned()));
        figure.legend(legend).live(time_json(self))
    }
}

//! What pages of other crates are built from: the frame of a page, its figures, and numbers as they stand there.
//!
//! Figures are drawn with `plotters`, whose types stand in [`Area`] and [`Chart`]: whoever draws with them takes the same version of it.

pub use crate::{
    bar_figure::{Bar, Row, Scale, bar_figure, narrow_bar_figure},
    canvas::{Canvas, Ink, STEPS},
    figure::{Area, Axes, Chart, Drawn, Figure, FigureSize, TEXT_PX, dot, plot, px, stroke, words},
    markup::{fixed, number, percent},
    page::{Page, Table},
};

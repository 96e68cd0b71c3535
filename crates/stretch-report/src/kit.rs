//! Parts for the pages of other crates: the frame of a page, its figures, and its numbers.
//!
//! Figures are drawn with `plotters`, whose types appear in [`Area`] and [`Chart`]: a crate that draws with these
//! types needs the same version of `plotters`.

pub use crate::{
    bar_figure::{Bar, Row, Scale, bar_figure, narrow_bar_figure},
    canvas::{Canvas, Ink, STEPS},
    figure::{Area, Axes, Chart, Drawn, Figure, FigureSize, TEXT_PX, dot, plot, px, stroke, words},
    markup::{escape, fixed, number, percent},
    page::{Page, Table},
};

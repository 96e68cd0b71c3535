//! A figure and the axes that all figures share.

use std::{convert::Infallible, ops::Range};

use plotters::{
    coord::{Shift, types::RangedCoordf64},
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};

use super::{
    canvas::{Canvas, Ink, STEPS},
    markup::{escape, number, tick},
};

/// Font size of words and numbers, in pixels of the figure.
pub const TEXT_PX: u32 = 14;

/// The area on which figures are drawn.
pub type Area<'a> = DrawingArea<Canvas<'a>, Shift>;

/// Axes with a place for the data.
pub type Chart<'a, 'b> = ChartContext<'a, Canvas<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// The result of drawing. Drawing fails only for a fault in the figure itself.
pub type Drawn = Result<(), DrawingAreaErrorKind<Infallible>>;

/// Pixels as steps of the drawing grid.
pub fn px(pixels: f64) -> i32 {
    (pixels * f64::from(STEPS)).round() as i32
}

/// The size of a drawing, in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FigureSize {
    /// Width.
    pub width: u32,
    /// Height.
    pub height: u32,
}

impl FigureSize {
    /// The size for half a desktop page or a whole phone: the text stays legible at 360 px.
    pub const NARROW: Self = Self { width: 400, height: 290 };
    /// The size for the whole width of a desktop page.
    pub const WIDE: Self = Self { width: 880, height: 320 };
}

/// A drawing in one or two shapes with a legend in words, or the reason why there is no drawing.
#[derive(Debug, Clone, Default)]
pub struct Figure {
    /// Text for a reader who cannot see the figure.
    pub description: String,
    /// Colours and their meanings.
    pub legend: Vec<(Ink, String)>,
    /// Reason why there is no drawing.
    pub missing: Option<String>,
    /// Data from which the page's script draws the figure, as JSON.
    pub live: Option<String>,
    drawings: Vec<(FigureSize, String)>,
}

impl Figure {
    /// A figure with this description and nothing drawn yet.
    pub fn new(description: &str) -> Self {
        Self { description: description.to_owned(), ..Self::default() }
    }

    /// A figure without a drawing, and the reason.
    pub fn missing(why: &str) -> Self {
        Self { missing: Some(why.to_owned()), ..Self::default() }
    }

    /// Draws the figure in a frame; the narrowest of several frames is for phones.
    #[must_use]
    pub fn draw(mut self, frame: FigureSize, draw: impl FnOnce(&Area<'_>) -> Drawn) -> Self {
        let mut body = String::new();
        let done = {
            let area = Canvas::new(&mut body, frame.width, frame.height).into_drawing_area();
            draw(&area).and_then(|()| area.present())
        };
        match done {
            Ok(()) => self.drawings.push((frame, body)),
            Err(error) => self.missing = Some(format!("This figure could not be drawn: {error}")),
        }
        self
    }

    /// Keeps only the shape for phones, for figures that are side by side.
    #[must_use]
    pub fn narrowest(mut self) -> Self {
        let narrowest = self.drawings.iter().map(|(frame, _)| frame.width).min();
        self.drawings.retain(|(frame, _)| Some(frame.width) == narrowest);
        self
    }

    /// Adds a legend.
    #[must_use]
    pub fn legend(mut self, entries: impl IntoIterator<Item = (Ink, String)>) -> Self {
        self.legend.extend(entries);
        self
    }

    /// Adds the data for the page's script.
    #[must_use]
    pub fn live(mut self, json: impl Into<Option<String>>) -> Self {
        self.live = json.into();
        self
    }

    /// The drawings as inline SVG; of two drawings the style sheet shows the one that fits.
    pub fn svg(&self) -> String {
        let both = self.drawings.len() > 1;
        let narrowest = self.drawings.iter().map(|(frame, _)| frame.width).min();
        let label = escape(&self.description);
        let drawing = |(frame, body): &(FigureSize, String)| {
            let class = match (both, Some(frame.width) == narrowest) {
                (false, _) => "",
                (true, true) => " class=\"narrow\"",
                (true, false) => " class=\"wide\"",
            };
            let (w, h) = (frame.width * STEPS, frame.height * STEPS);
            format!(
                "<svg{class} viewBox=\"0 0 {w} {h}\" role=\"img\" aria-label=\"{label}\">\n\
                 {body}</svg>\n"
            )
        };
        self.drawings.iter().map(drawing).collect()
    }

    /// The widest drawing as a separate file, in light colours with its legend inside.
    pub fn standalone(&self) -> String {
        let Some((frame, body)) = self.drawings.iter().max_by_key(|(frame, _)| frame.width) else {
            return String::new();
        };
        let (width, height) = (frame.width, frame.height + LEGEND_PX);
        let (w, h) = (width * STEPS, height * STEPS);
        let (mut legend, mut x) = (String::new(), px(52.0));
        for (ink, name) in &self.legend {
            let (y, end, words, class) = (px(14.0), x + px(22.0), escape(name), ink.class());
            legend += &format!(
                "<path class=\"line {class}\" stroke-width=\"12\" d=\"M{x} {y}H{end}\"/>\n\
                 <text class=\"ink-text\" x=\"{}\" y=\"{y}\" dy=\"0.35em\" font-size=\"{}\">\
                 {words}</text>\n",
                end + px(6.0),
                TEXT_PX * STEPS
            );
            // a letter is about seven and a half pixels wide
            x = end + px(28.0 + 7.5 * name.chars().count() as f64);
        }
        let (label, down) = (escape(&self.description), LEGEND_PX * STEPS);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {w} {h}\" role=\"img\" aria-label=\"{label}\">\n<title>{label}</title>\n\
             <style>\n{}</style>\n<rect width=\"{w}\" height=\"{h}\" fill=\"#ffffff\"/>\n{legend}\
             <g transform=\"translate(0 {down})\">\n{body}</g></svg>\n",
            include_str!("figure_light.css")
        )
    }
}

/// Height of the legend of a figure in a separate file.
const LEGEND_PX: u32 = 28;

/// Labels and spans of two axes.
#[derive(Debug, Clone)]
pub struct Axes {
    /// Horizontal span.
    pub x: Range<f64>,
    /// Vertical span.
    pub y: Range<f64>,
    /// Label below the right end of the horizontal axis; empty if another panel shows the numbers of the axis.
    pub x_label: String,
    /// Label above the vertical axis.
    pub y_label: String,
    /// Whether horizontal places are logarithms to base ten; the numbers at the axis are then the powers of ten.
    pub is_log: bool,
}

impl Axes {
    /// Axes of plain numbers, with the labels below and above them.
    pub fn new(x: Range<f64>, y: Range<f64>, labels: [&str; 2]) -> Self {
        let [x_label, y_label] = labels.map(str::to_owned);
        Self { x, y, x_label, y_label, is_log: false }
    }
}

/// Returns the style of a text in an ink, aligned at `h` and `v`.
pub fn words(ink: Ink, h: HPos, v: VPos) -> TextStyle<'static> {
    let mut style = TextStyle::from(("sans-serif", TEXT_PX * STEPS).into_font());
    style.color = ink.color().to_backend_color();
    style.pos(Pos::new(h, v))
}

/// Returns the style of a line that is `pixels` wide.
pub fn stroke(color: impl Into<RGBAColor>, pixels: f64) -> ShapeStyle {
    let stroke_width = px(pixels).unsigned_abs();
    ShapeStyle { color: color.into(), filled: false, stroke_width }
}

/// Returns the style of a dot.
pub fn dot(ink: Ink, opacity: f64) -> ShapeStyle {
    ShapeStyle { color: ink.faint(opacity), filled: true, stroke_width: 0 }
}

/// Draws axes and then the data.
pub fn plot<'b>(
    area: &Area<'b>,
    axes: &Axes,
    data: impl FnOnce(&mut Chart<'_, 'b>) -> Drawn,
) -> Drawn {
    let (width, height) = area.dim_in_pixel();
    let bare = axes.x_label.is_empty();
    let (x, y) = (spread(&axes.x), spread(&axes.y));
    let (x_span, y_span) = (x.end - x.start, y.end - y.start);
    let mut chart = ChartBuilder::on(area)
        .margin_top(px(24.0))
        .margin_right(px(14.0))
        .margin_bottom(if bare { px(8.0) } else { px(22.0) })
        .x_label_area_size(px(20.0))
        .y_label_area_size(px(52.0))
        .build_cartesian_2d(x, y)?;
    let numbers = words(Ink::Text, HPos::Center, VPos::Center);
    let most = |pixels: u32, each: i32| (pixels as i32 / px(f64::from(each))).max(2) as usize;
    chart
        .configure_mesh()
        .x_labels(if axes.is_log { x_span.floor() as usize + 1 } else { most(width, 75) })
        .y_labels(most(height, 32))
        .x_label_formatter(&|v| {
            if axes.is_log { number(10f64.powf(*v), 1) } else { tick(*v, x_span) }
        })
        .y_label_formatter(&|v| tick(*v, y_span))
        .label_style(numbers)
        .axis_style(stroke(Ink::Axis.color(), 1.0))
        .bold_line_style(stroke(Ink::Grid.color(), 1.0))
        .light_line_style(stroke(TRANSPARENT, 0.0))
        .set_all_tick_mark_size(px(4.0))
        .draw()?;
    data(&mut chart)?;
    let above = words(Ink::Text, HPos::Left, VPos::Top);
    area.draw(&Text::new(axes.y_label.clone(), (px(4.0), px(3.0)), above))?;
    let below = words(Ink::Text, HPos::Right, VPos::Bottom);
    let corner = (width as i32 - px(14.0), height as i32 - px(3.0));
    area.draw(&Text::new(axes.x_label.clone(), corner, below))
}

/// Replaces a span that is not finite or that is empty, so that any data can be drawn.
fn spread(span: &Range<f64>) -> Range<f64> {
    let (low, high) = (span.start, span.end);
    if !(low.is_finite() && high.is_finite()) {
        return 0.0..1.0;
    }
    let least = 1e-9 * low.abs().max(high.abs()).max(1e-9);
    if high - low > least { low..high } else { low - 0.5..low + 0.5 }
}

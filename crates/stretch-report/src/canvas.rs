//! An SVG backend for plotters that writes colours as class names, not as numbers.
//!
//! Every shape carries a class (`ink-raw`), so that one figure serves light
//! and dark pages and paper. Dots of one colour are one path, so that a cloud of a thousand dots costs ten kilobytes,
//! not a hundred.

use std::{convert::Infallible, fmt::Write as _};

use plotters::style::{RGBAColor, RGBColor};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
    FontTransform,
    text_anchor::{HPos, VPos},
};

use super::markup::escape;

/// Steps of the drawing grid in one pixel of the figure; plotters places shapes on whole steps.
pub const STEPS: u32 = 4;

/// A colour by its meaning; the style sheet gives its appearance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ink {
    /// Words and numbers.
    Text,
    /// Axes.
    Axis,
    /// Grid lines.
    Grid,
    /// The measured reference.
    Truth,
    /// The first of several compared curves or groups.
    First,
    /// The second of several compared curves or groups.
    Second,
    /// The third of several compared curves or groups.
    Third,
    /// The fourth of several compared curves or groups.
    Fourth,
    /// The fifth of several compared curves or groups.
    Fifth,
    /// The low end of an ordered scale.
    Low,
    /// The middle of an ordered scale.
    Middle,
    /// The high end of an ordered scale.
    High,
}

impl Ink {
    const ALL: [(Self, &'static str); 12] = [
        (Self::Text, "ink-text"),
        (Self::Axis, "ink-axis"),
        (Self::Grid, "ink-grid"),
        (Self::Truth, "ink-truth"),
        (Self::First, "ink-1"),
        (Self::Second, "ink-2"),
        (Self::Third, "ink-3"),
        (Self::Fourth, "ink-4"),
        (Self::Fifth, "ink-5"),
        (Self::Low, "ink-low"),
        (Self::Middle, "ink-middle"),
        (Self::High, "ink-high"),
    ];

    /// Returns the ink of the compared curve or group with an index; the colours repeat after the
    /// fifth.
    pub fn of(index: usize) -> Self {
        [Self::First, Self::Second, Self::Third, Self::Fourth, Self::Fifth][index % 5]
    }

    /// CSS class of the ink.
    pub(crate) fn class(self) -> &'static str {
        Self::ALL.iter().find(|(ink, _)| *ink == self).map_or("ink-text", |(_, class)| class)
    }

    /// Encodes the ink as a colour, which plotters passes to the backend.
    pub fn color(self) -> RGBColor {
        let index = Self::ALL.iter().position(|(ink, _)| *ink == self).unwrap_or(0);
        RGBColor(index as u8, 0, 0)
    }

    /// The colour of the ink with an opacity.
    pub fn faint(self, opacity: f64) -> RGBAColor {
        RGBAColor(self.color().0, 0, 0, opacity)
    }
}

/// Returns the CSS class of the ink that a colour from plotters encodes.
fn class(color: BackendColor) -> &'static str {
    Ink::ALL.get(usize::from(color.rgb.0)).map_or("ink-text", |(_, class)| class)
}

/// Dots of one colour and size that are collected for one path.
#[derive(Debug)]
struct Dots {
    class: &'static str,
    opacity: f64,
    radius: u32,
    last: BackendCoord,
    path: String,
}

/// The backend: writes the inside of an `svg` element into a string.
#[derive(Debug)]
pub struct Canvas<'a> {
    body: &'a mut String,
    size: (u32, u32),
    dots: Option<Dots>,
}

type Done = Result<(), DrawingErrorKind<Infallible>>;

impl<'a> Canvas<'a> {
    /// A canvas of `width` by `height` pixels.
    pub(crate) fn new(body: &'a mut String, width: u32, height: u32) -> Self {
        Self { body, size: (width * STEPS, height * STEPS), dots: None }
    }

    fn flush(&mut self) {
        if let Some(dots) = self.dots.take() {
            let width = 2 * dots.radius;
            let opacity = opacity("stroke", dots.opacity);
            *self.body += &format!(
                "<path class=\"dots {}\"{opacity} stroke-width=\"{width}\" d=\"{}\"/>\n",
                dots.class, dots.path
            );
        }
    }

    fn shape<S: BackendStyle>(&mut self, d: &str, style: &S, filled: bool) -> Done {
        let color = style.color();
        if color.alpha == 0.0 || d.is_empty() {
            return Ok(());
        }
        self.flush();
        let class = class(color);
        *self.body += &if filled {
            let opacity = opacity("fill", color.alpha);
            format!("<path class=\"area {class}\"{opacity} d=\"{d}z\"/>\n")
        } else {
            let (opacity, width) = (opacity("stroke", color.alpha), style.stroke_width());
            format!("<path class=\"line {class}\"{opacity} stroke-width=\"{width}\" d=\"{d}\"/>\n")
        };
        Ok(())
    }
}

/// An opacity attribute; empty when opaque.
fn opacity(of: &str, share: f64) -> String {
    if share >= 1.0 { String::new() } else { format!(" {of}-opacity=\"{share:.2}\"") }
}

/// Path data through points; coordinates after the first point are relative, which is shorter.
fn path(points: impl IntoIterator<Item = BackendCoord>) -> String {
    let mut d = String::new();
    let mut last: Option<BackendCoord> = None;
    for (x, y) in points {
        // writing to a string cannot fail
        let _ = match last {
            None => write!(d, "M{x} {y}l"),
            Some((x0, y0)) => write!(d, "{} {} ", x - x0, y - y0),
        };
        last = Some((x, y));
    }
    let end = d.trim_end_matches([' ', 'l']).len();
    d.truncate(end);
    d
}

impl DrawingBackend for Canvas<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        self.size
    }

    fn ensure_prepared(&mut self) -> Done {
        Ok(())
    }

    fn present(&mut self) -> Done {
        self.flush();
        Ok(())
    }

    fn draw_pixel(&mut self, point: BackendCoord, color: BackendColor) -> Done {
        self.draw_circle(point, 1, &color, true)
    }

    fn draw_line<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
    ) -> Done {
        self.shape(&path([from, to]), style, false)
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        (left, top): BackendCoord,
        (right, bottom): BackendCoord,
        style: &S,
        fill: bool,
    ) -> Done {
        let corners = [(left, top), (right, top), (right, bottom), (left, bottom), (left, top)];
        self.shape(&path(corners), style, fill)
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        points: I,
        style: &S,
    ) -> Done {
        self.shape(&path(points), style, false)
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        points: I,
        style: &S,
    ) -> Done {
        self.shape(&path(points), style, true)
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        (x, y): BackendCoord,
        radius: u32,
        style: &S,
        _fill: bool,
    ) -> Done {
        let color = style.color();
        let class = class(color);
        let joins = self.dots.as_ref().is_some_and(|dots| {
            (dots.class, dots.opacity, dots.radius) == (class, color.alpha, radius)
        });
        if !joins {
            self.flush();
        }
        let first = Dots { class, opacity: color.alpha, radius, last: (0, 0), path: String::new() };
        let dots = self.dots.get_or_insert(first);
        let command = if dots.path.is_empty() { 'M' } else { 'm' };
        let (x0, y0) = dots.last;
        // a line of length zero with round ends is drawn as a dot
        let _ = write!(dots.path, "{command}{} {}h0", x - x0, y - y0);
        dots.last = (x, y);
        Ok(())
    }

    fn draw_text<S: BackendTextStyle>(
        &mut self,
        text: &str,
        style: &S,
        (x, y): BackendCoord,
    ) -> Done {
        self.flush();
        let anchor = match style.anchor().h_pos {
            HPos::Left => "start",
            HPos::Center => "middle",
            HPos::Right => "end",
        };
        let dy = match style.anchor().v_pos {
            VPos::Top => "0.8em",
            VPos::Center => "0.35em",
            VPos::Bottom => "-0.2em",
        };
        let turn = match style.transform() {
            FontTransform::None => 0,
            FontTransform::Rotate90 => 90,
            FontTransform::Rotate180 => 180,
            FontTransform::Rotate270 => 270,
        };
        let class = class(style.color());
        let size = style.size();
        let turned = if turn == 0 {
            String::new()
        } else {
            format!(" transform=\"rotate({turn} {x} {y})\"")
        };
        let words = escape(text);
        *self.body += &format!(
            "<text class=\"{class}\" x=\"{x}\" y=\"{y}\" dy=\"{dy}\" text-anchor=\"{anchor}\" \
             font-size=\"{size}\"{turned}>{words}</text>\n"
        );
        Ok(())
    }
}

//! Horizontal bars: a few numbers with their intervals and labels.

use plotters::{
    prelude::*,
    style::text_anchor::{HPos, VPos},
};

use super::{
    canvas::Ink,
    figure::{Area, Drawn, Figure, FigureSize, dot, px, stroke, words},
    live::{BarRow, Pick, bars_json},
    markup::{number, tick},
};

/// Height of a bar, of a row's label, and of the axis, in pixels.
const BAR: f64 = 11.0;
const LABEL: f64 = 21.0;
const AXIS: f64 = 46.0;
/// Space for the number behind the longest bar.
const NUMBER: f64 = 88.0;

/// One bar.
#[derive(Debug, Clone)]
pub struct Bar {
    /// Colour of the bar.
    pub ink: Ink,
    /// Value that the length shows.
    pub value: f64,
    /// An interval around the end of the bar.
    pub interval: Option<[f64; 2]>,
    /// Text behind the bar; if it is empty, the value is written.
    pub text: String,
}

impl Bar {
    /// A bar with its value behind it.
    pub fn new(ink: Ink, value: f64) -> Self {
        Self { ink, value, interval: None, text: String::new() }
    }
}

/// Bars under one label.
#[derive(Debug, Clone)]
pub struct Row {
    /// The label of the bars.
    pub label: String,
    /// The bars.
    pub bars: Vec<Bar>,
}

/// The scale from values to lengths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// A linear scale from 0 to 1, in percent.
    Percent,
    /// A logarithmic scale in multiples of the noise, from 1.
    NoiseMultiples,
}

/// Largest number of letters of a label that fit on one line of a phone's screen.
const LETTERS: usize = 48;
/// Height of each further line of a label, in pixels.
const LINE: f64 = 17.0;

/// Returns a label split between words into lines that fit a phone's screen.
fn label_lines(label: &str) -> Vec<String> {
    let mut lines: Vec<String> = vec![String::new()];
    for word in label.split(' ') {
        let last = lines.last().map_or(0, |line| line.chars().count());
        match lines.last_mut() {
            Some(line) if last == 0 => line.push_str(word),
            Some(line) if last + 1 + word.chars().count() <= LETTERS => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

fn label_px(row: &Row) -> f64 {
    LABEL + LINE * (label_lines(&row.label).len() - 1) as f64
}

/// Draws rows of bars.
pub fn bar_figure(description: &str, rows: &[Row], scale: Scale, x_label: &str) -> Figure {
    if rows.is_empty() {
        return Figure::missing("There is nothing to draw here.");
    }
    let bars: usize = rows.iter().map(|r| r.bars.len()).sum();
    let labels: f64 = rows.iter().map(label_px).sum();
    let height = (labels + rows.len() as f64 * 5.0 + bars as f64 * (BAR + 3.0) + AXIS) as u32;
    let most = rows
        .iter()
        .flat_map(|r| &r.bars)
        .map(|b| b.interval.map_or(b.value, |i| i[1].max(b.value)))
        .filter(|x| x.is_finite())
        .fold(1.0, f64::max);
    let draw = |area: &Area<'_>| draw(area, rows, scale, most, x_label);
    Figure::new(description)
        .draw(FigureSize { width: 400, height }, draw)
        .draw(FigureSize { width: 880, height }, draw)
        .live(bars_json(GAP, &bar_rows(rows, &[], x_label)))
}

/// Name of the link between bars and the plots over time that mark a bar's samples.
pub(crate) const GAP: &str = "gap";

/// Returns the place and the text of every row, with the samples that belong to the row.
fn bar_rows(rows: &[Row], picks: &[Option<Pick>], unit: &str) -> Vec<BarRow> {
    let mut y = 2.0;
    let mut one = |(index, row): (usize, &Row)| {
        let top = y;
        y += label_px(row) + row.bars.len() as f64 * (BAR + 3.0) + 5.0;
        let said = |bar: &Bar| match bar.text.is_empty() {
            true => format!("{} {unit}", number(bar.value, 2)),
            false => bar.text.clone(),
        };
        BarRow {
            label: row.label.clone(),
            top: px(top),
            bottom: px(y - 3.0),
            text: row.bars.iter().map(said).collect::<Vec<_>>().join("; "),
            pick: picks.get(index).cloned().flatten(),
        }
    };
    rows.iter().enumerate().map(&mut one).collect()
}

/// Adds to a figure of bars the samples that each row marks in the linked plots.
pub(crate) fn picking(figure: Figure, rows: &[Row], picks: &[Option<Pick>], unit: &str) -> Figure {
    figure.live(bars_json(GAP, &bar_rows(rows, picks, unit)))
}

fn draw(area: &Area<'_>, rows: &[Row], scale: Scale, most: f64, x_label: &str) -> Drawn {
    let (width, height) = area.dim_in_pixel();
    let (left, right) = (px(4.0), width as i32 - px(NUMBER));
    let bottom = height as i32 - px(AXIS - 4.0);
    let end = match scale {
        Scale::Percent => 1.0,
        // The scale ends at the next 1, 2 or 5 times a power of ten.
        Scale::NoiseMultiples => [1.0, 2.0, 5.0, 10.0]
            .map(|k| k * 10f64.powf(most.log10().floor()))
            .into_iter()
            .find(|e| *e >= most.max(1.9))
            .unwrap_or(most),
    };
    let place = |value: f64| -> i32 {
        let share = match scale {
            Scale::Percent => value,
            Scale::NoiseMultiples => value.max(1.0).log10() / end.log10(),
        };
        left + (f64::from(right - left) * share.clamp(0.0, 1.0)).round() as i32
    };
    let ticks: Vec<f64> = match scale {
        Scale::Percent => vec![0.0, 0.25, 0.5, 0.75, 1.0],
        Scale::NoiseMultiples => {
            let fine: &[f64] = match end {
                e if e <= 20.0 => &[1.0, 2.0, 5.0],
                e if e <= 2e3 => &[1.0, 3.0],
                _ => &[1.0],
            };
            let decades = 0..=(end.log10().ceil() as i32);
            let all = decades.flat_map(|d| fine.iter().map(move |f| f * 10f64.powi(d)));
            all.filter(|t| *t <= end * 1.001).collect()
        }
    };
    for (index, t) in ticks.into_iter().enumerate() {
        let x = place(t);
        let line = vec![(x, px(2.0)), (x, bottom)];
        area.draw(&PathElement::new(line, stroke(Ink::Grid.color(), 1.0)))?;
        let text = match scale {
            Scale::Percent => tick(100.0 * t, 100.0),
            Scale::NoiseMultiples => number(t, 1),
        };
        let h = if index == 0 { HPos::Left } else { HPos::Center };
        area.draw(&Text::new(text, (x, bottom + px(4.0)), words(Ink::Text, h, VPos::Top)))?;
    }
    let mut y = px(2.0);
    for row in rows {
        for (k, line) in label_lines(&row.label).into_iter().enumerate() {
            let at = (left + px(5.0), y + px(0.5 * LABEL - 1.0 + LINE * k as f64));
            area.draw(&Text::new(line, at, words(Ink::Text, HPos::Left, VPos::Center)))?;
        }
        y += px(label_px(row));
        for bar in &row.bars {
            let (top, low) = (y, y + px(BAR));
            let x = place(bar.value).max(left + px(1.0));
            area.draw(&Rectangle::new([(left, top), (x, low)], dot(bar.ink, 0.85)))?;
            let mut behind = x;
            if let Some([a, b]) = bar.interval {
                let (a, b, at) = (place(a), place(b), (top + low) / 2);
                let style = stroke(Ink::Text.color(), 1.4);
                area.draw(&PathElement::new(vec![(a, at), (b, at)], style))?;
                for x in [a, b] {
                    let cap = vec![(x, at - px(3.5)), (x, at + px(3.5))];
                    area.draw(&PathElement::new(cap, style))?;
                }
                behind = behind.max(b);
            }
            let text = if bar.text.is_empty() { number(bar.value, 2) } else { bar.text.clone() };
            let at = (behind + px(5.0), (top + low) / 2);
            area.draw(&Text::new(text, at, words(Ink::Text, HPos::Left, VPos::Center)))?;
            y += px(BAR + 3.0);
        }
        y += px(5.0);
    }
    let axis = vec![(left, px(2.0)), (left, bottom)];
    area.draw(&PathElement::new(axis, stroke(Ink::Axis.color(), 1.0)))?;
    let corner = (right, height as i32 - px(1.0));
    let label = match scale {
        Scale::Percent => x_label.to_owned(),
        Scale::NoiseMultiples => format!("{x_label} (logarithmic)"),
    };
    area.draw(&Text::new(label, corner, words(Ink::Text, HPos::Right, VPos::Bottom)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_label_breaks_between_words() {
        let label = "gauge_nonlinearity + muscle_hysteresis + pressure_crosstalk";
        let lines = label_lines(label);
        assert_eq!(lines, ["gauge_nonlinearity + muscle_hysteresis +", "pressure_crosstalk"]);
        assert_eq!(label_lines("short"), ["short"]);
    }
}

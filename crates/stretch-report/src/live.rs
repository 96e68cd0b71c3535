//! The data of a figure for the script of a page, as compact JSON.
//!
//! A curve is given on an even grid of time, once over the whole recording and once on a finer grid around the first
//! view. If a slot of the grid contains several samples, its two values are the smallest and the greatest of them in
//! the order of time, so that no peak is lost. A value is `o` plus an integer times `q`. Each integer is stored as
//! the difference from the previous one.

use std::ops::Range;

use serde::Serialize;
use stretch_core::label::is_hidden;

use super::{canvas::STEPS, thin::extent, time_figure::TimePlot};

/// Slots over a whole recording.
const COARSE: usize = 600;
/// Slots around the first view.
const FINE: usize = 800;
/// Number of quantisation steps over the span of a curve.
const FINENESS: f64 = 2000.0;

/// A curve on an even grid.
#[derive(Debug, Serialize)]
pub(crate) struct Packed {
    t: f64,
    dt: f64,
    o: f64,
    q: f64,
    d: Vec<Option<i64>>,
}

/// A curve with its appearance.
#[derive(Debug, Serialize)]
struct Series<'a> {
    name: &'a str,
    ink: &'static str,
    w: f64,
    levels: Vec<Packed>,
}

/// The condition by which the samples of a bar are selected.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Pick {
    /// The key that is compared: `level`, `rate` or `time`.
    pub(crate) by: &'static str,
    /// Smallest value of the key.
    pub(crate) from: f64,
    /// Greatest value of the key.
    pub(crate) to: f64,
    /// Whether magnitudes are compared, without the sign.
    pub(crate) size: bool,
}

/// A plot over time as JSON; `None` without a link or a span of time.
pub(crate) fn time_json(plot: &TimePlot<'_>) -> Option<String> {
    let span = extent(plot.time.iter().copied()).filter(|s| s.end > s.start)?;
    if plot.link.is_empty() {
        return None;
    }
    let levels = |values: &[f64]| levels(plot.time, values, [&span, &plot.view], ends);
    let lines = if plot.is_whole { &[][..] } else { &plot.lines[..] };
    let series: Vec<Series<'_>> = lines
        .iter()
        .map(|(name, ink, w, y)| Series { name, ink: ink.class(), w: *w, levels: levels(y) })
        .collect();
    let keys: serde_json::Map<_, _> = plot
        .keys
        .iter()
        .map(|(key, values)| ((*key).to_owned(), serde_json::json!(levels(values))))
        .collect();
    let figure = serde_json::json!({
        "kind": "time",
        "link": plot.link,
        "x": plot.labels[0],
        "y": plot.labels[1],
        "unit": plot.unit,
        "height": plot.height,
        "span": [span.start, span.end],
        "view": [plot.view.start, plot.view.end],
        "all": plot.is_whole,
        "series": series,
        "keys": keys,
        "moves": plot.moves,
    });
    Some(figure.to_string())
}

/// Change of a curve with a varied parameter, on the grids of the curve.
pub(crate) fn change(time: &[f64], values: &[f64], view: &Range<f64>) -> Vec<Packed> {
    let span = extent(time.iter().copied()).unwrap_or(0.0..0.0);
    levels(time, values, [&span, view], mean)
}

/// A function from the samples of a slot to the slot's two values.
type SlotValues = fn(&[(f64, f64)]) -> Option<[f64; 2]>;

/// The least and the greatest sample of a slot, in the order of time.
fn ends(part: &[(f64, f64)]) -> Option<[f64; 2]> {
    let real = || part.iter().filter(|p| p.1.is_finite());
    let low = real().min_by(|a, b| a.1.total_cmp(&b.1))?;
    let high = real().max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(if low.0 <= high.0 { [low.1, high.1] } else { [high.1, low.1] })
}

/// Returns the mean of a slot's samples twice, because a change of the parameter changes both
/// values of the slot.
fn mean(part: &[(f64, f64)]) -> Option<[f64; 2]> {
    let mean = part.iter().map(|p| p.1).sum::<f64>() / part.len() as f64;
    mean.is_finite().then_some([mean; 2])
}

/// A curve over the whole recording, and over the view with half its width on either side.
fn levels(
    time: &[f64],
    values: &[f64],
    [span, view]: [&Range<f64>; 2],
    of_slot: SlotValues,
) -> Vec<Packed> {
    let half = 0.5 * (view.end - view.start);
    let around = (view.start - half).max(span.start)..(view.end + half).min(span.end);
    let whole = packed(time, values, span, COARSE, of_slot);
    let fine = packed(time, values, &around, FINE, of_slot);
    let is_finer = fine.dt < 0.99 * whole.dt;
    [Some(whole), is_finer.then_some(fine)].into_iter().flatten().collect()
}

/// The samples inside a window, at no more than `2 slots` places.
fn packed(
    time: &[f64],
    values: &[f64],
    window: &Range<f64>,
    slots: usize,
    of_slot: SlotValues,
) -> Packed {
    let inside: Vec<(f64, f64)> = time
        .iter()
        .copied()
        .zip(values.iter().copied())
        .filter(|(t, _)| *t >= window.start && *t <= window.end)
        .collect();
    let span = window.end - window.start;
    let few = inside.len() <= 2 * slots;
    let (t, dt, values_at) = if few {
        let dt = span / inside.len().saturating_sub(1).max(1) as f64;
        let mut values_at = vec![None; inside.len().max(1)];
        for (t, y) in &inside {
            let at = ((t - window.start) / dt).round() as usize;
            if let Some(place) = values_at.get_mut(at) {
                *place = Some(*y);
            }
        }
        (window.start, dt, values_at)
    } else {
        let width = span / slots as f64;
        let slot = |t: f64| (((t - window.start) / width) as usize).min(slots - 1);
        let mut values_at = vec![None; 2 * slots];
        for part in inside.chunk_by(|a, b| slot(a.0) == slot(b.0)) {
            if let Some(pair) = of_slot(part) {
                let at = 2 * slot(part[0].0);
                (values_at[at], values_at[at + 1]) = (Some(pair[0]), Some(pair[1]));
            }
        }
        (window.start + 0.25 * width, 0.5 * width, values_at)
    };
    steps(t, dt, &values_at)
}

/// Quantises values, and encodes each as the difference from the value before.
fn steps(t: f64, dt: f64, values: &[Option<f64>]) -> Packed {
    let real = values.iter().flatten().copied().filter(|y| y.is_finite());
    let span = extent(real).unwrap_or(0.0..0.0);
    let q = ((span.end - span.start) / FINENESS).max(f64::MIN_POSITIVE);
    let mut last = 0;
    let mut step = |value: &Option<f64>| {
        let at = ((value.filter(|y| y.is_finite())? - span.start) / q).round() as i64;
        Some(at - std::mem::replace(&mut last, at))
    };
    Packed { t, dt, o: span.start, q, d: values.iter().map(&mut step).collect() }
}

/// One row of a bar figure, with its place and its texts.
#[derive(Debug, Serialize)]
pub(crate) struct BarRow {
    /// Label of the row.
    pub(crate) label: String,
    /// Upper end of the row, in steps of the drawing.
    pub(crate) top: i32,
    /// Lower end of the row, in steps of the drawing.
    pub(crate) bottom: i32,
    /// Values of the row as text.
    pub(crate) text: String,
    /// Samples that belong to the row.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) pick: Option<Pick>,
}

/// The rows of a bar figure as JSON.
pub(crate) fn bars_json(link: &str, rows: &[BarRow]) -> String {
    serde_json::json!({"kind": "bars", "link": link, "rows": rows}).to_string()
}

/// One panel of a scatter, in steps of the drawing.
#[derive(Debug, Serialize)]
pub(crate) struct Panel {
    top: f64,
    bottom: f64,
    left: f64,
    right: f64,
    y: [f64; 2],
    name: String,
}

impl Panel {
    /// A panel of [`super::figure::plot`] between `top` and `bottom`, in pixels.
    pub(crate) fn new(name: String, [top, bottom]: [u32; 2], is_bare: bool, y: [f64; 2]) -> Self {
        let steps = |pixels: u32| f64::from(pixels * STEPS);
        let below = if is_bare { 28 } else { 42 };
        Self {
            top: steps(top + 24),
            bottom: steps(bottom - below),
            left: steps(52),
            right: steps(400 - 14),
            y,
            name,
        }
    }
}

/// Returns a scatter plot as JSON. `by` is the key by which a brush (a drag over the plot) picks samples.
pub(crate) fn scatter_json(
    link: &str,
    by: Option<&str>,
    x: &Range<f64>,
    [x_name, x_unit, y_unit]: [&str; 3],
    panels: &[Panel],
) -> String {
    serde_json::json!({
        "kind": "scatter",
        "link": link,
        "x": [x.start, x.end],
        "xname": x_name,
        "xunit": x_unit,
        "yunit": y_unit,
        "by": by,
        "panels": panels,
    })
    .to_string()
}

/// JSON for embedding in a page, with markup characters escaped, so that no name can end the element.
pub(crate) fn embedded(json: &str) -> String {
    let mut safe = String::with_capacity(json.len());
    for c in json.chars() {
        match c {
            '<' | '>' | '&' => safe.push_str(&format!("\\u{:04x}", u32::from(c))),
            c if c.is_control() => safe.push('\u{fffd}'),
            // a reader of the JSON gets the name as shown on the page
            c if is_hidden(c) => safe.push_str(&format!("\\\\u{:04x}", u32::from(c))),
            c => safe.push(c),
        }
    }
    safe
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unpacked(packed: &Packed) -> Vec<Option<f64>> {
        let mut at = 0;
        let one = |d: &Option<i64>| {
            at += (*d)?;
            Some(packed.o + packed.q * at as f64)
        };
        packed.d.iter().map(one).collect()
    }

    #[test]
    fn peaks_and_holes_outlive_the_packing() {
        let time: Vec<f64> = (0..40_000).map(|i| f64::from(i) * 0.005).collect();
        let mut values: Vec<f64> = time.iter().map(|t| t.sin()).collect();
        values[12_345] = 7.0;
        values[20_000..30_000].fill(f64::NAN);
        let packed = packed(&time, &values, &(0.0..199.995), 600, ends);
        let shown = unpacked(&packed);
        assert_eq!(shown.len(), 1200);
        let most = shown.iter().flatten().copied().fold(f64::MIN, f64::max);
        assert!((most - 7.0).abs() <= packed.q);
        let at = shown.iter().position(|y| y.is_some_and(|y| y > 6.0)).unwrap();
        assert!((packed.t + packed.dt * at as f64 - time[12_345]).abs() <= 2.0 * packed.dt);
        assert!(shown[700..800].iter().all(Option::is_none));
    }

    #[test]
    fn few_samples_are_told_one_by_one() {
        let time: Vec<f64> = (0..100).map(|i| 2.0 + f64::from(i) * 0.01).collect();
        let values: Vec<f64> = (0..100).map(|i| f64::from(i * i)).collect();
        let packed = packed(&time, &values, &(2.0..2.99), 800, ends);
        let shown = unpacked(&packed);
        assert_eq!(shown.len(), 100);
        assert!(shown.iter().zip(&values).all(|(a, b)| (a.unwrap() - b).abs() <= packed.q));
    }

    #[test]
    fn no_name_ends_the_data() {
        let json = bars_json(
            "x",
            &[BarRow {
                label: "</script><b>&".into(),
                top: 0,
                bottom: 1,
                text: String::new(),
                pick: None,
            }],
        );
        let safe = embedded(&json);
        assert!(!safe.contains(['<', '>', '&']));
        let read: serde_json::Value = serde_json::from_str(&safe).unwrap();
        assert_eq!(read["rows"][0]["label"], "</script><b>&");
    }
}

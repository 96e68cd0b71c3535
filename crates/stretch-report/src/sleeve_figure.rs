//! Figures of sensors that are put on again: what each channel carries, and the error against seconds of reference.

use plotters::prelude::*;
use stretch_calibrate::{Carried, Expected};

use super::{
    bar_figure::{Bar, Row, Scale, bar_figure},
    canvas::Ink,
    figure::{Axes, Figure, FigureSize, dot, plot, px, stroke},
    plain::number,
};

/// Errors by channel as an SVG file: of each channel alone, of all others, and of all together, on data left out.
///
/// ```
/// use stretch_calibrate::Carried;
/// let channel = |name: &str| Carried {
///     signal: name.into(),
///     rmse_alone: Some(4.0),
///     rmse_without: Some(3.0),
///     adds: Some(0.5),
/// };
/// let svg = stretch_report::channels_figure(&[channel("s1"), channel("s2")], 2.0, "deg");
/// assert!(svg.starts_with("<svg") && svg.contains("s2") && svg.contains("4.000 deg"));
/// ```
pub fn channels_figure(carried: &[Carried], together: f64, unit: &str) -> String {
    let errors = carried.iter().flat_map(|c| [c.rmse_alone, c.rmse_without]).flatten();
    let most = errors.fold(together, f64::max).max(f64::MIN_POSITIVE);
    let bar = |ink: Ink, error: f64| Bar {
        text: format!("{} {unit}", number(error)),
        ..Bar::new(ink, error / most)
    };
    let mut rows: Vec<Row> = carried
        .iter()
        .map(|c| {
            let bars = [
                c.rmse_alone.map(|e| bar(Ink::of(0), e)),
                c.rmse_without.map(|e| bar(Ink::of(1), e)),
            ];
            Row { label: c.signal.clone(), bars: bars.into_iter().flatten().collect() }
        })
        .collect();
    rows.push(Row { label: "all together".into(), bars: vec![bar(Ink::of(2), together)] });
    let legend = [(Ink::of(0), "alone"), (Ink::of(1), "all others"), (Ink::of(2), "all")];
    bar_figure("Errors by channel", &rows, Scale::Percent, "RMSE, % of the greatest")
        .legend(legend.map(|(ink, name)| (ink, name.to_owned())))
        .standalone()
}

/// What a prior errs by against seconds of reference, as an SVG file: for wearers that it has seen and for new ones.
///
/// ```
/// use stretch_calibrate::{ErrorSpread, Expected};
/// let after = |seconds: f64, rmse: f64| Expected {
///     seconds,
///     rmse_known: Some(rmse),
///     rmse_new: Some(2.0 * rmse),
///     spread_known: ErrorSpread::NORMAL,
///     spread_new: ErrorSpread::NORMAL,
/// };
/// let svg = stretch_report::seconds_figure(&[after(0.0, 4.0), after(60.0, 2.0)], "deg").unwrap();
/// assert!(svg.contains("seconds of reference") && svg.contains("RMSE, deg"));
/// assert!(stretch_report::seconds_figure(&[], "deg").is_none());
/// ```
pub fn seconds_figure(expected: &[Expected], unit: &str) -> Option<String> {
    let line = |of: fn(&Expected) -> Option<f64>| -> Vec<(f64, f64)> {
        expected.iter().filter_map(|e| Some((e.seconds, of(e)?))).collect()
    };
    let lines = [line(|e| e.rmse_known), line(|e| e.rmse_new)];
    let points = lines.iter().flatten();
    let (x, y) = points.fold((0.0, 0.0), |(x, y), p| (f64::max(x, p.0), f64::max(y, p.1)));
    if !(x > 0.0 && y > 0.0) {
        return None;
    }
    let y_label = if unit.is_empty() { "RMSE".to_owned() } else { format!("RMSE, {unit}") };
    let axes = Axes::new(0.0..1.03 * x, 0.0..1.08 * y, ["seconds of reference", &y_label]);
    let legend = [(Ink::of(0), "wearer seen before"), (Ink::of(1), "new wearer")];
    let figure = Figure::new("Error against seconds of reference, on sessions left out")
        .draw(FigureSize { width: 560, height: 320 }, |area| {
            plot(area, &axes, |chart| {
                for (i, line) in lines.iter().enumerate() {
                    let ink = Ink::of(i);
                    chart.draw_series(LineSeries::new(line.clone(), stroke(ink.color(), 2.0)))?;
                    let dots = line.iter().map(|&at| Circle::new(at, px(3.5), dot(ink, 1.0)));
                    chart.draw_series(dots)?;
                }
                Ok(())
            })
        })
        .legend(legend.map(|(ink, name)| (ink, name.to_owned())));
    Some(figure.standalone())
}

//! The residual over each parameter of an effect, and the data with which the page's script lets a reader vary the
//! parameter.

use std::ops::Range;

use plotters::prelude::*;
use serde::Serialize;
use stretch_gap::{Answered, Response, Responses};
use stretch_problem::effect_in_words;

use super::{
    bar_figure::GAP,
    canvas::Ink,
    figure::{Area, Axes, Drawn, Figure, FigureSize, plot, px, stroke},
    gap_figures::{AFTER, Shown},
    live::{Packed, Panel, change},
    markup::{labelled, shown_unit},
    subject::Subject,
    thin::{extent, padded},
};

/// Height of a panel, pixels.
const PANEL: u32 = 165;

/// A parameter of an effect.
#[derive(Debug, Serialize)]
struct Turned {
    name: String,
    unit: String,
    at: f64,
    values: Vec<f64>,
    out: Vec<Vec<Packed>>,
    left: Vec<Vec<Packed>>,
    x: [f64; 2],
    panel: Panel,
}

/// The residual on the test trials over every parameter, one panel each; `None` where no parameter can be varied.
pub(crate) fn turn_figure(subject: &Subject<'_>, stage: usize, shown: &Shown) -> Option<Figure> {
    let responses = subject.evidence.responses.as_ref().filter(|r| r.stage == stage)?;
    let curves = curves(responses);
    let of_all = extent(curves.iter().flatten().map(|p| p.1))?;
    let y = padded(&(of_all.start.min(1.0)..of_all.end), 0.06);
    let spans: Vec<Range<f64>> = curves
        .iter()
        .filter_map(|curve| extent(curve.iter().map(|p| p.0)).map(|span| padded(&span, 0.03)))
        .collect();
    let turned: Vec<Turned> = (0_u32..)
        .zip(&responses.parameters)
        .zip(&spans)
        .map(|((i, one), x)| {
            let panel = [i * PANEL, (i + 1) * PANEL];
            let packed = |of: fn(&Answered) -> &[f64]| {
                let part = |answer| {
                    change(&shown.time_s, &of(answer)[shown.samples.clone()], &shown.window)
                };
                one.answers.iter().map(part).collect()
            };
            Turned {
                name: named(one, subject),
                unit: shown_unit(&one.unit).to_owned(),
                at: one.fitted,
                values: one.answers.iter().map(|answer| answer.value).collect(),
                out: packed(|answer| &answer.output),
                left: packed(|answer| &answer.residual),
                x: [x.start, x.end],
                panel: Panel::new(String::new(), panel, false, [y.start, y.end]),
            }
        })
        .collect();
    let spec = &subject.simulator.stages()[stage];
    let live = serde_json::json!({
        "kind": "turn",
        "link": GAP,
        "ink": AFTER.class(),
        "unit": spec.unit,
        "noise": subject.evidence.stages[stage].noise,
        "products": responses.products,
        "parameters": turned,
    });
    let frame = FigureSize { width: 400, height: PANEL * responses.parameters.len() as u32 };
    let figure = Figure::new("Remaining error on the test trials against each effect parameter")
        .draw(frame, |area| {
            let mut rest = area.clone();
            for ((one, curve), x) in responses.parameters.iter().zip(&curves).zip(&spans) {
                let (here, below) = rest.split_vertically(px(f64::from(PANEL)));
                rest = below;
                draw(&here, (one, &short(&named(one, subject))), curve, [x, &y])?;
            }
            Ok(())
        })
        .live(live.to_string());
    Some(figure)
}

fn draw(
    area: &Area<'_>,
    (one, name): (&Response, &str),
    curve: &[(f64, f64)],
    [x, y]: [&Range<f64>; 2],
) -> Drawn {
    let labels =
        [&*labelled(name, shown_unit(&one.unit)), "remaining error, multiples of the noise"];
    let axes = Axes::new(x.clone(), y.clone(), labels);
    plot(area, &axes, |chart| {
        let floor = [(x.start, 1.0), (x.end, 1.0)];
        chart.draw_series(LineSeries::new(floor, stroke(Ink::Axis.color(), 1.0)))?;
        chart.draw_series(LineSeries::new(curve.iter().copied(), stroke(AFTER.color(), 2.0)))?;
        let fitted = curve.iter().filter(|p| p.0 == one.fitted).copied();
        chart.draw_series(fitted.map(|at| Circle::new(at, px(4.0), AFTER.faint(1.0).filled())))?;
        Ok(())
    })
}

/// For each parameter, its values (the fitted value among them) and the root mean square of the residual at each
/// value, in multiples of the noise.
fn curves(responses: &Responses) -> Vec<Vec<(f64, f64)>> {
    let products = &responses.products;
    let all = products[0][0];
    let mut k = 0;
    let of = |one: &Response| {
        let mut curve = vec![(one.fitted, all.max(0.0).sqrt())];
        for answer in &one.answers {
            k += 1;
            let left = all - 2.0 * products[0][k] + products[k][k];
            curve.push((answer.value, left.max(0.0).sqrt()));
        }
        curve.sort_by(|a, b| a.0.total_cmp(&b.0));
        curve
    };
    responses.parameters.iter().map(of).collect()
}

/// Number of characters of an effect's title that fit below a panel.
const TITLE: usize = 36;

/// Returns the name of a parameter with a shortened title of its effect, if the title is wider than a panel.
fn short(name: &str) -> String {
    match name.rsplit_once(": ") {
        Some((title, parameter)) if title.chars().count() > TITLE => {
            let title: String = title.chars().take(TITLE - 1).collect();
            format!("{}…: {parameter}", title.trim_end())
        }
        _ => name.to_owned(),
    }
}

fn named(one: &Response, subject: &Subject<'_>) -> String {
    format!("{}: {}", effect_in_words(&one.effect, subject.diagnosis), one.name)
}

//! The report of a prediction: new recordings, measured and simulated with and without a fix of the
//! simulator.

use std::ops::Range;

use stretch_problem::{PredictedOutput, Prediction};

use super::{
    canvas::Ink,
    figure::Figure,
    gap_figures::{AFTER, BEFORE, worst_window},
    markup::{labelled, number},
    page::{Page, Table},
    time_figure::TimePlot,
};

/// The report as a page.
pub fn predict_page(prediction: &Prediction) -> String {
    let mut page = Page::new(&format!("Predicted: {}", prediction.name), &prediction.sentence());
    page.facts(&[
        ("Effects of the fix", prediction.effects_in_words().join(", ")),
        ("Error with the fix / without it", number(prediction.ratio, 3)),
        (
            "Largest root mean square error",
            format!("{} times the noise", number(prediction.largest_times_noise, 3)),
        ),
    ]);
    page.list(&prediction.notes);
    page.section(
        "Errors of the prediction",
        "Root mean square errors on recordings that were not fitted. Without: the simulator with re-tuned parameters and without the fix. The fix helps if the ratio is below 1.",
    );
    page.table(&predict_table(prediction));
    for trial in &prediction.trials {
        let intro = match trial.extrapolated.is_empty() {
            true => "The whole recording lies within the ranges that were fitted.",
            false => {
                "Parts are outside the ranges that were fitted: do not trust the prediction there."
            }
        };
        page.section(&trial.name, intro);
        page.list(&trial.extrapolated);
        for output in &trial.outputs {
            let whole = 0.0..trial.seconds;
            let caption = format!("{}: the whole recording.", output.stage);
            page.figure(&traces(prediction, output, &whole), &caption);
            let pairs = output.measured.iter().zip(&output.without);
            let error: Vec<f64> = pairs.map(|(m, p)| m - p).collect();
            let look = worst_window(&error, prediction.dt_s);
            if let Some(look) = look.filter(|look| 2 * look.len() < error.len()) {
                let [from, to] = [look.start, look.end].map(|i| i as f64 * prediction.dt_s);
                let caption = format!(
                    "{}: the largest error of the simulator without the fix.",
                    output.stage
                );
                page.figure(&traces(prediction, output, &(from..to)), &caption);
            }
        }
    }
    page.finish()
}

/// Errors of every output of every recording.
pub fn predict_table(prediction: &Prediction) -> Table {
    let head = ["recording", "output", "unit", "with", "without", "ratio", "times noise"];
    let rows = prediction.trials.iter().flat_map(|trial| {
        trial.outputs.iter().map(|o| {
            let numbers = [o.rmse, o.rmse_without, o.ratio, o.times_noise].map(|x| number(x, 3));
            let texts = [trial.name.clone(), o.column.clone(), o.unit.clone()];
            texts.into_iter().chain(numbers).collect::<Vec<String>>()
        })
    });
    Table::new("Root mean square errors of the prediction", &head, rows)
}

fn traces(prediction: &Prediction, output: &PredictedOutput, drawn: &Range<f64>) -> Figure {
    let time: Vec<f64> = (0..output.measured.len()).map(|i| i as f64 * prediction.dt_s).collect();
    let with = format!("predicted with {}", prediction.effects_in_words().join(" and "));
    let name = labelled(&output.column, &output.unit);
    let plot = TimePlot {
        link: "",
        labels: ["time in the recording, s", &name],
        unit: &output.unit,
        height: 280,
        time: &time,
        drawn,
        view: drawn.clone(),
        is_whole: false,
        lines: vec![
            ("measured", Ink::Truth, 3.2, &output.measured[..]),
            ("predicted without the fix", BEFORE, 1.5, &output.without[..]),
            (&*with, AFTER, 1.5, &output.with[..]),
        ],
        keys: Vec::new(),
        moves: None,
    };
    let description = format!("{name} over time, measured and predicted");
    plot.figure(&description, "There are no values to draw here.")
}

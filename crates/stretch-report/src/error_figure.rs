//! Errors against rate and reference.

use stretch_calibrate::Evaluation;

use super::{
    canvas::Ink,
    dots_figure::{Dots, Shared, dots_figure},
    figure::Figure,
    markup::labelled,
    thin::{padded, quantile, sorted},
};

/// Largest number of dots of one method.
const DOTS: usize = 720;

/// Number of samples on each side of a sample in the central difference that gives the rate of the
/// reference.
const REACH: usize = 5;

/// The quantity against which errors are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Against {
    /// The rate of the reference, by a central difference over eleven samples.
    Rate,
    /// The reference itself.
    Reference,
}

/// Errors (estimate minus reference) of all trials against `against`, one panel for each method.
pub(crate) fn error_figure(evaluation: &Evaluation, names: &[String], against: Against) -> Figure {
    let methods = points(evaluation, names.len(), against);
    let errors = sorted(methods.iter().flatten().map(|(_, e)| e.abs()));
    let places = sorted(methods.iter().flatten().map(|(x, _)| *x));
    if errors.is_empty() {
        return Figure::missing("There is no error to draw: no sample has both values.");
    }
    let most = 1.05 * quantile(&errors, 0.995).max(f64::MIN_POSITIVE);
    let unit = &evaluation.unit;
    let between = |from, to| quantile(&places, from)..quantile(&places, to);
    let (x, x_label) = match against {
        Against::Rate => (between(0.005, 0.995), per_second(unit)),
        Against::Reference => (padded(&between(0.0, 1.0), 0.02), labelled("reference", unit)),
    };
    let description = format!(
        "Error of {} against {x_label}: dots are samples, the line their median, the band 80 %",
        names.join(", ")
    );
    let (x_name, x_unit) = x_label.rsplit_once(", ").unwrap_or((&x_label, ""));
    let against = Shared {
        x,
        x_label: &x_label,
        names: [x_name, x_unit, unit],
        most,
        dots: DOTS,
        brush: ("", None),
    };
    let panels: Vec<Dots> = (0..)
        .zip(names)
        .zip(methods)
        .map(|((i, name), points)| Dots {
            ink: Ink::of(i),
            name: format!("error of {name}"),
            y_label: labelled(&format!("{name}: error"), unit),
            points,
        })
        .collect();
    dots_figure(&description, &against, &panels)
}

/// Returns, for each method, the abscissa and the error of each sample of all trials.
fn points(evaluation: &Evaluation, methods: usize, against: Against) -> Vec<Vec<(f64, f64)>> {
    let mut all = vec![Vec::new(); methods];
    for trial in &evaluation.trials {
        let places = match against {
            Against::Reference => trial.reference.clone(),
            Against::Rate => rates(&trial.time_s, &trial.reference),
        };
        for (points, estimates) in all.iter_mut().zip(&trial.estimates) {
            let pairs = places.iter().zip(&trial.reference).zip(estimates);
            points.extend(
                pairs
                    .map(|((&x, &truth), &estimate)| (x, estimate - truth))
                    .filter(|(x, e)| x.is_finite() && e.is_finite()),
            );
        }
    }
    all
}

/// Central differences of the reference over eleven samples; NaN at the ends.
pub(crate) fn rates(time_s: &[f64], values: &[f64]) -> Vec<f64> {
    let mut rates = vec![f64::NAN; values.len()];
    let spans = time_s.windows(2 * REACH + 1).zip(values.windows(2 * REACH + 1));
    for (rate, (t, y)) in rates.iter_mut().skip(REACH).zip(spans) {
        *rate = (y[2 * REACH] - y[0]) / (t[2 * REACH] - t[0]);
    }
    rates
}

fn per_second(unit: &str) -> String {
    let unit = if unit.is_empty() { "1" } else { unit };
    format!("rate of the reference, {unit}/s")
}

//! Comparison with the figures of the published method ("the paper"): tables and sentences.

use stretch_calibrate::{Evaluation, FitReport};
use stretch_report::{Table, number};

use super::experiment::Experiment;

/// The published errors of one fit.
#[derive(Clone, Copy)]
pub(super) struct PublishedFit {
    /// Coefficient of determination.
    pub(super) r_squared: f64,
    /// RMSE in percent of normalised strain; `None` for the linear fit.
    rmse_percent: Option<f64>,
}

/// Published errors of a method: the average error in percent, and the RMSE in millimetres. (The paper labels the RMSE
/// as percent.)
struct PublishedErrors {
    average_error_percent: f64,
    rmse_mm: f64,
}

/// Published figures (sections 3.1 to 3.4 of the paper).
pub(super) struct PublishedFigures {
    /// The linear fit.
    pub(super) linear: PublishedFit,
    /// Slope and intercept of the linear fit.
    pub(super) line: (f64, f64),
    /// Fits to inflations: with the next lower order than poly13, with poly13, and with the next
    /// higher order.
    inflation: [PublishedFit; 3],
    /// Fits to deflations: with the next lower order than poly13, with poly13, and with the next
    /// higher order.
    deflation: [PublishedFit; 3],
    /// Errors of the raw signal, the linear and the non-linear calibration on arbitrary actuation.
    arbitrary: [PublishedErrors; 3],
    /// Errors of the raw signal, the linear and the non-linear calibration on pulses.
    pulses: [PublishedErrors; 3],
}

const fn fit(r_squared: f64, rmse_percent: f64) -> PublishedFit {
    PublishedFit { r_squared, rmse_percent: Some(rmse_percent) }
}

const fn errors(average_error_percent: f64, rmse_mm: f64) -> PublishedErrors {
    PublishedErrors { average_error_percent, rmse_mm }
}

/// The published values.
pub(super) const PUBLISHED: PublishedFigures = PublishedFigures {
    linear: PublishedFit { r_squared: 0.9680, rmse_percent: None },
    line: (0.9744, 0.1757),
    inflation: [fit(0.9806, 4.890), fit(0.9934, 2.851), fit(0.9938, 2.765)],
    deflation: [fit(0.9895, 2.467), fit(0.9943, 1.821), fit(0.9945, 1.798)],
    arbitrary: [errors(14.10, 2.169), errors(18.62, 3.807), errors(16.05, 2.777)],
    pulses: [errors(5.180, 0.9266), errors(5.875, 1.845), errors(4.863, 1.550)],
};

/// Trials of one kind: name, errors of the published method here, errors printed in the paper,
/// errors of our method.
type Applied<'a> = (&'static str, &'a Evaluation, &'static [PublishedErrors; 3], &'a Evaluation);

fn applied(experiment: &Experiment) -> [Applied<'_>; 2] {
    let Experiment { published, ours, .. } = experiment;
    [
        ("arbitrary actuation", &published.arbitrary, &PUBLISHED.arbitrary, &ours.arbitrary),
        ("pulses", &published.pulses, &PUBLISHED.pulses, &ours.pulses),
    ]
}

/// Compares each fit with the paper's value and with the fit of our method.
pub(super) fn fit_table(experiment: &Experiment) -> Table {
    let (there, here) = (&experiment.published, &experiment.ours);
    let row = |name: String, a: (f64, f64), paper: PublishedFit, b: (f64, f64)| {
        vec![
            name,
            format!("{:.4}", a.0),
            format!("{:.4}", paper.r_squared),
            number(100.0 * a.1),
            paper.rmse_percent.map_or("-".to_owned(), number),
            format!("{:.4}", b.0),
            number(100.0 * b.1),
        ]
    };
    let whole = |fit: &FitReport| (fit.r_squared, fit.rmse);
    let order = |fit: &FitReport, model: &str| {
        let found = fit.orders.iter().find(|order| order.model == model);
        let value = |x: Option<f64>| x.unwrap_or(f64::NAN);
        found.map_or((f64::NAN, f64::NAN), |o| (value(o.r_squared), value(o.rmse)))
    };
    let mut rows = vec![row(
        "linear".to_owned(),
        whole(&there.linear.fits[0]),
        PUBLISHED.linear,
        whole(&here.linear.fits[0]),
    )];
    let branches = [PUBLISHED.inflation, PUBLISHED.deflation];
    for (branch, paper) in branches.into_iter().enumerate() {
        let (a, b) = (&there.non_linear.fits[branch], &here.non_linear.fits[branch]);
        rows.push(row(format!("{} poly13", a.name), whole(a), paper[1], whole(b)));
        for (model, paper) in [("poly12", paper[0]), ("poly14", paper[2])] {
            rows.push(row(format!("  {model}"), order(a, model), paper, order(b, model)));
        }
    }
    let head = [
        "Fit",
        "R², published method",
        "R², paper",
        "RMSE %, published method",
        "RMSE %, paper",
        "R², ours",
        "RMSE %, ours",
    ];
    Table::new(
        "Fits, normalised: as published, printed in the paper, and with our decisions",
        &head,
        rows,
    )
}

/// Compares the errors of each method, for each kind of trials, with the paper's values and with
/// our method.
pub(super) fn error_tables(experiment: &Experiment) -> [Table; 2] {
    let head = [
        "Method",
        "Error %, published method",
        "Error %, paper",
        "RMSE mm, published method",
        "RMSE mm, paper",
        "Error %, ours",
        "RMSE mm, ours",
    ];
    applied(experiment).map(|(kind, there, paper, here)| {
        let rows = here.pooled.iter().enumerate().map(|(method, ours)| {
            let own = [ours.average_error_percent, ours.rmse].map(number);
            let (name, others) = match there.pooled.get(method).zip(paper.get(method)) {
                Some((a, paper)) => {
                    let average = [a.average_error_percent, paper.average_error_percent];
                    let [a_mm, paper_mm] = [a.rmse, paper.rmse_mm].map(number);
                    let [average, paper_average] = average.map(number);
                    (a.method.clone(), [average, paper_average, a_mm, paper_mm])
                }
                None => {
                    (format!("{} (not in the paper)", ours.method), ["-"; 4].map(str::to_owned))
                }
            };
            [name].into_iter().chain(others).chain(own).collect::<Vec<_>>()
        });
        Table::new(format!("Applied to {kind}"), &head, rows)
    })
}

/// Returns sentences that state which published findings the figures reproduce.
pub(super) fn verdicts(experiment: &Experiment) -> Vec<String> {
    let there = &experiment.published;
    let mut said = Vec::new();
    let mut judge = |agrees: bool, what: String| {
        said.push(format!("{}: {what}", if agrees { "agrees" } else { "does not agree" }));
    };
    let (r2, paper) = (there.linear.fits[0].r_squared, PUBLISHED.linear.r_squared);
    let line = format!("the line explains {r2:.3} of the variance, {paper:.3} in the paper");
    judge((r2 - paper).abs() < 0.01, line);
    let branches = [("inflation", PUBLISHED.inflation[1]), ("deflation", PUBLISHED.deflation[1])];
    for ((name, paper), fit) in branches.into_iter().zip(&there.non_linear.fits) {
        let (rmse, paper) = (100.0 * fit.rmse, paper.rmse_percent.unwrap_or(f64::NAN));
        let surface = format!(
            "the surface of {name} fits with an RMSE of {rmse:.2} %, {paper:.2} % in the paper"
        );
        judge((rmse / paper - 1.0).abs() < 0.35, surface);
    }
    for (kind, evaluation, paper, _) in applied(experiment) {
        let [raw, linear, non_linear] = [0, 1, 2].map(|method| evaluation.pooled[method].rmse);
        let surfaces = format!(
            "on {kind} the surfaces beat the line (RMSE {non_linear:.2} and {linear:.2} mm)"
        );
        judge(non_linear < linear, surfaces);
        judge(
            raw < non_linear.min(linear),
            format!("on {kind} the raw signal has the lowest RMSE ({raw:.2} mm)"),
        );
        let ratios = [raw, linear, non_linear].into_iter().zip(paper);
        let worst =
            ratios.map(|(rmse, paper)| (rmse / paper.rmse_mm).ln().abs()).fold(0.0, f64::max);
        let factor = worst.exp();
        judge(
            worst < 2f64.ln(),
            format!(
                "on {kind} every RMSE is within a factor of two of the published one (at most {factor:.1})"
            ),
        );
    }
    said.push("not to be compared: single coefficients and trial errors, which depend on commands that the paper does not print; several sets of effects come as close as this one".to_owned());
    said
}

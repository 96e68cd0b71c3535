//! The paper's experiment beside the published figures: rows and sentences, for a terminal and a page.

use stretch_calibrate::{Evaluation, FitReport, MethodErrors};
use stretch_report::number;

use super::{
    experiment::Experiment,
    published::{PUBLISHED, PublishedErrors, PublishedFit},
};

/// A fit, what the paper prints, and the same fit with our decisions.
pub(crate) fn fit_rows(experiment: &Experiment) -> Vec<Vec<String>> {
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
    rows
}

/// A method's errors, what the paper prints, and the same with our decisions.
pub(crate) fn error_rows(
    there: &Evaluation,
    paper: &[PublishedErrors; 3],
    here: &Evaluation,
) -> Vec<Vec<String>> {
    let row = |((a, paper), b): ((&MethodErrors, &PublishedErrors), &MethodErrors)| {
        vec![
            a.method.clone(),
            number(a.average_error_percent),
            number(paper.average_error_percent),
            number(a.rmse),
            number(paper.rmse_mm),
            number(b.average_error_percent),
            number(b.rmse),
        ]
    };
    let beside = there.pooled.iter().zip(paper).zip(&here.pooled).map(row);
    // what the paper has not
    let alone = here.pooled[there.pooled.len()..].iter().map(|m| {
        let mut cells = vec![format!("{} (not in the paper)", m.method)];
        cells.extend(std::iter::repeat_n("-".to_owned(), 4));
        cells.extend([number(m.average_error_percent), number(m.rmse)]);
        cells
    });
    beside.chain(alone).collect()
}

/// Plain sentences, each decided by the figures.
pub(crate) fn verdicts(experiment: &Experiment) -> Vec<String> {
    let there = &experiment.published;
    let mut said = Vec::new();
    let mut judge = |holds: bool, agrees: &str, differs: &str| {
        said.push(if holds {
            format!("agrees: {agrees}")
        } else {
            format!("does not agree: {differs}")
        });
    };
    let r2 = there.linear.fits[0].r_squared;
    judge(
        (r2 - PUBLISHED.linear.r_squared).abs() < 0.01,
        &format!(
            "the line explains {r2:.3} of the variance, as in the paper ({:.3})",
            PUBLISHED.linear.r_squared
        ),
        &format!(
            "the line explains {r2:.3} of the variance, {:.3} in the paper",
            PUBLISHED.linear.r_squared
        ),
    );
    let ratios =
        [("inflation", 0, PUBLISHED.inflation[1]), ("deflation", 1, PUBLISHED.deflation[1])].map(
            |(name, i, paper)| {
                let rmse = 100.0 * there.non_linear.fits[i].rmse;
                (name, rmse, paper.rmse_percent.unwrap_or(f64::NAN))
            },
        );
    let text = ratios
        .map(|(name, rmse, paper)| format!("{name} {rmse:.2} % (paper {paper:.2} %)"))
        .join(", ");
    judge(
        ratios.iter().all(|(_, rmse, paper)| (rmse / paper - 1.0).abs() < 0.35),
        &format!("the surfaces fit about as well: RMSE {text}"),
        &format!("the surfaces fit otherwise: RMSE {text}"),
    );
    let rmse = |evaluation: &Evaluation, method: usize| evaluation.pooled[method].rmse;
    for (kind, evaluation, paper) in [
        ("pulses", &there.pulses, PUBLISHED.pulses),
        ("arbitrary actuation", &there.arbitrary, PUBLISHED.arbitrary),
    ] {
        let [raw, linear, non_linear] = [0, 1, 2].map(|m| rmse(evaluation, m));
        judge(
            non_linear < linear,
            &format!(
                "on {kind} the surfaces beat the line ({non_linear:.2} against {linear:.2} mm)"
            ),
            &format!(
                "on {kind} the line beats the surfaces ({linear:.2} against {non_linear:.2} mm)"
            ),
        );
        judge(
            raw < non_linear.min(linear),
            &format!("on {kind} the raw signal has the lowest RMSE ({raw:.2} mm)"),
            &format!("on {kind} the raw signal does not have the lowest RMSE ({raw:.2} mm)"),
        );
        let worst =
            (0..3).map(|m| (rmse(evaluation, m) / paper[m].rmse_mm).ln().abs()).fold(0.0, f64::max);
        judge(
            worst < 2f64.ln(),
            &format!("on {kind} every RMSE is within a factor of two of the published one"),
            &format!(
                "on {kind} an RMSE is off from the published one by a factor of {:.1}",
                worst.exp()
            ),
        );
    }
    said.push("not to be compared: single coefficients and trial errors, which depend on commands that the paper does not print; several sets of effects come as close as this one".to_owned());
    said
}

//! The tables of a calibration's report.

use stretch_calibrate::{Calibrated, Candidate, Comparison, Evaluation, FitReport, MethodErrors};
use stretch_core::Model;

use super::{
    markup::{NONE, fixed, labelled, number, with_unit},
    page::Table,
};

/// Name that an evaluation gives to the signal without a calibration.
pub(crate) const RAW: &str = "raw";

fn optional(x: Option<f64>, digits: usize) -> String {
    x.map_or_else(|| NONE.to_owned(), |x| number(x, digits))
}

/// Names of an evaluation's methods on the page.
pub(crate) fn method_names(
    calibrated: &[(&str, &Calibrated)],
    evaluation: &Evaluation,
) -> Vec<String> {
    let name = |method: &str| {
        let found = calibrated.iter().find(|(name, _)| *name == method);
        match found.map(|(_, c)| &c.calibration.spec().model) {
            Some(Model::Surfaces { .. }) if !method.contains("linear") => {
                format!("non-linear ({method})")
            }
            Some(_) if method.is_empty() => "linear".to_owned(),
            _ => method.to_owned(),
        }
    };
    evaluation.pooled.iter().map(|errors| name(&errors.method)).collect()
}

/// Returns the calibration with the least RMSE. The raw signal is left out, because its scale comes from the reference.
pub(crate) fn best(methods: &[MethodErrors]) -> Option<usize> {
    let finite = methods.iter().enumerate().filter(|(_, m)| m.rmse.is_finite() && m.method != RAW);
    finite.min_by(|a, b| a.1.rmse.total_cmp(&b.1.rmse)).map(|(i, _)| i)
}

/// The paper's measures, one row for each method.
pub fn method_table(
    caption: &str,
    methods: &[MethodErrors],
    names: &[String],
    unit: &str,
) -> Table {
    let rmse = labelled("RMSE", unit);
    let bias = labelled("Bias", unit);
    let largest = with_unit("Largest error,", unit);
    let head = [
        "Method",
        "Average error, %",
        &rmse,
        "RMSE, % of range",
        &bias,
        "R\u{b2}",
        "Lag, ms",
        largest.trim_end_matches(','),
        "Outside domain, %",
    ];
    let row = |(m, name): (&MethodErrors, &String)| {
        let outside = 100.0 * m.clamped as f64 / (m.samples.max(1)) as f64;
        // The mean error of a least-squares fit is a rounding error.
        let bias = if m.bias.abs() < 1e-9 * m.rmse { 0.0 } else { m.bias };
        vec![
            name.clone(),
            fixed(m.average_error_percent, 2),
            number(m.rmse, 3),
            fixed(m.rmse_percent, 2),
            number(bias, 3),
            fixed(m.r_squared, 3),
            m.lag_s.map_or_else(|| NONE.to_owned(), |lag| fixed(1e3 * lag, 0)),
            number(m.max, 3),
            fixed(outside, 1),
        ]
    };
    Table::new(caption, &head, methods.iter().zip(names).map(row)).highlight(best(methods))
}

/// Paired tests between methods.
pub fn comparison_table(
    comparisons: &[Comparison],
    unit: &str,
    called: impl Fn(&str) -> String,
) -> Table {
    let probability = |p: Option<f64>| match p {
        Some(p) if p < 1e-300 => "< 1e\u{2212}300".to_owned(),
        Some(p) if p < 1e-4 => number(p, 1),
        Some(p) => number(p, 2),
        None => NONE.to_owned(),
    };
    let row = |c: &Comparison| {
        let interval = c.interval_95.map_or_else(
            || NONE.to_owned(),
            |(low, high)| format!("{} \u{2026} {}", number(low, 3), number(high, 3)),
        );
        vec![
            format!("{} less {}", called(&c.first), called(&c.second)),
            number(c.mean_difference, 3),
            interval,
            probability(c.p_blocks),
            c.blocks.to_string(),
            probability(c.p_samples),
        ]
    };
    let caption = with_unit("Difference of absolute errors, paired t test; unit:", unit);
    let head = ["Difference", "Mean", "95 % interval", "P, blocks", "Blocks", "P, samples"];
    Table::new(caption.trim_end_matches("; unit:"), &head, comparisons.iter().map(row))
}

/// Candidate signals, best first.
pub fn signal_table(candidates: &[Candidate]) -> Table {
    let row = |c: &Candidate| {
        let percent = c.cross_validated_rmse.map(|rmse| 100.0 * rmse);
        let text = c.problem.clone().unwrap_or_else(|| optional(percent, 3));
        vec![c.signal.clone(), text]
    };
    let head = ["Signal", "Cross-validated RMSE, % of range"];
    Table::new("Candidate signals, best first", &head, candidates.iter().map(row))
        .highlight((!candidates.is_empty()).then_some(0))
}

/// The fitted order with its neighbours.
pub fn order_table(fit: &FitReport) -> Table {
    let row = |o: &stretch_calibrate::Order| {
        let mut remarks = Vec::new();
        if o.model == fit.model {
            remarks.push("fitted");
        }
        if fit.recommended.as_ref() == Some(&o.model) {
            remarks.push("recommended");
        }
        remarks.extend(o.problem.as_deref());
        vec![
            o.model.clone(),
            o.terms.to_string(),
            o.r_squared.map_or_else(|| NONE.to_owned(), |r| fixed(r, 4)),
            optional(o.rmse, 3),
            optional(o.cross_validated_rmse, 3),
            remarks.join(", "),
        ]
    };
    let caption = format!("Orders, {}; errors in normalised target", fit.name);
    let head = ["Order", "Terms", "R\u{b2}", "Residual SD", "RMSE, left out", "Remarks"];
    let best = fit.orders.iter().position(|o| Some(&o.model) == fit.recommended.as_ref());
    Table::new(caption, &head, fit.orders.iter().map(row)).highlight(best)
}

/// Coefficients with their bounds.
pub(crate) fn coefficient_table(fit: &FitReport) -> Table {
    let row = |c: &stretch_calibrate::Coefficient| {
        let power = |name: &str, power: u8| match power {
            0 => String::new(),
            1 => name.to_owned(),
            2 => format!("{name}\u{b2}"),
            3 => format!("{name}\u{b3}"),
            n => format!("{name}^{n}"),
        };
        let (r, v) = (power("r", c.rate_power), power("v", c.signal_power));
        let term = if r.is_empty() && v.is_empty() { "1".to_owned() } else { format!("{r}{v}") };
        vec![c.name.clone(), term, number(c.estimate, 4), number(c.lower, 4), number(c.upper, 4)]
    };
    let caption = format!(
        "Coefficients, {} ({}): {} samples, R\u{b2} {}, residual SD {} in normalised target",
        fit.name,
        fit.model,
        fit.samples,
        fixed(fit.r_squared, 4),
        number(fit.rmse, 3)
    );
    let head = ["Name", "Multiplies", "Estimate", "Lower, 95 %", "Upper, 95 %"];
    Table::new(caption, &head, fit.coefficients.iter().map(row))
}

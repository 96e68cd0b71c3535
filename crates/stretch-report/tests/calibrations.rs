//! Reports of calibrations and predictions, built from values.

use stretch_calibrate::{Candidate, Comparison, Evaluation, MethodErrors, TrialErrors};
use stretch_problem::{PredictedOutput, PredictedTrial, Prediction};
use stretch_report::{Context, Judged, calibration_page, predict_page};

use crate::support::{first_seconds, is_snapshot, text};

fn errors(method: &str, rmse: f64) -> MethodErrors {
    MethodErrors {
        method: method.into(),
        samples: 4000,
        withheld: 12,
        clamped: 80,
        rmse,
        rmse_percent: 1.25 * rmse,
        average_error_percent: rmse,
        average_error_percent_of_reference: 1.1 * rmse,
        signed_error_percent: -0.1 * rmse,
        bias: -0.08 * rmse,
        mae: 0.8 * rmse,
        max: 3.0 * rmse,
        r_squared: 1.0 - 0.01 * rmse,
        lag_s: (method != "raw").then_some(0.012 * rmse),
    }
}

fn trial(name: &str, pooled: &[MethodErrors]) -> TrialErrors {
    let time_s: Vec<f64> = (0..1500).map(|i| 0.01 * f64::from(i)).collect();
    let reference: Vec<f64> = time_s.iter().map(|t| 40.0 - 30.0 * (1.1 * t).cos()).collect();
    let estimate = |i: usize| reference.iter().map(|x| x + 0.5 / (i + 1) as f64).collect();
    TrialErrors {
        trial: name.into(),
        methods: pooled.to_vec(),
        estimates: (0..pooled.len()).map(estimate).collect(),
        rates: vec![time_s.iter().map(|t| 33.0 * (1.1 * t).sin()).collect(); pooled.len()],
        signal: reference.iter().map(|x| 1.0 + 0.01 * x).collect(),
        time_s,
        reference,
    }
}

/// Methods with their errors, on trials; the trial `monday` was fitted.
fn evaluation(methods: &[(&str, f64)], trials: &[&str]) -> Evaluation {
    let pooled: Vec<MethodErrors> =
        methods.iter().map(|(method, rmse)| errors(method, *rmse)).collect();
    let comparison = |pair: &[MethodErrors]| Comparison {
        first: pair[0].method.clone(),
        second: pair[1].method.clone(),
        mean_difference: 0.8 * (pair[0].rmse - pair[1].rmse),
        p_samples: Some(0.0),
        p_blocks: Some(3.2e-7),
        blocks: 80,
        interval_95: Some((0.1, 1.9)),
    };
    Evaluation {
        unit: "deg".into(),
        trials: trials.iter().map(|name| trial(name, &pooled)).collect(),
        comparisons: pooled.windows(2).map(comparison).collect(),
        pooled,
    }
}

fn page(evaluation: &Evaluation) -> String {
    let candidate = |signal: &str, rmse, problem: Option<&str>| Candidate {
        signal: signal.into(),
        cross_validated_rmse: rmse,
        problem: problem.map(Into::into),
    };
    let context = Context {
        title: "A joint & its gauge".into(),
        calibrated_on: vec!["monday".into()],
        tested_on: evaluation.trials.iter().map(|trial| trial.trial.clone()).collect(),
        signal_choice: vec![
            candidate("gauge", Some(0.0123), None),
            candidate("other", None, Some("constant")),
        ],
        notes: vec!["resampled <twice>".into()],
        kinds: Vec::new(),
    };
    calibration_page(&Judged { calibrated: &[], evaluation, context: &context })
}

#[test]
fn the_first_sentence_of_every_calibration() {
    let all = [("raw", 9.0), ("linear", 3.21), ("poly13", 1.234)];
    let cases = [
        ("new recording", evaluation(&all, &["tuesday"])),
        ("two new recordings", evaluation(&all, &["tuesday", "friday"])),
        ("the data of the fit", evaluation(&all, &["monday"])),
        ("some of the data of the fit", evaluation(&all, &["monday", "tuesday"])),
        ("a memory is best", evaluation(&[all[0], all[1], ("observer", 0.9)], &["tuesday"])),
        ("no raw signal", evaluation(&[("linear", 2e-5)], &["tuesday"])),
        ("no number", evaluation(&[("raw", f64::NAN), ("linear", f64::NAN)], &[])),
    ];
    let said = cases.map(|(name, judged)| format!("=== {name}\n{}", first_seconds(&page(&judged))));
    is_snapshot("calibrations.txt", &said.join("\n\n"));
}

#[test]
fn a_page_of_a_calibration() {
    let all = [("raw", 9.0), ("linear", 3.21), ("poly13", 1.234)];
    is_snapshot("calibration.txt", &text(&page(&evaluation(&all, &["tuesday", "friday"]))));
}

#[test]
fn a_page_of_a_prediction() {
    let measured: Vec<f64> = (0..1000).map(|i| (0.02 * f64::from(i)).sin()).collect();
    let output = PredictedOutput {
        stage: "joint".into(),
        column: "angle_deg".into(),
        unit: "deg".into(),
        noise: 0.02,
        rmse: 0.031,
        rmse_without: 0.42,
        times_noise: 1.55,
        ratio: 0.0738,
        with: measured.iter().map(|y| y + 0.03).collect(),
        without: measured.iter().map(|y| 1.4 * y).collect(),
        measured,
    };
    let trial = |name: &str, extrapolated: &[&str]| PredictedTrial {
        name: name.into(),
        seconds: 20.0,
        outputs: vec![output.clone()],
        extrapolated: extrapolated.iter().map(|&words| words.to_owned()).collect(),
    };
    let prediction = Prediction {
        schema: 2,
        name: "arm".into(),
        effects: vec!["brake".into()],
        dt_s: 0.02,
        ratio: 0.0738,
        largest_times_noise: 1.55,
        holds: None,
        trials: vec![
            trial("a.csv", &[]),
            trial("b.csv", &["command_V reaches 7.2, above the 5 of the fit"]),
        ],
        notes: vec!["b.csv: 3 rows are left out".into()],
    };
    is_snapshot("prediction.txt", &text(&predict_page(&prediction)));
}

//! Tests of calibration files that must be refused, and of the error messages.

use proptest::{prelude::*, strategy::ValueTree, test_runner::TestRunner};
use serde_json::{Value, json};
use stretch_core::{Calibration, CalibrationSpec, Degree, DesignError, Model, Surface};

/// Returns a valid calibration with surfaces, in JSON. The tests make one of its fields invalid.
fn record() -> Value {
    let mut runner = TestRunner::deterministic();
    loop {
        let calibration =
            stretch_strategies::calibration().new_tree(&mut runner).unwrap().current();
        if matches!(calibration.spec().model, Model::Surfaces { .. }) {
            return serde_json::to_value(calibration).unwrap();
        }
    }
}

#[track_caller]
fn refused(pointer: &str, value: Value, says: &str) {
    let mut record = record();
    *record.pointer_mut(pointer).expect("a field of the record") = value;
    let error = serde_json::from_value::<Calibration>(record).unwrap_err().to_string();
    assert!(error.contains(says), "{pointer}: {error}");
}

#[test]
fn the_unspoilt_record_loads() {
    assert!(serde_json::from_value::<Calibration>(record()).is_ok());
}

#[test]
fn impossible_numbers_name_their_field() {
    refused("/dead_band", json!(-1.0), "dead_band");
    refused("/sample_rate_hz", json!(0.0), "sample_rate_hz");
    refused("/target", json!({"contraction": {"rest_length": -180.0}}), "target.rest_length");
    refused(
        "/rate_estimator",
        json!({"savitzky_golay": {"window": 1, "degree": 1, "delay": 0}}),
        "rate.window",
    );
    refused(
        "/rate_estimator",
        json!({"savitzky_golay": {"window": 5, "degree": 5, "delay": 0}}),
        "rate.degree",
    );
    refused(
        "/rate_estimator",
        json!({"savitzky_golay": {"window": 5, "degree": 2, "delay": 5}}),
        "rate.delay",
    );
    refused("/rate_estimator", json!({"differentiator": {"cutoff_hz": 0.0}}), "rate.cutoff_hz");
    refused("/rate_estimator", json!({"tracker": {"tracking_index": -1.0}}), "rate.tracking_index");
    refused(
        "/model/surfaces/inflation/signal_domain",
        json!({"min": 2.0, "max": 1.0}),
        "inflation.signal_domain",
    );
    refused(
        "/model/surfaces/deflation/rate_domain",
        json!({"min": 2.0, "max": 1.0}),
        "deflation.rate_domain",
    );
    refused("/model/surfaces/inflation/fit/r_squared", json!(1.5), "fit.r_squared");
    refused("/model/surfaces/deflation/fit/rmse", json!(-0.1), "fit.rmse");
    refused("/signal_range/max", json!(-1e3), "range");
}

#[test]
fn a_newer_schema_says_so_before_anything_else() {
    let newer = r#"{"schema": 99, "a_field_of_tomorrow": 1}"#;
    let error = serde_json::from_str::<Calibration>(newer).unwrap_err().to_string();
    assert!(error.contains("schema is 99") && error.contains("update"), "{error}");
    refused("/schema", json!(0), "schema is 0");
}

/// Binary files store the index of the model, so the remaining models must keep their indices.
#[test]
fn a_removed_model_is_refused_by_name_in_text_and_in_bytes() {
    let mut record = record();
    let surfaces = record["model"]["surfaces"].take();
    record["model"] = json!({ "blended": surfaces });
    let error = serde_json::from_value::<Calibration>(record.clone()).unwrap_err().to_string();
    assert!(error.contains("a `blended` model, which only builds of stretch 0.1.0"), "{error}");
    let spec: CalibrationSpec = serde_json::from_value(record).unwrap();
    let mut buffer = [0; 4096];
    let bytes = stretch_core::record::store(&spec, &mut buffer).unwrap();
    let read = stretch_core::record::load::<CalibrationSpec>(bytes).unwrap();
    assert_eq!(Calibration::new(read), Err(DesignError::Removed { model: "blended" }));
    let mut runner = TestRunner::deterministic();
    for _ in 0..64 {
        let model =
            stretch_strategies::calibration().new_tree(&mut runner).unwrap().current().spec().model;
        let number = match model {
            Model::Linear(_) => 0,
            Model::Surfaces { .. } => 1,
            Model::History(_) => 3,
            Model::Observer(_) => 4,
            Model::Diagnosed(_) => 5,
            _ => unreachable!(),
        };
        assert_eq!(postcard::to_slice(&model, &mut buffer).unwrap()[0], number, "{}", model.name());
    }
}

#[test]
fn an_unknown_or_missing_field_is_named() {
    let mut unknown = record();
    unknown["dead_bend"] = json!(0.1);
    let error = serde_json::from_value::<Calibration>(unknown).unwrap_err().to_string();
    assert!(error.contains("dead_bend"), "{error}");
    let mut missing = record();
    missing.as_object_mut().unwrap().remove("signal_range");
    let error = serde_json::from_value::<Calibration>(missing).unwrap_err().to_string();
    assert!(error.contains("signal_range"), "{error}");
}

/// Reads a binary file that an earlier release wrote.
#[test]
fn an_earlier_record_loads_and_is_written_as_it_was() {
    let bytes = include_bytes!("../../../firmware/data/poly13.postcard");
    assert_eq!(bytes[0], 2);
    let calibration = stretch_core::record::load::<Calibration>(bytes).unwrap();
    let mut buffer = [0; 4096];
    assert_eq!(stretch_core::record::store(&calibration, &mut buffer).unwrap(), bytes);
}

#[test]
fn a_surface_needs_one_finite_coefficient_a_term() {
    assert!(Surface::new(Degree::POLY13, &[0.0; 6]).is_err());
    assert!(Surface::new(Degree::POLY13, &[0.0; 8]).is_err());
    let error = Surface::new(Degree::POLY13, &[f64::NAN; 7]).unwrap_err();
    assert!(error.to_string().contains("surface.coefficients"));
    assert!(Degree::new(0, 6).is_err());
}

#[test]
fn two_poly13_surfaces_take_about_400_bytes() {
    let mut runner = TestRunner::deterministic();
    let mut buffer = [0; 4096];
    loop {
        let calibration =
            stretch_strategies::calibration().new_tree(&mut runner).unwrap().current();
        if let Model::Surfaces { inflation, deflation } = calibration.spec().model
            && inflation.surface.degree() == Degree::POLY13
            && deflation.surface.degree() == Degree::POLY13
        {
            let bytes = postcard::to_slice(&calibration, &mut buffer).unwrap().len();
            assert!((300..=450).contains(&bytes), "{bytes}");
            return;
        }
    }
}

//! Converts volts to millimetres in `f32`, with the rate from a low-pass filtered difference.
#![no_std]
#![no_main]

use stretch_core::{Calibration, CalibrationSpec, Hertz, RateEstimator};
use stretch_filter::{Differentiator, LowPassSpec};
use stretch_firmware::program;
use stretch_receptor::StretchReceptor;

type Receptor = StretchReceptor<f32, Differentiator<f32>>;

fn make(calibration: Calibration) -> Receptor {
    let spec = LowPassSpec { cutoff: Hertz(5.0), sample_rate: calibration.spec().sample_rate_hz };
    let rate = Differentiator::new(spec).expect("a rate that can be designed");
    // the calibration was fitted with another estimator; the program only measures the cost of the differentiator
    let rate_estimator = RateEstimator::Differentiator { cutoff_hz: 5.0 };
    let spec = CalibrationSpec { rate_estimator, ..calibration.into_spec() };
    let calibration = Calibration::new(spec).expect("only the name of the estimator differs");
    Receptor::with_rate(&calibration, rate).expect("a calibration that fits f32")
}

program!(volts, Receptor, make, "poly13-f32-differentiator" from "poly13");

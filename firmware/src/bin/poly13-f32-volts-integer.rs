//! Converts volts to millimetres in `f32`, with the rate computed in integers.
#![no_std]
#![no_main]

use stretch_core::Calibration;
use stretch_filter::IntegerSgRate;
use stretch_firmware::program;
use stretch_receptor::StretchReceptor;

type Receptor = StretchReceptor<f32, IntegerSgRate<11, 2>>;

fn make(calibration: Calibration) -> Receptor {
    let rate = IntegerSgRate::new(calibration.spec().sample_rate_hz, 3.3)
        .expect("a rate that can be designed");
    Receptor::with_rate(&calibration, rate).expect("a calibration that fits f32")
}

program!(volts, Receptor, make, "poly13-f32-volts-integer" from "poly13");

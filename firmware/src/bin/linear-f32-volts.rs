//! Converts volts to millimetres with a line, all in `f32`: the direct implementation.
#![no_std]
#![no_main]

use stretch_core::Calibration;
use stretch_filter::SgRate;
use stretch_firmware::program;
use stretch_receptor::StretchReceptor;

type Receptor = StretchReceptor<f32, SgRate<f32, 11, 2>>;

fn make(calibration: Calibration) -> Receptor {
    let rate = SgRate::new(calibration.spec().sample_rate_hz).expect("a rate that can be designed");
    Receptor::with_rate(&calibration, rate).expect("a calibration that fits f32")
}

program!(volts, Receptor, make, "linear-f32-volts" from "linear");

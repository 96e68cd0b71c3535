//! Converts volts to millimetres with polynomials of the signal's history, in `f32`.
#![no_std]
#![no_main]

use stretch_core::Calibration;
use stretch_filter::SgRate;
use stretch_firmware::program;
use stretch_receptor::HistoryReceptor;

type Receptor = HistoryReceptor<f32, SgRate<f32, 11, 2>>;

fn make(calibration: Calibration) -> Receptor {
    let rate = SgRate::new(calibration.spec().sample_rate_hz).expect("a rate that can be designed");
    Receptor::with_rate(&calibration, rate).expect("a calibration that fits f32")
}

program!(
    volts, Receptor, make,
    "history" from "history",
    "history+rest" from "history-rest",
);

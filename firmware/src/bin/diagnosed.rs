//! Converts volts to millimetres in `f32`, with a model of diagnosed effects that a filter inverts.
#![no_std]
#![no_main]

use stretch_core::Calibration;
use stretch_firmware::program;
use stretch_receptor::DiagnosedReceptor;

type Receptor = DiagnosedReceptor<f32>;

fn make(calibration: Calibration) -> Receptor {
    Receptor::new(&calibration).expect("a calibration that fits f32")
}

program!(
    volts, Receptor, make,
    "diagnosed" from "diagnosed",
    "diagnosed+rest" from "diagnosed-rest",
);

//! Converts volts to millimetres in `f32`, with the gauge's forward model that a filter inverts.
#![no_std]
#![no_main]

use stretch_core::Calibration;
use stretch_firmware::program;
use stretch_receptor::ObserverReceptor;

type Receptor = ObserverReceptor<f32>;

fn make(calibration: Calibration) -> Receptor {
    Receptor::new(&calibration).expect("a calibration that fits f32")
}

program!(
    volts, Receptor, make,
    "observer" from "observer",
    "observer+rest" from "observer-rest",
);

//! Converts volts to millimetres in `f32`, with the rate from an alpha-beta tracker.
#![no_std]
#![no_main]

use stretch_core::{Calibration, Design, Stage};
use stretch_filter::{NamedRate, Tracker, TrackerSpec};
use stretch_firmware::program;
use stretch_receptor::StretchReceptor;

/// A tracker that outputs only the rate, which the receptor needs.
#[derive(Clone, Copy)]
struct Rate(Tracker<f32>);

impl Design for Rate {
    type Memory = <Tracker<f32> as Design>::Memory;
    fn memory(&self) -> Self::Memory {
        self.0.memory()
    }
}

/// The calibration was fitted with another estimator. The program only measures the cost of the tracker.
impl NamedRate for Rate {}

impl Stage<f32> for Rate {
    type Out = Option<f32>;
    #[inline(always)]
    fn step(&self, memory: &mut Self::Memory, volts: f32) -> Option<f32> {
        self.0.step(memory, volts).map(|track| track.rate)
    }
}

type Receptor = StretchReceptor<f32, Rate>;

fn make(calibration: Calibration) -> Receptor {
    let spec = TrackerSpec { tracking_index: 0.1, sample_rate: calibration.spec().sample_rate_hz };
    let rate = Rate(Tracker::new(spec).expect("a rate that can be designed"));
    Receptor::with_rate(&calibration, rate).expect("a calibration that fits f32")
}

program!(volts, Receptor, make, "poly13-f32-tracker" from "poly13");

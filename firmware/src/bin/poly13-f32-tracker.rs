//! Volts to millimetres in `f32`, with the rate of an alpha-beta tracker.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use stretch_core::{Calibration, Design, Stage, Volts};
use stretch_filter::{Tracker, TrackerSpec};
use stretch_firmware::{
    measure::{Answer, length_only, replay},
    trial,
};
use stretch_receptor::StretchReceptor;

static RECORD: &[u8] = include_bytes!("../../data/poly13.postcard");

/// The receptor takes the rate alone.
#[derive(Clone, Copy)]
struct Rate(Tracker<f32>);

impl Design for Rate {
    type Memory = <Tracker<f32> as Design>::Memory;
    fn memory(&self) -> Self::Memory {
        self.0.memory()
    }
}

impl Stage<f32> for Rate {
    type Out = Option<f32>;
    #[inline(always)]
    fn step(&self, memory: &mut Self::Memory, volts: f32) -> Option<f32> {
        self.0.step(memory, volts).map(|track| track.rate)
    }
}

type Receptor = StretchReceptor<f32, Rate>;

#[inline(never)]
fn step(
    design: &Receptor,
    memory: &mut <Receptor as Design>::Memory,
    volts: Volts<f32>,
) -> Answer<f32> {
    length_only(design.step(memory, volts))
}

#[entry]
fn main() -> ! {
    let calibration: Calibration = postcard::from_bytes(RECORD).expect("a valid record");
    let spec = TrackerSpec { tracking_index: 0.1, sample_rate: calibration.sample_rate_hz };
    let rate = Rate(Tracker::new(spec).expect("a rate that can be designed"));
    let design = Receptor::with_rate(&calibration, rate).expect("a calibration that fits f32");
    replay(
        "poly13-f32-tracker",
        &design,
        &mut design.memory(),
        |code| Volts(trial::volts(code)),
        step,
    );
    semihosting::process::exit(0)
}

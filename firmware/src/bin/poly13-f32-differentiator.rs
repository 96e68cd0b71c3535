//! Volts to millimetres in `f32`, with the rate of a band-limited differentiator.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use stretch_core::{Calibration, Design, Hertz, Stage, Volts};
use stretch_filter::{Differentiator, LowPassSpec};
use stretch_firmware::{
    measure::{Answer, length_only, replay},
    trial,
};
use stretch_receptor::StretchReceptor;

static RECORD: &[u8] = include_bytes!("../../data/poly13.postcard");

type Receptor = StretchReceptor<f32, Differentiator<f32>>;

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
    let rate = Differentiator::new(LowPassSpec {
        cutoff: Hertz(5.0),
        sample_rate: calibration.sample_rate_hz,
    })
    .expect("a rate that can be designed");
    let design = Receptor::with_rate(&calibration, rate).expect("a calibration that fits f32");
    replay(
        "poly13-f32-differentiator",
        &design,
        &mut design.memory(),
        |code| Volts(trial::volts(code)),
        step,
    );
    semihosting::process::exit(0)
}

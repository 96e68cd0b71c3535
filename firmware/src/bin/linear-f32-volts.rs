//! Volts to millimetres by a line, all in `f32`.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use stretch_core::{Calibration, Design, Stage, Volts};
use stretch_filter::SgRate;
use stretch_firmware::{
    measure::{Answer, length_only, replay},
    trial,
};
use stretch_receptor::StretchReceptor;

static RECORD: &[u8] = include_bytes!("../../data/linear.postcard");

type Receptor = StretchReceptor<f32, SgRate<f32, 11, 2>>;

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
    let rate = SgRate::new(calibration.sample_rate_hz).expect("a rate that can be designed");
    let design = Receptor::with_rate(&calibration, rate).expect("a calibration that fits f32");
    replay(
        "linear-f32-volts",
        &design,
        &mut design.memory(),
        |code| Volts(trial::volts(code)),
        step,
    );
    semihosting::process::exit(0)
}

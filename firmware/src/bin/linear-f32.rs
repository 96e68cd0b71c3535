//! Codes to millimetres by a line in `f32`.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use stretch_core::{Design, Stage};
use stretch_firmware::measure::{Answer, replay};
use stretch_receptor::code::{AdcCode, CodeCalibration, CodeMemory, CodeReceptor};

static RECORD: &[u8] = include_bytes!("../../data/linear-f32.postcard");

type Receptor = CodeReceptor<f32, 11, 2>;

#[inline(never)]
fn step(design: &Receptor, memory: &mut CodeMemory<11>, code: AdcCode) -> Answer<f32> {
    design.step(memory, code)
}

#[entry]
fn main() -> ! {
    let calibration: CodeCalibration<f32, 11, 2> =
        postcard::from_bytes(RECORD).expect("a valid record");
    let design = Receptor::new(calibration);
    replay("linear-f32", &design, &mut design.memory(), |code| code, step);
    semihosting::process::exit(0)
}

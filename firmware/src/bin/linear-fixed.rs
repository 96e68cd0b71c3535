//! Codes to micrometres by a line, in fixed point.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use stretch_core::{Design, Stage};
use stretch_firmware::measure::{Answer, replay};
use stretch_receptor::code::{AdcCode, CodeMemory, FixedCalibration, FixedReceptor};

static RECORD: &[u8] = include_bytes!("../../data/linear-fixed.postcard");

#[inline(never)]
fn step(design: &FixedReceptor<11, 2>, memory: &mut CodeMemory<11>, code: AdcCode) -> Answer<i32> {
    design.step(memory, code)
}

#[entry]
fn main() -> ! {
    let calibration: FixedCalibration<11, 2> =
        postcard::from_bytes(RECORD).expect("a valid record");
    let design = FixedReceptor::new(calibration);
    replay("linear-fixed", &design, &mut design.memory(), |code| code, step);
    semihosting::process::exit(0)
}

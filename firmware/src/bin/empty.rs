//! A step that does nothing. It measures the cost of the replay and its printing.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use stretch_firmware::measure::{Answer, replay};
use stretch_receptor::{Withheld, code::AdcCode};

#[inline(never)]
fn step(_: &(), _: &mut (), _: AdcCode) -> Answer<i32> {
    Err(Withheld::Warming)
}

#[entry]
fn main() -> ! {
    replay("empty", &(), &mut (), |code| code, step, |answer| answer);
    semihosting::process::exit(0)
}

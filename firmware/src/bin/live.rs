//! An example to copy: reads a sample every 10 ms and sends a line of the live link.
//!
//! Code that depends on the board is in `main`; `run` is the same on every board. `stretch listen`
//! shows and records the lines.
#![no_std]
#![no_main]

use cortex_m::peripheral::{SYST, syst::SystClkSource};
use cortex_m_rt::entry;
use embedded_io::Write;
use stretch_core::{Runner, Stage};
use stretch_firmware::board::{Converter, Ended, Replay, Uart};
use stretch_link::Frame;
use stretch_receptor::{
    Withheld,
    code::{AdcCode, CodeReading, FixedCalibration, FixedReceptor},
};

/// Output of `stretch export --fixed`: the calibration for this board's converter, in integers.
static RECORD: &[u8] = include_bytes!("../../data/poly13-fixed.postcard");

const CORE_HZ: u32 = 25_000_000;
const SAMPLE_HZ: u32 = 100;

/// Waits for the next period.
struct Pace(SYST);

impl Pace {
    fn new(mut syst: SYST) -> Self {
        syst.set_clock_source(SystClkSource::Core);
        syst.set_reload(CORE_HZ / SAMPLE_HZ - 1);
        syst.clear_current();
        syst.enable_counter();
        Self(syst)
    }

    fn wait(&mut self) {
        // Reading the flag clears it. A missed period is skipped, and the loop waits for the next one.
        while !self.0.has_wrapped() {}
    }
}

/// Converts and sends samples. If the converter fails, the sample is sent as missing. The loop ends only at an error
/// for which `is_end` is true.
fn run<C: Converter>(
    receptor: impl Stage<AdcCode, Out = Result<CodeReading<i32>, Withheld>>,
    converter: &mut C,
    port: &mut impl Write,
    pace: &mut Pace,
    is_end: impl Fn(&C::Error) -> bool,
) {
    let mut receptor = Runner::new(receptor);
    let mut counter = 0u32;
    loop {
        pace.wait();
        let code = match converter.convert() {
            Ok(code) => code,
            Err(error) if is_end(&error) => return,
            Err(_) => AdcCode::MISSING,
        };
        let frame = Frame {
            counter,
            time_ms: counter.wrapping_mul(1000 / SAMPLE_HZ),
            code: code.0,
            answer: receptor.step(code).into(),
        };
        // A failing port loses a line, which the receiver detects by the counter. The loop
        // continues.
        let _ = port.write_all(frame.encode(&mut [0; Frame::LONGEST]));
        counter = counter.wrapping_add(1);
    }
}

#[entry]
fn main() -> ! {
    let core = cortex_m::Peripherals::take().expect("taken once");
    let calibration: FixedCalibration<11, 2> =
        stretch_core::record::load(RECORD).expect("a sound record");
    // SAFETY: this is an emulated MPS2 board, and the port is used only here.
    let mut port = unsafe { Uart::take() };
    let mut pace = Pace::new(core.SYST);
    run(FixedReceptor::new(calibration), &mut Replay::new(), &mut port, &mut pace, |Ended| true);
    semihosting::process::exit(0)
}

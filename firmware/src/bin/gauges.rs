//! Converts volts of four gauges to the angle of a joint, in `f32`. The program measures the cost
//! of a channel and of its monitoring.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use stretch_core::{Design, Stage};
use stretch_firmware::{
    gauges::{GAUGES, answer, samples},
    measure::{load, replay},
    trial,
};
use stretch_sleeve::{ArrayCalibration, ArrayMemory, ArrayReading, ArrayReceptor, ArrayWithheld};

static RECORD: &[u8] = include_bytes!("../../data/gauges.postcard");

type Receptor = ArrayReceptor<f32, GAUGES>;

#[inline(never)]
fn step(
    receptor: &Receptor,
    memory: &mut ArrayMemory<f32, GAUGES>,
    samples: [f32; GAUGES],
) -> Result<ArrayReading<f32>, ArrayWithheld> {
    receptor.step(memory, samples)
}

#[entry]
fn main() -> ! {
    let calibration: ArrayCalibration<GAUGES> = load(RECORD);
    let receptor = Receptor::new(&calibration);
    let mut memory = receptor.memory();
    let input = |code| samples(trial::volts(code));
    replay("gauges", &receptor, &mut memory, input, step, answer);
    semihosting::process::exit(0)
}

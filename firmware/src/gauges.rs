//! Four simulated gauges that follow the trial, each with a different gain.

use stretch_core::Branch;
use stretch_receptor::{Domain, Withheld, code::CodeReading};
use stretch_sleeve::{ArrayReading, ArrayWithheld};

/// Number of gauges.
pub const GAUGES: usize = 4;

/// Returns the gain of a gauge relative to the trial's volts.
pub fn gain(gauge: usize) -> f32 {
    1.0 + 0.25 * gauge as f32
}

/// Returns a sample of each gauge. All are NaN if the trial's sample is missing.
pub fn samples(volts: f32) -> [f32; GAUGES] {
    core::array::from_fn(|gauge| gain(gauge) * volts)
}

/// Converts a reading for the checksum. A lost channel is encoded as the branch.
pub fn answer(
    reading: Result<ArrayReading<f32>, ArrayWithheld>,
) -> Result<CodeReading<f32>, Withheld> {
    match reading {
        Ok(reading) => Ok(CodeReading {
            estimate: reading.estimate,
            branch: if reading.lost == 0 { Branch::Inflation } else { Branch::Deflation },
            domain: if reading.clamped { Domain::SignalClamped } else { Domain::Inside },
        }),
        Err(ArrayWithheld::Warming) => Err(Withheld::Warming),
        Err(_) => Err(Withheld::Missing),
    }
}

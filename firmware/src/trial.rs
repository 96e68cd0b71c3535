//! The trial that is replayed: 2,000 codes of a 12-bit converter at 100 Hz.

use stretch_receptor::code::AdcCode;

static CODES: &[u8] = include_bytes!("../data/trial.u16le");

/// Volts from one code to the next: 3.3 V over 4095.
pub const VOLTS_PER_CODE: f32 = 3.3 / 4095.0;

/// The codes in order; 0xffff means a sample that did not come.
pub fn codes() -> impl Iterator<Item = AdcCode> {
    CODES.chunks_exact(2).map(|two| match u16::from_le_bytes([two[0], two[1]]) {
        u16::MAX => AdcCode::MISSING,
        code => AdcCode(code.into()),
    })
}

/// The sample in volts, NaN for one that did not come.
pub fn volts(code: AdcCode) -> f32 {
    if code == AdcCode::MISSING { f32::NAN } else { code.0 as f32 * VOLTS_PER_CODE }
}

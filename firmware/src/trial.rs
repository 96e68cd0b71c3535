//! The replayed trial: 2,000 codes of a 12-bit converter at 100 Hz.

use stretch_receptor::code::AdcCode;

static CODES: &[u8] = include_bytes!("../data/trial.u16le");

/// Volts per code: 3.3 V divided by 4095.
pub const VOLTS_PER_CODE: f32 = 3.3 / 4095.0;

/// Returns the codes in order. The value 0xffff is a missing sample.
pub fn codes() -> impl Iterator<Item = AdcCode> {
    CODES.chunks_exact(2).map(|two| match u16::from_le_bytes([two[0], two[1]]) {
        u16::MAX => AdcCode::MISSING,
        code => AdcCode(code.into()),
    })
}

/// Converts a code to volts; a missing sample becomes NaN.
pub fn volts(code: AdcCode) -> f32 {
    if code == AdcCode::MISSING { f32::NAN } else { code.0 as f32 * VOLTS_PER_CODE }
}

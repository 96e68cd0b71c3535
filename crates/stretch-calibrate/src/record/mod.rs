//! Calibration files: sealed files (with a checksum or a digest), and integer calibrations for a
//! board.

pub mod digest;
mod file;
mod fixed;

pub use file::{
    calibration_bytes, calibration_from_edited_json, calibration_from_json, calibration_seal,
    calibration_to_json, is_postcard, read_calibration, write_calibration,
};
pub use fixed::{
    BoardReceptor, FIXED_STEP, FixedRecord, RecordNumbers, change_per_code, converter_reach,
    fit_error, fixed_record, parse_adc,
};

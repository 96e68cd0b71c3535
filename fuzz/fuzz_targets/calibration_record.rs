//! Any bytes as a calibration: no panic, and what loads passes its own checks.
#![no_main]

use libfuzzer_sys::fuzz_target;
use stretch_core::{Calibration, CalibrationSpec};
use stretch_receptor::StretchReceptor;

fuzz_target!(|bytes: &[u8]| {
    let records = [
        serde_json::from_slice::<Calibration>(bytes).ok(),
        postcard::from_bytes::<Calibration>(bytes).ok(),
    ];
    for record in records.into_iter().flatten() {
        let _ = StretchReceptor::<f32>::new(&record);
        assert!(Calibration::new(CalibrationSpec::from(record)).is_ok());
    }
});

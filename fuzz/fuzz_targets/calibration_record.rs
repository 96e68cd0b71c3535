//! Any bytes as a binary calibration file: no panic; what loads passes its own checks, is stepped, and every reading of it is finite.
#![no_main]

use libfuzzer_sys::fuzz_target;
use stretch_calibrate::{BoardReceptor, calibration_from_json, calibration_to_json};
use stretch_core::{Calibration, CalibrationSpec, record};
use stretch_fuzz::{codes, steps};

fuzz_target!(|bytes: &[u8]| {
    // under a seal, and as if the seal had held
    let text = std::str::from_utf8(bytes).ok();
    let records = [
        serde_json::from_slice::<Calibration>(bytes).ok(),
        text.and_then(|text| calibration_from_json(text, "fuzz").ok()),
        postcard::from_bytes::<Calibration>(bytes).ok(),
        record::load::<Calibration>(bytes).ok(),
    ];
    for calibration in records.into_iter().flatten() {
        steps::<f64>(&calibration, bytes);
        steps::<f32>(&calibration, bytes);
        if let Ok(text) = calibration_to_json(&calibration) {
            let again = calibration_from_json(&text, "fuzz").expect("own record");
            assert_eq!(calibration, again);
        }
        assert!(Calibration::new(CalibrationSpec::from(calibration)).is_ok());
    }
    if let Some(mut board) = BoardReceptor::new(bytes) {
        let largest = (1 << board.adc_bits()) - 1;
        for code in codes(bytes, largest) {
            let _ = board.step(code);
        }
    }
});

//! Any calibration that loads, then any stream of voltages: every reading is finite, in both widths.
#![no_main]

use libfuzzer_sys::fuzz_target;
use stretch_core::Calibration;
use stretch_fuzz::steps;

fuzz_target!(|bytes: &[u8]| {
    if let Ok((calibration, stream)) = postcard::take_from_bytes::<Calibration>(bytes) {
        steps::<f64>(&calibration, stream);
        steps::<f32>(&calibration, stream);
    }
});

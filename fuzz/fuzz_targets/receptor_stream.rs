//! Any stream of voltages: every reading is finite.
#![no_main]

use libfuzzer_sys::fuzz_target;
use stretch_core::{Runner, Volts};
use stretch_receptor::{StretchReceptor, example_calibration};

fuzz_target!(|bytes: &[u8]| {
    let calibration = example_calibration();
    let mut receptor = Runner::new(StretchReceptor::<f32>::new(&calibration).expect("valid"));
    for sample in bytes.chunks_exact(4) {
        let volts = f32::from_le_bytes([sample[0], sample[1], sample[2], sample[3]]);
        if let Ok(reading) = receptor.step(Volts(volts)) {
            assert!(reading.estimate.is_finite() && reading.rate.is_finite());
        }
    }
});

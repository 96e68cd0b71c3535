//! Any stream through the receptors of three examples: every reading is finite.
#![no_main]

use libfuzzer_sys::fuzz_target;
use stretch_fuzz::steps;
use stretch_receptor::{example_calibration, example_diagnosed, example_observer};

fuzz_target!(|bytes: &[u8]| {
    let Some((which, stream)) = bytes.split_first() else { return };
    let calibration = match which % 3 {
        0 => example_calibration(),
        1 => example_observer(),
        _ => example_diagnosed(),
    };
    steps::<f32>(&calibration, stream);
});

//! Any calibration, over any converter, in integers: no overflow, whatever codes come.
#![no_main]

use libfuzzer_sys::fuzz_target;
use stretch_core::Calibration;
use stretch_fuzz::{adc, code_steps, observer_steps};
use stretch_receptor::code::{FixedCalibration, FixedObserver};

fuzz_target!(|bytes: &[u8]| {
    let Some((which, bytes)) = bytes.split_first() else { return };
    // calibrations as they lie in flash, as if their seal had held
    match which % 4 {
        0 => {
            if let Ok((fixed, stream)) = postcard::take_from_bytes::<FixedCalibration<11, 2>>(bytes)
            {
                code_steps(Ok::<_, ()>(fixed), stream);
            }
        }
        1 => {
            if let Ok((observer, stream)) = postcard::take_from_bytes::<FixedObserver>(bytes) {
                observer_steps(observer, stream);
            }
        }
        // converted from calibrations on a computer
        _ => {
            let Ok((calibration, stream)) = postcard::take_from_bytes::<Calibration>(bytes) else {
                return;
            };
            let Some(adc) = adc(&calibration, which / 4) else { return };
            code_steps(FixedCalibration::<11, 2>::new(&calibration, &adc), stream);
            if let Ok(observer) = FixedObserver::new(&calibration, &adc) {
                observer_steps(observer, stream);
            }
        }
    }
});

//! Any calibration as C: refused, or a header of printable characters, in both arithmetics and under any name.
#![no_main]

use libfuzzer_sys::fuzz_target;
use stretch_core::Calibration;
use stretch_export::{Form, Options, arduino_library, header};
use stretch_fuzz::adc;

fuzz_target!(|bytes: &[u8]| {
    let Some((which, bytes)) = bytes.split_first() else { return };
    let Ok(calibration) = postcard::from_bytes::<Calibration>(bytes) else { return };
    let Some(adc) = adc(&calibration, which / 3) else { return };
    let form = [None, Some(Form::Fixed), Some(Form::Float)][usize::from(which % 3)];
    if let Ok(header) = header(&calibration, &Options { form, adc }) {
        let library = arduino_library(&header, &String::from_utf8_lossy(bytes));
        for file in library.into_iter().flatten() {
            let is_plain = |c: char| matches!(c, '\n' | '\t') || !c.is_control();
            assert!(file.text.chars().all(is_plain), "{}", file.text);
            for line in file.text.lines().filter(|line| line.ends_with(',')) {
                assert!(!line.contains("NaN") && !line.contains("inf"), "{line}");
            }
        }
    }
});

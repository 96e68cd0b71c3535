//! Any text where a command line has a name, a rate or a converter: no panic; what has a name is spelt by it.
#![no_main]

use libfuzzer_sys::fuzz_target;
use stretch_calibrate::{ModelKind, parse_adc, parse_rate};

fuzz_target!(|text: &str| {
    if let Ok(kind) = text.parse::<ModelKind>() {
        assert_eq!(kind.to_string().parse(), Ok(kind));
    }
    if let Ok(rate) = parse_rate(text) {
        assert!(rate.validate().is_ok());
    }
    let _ = parse_adc(text);
});

//! Any text as a data set: no panic, and what is read can be written and read again.
#![no_main]

use libfuzzer_sys::fuzz_target;
use stretch_data::DataSet;

fuzz_target!(|text: &str| {
    if let Ok(set) = DataSet::parse("fuzz", text) {
        let again = DataSet::parse("fuzz", &set.to_toml()).expect("own output");
        assert_eq!(set, again);
    }
});

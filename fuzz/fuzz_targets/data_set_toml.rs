//! Any text as a data set or a rig file: no panic.
#![no_main]

use libfuzzer_sys::fuzz_target;
use stretch_data::{DataSet, RigFile};

fuzz_target!(|text: &str| {
    let _ = DataSet::parse("fuzz", text);
    let _ = RigFile::parse("fuzz", text);
});

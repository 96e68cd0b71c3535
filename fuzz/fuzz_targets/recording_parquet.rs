//! No panic on a Parquet file; what is read can be written.
#![no_main]

use libfuzzer_sys::fuzz_target;
use stretch_data::{ReadOptions, Recording};

/// What tells the format.
const HEAD: &[u8] = b"PAR1";

fuzz_target!(|bytes: &[u8]| {
    let bytes = [HEAD, bytes].concat();
    let options = ReadOptions::new().sample_rate_hz(100.0);
    if let Ok(recording) = Recording::from_reader(&bytes[..], "fuzz", &options) {
        assert!(recording.trial.check().is_ok());
    }
});

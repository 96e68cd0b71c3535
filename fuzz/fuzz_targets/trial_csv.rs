//! Any bytes as a trial: no panic, and whatever is read can be written and read again.
#![no_main]

use libfuzzer_sys::fuzz_target;
use stretch_recording::{ReadOptions, Recording, RowReader, TimeUnit};

fuzz_target!(|bytes: &[u8]| {
    let options = ReadOptions::new();
    if let Ok(Recording { trial, .. }) = Recording::from_reader(bytes, "fuzz", &options) {
        assert!(trial.time_s.iter().all(|t| t.is_finite()));
        let mut text = Vec::new();
        if trial.write_to(&mut text).is_ok() {
            // seconds, whatever the options of the first reader say that it counted
            let own = ReadOptions::new().time_unit(TimeUnit::Seconds);
            let again = Recording::from_reader(text.as_slice(), "fuzz", &own).expect("own output");
            assert_eq!(trial, again.trial);
        }
    }
    if let Ok(mut rows) = RowReader::new(bytes, "fuzz", &options) {
        while rows.next_row().is_some() {}
    }
});

//! No panic on a table of text in any dialect, whole and a row at a time; what is read can be written.
#![no_main]

use libfuzzer_sys::fuzz_target;
use stretch_recording::{DateOrder, ReadOptions, Recording};

fuzz_target!(|bytes: &[u8]| {
    let named = ReadOptions::new().columns(["tag", "time_ms", "a"]).date_order(DateOrder::DayFirst);
    for options in [ReadOptions::new().sample_rate_hz(100.0), ReadOptions::new(), named] {
        if let Ok(recording) = Recording::from_reader(bytes, "fuzz", &options) {
            assert!(recording.trial.check().is_ok());
        }
        if let Ok(mut rows) = stretch_recording::RowReader::new(bytes, "fuzz", &options) {
            while let Some(row) = rows.next_row() {
                assert!(row.map_or(true, |row| row.time_s.is_finite()));
            }
        }
    }
});

//! No panic on a bag in SQLite; what is read can be written.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| stretch_fuzz::recording(b"SQLite format 3\0", bytes));

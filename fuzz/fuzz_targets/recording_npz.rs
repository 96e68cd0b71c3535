//! No panic on an archive of arrays; what is read can be written.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| stretch_fuzz::recording(b"PK\x03\x04", bytes));

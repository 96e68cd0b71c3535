//! No panic on a packed recording; what is read can be written.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| stretch_fuzz::recording(b"\x1f\x8b", bytes));

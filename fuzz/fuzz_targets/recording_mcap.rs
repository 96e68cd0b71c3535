//! No panic on an MCAP file; what is read can be written.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| stretch_fuzz::recording(b"\x89MCAP0\r\n", bytes));

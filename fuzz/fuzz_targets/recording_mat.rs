//! No panic on a MAT file; what is read can be written.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| stretch_fuzz::recording(b"MATLAB 5.0 MAT-file", bytes));

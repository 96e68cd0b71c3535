//! No panic on an array of NumPy; what is read can be written.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| stretch_fuzz::recording(b"\x93NUMPY", bytes));

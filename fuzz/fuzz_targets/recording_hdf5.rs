//! No panic on an HDF5 file; what is read can be written.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| stretch_fuzz::recording(b"\x89HDF\r\n\x1a\n", bytes));

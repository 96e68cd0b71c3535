//! Any text as a problem: no panic, here and where its workers are asked for.
#![no_main]

use libfuzzer_sys::fuzz_target;
use stretch_problem::ProblemFile;

fuzz_target!(|text: &str| {
    if let Ok(file) = ProblemFile::parse("fuzz", text) {
        let _ = file.workers(1);
    }
});

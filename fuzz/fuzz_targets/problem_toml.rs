//! Any text as a problem: no panic, here and where its workers are asked for.
#![no_main]

use libfuzzer_sys::fuzz_target;
use stretch_problem::ProblemSpec;

fuzz_target!(|text: &str| {
    if let Ok(file) = ProblemSpec::parse("fuzz", text) {
        let _ = file.workers(1);
        assert_eq!(ProblemSpec::parse("own", &file.to_toml()).expect("own output"), file);
    }
});

//! The program of the fleet, aborted before its file-system call number N:
//! `killed_fleet N COMMAND...`.
//!
//! Tests start it, and check which files such a kill leaves.

use std::{
    env,
    process::ExitCode,
    sync::atomic::{AtomicUsize, Ordering::Relaxed},
};

use stretch_data::files::ask_before_disk_calls;

fn main() -> ExitCode {
    let mut words = env::args_os();
    let program = words.next();
    let number = words.next().and_then(|word| word.to_str()?.parse::<usize>().ok());
    let last = number.expect("the number of a call");
    let calls = AtomicUsize::new(0);
    assert!(ask_before_disk_calls(move |_| {
        if calls.fetch_add(1, Relaxed) + 1 == last {
            // As after kill -9, nothing is cleaned up.
            std::process::abort();
        }
        Ok(())
    }));
    let is_ingest = env::args().nth(2).is_some_and(|command| command == "ingest");
    match stretch_fleet_program::run(program.into_iter().chain(words)) {
        // An ingest ends with status 1 if it has refused a file. That is no failure here.
        _ if is_ingest => ExitCode::SUCCESS,
        status => status,
    }
}

//! Reads a recording, and prints the peak memory of the process, in kB, and the number of rows:
//!
//!     cargo run --release -p stretch-recording --example peak_memory -- run.npz
//!
//! The peak comes from Linux (`/proc/self/status`). `tests/memory.rs` checks the limit of every reader with this
//! program.

use std::{env, fs, io};

use stretch_recording::{ReadOptions, Recording};

fn main() -> io::Result<()> {
    let path = env::args_os().nth(1).ok_or_else(|| io::Error::other("name a recording"))?;
    let read = Recording::read(path, &ReadOptions::new().sample_rate_hz(100.0));
    let status = fs::read_to_string("/proc/self/status")?;
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or_default();
    let answer = match read {
        Ok(recording) => format!("read {} rows", recording.trial.time_s.len()),
        Err(why) => format!("refused: {why}"),
    };
    println!("{} {answer}", peak.trim().trim_end_matches(" kB"));
    Ok(())
}

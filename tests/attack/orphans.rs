//! The workers of a simulator, and all processes that they start, end with the program, however it
//! ends.
#![cfg(unix)]

use std::{
    fs::{File, OpenOptions},
    io::{ErrorKind, Read},
    os::unix::fs::OpenOptionsExt,
    path::Path,
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use rustix::{
    fs::OFlags,
    process::{Pid, Signal, kill_process},
};

use crate::support::{Scratch, program};

/// A worker that never answers. Every process that it starts holds the pipe `alive` open: a child,
/// a grandchild without a parent, and the shell itself, which continues after its standard input
/// has ended.
const WORKER: &str = "exec 3>alive; sleep 600 & (sleep 600 &); trap '' HUP INT TERM; echo up >&3; cat >/dev/null; sleep 600; true";

/// The way in which the program ends.
#[derive(Debug, Clone, Copy)]
enum Death {
    By(Signal),
    /// The deadline for the worker passes, and the program ends by itself.
    Deadline,
}

const DEATHS: [Death; 4] =
    [Death::By(Signal::TERM), Death::By(Signal::INT), Death::By(Signal::KILL), Death::Deadline];

/// Reads the data in the pipe. Returns whether a process still holds it open for writing.
fn heard(pipe: &mut File, text: &mut String) -> bool {
    let mut bytes = [0; 64];
    match pipe.read(&mut bytes) {
        Ok(0) => false,
        Ok(n) => {
            text.push_str(&String::from_utf8_lossy(&bytes[..n]));
            true
        }
        Err(e) => e.kind() == ErrorKind::WouldBlock || e.kind() == ErrorKind::Interrupted,
    }
}

/// Waits until a condition holds, at most one minute, because the time depends on the machine.
fn waits(mut holds: impl FnMut() -> bool) -> bool {
    let until = Instant::now() + Duration::from_secs(60);
    while !holds() {
        if Instant::now() > until {
            return false;
        }
        thread::sleep(Duration::from_millis(2));
    }
    true
}

fn begun(folder: &Path, death: Death) -> Child {
    let start_s = if matches!(death, Death::Deadline) { 0.2 } else { 600.0 };
    let text = format!(
        "[simulator]\ncommand = [\"sh\", \"-c\", \"\"\"{WORKER}\"\"\"]\nstart_s = {start_s}\n[[stage]]\noutput = \"y\"\ninputs = [\"u\"]\n[[trial]]\nfile = \"a.csv\"\n"
    );
    std::fs::write(folder.join("problem.toml"), text).unwrap();
    let mut stretch = Command::new(program());
    stretch.current_dir(folder).args(["diagnose", "problem.toml"]);
    stretch.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

/// Ends the program this number of times, in each way in turn. Returns how often a process was
/// left.
fn orphans_of(deaths: usize) -> usize {
    let scratch = Scratch::in_memory();
    let rows: String = (0..400)
        .map(|i| format!("{:.2},{},{}\n", 0.01 * f64::from(i), i / 60 % 2, i / 60 % 3))
        .collect();
    scratch.write("a.csv", format!("time_s,u,y\n{rows}"));
    let mut orphans = 0;
    for n in 0..deaths {
        let death = DEATHS[n % DEATHS.len()];
        let path = scratch.path("alive");
        let _ = std::fs::remove_file(&path);
        assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
        let flags = OFlags::NONBLOCK.bits() as i32;
        let mut pipe = OpenOptions::new().read(true).custom_flags(flags).open(&path).unwrap();
        let mut stretch = begun(&scratch.path(""), death);
        let mut text = String::new();
        let is_up = waits(|| {
            heard(&mut pipe, &mut text);
            text == "up\n"
        });
        assert!(is_up, "{death:?}: the worker was not started: {text:?}");
        // Some signals arrive immediately, others while the program waits.
        thread::sleep(Duration::from_micros(700 * (n as u64 % 7)));
        if let Death::By(signal) = death {
            kill_process(Pid::from_child(&stretch), signal).unwrap();
        }
        assert!(!stretch.wait().unwrap().success(), "{death:?}");
        // A killed process may take a moment to disappear.
        let until = Instant::now() + Duration::from_secs(5);
        while heard(&mut pipe, &mut text) && Instant::now() < until {
            thread::sleep(Duration::from_millis(2));
        }
        orphans += usize::from(heard(&mut pipe, &mut text));
    }
    orphans
}

#[test]
fn a_program_that_dies_leaves_no_worker_behind() {
    assert_eq!(orphans_of(8), 0);
}

/// `STRETCH_DEATHS` sets the number of runs.
#[test]
#[ignore = "200 deaths take a minute; ./ci.sh runs it"]
fn two_hundred_deaths_leave_no_worker_behind() {
    let deaths = std::env::var("STRETCH_DEATHS").map_or(200, |deaths| deaths.parse().unwrap());
    assert_eq!(orphans_of(deaths), 0);
}

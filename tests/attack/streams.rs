//! Standard output and standard error that are full, closed, slow or closed by their reader. The
//! written files are the same, and exit codes are correct.
#![cfg(unix)]

use std::{
    collections::BTreeMap,
    fs::{self, File},
    hash::{DefaultHasher, Hash, Hasher},
    io::Read,
    path::Path,
    process::{Command, ExitStatus, Stdio},
    thread,
    time::Duration,
};

use crate::support::{Scratch, program};
use stretch_calibrate::calibration_to_json;
use stretch_link::Frame;
use stretch_receptor::{
    code::{Adc, AdcSpec, FixedCalibration, FixedReceptor},
    example_calibration,
};

/// The other end of a stream.
#[derive(Debug, Clone, Copy, PartialEq)]
enum End {
    /// A process that reads.
    Read,
    /// A disk without space.
    Full,
    /// A pipe whose reader has closed it.
    Gone,
    /// A closed stream: `2>&-`.
    Closed,
}

impl End {
    fn stdio(self) -> Stdio {
        match self {
            Self::Read | Self::Closed => Stdio::null(),
            Self::Full => File::options().write(true).open("/dev/full").unwrap().into(),
            // The reading end is dropped here.
            Self::Gone => std::io::pipe().unwrap().1.into(),
        }
    }
}

/// Creates the inputs of all commands.
fn inputs() -> Scratch {
    let scratch = Scratch::new();
    scratch.loops("a_1.csv", 20.0, 1.1);
    scratch.loops("a_2.csv", 15.0, 0.9);
    scratch.calibration("cal.json");
    // A malformed row is reported on standard error.
    let rows = fs::read_to_string(scratch.path("a_1.csv")).unwrap();
    let (head, rest) = rows.split_at(rows.find("\n1.00,").unwrap());
    scratch.write("live.csv", format!("{head}\nthis is no row{rest}"));
    scratch.write("board.json", calibration_to_json(&example_calibration()).unwrap());
    scratch.write("frames", frames(500));
    scratch
}

/// Returns the lines of a board that runs the example calibration.
fn frames(samples: u32) -> Vec<u8> {
    let adc = Adc::new(AdcSpec { bits: 12, zero_v: 0.0, full_scale_v: 3.3 }).unwrap();
    let fixed = FixedCalibration::<11, 2>::new(&example_calibration(), &adc).unwrap();
    let mut receptor = stretch_core::Runner::new(FixedReceptor::new(fixed));
    let mut lines = Vec::new();
    for counter in 0..samples {
        let code = adc.code(1.6 + 0.35 * (f64::from(counter) * 0.02).sin());
        let answer = receptor.step(code).into();
        let frame = Frame { counter, time_ms: 10 * counter, code: code.0, answer };
        lines.extend_from_slice(frame.encode(&mut [0; Frame::LONGEST]));
    }
    lines
}

/// Every command, with the file for its standard input.
const COMMANDS: [(&str, Option<&str>); 18] = [
    ("calibrate a_1.csv --out new.json --report new.html", None),
    ("apply --calibration cal.json a_1.csv --out out.csv", None),
    ("apply --calibration cal.json - --out out.csv", Some("live.csv")),
    ("apply --calibration cal.json -", Some("live.csv")),
    ("evaluate --calibration cal.json a_2.csv", None),
    ("convert a_1.csv --column angle_deg=length_mm*2 --out converted.csv", None),
    ("simulate --protocol pulses --out simulated", None),
    ("diagnose a_1.csv --reference length_mm --signal bridge_v --fix fixed.toml --no-next", None),
    ("effects", None),
    ("simulate --print-rig", None),
    ("listen --port frames --calibration board.json --out trial.csv", None),
    ("export --calibration board.json --c c --fixed new.postcard", None),
    // Commands that write a file to standard output.
    ("convert a_1.csv --out -", None),
    ("calibrate a_1.csv --out /dev/stdout", None),
    ("apply --calibration cal.json a_1.csv --out -", None),
    ("simulate --protocol pulses --out -", None),
    ("export --calibration board.json --c -", None),
    ("diagnose a_1.csv --reference length_mm --signal bridge_v --no-next --fix -", None),
];

fn run(scratch: &Scratch, (line, input): (&str, Option<&str>), out: End, err: End) -> ExitStatus {
    let mut command = Command::new("sh");
    let close =
        |end: End, n: u8| if end == End::Closed { format!(" {n}>&-") } else { String::new() };
    let script = format!("exec \"$@\"{}{}", close(out, 1), close(err, 2));
    command.args(["-c", &script, "sh"]).arg(program()).args(line.split(' '));
    let stdin = match input {
        Some(name) => File::open(scratch.path(name)).unwrap().into(),
        None => Stdio::null(),
    };
    command.current_dir(scratch.path("")).stdin(stdin).stdout(out.stdio()).stderr(err.stdio());
    command.status().unwrap()
}

/// Returns length and hash of every file below a folder by relative path.
fn contents(folder: &Path) -> BTreeMap<String, (usize, u64)> {
    let mut files = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            files.extend(contents(&path).into_iter().map(|(k, v)| (format!("{name}/{k}"), v)));
        } else {
            let bytes = fs::read(&path).unwrap();
            let mut hasher = DefaultHasher::new();
            bytes.hash(&mut hasher);
            files.insert(name, (bytes.len(), hasher.finish()));
        }
    }
    files
}

/// Runs a command with every combination of stream ends under test, and compares the files.
#[track_caller]
fn files_do_not_depend_on_streams(command: (&str, Option<&str>)) {
    let expected = inputs();
    assert!(run(&expected, command, End::Read, End::Read).success(), "{}", command.0);
    let expected = contents(&expected.path(""));
    let ends = [End::Read, End::Full, End::Gone, End::Closed];
    for (out, err) in ends.into_iter().flat_map(|out| ends.map(|err| (out, err))) {
        // One stream at a time, and both full.
        if out != End::Read && err != End::Read && (out, err) != (End::Full, End::Full) {
            continue;
        }
        let scratch = inputs();
        let status = run(&scratch, command, out, err);
        let case = format!("{} with output {out:?}, error {err:?}", command.0);
        assert_eq!(contents(&scratch.path("")), expected, "{case}");
        let says_nothing = command.0.starts_with("apply") && command.0.ends_with("out.csv");
        let code = i32::from(out == End::Full && !says_nothing);
        assert_eq!(status.code(), Some(code), "{case}");
    }
}

#[test]
fn every_command_writes_the_same_files_whatever_stands_behind_its_streams() {
    // One thread per command, because each waits for the disk most of the time.
    thread::scope(|scope| {
        for command in COMMANDS {
            scope.spawn(move || files_do_not_depend_on_streams(command));
        }
    });
}

#[test]
fn a_file_that_nobody_reads_on_standard_output_keeps_no_other_back() {
    let scratch = inputs();
    let line = "calibrate a_1.csv --out - --report new.html --json=new.json";
    assert_eq!(run(&scratch, (line, None), End::Gone, End::Read).code(), Some(0));
    assert!(scratch.path("new.html").is_file() && scratch.path("new.json").is_file());
}

#[test]
fn what_comes_through_a_pipe_is_read_once() {
    let scratch = inputs();
    fs::copy(scratch.path("cal.json"), scratch.path("b.json")).unwrap();
    let trial = fs::read_to_string(scratch.path("a_1.csv")).unwrap();
    let rows = trial.lines().map(|row| row.split_once(',').unwrap().1);
    scratch.write("table.csv", rows.collect::<Vec<_>>().join("\n"));
    for line in [
        "apply --calibration <(cat cal.json) a_1.csv",
        "apply --calibration cal.json <(cat a_1.csv)",
        "apply --calibration <(cat cal.json) - < a_1.csv",
        "evaluate --calibration <(cat cal.json) --calibration <(cat b.json) a_1.csv",
        "export --calibration <(cat cal.json)",
        "export --calibration <(cat cal.json) --c -",
        "calibrate <(cat a_1.csv) <(cat a_2.csv) --out -",
        "calibrate a_1.csv a_2.csv - --out - < a_1.csv",
        "calibrate table.csv <(cut -d, -f2- a_2.csv) --model curve --out -",
        "convert <(cat a_1.csv) --out -",
        "listen --port frames --calibration <(cat board.json)",
        "simulate --rig <(\"$0\" simulate --print-rig) --protocol pulses --out -",
        "diagnose <(cat a_1.csv) --reference length_mm --signal bridge_v --no-next",
    ] {
        let mut bash = Command::new("bash");
        bash.args(["-c", &format!("\"$0\" {line} > /dev/null")]).arg(program());
        let bash = bash.current_dir(scratch.path("")).stdin(Stdio::null());
        // Without bash, users cannot write <(...).
        let Ok(output) = bash.output() else { return };
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

#[test]
fn a_pipe_whose_reader_goes_is_no_failure() {
    let scratch = inputs();
    // More than the buffer of a pipe.
    scratch.loops("long.csv", 120.0, 1.1);
    for line in [
        "convert long.csv --out - | head -1",
        "convert long.csv --out >(head -1)",
        "apply --calibration cal.json long.csv | head -1",
        "apply --calibration cal.json long.csv --out >(head -1)",
        "apply --calibration cal.json - --out >(head -1) < long.csv",
        "export --calibration board.json --c - | head -1",
        "simulate --protocol pulses --out - | head -1",
    ] {
        let mut bash = Command::new("bash");
        bash.args(["-c", &format!("\"$0\" {line}; exit ${{PIPESTATUS[0]}}")]).arg(program());
        let bash = bash.current_dir(scratch.path("")).stdin(Stdio::null());
        let Ok(output) = bash.output() else { return };
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{line}: {said}");
        assert!(!said.contains("roken pipe"), "{line}: {said}");
    }
}

#[test]
fn help_that_cannot_be_shown_is_a_failure_and_help_that_nobody_reads_is_none() {
    let scratch = Scratch::new();
    for (line, out, code) in [
        ("--help", End::Read, 0),
        ("--help", End::Gone, 0),
        ("--help", End::Full, 1),
        ("no_such_command", End::Full, 2),
    ] {
        let status = run(&scratch, (line, None), out, End::Full);
        assert_eq!(status.code(), Some(code), "{line} {out:?}");
    }
}

#[test]
fn a_recording_does_not_wait_for_a_reader_that_does_not_read() {
    let scratch = inputs();
    // More than the buffer of a pipe.
    let rows = 5000;
    scratch.write("frames", frames(rows));
    let mut child = Command::new(program())
        .current_dir(scratch.path(""))
        .args(["listen", "--port", "frames", "--calibration", "board.json", "--out", "trial.csv"])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let recorded = || fs::read_to_string(scratch.path("trial.csv")).unwrap_or_default();
    for _ in 0..1000 {
        if recorded().lines().count() > rows as usize {
            break;
        }
        thread::sleep(Duration::from_millis(20));
    }
    assert_eq!(recorded().lines().count(), rows as usize + 1, "nothing was read of what is shown");
    // A late reader gets all rows.
    let mut shown = String::new();
    child.stdout.take().unwrap().read_to_string(&mut shown).unwrap();
    assert_eq!(shown, recorded());
    assert!(child.wait().unwrap().success());
}

#[test]
fn a_listen_that_records_nothing_leaves_nothing() {
    let scratch = inputs();
    scratch.write("frames", "noise\n");
    let listen = "listen --port frames --calibration board.json --out trial.csv";
    for (out, err) in [(End::Full, End::Full), (End::Gone, End::Gone), (End::Read, End::Read)] {
        let _ = run(&scratch, (listen, None), out, err);
        assert!(!scratch.path("trial.csv").exists(), "a header blocks the next try");
    }
    scratch.write("frames", frames(20));
    assert!(run(&scratch, (listen, None), End::Read, End::Read).success());
}

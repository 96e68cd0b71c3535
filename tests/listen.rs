//! `stretch listen` on a pseudo-terminal, with all disturbances of a cable.
#![cfg(unix)]

use std::{
    fs::{self, File},
    io::{BufRead, BufReader, Read, Write},
    os::unix::fs::symlink,
    path::{Path, PathBuf},
    process::{Child, ChildStderr, Command, ExitStatus, Stdio},
    thread,
    time::{Duration, Instant},
};

use crate::support::{Scratch, calibrate, program, runs};
use rustix::{
    process::{Pid, Signal, kill_process},
    pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt},
    termios,
};
use stretch_calibrate::{
    BoardReceptor, ModelKind, calibration_to_json, fixed_record, read_calibration,
};
use stretch_core::{Calibration, Runner, Target, Volts};
use stretch_link::Frame;
use stretch_receptor::{
    Receptor, Withheld,
    code::{Adc, AdcCode, AdcSpec, CodeReading, FixedCalibration, FixedReceptor},
    example_calibration,
};
use stretch_recording::{ReadOptions, Recording};

fn due() -> Adc {
    Adc::new(AdcSpec { bits: 12, zero_v: 0.0, full_scale_v: 3.3 }).unwrap()
}

/// Returns the frames of a board for `samples` samples after a reset, with real estimates.
fn board(samples: u32) -> Vec<Frame> {
    let fixed = FixedCalibration::<11, 2>::new(&example_calibration(), &due()).unwrap();
    let mut receptor = Runner::new(FixedReceptor::new(fixed));
    frames(samples, |code| receptor.step(code))
}

/// Returns the frames of a board with these answers.
fn frames(
    samples: u32,
    mut answer: impl FnMut(AdcCode) -> Result<CodeReading<i32>, Withheld>,
) -> Vec<Frame> {
    (0..samples)
        .map(|counter| {
            let swing = (f64::from(counter) * 0.02).sin();
            // One sample in a hundred is missing.
            let code = if counter % 100 == 57 { -1 } else { due().code(1.6 + 0.35 * swing).0 };
            let answer = answer(AdcCode(code)).into();
            Frame { counter, time_ms: 10 * counter, code, answer }
        })
        .collect()
}

/// Returns the frames of a board with a floating-point unit, which runs a calibration in `f32`.
fn float_board(calibration: &Calibration) -> Vec<Frame> {
    let mut receptor = Runner::new(Receptor::<f32>::new(calibration).unwrap());
    frames(300, |code| {
        let volts = due().volts(code).map_or(f32::NAN, |volts| volts as f32);
        let reading = receptor.step(Volts(volts))?;
        let estimate = (1000.0 * reading.estimate).round() as i32;
        Ok(CodeReading { estimate, branch: reading.branch, domain: reading.domain })
    })
}

fn line(frame: &Frame) -> Vec<u8> {
    frame.encode(&mut [0; Frame::LONGEST]).to_vec()
}

/// Opens a pseudo-terminal as the other end of the port, and links its name to a fixed path.
fn plug(name: &Path) -> File {
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
    grantpt(&master).unwrap();
    unlockpt(&master).unwrap();
    let slave = ptsname(&master, Vec::new()).unwrap();
    let _ = fs::remove_file(name);
    symlink(Path::new(slave.to_str().unwrap()), name).unwrap();
    File::from(master)
}

struct Listener {
    child: Child,
    notes: BufReader<ChildStderr>,
    folder: tempfile::TempDir,
}

impl Listener {
    fn port(folder: &Path) -> PathBuf {
        folder.join("port")
    }

    fn start() -> (Self, File) {
        Self::start_with(calibration_to_json(&example_calibration()).unwrap().as_bytes())
    }

    fn start_with(record: &[u8]) -> (Self, File) {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("cal.json"), record).unwrap();
        let master = plug(&Self::port(folder.path()));
        let mut child = Command::new(program())
            .current_dir(folder.path())
            .args(["listen", "--port", "port", "--calibration", "cal.json", "--out", "trial.csv"])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let notes = BufReader::new(child.stderr.take().unwrap());
        let mut listener = Self { child, notes, folder };
        listener.await_note("connected");
        (listener, master)
    }

    fn await_note(&mut self, word: &str) -> String {
        let mut note = String::new();
        while !note.contains(word) {
            note.clear();
            assert_ne!(self.notes.read_line(&mut note).unwrap(), 0, "it ended without {word:?}");
        }
        note
    }

    fn recorded(&self) -> String {
        fs::read_to_string(self.folder.path().join("trial.csv")).unwrap()
    }

    /// Waits until the recording has `rows` rows.
    fn await_rows(&self, rows: usize) {
        let start = Instant::now();
        while self.recorded().lines().count() < rows + 1 {
            assert!(start.elapsed() < Duration::from_secs(20), "{}", self.recorded());
            thread::sleep(Duration::from_millis(10));
        }
    }

    /// Sends Ctrl-C. Returns the exit status, the messages and the recording.
    fn stop(mut self) -> (ExitStatus, String, String) {
        kill_process(Pid::from_child(&self.child), Signal::INT).unwrap();
        let status = self.child.wait().unwrap();
        let mut notes = String::new();
        self.notes.read_to_string(&mut notes).unwrap();
        let recorded = self.recorded();
        let signal = recorded.split(',').nth(1).unwrap();
        let columns = ReadOptions::new().require(signal).require("adc_code");
        let trial = Recording::read(self.folder.path().join("trial.csv"), &columns);
        assert!(trial.is_ok(), "{trial:?}");
        (status, notes, recorded)
    }
}

/// Returns the expected rows of a recording of these frames, without the time. A record in integers
/// has no target.
fn rows<'a>(frames: impl IntoIterator<Item = &'a Frame>, target: Option<Target>) -> Vec<String> {
    let row = |frame: &Frame| {
        let volts = due().volts(AdcCode(frame.code)).unwrap();
        format!("{volts},{},{}", frame.code, frame.answer.cells(target))
    };
    frames.into_iter().filter(|frame| frame.code >= 0).map(row).collect()
}

/// The target of [`example_calibration`].
fn length() -> Option<Target> {
    Some(example_calibration().spec().target)
}

fn without_time(recorded: &str) -> Vec<String> {
    let rest = |line: &str| line.split_once(',').unwrap().1.to_owned();
    recorded.lines().skip(1).map(rest).collect()
}

#[test]
fn a_clean_line_is_recorded_sample_by_sample() {
    let frames = board(300);
    let (listener, mut master) = Listener::start();
    frames.iter().for_each(|frame| master.write_all(&line(frame)).unwrap());
    listener.await_rows(297);
    let (status, notes, recorded) = listener.stop();
    assert!(status.success(), "{notes}");
    assert_eq!(without_time(&recorded), rows(&frames, length()));
    assert!(recorded.starts_with("time_s,bridge_v,adc_code,estimate_mm,branch,domain\n0,"));
    assert!(recorded.contains("\n2.99,"), "the board's clock");
    assert!(notes.contains("300 frames, 0 lost, 0 damaged, 0 repeated, 0 restarts"), "{notes}");
    let told =
        notes.split("from the calibration by up to ").nth(1).unwrap().split(' ').next().unwrap();
    // The final rounding of the board's fixed point, and the effect of bridging missing samples on
    // it.
    assert!((0.0004..=0.0015).contains(&told.parse::<f64>().unwrap()), "{notes}");
}

/// Listens to the frames with this calibration file. Returns the largest difference that is
/// reported.
fn difference(record: &[u8], (frames, target): (&[Frame], Option<Target>), what: &str) -> f64 {
    let (listener, mut master) = Listener::start_with(record);
    frames.iter().for_each(|frame| master.write_all(&line(frame)).unwrap());
    listener.await_rows(rows(frames, target).len());
    let (status, notes, recorded) = listener.stop();
    assert!(status.success(), "{what}: {notes}");
    assert_eq!(without_time(&recorded), rows(frames, target), "{what}");
    assert!(notes.contains("300 frames, 0 lost"), "{what}: {notes}");
    let told = notes.split("from the calibration by up to ").nth(1).unwrap();
    told.split_whitespace().next().unwrap().parse().unwrap()
}

#[test]
#[ignore = "every model is fitted and listened to; ./ci.sh runs it"]
fn every_model_that_is_calibrated_is_listened_to() {
    let scratch = Scratch::new();
    let (trial, out) = (scratch.loops("a.csv", 20.0, 1.1), scratch.path("cal.json"));
    let (mut in_integers, mut kinds) = (Vec::new(), ModelKind::named());
    kinds.push("poly22".parse().unwrap());
    for kind in kinds {
        let kind = kind.to_string();
        runs(calibrate(&trial, &out).args(["--model", &kind]));
        let calibration = read_calibration(&out).unwrap();
        let told =
            difference(&fs::read(&out).unwrap(), (&float_board(&calibration), length()), &kind);
        // The final rounding to a micrometre, and the rounding of `f32` on the board.
        let bound = 6e-4 + testkit::tolerance::REMEMBERING_F32_MM;
        assert!(told <= bound, "{kind}: {told} mm, bound {bound} mm");

        let Ok(fixed) = fixed_record(&calibration, &due()) else { continue };
        let mut receptor = BoardReceptor::new(&fixed.bytes).unwrap();
        let frames = frames(300, |code| receptor.step(code));
        assert_eq!(
            difference(&fixed.bytes, (&frames, None), &kind),
            0.0,
            "{kind}: the same integers"
        );
        in_integers.push(kind);
    }
    assert_eq!(in_integers, ["linear", "poly13", "observer", "observer+rest"]);
}

#[test]
fn a_start_that_fails_leaves_nothing_behind() {
    let scratch = Scratch::new();
    scratch.write("broken.json", "{}");
    let fixed = fixed_record(&example_calibration(), &due()).unwrap();
    scratch.write("cal.postcard", fixed.bytes);
    scratch.write("cal.json", calibration_to_json(&example_calibration()).unwrap());
    let before = scratch.names();
    for (arguments, parts) in [
        (["--port", "-", "--calibration", "broken.json"].as_slice(), ["broken.json", "schema"]),
        (&["--port", "none", "--calibration", "cal.postcard"], ["none", "No such file"]),
        (
            &["--port", "-", "--calibration", "cal.postcard", "--adc", "16,0,3.3"],
            ["12 bits", "--adc 12,"],
        ),
        (
            &["--port", "-", "--calibration", "cal.json", "--adc", "10,100,1023"],
            ["cal.json: the signal", "measures from 100 to 1023"],
        ),
    ] {
        let mut command = crate::support::stretch();
        command.arg("listen").args(["--out", "trial.csv"]).args(arguments);
        crate::support::fails(command.current_dir(scratch.path("")), &parts);
        assert_eq!(scratch.names(), before, "{arguments:?}");
    }
}

/// Listens to bytes on standard input and records them. Returns the messages and the recording.
fn heard(bytes: &[u8]) -> (String, String) {
    let scratch = Scratch::new();
    scratch.write("cal.json", calibration_to_json(&example_calibration()).unwrap());
    scratch.write("frames", bytes);
    let output = crate::support::stretch()
        .current_dir(scratch.path(""))
        .args(["listen", "--port", "frames", "--calibration", "cal.json", "--out", "trial.csv"])
        .output()
        .unwrap();
    assert!(output.status.success());
    let recorded = fs::read_to_string(scratch.path("trial.csv")).unwrap_or_default();
    (crate::support::unbroken(&String::from_utf8_lossy(&output.stderr)), recorded)
}

#[test]
fn codes_beyond_the_converter_are_counted_and_nothing_is_called_compared() {
    let mut frames = board(200);
    frames.iter_mut().filter(|frame| frame.code >= 0).for_each(|frame| frame.code += 5000);
    let bytes: Vec<u8> = frames.iter().flat_map(line).collect();
    let (notes, recorded) = heard(&bytes);
    assert!(notes.contains("198 codes up to"), "{notes}");
    assert!(notes.contains("exceed a converter of 12 bits") && notes.contains("--adc"), "{notes}");
    assert!(notes.contains("2 samples that the board did not get"), "{notes}");
    assert!(
        notes.contains("no estimate was compared") && !notes.contains("differ from"),
        "{notes}"
    );
    assert!(recorded.is_empty());
    // One such frame among valid ones.
    let mut frames = board(200);
    frames[20].code = 4096;
    let bytes: Vec<u8> = frames.iter().flat_map(line).collect();
    let (notes, recorded) = heard(&bytes);
    assert!(notes.contains("; 197 rows recorded;"), "{notes}");
    assert!(notes.contains("; 1 codes up to 4096 exceed"), "{notes}");
    assert_eq!(recorded.lines().count(), 198);
}

#[test]
fn a_last_frame_without_newline_and_a_block_that_comes_twice_are_counted() {
    let frames = board(50);
    let bytes: Vec<u8> = frames.iter().flat_map(line).collect();
    let (notes, recorded) = heard(&bytes[..bytes.len() - 1]);
    assert!(notes.contains("50 frames, 0 lost, 0 damaged") && notes.contains("50 rows"), "{notes}");
    assert_eq!(without_time(&recorded), rows(&frames, length()));
    let (notes, _) = heard(&bytes[..bytes.len() - 5]);
    assert!(notes.contains("49 frames, 0 lost, 1 damaged"), "{notes}");
    let replayed = frames[..30].iter().chain(&frames[28..]).flat_map(line).collect::<Vec<u8>>();
    let (notes, recorded) = heard(&replayed);
    assert!(notes.contains("50 frames, 0 lost, 0 damaged, 2 repeated, 0 restarts"), "{notes}");
    assert_eq!(without_time(&recorded), rows(&frames, length()));
}

#[test]
fn a_folder_is_no_port() {
    let scratch = Scratch::new();
    scratch.write("cal.json", calibration_to_json(&example_calibration()).unwrap());
    let mut command = crate::support::stretch();
    command.current_dir(scratch.path("")).args([
        "listen",
        "--port",
        ".",
        "--calibration",
        "cal.json",
    ]);
    crate::support::fails(&mut command, &[".", "it is a folder", "name a serial port"]);
}

#[test]
fn faults_lose_their_own_frames_and_no_others() {
    let frames = board(400);
    let (listener, mut master) = Listener::start();
    let mut kept = Vec::new();
    for (n, frame) in frames.iter().enumerate() {
        let mut bytes = line(frame);
        match n % 20 {
            3 => bytes.extend(bytes.clone()), // doubled
            7 => drop(bytes.remove(9)),       // a byte dropped
            11 => bytes[12] ^= 0x04,          // a bit flipped
            13 => bytes.truncate(20),         // the end cut off
            17 => drop(bytes.splice(0..0, *b"\xff\x00noise\n$S1,\n")),
            _ => {}
        }
        if !matches!(n % 20, 7 | 11 | 13) {
            kept.push(*frame);
        }
        master.write_all(&bytes).unwrap();
    }
    listener.await_rows(rows(&kept, length()).len());
    let (status, notes, recorded) = listener.stop();
    assert!(status.success(), "{notes}");
    assert_eq!(without_time(&recorded), rows(&kept, length()));
    // 340 of 400 frames arrive. Every lost one lies before the last one that arrived.
    assert!(notes.contains("340 frames, 60 lost, 100 damaged, 20 repeated, 0 restarts"), "{notes}");
}

#[test]
fn a_pulled_cable_and_a_board_that_restarts_lose_nothing_recorded() {
    let frames = board(150);
    let (mut listener, mut master) = Listener::start();
    frames[..100].iter().for_each(|frame| master.write_all(&line(frame)).unwrap());
    listener.await_rows(99);
    // Half a line is sent, and the cable is disconnected.
    master.write_all(&line(&frames[100])[..15]).unwrap();
    let before = listener.recorded();
    // The link is removed first, because the system reuses the number for the next pseudo-terminal.
    fs::remove_file(Listener::port(listener.folder.path())).unwrap();
    drop(master);
    listener.await_note("waiting");
    assert_eq!(listener.recorded(), before, "what was recorded stays");
    let mut master = plug(&Listener::port(listener.folder.path()));
    listener.await_note("connected");
    // The second half of that line, and the rest.
    master.write_all(&line(&frames[100])[15..]).unwrap();
    frames[101..].iter().for_each(|frame| master.write_all(&line(frame)).unwrap());
    listener.await_rows(99 + 49);
    // The board restarts.
    frames[..30].iter().for_each(|frame| master.write_all(&line(frame)).unwrap());
    listener.await_rows(99 + 49 + 30);
    let (status, notes, recorded) = listener.stop();
    assert!(status.success(), "{notes}");
    let kept = frames[..100].iter().chain(&frames[101..]).chain(&frames[..30]);
    assert_eq!(without_time(&recorded), rows(kept, length()));
    // The first half of that line may be lost with the cable.
    let damaged = if notes.contains("2 damaged") { 2 } else { 1 };
    let expected = format!("179 frames, 1 lost, {damaged} damaged, 0 repeated, 1 restarts");
    assert!(notes.contains(&expected), "{notes}");
}

#[test]
fn killed_outright_it_leaves_every_whole_line() {
    let frames = board(120);
    let (mut listener, mut master) = Listener::start();
    frames.iter().for_each(|frame| master.write_all(&line(frame)).unwrap());
    listener.await_rows(119);
    listener.child.kill().unwrap();
    listener.child.wait().unwrap();
    assert_eq!(without_time(&listener.recorded()), rows(&frames, length()));
}

#[test]
fn standard_input_ends_with_its_stream_and_a_record_is_never_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let calibration = calibration_to_json(&example_calibration()).unwrap();
    fs::write(folder.path().join("cal.json"), calibration).unwrap();
    let frames = board(50);
    let run = |out: &str| {
        let mut child = Command::new(program())
            .current_dir(folder.path())
            .args(["listen", "--port", "-", "--calibration", "cal.json", "--out", out])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut input = child.stdin.take().unwrap();
        // A program that refuses to start does not read its input.
        let _ = frames.iter().try_for_each(|frame| input.write_all(&line(frame)));
        drop(input);
        child.wait_with_output().unwrap()
    };
    let output = run("trial.csv");
    assert!(output.status.success());
    let shown = String::from_utf8(output.stdout).unwrap();
    let recorded = fs::read_to_string(folder.path().join("trial.csv")).unwrap();
    assert_eq!(shown, recorded, "off a terminal the lines are those of the record");
    assert_eq!(without_time(&shown), rows(&frames, length()));
    let again = run("trial.csv");
    assert!(!again.status.success());
    assert!(String::from_utf8_lossy(&again.stderr).contains("trial.csv: cannot record there"));
    assert_eq!(fs::read_to_string(folder.path().join("trial.csv")).unwrap(), recorded);
}

/// Returns the exit status of `listen` on a terminal of 24 rows, the text shown there, and the
/// recorded files.
fn seen_on_a_terminal(out: &[&str]) -> (ExitStatus, String, Vec<PathBuf>) {
    let folder = tempfile::tempdir().unwrap();
    let calibration = calibration_to_json(&example_calibration()).unwrap();
    fs::write(folder.path().join("cal.json"), calibration).unwrap();
    let mut port = plug(&folder.path().join("port"));
    let mut eyes = plug(&folder.path().join("terminal"));
    let tty = || {
        let path = folder.path().join("terminal");
        let file = File::options().read(true).write(true).open(path).unwrap();
        let size = termios::Winsize { ws_row: 24, ws_col: 80, ws_xpixel: 0, ws_ypixel: 0 };
        termios::tcsetwinsize(&file, size).unwrap();
        file
    };
    let mut child = Command::new(program())
        .current_dir(folder.path())
        .args(["listen", "--port", "port", "--calibration", "cal.json"])
        .args(out)
        .env("TERM", "xterm")
        .stdin(tty())
        .stdout(tty())
        .stderr(tty())
        .spawn()
        .unwrap();
    let seen = thread::spawn(move || {
        let (mut seen, mut buffer) = (Vec::new(), [0; 4096]);
        // The end of the terminal is an error on this side.
        while let Ok(n) = eyes.read(&mut buffer) {
            seen.extend_from_slice(&buffer[..n]);
            if n == 0 {
                break;
            }
        }
        seen
    });
    for frame in board(200) {
        port.write_all(&line(&frame)).unwrap();
        thread::sleep(Duration::from_millis(2));
    }
    thread::sleep(Duration::from_millis(300));
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    let status = child.wait().unwrap();
    let seen = String::from_utf8_lossy(&seen.join().unwrap()).into_owned();
    let recorded = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path());
    (status, seen, recorded.filter(|path| path.extension().is_some_and(|e| e == "csv")).collect())
}

#[test]
fn a_terminal_shows_one_line_that_is_renewed() {
    let (status, seen, recorded) = seen_on_a_terminal(&["--out", "trial.csv"]);
    assert!(status.success(), "{seen}");
    // The status line is redrawn in place, so there are far fewer lines than samples.
    assert!(seen.matches("mm; ").count() > 3 && seen.lines().count() < 12, "{seen}");
    assert!(seen.contains("frames, 0 lost") && !seen.contains("time_s,"), "{seen}");
    assert!(seen.contains("198 rows recorded"), "{seen}");
    assert_eq!(recorded.len(), 1, "Ctrl-C keeps the recording");
}

#[test]
fn a_dash_sends_the_samples_to_standard_output() {
    let (status, seen, recorded) = seen_on_a_terminal(&["--out", "-"]);
    assert!(status.success() && recorded.is_empty(), "{seen}");
    let rows = seen.lines().filter(|line| line.split(',').count() == 6).count();
    assert_eq!(rows, 201, "a header and a row a sample: {seen}");
    assert!(!seen.contains("mm; "), "no status line between the rows: {seen}");
}

#[test]
fn a_board_whose_clock_stands_is_told() {
    let scratch = Scratch::new();
    scratch.write("cal.json", calibration_to_json(&example_calibration()).unwrap());
    let said = |standing_from: u32| {
        let frames = board(300)
            .into_iter()
            .map(|frame| Frame { time_ms: frame.time_ms.min(10 * standing_from), ..frame });
        scratch.write("frames", frames.flat_map(|frame| line(&frame)).collect::<Vec<u8>>());
        let mut listen = Command::new(program());
        let listen = listen.current_dir(scratch.path("")).args(["listen", "--port", "frames"]);
        let name = format!("{standing_from}.csv");
        let out = listen.args(["--calibration", "cal.json", "--out", &name]).output().unwrap();
        assert!(out.status.success());
        let text = std::fs::read_to_string(scratch.path(&name)).unwrap();
        let time_s =
            text.lines().skip(1).map(|row| row.split(',').next().unwrap().parse().unwrap());
        let time_s: Vec<f64> = time_s.collect();
        let told = String::from_utf8_lossy(&out.stderr);
        (told.split_whitespace().collect::<Vec<_>>().join(" "), time_s)
    };
    let (stood, time_s) = said(199);
    assert!(stood.contains("the board's clock did not advance at 100 frames"), "{stood}");
    assert!(stood.contains("which are not recorded"), "{stood}");
    // No time is invented: recorded times are those of the board.
    let of_board = |frames: Vec<Frame>| -> Vec<f64> {
        let sampled = frames.into_iter().filter(|frame| frame.code >= 0);
        sampled.map(|frame| f64::from(frame.time_ms) / 1e3).collect()
    };
    assert_eq!(time_s, of_board(board(200)));
    let (ran, time_s) = said(300);
    assert!(!ran.contains("did not advance") && time_s == of_board(board(300)), "{ran}");
}

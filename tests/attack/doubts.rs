//! Logs that are accepted although the results are doubtful: every command that takes them must
//! print a warning.

use std::{fmt::Write, fs};

use crate::support::{Scratch, fails, one_line, stretch, warned};

/// Changes a row of time in seconds, length and signal; `None` removes the row.
type Change<'a> = &'a dyn Fn(usize, [f64; 3]) -> Option<[f64; 3]>;

/// Returns the log to which [`Scratch::calibration`] is fitted, with each row changed depending on
/// its number.
fn rows(scratch: &Scratch, change: Change<'_>) -> String {
    let text = fs::read_to_string(scratch.loops("whole.csv", 40.0, 1.1)).unwrap();
    let mut out = String::from("time_s,length_mm,bridge_v\n");
    for (n, line) in text.lines().skip(1).enumerate() {
        let mut cells = line.split(',').map(|cell| cell.parse().unwrap());
        let row = [(); 3].map(|()| cells.next().unwrap());
        if let Some([time_s, length, signal]) = change(n, row) {
            writeln!(out, "{time_s},{length},{signal}").unwrap();
        }
    }
    out
}

/// The command line before the log's name. For a stream, the log goes to standard input.
const EVALUATE: &str = "evaluate --calibration cal.json";
const APPLY: &str = "apply --calibration cal.json";
const STREAM: &str = "apply --calibration cal.json -";

/// Name and text of a log, the commands that take it, phrases that must occur once in the messages,
/// and phrases that must not occur.
type Member<'a> = (&'a str, String, &'a [&'a str], &'a [&'a str], &'a [&'a str]);

const ANOTHER: &str = "samples a second, the calibration";
const AT_200: &[&str] =
    &["the log has 200 samples a second, the calibration 100", ANOTHER, "--grid 100"];
const AT_10: &[&str] = &["the log has 10 samples a second", ANOTHER, "--grid 100"];

#[test]
fn a_log_that_makes_one_doubt_the_estimates_is_told_on_every_way_in() {
    let scratch = Scratch::new();
    scratch.calibration("cal.json");
    fs::create_dir(scratch.path("elsewhere")).unwrap();
    // All rows or every `every`th row, with times multiplied, and with every other row late.
    let timed = |times: f64, every: usize, late_s: f64| {
        rows(&scratch, &|n, [t, length, signal]| {
            let late_s = if (n / every).is_multiple_of(2) { 0.0 } else { late_s };
            n.is_multiple_of(every).then_some([times * t + late_s, length, signal])
        })
    };
    // Stamps that are up to 4 ms early or late, in no order.
    let jitter = rows(&scratch, &|n, [t, length, signal]| {
        let turn = (n as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let turn = (turn ^ (turn >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 11;
        Some([t + 0.008 * (turn as f64 / 2_f64.powi(53) - 0.5), length, signal])
    });
    let own = fs::read_to_string(scratch.loops("own.csv", 20.0, 1.0)).unwrap();
    let same = timed(1.0, 1, 0.0);
    let other = rows(&scratch, &|_, [t, length, signal]| Some([t, length + 0.1 * t.sin(), signal]));
    // The same samples at later times, with an additional column.
    let later = rows(&scratch, &|_, [t, length, signal]| Some([9.0 + t, length, signal]));
    let later = later.replace('\n', ",1\n").replacen("bridge_v,1", "bridge_v,more", 1);
    let still = rows(&scratch, &|_, [t, _, signal]| Some([t, 74.0, signal]));
    let metres = rows(&scratch, &|_, [t, length, signal]| Some([t, 0.001 * length, signal]));
    let reversed = rows(&scratch, &|_, [t, length, signal]| Some([t, 180.0 - length, signal]));
    let millivolts = rows(&scratch, &|_, [t, length, signal]| Some([t, length, 1000.0 * signal]));
    let (files, all) = (&[EVALUATE, APPLY], &[EVALUATE, APPLY, STREAM]);
    let (evaluate, applied) = (&[EVALUATE], &[APPLY, STREAM]);
    let outside = "samples lie outside the range of the calibration";
    let members: [Member<'_>; 22] = [
        ("own.csv", own.clone(), &[APPLY], &["outside the calibrated domain"], &[]),
        ("own.csv", own, files, &[], &["is it the calibrated sensor"]),
        ("other.csv", other.clone(), evaluate, &[], &["cal:"]),
        (
            "for_calibration.csv",
            same.clone(),
            evaluate,
            &["cal: it was fitted on for_calibration.csv"],
            &[],
        ),
        ("copy.csv", same, evaluate, &["cal: it was fitted on copy.csv (under another name)"], &[]),
        (
            "later.csv",
            later,
            evaluate,
            &["cal: it was fitted on later.csv (under another name)"],
            &[],
        ),
        (
            "elsewhere/for_calibration.csv",
            other,
            evaluate,
            &["for_calibration.csv (only the name is the same: its samples differ)"],
            &[],
        ),
        (
            "still.csv",
            still,
            evaluate,
            &["the reference is constant, so that R^2 is undefined"],
            &[],
        ),
        (
            "metres.csv",
            metres,
            evaluate,
            &[
                "length_mm changes by 0.001 for 1 of the estimate",
                "--column 'length_mm=length_mm*1000'",
            ],
            &["does not belong", "put on again"],
        ),
        (
            "reversed.csv",
            reversed,
            evaluate,
            &["cal: the estimate rises while length_mm falls"],
            &["does not belong", "put on again"],
        ),
        (
            "millivolts.csv",
            millivolts.clone(),
            files,
            &[outside],
            &["put on again", "does not belong"],
        ),
        ("millivolts.csv", millivolts, all, &["are they in mV?"], &[]),
        (
            "fast.csv",
            timed(0.5, 1, 0.0),
            evaluate,
            &["cal: fast.csv: the log has 200 samples a second"],
            &[],
        ),
        ("fast.csv", timed(0.5, 1, 0.0), applied, AT_200, &[]),
        ("fast_and_late.csv", timed(0.5, 1, 0.002), applied, AT_200, &[]),
        ("slow.csv", timed(1.0, 10, 0.0), applied, AT_10, &[]),
        ("slow_and_late.csv", timed(1.0, 10, 0.04), applied, AT_10, &[]),
        ("whole.csv", timed(1.0, 1, 0.0), applied, &[], &[ANOTHER]),
        ("late.csv", timed(1.0, 1, 0.004), applied, &["time stamps: 0 missing"], &[ANOTHER]),
        (
            "jitter.csv",
            jitter,
            applied,
            &["time stamps: 0 missing"],
            &[ANOTHER, "the zero has shifted"],
        ),
        ("in_ms.csv", timed(1e3, 1, 0.0), &[STREAM], &["are its times in ms?", "COL:ms"], &[]),
        ("a_little_slow.csv", timed(1.05, 1, 0.0), applied, &[], &[ANOTHER]),
    ];
    for (name, log, lines, says, says_not) in members {
        scratch.write(name, &log);
        for line in lines {
            let mut command = stretch();
            command.current_dir(scratch.path("")).args(line.split(' '));
            let told = match *line {
                STREAM => warned(command.write_stdin(log.clone())),
                _ => warned(command.arg(name)),
            };
            let counts = says.iter().map(|part| (part, 1));
            for (part, count) in counts.chain(says_not.iter().map(|part| (part, 0))) {
                assert_eq!(told.matches(part).count(), count, "{line} {name}, {part}: {told}");
            }
        }
    }
}

#[test]
fn stamps_that_cannot_be_or_come_unevenly_are_told_or_refused() {
    let scratch = Scratch::new();
    fs::create_dir(scratch.path("set")).unwrap();
    let set =
        "name = 'set'\nrate_hz = 250\n[[trial]]\nfile = 'a.csv'\nkind = 'other'\nsplit = 'fit'\n";
    let at = |count: usize, time_s: &dyn Fn(usize, f64) -> f64| {
        rows(&scratch, &|n, [t, length, signal]| {
            (n < count).then(|| [time_s(n, t), length, signal])
        })
    };
    let late = at(3000, &|n, t| if n < 1500 { t } else { t + 1e7 });
    let jitter = at(3000, &|n, t| t + [0.0, 0.004, -0.004][11 * n * n / 5 % 3]);
    scratch.write("set/dataset.toml", set);
    scratch.write("set/a.csv", at(1500, &|_, t| t));
    scratch.write("ps.csv", at(500, &|n, _| 1e-12 * n as f64));
    scratch.write("jitter.csv", jitter);
    scratch.write("late.csv", &late);
    // More missing samples than the count of a gap can hold.
    scratch.write("longer.csv", late.replace("\n100000", "\n999900000"));
    for (line, is_done, parts) in [
        ("calibrate ps.csv --out c.json", false, &["1.000e12 samples per second"][..]),
        ("calibrate set --out c.json", true, &["rate_hz = 250", "100.00 Hz"]),
        ("calibrate jitter.csv --out c.json", true, &["resampled to one every 0.0100 s"]),
        (
            "convert late.csv --grid 100 --out e.csv",
            false,
            &[
                "late.csv: a grid of 100 Hz has 1.0e9 instants in its 1000",
                "at the gap in its time",
            ],
        ),
        ("calibrate late.csv --out c.json", true, &["s are missing after 14.99 s"]),
        (
            "apply --calibration c.json longer.csv --out o.csv",
            true,
            &["time stamps: at least 42949672"],
        ),
    ] {
        let mut command = stretch();
        command.current_dir(scratch.path("")).args(line.split(' '));
        if !is_done {
            fails(&mut command, parts);
            continue;
        }
        let output = command.output().expect("the program runs");
        let told = one_line(&String::from_utf8_lossy(&[output.stdout, output.stderr].concat()));
        assert!(output.status.success(), "{line}: {told}");
        assert!(parts.iter().all(|part| told.contains(part)), "{line}: {told}");
    }
}

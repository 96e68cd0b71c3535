//! What is wrong in what the program is given, and would give numbers all the same, is told or refused.

use std::{fmt::Write, fs};

use crate::support::{Scratch, calibrate, fails, one_line, stretch};

/// What a command says on standard error, which succeeds.
#[track_caller]
fn warned(scratch: &Scratch, arguments: &[&str]) -> String {
    let mut command = stretch();
    let out = command.current_dir(scratch.path("")).args(arguments).output().unwrap();
    let said = one_line(&String::from_utf8_lossy(&out.stderr));
    assert!(out.status.success(), "{arguments:?}: {said}");
    said
}

/// A trial like those of [`Scratch::loops`], with a length of the caller's.
fn log(scratch: &Scratch, name: &str, rate_hz: f64, length: impl Fn(f64, f64) -> f64) {
    let mut text = String::from("time_s,length_mm,bridge_v\n");
    for n in 0..4000 {
        let t = f64::from(n) / rate_hz;
        let at = |t: f64| 165.0 + 14.0 * (1.1 * t).cos() * (0.31 * t).cos();
        writeln!(
            text,
            "{t:.4},{:.4},{:.5}",
            length(t, at(t)),
            1.24 + 0.033 * (180.0 - at(t - 0.03))
        )
        .unwrap();
    }
    scratch.write(name, text);
}

#[test]
fn an_evaluation_says_what_its_numbers_hide() {
    let scratch = Scratch::new();
    scratch.calibration("cal.json");
    log(&scratch, "fast.csv", 200.0, |_, length| length);
    // not to the bit what was fitted
    log(&scratch, "other.csv", 100.0, |t, length| length + 0.1 * t.sin());
    log(&scratch, "still.csv", 100.0, |_, _| 74.0);
    let said = |trial: &str| warned(&scratch, &["evaluate", "--calibration", "cal.json", trial]);
    let fast = said("fast.csv");
    assert!(fast.contains("cal: fast.csv: 200.0000 samples a second come where"), "{fast}");
    let own = said("for_calibration.csv");
    assert!(own.contains("cal: it was fitted on for_calibration.csv"), "{own}");
    // a copy under another name, and the same samples in other digits, later and with a column more
    fs::copy(scratch.path("for_calibration.csv"), scratch.path("copy.csv")).unwrap();
    let text = fs::read_to_string(scratch.path("for_calibration.csv")).unwrap();
    let mut lines = text.lines();
    let mut later = format!("{},more\n", lines.next().unwrap());
    for line in lines {
        let mut cells = line.split(',').map(|cell| cell.parse::<f64>().unwrap());
        write!(later, "{:.4}", 9.0 + cells.next().unwrap()).unwrap();
        cells.for_each(|value| write!(later, ",{value:e}").unwrap());
        later += ",1\n";
    }
    scratch.write("later.csv", later);
    for name in ["copy.csv", "later.csv"] {
        let copy = said(name);
        let told = format!("cal: it was fitted on {name} (under another name)");
        assert!(copy.contains(&told), "{copy}");
    }
    // another log that has the name of a fitted one
    fs::create_dir(scratch.path("elsewhere")).unwrap();
    fs::copy(scratch.path("other.csv"), scratch.path("elsewhere/for_calibration.csv")).unwrap();
    let named = said("elsewhere/for_calibration.csv");
    assert!(named.contains("for_calibration.csv (by its name: its samples are others)"), "{named}");
    let still = said("still.csv");
    assert!(still.contains("the reference stands still, so that there is no R^2"), "{still}");
    let other = said("other.csv");
    assert!(!other.contains("cal:"), "{other}");
}

#[test]
fn a_trial_that_is_fitted_is_not_tested_on_under_another_name() {
    let scratch = Scratch::new();
    scratch.loops("a.csv", 30.0, 1.1);
    fs::copy(scratch.path("a.csv"), scratch.path("b.csv")).unwrap();
    let mut set = "name = 's'\nrate_hz = 100\n".to_owned();
    for (name, split) in [("a", "fit"), ("b", "test")] {
        let _ = writeln!(set, "[[trial]]\nfile = '{name}.csv'\nkind = 'other'\nsplit = '{split}'");
    }
    scratch.write("dataset.toml", set);
    let told = ["b.csv is a test trial, and it holds the samples of a.csv, which is fitted"];
    fails(stretch().arg("diagnose").arg(scratch.path("")), &told);
    let trials = "[[trial]]\nfile = \"a.csv\"\n[[trial]]\nfile = \"b.csv\"\nsplit = \"test\"\n";
    let stage = "[[stage]]\noutput = \"bridge_v\"\ninputs = [\"length_mm\"]\n";
    let problem = scratch.write("p.toml", format!("simulator = [\"true\"]\n{stage}{trials}"));
    fails(stretch().arg("diagnose").arg(problem), &told);
    // fitted twice, it weighs double
    let out = calibrate(&scratch.path("a.csv"), &scratch.path("c.json"))
        .arg(scratch.path("b.csv"))
        .output();
    let out = out.unwrap();
    let said = one_line(&String::from_utf8_lossy(&[out.stdout, out.stderr].concat()));
    assert!(said.contains("b.csv holds the samples of a.csv: they weigh double"), "{said}");
}

const PROBLEM: &str = r#"
[simulator]
command = ["false"]
start_s = 5
[[stage]]
name = "plant"
output = "angle_deg"
inputs = ["command_V"]
noise = 0.1
[[input]]
column = "command_V"
unit = "V"
[[effect]]
name = "brake"
unit = "deg"
range = [0, 20]
off = 0
twins = ["output.backlash"]
[[trial]]
file = "a.csv"
"#;

#[test]
fn entries_of_a_problem_that_cannot_be_are_refused() {
    let scratch = Scratch::new();
    let row = |i: u32| format!("{:.2},{},{}\n", 0.01 * f64::from(i), (i / 50) % 3, (i / 40) % 7);
    let rows: String = (0..800).map(row).collect();
    scratch.write("a.csv", format!("time_s,command_V,angle_deg\n{rows}"));
    let own = "stage plant: its output angle_deg is one of its inputs";
    let cases = [
        (
            "noise = 0.1",
            "noise = 1e12",
            "a noise of 1000000000000 hides all of angle_deg, which spans 6",
        ),
        ("unit = \"V\"", "unit = \"V\"\nnoise = 1e12", "hides all of command_V, which spans 2"),
        ("noise = 0.1", "unit = \"kg\"", "its unit is kg, and its column angle_deg is in deg"),
        ("off = 0", "off = -3", "off = -3 is outside of its range, 0 to 20"),
        ("[\"command_V\"]", "[\"command_V\", \"angle_deg\"]", own),
        ("output.backlash", "output.backslash", "effect brake: there is no twin output.backslash"),
        ("\"a.csv\"", "\"a.csv\"\nsplit = \"test\"", "no trial may be fitted"),
        // what a clock cannot reach is no panic
        ("start_s = 5", "start_s = 1e19\ndeadline_s = 1e19", "it closed its standard output"),
        ("start_s = 5", "start_s = 5", "it closed its standard output"),
    ];
    for (from, to, told) in cases {
        assert!(PROBLEM.contains(from), "{from}");
        let path = scratch.write("p.toml", PROBLEM.replacen(from, to, 1));
        fails(stretch().arg("diagnose").arg(path), &[told]);
    }
}

#[test]
fn a_gap_in_time_is_told_as_a_gap() {
    let scratch = Scratch::new();
    let text = fs::read_to_string(scratch.loops("a.csv", 30.0, 1.1)).unwrap();
    let mut lines = text.lines();
    let mut late = format!("{}\n", lines.next().unwrap());
    for (n, line) in lines.enumerate() {
        let (time, rest) = line.split_once(',').unwrap();
        let time_s: f64 = time.parse().unwrap();
        let _ = writeln!(late, "{:.2},{rest}", if n < 1500 { time_s } else { time_s + 1e7 });
    }
    let path = scratch.write("late.csv", late);
    let told =
        ["late.csv: a grid of 100 Hz has 1.0e9 instants in its 1000", "at the gap in its time"];
    let convert = ["convert", "late.csv", "--grid", "100", "--out", "even.csv"];
    fails(stretch().current_dir(scratch.path("")).args(convert), &told);
    let said = calibrate(&path, &scratch.path("c.json")).output().unwrap();
    let said = one_line(&String::from_utf8_lossy(&[said.stdout, said.stderr].concat()));
    assert!(said.contains("s are missing after 14.99 s"), "{said}");
    // more samples than a gap's count can hold
    let longer = fs::read_to_string(&path).unwrap().replace("\n100000", "\n999900000");
    scratch.write("longer.csv", longer);
    let said =
        warned(&scratch, &["apply", "--calibration", "c.json", "longer.csv", "--out", "o.csv"]);
    assert!(said.contains("time stamps: at least 42949672"), "{said}");
}

#[test]
fn stamps_that_come_early_and_late_have_the_rate_that_they_have() {
    let scratch = Scratch::new();
    let mut text = String::from("time_s,length_mm,bridge_v\n");
    for n in 0..3000_u32 {
        let late_s = [0.0, 0.004, -0.004][(11 * n * n / 5 % 3) as usize];
        let t = f64::from(n) * 0.01;
        let length = 165.0 + 14.0 * (1.1 * t).cos() * (0.31 * t).cos();
        writeln!(text, "{:.4},{length:.4},{:.5}", t + late_s, 1.24 + 0.033 * (180.0 - length))
            .unwrap();
    }
    let path = scratch.write("jitter.csv", text);
    let out = calibrate(&path, &scratch.path("c.json")).output().unwrap();
    let said = one_line(&String::from_utf8_lossy(&[out.stdout, out.stderr].concat()));
    assert!(said.contains("resampled to every 0.0100 s"), "{said}");
}

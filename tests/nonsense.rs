//! Logs and records that do not belong to what is asked of them: it is said, and nothing is written.

use std::{fmt::Write, fs};

use crate::support::{Scratch, calibrate, fails, one_line, runs, stretch};
use testkit::random::unit;

/// The rows of a trial, each changed by its number.
fn changed(
    scratch: &Scratch,
    name: &str,
    change: impl Fn(usize, &mut [String]),
) -> std::path::PathBuf {
    let text = fs::read_to_string(scratch.loops("whole.csv", 40.0, 1.1)).unwrap();
    let mut out = String::from("time_s,length_mm,bridge_v\n");
    for (n, line) in text.lines().skip(1).enumerate() {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        change(n, &mut cells);
        writeln!(out, "{}", cells.join(",")).unwrap();
    }
    scratch.write(name, out)
}

/// Standard error of a command that succeeds.
fn warned(command: &mut assert_cmd::Command) -> String {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    one_line(&String::from_utf8_lossy(&output.stderr))
}

#[test]
fn wild_values_are_counted_told_and_left_out() {
    let scratch = Scratch::new();
    let out = scratch.path("cal.json");
    for (column, value) in [(1, "-999"), (1, "9999.5"), (2, "65535")] {
        let log = changed(&scratch, "log.csv", |n, cells| {
            if n % 50 == 17 {
                cells[column] = value.to_owned();
            }
        });
        let told = runs(&mut calibrate(&log, &out));
        assert!(told.contains("80 of 4000 values of"), "{value}: {told}");
        assert!(told.contains("are gross errors") && told.contains(value), "{told}");
        let whole = scratch.path("whole.csv");
        let mut evaluate = stretch();
        evaluate.args(["evaluate", "--json", "--calibration"]).arg(&out).arg(&whole);
        let judged: serde_json::Value = serde_json::from_str(&runs(&mut evaluate)).unwrap();
        let rmse = judged["pooled"][1]["rmse"].as_f64().unwrap();
        // as good as from the log without them, to a tenth
        let mut evaluate = stretch();
        runs(&mut calibrate(&whole, &scratch.path("sound.json")));
        evaluate.args(["evaluate", "--json", "--calibration"]).arg(scratch.path("sound.json"));
        let sound: serde_json::Value = serde_json::from_str(&runs(evaluate.arg(&whole))).unwrap();
        let sound = sound["pooled"][1]["rmse"].as_f64().unwrap();
        assert!(rmse < 1.1 * sound, "{rmse} mm, {sound} mm without wild values");
    }
}

#[test]
fn a_fit_that_explains_nothing_is_refused_and_written_when_forced() {
    let scratch = Scratch::new();
    let out = scratch.path("cal.json");
    let dead = changed(&scratch, "dead.csv", |n, cells| {
        cells[2] = format!("{:.5}", 1.65 + 0.002 * unit(n));
    });
    // a recorder that made up more than can be told from a motion: half of the lengths, in between
    let made_up = changed(&scratch, "made_up.csv", |n, cells| {
        cells[1] = format!("{:.4}", 150.0 + 30.0 * unit(n));
    });
    // a dead sensor has no branches either: a surface is refused for that
    for (log, models) in [(dead, &["linear"][..]), (made_up, &["linear", "poly13"])] {
        for model in models {
            let mut command = calibrate(&log, &out);
            command.args(["--model", model, "--report"]).arg(scratch.path("r.html"));
            let parts = ["explains nothing", "R^2", "sensor that is not connected", "--force"];
            fails(&mut command, &parts);
            assert!(!out.exists() && !scratch.path("r.html").exists(), "{model}");
        }
        let told = runs(calibrate(&log, &out).args(["--force", "--model", models[0]]));
        assert!(told.contains("explains nothing") && told.contains("--force"), "{told}");
        fs::remove_file(&out).unwrap();
    }
}

#[test]
fn a_log_that_does_not_belong_to_the_record_is_said_to_be_none_of_its_own() {
    let scratch = Scratch::new();
    let record = scratch.calibration("cal.json");
    let apply = |log: &std::path::Path| {
        let mut command = stretch();
        command.arg("apply").arg("--calibration").arg(&record).arg(log);
        command.arg("--out").arg(scratch.path("out.csv"));
        warned(&mut command)
    };
    let evaluate = |log: &std::path::Path| {
        let mut command = stretch();
        command.arg("evaluate").arg("--calibration").arg(&record).arg(log);
        warned(&mut command)
    };
    let own = scratch.loops("own.csv", 20.0, 1.0);
    assert!(apply(&own).contains("outside of what was calibrated"), "the count is always told");
    for said in [apply(&own), evaluate(&own)] {
        assert!(!said.contains("is this a log of that"), "{said}");
    }
    // millivolts for volts
    let other_unit = changed(&scratch, "millivolts.csv", |_, cells| {
        cells[2] = format!("{:.2}", 1000.0 * cells[2].parse::<f64>().unwrap());
    });
    for said in [apply(&other_unit), evaluate(&other_unit)] {
        assert!(said.contains("samples lie outside the range of the calibration"), "{said}");
        assert!(said.contains("are they in mV? divided by 1000,"), "{said}");
    }
    // metres for millimetres
    let other_reference = changed(&scratch, "metres.csv", |_, cells| {
        cells[1] = format!("{:.7}", 0.001 * cells[1].parse::<f64>().unwrap());
    });
    let said = evaluate(&other_reference);
    assert!(said.contains("errs more than the mean of the reference would"), "{said}");
    assert!(said.contains("does not belong to that calibration"), "{said}");
    // live, at the end of the stream
    let mut command = stretch();
    command.args(["apply", "-", "--calibration"]).arg(&record);
    let said = warned(command.write_stdin(fs::read(&other_unit).unwrap()));
    assert!(said.contains("are they in mV?"), "{said}");
}

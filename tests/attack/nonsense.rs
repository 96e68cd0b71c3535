//! Logs and calibration files that do not fit the command are refused, and nothing is written.

use std::{fmt::Write, fs};

use crate::support::{Scratch, calibrate, fails, runs, stretch, warned};
use testkit::random::unit;

/// Writes a trial whose rows are changed depending on their numbers.
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
        let told = warned(&mut calibrate(&log, &out));
        assert!(told.contains("80 of 4000 values of"), "{value}: {told}");
        assert!(told.contains("are gross errors") && told.contains(value), "{told}");
        let whole = scratch.path("whole.csv");
        let mut evaluate = stretch();
        evaluate.args(["evaluate", "--json", "--calibration"]).arg(&out).arg(&whole);
        let judged: serde_json::Value = serde_json::from_str(&runs(&mut evaluate)).unwrap();
        let rmse = judged["pooled"][1]["rmse"].as_f64().unwrap();
        // The error is at most 10 % larger than with the log without gross errors.
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
    // A recorder that replaced half of the lengths by random values between the extremes, too many
    // for removal.
    let made_up = changed(&scratch, "made_up.csv", |n, cells| {
        cells[1] = format!("{:.4}", 150.0 + 30.0 * unit(n));
    });
    // A dead sensor has no branches either, so a surface is refused for another reason.
    for (log, models) in [(dead, &["linear"][..]), (made_up, &["linear", "poly13"])] {
        for model in models {
            let mut command = calibrate(&log, &out);
            command.args(["--model", model, "--report"]).arg(scratch.path("r.html"));
            let parts = ["explains nothing", "R^2", "the sensor is not connected", "--force"];
            fails(&mut command, &parts);
            assert!(!out.exists() && !scratch.path("r.html").exists(), "{model}");
        }
        let told = warned(calibrate(&log, &out).args(["--force", "--model", models[0]]));
        assert!(told.contains("explains nothing") && told.contains("--force"), "{told}");
        fs::remove_file(&out).unwrap();
    }
}

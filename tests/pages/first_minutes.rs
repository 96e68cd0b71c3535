//! Problems that stopped new users in their first minutes.

use std::{fmt::Write, fs, path::Path};

use super::markdown::{blocks, read};
use crate::support::{Scratch, fails, one_line, program, runs, stretch};

/// A trial of one minute at 20 Hz in centimetres, with short column names.
fn own_trial(header: &str, factor: f64) -> String {
    let mut text = format!("{header}\n");
    for n in 0..1200 {
        let t = 0.05 * f64::from(n);
        let length_cm = 16.5 + 1.4 * (1.1 * t).cos() * (0.31 * t).cos();
        let wobble = f64::from(n * 7919 % 101) * 1e-5;
        let volts = 1.24 + 0.33 * (18.0 - length_cm) + wobble;
        writeln!(text, "{t:.2},{:.4},{volts:.5}", factor * length_cm).expect("a text");
    }
    text
}

#[test]
fn own_columns_are_asked_for_with_the_options_that_name_them() {
    let scratch = Scratch::new();
    let log = scratch.write("log.csv", own_trial("t,L,V", 1.0));
    let mut calibrate = stretch();
    calibrate.arg("calibrate").arg(&log).arg("--out").arg(scratch.path("cal.json"));
    let says = "the columns are t, L, V; name your columns with --reference and --signal";
    fails(&mut calibrate, &["there is no column length_mm", says]);
    runs(calibrate.args(["--reference", "L", "--signal", "V"]));
}

#[test]
fn a_log_at_another_rate_is_told_to_be_brought_onto_the_calibration_s() {
    let scratch = Scratch::new();
    let fast = scratch.loops("fast.csv", 30.0, 1.1);
    let record = scratch.path("cal.json");
    runs(stretch().arg("calibrate").arg(&fast).args(["--model", "poly13", "--out"]).arg(&record));
    let slow = scratch.write("slow.csv", own_trial("time_s,length_mm,bridge_v", 10.0));
    let mut evaluate = stretch();
    evaluate.args(["evaluate", "--calibration"]).arg(&record).arg(&slow);
    let says = "it has 20 samples a second, but the calibration needs 100: resample it (stretch convert OLD --grid 100 --out NEW.csv)";
    fails(&mut evaluate, &["slow.csv: no sample has an estimate", says]);
    let even = scratch.path("even.csv");
    runs(stretch().arg("convert").arg(&slow).args(["--grid", "100", "--out"]).arg(&even));
    runs(stretch().args(["evaluate", "--calibration"]).arg(&record).arg(&even));
}

#[test]
fn a_diagnosis_says_as_much_as_is_asked_for() {
    let scratch = Scratch::new();
    let bench = scratch.path("bench");
    runs(stretch().args(["simulate", "--protocol", "pulses", "--out"]).arg(&bench));
    let said = |volume: &[&str]| {
        let mut command = stretch();
        command.arg("diagnose").arg(bench.join("pulses_1.csv")).arg("--no-next").args(volume);
        command.args(["--reference", "length_mm", "--signal", "bridge_v"]);
        runs(&mut command)
    };
    let (quiet, usual, verbose) = (said(&["-q"]), said(&[]), said(&["-v"]));
    // All outputs begin with the verdict.
    assert!(
        one_line(&usual).starts_with(&one_line(&quiet)) && quiet.lines().count() < 5,
        "{quiet}"
    );
    assert!(!quiet.contains('|') && usual.contains('|'));
    // By default one line on the parameters, and one line for each with -v.
    let lines = |text: &str| text.lines().filter(|line| line.starts_with("- ")).count();
    assert!(one_line(&usual).contains("-v lists the reasons for the others"), "{usual}");
    assert!(lines(&verbose) > lines(&usual), "{verbose}");
}

#[cfg(unix)]
#[test]
fn the_action_fails_where_simulator_and_rig_disagree_and_keeps_the_report() {
    let scratch = Scratch::new();
    let action = read(Path::new("action.yml"));
    let line = action.lines().find_map(|line| line.trim().strip_prefix("run: stretch diagnose"));
    let typed = format!("\"$STRETCH\" diagnose{}", line.expect("a command"));
    for (effect, status) in [(None, 0), (Some("gauge_hysteresis:h=0.2,s=0.012"), 3)] {
        let bench = scratch.path(&format!("bench_{status}"));
        let mut simulate = stretch();
        simulate.args(["simulate", "--protocol", "pulses", "--out"]).arg(&bench);
        runs(simulate.args(effect.map(|effect| ["--effect", effect]).iter().flatten()));
        let report = scratch.path(&format!("report_{status}.html"));
        let mut shell = std::process::Command::new("bash");
        shell.args(["-euc", &typed]).env("STRETCH", program().canonicalize().expect("the program"));
        shell.env("DATA", &bench).env("RIG", "").env("FAIL_ON", "gap").env("REPORT", &report);
        let said = shell.output().expect("bash");
        assert_eq!(said.status.code(), Some(status), "{}", String::from_utf8_lossy(&said.stderr));
        assert!(fs::read_to_string(&report).expect("a report").contains("</html>"));
    }
}

#[test]
#[ignore = "needs python3; ./ci.sh runs it"]
fn with_python_a_worker_that_takes_no_other_inputs_is_diagnosed_as_init_proposes() {
    let scratch = Scratch::new();
    let folder = scratch.path("recordings");
    fs::create_dir(&folder).expect("a folder");
    // The worker of the tutorial, without the declaration that it takes altered inputs.
    let page = read(Path::new("book/src/tutorials/worker.md"));
    for block in blocks(&page) {
        if let Some(file) = block.file {
            scratch.write(file, block.text.replace("\"inputs\": True, ", ""));
        }
    }
    let mut python = std::process::Command::new("python3");
    assert!(
        python.arg("record.py").current_dir(scratch.path("")).status().expect("python3").success()
    );
    runs(stretch().arg("init").arg(&folder));
    let file = folder.join("problem.toml");
    let parameter = |name: &str, unit: &str, value: f64| {
        format!(
            "\n[[parameter]]\nname = \"{name}\"\nunit = \"{unit}\"\nvalue = {value}\ntolerance = \"10 %\"\n"
        )
    };
    let proposed = fs::read_to_string(&file).expect("the problem");
    assert!(proposed.contains("wrap = \"all\""), "{proposed}");
    let whole = "budget = 400\n".to_owned()
        + &proposed
        + &parameter("gain", "deg/V", 10.0)
        + &parameter("tau", "s", 0.1);
    fs::write(&file, whole).expect("the problem");
    let told = one_line(&runs(stretch().arg("diagnose").arg(&file)));
    assert!(told.contains("no effect was looked for in front of a stage"), "{told}");
    // A brake in front of the servo is not among the effects behind it.
    assert!(told.starts_with("There is a gap in plant"), "{told}");
}

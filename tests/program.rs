//! The program, run as a user would.

use std::{
    io::{BufRead, BufReader, Write},
    process::{Command, Stdio},
    time::Duration,
};

use crate::support::{Scratch, calibrate, one_line, program, runs, stdout, stretch, warned};
use serde_json::Value;

#[test]
fn calibrate_apply_evaluate() {
    let scratch = Scratch::new();
    let fit = [scratch.loops("a.csv", 40.0, 1.1), scratch.loops("b.csv", 40.0, 1.7)];
    let test = scratch.loops("c.csv", 30.0, 1.4);
    let (linear, poly13) = (scratch.path("linear.json"), scratch.path("poly13.json"));
    for (model, out) in [("linear", &linear), ("poly13", &poly13)] {
        let mut command = stretch();
        command.arg("calibrate").args(&fit).args(["--model", model]);
        command.arg("--out").arg(out).assert().success();
    }
    let output = stretch()
        .args(["evaluate", "--json", "--calibration"])
        .arg(&linear)
        .arg("--calibration")
        .arg(&poly13)
        .arg(&test)
        .output()
        .unwrap();
    let evaluation: Value = serde_json::from_slice(&output.stdout).unwrap();
    let rmse = |method: usize| evaluation["pooled"][method]["rmse"].as_f64().unwrap();
    assert_eq!(evaluation["unit"], "mm");
    assert_eq!(evaluation["pooled"][2]["method"], "poly13");
    // The gauge lags by 30 ms, which only a model with a rate can compensate.
    assert!(rmse(2) < 0.5 * rmse(1), "poly13 {} mm, linear {} mm", rmse(2), rmse(1));

    let out = scratch.path("estimates.csv");
    stretch()
        .arg("apply")
        .arg("--calibration")
        .arg(&poly13)
        .arg(&test)
        .arg("--out")
        .arg(&out)
        .assert()
        .success();
    let text = std::fs::read_to_string(&out).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("time_s,estimate_mm,rate_mm_per_s,branch,domain"));
    assert_eq!(lines.next(), Some("0,,,,warming"));
    let (mut squares, mut count) = (0.0, 0);
    let truth = std::fs::read_to_string(&test).unwrap();
    for (estimate, truth) in text.lines().zip(truth.lines()).skip(12) {
        let (estimate, truth): (Vec<_>, Vec<_>) =
            (estimate.split(',').collect(), truth.split(',').collect());
        assert!(["rising", "falling"].contains(&estimate[3]), "{estimate:?}");
        squares += (estimate[1].parse::<f64>().unwrap() - truth[1].parse::<f64>().unwrap()).powi(2);
        count += 1;
    }
    assert_eq!(count, 2989);
    assert!((squares / 2990.0_f64).sqrt() < 1.2 * rmse(2) + 0.01);
}

#[test]
fn a_report_opens_without_a_network() {
    let scratch = Scratch::new();
    let trial = scratch.loops("a.csv", 30.0, 1.1);
    let report = scratch.path("r.html");
    calibrate(&trial, &scratch.path("cal.json")).arg("--report").arg(&report).assert().success();
    let html = std::fs::read_to_string(report).unwrap();
    assert!(html.contains("<svg") && html.contains("poly13") && html.contains("</html>"));
    let elsewhere = html.replace("http://www.w3.org/2000/svg", "");
    assert!(!elsewhere.contains("http://") && !elsewhere.contains("https://"));
}

#[test]
fn a_postcard_record_says_the_same_as_json() {
    let scratch = Scratch::new();
    let trial = scratch.loops("a.csv", 30.0, 1.1);
    let mut outputs = Vec::new();
    for name in ["cal.json", "cal.postcard"] {
        let record = scratch.path(name);
        calibrate(&trial, &record).assert().success();
        let output =
            stretch().arg("apply").arg("--calibration").arg(&record).arg(&trial).output().unwrap();
        assert!(output.status.success());
        outputs.push(output.stdout);
    }
    assert!(std::fs::metadata(scratch.path("cal.postcard")).unwrap().len() < 600);
    assert_eq!(outputs[0], outputs[1]);
}

#[test]
fn other_columns_and_units() {
    let scratch = Scratch::new();
    let mut text = String::from("t_ms;angle_deg;s1;s2\n");
    for n in 0..3000 {
        let angle = 45.0 - 45.0 * (0.012 * f64::from(n)).cos();
        let wobble = f64::from(n * 7919 % 101) / 101.0;
        text += &format!("{};{angle};{};{}\n", 10 * n, wobble, 0.002 * angle);
    }
    let trial = scratch.write("knee.csv", text);
    let record = scratch.path("cal.json");
    let output = calibrate(&trial, &record)
        .args(["--time", "t_ms", "--reference", "angle_deg", "--signal", "auto", "--json"])
        .output()
        .unwrap();
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["signal"], "s2", "the other is noise");
    let mut worse = calibrate(&trial, &scratch.path("worse.json"));
    worse.args(["--time", "t_ms", "--reference", "angle_deg", "--signal", "auto:s2,s1"]);
    worse.args(["--model", "poly10", "--force"]);
    let doubt = one_line(&warned(&mut worse));
    assert!(doubt.contains("poly10 is worse than a straight line"), "{doubt}");
    let said = one_line(&runs(&mut worse));
    assert!(said.contains("RMSE of the signals, % of range: s"), "{said}");
    let output = stretch()
        .args(["apply", "--time", "t_ms", "--calibration"])
        .arg(&record)
        .arg(&trial)
        .output()
        .unwrap();
    assert!(stdout(&output).starts_with("time_s,estimate_deg,rate_deg_per_s,branch,domain\n"));
}

#[test]
fn convert_renames_and_scales() {
    let scratch = Scratch::new();
    let log = scratch.write("log.csv", "t_ms,pos,adc\n1000,0.18,1000\n1010,0.179,1010\n");
    let out = scratch.path("trial.csv");
    stretch()
        .arg("convert")
        .arg(&log)
        .args(["--time", "t_ms", "--from-zero", "--column", "length_mm=pos*1000"])
        .args(["--column", "bridge_v=adc*0.001+0.24", "--out"])
        .arg(&out)
        .assert()
        .success();
    let text = std::fs::read_to_string(out).unwrap();
    assert_eq!(text, "time_s,length_mm,bridge_v\n0,180,1.24\n0.01,179,1.25\n");
}

#[test]
fn live_each_line_is_answered_as_it_comes() {
    let scratch = Scratch::new();
    let calibration = scratch.calibration("cal.json");
    let mut child = Command::new(program())
        .args(["apply", "--calibration"])
        .arg(&calibration)
        .arg("-")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = child.stdin.take().unwrap();
    let mut answers = BufReader::new(child.stdout.take().unwrap()).lines();
    writeln!(input, "bridge_v,time_s").unwrap();
    assert!(answers.next().unwrap().unwrap().starts_with("time_s,estimate_mm"));
    for n in 0..20 {
        // Each estimate is read before the next line is written, so buffered output would hang
        // here.
        writeln!(input, "1.5,{:.2}", 0.01 * f64::from(n)).unwrap();
        let answer = answers.next().unwrap().unwrap();
        assert_eq!(answer.ends_with("warming"), n < 10, "{answer}");
    }
    drop(input);
    assert!(answers.next().is_none());
    assert!(child.wait().unwrap().success());
}

#[cfg(unix)]
fn interrupt(child: &std::process::Child) {
    let pid = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &pid]).status().unwrap().success());
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_a_recording_and_keeps_what_came() {
    let scratch = Scratch::new();
    let calibration = scratch.calibration("cal.json");
    let out = scratch.path("live.csv");
    let mut child = Command::new(program())
        .args(["apply", "--calibration"])
        .arg(&calibration)
        .arg("-")
        .arg("--out")
        .arg(&out)
        .stdin(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = child.stdin.take().unwrap();
    writeln!(input, "time_s,bridge_v").unwrap();
    for n in 0..50 {
        writeln!(input, "{:.2},1.5", 0.01 * f64::from(n)).unwrap();
    }
    std::thread::sleep(Duration::from_millis(500));
    assert!(!out.exists(), "whole or not at all");
    interrupt(&child);
    assert!(child.wait().unwrap().success());
    assert_eq!(std::fs::read_to_string(&out).unwrap().lines().count(), 51);
    drop(input);
}

#[cfg(unix)]
#[test]
fn ctrl_c_in_the_middle_leaves_no_partial_file() {
    let scratch = Scratch::new();
    let calibration = scratch.calibration("cal.json");
    // A pipe that stays open keeps the program running.
    let fifo = scratch.path("pipe.csv");
    assert!(Command::new("mkfifo").arg(&fifo).status().unwrap().success());
    let before = scratch.names();
    let child = Command::new(program())
        .args(["apply", "--calibration"])
        .arg(&calibration)
        .arg(&fifo)
        .arg("--out")
        .arg(scratch.path("out.csv"))
        .spawn()
        .unwrap();
    let mut writer = std::fs::File::options().write(true).open(&fifo).unwrap();
    writeln!(writer, "time_s,bridge_v\n0,1.5").unwrap();
    std::thread::sleep(Duration::from_millis(300));
    interrupt(&child);
    let mut child = child;
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(scratch.names(), before);
}

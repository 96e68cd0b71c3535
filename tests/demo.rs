//! `stretch demo`, run as a user would.

use std::{fs, path::Path};

use crate::support::{Scratch, fails, runs, stretch};
use serde_json::Value;
use testkit::page::without_program;

/// Asserts that the report contains calibration and diagnosis of `compared`, and needs no network.
fn holds_both_parts(out: &Path, compared: &str) {
    let page = without_program(&fs::read_to_string(out.join("report.html")).unwrap());
    for heading in
        ["How good it is", "The surfaces (non-linear)", "Where the gap sits", "Which effect"]
    {
        assert_eq!(page.matches(&format!("<h2>{heading}")).count(), 1, "{heading}");
    }
    assert!(page.contains(&format!(": {compared}</h")) && !page.contains("NaN"));
    assert_eq!(page.matches("<!DOCTYPE html>").count(), 1);
    // Each part begins with a picture.
    let parts: Vec<&str> = page.split("<p class=\"verdict\">").skip(1).collect();
    assert_eq!(parts.len(), 2);
    for part in parts {
        assert!(part.find("<figure>").unwrap() < part.find("<table").unwrap());
    }
    let elsewhere = page.replace("http://www.w3.org/2000/svg", "");
    assert!(!elsewhere.contains("http://") && !elsewhere.contains("https://"));
}

/// Returns the RMSE of raw signal, linear, non-linear and the chosen model.
fn rmse(methods: &Value) -> [f64; 4] {
    [0, 1, 2, 3].map(|i| methods[i]["rmse"].as_f64().unwrap())
}

#[test]
#[ignore = "the whole demo, half a minute; ./ci.sh runs it"]
fn the_demo_does_the_whole_job_without_anybody_s_data() {
    let scratch = Scratch::new();
    let out = scratch.path("demo");
    let mut command = stretch();
    command.env("STRETCH_DATA", scratch.path("nothing")).args(["demo", "--json"]);
    let said: Value = serde_json::from_str(&runs(command.arg("--out").arg(&out))).unwrap();
    assert_eq!(said["seed"], 3);
    // The simulated rig has memory, which the paper's surfaces do not model.
    for kind in [0, 1] {
        let [_, linear, surfaces, chosen] = rmse(&said["kinds"][kind][1]);
        assert!(surfaces < linear && chosen < surfaces, "{}", said["kinds"][kind]);
    }
    let kinds = [&said["kinds"][0][0], &said["kinds"][1][0]];
    assert_eq!(kinds, ["arbitrary", "pulses"]);
    let mut named: Vec<&str> =
        said["diagnosis"]["named"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    named.sort_unstable();
    assert_eq!(named, ["gauge_nonlinearity", "gauge_relaxation", "muscle_hysteresis"]);
    assert_eq!(said["diagnosis"]["verdict"], "effect");
    holds_both_parts(&out, "simulator against rig");
    for name in ["linear.json", "poly13.json", "chosen.json", "estimates.csv", "estimate.svg"] {
        assert!(out.join(name).metadata().unwrap().len() > 100, "{name}");
    }
    // A second diagnosis with the corrected rig file finds nothing.
    let fixed = scratch.path("fixed.toml");
    let diagnose = || {
        let mut command = stretch();
        command.arg("diagnose").arg(out.join("bench")).args(["--no-next", "--json"]);
        command
    };
    runs(diagnose().arg("--fix").arg(&fixed));
    let again: Value = serde_json::from_str(&runs(diagnose().arg("--rig").arg(&fixed))).unwrap();
    assert_eq!(again["verdict"], "no_gap", "{}", again["sentence"]);
    // The demo's data set and calibration file can be used like any others.
    let mut command = stretch();
    command.args(["evaluate", "--json", "--calibration"]).arg(out.join("chosen.json"));
    let same: Value = serde_json::from_str(&runs(command.arg(out.join("bench")))).unwrap();
    assert_eq!(same["pooled"][1]["rmse"], said["evaluation"]["pooled"][3]["rmse"]);
}

#[test]
#[ignore = "needs measured data: ../shared/data, or what STRETCH_DATA names; ./ci.sh runs it"]
fn with_data_measured_sessions_take_the_same_way() {
    let sleeve = testkit::measured::folder("knit_sleeve");
    let scratch = Scratch::new();
    let out = scratch.path("demo");
    let mut command = stretch();
    command.args(["demo", "--data"]).arg(sleeve.join("heel_curl_90")).arg("--out");
    let text = runs(command.arg(&out).arg("--json"));
    let said: Value = serde_json::from_str(&text).unwrap();
    let [raw, linear, surfaces, chosen] = rmse(&said["evaluation"]["pooled"]);
    assert!(surfaces < linear && surfaces < raw && chosen < surfaces, "{text}");
    // The built-in rig is no model of this machine. Even if an effect closes a part of the gap,
    // more is left than a form explains.
    let verdict = said["diagnosis"]["verdict"].as_str().unwrap();
    assert!(["partial", "unknown"].contains(&verdict), "{verdict}");
    let closed = said["diagnosis"]["candidates"][0]["closed"].as_f64().unwrap();
    assert!(closed < 0.95, "{text}");
    holds_both_parts(&out, "calibration line against gauge");
    let command = &mut stretch();
    command.args(["demo", "--data"]).arg(sleeve.join("heel"));
    command.arg("--out").arg(scratch.path("other"));
    fails(command, &["no group of sessions heel", "heel_curl_45, heel_curl_90, lift_up"]);
}

#[test]
fn sessions_that_cannot_be_used_are_refused_with_a_way_out() {
    let scratch = Scratch::new();
    let run = |path: &Path| {
        let mut command = stretch();
        command.args(["demo", "--data"]).arg(path).arg("--out").arg(scratch.path("out"));
        command
    };
    fails(&mut run(&scratch.path("none")), &["no such folder", "e-Body-Lab", "47369abac95f"]);
    let one = scratch.loops("alone.csv", 20.0, 1.1);
    fails(&mut run(&one), &["alone.csv: alone is a single session", "another to test on"]);
    fs::create_dir(scratch.path("empty")).unwrap();
    fails(&mut run(&scratch.path("empty")), &["neither a dataset.toml nor a CSV file"]);
    let pair = scratch.path("pair");
    fs::create_dir(&pair).unwrap();
    for name in ["a_1.csv", "a_2.csv"] {
        fs::write(pair.join(name), "time_s,turn_rad,s1\n0,1,2\n0.01,2,3\n").unwrap();
    }
    fails(&mut run(&pair), &["name the reference with --reference", "turn_rad, s1"]);
}

//! `stretch diagnose` for a gauge alone, run as a user would.

use std::{
    f64::consts::TAU,
    fs,
    path::{Path, PathBuf},
};

use crate::support::{Scratch, fails, json_to, one_line, prints, runs, stretch, warned};
use approx::assert_abs_diff_eq;
use serde_json::Value;
use testkit::{page::without_program, random::unit, tolerance::SKEW_FOUND_S};

/// Returns the position of a joint at a time, degrees.
fn joint(t: f64) -> f64 {
    40.0 + 25.0 * (TAU * 0.31 * t).sin() + 12.0 * (TAU * 0.83 * t).sin()
}

/// Writes a trial of one minute: a reference, and a signal that lags it by 0.12 s.
fn record(file: &Path, header: &str, scale: f64, begin_s: f64) {
    let mut text = header.to_owned() + "\n";
    for i in 0..6000 {
        let t = 0.01 * i as f64;
        let x = scale * (joint(begin_s + t) + 0.01 * (2.0 * unit(7 * i + 1) - 1.0));
        let y = 0.3 + 0.02 * joint(begin_s + t - 0.12) + 0.004 * (2.0 * unit(7 * i + 3) - 1.0);
        text += &format!("{t:.2},{x:.6},{y:.5}\n");
    }
    fs::write(file, text).unwrap();
}

fn folder(scratch: &Scratch, name: &str, header: &str, rig: Option<&str>) -> PathBuf {
    let folder = scratch.path(name);
    fs::create_dir(&folder).unwrap();
    let mut text = "name = \"joint\"\nrate_hz = 100.0\n".to_owned();
    if let Some(rig) = rig {
        fs::write(folder.join("gauge.toml"), rig).unwrap();
        text += "rig = \"gauge.toml\"\n";
    }
    for (i, (file, split)) in [("a.csv", "fit"), ("b.csv", "test")].iter().enumerate() {
        let start = 80.0 * i as f64;
        record(&folder.join(file), header, 1.0, start);
        text += &format!(
            "[[trial]]\nfile = \"{file}\"\nkind = \"other\"\nstart_s = {start:.1}\nsplit = \"{split}\"\n"
        );
    }
    fs::write(folder.join("dataset.toml"), text).unwrap();
    folder
}

const GAUGE: &str = "kind = \"gauge\"\n[sensing]\nzero = { value = 3.0 }\nspan = { value = 74.0 }\n\
                     offset = { value = 0.36 }\ngain = { value = 1.48 }\n";

#[test]
fn a_gauge_is_told_by_columns_rig_file_or_missing_openings() {
    let scratch = Scratch::new();
    let named = |text: &str| {
        let first = text.lines().next().unwrap();
        assert!(first.contains("the time offset between signal and reference"), "{text}");
    };
    // One trial and two columns. Report and JSON agree with the text.
    let file = scratch.path("joint.csv");
    record(&file, "time_s,angle_deg,s2", 1.0, 0.0);
    let (json, page) = (scratch.path("d.json"), scratch.path("d.html"));
    let mut command = stretch();
    command.arg("diagnose").arg(&file).args(["--reference", "angle_deg", "--signal", "s2"]);
    named(&runs(command.arg(json_to(&json)).arg("--report").arg(&page)));
    let d: Value = serde_json::from_str(&fs::read_to_string(&json).unwrap()).unwrap();
    assert_eq!((d["verdict"].as_str(), &d["named"][0]), (Some("effect"), &"channel_skew".into()));
    let skew = d["candidates"][0]["parameters"]["skew_s"].as_f64().unwrap();
    assert_abs_diff_eq!(skew, 0.12, epsilon = SKEW_FOUND_S);
    assert_eq!(d["shares"][0]["effect"], "channel_skew");
    assert!(d["sentence"].as_str().unwrap().starts_with("The calibration line lacks"));
    let page = without_program(&fs::read_to_string(page).unwrap());
    assert!(page.contains("channel_skew") && page.contains("deg") && !page.contains("NaN"));
    assert!(page.contains("calibration line against gauge") && !page.contains("simulator"));
    // A data set whose rig file describes a gauge, with named columns. The default columns need not
    // be named.
    let set = folder(&scratch, "kind", "time_s,angle_deg,s2", Some(GAUGE));
    let columns = ["--reference", "angle_deg", "--signal", "s2"];
    named(&runs(stretch().arg("diagnose").arg(&set).args(columns)));
    fails(stretch().arg("diagnose").arg(&set), &["--reference", "angle_deg, s2"]);
    let set = folder(&scratch, "usual", "time_s,length_mm,bridge_v", None);
    named(&runs(stretch().arg("diagnose").arg(&set)));
    // A rig file of a complete rig does not describe a gauge.
    let rig = scratch.path("rig.toml");
    fs::write(&rig, prints(stretch().args(["simulate", "--print-rig"]))).unwrap();
    let mut command = stretch();
    command.arg("diagnose").arg(&file).args(columns).arg("--rig").arg(&rig);
    fails(&mut command, &["joint.csv", "kind"]);
}

#[test]
fn records_that_cannot_be_used_are_refused_by_name() {
    let scratch = Scratch::new();
    let file = scratch.path("joint.csv");
    let run = |text: &str, reference: &str, signal: &str| {
        fs::write(&file, text).unwrap();
        let mut command = stretch();
        command.arg("diagnose").arg(&file);
        command.args(["--reference", reference, "--signal", signal]);
        command
    };
    record(&file, "time_s,angle_deg,s2", 1.0, 0.0);
    let good = fs::read_to_string(&file).unwrap();
    fails(
        &mut run(&good, "angle_deg", "s3"),
        &["joint.csv", "s3", "the columns are time_s, angle_deg, s2"],
    );
    let mut with_footer = run(&(good.clone() + "End of test\n"), "angle_deg", "s2");
    fails(with_footer.arg("--strict"), &["joint.csv", "--strict leaves no row out"]);
    let cell = |line: &str, column: usize, value: &str| {
        let mut cells: Vec<&str> = line.split(',').collect();
        cells[column] = value;
        cells.join(",") + "\n"
    };
    let spoiled = |column: usize, value: &dyn Fn(usize) -> Option<String>| {
        let lines = good.lines().enumerate();
        lines
            .map(|(i, line)| match value(i) {
                Some(value) if i > 0 => cell(line, column, &value),
                _ => line.to_owned() + "\n",
            })
            .collect::<String>()
    };
    let dead = spoiled(2, &|_| Some("0.5".into()));
    fails(&mut run(&dead, "angle_deg", "s2"), &["joint.csv", "s2", "0.5 in every sample", "cable"]);
    let hole = spoiled(2, &|i| (i == 17).then(|| "n/a".into()));
    let text = runs(&mut run(&hole, "angle_deg", "s2"));
    assert!(text.contains("joint.csv: a row is left out: row 18, column s2"), "{text}");
    let short: String = good.lines().take(200).map(|l| l.to_owned() + "\n").collect();
    fails(
        &mut run(&short, "angle_deg", "s2"),
        &["joint.csv", "to fit have 150 samples", "at least 300"],
    );
    let swapped = good.replacen("angle_deg,s2", "bridge_v,length_mm", 1);
    fails(&mut run(&swapped, "bridge_v", "length_mm"), &["swapped", "reference is the length"]);
    // A gap in time and a converter at its limit are reported, but are no reason to refuse the
    // recording.
    let kept = good.lines().enumerate().filter(|(i, _)| !(4000..4300).contains(i));
    let gap: String = kept.map(|(_, l)| l.to_owned() + "\n").collect();
    let text = runs(&mut run(&gap, "angle_deg", "s2"));
    assert!(text.lines().next().unwrap().contains("the time offset between"), "{text}");
    assert!(text.contains("joint.csv: 3.000 s are missing after 39.98 s"), "{text}");
    let value = |i: usize| -> Option<f64> { good.lines().nth(i)?.split(',').nth(2)?.parse().ok() };
    let all: Vec<Option<f64>> = (0..6001).map(value).collect();
    let clipped = spoiled(2, &|i| Some(format!("{:.5}", all[i]?.min(1.5))));
    let doubt = one_line(&warned(&mut run(&clipped, "angle_deg", "s2")));
    assert!(doubt.contains("s2 is at 1.5, its greatest value"), "{doubt}");
    let text = runs(&mut run(&clipped, "angle_deg", "s2"));
    let first = text.lines().next().unwrap();
    assert!(first.contains("the time offset between") && !first.contains("linearity"), "{first}");
    // Exchanged reference and signal are reported, and no effect is named with certainty.
    let doubt = warned(&mut run(&good, "s2", "angle_deg"));
    assert!(doubt.contains("swapped?"), "{doubt}");
    let metres = scratch.path("metres.csv");
    record(&metres, "time_s,length_mm,s2", 1e-3, 0.0);
    let mut command = stretch();
    command.arg("diagnose").arg(&metres).args(["--reference", "length_mm", "--signal", "s2"]);
    let text = runs(&mut command);
    assert!(
        text.contains("metres") && text.lines().next().unwrap().contains("the time offset between")
    );
}

#[test]
#[ignore = "needs measured data: ../shared/data, or what STRETCH_DATA names; ./ci.sh runs it"]
fn with_data_a_measured_sleeve_gets_shares_and_no_confident_name() {
    let sleeve = testkit::measured::folder("knit_sleeve");
    let file = sleeve.join("heel_curl_90_1.csv");
    let mut command = stretch();
    command.arg("diagnose").arg(file).args(["--reference", "angle_deg", "--signal", "s2"]);
    let text = runs(&mut command);
    let first = text.lines().next().unwrap();
    assert!(!first.contains("lacks"), "{first}");
    // Slow memory, which a fit of other model forms confirms (book/src/results/gauge_alone.md), and
    // a term for the rest.
    assert!(
        first.contains("the gauge's relaxation") && first.contains("What is missing"),
        "{first}"
    );
}

//! A larger number of rows changes only the run time.

use std::fmt::Write;

use crate::support::{Scratch, fails, prints, stretch};

/// More rows than an earlier release could read at once.
const MANY: u32 = 1_600_000;

/// A gauge that moves between two lengths.
fn rows(count: u32, (least_mm, most_mm): (f64, f64), phase: f64) -> String {
    let mut text = String::from("time_s,length_mm,bridge_v\n");
    for n in 0..count {
        let time_s = f64::from(n) * 0.01;
        let share = 0.5 + 0.5 * (1.3 * time_s + phase).sin();
        let length_mm = least_mm + (most_mm - least_mm) * share;
        let bridge_v = 1.2 + 0.03 * (180.0 - length_mm) + 1e-4 * (180.0 - length_mm).powi(2);
        writeln!(text, "{time_s:.2},{length_mm:.4},{bridge_v:.6}").unwrap();
    }
    text
}

/// The short trials cover five sixths of the range. Without them the estimates would be wrong by
/// millimetres.
#[test]
#[ignore = "reads 1,600,000 rows twice; ./ci.sh runs it"]
fn short_trials_are_fitted_with_a_long_one_and_digests_are_checked() {
    let scratch = Scratch::new();
    scratch.write("long.csv", rows(MANY, (150.0, 155.0), 0.0));
    let short: Vec<String> = (0..6).map(|k| format!("short_{k}.csv")).collect();
    for (k, name) in (0_u8..).zip(&short) {
        scratch.write(name, rows(60, (155.0, 180.0), f64::from(k)));
    }
    scratch.write("new.csv", rows(600, (150.0, 180.0), 0.5));
    let at = |name: &str| scratch.path(name);
    let mut calibrate = stretch();
    calibrate.args(["calibrate", "--model", "poly13", "--out"]).arg(at("cal.json"));
    prints(calibrate.arg(at("long.csv")).args(short.iter().map(|name| at(name))));
    let mut evaluate = stretch();
    evaluate.args(["evaluate", "--json", "--calibration"]).args([at("cal.json"), at("new.csv")]);
    let judged: serde_json::Value = serde_json::from_str(&prints(&mut evaluate)).unwrap();
    let rmse_mm = judged["pooled"][1]["rmse"].as_f64().unwrap();
    assert!(rmse_mm < 0.1, "{rmse_mm} mm");

    prints(stretch().args(["simulate", "--protocol", "pulses", "--out"]).arg(at("set")));
    std::fs::rename(at("long.csv"), at("set/pulses_1.csv")).unwrap();
    let says = ["dataset.toml", "pulses_1.csv is not the file that this data set was written with"];
    fails(stretch().arg("calibrate").arg(at("set")).arg("--out").arg(at("other.json")), &says);
    assert!(!at("other.json").exists());
}

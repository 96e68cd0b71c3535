//! Sensors that are put on again, that are worn by another person, or that are broken:
//! `stretch sleeve learn`, `calibrate --signal s1,s2` and `--prior`, `sleeve renew`, and `apply`
//! with several gauges.

use std::{fmt::Write, path::PathBuf};

use assert_cmd::Command;

use crate::support::{Scratch, fails, one_line, prints, runs, stretch};

/// Parameters of a session.
#[derive(Clone, Copy)]
struct Worn {
    wearer: usize,
    number: usize,
    seconds: f64,
    hz: f64,
}

const SHORT: Worn = Worn { wearer: 7, number: 0, seconds: 20.0, hz: 50.0 };

impl Scratch {
    /// Writes a session of a wearer as CSV: two gauges with gain, zero and memory, and an angle.
    fn worn(&self, name: &str, worn: Worn, change: impl Fn(&mut [f64; 3])) -> PathBuf {
        let Worn { wearer, number, seconds, hz } = worn;
        let (w, n) = (wearer as f64, number as f64);
        let (gain, zero) =
            (1.0 + 0.2 * (2.3 * w).sin() + 0.02 * n, 0.1 * (1.7 * w).cos() + 0.02 * n);
        let angle = |t: f64| {
            let t = t + 3.0 * w + n;
            45.0 + 30.0 * (1.3 * t).sin() + 10.0 * (0.37 * t).cos() + 3.0 * (4.1 * t).sin()
        };
        let (mut text, mut slow) = ("time_s,s1,s2,angle_deg\n".to_owned(), angle(0.0));
        for k in 0..(seconds * hz) as u32 {
            let t = f64::from(k) / hz;
            slow += (angle(t) - slow) / (0.3 * hz);
            let noise =
                |k: u32| 3e-3 * (f64::from(k.wrapping_mul(2_654_435_761) >> 16) / 65536.0 - 0.5);
            let first = gain * (angle(t) + 0.2 * (angle(t) - slow)) / 90.0 + zero + noise(k);
            let second = 1.5 * gain * angle(t) / 90.0 - zero + noise(k + 77);
            let mut row = [first, second, angle(t)];
            change(&mut row);
            let cell = |x: f64| if x.is_finite() { format!("{x:.5}") } else { String::new() };
            writeln!(text, "{t},{},{},{}", cell(row[0]), cell(row[1]), cell(row[2])).unwrap();
        }
        self.write(name, text)
    }

    /// Writes a session, and its sums as a session file.
    fn summed(
        &self,
        name: &str,
        worn: Worn,
        signals: &str,
        change: impl Fn(&mut [f64; 3]),
    ) -> PathBuf {
        let trial = self.worn(&format!("{name}.csv"), worn, change);
        let session = self.path(&format!("{name}.json"));
        let of = format!("w{}", worn.wearer);
        runs(
            self.sleeve(&[
                "calibrate",
                "--reference",
                "angle_deg",
                "--signal",
                signals,
                "--of",
                &of,
            ])
            .arg("--session")
            .arg(&session)
            .arg("--out")
            .arg(self.path("own.json"))
            .arg(trial),
        );
        session
    }

    /// Writes two sessions of each of four wearers.
    fn sessions(&self) -> Vec<PathBuf> {
        let one = |k: usize| {
            let worn = Worn { wearer: k / 2, number: k % 2, seconds: 75.0, hz: 50.0 };
            self.summed(&format!("w{}_{}", k / 2, k % 2), worn, "s1,s2", |_| ())
        };
        (0..8).map(one).collect()
    }

    fn prior(&self) -> PathBuf {
        let prior = self.path("prior.json");
        let mut command = self.sleeve(&["sleeve", "learn", "--out", "prior.json"]);
        let said = runs(command.args(self.sessions()));
        assert!(
            said.contains("Prior of 8 sessions with the signals s1, s2")
                && said.contains("known sensor"),
            "{said}"
        );
        prior
    }

    fn sleeve(&self, arguments: &[&str]) -> Command {
        let mut command = stretch();
        command.current_dir(self.path("")).args(arguments);
        command
    }

    /// Returns the root mean square error of a calibration's estimates on a session, and the
    /// messages of `apply` on standard error.
    fn error(&self, record: &str, trial: &str) -> (f64, String) {
        let (errors, said) = self.errors(record, trial, 3);
        assert!(errors.len() > 100, "{said}");
        (root_mean_square(&errors), said)
    }

    /// Returns the errors of a calibration's estimates relative to the reference in a column
    /// (counted from 0), and the messages of `apply` on standard error.
    fn errors(&self, record: &str, trial: &str, column: usize) -> (Vec<f64>, String) {
        let mut command = self.sleeve(&["apply", "--calibration", record, trial]);
        let output = command.output().unwrap();
        let said = one_line(&String::from_utf8_lossy(&output.stderr));
        assert!(output.status.success(), "{said}");
        let truth = std::fs::read_to_string(self.path(trial)).unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        let rows = text.lines().zip(truth.lines()).skip(1);
        let cell = |line: &str, k| line.split(',').nth(k)?.parse::<f64>().ok();
        let errors = rows.filter_map(|(told, row)| Some(cell(told, 1)? - cell(row, column)?));
        (errors.collect(), said)
    }
}

fn root_mean_square(errors: &[f64]) -> f64 {
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

/// Several gauges are evaluated together and each alone, and the gauge that was put on again is named.
#[test]
fn several_gauges_are_evaluated_together_and_each_alone() {
    let scratch = Scratch::new();
    let worn = Worn { wearer: 1, number: 0, seconds: 90.0, hz: 50.0 };
    scratch.worn("fit.csv", worn, |_| ());
    let test = Worn { number: 1, seconds: 60.0, ..worn };
    scratch.worn("test.csv", test, |_| ());
    scratch.worn("moved.csv", test, |row| row[0] += 0.4);
    let calibrate = [
        "calibrate",
        "--reference",
        "angle_deg",
        "--signal",
        "s1,s2",
        "--out",
        "both.json",
        "fit.csv",
    ];
    runs(&mut scratch.sleeve(&calibrate));
    let evaluate = |arguments: &[&str]| {
        let mut command = scratch.sleeve(&["evaluate", "--calibration", "both.json"]);
        let output = command.args(arguments).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{said}");
        (String::from_utf8(output.stdout).unwrap(), one_line(&said))
    };
    let (shown, _) = evaluate(&["test.csv"]);
    assert!(shown.starts_with("Calibration both is off by "), "{shown}");
    assert!(
        shown.contains("s1 alone") && shown.contains("s2 alone") && !shown.contains("raw"),
        "{shown}"
    );
    assert!(shown.lines().count() <= 15, "{shown}");
    let (quiet, _) = evaluate(&["--quiet", "test.csv"]);
    assert_eq!(quiet.lines().count(), 1, "{quiet}");
    assert!(evaluate(&["-v", "test.csv"]).0.len() > shown.len());
    let (json, told) = evaluate(&["--json", "moved.csv"]);
    let found: serde_json::Value = serde_json::from_str(&json).unwrap();
    let of = |k: usize| {
        (found["pooled"][k]["method"].clone(), found["pooled"][k]["rmse"].as_f64().unwrap())
    };
    let ((both, together), (first, shifted), (second, as_before)) = (of(0), of(1), of(2));
    assert_eq!([both, first, second], ["both", "s1 alone", "s2 alone"]);
    assert!(
        as_before < 3.0 && together > as_before && shifted > together,
        "{as_before} {together} {shifted}"
    );
    assert!(told.contains("was the sensor put on again? The estimate is shifted"), "{told}");
    let alone = told.split("single gauges are off by: ").nth(1).unwrap_or_default();
    assert!(alone.starts_with("s1 alone ") && !alone.contains("s2"), "{told}");
    // Two gauges disagree, and their signals do not show which of them has moved.
    assert!(
        told.contains("both: moved.csv: at") && told.contains("s1 or s2 has shifted"),
        "{told}"
    );
    let one =
        ["calibrate", "--reference", "angle_deg", "--signal", "s2", "--out", "one.json", "fit.csv"];
    runs(&mut scratch.sleeve(&one));
    let mixed = ["evaluate", "--calibration", "both.json", "--calibration", "one.json", "test.csv"];
    fails(
        &mut scratch.sleeve(&mixed),
        &["both is a calibration of several gauges, and one is not"],
    );
}

/// A wrist bends and turns, and three gauges depend on both angles. One recording gives a
/// calibration file for each angle.
#[test]
fn several_references_get_a_record_each() {
    let scratch = Scratch::new();
    let wrist = |name: &str, phase: f64| {
        let mut text = "time_s,s1,s2,s3,bend_deg,turn_deg\n".to_owned();
        for k in 0..3000_u32 {
            let t = f64::from(k) / 50.0;
            let bend = 40.0 * (1.3 * t + phase).sin() + 5.0 * (0.31 * t).cos();
            let turn = 25.0 * (0.7 * t - phase).cos() + 8.0 * (2.9 * t).sin();
            let noise =
                |k: u32| 2e-3 * (f64::from(k.wrapping_mul(2_654_435_761) >> 16) / 65536.0 - 0.5);
            let gauges = [(0.02, 0.005), (-0.004, 0.03), (0.01, -0.02)];
            write!(text, "{t}").unwrap();
            for (i, (a, b)) in (0..).zip(gauges) {
                write!(text, ",{:.5}", 1.0 + a * bend + b * turn + noise(k + 991 * i)).unwrap();
            }
            writeln!(text, ",{bend:.4},{turn:.4}").unwrap();
        }
        scratch.write(name, text)
    };
    wrist("wrist.csv", 0.0);
    wrist("later.csv", 1.0);
    let asked =
        ["calibrate", "wrist.csv", "--reference", "bend_deg,turn_deg", "--out", "wrist.json"];
    let said = runs(scratch.sleeve(&asked).args(["--signal", "all"]));
    for (angle, column) in [("bend_deg", 4), ("turn_deg", 5)] {
        assert!(said.contains(&format!("{angle} on s1, s2, s3 is off by")), "{said}");
        let record = format!("wrist.{angle}.json");
        // 2 % of some 80 degrees, including errors beyond the ranges of the first recording.
        let (errors, _) = scratch.errors(&record, "later.csv", column);
        let (rmse_deg, count) = (root_mean_square(&errors), errors.len());
        assert!(count > 2000 && rmse_deg < 1.6, "{angle}: {rmse_deg} of {count}");
        // The calibration of an angle does not depend on the other angle.
        let alone = ["--reference", angle, "--signal", "s1,s2,s3", "--out", "alone.json"];
        runs(scratch.sleeve(&["calibrate", "wrist.csv"]).args(alone));
        let text = |name: &str| std::fs::read_to_string(scratch.path(name)).unwrap();
        assert_eq!(text("alone.json"), text(&record));
    }
    fails(&mut scratch.sleeve(&asked), &["name the gauges with --signal"]);
    let model = ["--signal", "all", "--model", "auto"];
    fails(scratch.sleeve(&asked).args(model), &["--model", "--signal auto:s1,s2"]);
    let also = ["--signal", "all", "--session", "s.json"];
    fails(scratch.sleeve(&asked).args(also), &["work with one reference"]);
    let stdout = ["calibrate", "wrist.csv", "--signal", "all", "--out", "-"];
    let both = ["--reference", "bend_deg,turn_deg"];
    fails(scratch.sleeve(&stdout).args(both), &["name a file with --out"]);
}

#[test]
fn a_prior_needs_seconds_of_reference_or_none() {
    let scratch = Scratch::new();
    scratch.prior();
    let new = Worn { seconds: 60.0, ..SHORT };
    scratch.worn("new.csv", new, |_| ());
    scratch.worn("short.csv", Worn { seconds: 10.0, ..new }, |_| ());
    let from = ["calibrate", "--prior", "prior.json", "--out"];
    runs(scratch.sleeve(&from).arg("alone.json"));
    let said = runs(scratch.sleeve(&from).args(["ten.json", "short.csv"]));
    assert!(
        said.contains("10.00 s of reference") || said.contains("10.0 s of reference"),
        "{said}"
    );
    let (alone, ten) =
        (scratch.error("alone.json", "new.csv").0, scratch.error("ten.json", "new.csv").0);
    assert!(ten < 0.3 * alone, "{ten} beside {alone}");
    // The new recording has no reference.
    scratch.worn("today.csv", new, |row| row[2] = f64::NAN);
    let renew = ["sleeve", "renew", "--prior", "prior.json", "--out"];
    let said = runs(scratch.sleeve(&renew).args(["renewed.json", "today.csv"]));
    assert!(said.contains("are assumed to be") && said.contains("high end"), "{said}");
    let renewed = scratch.error("renewed.json", "new.csv").0;
    assert!(renewed < 0.6 * alone && renewed > ten, "{renewed} beside {alone}");
    // The calibration of an earlier session of the same wearer, made from the same prior.
    runs(scratch.sleeve(&from).args(["w1.json", "--of", "w1", "w1_0.csv"]));
    scratch.worn("w1_3.csv", Worn { wearer: 1, number: 2, seconds: 60.0, hz: 50.0 }, |_| ());
    let again = ["--calibration", "w1.json", "--of", "w1", "w1_3.csv", "--json"];
    let json = prints(scratch.sleeve(&renew).arg("w1_new.json").args(again));
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["renewal"]["assumed"].as_array().unwrap().len(), 3);
    let (before, after) =
        (scratch.error("w1.json", "w1_3.csv").0, scratch.error("w1_new.json", "w1_3.csv").0);
    assert!(after < before, "{after} beside {before}");
}

#[test]
fn a_single_gauge_that_is_put_on_again_is_reported_with_what_is_usual() {
    let scratch = Scratch::new();
    let worn = |wearer: usize| Worn { wearer, number: 0, seconds: 200.0, hz: 50.0 };
    let session = |wearer: usize| scratch.summed(&format!("w{wearer}"), worn(wearer), "s1", |_| ());
    let sessions: Vec<PathBuf> = (0..4).map(session).collect();
    runs(scratch.sleeve(&["sleeve", "learn", "--out", "prior.json"]).args(sessions));
    scratch.worn("today.csv", worn(7), |_| ());
    scratch.worn("again.csv", worn(7), |row| row[0] += 1.0);
    let from = ["calibrate", "--prior", "prior.json", "--out", "prior_made.json", "today.csv"];
    runs(&mut scratch.sleeve(&from));
    let columns = ["calibrate", "--reference", "angle_deg", "--signal", "s1", "--out", "own.json"];
    runs(scratch.sleeve(&columns).arg("today.csv"));
    for (record, usual) in [
        ("own.json", " deg is usual in this calibration. If the sensor was put on again"),
        (
            "prior_made.json",
            " deg is usual (in 4 earlier sessions; without a shift, one session in 5 at most exceeds it). If the sensor",
        ),
    ] {
        let said = scratch.error(record, "again.csv").1;
        assert!(said.contains(" s, across a pause: at most ") && said.contains(usual), "{said}");
        let said = scratch.error(record, "today.csv").1;
        assert!(!said.contains("the zero has shifted"), "{said}");
    }
}

#[test]
fn several_gauges_err_less_than_one_and_a_lost_one_is_named() {
    let scratch = Scratch::new();
    let worn = Worn { seconds: 80.0, ..SHORT };
    scratch.worn("knee.csv", worn, |_| ());
    let all = [
        "calibrate",
        "knee.csv",
        "--reference",
        "angle_deg",
        "--signal",
        "all",
        "--out",
        "cal.json",
    ];
    let json = prints(scratch.sleeve(&all).arg("--json"));
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let (rmse, alone) =
        (json["rmse"].as_f64().unwrap(), json["carried"][0]["rmse_alone"].as_f64().unwrap());
    assert!(json["signals"] == serde_json::json!(["s1", "s2"]) && rmse < 0.9 * alone, "{json}");
    let (whole, said) = scratch.error("cal.json", "knee.csv");
    assert!(!said.contains("left out"), "{said}");
    let k = std::cell::Cell::new(0);
    scratch.worn("cut.csv", worn, |row| {
        k.set(k.get() + 1);
        row[0] = if k.get() > 2000 { 9.0 } else { row[0] };
    });
    let (cut, said) = scratch.error("cal.json", "cut.csv");
    let left_out =
        "s1 is left out of 1997 of 4000 samples, the first at 40.06 s: its signal is outside";
    assert!(said.contains(left_out), "{said}");
    assert!(
        said.contains("outside the calibrated domain") && said.contains("1997 with a lost gauge"),
        "{said}"
    );
    assert!(whole < cut && cut < 20.0 * whole, "{cut} beside {whole}");
    k.set(0);
    scratch.worn("blank.csv", worn, |row| {
        k.set(k.get() + 1);
        row[0] = if (1000..3000).contains(&k.get()) { f64::NAN } else { row[0] };
    });
    let (blank, said) = scratch.errors("cal.json", "blank.csv", 3);
    let left_out =
        "s1 is left out of 2996 of 4000 samples, the first at 20.04 s: its samples are missing";
    assert!(said.contains(left_out) && blank.len() == 4000, "{said}");
    assert!(root_mean_square(&blank) < 20.0 * whole, "{said}");
    let (k, stuck_at) = (std::cell::Cell::new(0), std::cell::Cell::new(0.0));
    scratch.worn("stuck.csv", worn, |row| {
        k.set(k.get() + 1);
        if k.get() <= 2000 {
            stuck_at.set(row[1]);
        }
        row[1] = stuck_at.get();
    });
    let (stuck, said) = scratch.error("cal.json", "stuck.csv");
    assert!(
        said.contains("s2 is left out of 19") && said.contains("its signal repeats one value"),
        "{said}"
    );
    assert!(stuck < 20.0 * whole, "{stuck} beside {whole}");
}

#[test]
fn priors_refuse_what_they_have_not_seen() {
    let scratch = Scratch::new();
    scratch.prior();
    type Case<'a> = (&'a str, Worn, fn(&mut [f64; 3]), &'a [&'a str]);
    let cases: [Case<'_>; 4] = [
        ("unit.csv", SHORT, |row| row[0] *= 1000.0, &["unit.csv", "s1", "another unit"]),
        ("rate.csv", Worn { hz: 100.0, ..SHORT }, |_| (), &["rate.csv", "--grid 50"]),
        (
            "turned.csv",
            SHORT,
            |row| (row[0], row[1]) = (1.0 - row[0], 1.0 - row[1]),
            &["swap the wires"],
        ),
        ("copies.csv", SHORT, |row| row[1] = row[0], &["the same signal", "--signal"]),
    ];
    for (name, worn, change, says) in cases {
        scratch.worn(name, worn, change);
        let from = ["calibrate", "--prior", "prior.json", "--out", "no.json", name];
        fails(&mut scratch.sleeve(&from), says);
    }
    let worn = |name: &str, change: fn(&mut [f64; 3])| scratch.worn(name, SHORT, change);
    worn("plain.csv", |_| ());
    let with = |more: &[&str]| {
        let mut command =
            scratch.sleeve(&["calibrate", "--prior", "prior.json", "--out", "no.json"]);
        command.args(more);
        command
    };
    fails(&mut with(&["--signal", "s1", "plain.csv"]), &["2 channels", "1 were given", "--signal"]);
    let radian = scratch.path("radian.csv");
    let text = std::fs::read_to_string(scratch.path("plain.csv")).unwrap();
    std::fs::write(&radian, text.replace("angle_deg", "angle_rad")).unwrap();
    fails(&mut with(&["radian.csv"]), &["angle_deg", "--reference"]);
    let other = &mut with(&["--reference", "angle_rad", "radian.csv"]);
    fails(other, &["angle_rad", "stretch convert"]);
    // The prior determines the model, so --model is refused.
    assert_eq!(with(&["--model", "linear", "plain.csv"]).output().unwrap().status.code(), Some(2));
    let renew = |name: &str, says: &[&str]| {
        let arguments = ["sleeve", "renew", "--prior", "prior.json", "--out", "no.json", name];
        fails(&mut scratch.sleeve(&arguments), says);
    };
    scratch.worn("brief.csv", Worn { seconds: 1.0, ..SHORT }, |_| ());
    renew("brief.csv", &["brief.csv", "no complete movement", "reference"]);
    // The gain of wearer 1 differed by 0.02 between sessions, and in this session by 0.18.
    let far = Worn { wearer: 1, number: 9, seconds: 60.0, hz: 50.0 };
    scratch.worn("far.csv", far, |row| row[2] = f64::NAN);
    let arguments = "sleeve renew --prior prior.json --of w1 --out no.json far.csv";
    let arguments: Vec<&str> = arguments.split(' ').collect();
    fails(&mut scratch.sleeve(&arguments), &["far.csv", "999 of 1000 sessions", "reference"]);
    assert!(!scratch.path("no.json").exists());
}

#[test]
fn sessions_of_different_kinds_make_no_prior() {
    let scratch = Scratch::new();
    let worn = |number| Worn { wearer: 1, number, seconds: 70.0, hz: 50.0 };
    let of = |k: usize| scratch.summed(&format!("a{k}"), worn(k), "s1,s2", |_| ());
    let good = [of(0), of(1)];
    let refused = |third: PathBuf, says: &[&str]| {
        let mut command = scratch.sleeve(&["sleeve", "learn", "--out", "no.json"]);
        fails(command.args(&good).arg(third), says);
    };
    refused(scratch.summed("one", worn(2), "s1", |_| ()), &["one", "1 channels", "same channels"]);
    let fast = Worn { hz: 100.0, ..worn(2) };
    refused(scratch.summed("fast", fast, "s1,s2", |_| ()), &["fast", "--grid 50"]);
    let turn = |row: &mut [f64; 3]| (row[0], row[1]) = (1.0 - row[0], 1.0 - row[1]);
    refused(scratch.summed("turned", worn(2), "s1,s2", turn), &["turned", "swap the wires"]);
    refused(scratch.path("own.json"), &["own.json", "stretch"]);
    fails(scratch.sleeve(&["sleeve", "learn", "--out", "no.json"]).args(&good), &["at least 3"]);
    let damaged = std::fs::read_to_string(&good[0]).unwrap().replacen("0.", "1.", 1);
    refused(scratch.write("damaged.json", damaged), &["damaged.json", "edited or damaged"]);
    // Rows after the end of the reference are left out and counted. A third of all rows is too
    // many.
    let k = std::cell::Cell::new(0);
    scratch.worn("early.csv", worn(2), |row| {
        k.set(k.get() + 1);
        row[2] = if k.get() > 2300 { f64::NAN } else { row[2] };
    });
    let fit = ["calibrate", "early.csv", "--reference", "angle_deg", "--signal", "s1,s2", "--out"];
    let mut command = scratch.sleeve(&fit);
    fails(command.arg("e.json"), &["early.csv", "row 2302", "angle_deg", "fill it in or remove"]);
}

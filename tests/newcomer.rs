//! Messages for new users: their own names, units and folders.

use std::fmt::Write;

use crate::support::{Scratch, calibrate, fails, one_line, runs, stretch};

/// Writes a trial with custom columns and scale: a reference of 151 to 179, and a gauge of 1.27 to
/// 2.2 multiplied by `times`.
fn trial(scratch: &Scratch, name: &str, header: &str, times: f64) -> std::path::PathBuf {
    let mut text = format!("{header}\n");
    for n in 0..3000 {
        let t = 0.01 * f64::from(n);
        let length = 165.0 + 14.0 * (1.1 * t).cos() * (0.31 * t).cos();
        let wobble = f64::from(n * 7919 % 101) * 1e-5;
        let gauge = times * (1.24 + 0.033 * (180.0 - length) + wobble);
        writeln!(text, "{t:.2},{length:.4},{gauge:.6}").unwrap();
    }
    scratch.write(name, text)
}

#[test]
fn own_columns_keep_their_units() {
    let scratch = Scratch::new();
    let log = trial(&scratch, "own.csv", "Time (s),Pos (mm),Gauge (V)", 1.0);
    let record = scratch.path("own.json");
    runs(calibrate(&log, &record).args(["--reference", "Pos (mm)", "--signal", "Gauge (V)"]));
    let mut apply = stretch();
    let told = runs(apply.args(["apply", "--calibration"]).arg(&record).arg(&log));
    assert!(
        told.starts_with("time_s,estimate_mm,rate_mm_per_s,branch,domain\n"),
        "{}",
        &told[..60]
    );
    let mut evaluate = stretch();
    let told = runs(evaluate.args(["evaluate", "--calibration"]).arg(&record).arg(&log));
    assert!(told.contains("RMSE, mm"), "{told}");
    // Units are printed in their usual form.
    let log = trial(&scratch, "force.csv", "time_s,force_n,gauge_v", 1.0);
    let record = scratch.path("force.json");
    runs(calibrate(&log, &record).args(["--reference", "force_n", "--signal", "gauge_v"]));
    let mut evaluate = stretch();
    let told = runs(evaluate.args(["evaluate", "--calibration"]).arg(&record).arg(&log));
    assert!(told.contains("RMSE, N") && !told.contains("RMSE, n"), "{told}");
}

#[test]
fn a_gauge_in_another_unit_is_told_by_its_power_of_ten() {
    let scratch = Scratch::new();
    let (volts, millivolts) = (
        trial(&scratch, "volts.csv", "time_s,length_mm,bridge_v", 1.0),
        trial(&scratch, "millivolts.csv", "time_s,length_mm,bridge_v", 1000.0),
    );
    let record = scratch.path("cal.json");
    runs(&mut calibrate(&volts, &record));
    let says = "3,000 of 3,000 samples lie outside the range of the calibration, 1.273 to 2.196 V, and were limited to it: \
                are they in mV? 2,999 lie inside when divided by 1000";
    let told = |command: &str, log: &std::path::Path| {
        let output =
            stretch().args([command, "--calibration"]).arg(&record).arg(log).output().unwrap();
        assert!(output.status.success());
        one_line(&String::from_utf8(output.stderr).unwrap())
    };
    for command in ["apply", "evaluate"] {
        assert!(told(command, &millivolts).contains(says), "{}", told(command, &millivolts));
        assert!(!told(command, &volts).contains("samples lie outside"), "{command}");
    }
    let live = std::fs::read_to_string(&millivolts).unwrap();
    let mut command = stretch();
    let output = command.args(["apply", "--calibration"]).arg(&record).write_stdin(live).output();
    let said = one_line(&String::from_utf8(output.unwrap().stderr).unwrap());
    assert!(
        said.contains(says) && said.contains("3000 samples: 10 without an estimate"),
        "live: {said}"
    );
    assert!(!said.contains("the zero has shifted"), "live: {said}");
}

#[test]
fn a_folder_of_csv_files_is_told_what_to_do() {
    let scratch = Scratch::new();
    std::fs::create_dir(scratch.path("logs")).unwrap();
    trial(&scratch, "logs/monday.csv", "time_s,length_mm,bridge_v", 1.0);
    let with = |line: &str| {
        let mut command = stretch();
        command.current_dir(scratch.path("")).args(line.split(' '));
        command
    };
    runs(&mut with("calibrate logs/monday.csv --out cal.json"));
    for line in [
        "calibrate logs --out x.json",
        "evaluate --calibration cal.json logs",
        "diagnose logs",
        "simulate --protocol logs --out x",
    ] {
        let says = ["logs: there is no dataset.toml in it", "it contains monday.csv", "logs/*.csv"];
        fails(&mut with(line), &says);
    }
    std::fs::create_dir(scratch.path("empty")).unwrap();
    fails(&mut with("diagnose empty"), &["empty: there is no dataset.toml in it; name a data set"]);
}

#[test]
fn times_that_begin_at_zero_have_the_digits_of_the_log() {
    let scratch = Scratch::new();
    let mut text = String::from("t_ms,length_mm\n");
    (0..500).for_each(|n| writeln!(text, "{:.3},170", 12345.678 + 10.0 * f64::from(n)).unwrap());
    let log = scratch.write("log.csv", text);
    let mut command = stretch();
    command.arg("convert").arg(log).args(["--time", "t_ms", "--from-zero", "--out", "-"]);
    for (n, line) in runs(&mut command).lines().skip(1).enumerate() {
        let expected = format!("{:.2}", 0.01 * n as f64);
        let expected = expected.trim_end_matches('0').trim_end_matches('.');
        assert_eq!(line.split(',').next(), Some(expected), "row {n}");
    }
}

#[test]
#[ignore = "every model is cross-validated; ./ci.sh runs it"]
fn a_choice_is_explained_with_its_figures() {
    let scratch = Scratch::new();
    let logs = [scratch.loops("a.csv", 30.0, 1.1), scratch.loops("b.csv", 30.0, 1.7)];
    let mut command = calibrate(&logs[0], &scratch.path("cal.json"));
    let told = one_line(&runs(command.arg(&logs[1]).args(["--model", "auto"])));
    let why = told.split("Chosen: ").nth(1).expect("a sentence");
    let why = &why[..why.find(". ").unwrap()];
    assert!(why.contains("on data left out of the fit") && why.contains(" mm"), "{why}");
    assert!(!told.contains("[]"), "{told}");
    let history = runs(calibrate(&logs[0], &scratch.path("cal.json")).args(["--model", "history"]));
    assert!(!history.contains("[]") && history.contains("time constants of 0.05"), "{history}");
}

#[test]
fn a_diagnosis_says_what_its_page_says() {
    let scratch = Scratch::new();
    let (bench, page) = (scratch.path("bench"), scratch.path("d.html"));
    let mut command = stretch();
    command.args([
        "simulate",
        "--protocol",
        "pulses",
        "--effect",
        "gauge_hysteresis:h=0.2,s=0.012",
    ]);
    runs(command.arg("--out").arg(&bench));
    let mut command = stretch();
    let told =
        runs(command.arg("diagnose").arg(&bench).arg("--no-next").arg("--report").arg(&page));
    let html = std::fs::read_to_string(&page).unwrap().replace('\u{a0}', " ");
    // The remaining difference is shown first.
    let at = |part: &str| html.find(part).unwrap_or_else(|| panic!("no {part}"));
    assert!(at("measured \u{2212} simulated") < at("<table"));
    assert!(!told.contains("Stability"), "the numbers of rivals are for -v: {told}");
    let rows: Vec<&str> = told.lines().filter(|l| l.starts_with("| sensing ")).collect();
    let cells = rows[0].split('|').map(str::trim).filter(|cell| cell.contains('\u{d7}'));
    let cells: Vec<&str> = cells.collect();
    assert_eq!(cells.len(), 3, "{told}");
    for cell in cells {
        assert!(html.contains(cell), "{cell} is not on the page");
    }
    // Without rivals there is no experiment. A user who requested the file gets a message, with or
    // without -q.
    let file = scratch.path("next.csv");
    let mut command = stretch();
    command.arg("-q").arg("diagnose").arg(&bench).arg("--experiment").arg(&file);
    let output = command.output().unwrap();
    let error = one_line(&String::from_utf8(output.stderr).unwrap());
    assert!(output.status.success() && !file.exists());
    assert!(error.contains("next.csv is not written: no experiment is recommended"), "{error}");
}

#[test]
fn what_agrees_has_no_slices_that_stand_out() {
    let scratch = Scratch::new();
    let bench = scratch.path("bench");
    runs(stretch().args(["simulate", "--protocol", "pulses", "--out"]).arg(&bench));
    let told = one_line(&runs(stretch().arg("diagnose").arg(&bench).arg("--no-next")));
    assert!(told.contains("agree") && !told.contains("Parts of the data with"), "{told}");
}

#[test]
fn a_reference_that_is_off_throughout_is_remarked_on_with_what_to_do() {
    let scratch = Scratch::new();
    let log = trial(&scratch, "millimetres.csv", "time_s,length_mm,bridge_v", 1.0);
    let record = scratch.path("cal.json");
    runs(&mut calibrate(&log, &record));
    let told = |logs: &[&std::path::Path]| {
        let mut evaluate = stretch();
        let output = evaluate.args(["evaluate", "--calibration"]).arg(&record).args(logs).output();
        let output = output.unwrap();
        assert!(output.status.success());
        one_line(&String::from_utf8(output.stderr).unwrap())
    };
    let text = std::fs::read_to_string(&log).unwrap();
    let other = |name: &str, change: &dyn Fn(f64) -> f64| {
        let row = |line: &str| {
            let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
            format!("{},{:.5},{}\n", cells[0], change(cells[1]), cells[2])
        };
        let rows: String = text.lines().skip(1).map(row).collect();
        scratch.write(name, format!("time_s,length_mm,bridge_v\n{rows}"))
    };
    // In centimetres, and on a mount that has moved by 10 mm.
    type Member = (&'static str, fn(f64) -> f64, &'static str);
    let members: [Member; 3] = [
        ("centimetres.csv", |mm| mm / 10.0, "--column 'length_mm=length_mm*10'"),
        ("moved.csv", |mm| mm + 10.0, "it is 10 mm below the reference on average"),
        ("moved_a_little.csv", |mm| mm - 2.0, "it is 2 mm above the reference on average"),
    ];
    for (name, change, says) in members {
        let log = other(name, &change);
        let told = told(&[&log]);
        assert!(told.contains(says), "{told}");
        assert_eq!(told.contains("put on again"), name != "centimetres.csv", "{told}");
    }
    let [same, up, down] = [("same.csv", 0.0), ("up.csv", 10.0), ("down.csv", -10.0)]
        .map(|(name, by)| other(name, &|mm| mm + by));
    assert!(!told(&[&same]).contains("on average"));
    // Shifts in opposite directions cancel in the mean of all trials. Doubts are printed with -q, too.
    let told = told(&["-q".as_ref(), &same, &up, &down]);
    assert!(told.contains("cal: up.csv: was the sensor put on again?"), "{told}");
    assert!(told.ends_with("also down.csv"), "{told}");
}

#[test]
fn a_row_without_numbers_costs_a_row_and_no_signal() {
    let scratch = Scratch::new();
    let text = std::fs::read_to_string(scratch.loops("whole.csv", 20.0, 1.1)).unwrap();
    let mut lines: Vec<&str> = text.lines().collect();
    lines[500] = "4.99,NaN,NaN";
    let log = scratch.write("hole.csv", lines.join("\n"));
    for signal in ["auto", "all"] {
        let told = runs(calibrate(&log, &scratch.path("cal.json")).args(["--signal", signal]));
        assert!(told.contains("is off by"), "{signal}: {told}");
    }
    let rows = (0..2000).map(|n| format!("{:.2},{},word\n", 0.01 * f64::from(n), n % 90));
    let log =
        scratch.write("words.csv", format!("time_s,length_mm,state\n{}", rows.collect::<String>()));
    for signal in ["auto", "all"] {
        let mut command = calibrate(&log, &scratch.path("cal.json"));
        let says = ["words.csv: no column of numbers is left for a signal", "time and length_mm"];
        fails(command.args(["--signal", signal]), &says);
    }
}

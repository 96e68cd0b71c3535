//! The message about a wrong recording names the actual fault and its place.

use std::{fmt::Write, fs, path::PathBuf};

use crate::support::{Scratch, calibrate, fails, one_line, prints, runs, stretch};
use testkit::random::noise;

/// Rows of a trial with the names of the columns.
type Rows = (Vec<String>, Vec<Vec<f64>>);
/// Name of a recording, its change, and phrases that the message must contain.
type Case<'a> = (&'a str, &'a dyn Fn(&mut Rows), &'a [&'a str]);

/// Writes a simulated data set in which every trial is changed, without digests, as if a recorder
/// had written it.
fn changed(scratch: &Scratch, name: &str, change: &dyn Fn(&mut Rows)) -> PathBuf {
    let (bench, out) = (scratch.path("bench"), scratch.path(name));
    if !bench.exists() {
        runs(stretch().args(["simulate", "--protocol", "paper", "--out"]).arg(&bench));
    }
    fs::create_dir(&out).unwrap();
    for entry in fs::read_dir(&bench).unwrap().flatten() {
        let text = fs::read_to_string(entry.path()).unwrap();
        let file = entry.file_name().into_string().unwrap();
        if !file.ends_with(".csv") {
            let kept = text.lines().filter(|line| !line.starts_with("digest"));
            fs::write(out.join(file), kept.fold(String::new(), |all, line| all + line + "\n"))
                .unwrap();
            continue;
        }
        let mut lines = text.lines();
        let names = lines.next().unwrap().split(',').map(str::to_owned).collect();
        let numbers = |line: &str| line.split(',').map(|cell| cell.parse().unwrap()).collect();
        let mut rows: Rows = (names, lines.map(numbers).collect());
        change(&mut rows);
        let mut text = rows.0.join(",") + "\n";
        for row in rows.1 {
            let cells: Vec<String> = row.iter().map(f64::to_string).collect();
            writeln!(text, "{}", cells.join(",")).unwrap();
        }
        fs::write(out.join(file), text).unwrap();
    }
    out
}

fn column(name: &'static str, change: impl Fn(f64, usize) -> f64) -> impl Fn(&mut Rows) {
    move |(names, rows)| {
        let at = names.iter().position(|other| other == name).unwrap();
        for (n, row) in rows.iter_mut().enumerate() {
            row[at] = change(row[at], n);
        }
    }
}

/// Shifts the valve openings by a number of rows, forwards or backwards.
fn shifted(by: isize) -> impl Fn(&mut Rows) {
    move |(_, rows)| {
        let valves: Vec<[f64; 2]> = rows.iter().map(|row| [row[1], row[2]]).collect();
        let last = valves.len() as isize - 1;
        for (n, row) in rows.iter_mut().enumerate() {
            let from = valves[(n as isize - by).clamp(0, last) as usize];
            row[1..3].copy_from_slice(&from);
        }
    }
}

fn said(folder: &PathBuf) -> String {
    let output = stretch().args(["diagnose", "--no-next"]).arg(folder).output().unwrap();
    one_line(&String::from_utf8([output.stdout, output.stderr].concat()).unwrap())
}

#[test]
fn what_goes_against_the_valves_is_told_by_what_is_wrong_with_it() {
    let scratch = Scratch::new();
    let swapped = |(_, rows): &mut Rows| rows.iter_mut().for_each(|row| row.swap(1, 2));
    let reversed = |(_, rows): &mut Rows| {
        let times: Vec<f64> = rows.iter().map(|row| row[0]).collect();
        rows.reverse();
        rows.iter_mut().zip(times).for_each(|(row, time_s)| row[0] = time_s);
    };
    let without_pressure = |change: &dyn Fn(&mut Rows), rows: &mut Rows| {
        change(rows);
        rows.0.remove(3);
        rows.1.iter_mut().for_each(|row| {
            row.remove(3);
        });
    };
    let negated = column("length_mm", |l, _| -l);
    let contraction = column("length_mm", |l, _| 180.0 - l);
    let cases: [Case<'_>; 13] = [
        ("negated", &negated, &["length_mm", "sign looks reversed"]),
        ("contraction", &contraction, &["length_mm", "looks like a contraction"]),
        ("upside_down", &column("length_mm", |l, _| 330.0 - l), &["length_mm", "upside down"]),
        ("reversed", &reversed, &["time_s", "reversed in time"]),
        ("late", &shifted(100), &["inlet, outlet", "1.0 s late"]),
        ("a_little_late", &shifted(20), &["inlet, outlet", "0.2 s late"]),
        ("early", &shifted(-100), &["inlet, outlet", "1.0 s early"]),
        ("swapped", &swapped, &["inlet, outlet", "swapped"]),
        (
            "negated_alone",
            &|r| without_pressure(&negated, r),
            &["length_mm", "sign looks reversed"],
        ),
        (
            "contraction_alone",
            &|r| without_pressure(&contraction, r),
            &["looks like a contraction"],
        ),
        ("reversed_alone", &|r| without_pressure(&reversed, r), &["time_s", "reversed in time"]),
        ("late_alone", &|r| without_pressure(&shifted(100), r), &["inlet, outlet", "s late"]),
        ("swapped_alone", &|r| without_pressure(&swapped, r), &["inlet, outlet", "swapped"]),
    ];
    let mut wrong = Vec::new();
    for (name, change, parts) in cases {
        let told = said(&changed(&scratch, name, change));
        let is_right = parts.iter().all(|part| told.contains(part));
        if !is_right || (told.contains("swapped") && !name.contains("swapped")) {
            wrong.push(format!("{name}: {}", told.lines().next().unwrap_or_default()));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn noise_is_neither_a_unit_nor_a_swap() {
    let scratch = Scratch::new();
    for (name, change) in [
        ("length", &column("length_mm", |_, n| 165.0 + 8.0 * noise(n)) as &dyn Fn(&mut Rows)),
        ("pressure", &column("pressure_kpa", |_, n| 3.0 * noise(n))),
        ("small_pressure", &column("pressure_kpa", |_, n| 0.1 * noise(n))),
    ] {
        let told = said(&changed(&scratch, name, change));
        assert!(!told.contains("swapped") && !told.contains("looks like"), "{name}: {told}");
        assert!(told.contains("The recording is wrong: "), "{name}: {told}");
    }
    let bar = changed(&scratch, "bar", &column("pressure_kpa", |p, _| p / 100.0));
    assert!(said(&bar).contains("this looks like bar: multiply by 100"));
}

#[test]
fn a_rig_file_is_named_in_what_is_wrong_with_it() {
    let scratch = Scratch::new();
    let bench = scratch.path("bench");
    runs(stretch().args(["simulate", "--protocol", "arbitrary", "--out"]).arg(&bench));
    let stock = prints(stretch().args(["simulate", "--print-rig"]));
    for (from, to) in [
        ("value = 0.35", "value = -0.35"),
        ("tau_m", "tau_mm"),
        ("L0 = { value = 180.0", "L0 = { value = 1e-300"),
        ("[muscle]", "[musscle]"),
        ("= {", "= {{"),
        ("[muscle]", "[[effect]]\nname = \"leek\"\n[muscle]"),
    ] {
        let rig = scratch.write("mine.toml", stock.replacen(from, to, 1));
        let mut diagnose = stretch();
        fails(
            diagnose.args(["diagnose", "--no-next", "--rig"]).arg(&rig).arg(&bench),
            &["mine.toml"],
        );
    }
    let rig =
        scratch.write("mine.toml", stock.replacen("e0 = { value = ", "e0 = { value = 1e300 # ", 1));
    let text = fs::read_to_string(&rig).unwrap().replace("1e300 # ", "1e300, tolerance = 1.0 } # ");
    let rig = scratch.write("mine.toml", text);
    let mut simulate = stretch();
    simulate.args(["simulate", "--protocol", "pulses", "--rig"]).arg(&rig).arg("--out");
    fails(simulate.arg(scratch.path("out")), &["mine.toml", "the simulation gave"]);
}

#[test]
fn a_log_is_named_in_what_is_wrong_with_it() {
    let scratch = Scratch::new();
    let log = |name: &str, rows: usize, row: &dyn Fn(usize) -> (f64, f64)| {
        let mut text = String::from("time_s,length_mm,bridge_v\n");
        for n in 0..rows {
            let (length, volts) = row(n);
            writeln!(text, "{:.2},{length},{volts}", 0.01 * n as f64).unwrap();
        }
        scratch.write(name, text)
    };
    let wave = |n: usize| (n as f64 / 30.0).sin();
    let logs = [
        log("constant_signal.csv", 500, &|n| (165.0 + wave(n), 1.5)),
        log("constant_reference.csv", 500, &|n| (165.0, 1.5 + 0.1 * wave(n))),
        log("one_row.csv", 1, &|_| (165.0, 1.5)),
        log("few_rows.csv", 5, &|n| (165.0 + n as f64, 1.5 + n as f64)),
        log("huge.csv", 500, &|n| (1e300 * (1 + n % 7) as f64, 1.5 + 0.1 * wave(n))),
    ];
    let mut refused = 0;
    for path in &logs {
        let name = path.file_name().unwrap().to_str().unwrap();
        for model in ["linear", "poly13", "observer", "history", "history+rest", "auto"] {
            let mut command = calibrate(path, &scratch.path("cal.json"));
            let output = command.args(["--model", model]).output().unwrap();
            if output.status.success() {
                continue;
            }
            refused += 1;
            let told = String::from_utf8(output.stderr).unwrap();
            assert_eq!(told.matches(name).count(), 1, "{model}: {told}");
            assert!(
                told.len() < 500 && !told.contains("name at least one file"),
                "{model}: {told}"
            );
        }
    }
    assert!(refused >= 25, "{refused}");
    let mut two = calibrate(&logs[0], &scratch.path("cal.json"));
    fails(two.arg(&logs[0]), &["constant_signal.csv and 1 more", "constant"]);
}

/// Characters that reverse the text around them, that are invisible, or that control a terminal.
const HOSTILE: [char; 6] = ['\u{202e}', '\u{2066}', '\u{200b}', '\u{feff}', '\u{1b}', '\u{9b}'];

#[test]
fn names_do_not_turn_the_text_around_them() {
    let scratch = Scratch::new();
    let name: String = "ev".chars().chain(HOSTILE).chain("il.csv".chars()).collect();
    let log = scratch.loops(&name, 20.0, 1.1);
    let (report, page) = (scratch.path("r.html"), scratch.path("d.html"));
    let is_plain = |what: &str, text: &str| {
        assert!(!text.chars().any(|c| HOSTILE.contains(&c)), "{what}: {text:?}");
    };
    let told = runs(calibrate(&log, &scratch.path("cal.json")).arg("--report").arg(&report));
    is_plain("calibrate", &told);
    let mut diagnose = stretch();
    diagnose.args(["diagnose", "--no-next", "--reference", "length_mm", "--signal", "bridge_v"]);
    is_plain("diagnose", &runs(diagnose.arg(&log).arg("--report").arg(&page)));
    for path in [&report, &page] {
        let text = fs::read_to_string(path).unwrap();
        is_plain("report", &text);
        assert!(text.contains("\\u202e") || path == &page, "it is shown as what it is");
    }
    let mut evaluate = stretch();
    evaluate.args(["evaluate", "--json", "--calibration"]).arg(scratch.path("cal.json"));
    let told = runs(evaluate.arg(&log));
    is_plain("JSON on a terminal", &told);
    let _: serde_json::Value = serde_json::from_str(&told).expect("it is still JSON");
    let output =
        calibrate(&scratch.path(&format!("no{name}")), &scratch.path("x.json")).output().unwrap();
    let told = String::from_utf8(output.stderr).unwrap();
    is_plain("an error", &told);
    assert!(told.contains("noev\\u202e"), "{told}");
}

#[cfg(target_os = "linux")] // which has /dev/full
#[test]
fn a_cause_is_said_once() {
    let scratch = Scratch::new();
    let trial = scratch.loops("a.csv", 20.0, 1.1);
    for (path, cause) in
        [("/dev/full", "No space left on device"), ("/proc/none/x", "No such file")]
    {
        let output = calibrate(&trial, &scratch.path(path)).output().unwrap();
        let told = String::from_utf8(output.stderr).unwrap();
        assert_eq!(told.matches(cause).count(), 1, "{told}");
        assert!(!told.contains("os error"), "{told}");
    }
}

//! `stretch diagnose`, run as a user would.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::support::{Scratch, fails, json_to, one_line, prints, program, runs, stretch, warned};
use approx::assert_abs_diff_eq;
use assert_cmd::Command;
use serde_json::Value;
use testkit::{page::without_program, tolerance::TRAINED_APART};

/// Simulates a data set with effects: one arbitrary trial to fit, and one to test.
fn bench(scratch: &Scratch, name: &str, effects: &[&str]) -> PathBuf {
    let out = scratch.path(name);
    let parts = ["one", "two"].map(|part| {
        let folder = scratch.path(&format!("{name}-{part}"));
        let seed = if part == "one" { "3" } else { "4" };
        let mut command = stretch();
        command.args(["simulate", "--protocol", "arbitrary", "--seed", seed, "--out"]).arg(&folder);
        effects.iter().for_each(|e| {
            command.args(["--effect", e]);
        });
        runs(&mut command);
        folder.join("arbitrary_1.csv")
    });
    fs::create_dir(&out).unwrap();
    fs::copy(&parts[0], out.join("fit.csv")).unwrap();
    fs::copy(&parts[1], out.join("test.csv")).unwrap();
    describe(&out, &[("fit.csv", "fit"), ("test.csv", "test")]);
    out
}

fn describe(folder: &Path, trials: &[(&str, &str)]) {
    let mut text = "name = \"bench\"\nrate_hz = 100.0\n".to_owned();
    for (i, (file, split)) in trials.iter().enumerate() {
        let start = 75 * i;
        text += &format!(
            "[[trial]]\nfile = \"{file}\"\nkind = \"arbitrary\"\nstart_s = {start}.0\nsplit = \"{split}\"\n"
        );
    }
    fs::write(folder.join("dataset.toml"), text).unwrap();
}

/// Changes every sample of a column of a trial.
fn alter(file: &Path, column: &str, change: impl Fn(usize, f64) -> f64) {
    let text = fs::read_to_string(file).unwrap();
    let at = text.lines().next().unwrap().split(',').position(|c| c == column).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for (i, line) in lines.iter_mut().skip(1).enumerate() {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        cells[at] = change(i, cells[at].parse().unwrap()).to_string();
        *line = cells.join(",");
    }
    fs::write(file, lines.join("\n") + "\n").unwrap();
}

fn both(folder: &Path, column: &str, change: impl Fn(usize, f64) -> f64) {
    ["fit.csv", "test.csv"].iter().for_each(|file| alter(&folder.join(file), column, &change));
}

/// Renames columns of both trials, one after the other.
fn rename(folder: &Path, names: [(&str, &str); 3]) {
    for file in ["fit.csv", "test.csv"] {
        let text = fs::read_to_string(folder.join(file)).unwrap();
        let (head, rest) = text.split_once('\n').unwrap();
        let mut head: Vec<&str> = head.trim_end().split(',').collect();
        for (from, to) in names {
            head.iter_mut().filter(|c| **c == from).for_each(|c| *c = to);
        }
        fs::write(folder.join(file), head.join(",") + "\n" + rest).unwrap();
    }
}

fn diagnose(folder: &Path) -> Command {
    let mut command = stretch();
    command.arg("diagnose").arg(folder);
    command
}

#[test]
#[ignore = "five whole diagnoses; ./ci.sh runs it"]
fn a_simulated_effect_is_named_and_reported() {
    let scratch = Scratch::new();
    let folder = bench(&scratch, "bench", &["gauge_hysteresis:h=0.25,s=0.015"]);
    let (json, page) = (scratch.path("d.json"), scratch.path("d.html"));
    let run = |threads: &str, json: &Path| {
        let mut command = diagnose(&folder);
        command.arg(json_to(json)).arg("--verbose").env("RAYON_NUM_THREADS", threads);
        command
    };
    let text = runs(run("2", &json).arg("--report").arg(&page));
    let first = text.lines().next().unwrap();
    assert!(first.contains("gauge_hysteresis"), "{text}");
    let read = |path: &Path| -> Value {
        let mut value: Value = serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
        assert!(value["runtime_s"].take().as_f64().unwrap() > 0.0);
        value
    };
    let d = read(&json);
    assert_eq!((d["schema"].as_u64(), d["verdict"].as_str()), (Some(2), Some("effect")));
    assert_eq!(d["named"][0], "gauge_hysteresis");
    let best = &d["candidates"][0];
    assert!(best["parameters"].is_object() && best["closed"].as_f64().unwrap() > 0.8, "{best}");
    assert!(
        best["closed_ci"][0].as_f64().unwrap() > 0.5 && best["gap_before"].as_f64().unwrap() > 0.5
    );
    let stages = d["where"]["stages"].as_array().unwrap();
    let sensing = stages.iter().find(|s| s["stage"] == "sensing").unwrap();
    assert!(sensing["share"].as_f64().unwrap() > 0.9 && sensing["unit"] == "V");
    let regimes = d["where"]["slices"].as_array().unwrap();
    assert!(regimes.iter().any(|s| s["by"] == "regime" && s["slice"] == "turnaround"));
    assert!(d["parameters"].as_array().unwrap().iter().any(|p| p["name"] == "e0"));
    // A calibration trained on the simulation with the effect is nearly as good as one trained on
    // the measurement.
    let poly13 = |from: &str| d["transfer"]["poly13"][from].as_f64().unwrap();
    assert!(poly13("sim") > 1.2 * poly13("real") && d["transfer"]["unit"] == "percent_full_scale");
    let (with, real) = (poly13("sim_with_effect"), poly13("real"));
    assert_abs_diff_eq!(with, real, epsilon = TRAINED_APART * real);
    assert!(text.contains("after a fit to measured or simulated trials"), "{text}");
    // The result has the same bits for any number of threads.
    let (again, page_again) = (scratch.path("again.json"), scratch.path("again.html"));
    runs(run("1", &again).arg("--report").arg(&page_again));
    assert!(d == read(&again));
    let page = fs::read_to_string(page).unwrap();
    assert!(page == fs::read_to_string(page_again).unwrap(), "the report tells two runs apart");
    let page = without_program(&page);
    assert!(
        !page.contains("http://")
            && !page.contains("https://")
            && !page.contains("NaN")
            && !page.contains("class=\"missing\"")
    );
    // Without the effect in the catalogue, no other effect is named with the same confidence.
    let without = scratch.path("without.json");
    runs(diagnose(&folder).args(["--without", "gauge_hysteresis"]).arg(json_to(&without)));
    let w = read(&without);
    assert_ne!(w["named"][0], "gauge_hysteresis");
    assert!(w["candidates"][0]["closed"].as_f64() < d["candidates"][0]["closed"].as_f64());
}

#[test]
fn a_rig_without_a_fault_gets_no_name() {
    let scratch = Scratch::new();
    let folder = bench(&scratch, "bench", &[]);
    let text = runs(&mut diagnose(&folder));
    assert!(!text.lines().next().unwrap().contains("lacks"), "{text}");
    // A single trial: its last part is reserved for testing.
    describe(&folder, &[("fit.csv", "fit")]);
    let text = runs(&mut diagnose(&folder));
    assert!(text.contains("no test trial") && !text.contains("lacks"), "{text}");
}

#[test]
fn data_that_are_not_what_they_say_are_refused_by_name() {
    let scratch = Scratch::new();
    let good = bench(&scratch, "good", &[]);
    let spoiled = |name: &str, spoil: &dyn Fn(&Path)| {
        let folder = scratch.path(name);
        fs::create_dir(&folder).unwrap();
        for file in ["fit.csv", "test.csv", "dataset.toml"] {
            fs::copy(good.join(file), folder.join(file)).unwrap();
        }
        spoil(&folder);
        folder
    };
    let metres = spoiled("metres", &|f| both(f, "length_mm", |_, x| 1e-3 * x));
    fails(&mut diagnose(&metres), &["length_mm", "metres", "1000"]);
    let dead = spoiled("dead", &|f| both(f, "bridge_v", |_, _| 1.24));
    fails(&mut diagnose(&dead), &["bridge_v", "dead"]);
    let swapped = spoiled("swapped", &|f| {
        rename(f, [("length_mm", "x"), ("bridge_v", "length_mm"), ("x", "bridge_v")]);
    });
    fails(&mut diagnose(&swapped), &["swapped"]);
    // The sensor wire of one trial was disconnected; the others are valid.
    let loose = spoiled("loose", &|f| alter(&f.join("test.csv"), "bridge_v", |_, _| 1.24));
    fails(&mut diagnose(&loose), &["test.csv", "bridge_v", "dead"]);
    let valves =
        spoiled("valves", &|f| rename(f, [("inlet", "x"), ("outlet", "inlet"), ("x", "outlet")]));
    fails(&mut diagnose(&valves), &["inlet, outlet", "swapped"]);
    for (name, cell) in [("nan", "NaN"), ("blank", "")] {
        let folder = spoiled(name, &|f| {
            let text = fs::read_to_string(f.join("fit.csv")).unwrap();
            let row = text.lines().nth(100).unwrap();
            let (head, _) = row.rsplit_once(',').unwrap();
            fs::write(f.join("fit.csv"), text.replacen(row, &format!("{head},{cell}"), 1)).unwrap();
        });
        let text = runs(&mut diagnose(&folder));
        assert!(text.contains("fit.csv: a row is left out: row 101, column bridge_v"), "{text}");
    }
    let zeros = spoiled("zeros", &|f| both(f, "pressure_kpa", |_, _| 0.0));
    fails(&mut diagnose(&zeros), &["pressure_kpa", "dead", "take the column out"]);
    let tests = spoiled("tests", &|f| describe(f, &[("fit.csv", "test"), ("test.csv", "test")]));
    fails(&mut diagnose(&tests), &["there is no trial to fit", "not a test trial"]);
    let shut = spoiled("shut", &|f| {
        both(f, "inlet", |_, _| 0.0);
        both(f, "outlet", |_, _| 0.0);
    });
    fails(&mut diagnose(&shut), &["valve", "inlet"]);
    // Impossible requests are reported before the computation starts.
    fails(
        diagnose(&good).args(["--without", "gauge_histeresis"]),
        &["did you mean `gauge_hysteresis`"],
    );
    fails(&mut diagnose(&good.join("fit.csv")), &["--reference", "--signal"]);
    fails(&mut diagnose(&scratch.path("nowhere")), &["nowhere", "no such"]);
    let json = scratch.path("d.json");
    fails(diagnose(&metres).arg(json_to(&json)), &["metres"]);
    assert!(!json.exists());
}

#[test]
fn odd_data_get_an_honest_verdict() {
    let scratch = Scratch::new();
    // Two seconds are missing. This is reported, and no effect is named for it.
    let folder = bench(&scratch, "gap", &[]);
    let file = folder.join("fit.csv");
    let text = fs::read_to_string(&file).unwrap();
    let kept = text.lines().enumerate().filter(|(i, _)| !(5000..5200).contains(i));
    fs::write(&file, kept.map(|(_, l)| format!("{l}\n")).collect::<String>()).unwrap();
    let text = runs(&mut diagnose(&folder));
    assert!(
        text.contains("missing after") && !text.lines().next().unwrap().contains("lacks"),
        "{text}"
    );
    // A different rig: the gap is total, and no effect is named.
    let rig = prints(stretch().args(["simulate", "--print-rig"]));
    let other = rig
        .replace("value = 180.0", "value = 300.0")
        .replace("value = 25e-6", "value = 200e-6")
        .replace("value = 2.5e-5", "value = 2e-4");
    let other = scratch.write("other.toml", other);
    let text = runs(diagnose(&folder).arg("--rig").arg(&other));
    assert!(!text.lines().next().unwrap().contains("lacks"), "{text}");
    // Either a general message, or the most wrong value: 300 mm instead of 180 mm.
    assert!(text.contains("Is it the right rig") || text.contains("L0 in the rig file"), "{text}");
}

#[test]
fn a_simulator_that_has_the_effect_agrees() {
    let scratch = Scratch::new();
    let stock = prints(stretch().args(["simulate", "--print-rig"]));
    let agrees = |command: &mut Command, name: &str| {
        let text = runs(command);
        let first = text.lines().next().unwrap();
        assert!(first.contains("agree") && !first.contains("lacks"), "{name}: {text}");
    };
    for (effect, table) in [
        ("gauge_relaxation:c=0.4,tau=0.2", "name = \"gauge_relaxation\"\nc = 0.4\ntau = 0.2\n"),
        ("crossbeam_inertia:m=0.04", "name = \"crossbeam_inertia\"\nm = 0.04\n"),
        ("valve_delay:delay_s=0.04", "name = \"valve_delay\"\ndelay_s = 0.04\n"),
    ] {
        let name = effect.split(':').next().unwrap();
        let folder = bench(&scratch, name, &[effect]);
        let rig = scratch.write(&format!("{name}.toml"), format!("{stock}\n[[effect]]\n{table}"));
        agrees(diagnose(&folder).arg("--rig").arg(&rig), name);
        // The rig file that `simulate` wrote next to its trials describes the rig from which they
        // come.
        let written = scratch.path(&format!("{name}-one")).join("rig.toml");
        agrees(diagnose(&folder).arg("--rig").arg(&written), name);
    }
    let folder = scratch.path("valve_delay");
    for (from, to, words) in [
        ("[muscle]", "[muscles]", ["odd.toml", "`muscles`", "`muscle`"]),
        ("tau_m = ", "tau_n = ", ["odd.toml", "`tau_n`", "`tau_m`"]),
    ] {
        let odd = scratch.write("odd.toml", stock.replace(from, to));
        fails(diagnose(&folder).arg("--rig").arg(&odd), &words);
    }
}

#[test]
#[ignore = "whole diagnoses of two rigs; ./ci.sh runs it"]
fn a_wrong_rig_is_no_effect_and_a_strong_effect_is_no_wrong_rig() {
    let scratch = Scratch::new();
    let folder = bench(&scratch, "bench", &[]);
    let stock = prints(stretch().args(["simulate", "--print-rig"]));
    // Rigs that did not produce the data, and that cannot be reached within the tolerances.
    let others = [
        ("amplifier", "G = { value = 10.0", "G = { value = 8.0"),
        ("bridge", "beta = { value = 1.0", "beta = { value = 0.9"),
        ("chamber", "V0 = { value = 2.5e-5", "V0 = { value = 2.5e-6"),
        ("muscle", "L0 = { value = 180.0", "L0 = { value = 165.0"),
    ];
    for (name, from, to) in others {
        assert!(stock.contains(from), "{stock}");
        let other = scratch.write(&format!("{name}.toml"), stock.replace(from, to));
        let text = runs(diagnose(&folder).arg("--rig").arg(&other));
        let first = text.lines().next().unwrap();
        // The message names the rig in general, or the wrong value.
        let words = ["right rig", "rig file", "does not fit the rig"];
        let told = words.iter().any(|words| first.contains(words));
        assert!(told && !first.contains("lacks"), "{name}: {text}");
    }
    for effect in ["pressure_crosstalk:c=0.04", "crossbeam_inertia:m=0.07"] {
        let folder = bench(&scratch, effect.split(':').next().unwrap(), &[effect]);
        let text = runs(&mut diagnose(&folder));
        assert!(text.lines().next().unwrap().contains("lacks"), "{effect}: {text}");
    }
}

#[test]
fn a_saturated_channel_is_noticed_with_its_share() {
    let scratch = Scratch::new();
    let folder = bench(&scratch, "bench", &[]);
    both(&folder, "bridge_v", |_, v| v.min(1.9));
    let doubt = one_line(&warned(&mut diagnose(&folder)));
    assert!(doubt.contains("bridge_v is at 1.9 V, its greatest value, in"), "{doubt}");
    let text = runs(&mut diagnose(&folder));
    // A clipped recording may be explained by a saturated amplifier or a slack sleeve, and by
    // nothing else.
    let first = text.lines().next().unwrap();
    let named =
        ["the amplifier's saturation", "the sensor's slack"].iter().any(|e| first.contains(e));
    assert!(named || !first.contains("lacks"), "{text}");
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_nothing_half_written() {
    let scratch = Scratch::new();
    let folder = bench(&scratch, "bench", &[]);
    let out = scratch.path("out");
    fs::create_dir(&out).unwrap();
    let mut child = std::process::Command::new(program())
        .arg("diagnose")
        .env("RAYON_NUM_THREADS", "1")
        .arg(&folder)
        .arg(json_to(&out.join("d.json")))
        .arg("--report")
        .arg(out.join("d.html"))
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    std::thread::sleep(std::time::Duration::from_millis(150));
    let pid = rustix::process::Pid::from_child(&child);
    rustix::process::kill_process(pid, rustix::process::Signal::INT).unwrap();
    let code = child.wait().unwrap().code();
    // A machine that finished before the signal has written both files.
    let files = fs::read_dir(&out).unwrap().count();
    assert!((code, files) == (Some(130), 0) || (code, files) == (Some(0), 2), "{code:?} {files}");
}

#[test]
fn a_gauge_alone_is_diagnosed_beside_its_reference() {
    let scratch = Scratch::new();
    // The signal shows the length 30 ms earlier.
    let trial = scratch.loops("loops.csv", 60.0, 1.1);
    let page = scratch.path("gauge.html");
    let columns = ["--reference", "length_mm", "--signal", "bridge_v"];
    let text = runs(diagnose(&trial).args(columns).arg("--report").arg(&page));
    let first = text.lines().next().unwrap();
    assert!(
        first.contains("the time offset between") || first.contains("the amplifier's lag"),
        "{text}"
    );
    assert!(text.contains("skew_s = 0.03") || text.contains("skew_s = 0.029"), "{text}");
    assert!(!without_program(&fs::read_to_string(page).unwrap()).contains("NaN"));
    let dead = scratch.write("dead.csv", fs::read_to_string(&trial).unwrap());
    alter(&dead, "bridge_v", |_, _| 1.0);
    fails(diagnose(&dead).args(columns), &["bridge_v", "dead"]);
    fails(diagnose(&trial).args(["--reference", "angle_deg", "--signal", "s2"]), &["angle_deg"]);
}

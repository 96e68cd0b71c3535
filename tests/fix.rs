//! `stretch diagnose --fix` and `--snippets`: from a named effect to a simulator that agrees, run
//! as a new user would.

use std::{fs, path::Path};

use crate::support::{
    Scratch, fails, json_to,
    round_trip::{diagnosed, is_agreed, replayed},
    runs, stretch,
};
use serde_json::Value;

/// Simulates two sessions with one arbitrary trial each: one to fit, one to test.
fn bench(scratch: &Scratch, effects: &[&str]) -> std::path::PathBuf {
    let out = scratch.path("bench");
    fs::create_dir(&out).unwrap();
    let mut text = "name = \"bench\"\nrate_hz = 100.0\n".to_owned();
    for (i, (seed, split)) in [("3", "fit"), ("4", "test")].into_iter().enumerate() {
        let folder = scratch.path(split);
        let mut command = stretch();
        command.args(["simulate", "--protocol", "arbitrary", "--seed", seed, "--out"]).arg(&folder);
        for effect in effects {
            command.args(["--effect", effect]);
        }
        runs(&mut command);
        fs::copy(folder.join("arbitrary_1.csv"), out.join(format!("{split}.csv"))).unwrap();
        text += &format!(
            "[[trial]]\nfile = \"{split}.csv\"\nkind = \"arbitrary\"\nstart_s = {}.0\nsplit = \"{split}\"\n",
            75 * i
        );
    }
    fs::write(out.join("dataset.toml"), text).unwrap();
    out
}

#[test]
fn a_named_effect_is_written_agrees_and_replays_the_measurement() {
    let scratch = Scratch::new();
    let folder = bench(&scratch, &["gauge_relaxation:c=0.15,tau=0.4,spread=2", "leak:c=6e-11"]);
    let (fixed, code) = (scratch.path("fixed.toml"), scratch.path("code"));
    let mut command = stretch();
    command.arg("diagnose").arg(&folder).arg("--no-next").arg("--fix").arg(&fixed);
    let said = runs(command.arg("--snippets").arg(&code));
    for part in [
        "gauge_relaxation",
        "leak",
        "To implement",
        "state: p, q, r, last (strain) begin",
        "code: 6 files",
    ] {
        assert!(said.contains(part), "no {part:?} in: {said}");
    }
    let text = fs::read_to_string(&fixed).unwrap();
    for part in
        ["# Found by stretch", "[[effect]]", "spread = ", "form; 95 %", "of the gap on trials"]
    {
        assert!(text.contains(part), "no {part:?} in: {text}");
    }
    for file in ["leak.c", "leak.py", "leak.m", "gauge_relaxation.c"] {
        assert!(code.join(file).is_file(), "{file}");
    }
    let again = diagnosed(&scratch, &folder, Some(&fixed), None);
    assert!(is_agreed(&again), "{}", again["sentence"]);
    let rig = fs::read_to_string(&fixed).unwrap();
    assert!(rig.contains("tolerance = "), "re-tuned parameters keep a tolerance");
    // The first trial, which has no predecessor.
    for (column, floors) in replayed(&scratch, &fixed, &folder.join("fit.csv"), &folder) {
        assert!(floors < 1.1, "{column}: {floors} floors");
    }
    // An existing file is replaced, which is reported. An input file or a folder is not replaced.
    let with = |rig: &Path| {
        let mut command = stretch();
        command.arg("diagnose").arg(&folder).args(["--no-next", "--rig"]).arg(rig);
        command
    };
    fails(with(&fixed).arg("--fix").arg(&fixed), &["fixed.toml", "choose another output file"]);
    fails(with(&fixed).arg("--snippets").arg(&code), &["code", "exists"]);
    let other = scratch.write("other.toml", "mine");
    let said = runs(with(&fixed).arg("--fix").arg(&other));
    assert!(said.contains("replacing the existing file"), "{said}");
    assert!(fs::read_to_string(&other).unwrap().contains("in the rig file already"));
}

#[test]
fn where_nothing_is_named_it_is_said_what_is_written() {
    let scratch = Scratch::new();
    let folder = bench(&scratch, &[]);
    let fixed = scratch.path("fixed.toml");
    let run = |folder: &Path| {
        let mut command = stretch();
        command.arg("diagnose").arg(folder).args(["--no-next", "--fix"]).arg(&fixed);
        runs(command.arg("--snippets").arg(scratch.path("code")))
    };
    let said = run(&folder);
    assert!(said.contains("fixed.toml: the rig re-tuned, with no effect"), "{said}");
    assert!(said.contains("code is not written: no effect is named"), "{said}");
    assert!(!fs::read_to_string(&fixed).unwrap().contains("[[effect]]"));
    assert!(is_agreed(&diagnosed(&scratch, &folder, Some(&fixed), None)));
    fs::remove_file(&fixed).unwrap();
    // A length in inches is an error of the recording, not of the rig.
    for file in ["fit.csv", "test.csv"] {
        let path = folder.join(file);
        let text = fs::read_to_string(&path).unwrap();
        let mut lines = text.lines();
        let head = lines.next().unwrap();
        let at = head.split(',').position(|c| c == "bridge_v").unwrap();
        let scaled = lines.map(|line| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            cells[at] = (1.3 * cells[at].parse::<f64>().unwrap()).to_string();
            cells.join(",") + "\n"
        });
        fs::write(&path, format!("{head}\n") + &scaled.collect::<String>()).unwrap();
    }
    let said = run(&folder);
    assert!(said.contains("fixed.toml is not written: the recording or the rig file"), "{said}");
    assert!(!fixed.exists());
}

#[test]
fn a_gauge_alone_is_written_and_agrees() {
    let scratch = Scratch::new();
    let mut text = "time_s,angle_deg,s1\n".to_owned();
    let rod = |t: f64| 40.0 + 20.0 * (1.3 * t).sin() + 10.0 * (3.1 * t).sin();
    for i in 0..4000_u64 {
        let t = 0.01 * i as f64;
        let noise = 1e-3 * ((i * i * 7919) % 1000) as f64 / 1000.0;
        text += &format!("{t:.2},{:.5},{:.6}\n", rod(t), 0.02 * rod((t - 0.05).max(0.0)) + noise);
    }
    let file = scratch.write("rod.csv", text);
    let fixed = scratch.path("gauge.toml");
    let run = |more: &[&str]| {
        let mut command = stretch();
        command.arg("diagnose").arg(&file);
        command.args(["--reference", "angle_deg", "--signal", "s1", "--no-next"]).args(more);
        command
    };
    let said = runs(run(&[]).arg("--fix").arg(&fixed));
    assert!(said.contains("with channel_skew"), "{said}");
    let text = fs::read_to_string(&fixed).unwrap();
    assert!(text.contains("kind = \"gauge\"") && text.contains("skew_s = 0.0"), "{text}");
    let json = scratch.path("d.json");
    runs(run(&["--rig"]).arg(&fixed).arg(json_to(&json)));
    let again: Value = serde_json::from_str(&fs::read_to_string(&json).unwrap()).unwrap();
    assert!(is_agreed(&again), "{}", again["sentence"]);
}

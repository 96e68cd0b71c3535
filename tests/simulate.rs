//! `stretch simulate` and `effects`, run as a user would.

use std::fs;

use crate::support::{Scratch, fails, prints, runs, stretch};

#[test]
fn a_run_is_repeated_from_its_own_rig_file() {
    let scratch = Scratch::new();
    let (first, again) = (scratch.path("first"), scratch.path("again"));
    let said = runs(
        stretch()
            .args([
                "simulate",
                "--effect",
                "gauge_hysteresis:h=0.2,s=0.012",
                "--seed",
                "5",
                "--out",
            ])
            .arg(&first),
    );
    assert!(said.contains("17 trials, 480 s, gauge_hysteresis, seed 5"), "{said}");
    runs(
        stretch().args(["simulate", "--rig"]).arg(first.join("rig.toml")).arg("--out").arg(&again),
    );
    let mut files = 0;
    for entry in fs::read_dir(&first).unwrap() {
        let name = entry.unwrap().file_name();
        if name != "dataset.toml" {
            let read = |folder: &std::path::Path| fs::read(folder.join(&name)).unwrap();
            assert!(read(&first) == read(&again), "{name:?}");
            files += 1;
        }
    }
    assert_eq!(files, 18);
    // The data are compared with the stock rig, not with the rig that has the effect.
    assert!(!fs::read_to_string(first.join("dataset.toml")).unwrap().contains("rig ="));
}

#[test]
fn a_rig_of_ones_own_is_named_without_its_effects() {
    let scratch = Scratch::new();
    let text = prints(stretch().args(["simulate", "--print-rig"]));
    assert!(text.contains("tau_m") && text.contains("# Lag of the muscle (s)"));
    let text =
        text.replace("value = 180.0", "value = 200.0") + "[[effect]]\nname = \"leak\"\nc = 1e-10\n";
    let rig = scratch.write("rig.toml", &text);
    let out = scratch.path("out");
    runs(
        stretch()
            .args(["simulate", "--protocol", "pulses", "--rig"])
            .arg(&rig)
            .arg("--out")
            .arg(&out),
    );
    let read = |name: &str| fs::read_to_string(out.join(name)).unwrap();
    assert!(read("dataset.toml").contains("rig = \"nominal.toml\""));
    assert!(
        read("nominal.toml").contains("L0 = { value = 200.0 }")
            && !read("nominal.toml").contains("leak")
    );
    assert!(read("rig.toml").contains("leak") && read("rig.toml").contains("seed"));
}

#[test]
fn replayed_commands_give_the_trial_again() {
    let scratch = Scratch::new();
    let (out, replay) = (scratch.path("out"), scratch.path("replay"));
    let quiet = ["--noise", "off"];
    runs(
        stretch().args(["simulate", "--protocol", "arbitrary"]).args(quiet).arg("--out").arg(&out),
    );
    let trial = out.join("arbitrary_1.csv");
    runs(
        stretch()
            .arg("simulate")
            .arg("--protocol")
            .arg(&trial)
            .args(quiet)
            .arg("--out")
            .arg(&replay),
    );
    assert!(fs::read(&trial).unwrap() == fs::read(replay.join("arbitrary_1.csv")).unwrap());
}

#[test]
fn a_replayed_session_is_the_session_again() {
    let scratch = Scratch::new();
    let (out, replay) = (scratch.path("out"), scratch.path("replay"));
    let effect = ["--effect", "gauge_softening:m=0.1", "--effect", "thermal_drift:d=1e-4"];
    runs(stretch().args(["simulate", "--protocol", "paper"]).args(effect).arg("--out").arg(&out));
    runs(
        stretch()
            .arg("simulate")
            .args(effect)
            .arg("--protocol")
            .arg(&out)
            .arg("--out")
            .arg(&replay),
    );
    for name in ["dataset.toml", "inflation_0_25.csv", "deflation_50.csv", "arbitrary_3.csv"] {
        let read = |folder: &std::path::Path| fs::read_to_string(folder.join(name)).unwrap();
        let own = read(&replay).replace("name = \"replay\"", "name = \"out\"");
        assert!(read(&out) == own, "{name}");
    }
}

/// Returns the largest difference between a column of two trials.
fn apart(a: &std::path::Path, b: &std::path::Path, column: &str) -> f64 {
    let values = |path: &std::path::Path| -> Vec<f64> {
        let text = fs::read_to_string(path).unwrap();
        let mut lines = text.lines();
        let at = lines.next().unwrap().split(',').position(|c| c == column).unwrap();
        lines.map(|line| line.split(',').nth(at).unwrap().parse().unwrap()).collect()
    };
    values(a).iter().zip(values(b)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn a_replay_does_what_every_column_says_or_refuses_it_by_name() {
    let scratch = Scratch::new();
    let mut count = 0;
    let mut replayed = |head: &str, cells: &dyn Fn(usize) -> String| {
        count += 1;
        let rows = (0..800).map(|i| format!("{:.2},{}\n", 0.01 * i as f64, cells(i)));
        let text = format!("time_s,{head}\n") + &rows.collect::<String>();
        let (file, out) = (scratch.write("next.csv", text), scratch.path(&format!("out_{count}")));
        let mut command = stretch();
        command.args(["simulate", "--noise", "off", "--effect", "amplifier_lowpass:tau=0.1"]);
        command.arg("--protocol").arg(&file).arg("--out").arg(&out);
        (command, out.join("next.csv"))
    };
    let fills = |i: usize| if (100..160).contains(&i) { "1,0" } else { "0,0" };
    let (mut usual, usual_at) = replayed("inlet,outlet", &|i| fills(i).to_owned());
    runs(&mut usual);
    let (mut dim, dim_at) =
        replayed("inlet,outlet,excitation_share", &|i| fills(i).to_owned() + ",0.7");
    runs(&mut dim);
    assert!(apart(&usual_at, &dim_at, "bridge_v") > 0.1, "the bridge is dimmed");
    assert_eq!(apart(&usual_at, &dim_at, "length_mm"), 0.0);
    assert!(fs::read_to_string(&dim_at).unwrap().contains("excitation_share"));
    // With the length clamped, the chamber fills and the muscle does not move.
    let (mut clamped, clamped_at) =
        replayed("inlet,outlet,set_length_mm", &|i| fills(i).to_owned() + ",165");
    runs(&mut clamped);
    assert_eq!(apart(&usual_at, &clamped_at, "pressure_kpa"), 0.0);
    let text = fs::read_to_string(&clamped_at).unwrap();
    assert!(text.lines().skip(1).all(|line| line.split(',').nth(4) == Some("165")));
    // A shunt acts immediately, and a slow amplifier after it responds slowly.
    let shunted = |i: usize| if (200..400).contains(&i) { "0.02" } else { "0" };
    let (mut shunt, shunt_at) = replayed("inlet,outlet,set_length_mm,shunt_share", &|i| {
        format!("{},165,{}", fills(i), shunted(i))
    });
    runs(&mut shunt);
    let moved = apart(&clamped_at, &shunt_at, "bridge_v");
    assert!((0.03..0.1).contains(&moved), "{moved}");
    for (head, cell, parts) in [
        ("set_pressure_kpa", "100", ["next.csv", "set_pressure_kpa", "does not know this command"]),
        ("heater_share", "0.5", ["next.csv", "heater_share", "excitation_share"]),
        ("shunt_share", "0.02", ["next.csv", "shunt_share", "add the column set_length_mm"]),
        ("excitation_share", "-1", ["next.csv", "excitation_share", "above 0 and at most 2"]),
    ] {
        let (mut command, at) =
            replayed(&format!("inlet,outlet,{head}"), &|i| format!("{},{cell}", fills(i)));
        fails(&mut command, &parts);
        assert!(!at.exists());
    }
    let (mut command, _) = replayed("inlet,outlet,excitation_share", &|i| {
        format!("{},{}", fills(i), if i < 400 { "1" } else { "0.7" })
    });
    fails(
        &mut command,
        &["next.csv", "excitation_share", "it contains 0.7, and 1 in the first row"],
    );
    // An experiment for a gauge alone sets a quantity that this rig does not have.
    let (mut command, _) = replayed("set_angle_deg", &|_| "10".to_owned());
    fails(&mut command, &["next.csv", "set_angle_deg"]);
}

#[test]
fn a_folder_that_exists_is_refused_and_left_alone() {
    let scratch = Scratch::new();
    let out = scratch.path("out");
    fs::create_dir(&out).unwrap();
    fs::write(out.join("mine.txt"), "mine").unwrap();
    let run = || {
        let mut command = stretch();
        command.args(["simulate", "--protocol", "pulses", "--out"]).arg(&out);
        command
    };
    fails(&mut run(), &["out", "exists"]);
    assert_eq!(fs::read_dir(&out).unwrap().count(), 1);
    runs(run().arg("--force"));
    assert_eq!(fs::read_to_string(out.join("mine.txt")).unwrap(), "mine");
    assert!(out.join("pulses_1.csv").is_file());
}

#[test]
fn wrong_input_is_named() {
    let scratch = Scratch::new();
    let out = scratch.path("out");
    let commands = |text: &str, parts: &[&str]| {
        let file = scratch.write("commands.csv", text);
        fails(stretch().arg("simulate").arg("--protocol").arg(&file).arg("--out").arg(&out), parts);
        assert!(!out.exists());
    };
    let header = "time_s,inlet,outlet\n";
    commands("time_s,inlet\n0,0\n0.01,0\n", &["commands.csv", "outlet"]);
    commands(&format!("{header}0,0,0\n0.01,1.2,0\n"), &["commands.csv", "inlet", "1.2", "0 .. 1"]);
    let gap = format!("{header}0,0,0\n0.01,0,0\n0.02,0,0\n0.05,0,0\n0.06,0,0\n");
    commands(&gap, &["commands.csv", "sample 3", "0.01 s"]);
    let rig = prints(stretch().args(["simulate", "--print-rig"]));
    let file = scratch.write("rig.toml", rig.replace("value = 0.35", "value = -0.35"));
    let with = |file: &std::path::Path, parts: &[&str]| {
        fails(stretch().args(["simulate", "--rig"]).arg(file).arg("--out").arg(&out), parts);
    };
    with(&file, &["rig.toml", "b = -0.35", "positive"]);
    let file = scratch.write("rig.toml", rig.replace("tau_m", "tau_mm"));
    with(&file, &["rig.toml", "tau_mm", "did you mean `tau_m`?"]);
    assert!(!out.exists());
}

#[test]
fn the_catalogue_is_listed() {
    let text = runs(stretch().arg("effects"));
    for name in ["supply_sag", "gauge_softening", "pot_backlash", "form tail: 0 .. 2.5"] {
        assert!(text.contains(name), "{name}");
    }
    let json: serde_json::Value =
        serde_json::from_str(&runs(stretch().args(["effects", "--json"]))).unwrap();
    assert_eq!(json.as_array().unwrap().len(), 23);
    assert_eq!(json[0]["parameters"][0]["name"], "r");
    assert_eq!(json[0]["parameters"][1]["role"], "form");
    let code = prints(stretch().args(["effects", "leak", "--code", "python"]));
    assert!(code.contains("def leak(p):") && code.contains("kg/(s Pa)"), "{code}");
    fails(stretch().args(["effects", "lek"]), &["did you mean `leak`?"]);
}

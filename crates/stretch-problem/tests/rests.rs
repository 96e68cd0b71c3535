//! The noise of a black box is estimated from its recordings while its commands are constant.

use std::fmt::Write as _;

use stretch_data::{Channel, SessionTrial, Trial};
use stretch_gap::RandomGenerator;
use stretch_problem::{Checked, ProblemSpec, StageEntry, first_problem};

const DT_S: f64 = 0.01;
const NOISE: f64 = 0.05;

/// A command that is held for 1.5 s, and the angle behind it: a resonance of 3 Hz, lightly damped, with noise.
fn recorded(damping: f64, seed: u64) -> [Vec<f64>; 2] {
    let mut random = RandomGenerator::new(seed, 0);
    let (w, h) = (std::f64::consts::TAU * 3.0, DT_S / 50.0);
    let (mut y, mut v, mut x) = (0.0, 0.0, 0.0);
    let (mut command, mut angle) = (Vec::new(), Vec::new());
    for i in 0..4000 {
        if i % 150 == 0 {
            x = 5.0 * (2.0 * random.unit() - 1.0);
        }
        command.push(x);
        angle.push(y + NOISE * random.gauss());
        for _ in 0..50 {
            v += h * (w * w * (x - y) - 2.0 * damping * w * v);
            y += h * v;
        }
    }
    [command, angle]
}

#[test]
fn noise_that_is_not_told_is_that_of_the_rests() {
    for damping in [0.05, 0.5] {
        let [command, angle] = recorded(damping, 1);
        let channel = |name: &str, values| Channel { name: name.into(), values };
        let time_s = (0..angle.len()).map(|i| DT_S * i as f64).collect();
        let channels = vec![channel("command_V", command), channel("angle_rad", angle)];
        let problem = Checked::new(ProblemSpec {
            stages: vec![StageEntry {
                name: "servo".into(),
                output: "angle_rad".into(),
                inputs: vec!["command_V".into()],
                ..StageEntry::default()
            }],
            trials: vec![SessionTrial::new(Trial { name: "a.csv".into(), time_s, channels })],
            ..ProblemSpec::default()
        });
        let problem = problem.expect("a problem");
        let noise = problem.description().spec().stages[0].noise.clone().expect("from the rests");
        assert!((noise.sd() / NOISE - 1.0).abs() < 0.2, "{damping}: {noise:?}");
        assert!(noise.source().starts_with("rests of the recording: "), "{noise:?}");
    }
}

#[test]
fn a_first_problem_says_the_noise_and_what_from() {
    let folder = std::env::temp_dir().join(format!("stretch-rests-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    for (i, name) in ["a.csv", "b.csv"].into_iter().enumerate() {
        let [command, angle] = recorded(0.05, 3 + i as u64);
        let mut text = "time_s,command_V,angle_rad\n".to_owned();
        for (i, (u, y)) in command.iter().zip(&angle).enumerate() {
            writeln!(text, "{:.2},{u},{y}", DT_S * i as f64).expect("text");
        }
        std::fs::write(folder.join(name), text).expect("written");
    }
    let text = first_problem(&folder).expect("a problem");
    std::fs::remove_dir_all(&folder).expect("removed");
    let line = text.lines().find(|line| line.starts_with("noise = ")).expect("a line of noise");
    let told: f64 =
        line["noise = ".len()..].split_whitespace().next().expect("a number").parse().expect("it");
    assert!((told / NOISE - 1.0).abs() < 0.2, "{line}");
    assert!(line.contains("measured: rests of the recording: "), "{line}");
}

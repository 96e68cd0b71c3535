//! Wrong inputs that would still give numbers are reported or refused.

use std::{fmt::Write, fs};

use crate::support::{Scratch, calibrate, fails, one_line, stretch};

#[test]
fn a_trial_that_is_fitted_is_not_tested_on_under_another_name() {
    let scratch = Scratch::new();
    scratch.loops("a.csv", 30.0, 1.1);
    fs::copy(scratch.path("a.csv"), scratch.path("b.csv")).unwrap();
    let mut set = "name = 's'\nrate_hz = 100\n".to_owned();
    for (name, split) in [("a", "fit"), ("b", "test")] {
        let _ = writeln!(set, "[[trial]]\nfile = '{name}.csv'\nkind = 'other'\nsplit = '{split}'");
    }
    scratch.write("dataset.toml", set);
    let told = ["b.csv is a test trial, and it has the same samples as a.csv, which is fitted"];
    fails(stretch().arg("diagnose").arg(scratch.path("")), &told);
    let trials = "[[trial]]\nfile = \"a.csv\"\n[[trial]]\nfile = \"b.csv\"\nsplit = \"test\"\n";
    let stage = "[[stage]]\noutput = \"bridge_v\"\ninputs = [\"length_mm\"]\n";
    let problem = scratch.write("p.toml", format!("simulator = [\"true\"]\n{stage}{trials}"));
    fails(stretch().arg("diagnose").arg(problem), &told);
    // A trial that is fitted twice has double weight.
    let out = calibrate(&scratch.path("a.csv"), &scratch.path("c.json"))
        .arg(scratch.path("b.csv"))
        .output();
    let out = out.unwrap();
    let said = one_line(&String::from_utf8_lossy(&[out.stdout, out.stderr].concat()));
    assert!(said.contains("b.csv has the same samples as a.csv: they count twice"), "{said}");
}

const PROBLEM: &str = r#"
[simulator]
command = ["false"]
start_s = 5
[[stage]]
name = "plant"
output = "angle_deg"
inputs = ["command_V"]
noise = 0.1
[[input]]
column = "command_V"
unit = "V"
[[effect]]
name = "brake"
unit = "deg"
range = [0, 20]
off = 0
twins = ["output.backlash"]
[[trial]]
file = "a.csv"
"#;

#[test]
fn entries_of_a_problem_that_cannot_be_are_refused() {
    let scratch = Scratch::new();
    let row = |i: u32| format!("{:.2},{},{}\n", 0.01 * f64::from(i), (i / 50) % 3, (i / 40) % 7);
    let rows: String = (0..800).map(row).collect();
    scratch.write("a.csv", format!("time_s,command_V,angle_deg\n{rows}"));
    let own = "stage plant: its output angle_deg is one of its inputs";
    let cases = [
        (
            "noise = 0.1",
            "noise = 1e12",
            "a noise of 1000000000000 hides all of angle_deg, which spans 6",
        ),
        ("unit = \"V\"", "unit = \"V\"\nnoise = 1e12", "hides all of command_V, which spans 2"),
        ("noise = 0.1", "unit = \"kg\"", "its unit is kg, but its column angle_deg is in deg"),
        ("off = 0", "off = -3", "off = -3 is outside of its range, 0 to 20"),
        ("[\"command_V\"]", "[\"command_V\", \"angle_deg\"]", own),
        ("output.backlash", "output.backslash", "effect brake: there is no twin output.backslash"),
        ("\"a.csv\"", "\"a.csv\"\nsplit = \"test\"", "there is no trial to fit"),
        // Times beyond the range of a clock do not cause a panic.
        ("start_s = 5", "start_s = 1e19\ndeadline_s = 1e19", "it closed its standard output"),
        ("start_s = 5", "start_s = 5", "it closed its standard output"),
    ];
    for (from, to, told) in cases {
        assert!(PROBLEM.contains(from), "{from}");
        let path = scratch.write("p.toml", PROBLEM.replacen(from, to, 1));
        fails(stretch().arg("diagnose").arg(path), &[told]);
    }
}

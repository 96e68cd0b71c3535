//! An output never overwrites an input of the same command or another output, whatever the paths
//! look like.
#![cfg(unix)]

use std::{fs, os::unix::fs::symlink, process::Stdio};

use crate::support::{
    Scratch, fails, one_line, runs, stretch,
    written::{command, prepared, tree},
};

/// Commands that would write `OUT` over one of the files that they read.
const OVER_INPUTS: [(&str, &str); 35] = [
    // A shell turns --out r*.csv into the names of all recordings, the first of which is not an
    // input.
    ("calibrate --out OUT b.csv", "a.csv"),
    ("calibrate a.csv --out cal.json --report OUT", "b.csv"),
    ("convert --out OUT b.csv", "a.csv"),
    ("apply --calibration cal.json --out OUT b.csv", "a.csv"),
    ("calibrate b.csv a.csv --out OUT", "a.csv"),
    ("calibrate a.csv --out new.json --report OUT", "a.csv"),
    ("calibrate a.csv --out new.json --json=OUT", "a.csv"),
    ("calibrate a.csv --out new.json --report r.html --test b.csv --json=OUT", "b.csv"),
    ("calibrate a.csv --model diagnosed --from d.json --out OUT", "d.json"),
    ("calibrate bench --out OUT", "bench/arbitrary_1.csv"),
    ("calibrate bench --out OUT", "bench/dataset.toml"),
    ("calibrate a.csv --prior prior.json --out OUT", "prior.json"),
    ("calibrate a.csv --signal bridge_v --session OUT --out new.json", "a.csv"),
    ("sleeve learn s1.json s2.json s3.json --out OUT", "s1.json"),
    ("sleeve renew --prior prior.json a.csv --out OUT", "prior.json"),
    ("apply --calibration cal.json a.csv --out OUT", "a.csv"),
    ("apply --calibration cal.json a.csv --out OUT", "cal.json"),
    ("evaluate --calibration cal.json a.csv --json=OUT", "a.csv"),
    ("evaluate --calibration cal.json a.csv --json=OUT", "cal.json"),
    ("convert a.csv --out OUT", "a.csv"),
    ("convert a.csv --from-zero --out OUT", "a.csv"),
    ("diagnose bench --report OUT", "bench/arbitrary_1.csv"),
    ("diagnose bench --fix OUT", "bench/dataset.toml"),
    ("diagnose bench --rig rig.toml --fix OUT", "rig.toml"),
    ("diagnose a.csv --reference length_mm --signal bridge_v --experiment OUT", "a.csv"),
    ("diagnose own/problem.toml --fix OUT", "own/problem.toml"),
    ("diagnose own/problem.toml --report OUT", "own/c.csv"),
    ("diagnose own/problem.toml --json=OUT", "own/sim.py"),
    ("predict own/fixed.toml a.csv --report OUT", "own/fixed.toml"),
    ("predict own/fixed.toml a.csv --json=OUT", "a.csv"),
    ("effects --data bench --json=OUT", "bench/arbitrary_1.csv"),
    ("export --calibration cal.json --fixed OUT", "cal.json"),
    ("listen --port - --calibration cal.json --out OUT", "cal.json"),
    ("simulate --protocol a.csv --out OUT --force", "a.csv"),
    ("demo --data a.csv --json=OUT --out new", "a.csv"),
];

const PROBLEM: &str = "simulator = [\"python3\", \"sim.py\"]\n[[stage]]\noutput = \"length_mm\"\ninputs = [\"bridge_v\"]\n\
                       noise = 0.1\n[[trial]]\nfile = \"c.csv\"\n";

fn inputs() -> Scratch {
    let scratch = prepared();
    scratch.loops("b.csv", 20.0, 0.9);
    for name in ["d.json", "prior.json", "s1.json", "s2.json", "s3.json"] {
        scratch.write(name, format!("this is {name}"));
    }
    fs::copy(scratch.path("bench/rig.toml"), scratch.path("rig.toml")).unwrap();
    fs::create_dir(scratch.path("own")).unwrap();
    fs::copy(scratch.path("a.csv"), scratch.path("own/c.csv")).unwrap();
    scratch.write("own/problem.toml", PROBLEM);
    let wrapped = "[[wrapped]]\nname = \"output.length_mm.lag\"\nvalues = { tau = 0.1 }\n";
    scratch.write("own/fixed.toml", format!("{PROBLEM}{wrapped}"));
    scratch.write("own/sim.py", "raise SystemExit\n");
    scratch
}

#[test]
fn an_output_over_an_input_is_refused_whatever_it_is_called() {
    let scratch = inputs();
    for (line, input) in OVER_INPUTS {
        let path = scratch.path(input);
        fs::write(scratch.path("old"), "old").unwrap();
        let (symbolic, hard) = (scratch.path("symbolic"), scratch.path("hard"));
        symlink(&path, &symbolic).unwrap();
        fs::hard_link(&path, &hard).unwrap();
        let before = tree(&scratch.path(""));
        for out in [input, &format!("./bench/../{input}"), "symbolic", "hard"] {
            let mut command = stretch();
            command.current_dir(scratch.path(""));
            command.args(line.split(' ').map(|part| part.replace("OUT", out)));
            let output = command.output().expect("the program runs");
            let message = one_line(&String::from_utf8_lossy(&output.stderr));
            assert_eq!(output.status.code(), Some(1), "{line}, {out}: {message}");
            assert!(message.contains(out), "{line}, {out}: {message}");
            assert!(tree(&scratch.path("")) == before, "{line}, {out}: {message}");
        }
        fs::remove_file(symbolic).unwrap();
        fs::remove_file(hard).unwrap();
    }
}

#[test]
fn a_refusal_names_the_option_and_the_input() {
    let scratch = inputs();
    for (line, parts) in [
        (
            "convert a.csv --out ./a.csv",
            ["a.csv: cannot open it", "--out ./a.csv would overwrite it"],
        ),
        (
            "apply --calibration cal.json a.csv --out cal.json",
            ["cal.json: cannot read it", "--out cal.json would overwrite it"],
        ),
        (
            "calibrate --out a.csv b.csv",
            ["--out a.csv: this file is a recording", "such as cal.json"],
        ),
        (
            "convert --out a.csv b.csv",
            ["--out a.csv: this file is a recording", "name another file"],
        ),
        (
            "calibrate a.csv --out x.json --report ./x.json",
            ["--report ./x.json", "--out x.json is the same file, or one lies in the other"],
        ),
    ] {
        fails(stretch().current_dir(scratch.path("")).args(line.split(' ')), &parts);
    }
    // If standard input is redirected from a file, that file is an input.
    scratch.write("begun.csv", "time_s,bridge_v\n");
    let before = tree(&scratch.path(""));
    let mut piped = command(&scratch, "apply --calibration cal.json - --out begun.csv");
    let from = fs::File::open(scratch.path("begun.csv")).unwrap();
    let output = piped.stdin(from).stderr(Stdio::piped()).output().unwrap();
    let message = one_line(&String::from_utf8_lossy(&output.stderr));
    assert!(!output.status.success(), "{message}");
    assert!(message.contains("--out begun.csv") && message.contains("standard input"), "{message}");
    assert!(tree(&scratch.path("")) == before);
}

#[test]
fn two_outputs_of_one_name_are_refused_before_anything_is_there() {
    let scratch = inputs();
    fs::create_dir(scratch.path("sub")).unwrap();
    symlink(scratch.path("sub"), scratch.path("link")).unwrap();
    let before = tree(&scratch.path(""));
    for line in [
        "calibrate a.csv --out x.json --report ./x.json",
        "calibrate a.csv --out sub/x --json=link/x",
        "calibrate a.csv --out x.json --session sub/../x.json",
        "diagnose a.csv --reference length_mm --signal bridge_v --fix x --report x",
        "diagnose a.csv --reference length_mm --signal bridge_v --snippets x --report x/r.html",
        "diagnose a.csv --reference length_mm --signal bridge_v --experiment x --json=./x",
        "predict own/fixed.toml a.csv --report x --json=sub/../x",
        "export --calibration cal.json --c x --fixed ./x",
        "sleeve renew --prior prior.json a.csv --out x --json=./x",
        "demo --out x --json=x/d.json",
    ] {
        let parts = [
            "x",
            "is the same file, or one lies in the other; choose another path for one of them",
        ];
        fails(stretch().current_dir(scratch.path("")).args(line.split(' ')), &parts);
        assert!(tree(&scratch.path("")) == before, "{line}");
    }
}

#[test]
fn what_is_no_loss_is_done() {
    let scratch = inputs();
    for line in [
        // These targets hold no data.
        "convert a.csv --out /dev/null",
        "calibrate a.csv --out /dev/null --report /dev/null --json=/dev/null",
        "evaluate --calibration cal.json a.csv --json=/dev/stdout",
        // An output of an earlier run.
        "calibrate a.csv --out cal.json --report cal.html",
        "apply --calibration cal.json a.csv --out estimate.csv",
        "apply --calibration cal.json b.csv --out estimate.csv",
        "convert a.csv --out out.csv",
        // Commands that update a file in place.
        "export --calibration cal.json --seal",
        "init logs --force",
        // A user's own rig file in a folder that is replaced is kept.
        "simulate --protocol pulses --rig bench/mine.toml --out bench --force",
    ] {
        fs::copy(scratch.path("rig.toml"), scratch.path("bench/mine.toml")).unwrap();
        runs(stretch().current_dir(scratch.path("")).args(line.split(' ')));
    }
}

#[test]
fn a_folder_that_is_replaced_does_not_take_an_input_with_it() {
    let scratch = inputs();
    let before = tree(&scratch.path(""));
    for line in [
        "simulate --protocol bench --out bench --force",
        "simulate --protocol bench/arbitrary_1.csv --rig rig.toml --out bench --force",
        "simulate --protocol pulses --rig bench/rig.toml --out bench --force",
    ] {
        let parts = ["bench: cannot write it: this command reads bench/"];
        fails(stretch().current_dir(scratch.path("")).args(line.split(' ')), &parts);
        assert!(tree(&scratch.path("")) == before, "{line}");
    }
}

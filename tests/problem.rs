//! `stretch init` and `stretch diagnose problem.toml`: custom simulators with any recording.

use std::{fmt::Write, fs, path::Path};

use crate::support::{json_to, one_line, stretch};

/// Writes a recording of a servo with a brake of 2 degrees and a new command every 0.6 s.
fn recording(path: &Path) {
    recording_from(path, 7);
}

fn recording_from(path: &Path, mut seed: u64) {
    let (mut rows, mut held, mut angle) = (String::new(), 0.0, 0.0_f64);
    let mut random = || {
        seed = seed.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(1);
        (seed >> 11) as f64 / 2_f64.powi(52) - 1.0
    };
    for i in 0..4000 {
        if i % 60 == 0 {
            held = 5.0 * random();
        }
        let shown = angle + 0.08 * random();
        let push = 10.5 * held - angle;
        angle += 0.01 / 0.11 * (push - push.clamp(-2.0, 2.0));
        writeln!(rows, "{:.2},{held:.4},{shown:.4}", 0.01 * f64::from(i)).unwrap();
    }
    fs::write(path, format!("time_s,command_V,angle_deg\n{rows}")).unwrap();
}

const PARAMETERS: &str = r#"
[[parameter]]
name = "gain"
unit = "deg/V"
value = 10
tolerance = "10 %"
[[parameter]]
name = "tau"
unit = "s"
value = 0.1
tolerance = 0.01
[[effect]]
name = "brake"
unit = "deg"
range = [0, 20]
off = 0
"#;

/// Diagnoses a problem file, or the one in a folder. Returns whether it succeeded, and its output
/// in one line.
fn said(path: &Path, more: &[&str]) -> (bool, String) {
    let inside = path.join("problem.toml");
    let file = if inside.exists() { &inside } else { path };
    let out = stretch().arg("diagnose").arg(file).args(more).output().unwrap();
    let text = [out.stdout, out.stderr].concat();
    let text = String::from_utf8(text).unwrap();
    // The line breaks depend on the width of the terminal.
    (out.status.success(), text.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// A text without the line breaks at the width of the terminal.
fn unfolded(text: &[u8]) -> String {
    String::from_utf8_lossy(text).replace('\n', " ")
}

#[test]
#[ignore = "needs python3 with NumPy; ./ci.sh runs it"]
fn with_numpy_a_folder_becomes_a_problem_and_a_worker_answers_it() {
    let folder = tempfile::tempdir().unwrap();
    recording(&folder.path().join("a.csv"));
    stretch().arg("init").arg(folder.path()).assert().success();
    stretch().arg("init").arg(folder.path()).assert().failure();
    let file = folder.path().join("problem.toml");
    let first = fs::read_to_string(&file).unwrap();
    assert!(first.contains("# Guessed: the last column that is not a command is the output"));
    let own = first
        .replace("wrap = \"all\"", "wrap = [\"input.delay\", \"output.lag\", \"output.backlash\"]")
        .replace("sim.py", "servo.py");
    fs::write(&file, own.clone() + PARAMETERS).unwrap();
    let servo = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/workers/servo.py");
    fs::copy(servo, folder.path().join("servo.py")).unwrap();
    let json = folder.path().join("d.json");
    let page = folder.path().join("d.html");
    let to_json = json_to(&json);
    let files = [to_json.as_str(), "--report", page.to_str().unwrap()];
    let (is_good, text) = said(folder.path(), &files);
    assert!(is_good && text.starts_with("The simulator lacks brake"), "{text}");
    assert!(
        text.contains("These data determine 2 of ")
            && text.contains("to a third of their tolerance"),
        "{text}"
    );
    let value: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(json).unwrap()).unwrap();
    assert_eq!(value["named"][0], "brake");
    assert!(value["model_runs"]["count"].as_u64().unwrap() < 400);
    assert_eq!(value["identifiability"][0]["knowledge"], "determined");
    assert!(fs::read_to_string(page).unwrap().contains("brake"));
    // The generated problem has the name of its folder.
    let name = folder.path().file_name().unwrap().to_str().unwrap();
    assert_eq!((&value["seed"], &value["data_set"]), (&1.into(), &name.into()));

    // With the corrected problem file, nothing is missing any more.
    let fixed = folder.path().join("fixed.toml");
    let (is_good, text) = said(folder.path(), &["--fix", fixed.to_str().unwrap()]);
    assert!(is_good && text.contains("the problem re-tuned, with brake"), "{text}");
    let (is_good, text) = said(folder.path(), &["--fix", file.to_str().unwrap()]);
    assert!(!is_good && text.contains("would overwrite it"), "{text}");
    assert!(fs::read_to_string(&fixed).unwrap().contains("value = "));
    let json = folder.path().join("again.json");
    let (is_good, text) = said(&fixed, &[json_to(&json).as_str()]);
    let again: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(json).unwrap()).unwrap();
    let agrees = ["no_gap", "parameters"].contains(&again["verdict"].as_str().unwrap());
    assert!(is_good && agrees, "{text}");

    // It predicts a recording that was not fitted.
    recording_from(&folder.path().join("b.csv"), 8);
    let (b, page) = (folder.path().join("b.csv"), folder.path().join("f.html"));
    let json = folder.path().join("f.json");
    let predicted = |more: &[&str]| {
        let mut command = stretch();
        command.arg("predict").arg(&fixed).arg(&b).args(more);
        command.output().unwrap()
    };
    let to_json = json_to(&json);
    let files = ["--report", page.to_str().unwrap(), to_json.as_str()];
    let out = predicted(&files);
    let text = unfolded(&out.stdout);
    assert!(
        out.status.success() && text.contains("With brake the simulator predicts 1 of 1"),
        "{text}"
    );
    let value: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(json).unwrap()).unwrap();
    let output = &value["trials"][0]["outputs"][0];
    assert!(output["ratio"].as_f64().unwrap() < 0.7, "{output}");
    assert!(output["times_noise"].as_f64().unwrap() < 1.5, "{output}");
    assert!(fs::read_to_string(page).unwrap().contains("predicted without the fix"));
    assert_eq!(predicted(&["--fail-above", "3"]).status.code(), Some(0));
    assert_eq!(predicted(&["--fail-above", "0.5", "--quiet"]).status.code(), Some(3));
    assert_eq!(predicted(&["--fail-above", "0"]).status.code(), Some(1));
    let bare = stretch().arg("predict").arg(&file).arg(&b).output().unwrap();
    let text = String::from_utf8_lossy(&bare.stderr).into_owned();
    assert!(!bare.status.success() && text.contains("it holds no effect that was found"), "{text}");
    // Other people have the card, but not the recording that was fitted.
    let there = fs::read(folder.path().join("a.csv")).unwrap();
    fs::remove_file(folder.path().join("a.csv")).unwrap();
    let out = predicted(&[]);
    let text = unfolded(&out.stdout);
    assert!(text.starts_with("The fix holds for these recordings. With brake"), "{text}");
    let copy = folder.path().join("copy.csv");
    fs::write(&copy, &there).unwrap();
    let out = stretch().arg("predict").arg(&fixed).arg(&copy).output().unwrap();
    let text = unfolded(&out.stdout);
    assert!(text.contains("copy.csv is one of the recordings of the card"), "{text}");
    fs::write(folder.path().join("a.csv"), there).unwrap();
    // The earlier name of the command.
    let old = stretch().arg("foretell").arg(&fixed).arg(&b).output().unwrap();
    let text = String::from_utf8_lossy(&old.stderr).into_owned();
    assert!(old.status.code() == Some(2) && text.contains("stretch predict"), "{text}");

    // Both runs are fitted separately.
    let two = own.clone() + PARAMETERS + "[[trial]]\nfile = \"b.csv\"\n";
    let both = folder.path().join("both.toml");
    fs::write(&both, two).unwrap();
    let json = folder.path().join("by.json");
    let (is_good, text) = said(&both, &["--by", "trial", json_to(&json).as_str()]);
    assert!(
        is_good && text.contains("the 2 runs agree within their intervals in every value"),
        "{text}"
    );
    let value: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(json).unwrap()).unwrap();
    assert_eq!(value["by_trial"]["runs"][1]["values"][2]["name"], "brake.brake");
    let (is_good, text) = said(&both, &["--by", "load_kg"]);
    assert!(
        !is_good && text.contains("there is no column load_kg; the columns are time_s"),
        "{text}"
    );

    // A Python object as the simulator, which raises an error.
    let module = "def servo(parameters, effects):\n    raise ValueError('no such gear')\n";
    fs::write(folder.path().join("own.py"), module).unwrap();
    let command = "command = [\"python3\", \"servo.py\"]";
    assert!(own.contains(command));
    fs::write(&file, own.replace(command, "python = \"own:servo\"") + PARAMETERS).unwrap();
    let (is_good, text) = said(folder.path(), &[]);
    assert!(!is_good && text.contains("ValueError: no such gear"), "{text}");
}

#[test]
fn what_is_wrong_in_a_file_is_told_with_key_and_value() {
    let folder = tempfile::tempdir().unwrap();
    recording(&folder.path().join("a.csv"));
    let good = "simulator = [\"no-such-program\"]\n[[stage]]\noutput = \"angle_deg\"\ninputs = [\"command_V\"]\n[[trial]]\nfile = \"a.csv\"\n";
    let cases = [
        (
            "output = \"angle_deg\"",
            "outptu = \"angle_deg\"",
            "row 3, key stage[0].outptu: unknown (did you mean output?)",
        ),
        ("file = \"a.csv\"", "file = \"b.csv\"", "b.csv"),
        ("command_V", "comand_V", "there is no column comand_V (did you mean command_V?)"),
        (
            "simulator = [\"no-such-program\"]",
            "simulator = []",
            "key simulator.command: it is empty",
        ),
        ("simulator = [\"no-such-program\"]", "simulator = { fmu = \"x.fmu\" }", "fmu"),
        ("[[trial]]", "[[trial]]\nsplit = \"tset\"", "\"tset\" is none of fit, test"),
        ("simulator", "simulator", "no-such-program could not be started"),
    ];
    for (from, to, told) in cases {
        fs::write(folder.path().join("problem.toml"), good.replacen(from, to, 1)).unwrap();
        let (is_good, text) = said(folder.path(), &[]);
        assert!(!is_good && text.contains(told), "{to}: {text}");
        // If the program that runs FMUs is next to this one, the message is that the file does not
        // exist.
        let is_fmu = text.contains("STRETCH_FMU") || text.contains("x.fmu: No such file");
        assert!(is_fmu || !to.contains("fmu ="), "{to}: {text}");
    }
    let (is_good, text) = said(folder.path(), &["--rig", "x.toml"]);
    assert!(
        !is_good && text.contains("--rig: it works with the built-in simulators only"),
        "{text}"
    );
}

#[test]
fn a_problem_of_the_built_in_gauge_is_its_data_set() {
    let folder = tempfile::tempdir().unwrap();
    let rows: String = (0..4000)
        .map(|i| {
            let t = 0.01 * f64::from(i);
            let rod = |t: f64| 40.0 + 20.0 * (1.3 * t).sin() + 10.0 * (3.1 * t).sin();
            let noise = 1e-3 * f64::from((i * i) % 1000) / 1000.0;
            format!("{t:.2},{:.5},{:.6}\n", rod(t), 0.02 * rod(t - 0.05) + noise)
        })
        .collect();
    fs::write(folder.path().join("rod.csv"), format!("time_s,rod_mm,s1\n{rows}")).unwrap();
    let text = "[simulator]\nbuiltin = \"gauge\"\ndata_set = \"rod.csv\"\nreference = \"rod_mm\"\nsignal = \"s1\"\n";
    fs::write(folder.path().join("problem.toml"), text).unwrap();
    let (is_good, text) = said(folder.path(), &[]);
    let begin = "The calibration line lacks an effect that makes s1 late by 50 ms (the time offset between signal and reference";
    assert!(is_good && text.starts_with(begin), "{text}");
}

/// A folder as received from another user: recordings, and a problem whose simulator leaves a file
/// when it runs.
fn downloaded(folder: &Path) -> std::path::PathBuf {
    recording(&folder.join("a.csv"));
    let text = "simulator = [\"sh\", \"-c\", \"touch ran; exec cat\"]\n[[stage]]\noutput = \"angle_deg\"\ninputs = [\"command_V\"]\n[[trial]]\nfile = \"a.csv\"\n";
    fs::write(folder.join("problem.toml"), text).unwrap();
    folder.join("ran")
}

#[test]
#[cfg(unix)]
fn a_folder_runs_no_program_unasked() {
    let scratch = tempfile::tempdir().unwrap();
    // A folder may have a name that ends like that of a file.
    for name in ["bench", "bench.toml"] {
        let folder = scratch.path().join(name);
        fs::create_dir(&folder).unwrap();
        let ran = downloaded(&folder);
        for arguments in [&["diagnose"][..], &["effects", "--data"], &["demo", "--data"], &["init"]]
        {
            let out = stretch().args(arguments).arg(&folder).output().unwrap();
            assert!(!out.status.success() && !ran.exists(), "{arguments:?} {name}");
            let text = String::from_utf8_lossy(&out.stderr).replace('\n', " ");
            let tells = [
                "it names a program to run (sh -c \"touch ran; exec cat\")",
                "give the file itself",
            ];
            let is_told = arguments[0] == "demo" || arguments[0] == "init";
            assert!(
                is_told || tells.iter().all(|part| text.contains(part)),
                "{arguments:?}: {text}"
            );
        }
    }
}

#[test]
#[cfg(unix)]
fn what_runs_is_said_in_a_line_before() {
    let folder = tempfile::tempdir().unwrap();
    let ran = downloaded(folder.path());
    let file = folder.path().join("problem.toml");
    for command in [&["diagnose"][..], &["effects", "--data"]] {
        let out = stretch().args(command).arg(&file).output().unwrap();
        let text = one_line(&String::from_utf8_lossy(&out.stderr));
        // A worker that echoes its input does not send a valid hello.
        assert!(!out.status.success(), "{text}");
        fs::remove_file(&ran).unwrap_or_else(|_| panic!("it did not run: {text}"));
        let runs = format!("runs this program in the folder {}: ", folder.path().display());
        assert_eq!(text.matches(&runs).count(), 1, "{text}");
        assert!(text.contains(&format!("{runs}sh -c \"touch ran; exec cat\"")), "{text}");
    }
}

#[test]
#[cfg(unix)]
fn what_a_data_set_or_a_rig_file_says_runs_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let ran = downloaded(folder.path());
    let set =
        "name = 'a'\nrate_hz = 100\n[[trial]]\nfile = 'a.csv'\nkind = 'other'\nsplit = 'fit'\n";
    let command = "simulator = ['sh', '-c', 'touch ran']\n";
    let gauge = ["--reference", "angle_deg", "--signal", "command_V"];
    // A problem file next to a data set is not read. A simulator entry in the data set or in a rig
    // file is ignored.
    for text in [set.to_owned(), format!("{command}{set}")] {
        fs::write(folder.path().join("dataset.toml"), text).unwrap();
        stretch().arg("diagnose").arg(folder.path()).args(gauge).output().unwrap();
        stretch().arg("demo").arg("--data").arg(folder.path()).output().unwrap();
        assert!(!ran.exists());
    }
    let rig = folder.path().join("rig.toml");
    fs::write(&rig, format!("{command}kind = 'gauge'\n")).unwrap();
    let mut asked = stretch();
    asked.arg("diagnose").arg(folder.path().join("a.csv")).args(gauge).arg("--rig").arg(rig);
    assert!(!asked.output().unwrap().status.success() && !ran.exists());
}

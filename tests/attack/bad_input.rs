//! Wrong input gives a message that states the place, exit code 1, and no output. Invalid files are
//! in `corpus/`.

use std::fs::File;

use crate::support::{Scratch, calibrate, fails, program, stdout, stretch};

#[test]
fn what_cannot_be_read_or_written_is_named_and_nothing_is_written() {
    let scratch = Scratch::new();
    let good = std::fs::read_to_string(scratch.calibration("cal.json")).unwrap();
    let at = good.find("\"dead_band\": ").unwrap() + "\"dead_band\": ".len();
    let end = at + good[at..].find(',').unwrap();
    scratch.write("newer.json", good.replace("\"schema\": 2", "\"schema\": 7"));
    scratch.write("half.json", &good[..good.len() / 2]);
    scratch.write("text.json", "not json");
    scratch.write("sim.toml", "[gauge]\ngain = 2\n");
    scratch.write("d.json", "{\"verdict\": \"effect\", \"sentence\": \"none\"}");
    scratch.write("null.json", format!("{}null{}", &good[..at], &good[end..]));
    scratch.write("below.json", format!("{}-3.0{}", &good[..at], &good[end..]));
    scratch.write("other.csv", "time_s,s1\n0,1\n0.01,2\n");
    scratch.loops("a.csv", 20.0, 1.2);
    std::fs::create_dir(scratch.path("folder")).unwrap();
    let long = scratch.write("gigabyte.csv", "time_s,length_mm,bridge_v\n");
    File::options().write(true).open(&long).unwrap().set_len(1 << 30).unwrap();
    let before = scratch.names();
    let run = |line: &str| {
        let mut command = stretch();
        command.current_dir(scratch.path("")).args(line.split(' '));
        command
    };
    for (line, parts) in [
        ("calibrate nowhere.csv --out new.json", &["nowhere.csv", "open"][..]),
        ("calibrate gigabyte.csv --out new.json", &["gigabyte.csv", "row 2", "longer than"]),
        ("calibrate a.csv --out a.csv/new.json", &["new.json", "cannot write"]),
        ("calibrate a.csv --out folder", &["folder"]),
        ("apply --calibration newer.json a.csv", &["newer.json", "schema is 7", "update"]),
        ("apply --calibration half.json a.csv", &["half.json", "EOF"]),
        ("apply --calibration text.json a.csv", &["text.json", "a text file"]),
        ("apply --calibration a.csv a.csv", &["a.csv: this is a text file, such as a recording"]),
        ("evaluate --calibration a.csv a.csv", &["recording (CSV), and not a calibration"]),
        ("export --calibration a.csv", &["recording (CSV), and not a calibration"]),
        ("export --calibration sim.toml --c made", &["sim.toml: this is a TOML file"]),
        (
            "apply --calibration d.json a.csv",
            &["d.json: this is a diagnosis and not a calibration"],
        ),
        (
            "calibrate other.csv --reference s1 --signal s1 --out new.json",
            &["s1 is both the signal and the reference"],
        ),
        ("apply --calibration null.json a.csv", &["null.json", "dead_band"]),
        ("apply --calibration below.json a.csv", &["below.json", "dead_band", "-3"]),
        ("apply --calibration cal.json other.csv", &["other.csv", "bridge_v", "s1"]),
    ] {
        fails(&mut run(line), parts);
    }
    for (option, hint) in [
        ("--model poly77", "poly55"),
        ("--model cubic", "use poly03"),
        ("--rate savgol:11", "savgol:WINDOW,DEGREE"),
        ("--robust both", "bisquare"),
    ] {
        let output = run(&format!("calibrate a.csv --out new.json {option}")).output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(message.contains(hint), "{message}");
    }
    let output = run("export --calibration cal.json --adc 10,0,5").output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(2) && message.contains("--c <DIR>"), "{message}");
    assert_eq!(scratch.names(), before);
}

#[test]
fn crlf_bom_and_semicolons_are_understood() {
    let scratch = Scratch::new();
    let plain = scratch.loops("plain.csv", 20.0, 1.3);
    let text = std::fs::read_to_string(&plain).unwrap();
    let foreign = format!("\u{feff}{}", text.replace(',', ";").replace('\n', "\r\n"));
    let foreign = scratch.write("foreign.csv", foreign);
    let german = text.replace(',', ";").replace('.', ",").replace("bridge_v", "Bridge (V)");
    let german = scratch.write("german.csv", german.replace("time_s", "Zeit [s]"));
    for (trial, out) in [(&plain, "a.json"), (&foreign, "b.json"), (&german, "c.json")] {
        calibrate(trial, &scratch.path(out)).assert().success().stderr("");
    }
    let mut verbose = calibrate(&german, &scratch.path("c.json"));
    let output = verbose.arg("-v").output().unwrap();
    assert!(String::from_utf8_lossy(&output.stderr).contains("numbers have decimal commas"));
    let read = |name| std::fs::read_to_string(scratch.path(name)).unwrap();
    // The checksum covers the trial's name, too.
    let unsealed = |name| read(name).split("\"digest\"").next().unwrap().to_owned();
    assert_eq!(unsealed("a.json"), unsealed("b.json").replace("foreign.csv", "plain.csv"));
    assert_eq!(unsealed("a.json"), unsealed("c.json").replace("german.csv", "plain.csv"));
}

#[test]
fn a_dash_is_standard_input_and_output_and_never_a_file() {
    let scratch = Scratch::new();
    let plain = scratch.loops("plain.csv", 20.0, 1.3);
    let text = std::fs::read_to_string(&plain).unwrap();
    let piped = |arguments: &[&str]| {
        let mut command = stretch();
        command.current_dir(scratch.path("")).args(arguments).write_stdin(text.clone());
        let output = command.output().expect("the program runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        stdout(&output)
    };
    let converted = piped(&["convert", "-", "--out", "-"]);
    let values = |text: &str| -> Vec<f64> {
        text.lines().skip(1).flat_map(|l| l.split(',')).map(|x| x.parse().unwrap()).collect()
    };
    assert!(values(&converted) == values(&text), "other numbers, or something beside them");
    calibrate(&plain, &scratch.path("cal.json")).assert().success();
    let record = std::fs::read_to_string(scratch.path("cal.json")).unwrap();
    let own = piped(&["calibrate", "-", "--out", "-"]);
    let unsealed = |text: &str| text.split("\"digest\"").next().unwrap().to_owned();
    assert_eq!(unsealed(&own).replace("standard input", "plain.csv"), unsealed(&record));
    let live = piped(&["apply", "--calibration", "cal.json", "-"]);
    assert_eq!(piped(&["apply", "--calibration", "cal.json", "plain.csv", "--out", "-"]), live);
    piped(&["evaluate", "--calibration", "cal.json", "-"]);
    let mut two = stretch();
    two.current_dir(scratch.path("")).args(["calibrate", "-", "--out", "-", "--report", "-"]);
    fails(&mut two, &["two files cannot go to standard output"]);
    let mut folder = stretch();
    folder.current_dir(scratch.path("")).args(["simulate", "--protocol", "paper", "--out", "-"]);
    fails(&mut folder, &["17 trials", "standard output"]);
    assert_eq!(scratch.names(), ["cal.json", "plain.csv"], "a file called -");
}

#[cfg(unix)]
#[test]
fn a_full_disk_leaves_nothing_half_written() {
    let scratch = Scratch::new();
    let calibration = scratch.calibration("cal.json");
    let trial = scratch.loops("long.csv", 60.0, 1.2);
    let before = scratch.names();
    // A file size limit acts like a full disk. Its signal is ignored, so that the write fails.
    let script =
        "trap '' XFSZ; ulimit -f 8; exec \"$0\" apply --calibration \"$1\" \"$2\" --out \"$3\"";
    let output = std::process::Command::new("bash")
        .args(["-c", script])
        .arg(program())
        .args([&calibration, &trial, &scratch.path("out.csv")])
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("out.csv") && message.contains("cannot write"), "{message}");
    assert_eq!(scratch.names(), before);
}

#[test]
fn the_papers_differentiator_cannot_run_live() {
    let scratch = Scratch::new();
    let trial = scratch.loops("trial.csv", 30.0, 1.2);
    let out = scratch.path("cal.json");
    calibrate(&trial, &out).args(["--rate", "central"]).assert().success();
    // On a log, the rate estimator may use later samples.
    stretch().arg("apply").arg("--calibration").arg(&out).arg(&trial).assert().success();
    let mut live = stretch();
    live.arg("apply").arg("--calibration").arg(&out).arg("-").write_stdin("time_s,bridge_v\n0,1\n");
    fails(&mut live, &["rate estimator"]);
}

#[test]
fn a_malformed_line_does_not_end_a_live_stream() {
    let scratch = Scratch::new();
    let calibration = scratch.calibration("cal.json");
    let mut stream = String::from("time_s,bridge_v\n");
    for n in 0..30 {
        stream += &format!("{:.2},{}\n", 0.01 * f64::from(n), 1.5 + 0.002 * f64::from(n));
        if n == 20 {
            stream += "what is this\n,,\n";
        }
    }
    let output = stretch()
        .arg("apply")
        .arg("--calibration")
        .arg(&calibration)
        .arg("-")
        .write_stdin(stream)
        .output()
        .unwrap();
    assert!(output.status.success());
    assert_eq!(stdout(&output).lines().count(), 31);
    let notes = String::from_utf8_lossy(&output.stderr);
    assert!(notes.contains("row 23") && notes.contains("row 24"), "{notes}");
}

//! Small files that are wrong, a folder a reader, each with the sentence that it must earn (`sentences.txt`:
//! exit code and the last line of standard error). Recordings in other formats than CSV have their own, in
//! the crate that reads them.

use std::{fs, path::Path};

use crate::support::{Scratch, stretch, unbroken};
use stretch_calibrate::calibration_to_json;
use stretch_receptor::example_calibration;
use testkit::corpus::is_as_it_should;

/// A servo's problem whose worker answers with what a file holds.
const PROBLEM: &str = r#"name = "servo"
wrap = "all"
[simulator]
command = ["sh", "-c", "cat frames.bin; sleep 0.3"]
start_s = 5
[[stage]]
name = "plant"
output = "angle_deg"
inputs = ["command_V"]
[[parameter]]
name = "gain"
unit = "deg/V"
value = 10
tolerance = "10 %"
[[trial]]
file = "a.csv"
"#;

/// What the program says of a file of the corpus that was put where a user would have it.
fn told(reader: &str, folder: &Path, name: &str) -> String {
    let scratch = Scratch::new();
    let bytes = fs::read(folder.join(name)).unwrap();
    let mut command = stretch();
    command.current_dir(scratch.path(""));
    let servo = || {
        let row =
            |i: u32| format!("{:.2},{},{}\n", 0.01 * f64::from(i), (i / 50) % 3, (i / 40) % 7);
        scratch.write(
            "a.csv",
            format!("time_s,command_V,angle_deg\n{}", (0..800).map(row).collect::<String>()),
        );
    };
    let put = |as_name: &str| {
        scratch.write(as_name, &bytes);
    };
    match reader {
        "data_set" => {
            fs::create_dir(scratch.path("set")).unwrap();
            scratch.loops("set/a.csv", 20.0, 1.1);
            put("set/dataset.toml");
            command.args(["calibrate", "set", "--out", "cal.json"]);
        }
        "link" => {
            put(name);
            scratch.write("board.json", calibration_to_json(&example_calibration()).unwrap());
            command.args(["listen", "--calibration", "board.json", "--port", name]);
        }
        "problem" => {
            servo();
            put(name);
            command.args(["diagnose", name]);
        }
        "record" => {
            put(name);
            command.args(["export", "--calibration", name]);
        }
        "rig" => {
            put(name);
            command.args(["simulate", "--protocol", "pulses", "--out", "out", "--rig", name]);
        }
        "trial" => {
            put(name);
            command.args(["calibrate", name, "--out", "cal.json"]);
        }
        _ => {
            servo();
            put("frames.bin");
            scratch.write("problem.toml", PROBLEM);
            command.args(["diagnose", "problem.toml"]);
        }
    }
    let output = command.timeout(std::time::Duration::from_secs(60)).output().unwrap();
    let said = unbroken(&String::from_utf8(output.stderr).expect("what is said is text"));
    assert!(!said.contains("panicked"), "{reader}/{name}: {said}");
    let last = said.lines().rfind(|line| !line.trim().is_empty()).unwrap_or("");
    if output.status.code() != Some(0) {
        let left = ["cal.json", "out"].into_iter().find(|name| scratch.path(name).exists());
        assert_eq!(left, None, "{reader}/{name}: something was written");
        assert!(
            scratch.names().iter().all(|name| !name.starts_with(".stretch-")),
            "{reader}/{name}"
        );
    }
    let code = output.status.code().map_or("killed".to_owned(), |code| code.to_string());
    format!("{name}: {code}: {last}").trim_end().to_owned()
}

/// A test a folder.
macro_rules! readers {
    ($($reader:ident)*) => {$(
        #[test]
        fn $reader() {
            let reader = stringify!($reader);
            let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(reader);
            is_as_it_should(&folder, |name| told(reader, &folder, name));
        }
    )*};
}

readers! { data_set link problem record rig trial worker }

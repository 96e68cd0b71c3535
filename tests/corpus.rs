//! Small invalid files, in one folder per reader, each with the expected message (`sentences.txt`
//! holds exit code and last line of standard error). Tests for recordings in other formats than CSV
//! are in the crate that reads them.

use std::{fs, path::Path};

use crate::support::{Scratch, stretch, unbroken};
use stretch_calibrate::calibration_to_json;
use stretch_receptor::example_calibration;
use testkit::corpus::is_as_it_should;

/// A problem file of a servo whose worker answers with the contents of a file.
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

/// Runs the program on a file of the corpus, placed where a user would have it, and returns its
/// message.
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

/// Generates a test for each folder.
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

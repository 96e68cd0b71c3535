//! `stretch export`: from trials to C code that compiles, and the refused cases.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use stretch_sleeve::{array_bytes, example_array};

use crate::support::{Scratch, calibrate, fails, runs, stdout, stretch, warned};

/// Calibrates with these arguments, and returns the path of the calibration file.
fn calibrated(scratch: &Scratch, arguments: &[&str]) -> PathBuf {
    let (trial, out) = (scratch.loops("a.csv", 20.0, 1.1), scratch.path("cal.json"));
    runs(calibrate(&trial, &out).args(arguments));
    out
}

fn export(calibration: &Path, out: &Path) -> assert_cmd::Command {
    let mut command = stretch();
    command.arg("export").arg("--calibration").arg(calibration).arg("--c").arg(out);
    command
}

/// Compiles and runs a program, and returns its output.
fn compiled(compiler: &[&str], folder: &Path, main: &str, include: &Path) -> String {
    let (source, program) = (folder.join("main.c"), folder.join("program"));
    fs::write(&source, main).unwrap();
    let mut command = Command::new(compiler[0]);
    command.args(&compiler[1..]).args(["-Wall", "-Wextra", "-Werror", "-I"]).arg(include);
    let output = command.arg(source).arg("-o").arg(&program).arg("-lm").output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let output = Command::new(program).output().unwrap();
    assert!(output.status.success(), "{}", stdout(&output));
    stdout(&output)
}

/// Asserts that a header passes its self-test when compiled with the system's C compiler.
fn passes_its_self_test(scratch: &Scratch, header: &Path) {
    let main = "#include \"stretch.h\"\nint main(void) { return stretch_self_test(); }\n";
    compiled(&["cc", "-std=c99"], &scratch.path("."), main, header);
}

#[test]
fn a_header_of_every_model_passes_its_self_test() {
    for (model, form, says) in [
        ("linear", "fixed", "linear, fixed"),
        ("poly13", "float", "poly13, float"),
        ("observer", "float", "observer, float"),
        ("observer+rest", "fixed", "observer+rest, fixed"),
    ] {
        let scratch = Scratch::new();
        let calibration = calibrated(&scratch, &["--model", model]);
        let out = scratch.path("c");
        let said = runs(export(&calibration, &out).args(["--form", form]));
        assert!(said.contains(says) && said.contains("200 samples"), "{said}");
        let per_code = said.contains("one code changes the estimate by 0.0");
        assert_eq!(per_code, form == "fixed", "{said}");
        passes_its_self_test(&scratch, &out);
    }
}

/// The parts of an Arduino core that the examples need: a converter that returns a rising code or,
/// for a disconnected gauge, its last code; a clock; and a serial port that is standard output.
const ARDUINO: &str = r#"
#include <cstdint>
#include <iostream>
static const uint8_t A0 = 0, A1 = 1;
static int code = 1600, cut_off = -1;
static uint32_t now_us = 4294000000u; // it wraps soon
static uint32_t micros() { return now_us; }
static int analogRead(int pin) { return pin == cut_off ? 4095 : code += 3; }
static void analogReadResolution(int bits) { if (bits != 12) { std::cout << "bits " << bits; } }
struct Port {
    void begin(long) {}
    void print(double x, int) { std::cout << x; }
    template <class T> void print(T x) { std::cout << x; }
    template <class T> void println(T x) { std::cout << x << "\n"; }
} Serial;
"#;

#[test]
#[ignore = "needs g++; ./ci.sh runs it"]
fn with_gxx_an_arduino_library_reads_a_sample_every_period() {
    let scratch = Scratch::new();
    let calibration = calibrated(&scratch, &["--model", "poly13"]);
    for form in ["fixed", "float"] {
        let library = scratch.path(form);
        runs(export(&calibration, &library).args(["--arduino", "--form", form]));
        let properties = fs::read_to_string(library.join("library.properties")).unwrap();
        for key in ["name=", "version=", "author=", "maintainer=", "sentence=", "category=Sensors"]
        {
            assert!(properties.lines().any(|line| line.starts_with(key)), "{key}");
        }
        let sentence = "sentence=Converts the signal bridge_v to length_mm, ";
        assert!(properties.contains(sentence), "{properties}");
        let keywords = fs::read_to_string(library.join("keywords.txt")).unwrap();
        assert!(keywords.contains("stretch_step\tKEYWORD2\n"));
        let example = library.join("examples/Live/Live.ino");
        let main = format!(
            "{ARDUINO}\n#include \"{}\"\nint main() {{ setup(); for (int n = 0; n < 300; n++) {{ loop(); \
             now_us += n == 200 ? 70000 : 5000; }} code = 9000; loop(); now_us += 10000; \
             code = 4092; loop(); now_us += 5000; loop(); }}\n",
            example.display()
        );
        let compiler = ["g++", "-x", "c++", "-std=gnu++11"];
        let said = compiled(&compiler, &scratch.path("."), &main, &library.join("src"));
        let lines: Vec<&str> = said.lines().collect();
        // A loop every 5 ms takes every other sample. A loop of 70 ms loses six samples, and the
        // rate filter warms up again.
        assert_eq!(lines.iter().filter(|line| **line == "warming").count(), 20, "{said}");
        assert_eq!(lines.len(), 153, "{said}");
        // a number that no code of the converter has, and its last code
        assert_eq!(lines[151..], ["missing", "missing"], "{said}");
        assert!(lines[60].contains("mm falling"), "{said}");
    }
}

#[test]
#[ignore = "needs g++; ./ci.sh runs it"]
fn with_gxx_the_arduino_example_of_two_gauges_names_the_one_that_is_cut_off() {
    let scratch = Scratch::new();
    let record = array_bytes(&example_array()).unwrap();
    let calibration = scratch.path("gauges.postcard");
    fs::write(&calibration, record).unwrap();
    let library = scratch.path("library");
    let said = runs(export(&calibration, &library).arg("--arduino"));
    assert!(said.contains("2 gauges, float"), "{said}");
    let example = library.join("examples/Live/Live.ino");
    let main = format!(
        "{ARDUINO}\n#include \"{}\"\nint main() {{ setup(); for (int n = 0; n < 300; n++) {{ loop(); \
         cut_off = n < 200 ? -1 : A1; now_us += 5000; }} }}\n",
        example.display()
    );
    let compiler = ["g++", "-x", "c++", "-std=gnu++11"];
    let said = compiled(&compiler, &scratch.path("."), &main, &library.join("src"));
    let lines: Vec<&str> = said.lines().collect();
    assert_eq!(lines.len(), 150, "{said}");
    assert!(lines.iter().all(|line| line.contains(" deg +/- 2")), "{said}");
    let without = lines.iter().position(|line| line.ends_with(" without back_v"));
    // Three samples are bridged.
    assert_eq!(without, Some(104), "{said}");
    assert!(lines[104..].iter().all(|line| line.ends_with(" without back_v")), "{said}");
}

#[test]
#[ignore = "needs g++; ./ci.sh runs it"]
fn with_gxx_a_board_of_another_converter_is_refused_with_the_option_that_names_it() {
    let scratch = Scratch::new();
    let calibration = calibrated(&scratch, &["--model", "poly13"]);
    // A part of the C library for AVR.
    fs::create_dir(scratch.path("avr")).unwrap();
    scratch
        .write("avr/pgmspace.h", "#include <string.h>\n#define PROGMEM\n#define memcpy_P memcpy\n");
    for (adc, refused) in [("12,0,3.3", true), ("10,0,5", false)] {
        let library = scratch.path(adc);
        runs(export(&calibration, &library).args(["--arduino", "--adc", adc]));
        let example = library.join("examples/Live/Live.ino");
        let main = format!("#define __AVR__\n{ARDUINO}\n#include \"{}\"\n", example.display());
        let source = scratch.write("avr.cpp", main);
        let mut gxx = std::process::Command::new("g++");
        gxx.args(["-std=gnu++11", "-fsyntax-only", "-I"]).arg(library.join("src"));
        gxx.arg("-I").arg(scratch.path(".")).arg(source);
        let said = gxx.output().expect("g++");
        let error = String::from_utf8_lossy(&said.stderr);
        assert_eq!(said.status.success(), !refused, "{error}");
        assert_eq!(error.contains("--adc 10,0,5"), refused, "{error}");
    }
}

#[test]
fn named_defects_are_exported_in_float_alone() {
    let scratch = Scratch::new();
    let record =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("firmware/data/diagnosed-rest.postcard");
    let out = scratch.path("c");
    fails(export(&record, &out).args(["--form", "fixed"]), &["diagnosed", "--form float"]);
    let output = export(&record, &out).output().unwrap();
    let said = stdout(&output);
    assert!(
        said.contains("diagnosed+rest, float") && !said.contains("stretch_set_pressure"),
        "{said}"
    );
    let note = String::from_utf8_lossy(&output.stderr);
    assert!(note.contains("note: the form is float, because the diagnosed model has no"), "{note}");
    passes_its_self_test(&scratch, &out);
}

#[test]
fn what_has_no_form_in_c_says_so_and_writes_nothing() {
    for (arguments, form, parts) in [
        (["--model", "poly22"], "float", ["poly22", "linear, poly13"]),
        (["--model", "history"], "fixed", ["the history model cannot be exported to C", "--model"]),
        (["--rate", "tracker:0.1"], "fixed", ["Tracker", "savgol:11,2"]),
    ] {
        let scratch = Scratch::new();
        let calibration = calibrated(&scratch, &arguments);
        let before = scratch.names();
        let mut command = export(&calibration, &scratch.path("c"));
        fails(command.args(["--form", form]), &parts);
        assert_eq!(scratch.names(), before, "{arguments:?}");
    }
}

#[test]
fn integers_that_the_model_or_the_converter_does_not_allow() {
    let scratch = Scratch::new();
    // A rate at the middle of its window can only be exported in floating point.
    let calibration = calibrated(&scratch, &["--model", "poly13", "--rate", "savgol:11,2,5"]);
    let before = scratch.names();
    let out = scratch.path("c");
    fails(export(&calibration, &out).args(["--form", "fixed"]), &["--form float", "window"]);
    let calibration = calibrated(&scratch, &["--model", "poly13"]);
    fails(
        export(&calibration, &out).args(["--adc", "12,0,1"]),
        &["the converter measures from 0 to 1", "--adc"],
    );
    assert_eq!(scratch.names(), before);
    let float = ["--adc", "12,0,1", "--form", "float"];
    fails(export(&calibration, &out).args(float).arg("--arduino"), &["from 0 to 1", "10,0,1023"]);
    assert_eq!(scratch.names(), before);
    let note = warned(export(&calibration, &out).args(float));
    assert!(note.contains("STRETCH_ADC_PER_CODE"), "{note}");
}

/// A signal column of counts: the default converter and that of an Uno in volts measure another quantity.
#[test]
fn a_signal_in_counts_needs_a_converter_in_counts_in_every_form() {
    let scratch = Scratch::new();
    let trial = fs::read_to_string(scratch.loops("volts.csv", 40.0, 1.1)).unwrap();
    let counts = trial.lines().enumerate().map(|(n, line)| {
        let (rest, volts) = line.rsplit_once(',').unwrap();
        match volts.parse::<f64>() {
            Ok(volts) => format!("{rest},{:.0}\n", 200.0 * volts),
            Err(_) => format!("{rest},a0\n", rest = if n == 0 { rest } else { line }),
        }
    });
    let trial = scratch.write("counts.csv", counts.collect::<String>());
    let calibration = scratch.path("counts.json");
    runs(calibrate(&trial, &calibration).args(["--model", "poly13", "--signal", "a0"]));
    let out = scratch.path("Elbow");
    for form in ["fixed", "float"] {
        for adc in ["12,0,3.3", "10,0,5", "10,0,1000000"] {
            let mut command = export(&calibration, &out);
            command.args(["--arduino", "--form", form, "--adc", adc]);
            fails(&mut command, &["signal a0", "unit of the signal column", "10,0,1023"]);
        }
    }
    for form in ["fixed", "float"] {
        let mut command = export(&calibration, &out);
        command.args(["--form", form, "--adc", "8,0,255"]);
        fails(&mut command, &["signal a0", "measures from 0 to 255", "give --adc 10,0,1023"]);
    }
    for (adc, parts) in [
        ("10,0,1023", [].as_slice()),
        ("10,0,300", &["range of a0 is from 2", "measures from 0 to 300", "only a part"]),
        ("10,0,20000", &["measures from 0 to 20000", "codes", "--adc"]),
    ] {
        let mut command = export(&calibration, &scratch.path(adc));
        let note = warned(command.args(["--arduino", "--form", "float", "--adc", adc]));
        assert!(parts.iter().all(|part| note.contains(part)), "{note}");
        assert_eq!(note.contains("note:"), !parts.is_empty(), "{note}");
    }
}

#[test]
fn a_folder_that_exists_and_a_newer_record_are_refused() {
    let scratch = Scratch::new();
    let calibration = calibrated(&scratch, &["--model", "linear"]);
    let note = warned(&mut export(&calibration, &scratch.path("out.h")));
    assert!(note.contains("out.h is a folder") && note.contains("--c - > "), "{note}");
    let out = scratch.path("c");
    fs::create_dir(&out).unwrap();
    fs::write(out.join("stretch.h"), "mine").unwrap();
    fails(&mut export(&calibration, &out), &["this folder exists", "nothing is overwritten"]);
    assert_eq!(fs::read_to_string(out.join("stretch.h")).unwrap(), "mine");

    let newer =
        fs::read_to_string(&calibration).unwrap().replace("\"schema\": 2", "\"schema\": 99");
    let newer = scratch.write("newer.json", newer);
    let before = scratch.names();
    fails(&mut export(&newer, &scratch.path("d")), &["newer.json", "schema", "99"]);
    assert_eq!(scratch.names(), before);
}

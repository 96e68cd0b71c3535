//! Sensors without memory and recordings without time stamps: tables of weights and readings,
//! single readings, signals with an offset.

use crate::support::{Scratch, fails, one_line, runs, stretch};

const TABLE: &str =
    "load_g,raw\n0,84213\n100,94120\n200,104080\n500,133790\n1000,183400\n2000,282600\n";

/// Calibrates on a table, and returns the output on both streams.
fn calibrated(scratch: &Scratch, table: &str, model: &str) -> String {
    let table = scratch.write("table.csv", table);
    let mut command = stretch();
    command.arg("calibrate").arg(table).args(["--reference", "load_g", "--signal", "raw"]);
    command.args(["--model", model, "--out"]).arg(scratch.path("cal.json"));
    let output = command.output().unwrap();
    let said = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(output.status.success(), "{said:?}");
    one_line(&said.join(" "))
}

/// Applies the calibration to a stream, and returns the estimates and the messages on standard
/// error.
fn live(scratch: &Scratch, arguments: &[&str], stream: &str) -> (Vec<[String; 3]>, String) {
    let mut command = stretch();
    command.arg("apply").arg("--calibration").arg(scratch.path("cal.json")).args(arguments);
    let output = command.arg("-").write_stdin(stream).output().unwrap();
    let said = one_line(&String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{said}");
    let rows = String::from_utf8(output.stdout).unwrap();
    let cells = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        [cells[0], cells[1], cells[2]].map(str::to_owned)
    };
    (rows.lines().skip(1).map(cells).collect(), said)
}

fn grams(rows: &[[String; 3]]) -> Vec<f64> {
    rows.iter().map(|[_, estimate, _]| estimate.parse::<f64>().unwrap().round()).collect()
}

#[test]
fn a_table_without_a_time_gives_a_line_or_a_curve() {
    let scratch = Scratch::new();
    for model in ["linear", "curve", "auto"] {
        let said = calibrated(&scratch, TABLE, model);
        for word in ["muscle", "branch", "inflation", "deflation", "one direction"] {
            assert!(!said.contains(word), "{model}: {word} in {said}");
        }
        let (rows, _) = live(&scratch, &[], "raw\n84213\n94120\n282600\n");
        assert_eq!(grams(&rows), [0.0, 100.0, 2000.0], "{model}");
    }
    // For a nonlinear sensor, auto chooses a curve.
    let bent: String = (0..12).map(|k| format!("{},{}\n", 10 * k, 400 + 5 * k + k * k)).collect();
    let said = calibrated(&scratch, &format!("load_g,raw\n{bent}"), "auto");
    assert!(said.contains("curve has the smallest error"), "{said}");
    let (rows, _) = live(&scratch, &[], "400\n435\n576\n");
    let [start, middle, end] = grams(&rows)[..] else { panic!("three readings") };
    assert!(start.abs() <= 1.0 && (middle - 41.0).abs() < 2.0 && (end - 110.0).abs() <= 1.0);
    // A model with a rate needs a time, and the message names the models that do not.
    let table = scratch.write("table.csv", TABLE);
    let mut command = stretch();
    command.arg("calibrate").arg(table).args(["--reference", "load_g", "--signal", "raw"]);
    fails(
        command.arg("--out").arg(scratch.path("other.json")),
        &["--time", "--model curve or --model linear"],
    );
}

#[test]
fn bare_readings_are_answered_from_the_first_one_on() {
    let scratch = Scratch::new();
    calibrated(&scratch, TABLE, "linear");
    let tenths = ["--time", "10hz"];
    for (arguments, header, step) in [
        (&tenths[..], "raw\n", 0.1),
        (&tenths, "", 0.1),
        (&["--time", "10hz", "--columns", "raw"], "", 0.1),
        (&[], "raw\n", 1.0),
        (&[], "", 1.0),
    ] {
        let (rows, said) = live(&scratch, arguments, &format!("{header}84213\n94120\n104080\n"));
        assert_eq!(grams(&rows), [0.0, 100.0, 200.0], "{arguments:?} {header:?}");
        let times: Vec<f64> = rows.iter().map(|[time, ..]| time.parse().unwrap()).collect();
        assert_eq!(times, [0.0, step, 2.0 * step], "{arguments:?}");
        assert!(rows.iter().all(|[.., rate]| rate.is_empty()), "{rows:?}");
        assert!(said.contains("there is no time"), "{said}");
        // A file gives the same result, however short.
        let file = scratch.write("bare.csv", format!("{header}84213\n94120\n104080\n"));
        let mut command = stretch();
        command.arg("apply").arg("--calibration").arg(scratch.path("cal.json")).args(arguments);
        let text = runs(command.arg(file));
        assert!(text.contains(",rising,") && !text.contains("inflation"), "{text}");
        let estimates: Vec<f64> =
            text.lines().skip(1).map(|l| l.split(',').nth(1).unwrap().parse().unwrap()).collect();
        assert_eq!(estimates.iter().map(|e| e.round()).collect::<Vec<_>>(), [0.0, 100.0, 200.0]);
    }
    // A row that is not a number still counts as a sample, and the stream continues.
    let (rows, said) = live(&scratch, &tenths, "84213\noops\n104080\n");
    assert_eq!(rows.iter().map(|[time, ..]| time.as_str()).collect::<Vec<_>>(), ["0", "0.2"]);
    assert!(said.contains("oops"), "{said}");
    // With a time column, the times are taken from it.
    let (rows, _) = live(&scratch, &[], "time_s,raw\n5,84213\n5.25,94120\n");
    assert_eq!(grams(&rows), [0.0, 100.0]);
    assert_eq!(rows[1][0], "5.25");
}

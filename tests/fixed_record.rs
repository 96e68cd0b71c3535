//! `stretch export --fixed`: the calibration file for a board, run on converter codes.

use std::path::{Path, PathBuf};

use crate::support::{Scratch, calibrate, fails, runs, stretch};
use stretch_calibrate::{parse_adc, read_calibration};
use stretch_core::{Calibration, Design, Runner, Stage, Volts, record::load};
use stretch_filter::RateFilter;
use stretch_receptor::{
    ObserverReceptor, Reading, StretchReceptor, Withheld,
    code::{Adc, AdcCode, CodeReading, FixedCalibration, FixedObserver, FixedReceptor},
};

const ADC: &str = "12,0,3.3";

fn adc() -> Adc {
    parse_adc(ADC).unwrap()
}

/// Calibrates on a trial, exports, and reads both calibration files.
fn records(scratch: &Scratch, trial: &Path, model: &str, read_as: &str) -> (Calibration, Vec<u8>) {
    let (float, fixed) = (scratch.path("cal.json"), scratch.path("cal.fixed.postcard"));
    runs(calibrate(trial, &float).args(["--model", model]));
    let text = runs(export(&float, &fixed).args(["--adc", ADC]));
    assert!(text.contains(&format!("a board reads it as {read_as}")), "{text}");
    (read_calibration(&float).unwrap(), std::fs::read(fixed).unwrap())
}

fn export(calibration: &Path, fixed: &Path) -> assert_cmd::Command {
    let mut command = stretch();
    command.arg("export").arg("--calibration").arg(calibration).arg("--fixed").arg(fixed);
    command
}

/// Converts the signal of a trial to converter codes.
fn codes(trial: &PathBuf) -> Vec<AdcCode> {
    let text = std::fs::read_to_string(trial).unwrap();
    let volts = text.lines().skip(1).map(|line| line.rsplit(',').next().unwrap());
    volts.map(|volts| adc().code(volts.parse().unwrap())).collect()
}

/// Returns the differences between the estimates in integers and in `f64`, in millimetres.
fn apart<D, F>(fixed: D, float: F, codes: &[AdcCode]) -> Vec<f64>
where
    D: Design + Stage<AdcCode, Out = Result<CodeReading<i32>, Withheld>>,
    F: Design + Stage<Volts<f64>, Out = Result<Reading<f64>, Withheld>>,
{
    let (mut fixed, mut float) = (Runner::new(fixed), Runner::new(float));
    let answers = codes.iter().map(|&code| {
        let volts = adc().volts(code).expect("a code of the converter");
        (fixed.step(code), float.step(Volts(volts)))
    });
    let both = answers.filter_map(|(fixed, float)| {
        assert_eq!(fixed.is_ok(), float.is_ok(), "both or neither");
        Some((1e-3 * f64::from(fixed.ok()?.estimate) - float.ok()?.estimate).abs())
    });
    both.collect()
}

fn largest(errors: &[f64]) -> f64 {
    errors.iter().copied().fold(0.0, f64::max)
}

#[test]
fn an_observer_runs_from_its_record_as_it_does_in_floats() {
    let scratch = Scratch::new();
    let (fit, test) = (scratch.loops("a.csv", 40.0, 1.1), scratch.loops("b.csv", 40.0, 1.5));
    for model in ["observer", "observer+rest"] {
        let (calibration, bytes) = records(&scratch, &fit, model, "FixedObserver");
        let fixed: FixedObserver = load(&bytes).unwrap();
        let float = ObserverReceptor::<f64>::new(&calibration).unwrap();
        let errors = apart(fixed, float, &codes(&test));
        assert_eq!(errors.len(), 4000, "an observer needs no warm-up");
        let per_target = calibration.spec().target.reference_per_target().abs();
        let span_mm = calibration.spec().target_range.span() * per_target;
        // One thousandth of a millimetre for the final rounding.
        let bound = testkit::tolerance::FIXED_OBSERVER * span_mm + 1e-3;
        let largest = largest(&errors);
        assert!(largest <= bound, "{model}: {largest} mm, bound {bound} mm");
    }
}

#[test]
fn a_line_and_surfaces_run_from_their_records_within_their_bound() {
    let scratch = Scratch::new();
    let (fit, test) = (scratch.loops("a.csv", 40.0, 1.1), scratch.loops("b.csv", 40.0, 1.5));
    for model in ["linear", "poly13"] {
        let (calibration, bytes) = records(&scratch, &fit, model, "FixedCalibration<11, 2>");
        let fixed: FixedCalibration<11, 2> = load(&bytes).unwrap();
        let rate = RateFilter::<f64>::new(
            calibration.spec().rate_estimator,
            calibration.spec().sample_rate_hz,
        );
        let float = StretchReceptor::with_rate(&calibration, rate.unwrap()).unwrap();
        let errors = apart(FixedReceptor::new(fixed), float, &codes(&test));
        // A line needs no rate, so it has an estimate from the first sample.
        let warm_up = if model == "linear" { 0 } else { 10 };
        assert_eq!(errors.len(), 4000 - warm_up, "{model}");
        let largest = largest(&errors);
        let bound = 1e-3 * fixed.worst_case_error_um();
        assert!(largest <= bound, "{model}: {largest} mm, bound {bound} mm");
    }
}

/// The program computes from the calibration file, and its record of integers is for the board.
#[test]
fn a_record_for_a_board_is_refused_with_the_file_that_the_program_reads() {
    let scratch = Scratch::new();
    let trial = scratch.loops("a.csv", 20.0, 1.1);
    for (model, read_as) in [("observer", "FixedObserver"), ("poly13", "FixedCalibration<11, 2>")] {
        records(&scratch, &trial, model, read_as);
        let before = scratch.names();
        let says = ["cal.fixed.postcard: it is a record of integers", "12 bits", "cal.json"];
        for (command, then) in
            [("apply", [].as_slice()), ("evaluate", &[]), ("export", &["--c", "c"])]
        {
            let mut stretch = stretch();
            let command = stretch.current_dir(scratch.path(".")).arg(command);
            if then.is_empty() {
                command.arg(&trial);
            }
            fails(command.args(["--calibration", "cal.fixed.postcard"]).args(then), &says);
            assert_eq!(scratch.names(), before);
        }
    }
}

#[test]
fn what_has_no_form_in_integers_says_so_and_writes_nothing() {
    let scratch = Scratch::new();
    let trial = scratch.loops("a.csv", 20.0, 1.1);
    let float = scratch.path("cal.json");
    let plain: &[&str] = &[];
    for (fitted, exported, parts) in [
        (["--model", "poly22"].as_slice(), plain, ["poly22", "linear, poly13"]),
        (&["--model", "history"], plain, ["the history model", "observer"]),
        (&["--rate", "tracker:0.1"], plain, ["Tracker", "savgol:WINDOW,DEGREE"]),
        (plain, &["--adc", "12,0,1"], ["between 1.2", "measures from 0 to 1"]),
        (plain, &["--adc", "12,0,1000000"], ["has only 0.0 codes", "not the board's converter"]),
    ] {
        runs(calibrate(&trial, &float).args(fitted));
        let before = scratch.names();
        fails(export(&float, &scratch.path("cal.fixed.postcard")).args(exported), &parts);
        assert_eq!(scratch.names(), before, "{fitted:?} {exported:?}");
    }
    let mut command = export(&float, &scratch.path("cal.fixed.postcard"));
    let output = command.args(["--adc", "12,3.3,0"]).output().expect("the program runs");
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("BITS,ZERO,"));
}

//! Two recordings are compared: known differences are found, and wrong input is refused.

use std::fmt::Write;

use serde_json::Value;
use stretch_gap::RandomGenerator;

use crate::support::{Scratch, fails, prints, runs, stretch};

/// Noise of every recording, one standard deviation, in the unit of the motion.
const NOISE: f64 = 0.05;

fn knee(t: f64) -> f64 {
    40.0 + 20.0 * (1.3 * t).sin() + 10.0 * (3.17 * t + 1.0).sin() + 5.0 * (7.39 * t).sin()
}

/// Writes a minute of a recording, with a column of a name, at a rate and from a time on.
fn log(
    scratch: &Scratch,
    name: &str,
    (column, hz, from_s): (&str, f64, f64),
    of: &dyn Fn(f64) -> f64,
) {
    let mut random = RandomGenerator::new(1, name.bytes().map(u64::from).sum());
    let mut text = format!("time_s,{column}\n");
    for i in 0..(60.0 * hz) as u32 {
        let t = f64::from(i) / hz;
        let value = of(t) + NOISE * random.gauss();
        writeln!(text, "{:.6},{value:.6}", from_s + t).expect("a text");
    }
    scratch.write(name, text);
}

const USUAL: (&str, f64, f64) = ("knee_deg", 100.0, 0.0);

/// Compares the motion of the knee with a changed one.
fn compared(how: (&str, f64, f64), of: &dyn Fn(f64) -> f64) -> Value {
    let scratch = Scratch::new();
    log(&scratch, "a.csv", USUAL, &knee);
    log(&scratch, "b.csv", how, of);
    let text = prints(
        stretch().arg("compare").arg("--json").args(["a.csv", "b.csv"].map(|f| scratch.path(f))),
    );
    serde_json::from_str(&text).expect("JSON")
}

/// Asserts that the interval of a quantity contains the truth and is not wider than `width`.
#[track_caller]
fn holds(answer: &Value, quantity: &str, truth: f64, width: f64) {
    let one = &answer["compared"][0][quantity];
    let [low, high] = [0, 1].map(|i| one["interval"][i].as_f64().expect("a number"));
    assert!(low <= truth && truth <= high && high - low < width, "{quantity} {truth}: {one}");
}

#[track_caller]
fn says(answer: &Value, part: &str) {
    let sentence = answer["compared"][0]["sentence"].as_str().expect("a sentence");
    assert!(sentence.contains(part), "no {part:?} in: {sentence}");
}

#[test]
fn recordings_that_differ_by_noise_agree() {
    let answer = compared(USUAL, &knee);
    assert_eq!(answer["verdict"], "no_gap", "{}", answer["sentence"]);
    says(&answer, "have the same gain, offset and clock");
    holds(&answer, "gain", 1.0, 0.01);
    holds(&answer, "delay_s", 0.0, 0.003);
}

#[test]
fn a_delay_and_a_gain_with_an_offset_are_found_within_their_intervals() {
    let answer = compared(USUAL, &|t| 1.7 * knee(t - 0.035) + 3.0);
    assert_eq!(answer["verdict"], "parameters", "{}", answer["sentence"]);
    holds(&answer, "delay_s", 0.035, 0.002);
    holds(&answer, "gain", 1.7, 0.01);
    holds(&answer, "offset", 3.0, 0.5);
    says(&answer, " late");
    let early = compared(USUAL, &|t| knee(t + 0.012));
    holds(&early, "delay_s", -0.012, 0.002);
    says(&early, " early");
}

#[test]
fn a_sign_is_told_in_the_sentence() {
    let answer = compared(USUAL, &|t| 90.0 - knee(t));
    holds(&answer, "gain", -1.0, 0.01);
    holds(&answer, "offset", 90.0, 0.5);
    says(&answer, "is upside down");
}

#[test]
fn a_factor_of_units_is_named_as_units() {
    let answer = compared(("knee_rad", 100.0, 0.0), &|t| knee(t).to_radians());
    assert_eq!(answer["compared"][0]["units"], serde_json::json!(["deg", "rad"]));
    says(&answer, "is in rad instead of deg");
}

#[test]
fn a_clock_that_drifts_is_found_with_its_rate() {
    let answer = compared(USUAL, &|t| knee(t - 0.02 - 2e-4 * (t - 30.0)));
    holds(&answer, "clock_rate", 2e-4, 1e-4);
    holds(&answer, "delay_s", 0.02, 0.002);
    says(&answer, "later with every second");
}

#[test]
fn other_rates_and_clocks_are_aligned() {
    let slower = compared(("knee_deg", 40.0, 0.0), &|t| knee(t - 0.035));
    holds(&slower, "delay_s", 0.035, 0.004);
    // the second recording begins 7.3 s later on a clock of its own
    let later = compared(("knee_deg", 100.0, 5000.0), &|t| knee(t + 7.3));
    holds(&later, "delay_s", -7.3, 0.003);
    assert!(later["notes"].to_string().contains("the clocks share no time"), "{}", later["notes"]);
}

/// A shift by a whole period of the motion explains a delay as well as the delay itself.
#[test]
fn periodic_motions_keep_their_clock() {
    let turn = |t: f64| 20.0 * (t / 0.7).sin() + 10.0 * (t / 0.35 + 1.0).sin();
    for hz in [100.0, 40.0] {
        let scratch = Scratch::new();
        log(&scratch, "a.csv", USUAL, &turn);
        log(&scratch, "b.csv", ("knee_deg", hz, 0.0), &|t| turn(t - 0.0065));
        let files = ["a.csv", "b.csv"].map(|f| scratch.path(f));
        let text = prints(stretch().arg("compare").arg("--json").args(files));
        let answer: Value = serde_json::from_str(&text).expect("JSON");
        holds(&answer, "delay_s", 0.0065, 0.003);
    }
}

#[test]
fn the_same_file_twice_is_equal_and_a_low_pass_is_named() {
    let scratch = Scratch::new();
    log(&scratch, "a.csv", USUAL, &knee);
    let file = scratch.path("a.csv");
    let said = runs(stretch().arg("compare").args([&file, &file]));
    assert!(
        said.starts_with("knee_deg of a.csv equals knee_deg of a.csv in every sample."),
        "{said}"
    );
    // saturation at 60
    log(&scratch, "b.csv", USUAL, &|t| knee(t).min(60.0));
    let page = scratch.path("d.html");
    let said = runs(
        stretch().arg("compare").arg(&file).arg(scratch.path("b.csv")).arg("--report").arg(&page),
    );
    assert!(said.contains("output.saturation"), "{said}");
    let html = std::fs::read_to_string(page).expect("a page");
    assert!(html.starts_with("<!DOCTYPE html>") && html.contains("<svg"));
}

#[test]
fn what_cannot_be_compared_is_refused_with_advice() {
    let scratch = Scratch::new();
    log(&scratch, "a.csv", USUAL, &knee);
    let walk = |t: f64| 40.0 + 20.0 * (0.83 * t * t.sqrt()).sin() + 9.0 * (11.0 * t).cos();
    log(&scratch, "unrelated.csv", USUAL, &walk);
    log(&scratch, "force.csv", ("force_n", 100.0, 0.0), &knee);
    scratch.write("two.csv", "time_s,x_v,y_v\n0,1,2\n0.01,2,3\n0.02,1,4\n");
    let constant = (0..6000).fold("time_s,knee_deg\n".to_owned(), |text, i| {
        text + &format!("{:.2},3\n", 0.01 * f64::from(i))
    });
    scratch.write("constant.csv", constant);
    let short = (0..90).fold("time_s,knee_deg\n".to_owned(), |text, i| {
        text + &format!("{:.2},{:.3}\n", 0.01 * f64::from(i), knee(0.01 * f64::from(i)))
    });
    scratch.write("short.csv", short);
    let compare = |other: &str, more: &[&str]| {
        let mut command = stretch();
        command.arg("compare").arg(scratch.path("a.csv")).arg(scratch.path(other)).args(more);
        command
    };
    fails(
        &mut compare("unrelated.csv", &[]),
        &["do not show the same motion", "compare recordings of one motion"],
    );
    fails(&mut compare("two.csv", &[]), &["knee_deg", "x_v and y_v", "--signal knee_deg=x_v"]);
    fails(&mut compare("constant.csv", &[]), &["knee_deg of constant.csv is constant"]);
    fails(&mut compare("short.csv", &[]), &["in common", "20 s or more"]);
    fails(&mut compare("force.csv", &["--signal", "knee_deg"]), &["force.csv", "knee_deg"]);
    // the only columns of two files are compared
    runs(&mut compare("force.csv", &["--quiet"]));
}

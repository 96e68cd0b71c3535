//! An angle that wraps is calibrated and evaluated like an unwrapped one.

use stretch_calibrate::{Calibrated, Options, calibrate, evaluate};
use stretch_data::{Channel, Trial};

/// An angle about 170 deg, from 110 to 230 deg, with a sensor that follows it.
fn trial(scale: f64, turn: f64, names: [&str; 2]) -> Trial {
    let time_s: Vec<f64> = (0..3000).map(|n| 0.01 * f64::from(n)).collect();
    let angle: Vec<f64> = time_s.iter().map(|t| 170.0 + 60.0 * (0.7 * t).sin()).collect();
    let other = angle.iter().zip(&time_s).map(|(a, t)| 1.0 + 0.01 * a + 1e-3 * (91.0 * t).sin());
    let other = other.collect();
    let low = -0.5 * turn;
    let shown = angle.iter().map(|a| (scale * a - low).rem_euclid(turn) + low).collect();
    let channel = |name: &str, values| Channel { name: name.into(), values };
    let channels = vec![channel(names[0], shown), channel(names[1], other)];
    Trial { name: "a.csv".into(), time_s, channels }
}

fn fitted(trial: &Trial, [reference, signal]: [&str; 2]) -> (Calibrated, f64) {
    let options =
        Options { reference: reference.into(), signal: signal.into(), ..Options::default() };
    let made = calibrate(std::slice::from_ref(trial), &options).expect("a calibration");
    let judged = evaluate(&[("own", &made.calibration)], std::slice::from_ref(trial));
    let rmse = judged.expect("errors").pooled[1].rmse;
    (made, rmse)
}

#[test]
fn a_reference_that_wraps_is_calibrated_and_judged_unwrapped() {
    let radian = std::f64::consts::PI / 180.0;
    for (scale, column, says) in [(1.0, "angle_deg", "360 deg"), (radian, "shaft_rad", "2 pi rad")]
    {
        let names = [column, "bridge_v"];
        let (plain, usual) = fitted(&trial(scale, 1e6, names), names);
        let (made, rmse) = fitted(&trial(scale, 360.0 * scale, names), names);
        assert!(usual < 0.2 * scale && (rmse / usual - 1.0).abs() < 1e-6, "{usual}, {rmse}");
        let note = format!("a.csv: {column} jumps by {says} ");
        assert!(made.notes.iter().any(|n| n.starts_with(&note)), "{:?}", made.notes);
        assert!(plain.notes.is_empty(), "{:?}", plain.notes);
    }
}

#[test]
fn trials_on_both_sides_of_the_seam_are_calibrated_as_one_motion() {
    let names = ["angle_deg", "bridge_v"];
    let (whole, plain) = (trial(1.0, 360.0, names), trial(1.0, 1e6, names));
    // Neither b.csv nor c.csv wraps by itself. c.csv lies wholly beyond the seam, between -170 and -130 deg.
    let part = |of: &Trial, name: &str, low: f64| {
        let is_in = |n: &usize| (low..low + 40.0).contains(&plain.channels[0].values[*n]);
        let kept: Vec<usize> = (0..of.time_s.len()).filter(is_in).take(100).collect();
        let take = |all: &[f64]| kept.iter().map(|n| all[*n]).collect::<Vec<f64>>();
        let channel = |c: &Channel| Channel { name: c.name.clone(), values: take(&c.values) };
        let time_s = (0..kept.len()).map(|n| 0.01 * n as f64).collect();
        Trial { name: name.into(), time_s, channels: of.channels.iter().map(channel).collect() }
    };
    let trials = |of: &Trial| [of.clone(), part(of, "b.csv", 112.0), part(of, "c.csv", 190.0)];
    let options =
        Options { reference: names[0].into(), signal: names[1].into(), ..Options::default() };
    let rmse = |trials: &[Trial]| {
        let made = calibrate(trials, &options).expect("a calibration");
        let judged = evaluate(&[("own", &made.calibration)], trials).expect("errors");
        (judged.pooled.iter().map(|m| m.rmse).collect::<Vec<_>>(), made.notes)
    };
    let (usual, _) = rmse(&trials(&plain));
    let (found, notes) = rmse(&trials(&whole));
    for (usual, found) in usual.iter().zip(&found) {
        approx::assert_relative_eq!(usual, found, max_relative = 1e-6);
    }
    let says = "angle_deg is an angle that begins in different turns: 1 of the trial parts";
    assert!(notes.iter().any(|note| note.starts_with(says)), "{notes:?}");
}

#[test]
fn a_signal_that_wraps_is_refused() {
    let names = ["shaft_deg", "length_mm"];
    let of = |turn| {
        let trial = trial(1.0, turn, names);
        let options =
            Options { signal: names[0].into(), reference: names[1].into(), ..Options::default() };
        calibrate(&[trial], &options)
    };
    assert!(of(1e6).is_ok());
    let refused = of(360.0).unwrap_err().to_string();
    assert!(refused.starts_with("a.csv: the signal shaft_deg jumps by 360 between"), "{refused}");
}

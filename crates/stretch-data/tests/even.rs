//! Trials and sessions on a uniform grid.

use stretch_data::{
    Channel, DataError, EvenSession, EvenSpec, SessionTrial, Split, Trial, rate_of,
};

const SPEC: EvenSpec =
    EvenSpec { rate_hz: 100.0, shortest: 10, bridged_s: 0.0, over_switches: true };

/// A trial with a length that is linear in time, and a command that is 1 from 0.5 s on.
fn trial(time_s: Vec<f64>) -> Trial {
    let length = time_s.iter().map(|t| 180.0 - 20.0 * t).collect();
    let inlet = time_s.iter().map(|t| f64::from(u8::from(*t > 0.4999))).collect();
    let channel = |name: &str, values| Channel { name: name.into(), values };
    let channels = vec![channel("length_mm", length), channel("inlet", inlet)];
    Trial { name: "a.csv".into(), time_s, channels }
}

fn stamps(count: usize) -> Vec<f64> {
    (0..count).map(|i| 0.01 * i as f64).collect()
}

/// Rounding error of linear interpolation between numbers of this size.
const ROUNDING: f64 = 1e-9;

#[test]
fn an_even_trial_is_taken_to_the_bit_and_nothing_is_said() {
    let trial = trial(stamps(200));
    let even = trial.even(&["length_mm", "inlet"], SPEC).expect("even");
    assert_eq!(even.parts[0].columns[0], trial.channels[0].values);
    assert_eq!(even.parts[0].columns[1], trial.channels[1].values);
    assert!(even.notes.is_empty() && even.gaps.is_empty() && even.rows.note().is_none());
}

#[test]
fn every_gap_of_up_to_three_samples_is_bridged_and_a_longer_one_cuts() {
    for lost in 1..=5 {
        let kept =
            stamps(200).into_iter().enumerate().filter(|(i, _)| !(80..80 + lost).contains(i));
        let even = trial(kept.map(|(_, t)| t).collect()).even(&["length_mm", "inlet"], SPEC);
        let even = even.expect("even");
        if lost > 3 {
            assert_eq!((even.parts.len(), even.rows.bridged), (2, 0));
            assert!((even.parts[1].begin_s - 0.01 * (80 + lost) as f64).abs() < ROUNDING);
            assert!(even.gaps[0].contains("missing after 0.79 s"), "{:?}", even.gaps);
            continue;
        }
        assert_eq!((even.parts.len(), even.rows.bridged), (1, lost));
        let whole = trial(stamps(200));
        for (x, y) in even.parts[0].columns[0].iter().zip(&whole.channels[0].values) {
            assert!((x - y).abs() < ROUNDING);
        }
        assert_eq!(even.parts[0].columns[1], whole.channels[1].values);
    }
}

#[test]
fn a_gap_in_which_a_valve_switched_cuts_a_session() {
    for (lost, parts) in [(48..49, 1), (49..52, 2), (50..51, 2), (52..54, 1)] {
        let kept = stamps(200).into_iter().enumerate().filter(|(i, _)| !lost.contains(i));
        let trial = SessionTrial::new(trial(kept.map(|(_, t)| t).collect()));
        let session = EvenSession::new(&[trial], &["length_mm", "inlet"], 10).expect("a session");
        assert_eq!(session.trials().len(), parts, "{lost:?}");
    }
}

#[test]
fn uneven_stamps_are_resampled_and_told() {
    let late = |i: usize| if i % 10 == 5 { 0.004 } else { 0.0 };
    let even = trial((0..200).map(|i| 0.01 * i as f64 + late(i)).collect());
    let even = even.even(&["length_mm", "inlet"], SPEC).expect("even");
    let part = &even.parts[0];
    assert_eq!(part.len(), 200);
    for (i, x) in part.columns[0].iter().enumerate() {
        assert!((x - (180.0 - 0.2 * i as f64)).abs() < ROUNDING, "{i}: {x}");
    }
    // A command keeps one of the values that were given.
    assert!(part.columns[1].iter().all(|u| *u == 0.0 || *u == 1.0));
    assert!(even.notes.iter().any(|n| n.contains("unevenly")), "{:?}", even.notes);
}

#[test]
fn another_clock_is_followed_and_another_rate_is_refused() {
    // Clocks that differ by 0.01 % and by 2 %: the first trial is used unchanged, the second is
    // resampled.
    for (rate_hz, is_resampled) in [(100.01, false), (102.0, true)] {
        let even = trial((0..1000).map(|i| i as f64 / rate_hz).collect());
        let even = even.even(&["length_mm"], SPEC).expect("even");
        assert_eq!(even.notes.iter().any(|n| n.contains("unevenly")), is_resampled, "{rate_hz}");
    }
    let slow = trial((0..200).map(|i| 0.02 * i as f64).collect());
    assert!(matches!(slow.even(&["length_mm"], SPEC), Err(DataError::OtherRate { .. })));
    let zero = EvenSpec { rate_hz: 0.0, ..SPEC };
    assert!(slow.even(&["length_mm"], zero).is_err());
}

#[test]
fn parts_that_are_too_short_are_left_out_and_counted() {
    let kept = stamps(200)
        .into_iter()
        .filter(|t| !(0.495..0.995).contains(t) && !(1.045..1.195).contains(t));
    let even = trial(kept.collect()).even(&["length_mm"], SPEC).expect("even");
    assert_eq!((even.parts.len(), even.rows.dropped), (2, 5));
    assert!(even.rows.note().expect("a note").starts_with("5 of "));
}

#[test]
fn a_session_keeps_order_split_and_pauses() {
    let at = |start_s: f64, split| {
        let mut trial = trial(stamps(200));
        // A test trial must have other samples than the fitted one.
        trial.channels[0].values[0] += if split == Split::Test { 1.0 } else { 0.0 };
        SessionTrial { start_s, split, ..SessionTrial::new(trial) }
    };
    let starts = |s: &EvenSession| s.trials().iter().map(|t| t.start_s()).collect::<Vec<_>>();
    let late_first = [at(50.0, Split::Test), at(10.0, Split::Fit)];
    let session = EvenSession::new(&late_first, &["length_mm"], 10).expect("a session");
    assert_eq!(starts(&session), [10.0, 50.0]);
    assert!(session.trials()[1].is_test());
    assert!(session.notes()[0].contains("in the order of their start_s"));
    let unknown = [at(0.0, Split::Fit), at(0.0, Split::Test)];
    let session = EvenSession::new(&unknown, &["length_mm"], 10).expect("a session");
    assert!((starts(&session)[1] - 17.0).abs() < ROUNDING, "{:?}", starts(&session));
    assert!(session.notes()[0].contains("pauses of 15 s"));
    assert!(matches!(EvenSession::new(&[], &["length_mm"], 10), Err(DataError::NoSamples)));
}

#[test]
fn a_test_trial_with_the_samples_of_one_that_is_fitted_is_refused() {
    let named = |name: &str, split| {
        let trial = Trial { name: name.into(), ..trial(stamps(200)) };
        SessionTrial { split, ..SessionTrial::new(trial) }
    };
    let of = |trials: &[SessionTrial]| EvenSession::new(trials, &["length_mm"], 10);
    let (fit, copy) = (named("a", Split::Fit), named("b", Split::Test));
    let told = of(&[copy.clone(), fit.clone()]).expect_err("a copy").to_string();
    assert!(told.starts_with("b is a test trial, and it has the same samples as a"), "{told}");
    // A change of one sample makes it a different trial.
    let mut other = copy;
    other.trial.channels[0].values[7] += 1e-9;
    assert!(of(&[fit.clone(), other]).is_ok());
    assert!(of(&[fit.clone(), fit]).is_ok());
}

#[test]
fn stamps_that_jitter_have_the_rate_of_long_stretches_and_lost_samples_do_not_count() {
    // The mean of the steps below 1.5 medians would give a rate of 141 Hz.
    let early_or_late = |i: u32| [0.0, 0.004, -0.004][(11 * i * i / 5 % 3) as usize];
    let jittered = |i: u32| 0.01 * f64::from(i) + early_or_late(i);
    let rate_hz = rate_of(&(0..3000).map(jittered).collect::<Vec<_>>()).expect("a rate");
    assert!((rate_hz - 100.0).abs() < 0.5, "{rate_hz}");
    let lost = stamps(3000).into_iter().enumerate().filter(|(i, _)| i % 5 != 0).map(|(_, t)| t);
    let rate_hz = rate_of(&lost.collect::<Vec<_>>()).expect("a rate");
    assert!((rate_hz - 100.0).abs() < 1e-6, "{rate_hz}");
}

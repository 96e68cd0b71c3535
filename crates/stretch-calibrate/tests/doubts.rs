//! Each mistake in a trial is reported once, and no other trial is reported.

use stretch_calibrate::{
    LiveReceptor, ModelKind, Options, Seen, calibrate, evaluate, evaluation_doubts, without_clipped,
};
use stretch_data::{Channel, Trial};

/// A muscle's length, in mm, and a gauge with a play, a curve and noise, in V.
fn trial(number: u32) -> Trial {
    let phase = f64::from(number);
    let time_s: Vec<f64> = (0..2000).map(|n| 0.01 * f64::from(n)).collect();
    let swing = |t: f64| 0.7 * (0.9 * t + phase).sin() + 0.3 * (2.3 * t + 2.0 * phase).sin();
    let length_mm: Vec<f64> = time_s.iter().map(|t| 165.0 + 15.0 * swing(*t)).collect();
    let mut held = length_mm[0];
    let gauge = |(n, x): (usize, &f64)| {
        held = held.clamp(x - 0.8, x + 0.8);
        let noise = ((n as f64 + phase) * 78.233).sin() * 43_758.545;
        let up = 180.0 - held;
        1.24 + 0.03 * up + 3e-4 * up * up + 2e-3 * (noise - noise.floor())
    };
    let bridge_v = length_mm.iter().enumerate().map(gauge).collect();
    let channel = |name: &str, values| Channel { name: name.into(), values };
    Trial {
        name: format!("t{number}.csv"),
        time_s,
        channels: vec![channel("length_mm", length_mm), channel("bridge_v", bridge_v)],
    }
}

fn notes(trials: &[Trial]) -> Vec<String> {
    // A linear model gives no note about a preferred order.
    let options = Options { model: ModelKind::Linear, ..Options::default() };
    calibrate(trials, &options).expect("a calibration").doubts
}

const LENGTH: usize = 0;
const SIGNAL: usize = 1;

fn change(trial: &mut Trial, channel: usize, of: impl Fn(f64) -> f64) {
    trial.channels[channel].values.iter_mut().for_each(|x| *x = of(*x));
}

type Spoil = fn(&mut Trial);

#[test]
fn one_trial_that_is_not_like_the_others_is_told_once() {
    let members: [(&str, Spoil); 12] = [
        ("t1.csv has bridge_v and length_mm exchanged, compared with t0.csv", |t| {
            let (length, signal) = t.channels.split_at_mut(SIGNAL);
            std::mem::swap(&mut length[0].values, &mut signal[0].values);
        }),
        ("t1.csv has bridge_v or length_mm reversed, compared with t0.csv", |t| {
            change(t, SIGNAL, |v| 2.48 - v);
        }),
        ("t1.csv has bridge_v or length_mm reversed, compared with t0.csv", |t| {
            change(t, LENGTH, |x| 330.0 - x);
        }),
        ("bridge_v of t1.csv is about 1000 times that of t0.csv", |t| {
            change(t, SIGNAL, |v| 1e3 * v);
        }),
        ("bridge_v of t1.csv is about a thousandth of that of t0.csv", |t| {
            change(t, SIGNAL, |v| 1e-3 * v);
        }),
        ("length_mm of t1.csv is about 1/57.3 of that of t0.csv", |t| {
            change(t, LENGTH, |x| x.to_radians());
        }),
        ("length_mm of t1.csv is about 57.3 times that of t0.csv", |t| {
            change(t, LENGTH, f64::to_degrees);
        }),
        ("length_mm of t1.csv is about a thousandth of that of t0.csv", |t| {
            change(t, LENGTH, |x| 1e-3 * x);
        }),
        ("bridge_v equals length_mm in t1.csv", |t| {
            t.channels[SIGNAL].values = t.channels[LENGTH].values.clone();
        }),
        ("bridge_v is 1.5 throughout t1.csv while length_mm moves", |t| {
            change(t, SIGNAL, |_| 1.5);
        }),
        ("bridge_v stays at 2 in t1.csv while length_mm moves on", |t| {
            change(t, SIGNAL, |v| v.min(2.0));
        }),
        ("bridge_v stays at 1.5 in t1.csv while length_mm moves on", |t| {
            change(t, SIGNAL, |v| v.max(1.5));
        }),
    ];
    for (says, spoil) in members {
        for count in [2, 4] {
            let mut trials: Vec<Trial> = (0..count).map(trial).collect();
            assert!(notes(&trials).is_empty(), "{:?}", notes(&trials));
            spoil(&mut trials[1]);
            let notes = notes(&trials);
            assert!(notes.len() == 1 && notes[0].starts_with(says), "{says}: {notes:?}");
        }
    }
}

#[test]
fn a_trial_saved_again_with_other_digits_is_told() {
    for digits in [3, 4, 9] {
        let mut trials: Vec<Trial> = (0..3).map(trial).collect();
        trials.push(Trial { name: "again.csv".into(), ..trials[1].clone() });
        let scale = 10_f64.powi(digits);
        change(&mut trials[3], SIGNAL, |v| (v * scale).round() / scale);
        let notes = notes(&trials);
        let says = "again.csv has the same samples as t1.csv: they count twice";
        assert!(notes.len() == 1 && notes[0].starts_with(says), "{digits}: {notes:?}");
    }
}

#[test]
fn times_of_milliseconds_are_asked_about() {
    let mut slow = trial(0);
    slow.time_s.iter_mut().for_each(|t| *t = 1e3 * *t + 0.25);
    let notes = notes(&[slow]);
    assert!(notes.len() == 1, "{notes:?}");
    assert!(notes[0].starts_with("the trials have 0.1 samples a second"), "{notes:?}");
}

#[test]
fn a_fit_to_a_few_samples_is_doubted() {
    let mut short = trial(0);
    let cut = |samples: usize, trial: &mut Trial| {
        trial.time_s.truncate(samples);
        trial.channels.iter_mut().for_each(|channel| channel.values.truncate(samples));
    };
    cut(50, &mut short);
    assert_eq!(notes(&[short.clone()]), Vec::<String>::new());
    cut(49, &mut short);
    let notes = notes(&[short]);
    assert!(
        notes.len() == 1 && notes[0].starts_with("the trials have 49 samples in total"),
        "{notes:?}"
    );
}

#[test]
fn trials_of_one_gauge_are_not_doubted() {
    // None of these is a mistake: another range of motion, a shift of the zero, coarse digits, a small movement after
    // drift, a rest.
    let members: [Spoil; 5] = [
        |t| {
            change(t, LENGTH, |x| x + 12.0);
            change(t, SIGNAL, |v| v - 0.36);
        },
        |t| change(t, SIGNAL, |v| v + 0.6),
        |t| change(t, SIGNAL, |v| (40.0 * v).round() / 40.0),
        |t| {
            let drift = t.time_s.iter().map(|s| 0.01 * s).collect::<Vec<f64>>();
            let at = t.channels[LENGTH].values.clone();
            t.channels[LENGTH].values =
                at.iter().zip(&drift).map(|(x, d)| 160.0 + 0.02 * x + 5.0 * d).collect();
            t.channels[SIGNAL].values = drift.iter().map(|d| 1.9 + d).collect();
        },
        |t| {
            change(t, LENGTH, |_| 170.0);
            change(t, SIGNAL, |_| 1.57);
        },
    ];
    for spoil in members {
        let mut trials: Vec<Trial> = (0..4).map(trial).collect();
        spoil(&mut trials[1]);
        assert_eq!(notes(&trials), Vec::<String>::new());
    }
    // Neither is a mistake: a robot that repeats its motion to within a thousandth, and a quantity that is at its lower
    // limit most of the time.
    let mut trials: Vec<Trial> = (0..3).map(trial).collect();
    trials.push(Trial { name: "repeated.csv".into(), ..trials[1].clone() });
    change(&mut trials[3], SIGNAL, |v| v + 1e-4 * (1e4 * v).sin());
    change(&mut trials[3], LENGTH, |x| x + 1e-3 * (1e4 * x).sin());
    assert_eq!(notes(&trials), Vec::<String>::new());
    let mut torque = trial(0);
    let turns = torque.time_s.iter().map(|t| f64::max((5.3 * t).sin(), 0.0)).collect();
    torque.channels[SIGNAL].values = turns;
    assert_eq!(notes(&[torque]), Vec::<String>::new());
}

/// The reported rate of a stream at 400 Hz is computed without rows that go back in time, because files leave such rows
/// out.
#[test]
fn rows_that_go_back_in_time_do_not_lower_the_rate_of_a_stream() {
    const LATE: f64 = 1.4;
    let calibration = stretch_receptor::example_calibration();
    let regular = |n: usize| n as f64;
    /// Name, number of periods at a row, rate in Hz.
    type Member<'a> = (&'a str, &'a dyn Fn(usize) -> f64, f64);
    let members: [Member<'_>; 6] = [
        ("every third is late", &|n| regular(n) + LATE * f64::from(n % 3 == 1), 266.7),
        ("every third is early", &|n| regular(n) - LATE * f64::from(n % 3 == 1), 266.7),
        ("pairs are exchanged", &|n| regular(n ^ 1), 200.0),
        ("one pair in three is exchanged", &|n| regular(n - n % 3 + [0, 2, 1][n % 3]), 266.7),
        ("a buffer held the first", &|n| regular(n) + 1e6 * f64::from(n == 0), 400.0),
        ("the clock begins anew", &|n| regular(n) + 1e6 * f64::from(n < 20), 400.0),
    ];
    for (name, periods, rate_hz) in members {
        let mut seen = Seen::of(&calibration);
        let mut live = LiveReceptor::new(&calibration).expect("a receptor");
        let doubt = (0..200).find_map(|n| {
            let time_s = periods(n) / 400.0;
            seen.take(time_s, 1.5, &live.step(stretch_core::Seconds(time_s), 1.5))
        });
        let text = doubt.expect(name).text;
        let found = text.split(' ').nth(3).expect(name);
        let found_hz: f64 = found.parse().expect(name);
        assert!((found_hz / rate_hz - 1.0).abs() < 0.05, "{name}: {text}");
    }
}

/// Each fault of a test trial has one doubt, which names it, and a sound trial has none.
#[test]
fn a_fault_of_a_test_trial_has_a_doubt_of_its_own() {
    let options = Options { model: ModelKind::Linear, ..Options::default() };
    let calibration =
        calibrate(&[trial(0), trial(1)], &options).expect("a calibration").calibration;
    // The play of the gauge adds about 60 ms to every delay.
    let members: [(&[&str], &str, Spoil); 6] = [
        (&[], "", |_| ()),
        (&["delayed"], "ms after the reference", |t| t.channels[SIGNAL].values.rotate_right(40)),
        (&["delayed"], "ms before the reference", |t| t.channels[SIGNAL].values.rotate_left(40)),
        (&["clipped_signal"], "stays at 1.9", |t| change(t, SIGNAL, |v| v.min(1.9))),
        (&["other_unit"], "With the sign reversed", |t| change(t, SIGNAL, |v| -v)),
        (&["other_sensor"], "the calibrated sensor", |t| change(t, SIGNAL, |v| 7.0 + v)),
    ];
    for (codes, says, spoil) in members {
        let mut tested = trial(2);
        spoil(&mut tested);
        let tested = [tested];
        let named = [("own", &calibration)];
        let evaluation = evaluate(&named, &tested).expect("errors");
        let doubts = evaluation_doubts(&named, &tested, &evaluation);
        assert_eq!(doubts.iter().map(|doubt| doubt.code).collect::<Vec<_>>(), codes, "{doubts:?}");
        assert!(doubts.iter().all(|doubt| doubt.text.contains(says)), "{doubts:?}");
    }
}

/// Samples at which the signal is clipped are left out, and the line of the others is that of the sensor.
#[test]
fn clipped_samples_are_left_out_at_either_end() {
    let sound = trial(0);
    let columns = ["bridge_v", "length_mm"];
    assert_eq!(without_clipped(vec![sound.clone()], columns), (vec![sound], Vec::new()));
    let clips: [(Vec<f64>, Spoil); 3] = [
        (vec![1.9], |t| change(t, SIGNAL, |v| v.min(1.9))),
        (vec![1.5], |t| change(t, SIGNAL, |v| v.max(1.5))),
        (vec![1.5, 1.9], |t| change(t, SIGNAL, |v| v.clamp(1.5, 1.9))),
    ];
    for (ends, spoil) in clips {
        let mut clipped = trial(0);
        spoil(&mut clipped);
        let values = clipped.require("bridge_v").expect("a signal");
        let at_ends = values.iter().filter(|v| ends.contains(v)).count();
        let (kept, sentences) = without_clipped(vec![clipped.clone()], columns);
        assert_eq!((kept[0].len(), sentences.len()), (clipped.len() - at_ends, ends.len()));
        let slope = |trial: &Trial| {
            let [v, x] = columns.map(|name| trial.require(name).expect("a column"));
            let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
            let [a, b] = [mean(v), mean(x)];
            let pairs = || v.iter().zip(x).map(|(v, x)| (v - a, x - b));
            pairs().map(|(v, x)| v * x).sum::<f64>() / pairs().map(|(v, _)| v * v).sum::<f64>()
        };
        let [own, before, after] = [&trial(0), &clipped, &kept[0]].map(slope);
        assert!(
            (after / own - 1.0).abs() < 0.6 * (before / own - 1.0).abs(),
            "{own} {before} {after}"
        );
    }
}

/// A trial with columns of unequal length stays as it is, because the fit refuses it.
#[test]
fn columns_of_unequal_length_are_not_searched_for_clipped_samples() {
    let mut torn = trial(0);
    change(&mut torn, SIGNAL, |v| v.min(1.9));
    torn.channels[0].values.truncate(100);
    let columns = ["bridge_v", "length_mm"];
    assert_eq!(without_clipped(vec![torn.clone()], columns), (vec![torn], Vec::new()));
}

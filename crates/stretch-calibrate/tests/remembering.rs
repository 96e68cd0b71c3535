//! Models with memory, from trials to readings.

use approx::assert_relative_eq;
use stretch_calibrate::{
    Calibrated, Memory, ModelKind, Options, apply, calibrate, choose_among, choose_model, evaluate,
    judge_model, read_calibration, write_calibration,
};
use stretch_core::Model;
use stretch_data::{Channel, Trial};
use stretch_receptor::Withheld;
use testkit::tolerance as tol;

/// A gauge that overshoots by 0.4 with a time constant of 0.25 s, on a muscle that moves by
/// `target`.
fn trial(name: &str, seconds: f64, target: impl Fn(f64) -> f64) -> Trial {
    let time_s: Vec<f64> = (0..(100.0 * seconds) as usize).map(|n| n as f64 * 0.01).collect();
    let share = -(-0.01f64 / 0.25).exp_m1();
    let mut slow = target(0.0);
    let mut noise = 1u32;
    let mut signal = |&t: &f64| {
        let y = target(t);
        slow += share * (y - slow);
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = 0.01 * (f64::from(noise) / f64::from(u32::MAX) - 0.5);
        let drive = y + 0.4 * (y - slow);
        1.24 + drive - 0.2 * drive * drive + noise
    };
    let bridge_v: Vec<f64> = time_s.iter().map(&mut signal).collect();
    let length_mm: Vec<f64> = time_s.iter().map(|&t| 180.0 - 30.0 * target(t)).collect();
    let channel = |name: &str, values| Channel { name: name.into(), values };
    Trial {
        name: name.into(),
        time_s,
        channels: vec![channel("length_mm", length_mm), channel("bridge_v", bridge_v)],
    }
}

/// Sums of sines that differ between trials.
fn irregular(phase: f64) -> impl Fn(f64) -> f64 {
    move |t| 0.5 + 0.25 * (2.1 * t + phase).sin() + 0.2 * (5.3 * t + 2.0 * phase).sin()
}

fn wandering() -> Vec<Trial> {
    [0.0, 1.0, 2.5].map(|p| trial(&format!("irregular_{p}.csv"), 30.0, irregular(p))).into()
}

fn options(kind: Memory, rest: bool) -> Options {
    Options { model: ModelKind::Remembering { kind, rest }, ..Options::default() }
}

#[test]
fn the_observer_finds_the_gauge() {
    let calibrated = calibrate(&wandering(), &options(Memory::Observer, false)).unwrap();
    let Model::Observer(map) = &calibrated.calibration.spec().model else {
        panic!("{calibrated:?}")
    };
    assert_eq!(map.relaxations_s.len(), 1);
    assert_relative_eq!(
        map.relaxations_s[0],
        0.25,
        epsilon = 0.0,
        max_relative = tol::OBSERVER_SEARCHED
    );
    let drive = calibrated.fits[0].coefficients.iter().find(|c| c.name.starts_with("relax"));
    let drive = drive.expect("a relaxation");
    assert_relative_eq!(drive.estimate, 0.4, epsilon = 0.0, max_relative = tol::OBSERVER_SEARCHED);
    assert!(drive.lower < drive.estimate && drive.estimate < drive.upper);
}

#[test]
fn memory_lowers_the_error_and_survives_its_record() {
    let test = [trial("test.csv", 30.0, irregular(4.0))];
    let plain = calibrate(&wandering(), &Options::default()).unwrap();
    let plain = evaluate(&[("x", &plain.calibration)], &test).unwrap().pooled[1].rmse;
    let folder = std::env::temp_dir().join(format!("remembering_{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    for kind in [Memory::History, Memory::Observer] {
        let Calibrated { calibration, fits, .. } =
            calibrate(&wandering(), &options(kind, true)).unwrap();
        // The condition number is at least 1 by definition. Beyond 1e8 half the digits would be
        // lost.
        assert!((1.0..1e8).contains(&fits[0].condition), "{kind}: {:e}", fits[0].condition);
        let own = evaluate(&[("x", &calibration)], &test).unwrap().pooled[1].rmse;
        assert!(own < 0.6 * plain, "{kind}: {own} mm, poly13 {plain} mm");
        for name in ["record.json", "record.postcard"] {
            let path = folder.join(name);
            write_calibration(&path, &calibration).unwrap();
            assert_eq!(
                read_calibration(&path).unwrap(),
                crate::as_held(&calibration, name),
                "{kind} {name}"
            );
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// The fit and the receptor use the same arithmetic.
#[test]
fn what_was_fitted_is_what_runs() {
    let trials = wandering();
    for rest in [false, true] {
        let calibrated = calibrate(&trials, &options(Memory::History, rest)).unwrap();
        let live = evaluate(&[("x", &calibrated.calibration)], &trials).unwrap().pooled[1].rmse;
        let range = calibrated.calibration.spec().target_range.span() * 180.0;
        let fitted = calibrated.fits[0].rmse * range;
        assert_relative_eq!(live, fitted, epsilon = 0.0, max_relative = tol::HISTORY_LIVE);
    }
}

/// The noise of the trials exceeds the ends of the fitted curve.
#[test]
fn the_samples_of_a_fit_are_inside_its_range() {
    let trials = wandering();
    for kind in [Memory::Observer, Memory::History] {
        let calibration = calibrate(&trials, &options(kind, false)).unwrap().calibration;
        let evaluation = evaluate(&[("x", &calibration)], &trials).unwrap();
        // The first samples of a trial, in which the memory settles, are not fitted.
        let most = if kind == Memory::Observer { 0 } else { trials.len() as u64 };
        assert!(evaluation.pooled[1].clamped <= most, "{kind}: {}", evaluation.pooled[1].clamped);
    }
}

#[test]
fn auto_takes_a_model_that_remembers_where_that_shows() {
    let choice = choose_model(&wandering(), &Options::default()).unwrap();
    assert!(matches!(choice.model, ModelKind::Remembering { .. }), "{choice:?}");
    assert!(choice.notes.is_empty());
    assert_eq!(choice.rows.len(), 6);
    let chosen = choice.rows.iter().find(|row| row.model == choice.model.to_string()).unwrap();
    let best = choice.rows[0].rmse.unwrap();
    // A tracked baseline adds three parameters.
    let simpler = chosen.parameters <= choice.rows[0].parameters + 3;
    assert!(chosen.rmse.unwrap() < 1.1 * best && simpler, "{chosen:?}");
}

/// A single larger movement lies outside the range of the other parts. Its clamped samples say nothing about a model.
#[test]
fn auto_does_not_judge_by_samples_that_only_the_part_left_out_reaches() {
    let larger =
        |t: f64| if (20.0..23.0).contains(&t) { 1.5 * (1.05 * (t - 20.0)).sin() } else { 0.0 };
    let target = |t: f64| 0.5 * irregular(1.0)(t) + larger(t);
    let (trials, options) = ([trial("knee.csv", 60.0, target)], Options::default());
    let judged = ["linear", "observer"].map(|model| {
        let kind: ModelKind = model.parse().unwrap();
        (kind, judge_model(&trials, &options, kind).map_err(|error| error.to_string()))
    });
    let choice = choose_among(&trials, &options, judged.into()).unwrap();
    let rmse_mm = |model: &str| choice.rows.iter().find(|row| row.model == model)?.rmse;
    assert!(rmse_mm("observer").unwrap() < 0.3, "{choice:?}");
    assert!(matches!(choice.model, ModelKind::Remembering { .. }), "{choice:?}");
    assert!(choice.notes.iter().any(|note| note.contains("% of the samples did not count")));
}

#[test]
fn auto_says_what_ramps_cannot() {
    let ramps: Vec<Trial> = [0.5, 1.0, 2.0, 4.0]
        .into_iter()
        .flat_map(|speed| {
            let up = move |t: f64| (speed * t / 4.0).min(1.0);
            [
                trial(&format!("up_{speed}.csv"), 8.0, up),
                trial(&format!("down_{speed}.csv"), 8.0, move |t| 1.0 - up(t)),
            ]
        })
        .collect();
    let choice = choose_model(&ramps, &Options::default()).unwrap();
    assert!(!matches!(choice.model, ModelKind::Remembering { .. }));
    assert!(choice.notes[0].contains("record one minute of arbitrary motion"), "{choice:?}");
}

/// After a gap of seconds, in which the muscle moved, models with memory start again: they say so, and their next
/// estimates are within 5 % of the range of 30 mm.
#[test]
fn models_with_memory_start_again_after_a_long_gap() {
    let fitted = [trial("fit", 60.0, irregular(0.0))];
    for memory in [Memory::Observer, Memory::History] {
        let options = Options {
            model: ModelKind::Remembering { kind: memory, rest: false },
            ..Options::default()
        };
        let calibration = calibrate(&fitted, &options).expect("a fit").calibration;
        let whole = trial("whole", 30.0, irregular(1.0));
        for (gap_s, settles) in [(0.3, false), (2.0, true), (3.3, true)] {
            let cut = |values: &[f64]| -> Vec<f64> {
                let kept = |i: &usize| !(10.0..10.0 + gap_s).contains(&whole.time_s[*i]);
                (0..whole.len()).filter(kept).map(|i| values[i]).collect()
            };
            let channels = whole.channels.iter().map(|channel| Channel {
                name: channel.name.clone(),
                values: cut(&channel.values),
            });
            let cut = Trial {
                name: "cut".into(),
                time_s: cut(&whole.time_s),
                channels: channels.collect(),
            };
            let readings = apply(&calibration, &cut).expect("readings").readings;
            let at = cut.time_s.iter().position(|t| *t >= 10.0 + gap_s).expect("a gap");
            assert_eq!(readings[at + 29] == Err(Withheld::Warming), settles, "{memory:?} {gap_s}");
            let truth = cut.channel("length_mm").expect("a reference");
            let error =
                |i: usize| (readings[i].as_ref().expect("a reading").estimate - truth[i]).abs();
            let worst = (at + 30..at + 130).map(error).fold(0.0, f64::max);
            assert!(worst < 1.5, "{memory:?}, {gap_s} s: {worst} mm");
        }
    }
}

/// A baseline is followed at the end of the range at which the sensor rests, be it the low or the high end.
#[test]
fn the_baseline_is_followed_at_the_end_where_the_sensor_rests() {
    let moves = |phase: f64| move |t: f64| (1.1 * t + phase).sin().max(0.0).powi(2);
    let drifting = |name: &str, phase: f64, drift: f64| {
        let mut trial = trial(name, 60.0, moves(phase));
        let bridge_v = &mut trial.channels[1].values;
        bridge_v.iter_mut().zip(&trial.time_s).for_each(|(v, t)| *v -= drift * t / 60.0);
        trial
    };
    let (fitted, tested) = (drifting("fit", 0.3, 0.02), drifting("test", 1.0, 0.15));
    let error = |name: &str, reference: &dyn Fn(f64) -> f64, kind: Memory| {
        let [fitted, tested] = [&fitted, &tested].map(|trial| {
            let length = trial.require("length_mm").expect("a length");
            let values = length.iter().map(|x| reference(*x)).collect();
            let channels = vec![Channel { name: name.into(), values }, trial.channels[1].clone()];
            Trial { channels, ..trial.clone() }
        });
        let options = Options {
            reference: name.into(),
            model: ModelKind::Remembering { kind, rest: true },
            ..Options::default()
        };
        let calibration = calibrate(&[fitted], &options).expect("a fit").calibration;
        evaluate(&[("own", &calibration)], &[tested]).expect("errors").pooled[1].rmse
    };
    for kind in [Memory::Observer, Memory::History] {
        let longest = error("length_mm", &|x| x, kind);
        for (name, reference) in [
            ("length_mm", &(|x: f64| 330.0 - x) as &dyn Fn(f64) -> f64),
            ("angle_deg", &|x| 180.0 - x),
            ("angle_deg", &|x| x),
        ] {
            let other = error(name, reference, kind);
            assert!(other < 1.3 * longest, "{kind:?}, {name}: {other} against {longest}");
        }
    }
}

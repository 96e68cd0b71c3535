//! Slow drift and offsets that a simulator describes are no effects, and other effects are still
//! found.

use stretch_gap::{NoteCode, SlowDrift, VerdictKind};

use crate::toys::{Effect, Law, Measured, Toy, noted, slow};

fn drifting(described: SlowDrift, course: (f64, f64), seed: u64) -> Toy {
    let mut toy = Toy::of(&[Law::Line]).may_lack(&Effect::ALL);
    toy.parameters[1].drift = Some(described);
    toy.courses = vec![(1, slow(course.0, course.1, (toy.samples(), toy.dt_s), seed))];
    toy
}

const DESCRIBED: SlowDrift = SlowDrift { sd: 0.03, correlation_s: 3.0 };

/// The drift is as described, half as large, twice as large or quicker. In 20 recordings no effect is named, because
/// this requires 12 nats.
#[test]
fn a_drift_that_is_described_is_no_effect() {
    for (i, course) in [(0.03, 3.0), (0.015, 3.0), (0.06, 3.0), (0.03, 1.0)].into_iter().enumerate()
    {
        for seed in 0..5 {
            let told =
                drifting(DESCRIBED, course, 10 * i as u64 + seed).measured(seed).diagnosed().0;
            assert!(told.named().is_empty(), "{course:?} {seed}: {}", told.sentence);
        }
    }
}

/// An effect changes the output by 0.06, twelve times as much as the drift. The largest size of the drift that is tried
/// is 2.5 times the described one, so the drift cannot explain the effect. (If the described drift were half as large
/// as the effect, the effect would not be named.)
#[test]
fn an_effect_beside_a_smaller_drift_is_found() {
    let described = SlowDrift { sd: 0.005, correlation_s: 3.0 };
    for seed in 0..5 {
        let toy = drifting(described, (0.005, 3.0), seed).hiding(&[(Effect::Quadratic, &[0.4])]);
        let told = toy.measured(seed).diagnosed().0;
        assert_eq!(told.named(), ["quadratic"], "{}", told.sentence);
        let value = told.candidates[0].parameters[0].value;
        // A drift of a twelfth of the effect changes the estimated size by at most a twelfth.
        approx::assert_abs_diff_eq!(value, 0.4, epsilon = 0.4 / 12.0);
    }
}

/// A drift that the simulator does not describe is a gap.
#[test]
fn a_drift_that_nobody_described_is_a_gap() {
    for seed in 0..5 {
        let mut toy = drifting(DESCRIBED, (0.03, 3.0), seed);
        toy.parameters[1].drift = None;
        let told = toy.measured(seed).diagnosed().0;
        assert!(told.gap.retuned > 1.0, "nine times the noise's variance: {:?}", told.gap);
        assert_ne!(told.verdict(), VerdictKind::NoGap, "{}", told.sentence);
    }
}

#[test]
fn offsets_by_trial_are_no_effect_where_they_are_described() {
    for seed in 0..5 {
        let mut toy = Toy::of(&[Law::Lag, Law::Line]);
        toy.catalogue = Effect::ALL.map(|effect| (1, effect)).into();
        toy.parameters[3].per_trial_sd = Some(0.05);
        let steps = [0.05, -0.03, 0.06, -0.05].into_iter().zip(toy.ranges());
        toy.courses = vec![(3, steps.flat_map(|(step, range)| range.map(move |_| step)).collect())];
        let told = toy.measured(seed).diagnosed().0;
        assert!(told.named().is_empty(), "{}", told.sentence);
        assert!(
            matches!(told.verdict(), VerdictKind::NoGap | VerdictKind::Parameters),
            "{}",
            told.sentence
        );
    }
}

/// Returns a recording whose output drifts by `times` its noise.
fn wandering(times: f64, correlation_s: f64, seed: u64, hidden: &[(Effect, &[f64])]) -> Measured {
    let recorder_drift = Some(SlowDrift { sd: 0.3, correlation_s: 2.0 });
    let toy = Toy { recorder_drift, ..Toy::of(&[Law::Line]).may_lack(&Effect::ALL).hiding(hidden) };
    let drift = slow(times * toy.noise, correlation_s, (toy.samples(), toy.dt_s), seed);
    toy.measured(seed).rewritten(|_, outputs| {
        outputs[0].iter_mut().zip(&drift).for_each(|(y, drift)| *y += drift);
    })
}

/// In 20 recordings with typical slow noise of a recorder there is no gap, and a note states the assumed slow noise.
#[test]
fn slow_noise_of_a_recorder_is_no_gap() {
    for (times, correlation_s) in [(0.0, 1.0), (0.4, 1.0), (0.7, 3.0), (0.5, 8.0)] {
        for seed in 0..5 {
            let told = wandering(times, correlation_s, seed, &[]).diagnosed().0;
            let agrees = matches!(told.verdict(), VerdictKind::NoGap | VerdictKind::Parameters);
            assert!(agrees, "{times} {correlation_s} {seed}: {}", told.sentence);
            let is_said = !noted(&told, NoteCode::SlowNoise).is_empty();
            assert!(is_said == (times > 0.0), "{times} {correlation_s} {seed}: {:?}", told.notes);
        }
    }
}

/// A drift that is larger than the noise of a recorder is a gap, however slow it is.
#[test]
fn what_wanders_by_more_than_noise_stays_a_gap() {
    for (times, correlation_s) in [(2.0, 1.0), (2.0, 3.0), (5.0, 10.0)] {
        for seed in 0..5 {
            let told = wandering(times, correlation_s, seed, &[]).diagnosed().0;
            assert!(told.gap.retuned > 1.0, "{times} {correlation_s} {seed}: {:?}", told.gap);
            let agrees = matches!(told.verdict(), VerdictKind::NoGap | VerdictKind::Parameters);
            assert!(!agrees, "{times} {correlation_s} {seed}: {}", told.sentence);
        }
    }
}

/// An effect as large as the slow noise is distinguished from it, because the two have different courses.
#[test]
fn an_effect_beside_slow_noise_is_found() {
    for seed in 0..5 {
        let told = wandering(0.6, 3.0, seed, &[(Effect::Quadratic, &[0.05])]).diagnosed().0;
        assert_eq!(told.named(), ["quadratic"], "{seed}: {}", told.sentence);
        let value = told.candidates[0].parameters[0].value;
        approx::assert_abs_diff_eq!(value, 0.05, epsilon = 0.01);
    }
}

/// If a drift is extrapolated to a test trial that is later than all fitted trials, a note states the fitted and the
/// extrapolated time.
#[test]
fn a_drift_is_told_as_extrapolated() {
    let notes = |effect: Effect, size: f64| {
        let toy = Toy::of(&[Law::Line]).may_lack(&Effect::ALL).hiding(&[(effect, &[size])]);
        let (told, _) = toy.measured(2).diagnosed();
        assert_eq!(told.named(), [effect.name()], "{}", told.sentence);
        noted(&told, NoteCode::ExtrapolatedDrift)
    };
    let [note] = &notes(Effect::Drift, 0.003)[..] else { panic!("one note") };
    let begins = "drift is a law of session time: it was fitted from 0 to 130 s and extrapolated to the test trials, from 180 to 190 s";
    assert!(note.starts_with(begins), "{note}");
    assert!(notes(Effect::Play, 0.1).is_empty());
}

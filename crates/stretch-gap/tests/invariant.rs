//! Tests that a diagnosis does not depend on threads, order, units and the clock of the session, and that fits do not
//! depend on the test trials.

use crate::{
    consistent::{evidenced, told},
    toys::{Effect, Law, Measured, Toy, noted},
};
use stretch_gap::{Diagnosis, NoteCode, Options};

/// A lag and a line, each with a missing effect.
fn two_stages() -> Toy {
    let mut toy = Toy::of(&[Law::Lag, Law::Line]);
    toy.catalogue = (0..2)
        .flat_map(|s| {
            [Effect::Play, Effect::Quadratic, Effect::Cubic, Effect::Drift].map(|e| (s, e))
        })
        .collect();
    toy.hidden = vec![(0, Effect::Cubic, vec![0.3]), (1, Effect::Play, vec![0.1])];
    toy
}

fn without_time(told: Diagnosis) -> Diagnosis {
    Diagnosis { runtime_s: 0.0, ..told }
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let by = |threads: usize| {
        let options = Options { threads, ..Options::default() };
        without_time(evidenced(&two_stages().measured(1), &options).0)
    };
    assert_eq!(by(1), by(2));
}

#[test]
fn the_same_question_has_the_same_answer() {
    let measured = two_stages().measured(2);
    assert_eq!(without_time(told(&measured)), without_time(told(&measured)));
}

/// The seed affects only the bootstrap: names, scores and sizes are the same, and intervals change a little.
#[test]
fn the_seed_moves_intervals_alone() {
    let by = |seed: u64| {
        let options = Options { seed, ..Options::default() };
        evidenced(&two_stages().measured(3), &options).0
    };
    let (one, other) = (by(1), by(2));
    assert_eq!(one.named(), other.named());
    for (a, b) in one.candidates.iter().zip(&other.candidates) {
        assert_eq!((&a.effects, a.closed, &a.by_name), (&b.effects, b.closed, &b.by_name));
    }
}

/// The order of the catalogue does not matter. Fits of sets begin with a different effect, but end near the same
/// optimum: scores agree to a hundredth of a nat, sizes to a thousandth.
#[test]
fn the_order_of_the_catalogue_does_not_matter() {
    let (one, mut turned) = (two_stages(), two_stages());
    turned.catalogue.reverse();
    let (one, turned) = (told(&one.measured(4)), told(&turned.measured(4)));
    let sorted = |names: &[String]| {
        let mut names = names.to_vec();
        names.sort();
        names
    };
    assert_eq!(
        sorted(&one.named()),
        sorted(&turned.named()),
        "{} {}",
        one.sentence,
        turned.sentence
    );
    assert_eq!(sorted(&one.ambiguous), sorted(&turned.ambiguous));
    let (a, b) = (&one.candidates[0], &turned.candidates[0]);
    assert!((a.score - b.score).abs() < 0.01 && (a.closed - b.closed).abs() < 1e-3, "{a:?} {b:?}");
    for (name, value) in &a.by_name {
        assert!((value / b.by_name[name] - 1.0).abs() < 1e-3, "{name}");
    }
}

/// With other units (kilometres, microvolts), every result in multiples of the noise is the same, except for rounding,
/// because searches stop when their steps are small.
#[test]
fn units_do_not_matter() {
    let (plain, scaled) = (two_stages(), Toy { units: [1e-3, 1e6], ..two_stages() });
    let (plain, scaled) = (told(&plain.measured(5)), told(&scaled.measured(5)));
    assert_eq!(
        (plain.verdict(), &plain.named(), &plain.answer.tied()),
        (scaled.verdict(), &scaled.named(), &scaled.answer.tied())
    );
    assert_eq!(plain.ambiguous, scaled.ambiguous);
    for (a, b) in plain.candidates.iter().zip(&scaled.candidates) {
        assert_eq!(a.effects, b.effects);
        assert!((a.closed - b.closed).abs() < 1e-4 && (a.probability - b.probability).abs() < 1e-3);
    }
    for (a, b) in plain.location.stages.iter().zip(&scaled.location.stages) {
        assert!((a.excess / b.excess - 1.0).abs() < 1e-4, "{a:?} {b:?}");
        assert!((1e6 * a.floor / b.floor - 1.0).abs() < 1e-4, "{a:?} {b:?}");
    }
    for (a, b) in plain.parameters.iter().zip(&scaled.parameters) {
        assert!((a.sigmas - b.sigmas).abs() < 1e-3, "{a:?} {b:?}");
    }
}

/// A session that began an hour later has the same diagnosis, because clocks count from its first trial. Only a drift
/// depends on the absolute session time; the zero of the line absorbs this offset.
#[test]
fn the_hour_of_the_session_does_not_matter() {
    let later = Toy { begins_s: 3600.0, ..two_stages() };
    let (one, later) = (told(&two_stages().measured(6)), told(&later.measured(6)));
    assert_eq!(
        (one.verdict(), &one.named(), &one.answer.tied()),
        (later.verdict(), &later.named(), &later.answer.tied())
    );
    assert_eq!(one.location.stages, later.location.stages);
    for (a, b) in one.candidates.iter().zip(&later.candidates).take(1) {
        assert_eq!((&a.effects, &a.by_name, a.closed), (&b.effects, &b.by_name, b.closed));
    }
}

/// Returns a recording, and the same recording with other values in its test trial (the last one).
fn with_another_test(seed: u64) -> (Measured, Measured) {
    let plain = two_stages().measured(seed);
    let other = two_stages().measured(seed).rewritten(|x, outputs| {
        let from = x.len() - 1000;
        for (i, x) in x[from..].iter_mut().enumerate() {
            *x += 0.3 * (0.05 * i as f64).sin();
        }
        for (k, output) in outputs.iter_mut().enumerate() {
            for (i, y) in output[from..].iter_mut().enumerate() {
                *y = 0.5 * *y + 0.4 * (0.031 * (i + 7 * k) as f64).cos();
            }
        }
    });
    (plain, other)
}

/// Nothing is fitted, chosen or screened on test trials: with other test trials every fit is the
/// same to the bit, and only the results on test trials change.
#[test]
fn test_trials_are_never_fitted() {
    let (plain, other) = with_another_test(7);
    let options = Options::default();
    let (one, of_one) = evidenced(&plain, &options);
    let (two, of_two) = other.diagnosed_by(&options);
    assert_eq!((&of_one.retuned, &of_one.best), (&of_two.retuned, &of_two.best));
    assert_eq!(of_one.retuned_spread, of_two.retuned_spread);
    assert_eq!(one.identifiability, two.identifiability);
    for a in &one.candidates {
        // A set that is worse than the empty set on these test trials is not a candidate.
        let Some(b) = two.candidates.iter().find(|b| b.effects == a.effects) else { continue };
        assert_eq!((&a.by_name, &a.parameters), (&b.by_name, &b.parameters));
        assert!(a.effects == ["unknown"] || a.score == b.score);
    }
    assert!(two.gap.left > one.gap.left + 1.0, "the test trial is another: {:?}", two.gap);
    let until = plain.x.len() - 1000;
    for (a, b) in of_one.stages.iter().zip(&of_two.stages) {
        assert_eq!(a.after[..until], b.after[..until]);
        assert_eq!(a.residual_after[..until], b.residual_after[..until]);
    }
}

/// A proposed sum of terms that makes the test trials worse is not reported.
#[test]
fn a_proposal_that_fails_on_the_test_trials_is_not_told() {
    told(&with_another_test(7).1);
}

/// Without a test trial, the last quarter of every trial is used for testing. Its values do not affect a fit either.
#[test]
fn borrowed_test_samples_are_never_fitted() {
    let mut toy = Toy::of(&[Law::Lag]).may_lack(&[Effect::Play, Effect::Cubic]);
    toy = toy.hiding(&[(Effect::Cubic, &[0.3])]);
    toy.trials = vec![(2000, false); 2];
    let (plain, mut other) = (toy.measured(8), toy.measured(8));
    for y in &mut other.outputs[0][1500..2000] {
        *y *= 0.7;
    }
    let options = Options::default();
    let ((one, of_one), (two, of_two)) = (evidenced(&plain, &options), evidenced(&other, &options));
    assert!(of_one.roles.borrowed_test && !noted(&one, NoteCode::NoTestTrial).is_empty());
    assert_eq!((&of_one.retuned, &of_one.best), (&of_two.retuned, &of_two.best));
    assert!(two.gap.left > one.gap.left);
}

/// A test trial in the middle of a session is not fitted either.
#[test]
fn a_test_trial_in_the_middle_is_not_fitted() {
    let mut toy = Toy::of(&[Law::Line]).may_lack(&[Effect::Play, Effect::Quadratic]);
    toy = toy.hiding(&[(Effect::Quadratic, &[0.2])]);
    toy.trials = vec![(1000, false), (1000, true), (1000, false)];
    let (plain, mut other) = (toy.measured(9), toy.measured(9));
    for (i, y) in other.outputs[0][1000..2000].iter_mut().enumerate() {
        *y += 0.3 * (0.03 * i as f64).sin();
    }
    let options = Options::default();
    let ((one, of_one), (_, of_two)) = (evidenced(&plain, &options), evidenced(&other, &options));
    assert_eq!(one.named(), ["quadratic"], "{}", one.sentence);
    assert_eq!((&of_one.retuned, &of_one.best), (&of_two.retuned, &of_two.best));
}

//! Stability of names when the recording is resampled.

use crate::{
    consistent::told,
    toys::{Effect, Law, Toy},
};
use stretch_gap::Diagnosis;

fn stability(told: &Diagnosis, effect: &str) -> f64 {
    let of = told.stabilities.iter().find(|s| s.effect == effect);
    of.unwrap_or_else(|| panic!("{effect}: {:?}", told.stabilities)).stability
}

/// A play that is visible in every trial is the cause in every resampled recording.
#[test]
fn what_every_trial_shows_is_firm() {
    let toy = Toy::of(&[Law::Line]).may_lack(&Effect::ALL);
    let told = told(&toy.hiding(&[(Effect::Play, &[0.1])]).measured(2));
    assert_eq!(told.named(), ["play"], "{}", told.sentence);
    assert!(stability(&told, "play") > 0.99, "{:?}", told.stabilities);
    assert!(told.stabilities.iter().all(|s| (0.0..=1.0).contains(&s.stability)));
}

/// If one law has two names, resampled recordings cannot distinguish them either, so each name has a stability of one
/// half.
#[test]
fn each_of_two_twins_has_a_half() {
    let toy = Toy::of(&[Law::Line]).may_lack(&[Effect::Quadratic, Effect::Square, Effect::Drift]);
    let told = told(&toy.hiding(&[(Effect::Quadratic, &[0.15])]).measured(1));
    for twin in ["quadratic", "square"] {
        let half = stability(&told, twin);
        assert!((half - 0.5).abs() < 0.15, "{twin}: {:?}", told.stabilities);
    }
}

/// Of a quadratic and a cubic together, the stronger effect is at least as stable as the weaker one.
#[test]
fn of_two_causes_the_stronger_is_the_firmer() {
    let toy = Toy::of(&[Law::Line]).may_lack(&[Effect::Quadratic, Effect::Cubic, Effect::Drift]);
    let hidden: [(Effect, &[f64]); 2] = [(Effect::Quadratic, &[0.15]), (Effect::Cubic, &[0.3])];
    let told = told(&toy.hiding(&hidden).measured(10));
    assert_eq!(told.named().len(), 2, "{}", told.sentence);
    assert!(stability(&told, "quadratic") >= stability(&told, "cubic"), "{:?}", told.stabilities);
    assert!(stability(&told, "cubic") > 0.9, "{:?}", told.stabilities);
}

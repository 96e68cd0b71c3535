//! A floor that is taken too high hides no effect: what the effect leaves is the noise.

use crate::gauge::{Gauge, Lack};
use stretch_gap::{Diagnosis, Options, VerdictKind, diagnose};

fn diagnosed(lack: Lack, times: f64, seed: u64) -> Diagnosis {
    let gauge = Gauge::lacking(lack, seed).with_noise_taken_for(times);
    diagnose(&gauge, &Options::default(), &|_| (), &|| false).expect("a diagnosis").0
}

#[test]
fn an_effect_below_a_floor_that_is_too_high_is_named() {
    for seed in 0..3 {
        let told = [1.0, 1.4].map(|times| diagnosed(Lack::Curve, times, seed));
        for told in &told {
            assert_eq!(told.verdict, VerdictKind::Effect, "{}", told.sentence);
            assert_eq!(told.named, ["curve"]);
        }
        // Whatever the noise was taken for, the gap is the same in units of what is left: sets chosen alike differ by noise alone.
        let [right, high] = told.map(|told| told.gap.retuned);
        assert!((0.9..1.1).contains(&(high / right)), "{high} {right}");
    }
}

/// The rule gives nothing away where nothing is missing.
#[test]
fn nothing_is_named_below_a_floor_that_is_too_high() {
    for seed in 0..20 {
        let told = diagnosed(Lack::Nothing, 1.4, seed);
        assert!(told.named.is_empty(), "{}", told.sentence);
        assert!(matches!(told.verdict, VerdictKind::NoGap | VerdictKind::Parameters));
    }
}

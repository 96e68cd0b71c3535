//! Noise that is taken too high hides no effect: what the effect leaves is the noise.

use crate::gauge::{Gauge, Lack};
use stretch_gap::{Diagnosis, Options, VerdictKind, diagnose};

fn diagnosed(lack: Lack, times: f64, seed: u64) -> Diagnosis {
    let gauge = Gauge::lacking(lack, seed).with_noise_taken_for(times);
    diagnose(&gauge, &Options::default(), &|_| (), &|| false).expect("a diagnosis").0
}

#[test]
fn an_effect_below_noise_taken_too_high_is_named() {
    for seed in 0..3 {
        let found = [1.0, 1.4].map(|times| diagnosed(Lack::Curve, times, seed));
        for found in &found {
            assert_eq!(found.verdict, VerdictKind::Effect, "{}", found.sentence);
            assert_eq!(found.named, ["curve"]);
        }
        // Whatever the noise was taken for, the gap is the same in units of what is left: sets chosen alike differ by noise alone.
        let [right, high] = found.map(|found| found.gap.retuned);
        assert!((0.9..1.1).contains(&(high / right)), "{high} {right}");
    }
}

/// The rule gives nothing away where nothing is missing.
#[test]
fn nothing_is_named_below_noise_taken_too_high() {
    for seed in 0..20 {
        let found = diagnosed(Lack::Nothing, 1.4, seed);
        assert!(found.named.is_empty(), "{}", found.sentence);
        assert!(matches!(found.verdict, VerdictKind::NoGap | VerdictKind::Parameters));
    }
}

//! If the noise is assumed too large, no effect is hidden, because the residual of the best set of effects replaces the
//! assumed noise.

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
            assert_eq!(found.verdict(), VerdictKind::Effect, "{}", found.sentence);
            assert_eq!(found.named(), ["curve"]);
        }
        // The gap is relative to the residual of the best set, so it does not depend on the assumed noise.
        let [right, high] = found.map(|found| found.gap.retuned);
        assert!((0.9..1.1).contains(&(high / right)), "{high} {right}");
    }
}

/// If nothing is missing, no effect is named.
#[test]
fn nothing_is_named_below_noise_taken_too_high() {
    for seed in 0..20 {
        let found = diagnosed(Lack::Nothing, 1.4, seed);
        assert!(found.named().is_empty(), "{}", found.sentence);
        assert!(matches!(found.verdict(), VerdictKind::NoGap | VerdictKind::Parameters));
    }
}

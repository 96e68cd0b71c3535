//! The gap of recordings in which nothing is missing stays within the null band. If the gap is
//! above the band and no effect explains it, the gap is reported.

use crate::gauge::{Gauge, Lack};
use stretch_gap::{Diagnosis, Options, VerdictKind, diagnose};

fn diagnosed(lack: Lack, seed: u64) -> Diagnosis {
    let gauge = Gauge::lacking(lack, seed);
    diagnose(&gauge, &Options::default(), &|_| (), &|| false).expect("a diagnosis").0
}

/// On average, two of 40 recordings are outside a 95 % band; seven or more are outside with
/// probability 0.003.
#[test]
fn noise_stays_within_its_band() {
    let is_outside = |seed: &u64| {
        let quiet = diagnosed(Lack::Nothing, *seed);
        let band = quiet.null_band;
        assert!(band < 0.2, "a band that holds everything tells nothing: {band}");
        quiet.gap.retuned > band
    };
    let outside = (0..40).filter(is_outside).count();
    assert!(outside <= 6, "{outside} of 40");
}

#[test]
fn what_is_above_the_band_and_below_a_name_is_told() {
    for seed in 0..5 {
        let faint = diagnosed(Lack::Whisper, seed);
        assert_eq!(faint.verdict(), VerdictKind::Parameters, "{}", faint.sentence);
        assert!(faint.sentence.starts_with("Too faint to name"), "{}", faint.sentence);
    }
}

//! Tests each verdict on a toy whose true cause is known.

use crate::{
    consistent::told,
    toys::{Effect, Law, Measured, Toy, binomial_bound, slow},
};
use stretch_gap::{RandomGenerator, VerdictKind};

fn line() -> Toy {
    Toy::of(&[Law::Line]).may_lack(&Effect::ALL)
}

/// Adds white noise to the offset of the recording; no catalogue contains such an effect.
fn restless(toy: Toy, sd: f64, seed: u64) -> Toy {
    let mut random = RandomGenerator::new(seed, 40);
    let zero = toy.parameter("line.zero");
    let course = (0..toy.samples()).map(|_| sd * random.gauss()).collect();
    Toy { courses: vec![(zero, course)], ..toy }
}

/// The verdict is `no_gap` if the gap on the test trials is below 0.02. The excess of 40 000 samples of noise has a
/// standard deviation of sqrt(2/40 000) = 0.007.
#[test]
fn what_agrees_as_shipped_has_no_gap() {
    let told = told(&Toy { trials: vec![(5000, false), (40_000, true)], ..line() }.measured(1));
    assert_eq!(told.verdict(), VerdictKind::NoGap, "{}", told.sentence);
    assert!(told.ambiguous.is_empty() && told.answer.gross().is_empty());
    // For the 5000 fitted samples it is 0.02; the tolerance is three times that.
    assert!(told.gap.raw < 0.021 && told.gap.retuned < 0.06, "{:?}", told.gap);
}

#[test]
fn what_agrees_once_re_tuned_lacks_nothing() {
    let told = told(&line().off_by(&[1.5, -1.5]).measured(2));
    assert_eq!(told.verdict(), VerdictKind::Parameters, "{}", told.sentence);
    // The errors are 0.075 x and 0.075, with noise of 0.01. The mean of x^2 is 4 0.25^2/2 = 0.125, so the gap is 56
    // times 1.125, which is 63.
    assert!((told.gap.raw / 63.3 - 1.0).abs() < 0.15, "{:?}", told.gap);
    for (p, off) in told.parameters.iter().zip([1.5, -1.5]) {
        // 3000 samples determine an offset to 0.01/sqrt(3000), and a gain three times less accurately, which is 0.01
        // tolerances. The prior pulls the values by less.
        assert!((p.sigmas - off).abs() < 0.1, "{p:?}");
    }
}

#[test]
fn a_missing_effect_is_named_with_its_size() {
    let told = told(&line().hiding(&[(Effect::Cubic, &[0.2])]).measured(3));
    assert_eq!(told.verdict(), VerdictKind::Effect, "{}", told.sentence);
    assert_eq!(told.named(), ["cubic"]);
    let size = &told.candidates[0].parameters[0];
    assert!(size.interval[0] <= 0.2 && 0.2 <= size.interval[1], "{size:?}");
}

/// A play outside the catalogue, plus a drift in the catalogue that closes less.
#[test]
fn what_the_catalogue_lacks_is_unknown() {
    let toy = Toy::of(&[Law::Line]).may_lack(&[Effect::Drift]).hiding(&[(Effect::Play, &[0.2])]);
    let told = told(&toy.measured(4));
    assert_eq!(told.verdict(), VerdictKind::Unknown, "{}", told.sentence);
    let unknown = told.candidates.last().expect("`unknown`");
    assert!(unknown.probability > 0.5, "{unknown:?}");
}

/// A known cause explains most of the gap and is named. The share of the rest is reported.
#[test]
fn a_cause_beside_something_else_is_told_in_part() {
    let toy = restless(line().hiding(&[(Effect::Quadratic, &[0.3])]), 0.02, 5);
    let told = told(&toy.measured(5));
    assert_eq!(
        (told.verdict(), told.named()),
        (VerdictKind::Partial, vec!["quadratic".to_owned()]),
        "{}",
        told.sentence
    );
    let unexplained = told.answer.unexplained().expect("what is left");
    assert!((unexplained.share + told.candidates[0].closed - 1.0).abs() < 1e-9);
    assert_eq!(unexplained.stage, "line");
}

#[test]
fn a_column_of_the_wrong_sign_is_an_error_of_the_record() {
    let mut measured = line().measured(6);
    measured.outputs[0].iter_mut().for_each(|y| *y = -*y);
    let told = told(&measured);
    assert_eq!(told.verdict(), VerdictKind::Record, "{}", told.sentence);
}

/// The output is unrelated to the simulator, so no effect is named.
#[test]
fn another_rigs_record_is_the_wrong_one() {
    let mut measured = line().measured(7);
    let other = Toy::of(&[Law::Oscillator]).measured(99);
    measured.outputs[0] = other.outputs[0].iter().map(|y| 5.0 * y * y).collect();
    let told = told(&measured);
    assert!(
        matches!(told.verdict(), VerdictKind::Unknown | VerdictKind::Record),
        "{}",
        told.sentence
    );
    assert!(told.named().is_empty());
}

/// The true parameters differ from the nominal ones by eight tolerances. The re-tuned parameters are then at their
/// bounds, a gap remains, and no effect is named.
#[test]
fn parameters_at_their_ends_are_told() {
    let toy = Toy::of(&[Law::Oscillator]).off_by(&[0.0, 8.0, 8.0]);
    let told = told(&toy.measured(8));
    assert!(
        told.named().is_empty() && told.verdict() != VerdictKind::Parameters,
        "{}",
        told.sentence
    );
    let ends = told.parameters.iter().filter(|p| p.sigmas.abs() > 2.75).count();
    assert!(ends >= 1, "{:?}", told.parameters);
}

/// The effect has four times the largest size in the catalogue. An effect at the end of its range counts as a
/// compensation for another cause.
#[test]
fn an_effect_at_the_end_of_its_range_is_not_named() {
    let toy = Toy::of(&[Law::Line]).may_lack(&[Effect::Quadratic]);
    let told = told(&toy.hiding(&[(Effect::Quadratic, &[2.0])]).measured(9));
    assert_eq!(told.verdict(), VerdictKind::Unknown, "{}", told.sentence);
    assert!(told.shares[0].at_bound, "{:?}", told.shares);
}

#[test]
fn two_causes_are_both_named() {
    let pairs: [[(Effect, &[f64]); 2]; 3] = [
        [(Effect::Quadratic, &[0.15]), (Effect::Play, &[0.1])],
        [(Effect::Cubic, &[0.3]), (Effect::Drift, &[0.0003])],
        [(Effect::Late, &[0.06]), (Effect::Quadratic, &[-0.15])],
    ];
    for pair in pairs {
        let told = told(&line().hiding(&pair).measured(10));
        for (effect, _) in pair {
            assert!(told.named().iter().any(|n| n == effect.name()), "{pair:?}: {}", told.sentence);
        }
        assert_eq!(told.named().len(), 2, "{}", told.sentence);
    }
}

#[test]
fn causes_of_two_stages_are_named_where_they_act() {
    let mut toy = Toy::of(&[Law::Lag, Law::Line]);
    toy.catalogue = (0..2).flat_map(|stage| Effect::ALL.map(|effect| (stage, effect))).collect();
    toy.hidden = vec![(0, Effect::Play, vec![0.1]), (1, Effect::Quadratic, vec![0.15])];
    let told = told(&toy.measured(11));
    let mut named = told.named();
    named.sort();
    assert_eq!(named, ["play", "quadratic_1"], "{}", told.sentence);
    // Every stage has its own gap and a share of the whole gap.
    assert!(told.location.stages.iter().all(|s| s.share > 0.05), "{:?}", told.location.stages);
}

/// If an effect is removed from the catalogue, no dissimilar effect is named in its place.
#[test]
fn strangers_get_no_name() {
    let cases: [(Effect, &[f64], &[Effect]); 3] = [
        (Effect::Play, &[0.2], &[Effect::Drift, Effect::Quadratic]),
        (Effect::Drift, &[0.004], &[Effect::Play, Effect::Cubic, Effect::Slow]),
        (Effect::Quadratic, &[0.2], &[Effect::Late, Effect::Slow, Effect::Drift]),
    ];
    for (hidden, values, catalogue) in cases {
        let toy = Toy::of(&[Law::Line]).may_lack(catalogue).hiding(&[(hidden, values)]);
        let told = told(&toy.measured(12));
        assert_eq!(told.verdict(), VerdictKind::Unknown, "{hidden:?}: {}", told.sentence);
    }
}

/// In 40 recordings in which nothing is missing, with parameters anywhere within two tolerances, no effect is named. By
/// chance, the threshold of twelve nats is exceeded in less than one of 1e5 recordings.
#[test]
fn nothing_is_named_on_noise() {
    for seed in 0..40 {
        let mut random = RandomGenerator::new(seed, 3);
        let off: Vec<f64> = (0..2).map(|_| 4.0 * random.unit() - 2.0).collect();
        let told = told(&line().off_by(&off).measured(100 + seed));
        assert!(
            matches!(told.verdict(), VerdictKind::NoGap | VerdictKind::Parameters),
            "{seed}: {}",
            told.sentence
        );
    }
}

/// The gap by noise alone is within the 95 % band. Of 40 recordings of two stages, the test allows the number outside
/// that a binomial count of probability 0.05 exceeds once in a thousand.
#[test]
fn noise_alone_stays_within_the_null_band() {
    let toy = Toy::of(&[Law::Lag, Law::Line]);
    let is_outside = |seed: &u64| {
        let told = told(&toy.measured(200 + seed));
        let band = told.null_band;
        // With 1000 test samples, the excess of each of the two stages is at most about 2 sqrt(2/1000) = 0.09. Their
        // sum counts.
        assert!((0.01..0.2).contains(&band), "{band}");
        told.gap.retuned > band
    };
    let outside = (0..40).filter(is_outside).count();
    assert!(outside <= binomial_bound(40, 0.05, 0.001), "{outside} of 40");
}

/// The band is inversely proportional to the root of the number of samples, and does not depend on units.
#[test]
fn the_null_band_narrows_with_the_record() {
    let band = |times: usize, units: [f64; 2]| {
        let trials = vec![(1000 * times, false), (1000 * times, true)];
        let toy = Toy { trials, units, ..Toy::of(&[Law::Line]) };
        told(&toy.measured(13)).null_band
    };
    let (short, long) = (band(1, [1.0; 2]), band(4, [1.0; 2]));
    // The draws are the same with a quarter of the variance, for fitted and for test samples alike.
    assert!((short / long / 2.0 - 1.0).abs() < 1e-6, "{short} {long}");
    let other = band(1, [1e3, 1e-3]);
    assert!((short / other - 1.0).abs() < 1e-6, "{short} {other}");
}

/// If a recording has only a tenth of the required rows and seconds, no effect is named or suggested, and the sentence
/// says what to record.
#[test]
fn a_record_that_is_too_short_carries_no_name() {
    let trials = vec![(400, false), (300, true)];
    let toy = Toy { trials, ..line().hiding(&[(Effect::Quadratic, &[0.2])]) };
    for seed in 14..20 {
        let told = told(&toy.measured(seed));
        assert!(told.named().is_empty(), "{:?}", told.named());
        let mut renamed = told.clone();
        renamed.rename(&|_| "an effect".to_owned());
        assert_eq!(told.notes, renamed.notes, "no note names an effect");
        assert!(told.sentence.contains("Record at least"), "{}", told.sentence);
    }
}

/// An independent slow drift is no effect, whatever its correlation time.
#[test]
fn a_slow_course_of_its_own_is_no_effect() {
    for (seed, correlation_s) in [(1, 0.3), (2, 3.0)] {
        let toy = line();
        let course = slow(0.03, correlation_s, (toy.samples(), toy.dt_s), seed);
        let zero = toy.parameter("line.zero");
        let measured: Measured = Toy { courses: vec![(zero, course)], ..toy }.measured(15);
        let told = told(&measured);
        assert!(told.named().is_empty(), "{correlation_s} s: {}", told.sentence);
    }
}

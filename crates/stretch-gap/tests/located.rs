//! Location of a gap: a gap that was added in one place is reported there, and not elsewhere.

use crate::{
    consistent::{evidenced, told},
    toys::{Effect, Law, Measured, Toy, binomial_bound},
};
use stretch_gap::{Diagnosis, Options, RandomGenerator};

/// A line whose recording has additional white noise of the offset at the samples for which `is_there` (of sample,
/// motion and rate) is true. No parameter can explain this noise.
fn disturbed(seed: u64, sd: f64, is_there: impl Fn(usize, f64, f64) -> bool) -> Measured {
    let toy =
        Toy { trials: vec![(1500, false), (1500, false), (1500, true)], ..Toy::of(&[Law::Line]) };
    let x = toy.measured(seed).x;
    let mut random = RandomGenerator::new(seed, 60);
    let course = (0..x.len())
        .map(|i| {
            let rate = (x[(i + 1).min(x.len() - 1)] - x[i.saturating_sub(1)]) / 0.02;
            let drawn = sd * random.gauss();
            if is_there(i, x[i], rate) { drawn } else { 0.0 }
        })
        .collect();
    Toy { courses: vec![(toy.parameter("line.zero"), course)], ..toy }.measured(seed)
}

fn standing_out<'a>(told: &'a Diagnosis, by: &str) -> Vec<&'a str> {
    let slices = told.location.slices.iter().filter(|s| s.by == by && s.stands_out);
    slices.map(|s| s.slice.as_str()).collect()
}

/// Returns the significant slices, with their axes, that are not on an `allowed` axis.
fn elsewhere<'a>(told: &'a Diagnosis, allowed: &[&str]) -> Vec<(&'a str, &'a str)> {
    let slices = told.location.slices.iter().filter(|s| s.stands_out);
    let all = slices.map(|s| (s.by.as_str(), s.slice.as_str()));
    all.filter(|(by, _)| !allowed.contains(by)).collect()
}

#[test]
fn a_gap_at_high_level_stands_out_there() {
    let told = told(&disturbed(1, 0.03, |_, x, _| x > 0.45));
    let levels: Vec<&str> =
        told.location.slices.iter().filter(|s| s.by == "level").map(|s| s.slice.as_str()).collect();
    let out = standing_out(&told, "level");
    // The highest of five levels between -1 and 1 begins at about 0.5. It contains most of the gap, and the level below
    // it the rest.
    assert_eq!(levels.len(), 5);
    assert!(out.contains(&levels[4]) && !out.iter().any(|o| levels[..3].contains(o)), "{out:?}");
    let high = told.location.slices.iter().filter(|s| levels[3..].contains(&s.slice.as_str()));
    let share: f64 = high.map(|s| s.share).sum();
    // The gap is nine variances in about a tenth of 4500 samples, a sum of 4000. Each of the three lower levels has
    // about 1200 samples, whose sum of squares has the standard deviation sqrt(2 1200) = 49. Three standard
    // deviations for each of the three levels are a tenth of the gap.
    assert!(share > 0.9, "{share}");
}

#[test]
fn a_gap_at_turnarounds_stands_out_there() {
    // Low rates occur near reversals: within 150 ms of a reversal, a wave of 2 rad/s or more has rates below about
    // 0.15.
    let told = told(&disturbed(2, 0.03, |_, _, rate| rate.abs() < 0.05));
    assert_eq!(standing_out(&told, "regime"), ["turnaround"]);
    let moving = told.location.slices.iter().find(|s| s.by == "regime" && s.slice == "rising");
    assert!(moving.is_some_and(|s| s.share < 0.2), "{moving:?}");
}

#[test]
fn a_gap_of_one_trial_stands_out_in_its_trial() {
    let told = told(&disturbed(3, 0.01, |i, _, _| (1500..3000).contains(&i)));
    assert_eq!(standing_out(&told, "trial"), ["trial 1"]);
    // Session time and travel vary with the trial, so slices on these axes may be significant as well. The gap is
    // independent of motion, time in the trial and frequency.
    assert_eq!(elsewhere(&told, &["trial", "session", "travel"]), []);
}

#[test]
fn a_gap_that_only_begins_a_trial_stands_out_in_time() {
    let told = told(&disturbed(4, 0.02, |i, _, _| i % 1500 < 300));
    assert_eq!(standing_out(&told, "time"), ["first 1 s", "1 to 3 s"]);
    assert_eq!(elsewhere(&told, &["time", "session", "travel"]), []);
}

/// A hum of 18 Hz lies between 12.5 and 25 Hz.
#[test]
fn a_gap_of_one_octave_stands_out_there() {
    let toy = Toy { trials: vec![(2000, false), (2000, true)], ..Toy::of(&[Law::Line]) };
    let hum = |i: usize| 0.01 * (std::f64::consts::TAU * 18.0 * 0.01 * i as f64).sin();
    let course = (0..toy.samples()).map(hum).collect();
    let toy = Toy { courses: vec![(toy.parameter("line.zero"), course)], ..toy };
    let told = told(&toy.measured(5));
    assert_eq!(standing_out(&told, "frequency"), ["12.5 to 25 Hz"]);
    let slice = told.location.slices.iter().find(|s| s.slice == "12.5 to 25 Hz");
    // The power of the hum is half of its squared amplitude, 0.5 variances of the noise. It lies in a quarter of the
    // spectral lines, so the excess there is 2.
    let excess = slice.map_or(0.0, |s| s.excess);
    assert!((excess - 2.0).abs() < 0.4, "{excess}");
    assert_eq!(elsewhere(&told, &["frequency"]), []);
}

/// If there is no gap, a slice is significant in at most 5 % of the recordings. The number is smaller, because
/// slices depend on each other. Of 60 recordings, the test allows the number that a binomial count exceeds once in
/// a thousand.
#[test]
fn nothing_stands_out_of_noise() {
    let alarms = (0..60)
        .filter(|seed| {
            let told = told(&disturbed(300 + seed, 0.0, |_, _, _| false));
            assert!(!told.location.slices.is_empty());
            told.location.slices.iter().any(|s| s.stands_out)
        })
        .count();
    assert!(alarms <= binomial_bound(60, 0.05, 0.001), "{alarms} of 60");
}

/// On each axis that divides all samples, the shares of the slices sum to 1.
#[test]
fn shares_of_slices_sum_to_the_gap() {
    let told = told(&disturbed(6, 0.03, |_, x, _| x > 0.3));
    for by in ["level", "time", "session", "travel", "trial", "frequency", "regime"] {
        let shares = told.location.slices.iter().filter(|s| s.by == by).map(|s| s.share);
        let sum: f64 = shares.sum();
        assert!((sum - 1.0).abs() < 1e-9, "{by}: {sum}");
    }
    for s in &told.location.slices {
        assert!(s.excess_ci[0] <= s.excess_ci[1], "{s:?}");
        assert!(!s.stands_out || (s.excess > 0.0 && s.excess_ci[0] > 0.0), "{s:?}");
    }
}

/// A lag drives a line. The line is driven by the measured output of the lag, including its noise.
/// In the chain the output of the lag is not measured: its noise, one variance, is missing in
/// addition to its gap, and passes a line of gain 1 unchanged. With gaps e of the two, in variances
/// of the noise, the share of the lag is (1 + e_0)/(1 + e_0 + e_1).
fn end_to_end(wrong: usize, size: f64) -> ([f64; 2], [f64; 2]) {
    let mut toy = Toy::of(&[Law::Lag, Law::Line]);
    toy.hidden = vec![(wrong, Effect::Cubic, vec![size])];
    let told = told(&toy.measured(7));
    let ends: Vec<f64> = told.location.end_to_end.iter().map(|s| s.share).collect();
    let gaps: Vec<f64> = told.location.stages.iter().map(|s| s.excess.max(0.0)).collect();
    ([gaps[0], gaps[1]], [ends[0], ends[1]])
}

#[test]
fn a_gap_has_the_stage_that_makes_it() {
    for (wrong, other) in [(0, 1), (1, 0)] {
        let (gaps, ends) = end_to_end(wrong, 0.3);
        assert!(gaps[wrong] > 4.0 && gaps[other] < 0.2, "{gaps:?}");
        assert!((ends[0] + ends[1] - 1.0).abs() < 1e-9, "{ends:?}");
        let expected = (1.0 + gaps[0]) / (1.0 + gaps[0] + gaps[1]);
        // Noise and gap are independent. The mean of twice their product over 1000 tested samples has the standard
        // deviation 2 sqrt(e/1000) variances, which is 0.03 of the whole. The tolerance is two of these.
        assert!((ends[0] - expected).abs() < 0.06, "{wrong}: {ends:?} for {expected}");
    }
}

/// If there is no gap, the chain lacks only the noise that drives the line.
#[test]
fn noise_that_drives_a_stage_is_that_of_the_stage_before() {
    let (gaps, ends) = end_to_end(0, 0.0);
    assert!(gaps.iter().all(|e| *e < 0.2), "{gaps:?}");
    // Over 1000 samples, twice the product of two noises has the standard deviation 2/sqrt(1000) = 0.06 variances, and
    // a mean square 0.045. The tolerance is three of these.
    assert!(ends[0] > 0.8, "{ends:?}");
}

/// After the named effect is removed, only noise is left. Without it, a cubic leaves a gap at the ends of the range.
#[test]
fn the_residual_after_a_named_effect_is_noise() {
    let toy = Toy::of(&[Law::Line]).may_lack(&Effect::ALL).hiding(&[(Effect::Cubic, &[0.4])]);
    let (told, evidence) = evidenced(&toy.measured(9), &Options::default());
    assert_eq!(told.named(), ["cubic"]);
    let stage = &evidence.stages[0];
    // The mean square of 1000 tested samples has the standard deviation sqrt(2/1000) = 0.045. The tolerance is four of
    // these.
    assert!(
        stage.excess_after.abs() < 0.18 && stage.excess_retuned > 1.0,
        "{}",
        stage.excess_after
    );
    let rms = (stage.residual_after.iter().map(|r| r * r).sum::<f64>() / 4000.0).sqrt();
    assert!((rms - 1.0).abs() < 0.05, "{rms}");
}

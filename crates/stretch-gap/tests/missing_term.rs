//! Tests whether a term that no catalogue contains is found again for a gauge, and whether random residuals are called
//! random.

use crate::gauge::{Gauge, JITTER_S, Lack, RANGE_MM};
use approx::assert_relative_eq;
use stretch_gap::{Course, Factor, Options, Passage, Proposed, RateForm, VerdictKind, diagnose};
use testkit::tolerance::{F64_ROUNDING, PLANTED_TERM, RESCALED};

fn proposed(gauge: &Gauge) -> Proposed {
    let (diagnosis, _) =
        diagnose(gauge, &Options::default(), &|_| (), &|| false).expect("a diagnosis");
    assert_eq!(diagnosis.verdict(), VerdictKind::Unknown, "{}", diagnosis.sentence);
    let proposed = diagnosis.proposed.expect("an unknown gap is asked what it may be");
    assert!(diagnosis.sentence.contains(&proposed.sentence), "{}", diagnosis.sentence);
    proposed
}

#[test]
fn a_planted_play_is_found_again() {
    let found = proposed(&Gauge::lacking(Lack::Play, 1));
    let first = &found.terms[0];
    let (scale, [Factor::Play { width, .. }]) = (found.signals[0].scale, &first.form.factors[..])
    else {
        panic!("{}", found.equation)
    };
    // The term has 0.1 V per range of the rod and a half-width of 0.1 ranges. The proposal's scale is the fitted range.
    let range = scale / RANGE_MM;
    assert_relative_eq!(width * range, 0.1, epsilon = 0.0, max_relative = PLANTED_TERM);
    assert_relative_eq!(first.coefficient, 0.1 * range, epsilon = 0.0, max_relative = PLANTED_TERM);
    assert!(found.closes_test > 0.95 && found.closes_held > 0.95, "{found:?}");
    assert_eq!((found.acts.as_str(), found.random), ("output of gauge", false));
}

#[test]
fn planted_warming_is_found_again() {
    let found = proposed(&Gauge::lacking(Lack::Warming, 0));
    let first = &found.terms[0];
    assert_eq!(first.form.factors, [Factor::Rate { signal: 0, form: RateForm::Square }]);
    let Passage::Lag { tau_s } = first.form.passage else { panic!("{}", found.equation) };
    assert_relative_eq!(tau_s, 2.0, epsilon = 0.0, max_relative = PLANTED_TERM);
    // 0.02 V at a rate of half a range per second.
    let rate = found.signals[0].rate_per_s * found.signals[0].scale / RANGE_MM;
    let expected = 0.02 * (rate / 0.5).powi(2);
    assert_relative_eq!(first.coefficient, expected, epsilon = 0.0, max_relative = PLANTED_TERM);
}

/// The lag is slower than a trial of 40 s is long, of which 28 s are fitted.
#[test]
fn no_time_constant_is_longer_than_the_recording() {
    let found = proposed(&Gauge::lacking(Lack::Settling, 0));
    let [Factor::Lag { tau_s, .. }] = found.terms[0].form.factors[..] else {
        panic!("{}", found.equation)
    };
    assert!(tau_s > 28.0 && tau_s <= 40.0, "{}", found.equation);
    let words = "s is longer than the 28 s that were fitted of the longest recording, so the cause may also be a drift or an integral.";
    assert!(found.sentence.contains(words), "{}", found.sentence);
}

#[test]
fn what_switches_jumps_or_wanders_on_its_own_is_random_in_time() {
    for lack in [Lack::White, Lack::Telegraph, Lack::Jumps, Lack::SlowDrift] {
        let found = proposed(&Gauge::lacking(lack, 2));
        assert!(found.random && found.terms.is_empty(), "{lack:?}: {}", found.equation);
        assert!(found.sentence.contains("No term that was tried"), "{}", found.sentence);
        assert!(
            !matches!(found.course, Some(Course::Jitters { .. })),
            "{lack:?}: {:?}",
            found.course
        );
    }
}

#[test]
fn time_stamps_that_jitter_are_told_with_their_size() {
    for seed in 0..4 {
        let found = proposed(&Gauge::lacking(Lack::Jitter, seed));
        assert!(found.random && found.terms.is_empty(), "{seed}: {}", found.equation);
        let Some(Course::Jitters { sd_s }) = found.course else {
            panic!("{seed}: {:?}", found.course)
        };
        // Some thousands of samples determine a variance to 5 %.
        assert!((sd_s / JITTER_S - 1.0).abs() < 0.1, "{seed}: {sd_s} s");
        assert!(found.sentence.contains("time stamps jitter by about"), "{}", found.sentence);
    }
}

/// In metres and millivolts instead of millimetres and volts, the same terms are proposed, with coefficients in the
/// other unit.
#[test]
fn terms_do_not_depend_on_units() {
    let plain = Gauge::lacking(Lack::Product, 3);
    let [one, other] = [&plain, &plain.scaled(1e-3, 1e3)].map(proposed);
    assert_eq!(one.terms.len(), other.terms.len());
    for (a, b) in one.terms.iter().zip(&other.terms) {
        assert_eq!(a.name, b.name);
        assert_relative_eq!(
            1e3 * a.coefficient,
            b.coefficient,
            epsilon = 0.0,
            max_relative = RESCALED
        );
    }
}

/// Other values in the test trial change only the share that the proposal closes there.
#[test]
fn nothing_is_chosen_or_fitted_by_test_samples() {
    let plain = Gauge::lacking(Lack::Product, 4);
    let [one, other] = [&plain, &plain.with_another_test_trial()].map(proposed);
    assert_eq!((&one.equation, &one.signals), (&other.equation, &other.signals));
    for (a, b) in one.terms.iter().zip(&other.terms) {
        assert_relative_eq!(
            a.coefficient,
            b.coefficient,
            epsilon = 0.0,
            max_relative = F64_ROUNDING
        );
    }
    assert_eq!(one.closes_held, other.closes_held);
    assert!(one.closes_test > other.closes_test + 0.1, "{} {}", one.closes_test, other.closes_test);
}

#[test]
fn a_proposal_can_be_written_and_read_back() {
    let found = proposed(&Gauge::lacking(Lack::Play, 1));
    let text = serde_json::to_string(&found).expect("written");
    let back: Proposed = serde_json::from_str(&text).expect("read");
    assert_eq!(back.terms[0].form, found.terms[0].form);
    assert_eq!(back.equation, found.equation);
}

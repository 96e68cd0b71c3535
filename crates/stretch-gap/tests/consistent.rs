//! Checks that hold for every diagnosis: probabilities, lists, shares and the sentence agree with each other.

use crate::toys::Measured;
use std::collections::BTreeSet;
use stretch_gap::{Diagnosis, Evidence, Options, VerdictKind};

/// Diagnoses a recording and checks that the diagnosis is consistent.
pub(crate) fn told(measured: &Measured) -> Diagnosis {
    evidenced(measured, &Options::default()).0
}

/// Like `told`, and also returns the evidence.
pub(crate) fn evidenced(measured: &Measured, options: &Options) -> (Diagnosis, Evidence) {
    let (diagnosis, evidence) = measured.diagnosed_by(options);
    assert_consistent(&diagnosis, measured);
    assert_eq!(evidence.candidates.len() + 1, diagnosis.candidates.len(), "one model for each set");
    (diagnosis, evidence)
}

pub(crate) fn assert_consistent(told: &Diagnosis, measured: &Measured) {
    assert_probabilities(told);
    assert_lists(told);
    assert_covering(told);
    assert_numbers(told);
    assert_sentence(told, measured);
}

/// The probabilities, including that of a cause outside the catalogue, sum to one.
fn assert_probabilities(told: &Diagnosis) {
    let sum: f64 = told.candidates.iter().map(|c| c.probability).sum();
    assert!((sum - 1.0).abs() < 1e-9, "{sum}");
    let (unknown, sets) = told.candidates.split_last().expect("`unknown` is always there");
    assert_eq!(unknown.effects, ["unknown"]);
    let of_effects = sets.iter().filter(|c| !c.effects.is_empty()).collect::<Vec<_>>();
    for pair in of_effects.windows(2) {
        assert!(pair[0].probability >= pair[1].probability, "{pair:?}");
    }
    // The probabilities that the calibration of thresholds recomputes are those of the diagnosis.
    let again = told.probabilities(&stretch_gap::Thresholds::frozen());
    for (candidate, p) in told.candidates.iter().zip(again) {
        assert!((candidate.probability - p).abs() < 1e-9, "{p}: {candidate:?}");
    }
    let different: BTreeSet<BTreeSet<&String>> =
        sets.iter().map(|c| c.effects.iter().collect()).collect();
    assert_eq!(different.len(), sets.len(), "a set stands there twice: {sets:?}");
}

/// Only the verdicts `effect` and `partial` have names. No effect is in two of the lists named, tied and faint. Named
/// and faint effects belong to the first set.
fn assert_lists(told: &Diagnosis) {
    let names = matches!(told.verdict(), VerdictKind::Effect | VerdictKind::Partial);
    assert_eq!(names, !told.named().is_empty(), "{:?} names {:?}", told.verdict(), told.named());
    assert!(names || told.answer.tied().is_empty(), "{told:?}");
    let first = told.candidates.iter().find(|c| !c.effects.is_empty()).expect("`unknown` at least");
    for name in told.named().iter().chain(told.answer.faint()) {
        assert!(first.effects.contains(name), "{name} is not of {:?}", first.effects);
        assert!(!told.answer.tied().contains(name), "{name} is named and tied with a name");
    }
    assert!(told.named().iter().all(|name| !told.answer.faint().contains(name)));
    let tells = matches!(told.verdict(), VerdictKind::Partial | VerdictKind::Unknown);
    assert!(tells || told.proposed.is_none());
    assert_eq!(told.answer.unexplained().is_some(), told.verdict() == VerdictKind::Partial);
    assert_eq!(!told.answer.gross().is_empty(), told.verdict() == VerdictKind::Record);
    if names {
        assert!(first.is_confirmed && first.closed > 0.0, "{first:?}");
    }
}

/// The 95 % set is the smallest possible: its sets have 95 % of the probability of all sets of the catalogue, and
/// without its last set they would have less.
fn assert_covering(told: &Diagnosis) {
    if told.ambiguous.is_empty() {
        return;
    }
    let (unknown, sets) = told.candidates.split_last().expect("`unknown` is always there");
    let of_catalogue = 1.0 - unknown.probability;
    let (mut sum, mut names) = (0.0, BTreeSet::new());
    for candidate in sets {
        if sum >= 0.95 {
            break;
        }
        sum += candidate.probability / of_catalogue;
        names.extend(&candidate.effects);
    }
    let ambiguous: BTreeSet<&String> = told.ambiguous.iter().collect();
    assert_eq!(ambiguous, names);
    assert_eq!(ambiguous.len(), told.ambiguous.len(), "a name stands there twice");
    assert!(told.named().iter().all(|name| told.ambiguous.contains(name)));
}

/// Shares are between 0 and 1, intervals contain their values, and no number is NaN.
fn assert_numbers(told: &Diagnosis) {
    for c in &told.candidates {
        assert!(c.closed <= 1.0 && c.closed_ci[0] <= c.closed_ci[1], "{c:?}");
        assert!(c.gap_before >= 0.0 && c.gap_after >= 0.0, "{c:?}");
        for value in &c.parameters {
            assert!(
                value.interval[0] <= value.value && value.value <= value.interval[1],
                "{value:?}"
            );
        }
    }
    let stages: f64 = told.location.stages.iter().map(|s| s.share).sum();
    assert!(stages.abs() < 1e-9 || (stages - 1.0).abs() < 1e-9, "{stages}");
    assert!(told.location.slices.iter().all(|s| (0.0..=1.0 + 1e-9).contains(&s.share)));
    let gap = told.gap;
    assert!([gap.raw, gap.retuned, gap.left].iter().all(|g| g.is_finite() && *g >= 0.0), "{gap:?}");
    assert!(told.shares.windows(2).all(|pair| pair[0].closes >= pair[1].closes));
    for p in &told.parameters {
        assert!(p.sigmas.abs() <= 3.0 + 1e-9, "three tolerances are all: {p:?}");
    }
    // serde_json writes null for numbers that are not finite and for missing values. Therefore no key may be null,
    // except the optional ones.
    let optional = ["unexplained", "proposed", "gross", "transfer", "next_experiment"];
    let mut json = serde_json::to_value(told).expect("written");
    let object = json.as_object_mut().expect("an object");
    optional.iter().for_each(|key| drop(object.remove(*key)));
    object["identifiability"] = serde_json::Value::Null;
    // the number of values of an error depends on its kind
    object["answer"].as_object_mut().expect("an answer").remove("errors");
    let null = object.iter().find(|(key, value)| *key != "identifiability" && holds_null(value));
    assert_eq!(null, None);
}

fn holds_null(value: &serde_json::Value) -> bool {
    match value {
        serde_json::Value::Null => true,
        serde_json::Value::Array(all) => all.iter().any(holds_null),
        serde_json::Value::Object(all) => all.values().any(holds_null),
        _ => false,
    }
}

/// The sentence uses only the names in the lists, and every share in it is listed.
fn assert_sentence(told: &Diagnosis, measured: &Measured) {
    let sentence = &told.sentence;
    let says = |name: &str| {
        let is_letter = |c: char| c.is_alphanumeric() || c == '_';
        sentence.split(|c| !is_letter(c)).any(|word| word == name)
    };
    assert!(told.named().iter().all(|name| says(name)), "{:?}: {sentence}", told.named());
    assert!(
        told.answer.tied().iter().all(|name| says(name)),
        "{:?}: {sentence}",
        told.answer.tied()
    );
    if matches!(told.verdict(), VerdictKind::Effect | VerdictKind::NoGap | VerdictKind::Parameters)
    {
        let listed = |name: &String| {
            told.named().contains(name)
                || told.answer.tied().contains(name)
                || told.answer.faint().contains(name)
        };
        for effect in &measured.toy.catalogue {
            let name = crate::toys::Toy::name(effect.0, effect.1);
            assert!(listed(&name) || !says(&name), "{name} is in no list: {sentence}");
        }
    }
    for share in shares(sentence) {
        assert!((0.0..=100.0).contains(&share), "{share} %: {sentence}");
    }
    assert!(sentence.ends_with(['.', '?']) && !sentence.contains("NaN"), "{sentence}");
}

/// Every number before a `%`.
fn shares(sentence: &str) -> Vec<f64> {
    let before = sentence.split('%').map(str::trim_end);
    let last = |part: &str| part.rsplit([' ', '(']).next().and_then(|word| word.parse().ok());
    let count = sentence.matches('%').count();
    before.take(count).filter_map(last).collect()
}

#[test]
fn shares_of_a_sentence_are_read() {
    let told = "It closes 99 % of the gap (-3 to 104 %) on trials; below 1 %.";
    assert_eq!(shares(told), [99.0, 104.0, 1.0]);
}

//! Tests of the score with labels and verdicts written by hand. All expected values are computed by
//! hand.

use approx::assert_relative_eq;
use std::collections::BTreeMap;
use testkit::tolerance::F64_ROUNDING;

use stretch_blind::{BlindError, CaseKind, Family, Label, Rate, Score, Stage, Truth, Verdict};

fn label(kind: CaseKind, effects: &[(&str, Stage)], excess: f64) -> Label {
    let first = effects.first().map(|e| e.0.to_owned());
    Label {
        kind,
        effects: effects.iter().map(|e| e.0.to_owned()).collect(),
        stages: effects.iter().map(|e| e.1).collect(),
        pressure_column: true,
        excess,
        struck: first.clone().filter(|_| kind == CaseKind::Struck),
        dominant: first.filter(|_| kind == CaseKind::Dominant),
        family: Family::Written,
        acting: Vec::new(),
        parameters: BTreeMap::new(),
        disturbances: BTreeMap::new(),
    }
}

fn verdict(case: &str, verdict: &str, named: &[&str], set: &[&str], p: f64) -> Verdict {
    let own = |list: &[&str]| list.iter().map(|s| (*s).to_owned()).collect::<Vec<_>>();
    Verdict {
        case: case.into(),
        verdict: verdict.into(),
        named: own(named),
        ambiguous: own(set),
        tied: Vec::new(),
        candidates: vec![(own(named), p)],
        stage: Some("sensing".into()),
        runtime_s: 2.0,
    }
}

fn truth(labels: &[(&str, Label)]) -> Truth {
    let cases = labels.iter().map(|(case, label)| ((*case).to_owned(), label.clone())).collect();
    Truth { schema: 1, seed: None, cases }
}

fn rate(hits: usize, cases: usize) -> Rate {
    Rate { hits, cases }
}

#[test]
fn singles_are_scored_by_strength() {
    let slip = ("sleeve_slip", Stage::Sensing);
    let hum = ("mains_hum", Stage::Sensing);
    let single = |effect, excess| label(CaseKind::Single, &[effect], excess);
    let truth = truth(&[
        ("a", single(slip, 20.0)),
        ("b", single(slip, 2.0)),
        ("c", single(hum, 0.5)),
        ("d", single(hum, 0.05)),
        ("e", single(("leak", Stage::Pneumatics), 5.0)),
    ]);
    let verdicts = [
        verdict("a", "effect", &["sleeve_slip"], &["sleeve_slip"], 0.97),
        verdict("b", "effect", &["gauge_hysteresis"], &["gauge_hysteresis", "sleeve_slip"], 0.6),
        verdict("c", "no_gap", &[], &[], 0.0),
        verdict("d", "no_gap", &[], &[], 0.0),
        verdict("e", "unknown", &["leak"], &["leak"], 0.5),
    ];
    let score = Score::of(&truth, &verdicts).expect("matching cases");
    let s = &score.singles;
    assert_eq!(s.top1, rate(1, 4));
    assert_eq!(s.top1_above_10, rate(1, 1));
    // The leak was assigned to the stage `sensing`, and the hum was not found.
    assert_eq!(s.stage, rate(2, 4));
    assert_eq!(s.set_covers, rate(3, 3));
    let size = s.set_size.expect("sets");
    assert_relative_eq!(size, 4.0 / 3.0, epsilon = 0.0, max_relative = F64_ROUNDING);
    assert_eq!(s.false_unknown, rate(1, 4));
    assert_eq!(score.by_effect["sleeve_slip"], rate(1, 2));
    // The faint case is not an error.
    let missed: Vec<&str> = score.misses.iter().map(|m| m.case.as_str()).collect();
    assert_eq!(missed, ["b", "c", "e"]);
    // |0.97 - 1|, |0.6 - 0|, |0 - 0|, |0.5 - 1| over four cases.
    let ece = score.calibration.ece.expect("candidates");
    assert_relative_eq!(
        ece,
        (0.03 + 0.6 + 0.0 + 0.5) / 4.0,
        epsilon = 0.0,
        max_relative = F64_ROUNDING
    );
    assert_eq!(score.runtime_s, Some((2.0, 2.0, 2.0)));
}

#[test]
fn nulls_foreign_and_struck_cases_have_their_own_right_answers() {
    let slip = ("sleeve_slip", Stage::Sensing);
    let droop = ("coil_droop", Stage::Sensing);
    let truth = truth(&[
        ("n1", label(CaseKind::Null, &[], 0.0)),
        ("n2", label(CaseKind::Null, &[], 0.0)),
        ("n3", label(CaseKind::Null, &[], 0.0)),
        ("o1", label(CaseKind::OutOfCatalogue, &[droop], 3.0)),
        ("o2", label(CaseKind::OutOfCatalogue, &[droop], 3.0)),
        ("s1", label(CaseKind::Struck, &[slip], 3.0)),
        ("s2", label(CaseKind::Struck, &[("mains_hum", Stage::Sensing)], 3.0)),
        ("s3", label(CaseKind::Struck, &[("mains_hum", Stage::Sensing)], 3.0)),
        ("z", label(CaseKind::Null, &[], 0.0)),
    ]);
    let verdicts = [
        verdict("n1", "no_gap", &[], &[], 0.0),
        verdict("n2", "parameters", &[], &[], 0.0),
        verdict("n3", "effect", &["thermal_drift"], &["thermal_drift"], 0.9),
        verdict("o1", "unknown", &[], &[], 0.3),
        verdict("o2", "effect", &["leak"], &["leak"], 0.9),
        verdict("s1", "effect", &["gauge_hysteresis"], &["gauge_hysteresis"], 0.9),
        verdict("s2", "unknown", &[], &[], 0.4),
        verdict("s3", "effect", &["leak"], &["leak"], 0.4),
    ];
    let score = Score::of(&truth, &verdicts).expect("matching cases");
    assert_eq!(score.false_alarms, rate(1, 3));
    assert_eq!(score.foreign_caught, rate(1, 2));
    assert_eq!(score.struck_unknown, rate(1, 2));
    assert_eq!(score.unanswered, ["z"]);
    let missed: Vec<&str> = score.misses.iter().map(|m| m.case.as_str()).collect();
    assert_eq!(missed, ["n3", "o2", "s3"]);
}

#[test]
fn several_effects_are_scored_by_how_many_are_named() {
    let (leak, hum) = (("leak", Stage::Pneumatics), ("mains_hum", Stage::Sensing));
    let truth = truth(&[
        ("a", label(CaseKind::Compound, &[leak, hum], 9.0)),
        ("b", label(CaseKind::Compound, &[hum, leak], 9.0)),
        ("c", label(CaseKind::Dominant, &[hum, leak], 9.0)),
    ]);
    let verdicts = [
        verdict("a", "effect", &["mains_hum", "leak"], &["mains_hum", "leak"], 0.9),
        verdict("b", "effect", &["mains_hum", "sleeve_slip"], &["mains_hum"], 0.9),
        verdict("c", "effect", &["mains_hum"], &["mains_hum"], 0.9),
    ];
    let score = Score::of(&truth, &verdicts).expect("matching cases");
    assert_eq!(score.compounds.all_named, rate(1, 2));
    assert_eq!(score.compounds.one_named, rate(2, 2));
    assert_eq!(score.dominant_named, rate(1, 1));
    assert_eq!(score.misses.len(), 1);
}

#[test]
fn stray_and_repeated_verdicts_are_refused() {
    let truth = truth(&[("a", label(CaseKind::Null, &[], 0.0))]);
    let is_of = |reason: &'static str| move |e: BlindError| e.to_string().ends_with(reason);
    let quiet = verdict("a", "no_gap", &[], &[], 0.0);
    let twice = Score::of(&truth, &[quiet.clone(), quiet]);
    assert!(twice.is_err_and(is_of("it is answered twice")));
    let stray = Score::of(&truth, &[verdict("b", "no_gap", &[], &[], 0.0)]);
    assert!(stray.is_err_and(is_of("it is not among the sealed cases")));
    let empty = Score::of(&truth, &[]).expect("no verdict at all");
    assert_eq!((empty.singles.top1.share(), empty.unanswered.len()), (None, 1));
}

#[test]
fn a_declared_tie_that_holds_the_truth_is_right_and_an_undeclared_one_wrong() {
    let slack = ("sleeve_slack", Stage::Sensing);
    let leak = ("leak", Stage::Pneumatics);
    let truth = truth(&[
        ("a", label(CaseKind::Single, &[slack], 20.0)),
        ("b", label(CaseKind::Single, &[slack], 20.0)),
        ("c", label(CaseKind::Single, &[slack], 20.0)),
        ("d", label(CaseKind::Compound, &[slack, leak], 20.0)),
    ]);
    let own = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
    let tie = |case, named: &[&str], tied: &[&str]| Verdict {
        tied: own(tied),
        candidates: vec![(own(&named[..1]), 0.5), (own(tied), 0.4)],
        ..verdict(case, "effect", named, &["amplifier_saturation", "sleeve_slack"], 0.5)
    };
    let verdicts = [
        tie("a", &["amplifier_saturation"], &["sleeve_slack"]),
        tie("b", &["amplifier_saturation"], &["channel_skew"]),
        tie("c", &["sleeve_slack", "leak"], &["amplifier_saturation"]),
        tie("d", &["amplifier_saturation", "leak"], &["sleeve_slack"]),
    ];
    let score = Score::of(&truth, &verdicts).expect("matching cases");
    let s = &score.singles;
    assert_eq!((s.top1, s.exact), (rate(2, 3), rate(1, 3)));
    assert_eq!(score.compounds.all_named, rate(1, 1));
    // The tie "A or B" has the probability 0.9; it is right in case a and wrong in case b. Case c
    // names two effects, the first with 0.5.
    let ece = score.calibration.ece.expect("candidates");
    assert_relative_eq!(ece, (2.0 * 0.4 + 0.5) / 3.0, epsilon = 0.0, max_relative = F64_ROUNDING);
    let missed: Vec<&str> = score.misses.iter().map(|m| m.case.as_str()).collect();
    assert_eq!(missed, ["b", "c"]);
}

#[test]
fn a_partial_is_held_to_its_names_and_a_record_is_no_answer() {
    let slip = ("sleeve_slip", Stage::Sensing);
    let truth = truth(&[
        ("a", label(CaseKind::Single, &[slip], 20.0)),
        ("b", label(CaseKind::Single, &[slip], 20.0)),
        ("c", label(CaseKind::Single, &[slip], 20.0)),
        ("n", label(CaseKind::Null, &[], 0.0)),
        ("o", label(CaseKind::OutOfCatalogue, &[("coil_droop", Stage::Sensing)], 3.0)),
        ("u", label(CaseKind::OutOfCatalogue, &[("coil_droop", Stage::Sensing)], 3.0)),
    ]);
    let verdicts = [
        verdict("a", "partial", &["sleeve_slip"], &["sleeve_slip"], 0.9),
        verdict("b", "partial", &["sleeve_slip", "leak"], &["sleeve_slip"], 0.9),
        verdict("c", "record", &[], &[], 0.9),
        verdict("n", "record", &[], &[], 0.0),
        verdict("o", "partial", &["leak"], &["leak"], 0.9),
        verdict("u", "unknown", &[], &[], 0.0),
    ];
    let score = Score::of(&truth, &verdicts).expect("matching cases");
    let s = &score.singles;
    assert_eq!((s.exact, s.top1), (rate(1, 3), rate(2, 3)));
    assert_eq!(score.false_alarms, rate(1, 1));
    assert_eq!((score.foreign_caught, score.foreign_named), (rate(1, 2), rate(1, 2)));
}

#[test]
fn families_have_figures() {
    let slip = ("sleeve_slip", Stage::Sensing);
    let of = |family| Label { family, ..label(CaseKind::Single, &[slip], 20.0) };
    let truth = truth(&[("a", of(Family::Splines)), ("b", of(Family::Spectra))]);
    let right = |case| verdict(case, "effect", &["sleeve_slip"], &["sleeve_slip"], 1.0);
    let wrong = |case| verdict(case, "effect", &["leak"], &["leak"], 1.0);
    let score = Score::of(&truth, &[right("a"), wrong("b")]).expect("matching cases");
    assert_eq!(score.singles.exact, rate(1, 2));
    assert_eq!(score.by_family[&Family::Splines], rate(1, 1));
    assert_eq!(score.by_family[&Family::Spectra], rate(0, 1));
    let json = serde_json::to_string(&score).expect("JSON");
    assert_eq!(serde_json::from_str::<Score>(&json).expect("read back"), score);
}

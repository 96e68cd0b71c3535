//! Tests of open sets: the files of a set, the requirements on a submission, and its score.

use std::{fs, path::Path, sync::OnceLock};

use stretch_blind::{
    Answer, Believed, BlindError, Figures, FormFamily, Interval, Level, OpenScore, OpenTruth,
    PlantName, Said, Submission, make_set, sealed_beside,
};

const CASES: usize = 10;

fn set(dir: &Path, plant: PlantName, seed: u64) -> (OpenTruth, String) {
    let folder = dir.join("set");
    make_set(plant, (&folder, &sealed_beside(&folder)), CASES, seed, None).expect("a set");
    OpenTruth::open(&folder).expect("its labels")
}

/// A submission that gives the probability `p` to the true hypothesis of each case, and the rest to
/// a wrong one.
fn oracle(truth: &OpenTruth, hash: &str, p: f64) -> Submission {
    let answer = |label: &stretch_blind::OpenLabel| {
        let (effects, verdict) = match label.level {
            Level::Nothing => (Vec::new(), Said::Nothing),
            Level::Foreign => (vec!["unknown".to_owned()], Said::Unknown),
            _ => (label.effects.clone(), Said::Effect),
        };
        let other = if effects.is_empty() { vec!["unknown".to_owned()] } else { Vec::new() };
        let believed = |effects, probability| Believed { effects, probability };
        Answer {
            probabilities: vec![believed(effects, p), believed(other, 1.0 - p)],
            verdict,
            named: None,
            tied: Vec::new(),
            place: label.places.first().cloned(),
            closed_share: label.oracle_closed,
            seconds: 1.0,
            simulations: 10,
        }
    };
    Submission {
        schema: 1,
        method: "oracle".to_owned(),
        setup: String::new(),
        set: hash.to_owned(),
        cases: truth.cases.iter().map(|(name, label)| (name.clone(), answer(label))).collect(),
    }
}

fn figure(figures: &Figures, name: &str) -> Interval {
    figures.rows.iter().find(|row| row.0 == name).expect("a figure").1
}

#[test]
fn labels_stand_apart_and_levels_come_in_turn() {
    let dir = tempfile::tempdir().expect("a folder");
    let (truth, hash) = set(dir.path(), PlantName::Thermal, 5);
    let count = |level| truth.cases.values().filter(|c| c.level == level).count();
    assert!(Level::ALL.into_iter().all(|level| count(level) == 2));
    for label in truth.cases.values() {
        let range = match label.level {
            Level::Nothing => 0.0..=0.0,
            Level::Faint => 0.05..=1.5,
            // two effects may partly compensate each other
            _ => 0.5..=400.0,
        };
        assert!(range.contains(&label.excess), "{label:?}");
    }
    // no file of the set contains the name of a missing effect, except the lists of candidates
    let problems: Vec<String> = truth
        .cases
        .keys()
        .map(|c| {
            fs::read_to_string(dir.path().join("set").join(c).join("problem.toml"))
                .expect("a problem")
        })
        .map(|text| text.lines().skip(1).collect::<Vec<_>>().join("\n"))
        .collect();
    assert!(problems.windows(2).all(|w| w[0] == w[1]));
    let again = tempfile::tempdir().expect("a folder");
    assert_eq!(set(again.path(), PlantName::Thermal, 5).1, hash, "same seed, same labels");
    assert_ne!(set(tempfile::tempdir().expect("a folder").path(), PlantName::Thermal, 6).1, hash);
}

#[test]
fn the_rig_has_the_same_layout() {
    let dir = tempfile::tempdir().expect("a folder");
    let (truth, _) = set(dir.path(), PlantName::Rig, 5);
    assert_eq!(truth.candidates.len(), 23);
    let problem =
        fs::read_to_string(dir.path().join("set/case-000/problem.toml")).expect("a problem");
    assert!(problem.contains("builtin = \"rig\""));
    assert!(!dir.path().join("set/sealed").exists(), "labels stand beside the set");
}

#[test]
fn an_altered_label_breaks_the_seal() {
    let dir = tempfile::tempdir().expect("a folder");
    set(dir.path(), PlantName::Servo, 5);
    let folder = dir.path().join("set");
    let labels = sealed_beside(&folder).join("truth.json");
    let text = fs::read_to_string(&labels).expect("labels").replace("friction", "drag");
    fs::write(&labels, text).expect("altered");
    assert!(matches!(OpenTruth::open(&folder), Err(BlindError::SealBroken { .. })));
}

#[test]
fn the_oracle_has_every_point_and_a_guess_does_not() {
    let dir = tempfile::tempdir().expect("a folder");
    let (truth, hash) = set(dir.path(), PlantName::Servo, 5);
    let score = OpenScore::of(&oracle(&truth, &hash, 0.9), &truth, &hash).expect("a score");
    let figures = Figures::of(&score.outcomes);
    assert_eq!((figure(&figures, "exact").value, figure(&figures, "exact").low), (Some(1.0), 1.0));
    assert_eq!(figure(&figures, "nulls alarmed").value, Some(0.0));
    assert_eq!(figure(&figures, "closed, of oracle").value, Some(1.0));
    // ten answers with probability 0.9 are all correct: the calibration error is 0.1, the logarithmic
    // score -ln 0.9
    assert!((figure(&figures, "calibration error").value.expect("cases") - 0.1).abs() < 1e-12);
    assert!(
        (figure(&figures, "log score, nats").value.expect("cases") + 0.9f64.ln()).abs() < 1e-12
    );
    let mut guess = oracle(&truth, &hash, 0.9);
    for answer in guess.cases.values_mut() {
        answer.probabilities =
            vec![Believed { effects: vec!["friction".to_owned()], probability: 1.0 }];
        answer.verdict = Said::Effect;
    }
    let figures = Figures::of(&OpenScore::of(&guess, &truth, &hash).expect("a score").outcomes);
    assert_eq!(figure(&figures, "nulls alarmed").value, Some(1.0));
    assert_eq!(figure(&figures, "foreign: named").value, Some(1.0));
    let right = truth.cases.values().filter(|c| c.effects == ["friction"]).count();
    assert_eq!(figure(&figures, "exact").value, Some(right as f64 / CASES as f64));
    // true hypotheses that the answer does not list have the probability 0
    let log_score = (CASES - right) as f64 * 1000f64.ln() / CASES as f64;
    assert!((figure(&figures, "log score, nats").value.expect("cases") - log_score).abs() < 1e-12);
    assert!(figure(&figures, "exact").low <= figure(&figures, "exact").value.expect("cases"));
}

/// Changes a valid submission and returns the resulting error.
fn refused(alter: impl FnOnce(&mut Submission)) -> String {
    static SET: OnceLock<(OpenTruth, String)> = OnceLock::new();
    let (truth, hash) = SET.get_or_init(|| {
        let dir = tempfile::tempdir().expect("a folder");
        set(dir.path(), PlantName::Servo, 5)
    });
    let mut submission = oracle(truth, hash, 0.5);
    alter(&mut submission);
    submission.check(truth, hash).expect_err("refused").to_string()
}

fn first(submission: &mut Submission) -> &mut Answer {
    submission.cases.get_mut("case-000").expect("a case")
}

#[test]
fn probabilities_that_do_not_sum_are_refused() {
    let error = refused(|s| first(s).probabilities[0].probability = 0.4);
    assert!(error.starts_with("cases.case-000.probabilities: they sum to 0.9"), "{error}");
}

#[test]
fn a_probability_out_of_range_is_refused() {
    let error = refused(|s| first(s).probabilities[1].probability = f64::NAN);
    assert!(error.starts_with("cases.case-000.probabilities[1].probability: NaN"), "{error}");
}

#[test]
fn an_unknown_name_is_refused() {
    let error = refused(|s| first(s).probabilities[0].effects = vec!["gremlin".to_owned()]);
    assert!(error.starts_with("cases.case-000.probabilities[0].effects: \"gremlin\""), "{error}");
}

#[test]
fn an_answer_given_twice_is_refused() {
    let error = refused(|s| {
        let again = first(s).probabilities[0].clone();
        first(s).probabilities[1] = again;
    });
    assert!(error.contains("probabilities[1].effects: they are there twice"), "{error}");
}

#[test]
fn a_name_or_tie_that_the_set_does_not_have_is_refused() {
    let error = refused(|s| first(s).named = Some(vec!["gremlin".to_owned()]));
    assert!(error.starts_with("cases.case-000.named: \"gremlin\""), "{error}");
    let error = refused(|s| first(s).tied = vec!["gremlin".to_owned()]);
    assert!(error.starts_with("cases.case-000.tied: \"gremlin\""), "{error}");
}

#[test]
fn a_declared_tie_counts_only_where_it_is_asked_for() {
    let dir = tempfile::tempdir().expect("a folder");
    let (truth, hash) = set(dir.path(), PlantName::Servo, 5);
    let mut submission = oracle(&truth, &hash, 0.9);
    let (name, label) = truth.cases.iter().find(|c| c.1.level == Level::Strong).expect("one");
    let other = truth.candidates.keys().find(|n| **n != label.effects[0]).expect("another");
    let answer = submission.cases.get_mut(name).expect("an answer");
    answer.named = Some(vec![other.clone()]);
    answer.tied = label.effects.clone();
    let figures =
        Figures::of(&OpenScore::of(&submission, &truth, &hash).expect("a score").outcomes);
    assert_eq!(
        (figure(&figures, "exact").value, figure(&figures, "exact or tied").value),
        (Some(0.9), Some(1.0))
    );
}

#[test]
fn a_missing_case_is_refused() {
    let error = refused(|s| drop(s.cases.remove("case-007")));
    assert!(error.starts_with("cases.case-007: it is missing"), "{error}");
}

#[test]
fn a_case_of_another_set_is_refused() {
    let error = refused(|s| {
        let answer = s.cases["case-000"].clone();
        s.cases.insert("case-999".to_owned(), answer);
    });
    assert!(error.starts_with("cases.case-999: the set has no such case"), "{error}");
}

#[test]
fn another_seed_is_refused() {
    let error = refused(|s| s.set = "0".repeat(64));
    assert!(error.starts_with("set: ") && error.contains("another seed"), "{error}");
}

#[test]
fn a_place_and_numbers_that_make_no_sense_are_refused() {
    let error = refused(|s| first(s).place = Some("moon".to_owned()));
    assert!(error.starts_with("cases.case-000.place: "), "{error}");
    let error = refused(|s| first(s).closed_share = 1.5);
    assert!(error.starts_with("cases.case-000.closed_share: "), "{error}");
    let error = refused(|s| first(s).seconds = -1.0);
    assert!(error.starts_with("cases.case-000.seconds: "), "{error}");
    assert!(refused(|s| s.schema = 2).starts_with("schema: "));
    assert!(refused(|s| s.method.clear()).starts_with("method: "));
}

#[test]
fn a_private_family_joins_the_published_ones() {
    let dir = tempfile::tempdir().expect("a folder");
    let mine = FormFamily {
        name: "mine".to_owned(),
        softness: (0.5, 0.9),
        asymmetry: (-0.4, 0.4),
        spread: (0.5, 0.9),
        colour: (0.5, 0.6),
    };
    let folder = dir.path().join("set");
    make_set(PlantName::Servo, (&folder, &sealed_beside(&folder)), 15, 5, Some(mine.clone()))
        .expect("a set");
    let (truth, _) = OpenTruth::open(&folder).expect("labels");
    let own: Vec<_> = truth.cases.values().filter(|c| c.family == "mine").collect();
    assert!(own.len() > 1 && own.len() < 12, "{}", own.len());
    let counted = own.iter().filter(|c| c.level != Level::Foreign).flat_map(|c| &c.forms);
    assert!(counted.clone().count() > 0 && counted.clone().all(|f| f.softness >= 0.5));
    let rig = make_set(
        PlantName::Rig,
        (&dir.path().join("rig"), &dir.path().join("labels")),
        5,
        5,
        Some(mine),
    );
    assert!(rig.expect_err("refused").to_string().starts_with("private: "));
}

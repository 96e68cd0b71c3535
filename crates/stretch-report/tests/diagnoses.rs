//! Reports of diagnoses of every kind, each built from values. The sentences are those that stretch-gap writes for such
//! answers.

use std::sync::{Arc, OnceLock};

use serde_json::{Value, from_value, json};
use stretch_data::{Channel, SessionTrial, Split, Trial};
use stretch_effects::{Extent, Quantity, Signals, kinds::BACKLASH};
use stretch_gap::{Answer, Diagnosis, Evidence, Options, Transfer, TransferError, VerdictKind};
use stretch_problem::{
    Ask, BlackBox, Checked, Implementation, Parameter, Problem, ProblemSpec, StageEntry, Tolerance,
    closure,
};
use stretch_report::{Subject, diagnosis_page, transfer_in_words};

use crate::support::{first_seconds, is_snapshot, section, text};

const SENTENCES: &str = include_str!("../../stretch-gap/src/verdict/tests/sentences.txt");
const ANSWERS: &str = include_str!("../../stretch-gap/src/verdict/tests/answers.json");
const SAMPLES: usize = 400;
const PLAY: &str = "lag.output.backlash";
const LOOP: &str = "lag.output.bouc_wen";

/// A line and a lag behind it, which differ from their recordings by noise only, and the evidence of their diagnosis.
fn line_and_lag() -> &'static (Problem, Evidence) {
    static GATHERED: OnceLock<(Problem, Evidence)> = OnceLock::new();
    GATHERED.get_or_init(|| {
        let stage = |name: &str, output: &str, input: &str| StageEntry {
            name: name.into(),
            output: output.into(),
            inputs: vec![input.into()],
            noise: Some(0.02),
            ..StageEntry::default()
        };
        let gain = Parameter {
            name: "gain".into(),
            value: 2.0,
            tolerance: Tolerance::Relative(0.05),
            stages: vec!["line".into()],
            ..Parameter::default()
        };
        let checked = Checked::new(ProblemSpec {
            stages: vec![stage("line", "y0_mm", "x_V"), stage("lag", "y1_mm", "y0_mm")],
            parameters: vec![gain],
            wrap: vec!["output.backlash".into()],
            trials: (0..2).map(trial).collect(),
            ..ProblemSpec::default()
        });
        let simulator = closure(|ask: &Ask<'_>| {
            let of = |trial| match ask.stage {
                0 => input(trial).iter().map(|x| ask.parameters[0] * x).collect(),
                _ => lagging(trial),
            };
            Ok((0..ask.trials).flat_map(of).collect())
        });
        let problem =
            Problem::from(BlackBox::new(checked.expect("a problem"), Arc::new(simulator)));
        let examined = problem.examine(&Options::default(), false, &|_| (), &|| false);
        let mut evidence = examined.expect("a diagnosis").evidence;
        evidence.responses = None;
        (problem, evidence)
    })
}

fn input(trial: usize) -> Vec<f64> {
    let at = |i: usize| (0.05 * i as f64 + trial as f64).sin() + (0.021 * i as f64).cos();
    (0..SAMPLES).map(at).collect()
}

fn lagging(trial: usize) -> Vec<f64> {
    let mut y = 0.0;
    let one = |x: f64| {
        y += 0.2 * (2.0 * x - y);
        y
    };
    input(trial).into_iter().map(one).collect()
}

fn trial(trial: usize) -> SessionTrial {
    // deterministic noise, without a random generator
    let noise = |i: usize| 0.02 * (((i * 7919 + 31 * trial) % 1000) as f64 / 288.7 - 1.732);
    let noisy = |y: Vec<f64>| y.into_iter().enumerate().map(|(i, y)| y + noise(i)).collect();
    let channel = |name: &str, values| Channel { name: name.into(), values };
    let line = noisy(input(trial).iter().map(|x| 2.0 * x).collect());
    let channels = vec![
        channel("x_V", input(trial)),
        channel("y0_mm", line),
        channel("y1_mm", noisy(lagging(trial))),
    ];
    let time_s = (0..SAMPLES).map(|i| 0.02 * i as f64).collect();
    let recorded = Trial { name: format!("run_{trial}.csv"), time_s, channels };
    let split = if trial == 1 { Split::Test } else { Split::Fit };
    SessionTrial { start_s: 60.0 * trial as f64, split, ..SessionTrial::new(recorded) }
}

/// Returns an answer of stretch-gap by its name: its value, its sentence and its notes.
fn said(name: &str) -> (Value, String, Vec<Value>) {
    let answers: Value = serde_json::from_str(ANSWERS).expect("JSON");
    let mut blocks = SENTENCES.split("# ").map(str::lines);
    let mut lines = blocks.find_map(|mut lines| (lines.next()? == name).then_some(lines));
    let mut lines = lines.take().expect(name);
    let sentence = lines.next().expect("a sentence").to_owned();
    let notes = lines.filter_map(|line| line.strip_prefix("note: "));
    let notes = notes.map(|text| json!({"code": "recording", "text": text}));
    (answers[name].clone(), sentence, notes.collect())
}

/// A diagnosis that names no effect.
fn answer(name: &str) -> Diagnosis {
    let (value, sentence, notes) = said(name);
    let answer: Answer = from_value(value.clone()).expect("an answer");
    let lag = if answer.agrees() { [30.0, 0.004, 0.004] } else { [30.0, 8.0, 0.002] };
    let stage = |name: &str, channel: &str, share: f64, [raw, excess, after]: [f64; 3]| {
        json!({
            "stage": name, "channel": channel, "share": share, "raw": raw, "excess": excess, "after": after,
            "rms": 0.06, "floor": 0.02, "floor_source": "stated by the problem", "unit": "mm",
        })
    };
    let slice = |by: &str, slice: &str, excess: f64| {
        json!({
            "by": by, "slice": slice, "stage": "lag", "share": 0.5, "excess": excess,
            "excess_ci": [0.8 * excess, 1.2 * excess], "stands_out": excess > 4.0,
        })
    };
    from_value(json!({
        "schema": 2, "answer": value, "sentence": sentence, "not_examined": [], "ambiguous": [],
        "candidates": [], "shares": [], "stabilities": [], "least_gap": 0.05,
        "gap": {"raw": 0.0, "retuned": 0.0, "left": 0.0}, "null_band": 0.02, "detection_limits": [],
        "identifiability": [], "notes": notes, "rows_used": {"used": 0, "read": 0}, "simulations": 0,
        "starts": {"tried": 1, "agreed": 1}, "runtime_s": 12.34,
        "where": {
            "end_to_end": [],
            "stages": [
                stage("line", "y0_mm", 0.06, [0.3, 0.1, 0.1]),
                stage("lag", "y1_mm", 0.94, lag),
            ],
            "slices": [
                slice("regime", "rising", 9.0), slice("regime", "falling", 7.0),
                slice("level", "1.2 to 2.4 mm", 3.0), slice("time", "first 3 s", 8.0),
            ],
        },
        "parameters": [
            {"name": "gain", "unit": "1", "nominal": 2.0, "fitted": 2.23, "sd": 0.01, "sigmas": 2.3, "bent": 2.41, "bent_sigmas": 4.1, "is_evidence": true},
            {"name": "zero", "unit": "mm", "nominal": 0.1, "fitted": 0.12, "sd": 0.02, "sigmas": 0.4, "bent": 0.1, "bent_sigmas": 0.0, "is_evidence": false},
        ],
    }))
    .expect("a diagnosis")
}

/// A candidate that closes a share of a gap of three times the noise.
fn candidate(effects: &[&str], probability: f64, closed: f64, values: Value) -> Value {
    let left = 8.0 * (1.0 - closed);
    json!({
        "effects": effects, "probability": probability, "score": 100.0, "gap_before": 8.0, "gap_after": left,
        "left": left, "at_bound": false, "closed": closed, "closed_ci": [closed - 0.02, closed], "is_confirmed": true,
        "parameters": {}, "parameter_values": values,
    })
}

fn width(effect: &str) -> Value {
    json!([{"effect": effect, "name": "w", "unit": "mm", "value": 0.5123, "sd": 0.0041, "interval": [0.5042, 0.5203],
        "is_form": false, "at_bound": false}])
}

/// A diagnosis that names effects, with rivals that are nearly as probable.
fn naming(name: &str, rivals: &[&str]) -> Diagnosis {
    let answer = answer(name);
    let closed = if answer.verdict() == VerdictKind::Partial { 0.8 } else { 0.999 };
    let named = answer.named();
    let named: Vec<&str> = named.iter().map(String::as_str).collect();
    let probability = if rivals.is_empty() { 0.97 } else { 0.55 };
    let mut candidates = vec![candidate(&named, probability, closed, width(named[0]))];
    candidates.extend(rivals.iter().map(|rival| candidate(&[*rival], 0.42, closed, width(rival))));
    candidates.push(candidate(&["unknown"], 0.03, 0.0, json!([])));
    Diagnosis {
        ambiguous: [&named, rivals].concat().into_iter().map(str::to_owned).collect(),
        candidates: from_value(json!(candidates)).expect("candidates"),
        stabilities: from_value(json!([{"effect": named[0], "stability": 0.93}])).expect("one"),
        ..answer
    }
}

/// A diagnosis of one missing effect, with everything that a report can contain.
fn one_missing() -> Diagnosis {
    let errors =
        |real: f64, sim: f64, with: f64| json!({"real": real, "sim": sim, "sim_with_effect": with});
    Diagnosis {
        transfer: from_value(json!({
            "linear": errors(3.1, 4.2, 3.2), "poly13": errors(1.1, 2.4, 1.2), "unit": "percent_full_scale",
        }))
        .expect("a transfer"),
        next_experiment: next_experiment(14.0),
        ..naming("one missing", &[LOOP])
    }
}

fn next_experiment<T: serde::de::DeserializeOwned>(minutes: f64) -> Option<T> {
    let next = json!({
        "name": "slow_triangle", "separates": [PLAY, LOOP], "d": 6.2, "minutes": minutes,
        "why": "Backlash dwells at its turns, smooth hysteresis does not.",
    });
    Some(from_value(next).expect("an experiment"))
}

fn agrees() -> Diagnosis {
    let limit = |effect: &str, strength: Option<f64>| json!({"effect": effect, "parameter": "w", "strength": strength, "unit": "mm", "others": {}});
    Diagnosis {
        detection_limits: from_value(json!([limit(PLAY, Some(0.0123)), limit(LOOP, None)]))
            .expect("limits"),
        ..answer("agrees")
    }
}

fn wrong(name: &str) -> Diagnosis {
    let with_it = json!([candidate(&["scale of y1_mm"], 0.9, 0.999, json!([]))]);
    Diagnosis { candidates: from_value(with_it).expect("candidates"), ..answer(name) }
}

/// Diagnoses with every kind of answer, by the name of the sentence.
fn answers() -> Vec<(&'static str, Diagnosis)> {
    let mut fits_worse = naming("one missing, fits worse than it tests", &[]);
    (fits_worse.candidates[0].left, fits_worse.candidates[0].gap_after) = (0.9, 0.1);
    let mut faint = answer("more than noise, nothing found");
    faint.parameters.clear();
    faint.gap.retuned = 0.08;
    let proposed = json!({
        "stage": "lag", "channel": "y1_mm", "equation": "y1_mm += 0.31 x_V^2", "terms": [], "signals": [],
        "time_scales_s": [8.0, 68.0], "initial": "at rest", "closes_held": 0.9, "closes_test": 0.88,
        "acts": "output y1_mm", "random": false, "log_odds": 12.0, "predicted": 0.8, "sentence": "",
    });
    let tie = Diagnosis { next_experiment: next_experiment(1.5), ..naming("tie", &[LOOP]) };
    let with_best = |name, closed| Diagnosis {
        candidates: from_value(json!([candidate(&[PLAY], 0.2, closed, json!([]))])).expect("one"),
        ..answer(name)
    };
    vec![
        ("agrees", agrees()),
        ("agrees, one effect faint", answer("agrees, one effect faint")),
        ("re-tuned", answer("re-tuned")),
        ("more than noise, nothing found", faint),
        ("one missing", one_missing()),
        ("one missing, fits worse than it tests", fits_worse),
        ("tie", tie),
        ("two missing", naming("two missing", &[])),
        (
            "two missing, one tied, a third faint",
            naming("two missing, one tied, a third faint", &[]),
        ),
        ("mostly", naming("mostly", &[])),
        ("unknown", with_best("unknown", 0.05)),
        (
            "unknown, with a proposal",
            Diagnosis {
                proposed: Some(from_value(proposed).expect("a proposal")),
                ..with_best("unknown, with a proposal", 0.05)
            },
        ),
        ("wrong record", wrong("wrong record")),
        ("copied column", wrong("copied column")),
        ("wrong rig file", wrong("wrong rig file")),
        ("parameters at their bounds", with_best("parameters at their bounds", 0.999)),
        ("too short", with_best("too short", 0.999)),
        ("too few rows", with_best("too few rows", 0.999)),
    ]
}

/// The named effect as code.
fn implementation() -> Implementation {
    let (extent, x) =
        (Extent::between(-4.0, 4.0), Quantity::new("x", "mm", "the output without play"));
    let signals = Signals { beside: x.clone(), x, load: Quantity::LOAD, dt_s: 0.02 };
    Implementation {
        name: PLAY.into(),
        words: BACKLASH.words.into(),
        stage: "lag".into(),
        formula: BACKLASH.equation.into(),
        numbers: from_value(width(PLAY)).expect("numbers"),
        sketch: BACKLASH.sketch.map(|sketch| sketch(&[0.5123, 0.0], &extent, &signals)),
    }
}

fn page(diagnosis: &Diagnosis) -> String {
    let (problem, evidence) = line_and_lag();
    let mut evidence = evidence.clone();
    evidence.best = evidence.retuned.clone();
    let mut implementations = Vec::new();
    if diagnosis.named().iter().any(|name| name == PLAY) {
        evidence.best.effects = vec![(0, vec![0.5123, 0.0])];
        implementations.push(implementation());
    }
    diagnosis_page(&Subject {
        name: "bench",
        diagnosis,
        evidence: &evidence,
        implementations: &implementations,
        simulator: problem.simulator(),
        by_trial: None,
    })
}

#[test]
fn the_first_seconds_of_every_answer() {
    let all = answers()
        .iter()
        .map(|(name, d)| format!("=== {name}\n{}", first_seconds(&page(d))))
        .collect::<Vec<_>>();
    is_snapshot("first_seconds.txt", &all.join("\n\n"));
}

#[test]
fn a_page_with_all_that_can_be_said() {
    is_snapshot("one_missing.txt", &text(&page(&one_missing())));
}

#[test]
fn a_page_of_an_agreement() {
    is_snapshot("agrees.txt", &text(&page(&agrees())));
}

#[test]
fn sections_as_html() {
    let (missing, agrees) = (page(&one_missing()), page(&agrees()));
    let all = [
        section(&missing, "Which effect"),
        section(&missing, "To implement"),
        section(&agrees, "What would have been seen"),
    ];
    is_snapshot("sections.html", &all.join("\n"));
}

#[test]
fn what_a_gap_costs_a_calibration() {
    let error = |sim, sim_with_effect| TransferError { real: 1.0, sim, sim_with_effect };
    let cases = [
        ("less with the effect", error(3.0, 1.1), error(2.0, 2.01)),
        ("neither changes", error(1.42, 1.40), error(2.0, 2.01)),
        ("the surface got worse", error(3.0, 1.1), error(2.0, 2.2)),
        ("both got worse", error(1.0, 1.1), error(2.0, 2.2)),
    ];
    let text = cases.map(|(name, linear, poly13)| {
        let words =
            transfer_in_words(&Transfer { linear, poly13, unit: "percent_full_scale".into() });
        format!("=== {name}\n{}\n", words.as_deref().unwrap_or("(its table says all)"))
    });
    is_snapshot("transfers.txt", &text.join("\n"));
}

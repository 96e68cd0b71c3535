//! Tests of the sentences for every kind of answer. The answers are built from values.
//! `sentences.txt` contains the expected sentences, and `answers.json` the answers as values.

use std::{collections::BTreeMap, fmt::Write as _, path::Path};

use serde_json::{from_value, json};
use testkit::corpus::is_in_file;

use crate::{
    evidence::{
        candidates::Candidate,
        gathered::{Evidence, Excess},
        probability::Posterior,
        sanity::{AtBounds, Sanity},
        shares::EffectShare,
    },
    missing::Proposed,
    problem::{column::Column, record_facts::RowsUsed, simulator::Simulator},
    record::gross::Gross,
    verdict::{
        answer::Answer,
        coverage::TooLittle,
        diagnosis::{Diagnosis, NextExperiment, Unexplained, VerdictKind},
        judge,
        naming::Naming,
        notes::answer_notes,
        tests::line_and_lag,
    },
};

const PLAY: &str = "lag.output.backlash";
const LAG: &str = "line.input.lag";
const LOOP: &str = "lag.output.bouc_wen";

/// A finding that overrides an answer.
#[derive(Clone)]
enum Overruled {
    AtBounds(AtBounds),
    TooLittle(TooLittle),
}

/// An answer defined by its values. By default simulator and rig agree, and there are no findings.
struct Case {
    seen: VerdictKind,
    overruled: Option<Overruled>,
    naming: Naming,
    proposed: Option<Proposed>,
    /// Excess as shipped, after re-tuning, and with the best set.
    gap: [f64; 3],
    first: Candidate,
    shares: Vec<EffectShare>,
    sanity: Sanity,
    unexplained: Option<Unexplained>,
    gross: Vec<Gross>,
    borrowed_test: bool,
    /// Whether the evidence contains a best effect, which closes a part of the gap.
    has_best: bool,
}

impl Default for Case {
    fn default() -> Self {
        Self {
            seen: VerdictKind::NoGap,
            overruled: None,
            naming: Naming::default(),
            proposed: None,
            gap: [0.004; 3],
            first: candidate(0.97, 0.002),
            shares: Vec::new(),
            sanity: Sanity {
                left: vec![0.001, 0.002],
                allowed: 0.1,
                at_bounds: None,
                implausible: Vec::new(),
            },
            unexplained: None,
            gross: Vec::new(),
            borrowed_test: false,
            has_best: false,
        }
    }
}

/// The most probable set, which closes 98 % of the gap.
fn candidate(probability: f64, left: f64) -> Candidate {
    Candidate {
        effects: vec![PLAY.into()],
        probability,
        score: 100.0,
        gap_before: 8.0,
        gap_after: 0.002,
        left,
        at_bound: false,
        closed: 0.98,
        closed_ci: [0.962, 1.0],
        is_confirmed: true,
        by_name: BTreeMap::new(),
        parameters: Vec::new(),
    }
}

fn names(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

fn share(effect: &str, closes: f64, at_bound: bool) -> EffectShare {
    EffectShare { effect: effect.into(), closes, closes_excess: 8.0 * closes, at_bound }
}

/// Missing effects that close nearly all of the gap.
fn missing(named: &[&str]) -> Case {
    Case {
        seen: VerdictKind::Effect,
        naming: Naming { named: names(named), ..Naming::default() },
        gap: [30.0, 8.0, 0.002],
        ..Case::default()
    }
}

/// Missing effects that close a share of the gap.
fn part(closed: f64, shares: Vec<EffectShare>) -> Case {
    let named: Vec<&str> = shares.iter().map(|s| s.effect.as_str()).collect();
    Case {
        seen: VerdictKind::Partial,
        gap: [30.0, 8.0, 8.0 * (1.0 - closed)],
        first: Candidate { closed, ..candidate(0.8, 8.0 * (1.0 - closed)) },
        unexplained: Some(Unexplained {
            share: 1.0 - closed,
            stage: "line".into(),
            sits: names(&["rising", "30 to 40 mm"]),
        }),
        ..missing(&named)
    }
    .shared(shares)
}

/// A gap that nothing explains.
fn unknown() -> Case {
    Case { seen: VerdictKind::Unknown, gap: [30.0, 8.0, 8.0], ..Case::default() }
}

/// An error of the recording or of the rig file.
fn wrong(gross: Vec<Gross>) -> Case {
    Case { seen: VerdictKind::Record, gap: [30.0, 8.0, 0.002], gross, ..Case::default() }
}

fn gross(what: &str, sentence: &str, hint: &str) -> Gross {
    from_value(json!({ "what": what, "unit": "V", "sentence": sentence, "hint": hint }))
        .expect("an error of the record")
}

/// A proposed term that is not in the catalogue.
fn proposed() -> Proposed {
    from_value(json!({
        "stage": "line", "channel": "y0", "equation": "y0 += 0.31 x^2", "terms": [], "signals": [],
        "time_scales_s": [10.0, 600.0], "initial": "at rest", "closes_held": 0.9, "closes_test": 0.88,
        "acts": "output y0", "random": false, "log_odds": 12.0, "predicted": 0.8,
        "sentence": "A term in x^2 closes 88 % of what is left in y0.",
    }))
    .expect("a proposal")
}

impl Case {
    fn shared(self, shares: Vec<EffectShare>) -> Self {
        Self { shares, ..self }
    }

    fn tied(mut self, name: &str, other: &str) -> Self {
        self.naming.ties.push((name.into(), other.into()));
        self
    }

    fn faint(mut self, name: &str) -> Self {
        self.naming.faint.push(name.into());
        self
    }

    fn overruled(self, by: Overruled) -> Self {
        Self { overruled: Some(by), ..self }
    }

    /// Returns a diagnosis with the answer and its notes.
    fn told(
        &self,
        simulator: &dyn Simulator,
        (plain, evidence): (&Diagnosis, &Evidence),
    ) -> Diagnosis {
        let [raw, retuned, left] = self.gap;
        let mut evidence = evidence.clone();
        evidence.gap = Excess { raw, retuned, left };
        evidence.roles.borrowed_test = self.borrowed_test;
        evidence.best_effect = self.has_best.then_some(0);
        let case = judge::Case {
            simulator,
            evidence: &evidence,
            posterior: &Posterior { sets: Vec::new(), unknown: 0.0, function: None },
            candidates: std::slice::from_ref(&self.first),
            shares: &self.shares,
            sanity: &self.sanity,
            gross: &self.gross,
            null_band: 0.02,
            too_little: None,
            seed: 1,
        };
        let mut answer = case.answer(self.seen, self.naming.clone());
        if let Answer::Missing { rest, .. } = &mut answer {
            rest.clone_from(&self.unexplained);
        }
        let answer = match &self.overruled {
            None => answer,
            Some(Overruled::AtBounds(found)) => found.answer(simulator, answer),
            Some(Overruled::TooLittle(why)) => Answer::TooLittle { why: *why },
        };
        let notes = answer_notes(&answer, &self.sanity, simulator, &evidence);
        let proposed = self.proposed.clone();
        Diagnosis { answer, proposed, notes, ..plain.clone() }
    }
}

fn cases(simulator: &dyn Simulator) -> Vec<(&'static str, Case)> {
    use VerdictKind::Parameters;
    let [line, lag] = [0, 1].map(|stage| Column::output(stage, &simulator.stages()[stage]));
    let retuned = || Case { seen: Parameters, gap: [24.0, 0.004, 0.004], ..Case::default() };
    let faint = || Case { seen: Parameters, gap: [24.0, 0.08, 0.08], ..Case::default() };
    let scale =
        || gross("scale", "y0 looks 1.250 times too large", "check the gain of the amplifier");
    let ended = AtBounds { stage: 1, ended: vec![0, 1], left: 8.0, rivals: None };
    let mostly = || part(0.8, vec![share(PLAY, 0.7, false), share(LAG, 0.1, true)]);
    vec![
        ("agrees", Case::default()),
        ("agrees, one effect faint", Case::default().faint(PLAY)),
        ("agrees, last quarters tested on", Case { borrowed_test: true, ..Case::default() }),
        ("re-tuned", retuned()),
        ("re-tuned, one effect faint", retuned().faint(PLAY)),
        ("more than noise, nothing found", faint()),
        ("more than noise, found and small", faint().faint(PLAY).faint(LAG)),
        ("one missing", missing(&[PLAY])),
        ("one missing, certain", Case { first: candidate(1.0, 0.002), ..missing(&[PLAY]) }),
        (
            "one missing, certain, more than noise left",
            Case {
                gap: [30.0, 20.0, 1.6],
                first: Candidate { closed: 1.0, gap_after: 1.6, ..candidate(1.0, 1.6) },
                ..missing(&[PLAY])
            },
        ),
        (
            "one missing, fits worse than it tests",
            Case {
                gap: [30.0, 8.0, 0.9],
                first: Candidate { gap_after: 0.1, ..candidate(0.97, 0.9) },
                ..missing(&[PLAY])
            },
        ),
        ("tie", Case { first: candidate(0.55, 0.002), ..missing(&[PLAY]) }.tied(PLAY, LOOP)),
        ("two missing", missing(&[PLAY, LAG])),
        (
            "two missing, one tied, a third faint",
            missing(&[PLAY, LAG]).tied(PLAY, LOOP).faint("lag.output.drift"),
        ),
        ("mostly", mostly()),
        ("mostly, tied", mostly().tied(PLAY, LOOP)),
        ("mostly, with a proposal", Case { proposed: Some(proposed()), ..mostly() }),
        (
            "in part, one closes nothing",
            part(0.3, vec![share(PLAY, 0.34, false), share(LAG, -0.04, false)]),
        ),
        ("in part", part(0.3, vec![share(PLAY, 0.295, true), share(LAG, 0.005, false)])),
        ("unknown", unknown()),
        (
            "unknown, parts close",
            Case { has_best: true, ..unknown() }.shared(vec![
                share(PLAY, 0.2, true),
                share(LAG, 0.06, false),
                share(LOOP, 0.01, false),
            ]),
        ),
        ("unknown, with a proposal", Case { proposed: Some(proposed()), ..unknown() }),
        ("wrong record", wrong(vec![scale()])),
        (
            "wrong record, one of two",
            wrong(vec![scale(), gross("delay", "y0 comes 0.030 s late", "check the clocks")]),
        ),
        ("copied column", wrong(vec![Gross::copied(&lag, &line, 0.5)])),
        (
            "columns that stand still",
            wrong(vec![
                Gross::still(&line, &("a.csv".into(), 1.0, 4.5), 1),
                Gross::still(&lag, &("b.csv".into(), 0.25, 9.0), 3),
            ]),
        ),
        (
            "wrong rig file",
            wrong(vec![gross(
                "parameter",
                "bridge_v is 2.5 V on the rig, and 5 in the simulator",
                "correct the parameter of the simulator, or the setting of the rig",
            )]),
        ),
        (
            "other units",
            wrong(vec![gross(
                "factor",
                "the simulated y0 is 57.3 times the recording's: that is deg for rad",
                "convert the recording",
            )]),
        ),
        ("parameters at their bounds", missing(&[PLAY]).overruled(Overruled::AtBounds(ended))),
        (
            "too short",
            missing(&[PLAY]).overruled(Overruled::TooLittle(TooLittle::Short {
                fit_s: 3.75,
                test_s: 1.25,
                block_s: 0.5,
            })),
        ),
        (
            "too few rows",
            missing(&[PLAY]).overruled(Overruled::TooLittle(TooLittle::Rows(RowsUsed {
                used: 1200,
                read: 4000,
            }))),
        ),
        (
            "a channel that is not simulated",
            Case {
                sanity: Sanity {
                    left: vec![0.02, 0.64],
                    allowed: 0.1,
                    at_bounds: None,
                    implausible: Vec::new(),
                },
                ..unknown()
            },
        ),
    ]
}

#[test]
fn every_answer_has_its_words() {
    let (measured, plain, evidence) = line_and_lag();
    let (mut text, mut values) = (String::new(), serde_json::Map::new());
    for (name, case) in cases(&measured) {
        let told = case.told(&measured, (&plain, &evidence));
        let _ = writeln!(text, "# {name}\n{}", told.headline());
        text.extend(told.notes.iter().map(|note| format!("note: {note}\n")));
        text.push('\n');
        values.insert(name.into(), json!(told.answer));
        if let Answer::Unknown { .. } = told.answer {
            let mut only = told.clone();
            if let Answer::Unknown { stage, .. } = &mut only.answer {
                *stage = "simulator".into();
            }
            assert!(only.headline().starts_with("There is a gap in the simulator that"), "{text}");
            let early =
                Diagnosis { cut_short: Some(names(&[PLAY, LAG])), none_examined: true, ..told };
            let said = early.headline();
            let begins = "The budget of runs was spent before any effect could be examined. There is a gap in ";
            assert!(said.starts_with(begins) && !said.contains("none of the examined"), "{said}");
        }
    }
    for rest in [&[][..], &["lag"], &["a", "b", "c", "d", "e", "f", "g", "h"]] {
        let cut = Diagnosis { cut_short: Some(names(rest)), ..plain.clone() };
        let _ =
            writeln!(text, "# budget spent, {} left\n{}\n", rest.len(), cut.preface().trim_end());
    }
    let answer = Answer::Agrees { small: Vec::new() };
    let gauge = Diagnosis { answer, proposed: None, gauge_alone: true, ..plain.clone() };
    let _ = writeln!(text, "# gauge alone\n{}\n", gauge.headline());
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/verdict/tests");
    is_in_file(&folder.join("sentences.txt"), &text);
    // The tests of reports read these values.
    let values = serde_json::to_string_pretty(&values).expect("written");
    is_in_file(&folder.join("answers.json"), &(values + "\n"));
}

/// If no candidate experiment distinguishes the alternatives, the sentence does not ask for one.
#[test]
fn the_next_step_follows_from_the_next_experiment() {
    let (measured, plain, evidence) = line_and_lag();
    let tied = missing(&[PLAY]).tied(PLAY, LOOP);
    let mut told = tied.told(&measured, (&plain, &evidence));
    for (separates, step) in [
        (vec![PLAY.to_owned(), LOOP.to_owned()], "Next: run an experiment that tells them apart"),
        (Vec::new(), "Next: measure another quantity that tells them apart"),
    ] {
        let (name, why) = ("slow".to_owned(), String::new());
        told.set_next_experiment(Some(NextExperiment {
            name,
            separates,
            d: 1.0,
            minutes: 1.0,
            why,
        }));
        assert!(told.sentence.contains(step), "{}", told.sentence);
    }
}

/// Every sentence that names effects also lists parameters at the ends of their tolerances, because
/// the values of the effects are then less reliable.
#[test]
fn parameters_at_the_ends_of_their_tolerances_are_said_with_every_name() {
    let (measured, plain, mut evidence) = line_and_lag();
    let mostly = part(0.8, vec![share(PLAY, 0.7, false), share(LAG, 0.1, true)]);
    let cases = [missing(&[PLAY]), missing(&[PLAY, LAG]), mostly];
    let says = |case: &Case, evidence: &Evidence| {
        let told = case.told(&measured, (&plain, evidence)).headline();
        let at = told.find(": the values that were found");
        at.map(|at| told[told[..at].rfind(". ").map_or(0, |end| end + 2)..at].to_owned())
    };
    for case in &cases {
        assert_eq!(says(case, &evidence), None);
    }
    let simulator: &dyn Simulator = &measured;
    let specs = simulator.parameters().iter().enumerate();
    let all: Vec<_> = specs.filter(|(_, p)| p.sd > 0.0).collect();
    let (one, other) = (all[0], all[1]);
    evidence.best.parameters[one.0] = one.1.nominal + 3.0 * one.1.sd;
    for case in &cases {
        let said = says(case, &evidence).expect("one is at its end");
        assert_eq!(
            said,
            format!("{} (+3.0 tolerances) is at the end of its tolerance", one.1.name)
        );
    }
    evidence.best.parameters[other.0] = other.1.nominal - 2.8 * other.1.sd;
    for case in &cases {
        let said = says(case, &evidence).expect("two are at their ends");
        let both = [(one.1, "+3.0"), (other.1, "-2.8")];
        let both = both.map(|(p, by)| format!("{} ({by} tolerances)", p.name));
        assert_eq!(said, format!("{} are at the end of their tolerances", both.join(" and ")));
    }
}

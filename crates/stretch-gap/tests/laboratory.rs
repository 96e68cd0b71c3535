//! Tests the proposal of the next experiment: two effects are a tie on the recorded motion, and the proposed motion
//! distinguishes them.

use crate::{
    consistent::evidenced,
    toys::{Effect, Law, Measured, Toy, levels},
};
use stretch_gap::{Diagnosis, Evidence, Model, Options, differences, next_experiment};

/// A line with a cubic, held at three levels. On these levels, a square with another gain explains the same.
fn tied() -> (Measured, Diagnosis, Evidence) {
    let toy = Toy::of(&[Law::Line]).may_lack(&[Effect::Quadratic, Effect::Cubic]);
    let toy = toy.hiding(&[(Effect::Cubic, &[0.1])]);
    let measured = toy.driven_by(levels(toy.samples()), 1);
    let (told, evidence) = evidenced(&measured, &Options::default());
    (measured, told, evidence)
}

#[test]
fn what_was_measured_cannot_tell_and_the_next_experiment_can() {
    let (measured, told, evidence) = tied();
    let mut ambiguous = told.ambiguous.clone();
    ambiguous.sort();
    assert_eq!(ambiguous, ["cubic", "quadratic"], "{}", told.sentence);
    let proposal =
        next_experiment(&measured, &told, &evidence).expect("simulated").expect("a proposal");
    let mut separates = proposal.next.separates.clone();
    separates.sort();
    assert_eq!(separates, ["cubic", "quadratic"]);
    // x^2 and x^3 differ if x is also negative. On the three levels they do not differ.
    assert_eq!(proposal.next.name, "to both sides");
    let d =
        |name: &str| proposal.experiments.iter().find(|m| m.0 == name).map_or(f64::NAN, |m| m.1);
    assert_eq!(d("to both sides"), proposal.next.d);
    assert!(
        d("to both sides") > 1.0 && d("three levels") < 0.2 && d("rest") < 0.2,
        "{:?}",
        proposal.experiments
    );
    assert_eq!(proposal.experiments.len(), 4);
    assert!(
        !proposal.trial.is_empty() && proposal.next.why.starts_with("Move"),
        "{}",
        proposal.next.why
    );
}

/// Experiments are ranked by evidence per minute. The same motion after ten minutes of preparation
/// ranks lower.
#[test]
fn preparation_counts_into_the_minutes() {
    let (measured, told, evidence) = tied();
    let proposal =
        next_experiment(&measured, &told, &evidence).expect("simulated").expect("a proposal");
    let place = |name: &str| {
        proposal.experiments.iter().position(|m| m.0 == name).expect("of the experiments")
    };
    assert!(place("to both sides") < place("to both sides, prepared"));
    let entry = |name: &str| &proposal.experiments[place(name)];
    assert_eq!(entry("to both sides").1, entry("to both sides, prepared").1);
    assert!((entry("to both sides, prepared").2 - entry("to both sides").2 - 10.0).abs() < 1e-9);
}

#[test]
fn a_single_name_needs_no_experiment() {
    let toy = Toy::of(&[Law::Line]).may_lack(&[Effect::Quadratic, Effect::Cubic]);
    let measured = toy.hiding(&[(Effect::Cubic, &[0.3])]).measured(2);
    let (told, evidence) = evidenced(&measured, &Options::default());
    assert_eq!(told.ambiguous, ["cubic"], "{}", told.sentence);
    assert_eq!(next_experiment(&measured, &told, &evidence).expect("simulated"), None);
    // A recording without a gap needs no experiment either.
    let quiet = Toy::of(&[Law::Line]).may_lack(&[Effect::Quadratic]).measured(3);
    let (told, evidence) = evidenced(&quiet, &Options::default());
    assert_eq!(next_experiment(&quiet, &told, &evidence).expect("simulated"), None);
}

/// Either hypothesis may be true, so their order does not matter. A model does not differ from itself.
#[test]
fn differences_have_no_order() {
    let (measured, _, _) = tied();
    let of = |effect: usize, size: f64| Model {
        effects: vec![(effect, vec![size])],
        parameters: measured.toy.parameters.iter().map(|p| p.nominal).collect(),
    };
    let (square, cube) = (of(0, 0.15), of(1, 0.1));
    let there = differences(&measured, &square, &cube).expect("simulated");
    let back = differences(&measured, &cube, &square).expect("simulated");
    for ((name, there), (_, back)) in there.iter().zip(&back) {
        assert!((there - back).abs() < 1e-9 * there.max(1.0), "{name}: {there} {back}");
    }
    for (name, d) in differences(&measured, &cube, &cube).expect("simulated") {
        assert!(d < 1e-9, "{name}: {d}");
    }
}

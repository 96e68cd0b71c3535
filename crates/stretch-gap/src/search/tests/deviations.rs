//! Tests of how much of a residual deviations of an effect's form may explain.

use crate::{
    fit::{
        hypothesis::Hypothesis,
        score::excess,
        tests::{prepared, with_effects},
    },
    search::sets::Sets,
    toys::{Effect, Law, Toy},
};

/// Fits of a quadratic to a line that hides some effects: without deviations, and with deviations
/// of at most `share`.
fn quadratic(hidden: &[(Effect, &[f64])], share: f64) -> [Hypothesis; 2] {
    let record = Toy::of(&[Law::Line]).may_lack(&[Effect::Quadratic]).hiding(hidden).measured(5);
    let problem = prepared(&record);
    let set = with_effects(&problem, &[(0, vec![0.1])]);
    let set = Sets::new(&problem).refit(&set).expect("fitted");
    let deviating = problem.with_deviations(&set, share).expect("simulated");
    [set, deviating]
}

/// x + c x^2 + b x^3, with b a quarter of c, is a quadratic effect of another form: the cubic term
/// is the quadratic term times b x/c.
#[test]
fn a_curve_that_bends_otherwise_is_the_same_effect() {
    let hidden: [(Effect, &[f64]); 2] = [(Effect::Quadratic, &[0.4]), (Effect::Cubic, &[0.1])];
    let [set, deviating] = quadratic(&hidden, 0.17);
    let [before, after] = [&set, &deviating].map(|h| excess(h.misfits[0].fit));
    assert!(before > 0.3 && after < 0.1 * before, "{before} {after}");
    assert!(excess(deviating.misfits[0].held) < 0.2 * before);
    assert!(deviating.score > set.score);
}

/// If an effect has the right form, the five coefficients of its deviations explain nothing, and
/// their penalty is larger than their gain. The set is then returned without deviations.
#[test]
fn an_effect_of_the_right_form_has_no_deviations() {
    let [set, deviating] = quadratic(&[(Effect::Quadratic, &[0.4])], 0.17);
    assert_eq!(deviating.score, set.score);
    assert_eq!(deviating.misfits, set.misfits);
}

/// A deviation is a share of its effect's contribution, so a small effect cannot explain a large
/// one.
#[test]
fn a_small_effect_does_not_stand_in_for_a_large_one() {
    let hidden: [(Effect, &[f64]); 2] = [(Effect::Quadratic, &[0.02]), (Effect::Cubic, &[0.4])];
    let [set, deviating] = quadratic(&hidden, 0.17);
    let [before, after] = [&set, &deviating].map(|h| excess(h.misfits[0].fit));
    assert!(after > 0.7 * before, "{before} {after}");
}

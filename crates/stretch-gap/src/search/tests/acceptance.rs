//! Tests of the acceptance criteria, and of how often noise meets them.

use super::index;
use crate::{
    fit::{
        prepared::PreparedProblem,
        tests::{prepared, with_effects},
    },
    problem::{sample_roles::Role, thresholds::Thresholds},
    search::{acceptance::Acceptance, selection::Search, sets::Sets},
    toys::{Effect, Law, Measured, Toy, slow},
};

fn is_any_taken(record: &Measured) -> bool {
    let (problem, thresholds) = (prepared(record), Thresholds::frozen());
    let mut search = Search::new(&problem, &thresholds, 4);
    !search.best(&problem.nominal, &|_: &str| ()).expect("a search").effects.is_empty()
}

/// By chance an effect with two parameters rises by 12 nats plus the penalty of 2 ln(60)/2 nats
/// once in exp(16) cases. None is accepted in 20 recordings of each of four toys, with seven
/// effects each.
#[test]
fn pure_noise_is_no_effect() {
    for law in [Law::Line, Law::Lag, Law::Oscillator, Law::Delay] {
        for seed in 0..20 {
            let toy = Toy::of(&[law]).may_lack(&Effect::ALL).off_by(&[1.0, -1.0, 1.0]);
            assert!(!is_any_taken(&toy.measured(seed)), "{law:?} {seed}");
        }
    }
}

/// The same test with noise of which half of the variance is correlated over 0.05 s. The stated
/// noise includes this part, because the likelihood by octaves does not model correlated noise.
#[test]
fn coloured_noise_is_no_effect() {
    for seed in 0..20 {
        let mut toy = Toy::of(&[Law::Line]).may_lack(&Effect::ALL);
        toy.stated = Some(2.0_f64.sqrt());
        toy.courses = vec![(1, slow(toy.noise, 0.05, (toy.samples(), toy.dt_s), seed))];
        assert!(!is_any_taken(&toy.measured(seed)), "seed {seed}");
    }
}

/// A parameter that does nothing gains chi^2/2 with one degree of freedom: half a nat on average,
/// with a standard deviation of 0.71. Schwarz's penalty ln(blocks)/2 is subtracted.
#[test]
fn a_number_that_does_nothing_rises_the_score_by_half_a_nat_less_its_price() {
    const DRAWS: u64 = 40;
    let mut sum = 0.0;
    for seed in 0..DRAWS {
        let record = Toy::of(&[Law::Line]).may_lack(&[Effect::Quadratic]).measured(seed);
        let problem = prepared(&record);
        let mut sets = Sets::new(&problem);
        let set = sets.refit(&with_effects(&problem, &[(0, vec![0.01])])).expect("fitted");
        sum += set.score + 0.5 * problem.compare.roles.blocks(Role::Fit).ln();
    }
    // The tolerance is three standard errors of 0.71/sqrt(40).
    approx::assert_abs_diff_eq!(sum / DRAWS as f64, 0.5, epsilon = 0.34);
}

fn worth<'a>(problem: &'a PreparedProblem<'a>, thresholds: &'a Thresholds) -> Acceptance<'a> {
    Acceptance { problem, thresholds }
}

#[test]
fn a_strong_effect_is_worth_it_and_the_same_set_is_not() {
    let toy = Toy::of(&[Law::Line]).may_lack(&Effect::ALL).hiding(&[(Effect::Play, &[0.1])]);
    let record = toy.measured(1);
    let (problem, thresholds) = (prepared(&record), Thresholds::frozen());
    let worth = worth(&problem, &thresholds);
    let play = with_effects(&problem, &[(index(&record, "play"), vec![0.1])]);
    let play = Sets::new(&problem).refit(&play).expect("fitted");
    let is_accepted = |base, next| {
        let deviating = worth.deviating(base).expect("simulated");
        worth.is_accepted((base, &deviating), next).expect("simulated")
    };
    assert!(is_accepted(&problem.nominal, &play));
    assert!(!is_accepted(&play, &play) && !is_accepted(&play, &problem.nominal));
}

/// An effect that closes less than `null_excess` needs a larger rise of the score.
#[test]
fn what_closes_little_has_to_rise_more() {
    let record = Toy::of(&[Law::Line]).measured(1);
    let (problem, thresholds) = (prepared(&record), Thresholds::frozen());
    let worth = worth(&problem, &thresholds);
    assert_eq!(worth.least_rise(0.99 * thresholds.null_excess), thresholds.faint_rise);
    assert_eq!(worth.least_rise(1.01 * thresholds.null_excess), thresholds.rise);
    assert!(thresholds.faint_rise > thresholds.rise);
}

/// An effect that is stronger than its range allows ends at a bound, and this is reported.
#[test]
fn an_effect_at_the_end_of_its_range_is_told() {
    for (size, is_bound) in [(0.15, false), (0.5, true)] {
        let toy = Toy::of(&[Law::Line]).may_lack(&[Effect::Play]);
        let record = toy.hiding(&[(Effect::Play, &[size])]).measured(4);
        let problem = prepared(&record);
        let play = with_effects(&problem, &[(0, vec![0.2])]);
        let play = Sets::new(&problem).refit(&play).expect("fitted");
        assert_eq!(play.is_at_bound(0, problem.simulator().effects()), is_bound, "{size}");
    }
}

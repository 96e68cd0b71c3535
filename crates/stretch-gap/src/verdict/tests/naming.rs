//! Properties of the naming that hold for all candidates, tested on thousands of random cases.

use std::collections::BTreeSet;

use crate::{
    evidence::{candidates::Candidate, shares::EffectShare},
    numerics::random::RandomGenerator,
    problem::thresholds::Thresholds,
    toys::{Law, Toy},
    verdict::{judge::missing_effects, naming::Naming},
};

const NAMES: [&str; 6] = ["play", "drift", "lag", "leak", "slack", "sag"];

/// A random set of up to three different effects.
fn set(random: &mut RandomGenerator) -> Vec<String> {
    let count = random.below(4);
    let mut names: Vec<String> = Vec::new();
    while names.len() < count {
        let name = NAMES[random.below(NAMES.len())].to_owned();
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

fn candidate(effects: Vec<String>, probability: f64, random: &mut RandomGenerator) -> Candidate {
    let closed = 1.2 * random.unit() - 0.2;
    Candidate {
        effects,
        probability,
        score: 10.0 * probability,
        gap_before: 10.0,
        gap_after: 10.0 * (1.0 - closed),
        left: 10.0 * (1.0 - closed),
        at_bound: false,
        closed,
        closed_ci: [closed - 0.1, closed + 0.1],
        is_confirmed: random.unit() < 0.7,
        by_name: Default::default(),
        parameters: Vec::new(),
    }
}

/// Random candidates, the most probable first, and shares of the first one's effects, the strongest
/// first.
fn drawn(random: &mut RandomGenerator) -> (Vec<Candidate>, Vec<EffectShare>) {
    let mut candidates = Vec::new();
    for probability in [0.6, 0.3, 0.1] {
        let effects = set(random);
        candidates.push(candidate(effects, probability, random));
    }
    let mut shares: Vec<EffectShare> = candidates[0]
        .effects
        .iter()
        .map(|effect| {
            let closes = random.unit() * random.unit();
            let at_bound = random.unit() < 0.2;
            EffectShare { effect: effect.clone(), closes, closes_excess: closes, at_bound }
        })
        .collect();
    shares.sort_by(|a, b| b.closes.total_cmp(&a.closes));
    (candidates, shares)
}

/// Named and faint effects together form the first set. A tie is between a named effect and one
/// outside the first set. Every effect is reported once.
#[test]
fn names_part_the_first_set() {
    let mut random = RandomGenerator::new(4, 0);
    let thresholds = Thresholds::frozen();
    let simulator = Toy::of(&[Law::Line]).measured(1);
    let mut ties = 0;
    for _ in 0..5000 {
        let (candidates, shares) = drawn(&mut random);
        let naming = Naming::of(&candidates, &shares, &thresholds, &|_, _| false);
        let both: Vec<&String> = naming.named.iter().chain(&naming.faint).collect();
        let parted: BTreeSet<&String> = both.iter().copied().collect();
        assert_eq!(parted.len(), both.len());
        assert_eq!(parted, candidates[0].effects.iter().collect());
        for (own, other) in &naming.ties {
            assert!(naming.named.contains(own) && !candidates[0].effects.contains(other));
        }
        ties += naming.ties.len();
        let told = missing_effects(&naming, &shares, &candidates, &simulator);
        assert!(told.iter().map(|effect| &effect.name).eq(&naming.named));
        let alternatives: usize = told.iter().map(|effect| effect.alternatives.len()).sum();
        assert_eq!(alternatives, naming.ties.len());
    }
    assert!(ties > 100, "{ties} ties are enough to say something");
}

/// The strongest effect is named. A further effect is named only if it closes `least_gap` or is certain.
#[test]
fn what_is_named_counts() {
    let mut random = RandomGenerator::new(5, 0);
    let thresholds = Thresholds::frozen();
    for _ in 0..5000 {
        let (candidates, shares) = drawn(&mut random);
        let naming = Naming::of(&candidates, &shares, &thresholds, &|_, _| false);
        let share = |name: &String| shares.iter().find(|s| s.effect == *name);
        let certain = |name: &String| {
            let sets = candidates.iter().filter(|c| c.effects.contains(name));
            sets.map(|c| c.probability).sum::<f64>() >= 0.95
        };
        let counts = |name: &String| {
            share(name).is_some_and(|s| s.closes_excess >= thresholds.least_gap) || certain(name)
        };
        assert!(naming.named.iter().skip(1).all(counts), "{naming:?}");
    }
}

//! From scores to probabilities and the 95 % set.

use std::collections::BTreeMap;

use crate::{select::Solution, simulator::Simulator, thresholds::Thresholds};

/// Probability that the 95 % set holds.
const COVERED: f64 = 0.95;

/// Softmax within every slot of the best set (an effect and those that could stand in its place), at a temperature
/// that grows with what the effect brings; the best set first.
pub(crate) fn weigh(
    thresholds: &Thresholds,
    best: &Solution,
    slots: &BTreeMap<usize, f64>,
    rivals: &[(usize, Solution)],
) -> Vec<(Solution, f64)> {
    let mut odds: Vec<(Solution, f64)> = vec![(best.clone(), 1.0)];
    for (slot, rival) in rivals {
        let brought = slots.get(slot).copied().unwrap_or(0.0).max(0.0);
        let temperature = thresholds.temperature + thresholds.rho * brought;
        let mut rival = rival.clone();
        // The rival stands where the effect stood.
        if let Some(at) = best.effects.iter().position(|e| e == slot) {
            let newcomer = rival.effects.iter().find(|e| !best.effects.contains(e)).copied();
            let mut effects = best.effects.clone();
            if let Some(newcomer) = newcomer {
                effects[at] = newcomer;
                rival.effects = effects;
            }
        }
        odds.push((rival.clone(), ((rival.score - best.score) / temperature).exp()));
    }
    let total: f64 = odds.iter().map(|o| o.1).sum();
    odds.iter_mut().for_each(|o| o.1 /= total);
    odds.sort_by(|a, b| b.1.total_cmp(&a.1));
    odds
}

/// Effects of the smallest set of candidates that holds 95 % of the probability, the best candidate's first.
pub(crate) fn covering_set(weighed: &[(Solution, f64)], simulator: &dyn Simulator) -> Vec<String> {
    let mut sum = 0.0;
    let mut names: Vec<String> = Vec::new();
    for (solution, probability) in weighed {
        if sum >= COVERED {
            break;
        }
        sum += probability;
        for &e in &solution.effects {
            let name = &simulator.effects()[e].name;
            if !names.contains(name) {
                names.push(name.clone());
            }
        }
    }
    names
}

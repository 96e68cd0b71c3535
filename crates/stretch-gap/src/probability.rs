//! From scores to probabilities and the 95 % set.

use crate::{diagnosis::Excess, select::Solution, simulator::Simulator, thresholds::Thresholds};

/// Probability that the 95 % set holds.
const COVERED: f64 = 0.95;

/// Softmax within every slot of the best set (an effect and those that could stand in its place), at the temperature
/// `temperature + rho left/retuned`: the more of the gap the best set leaves, the less its form is the rig's, and the less
/// a difference of scores says. The best set comes first.
pub(crate) fn weigh(
    thresholds: &Thresholds,
    best: &Solution,
    gap: Excess,
    rivals: &[(usize, Solution)],
) -> Vec<(Solution, f64)> {
    let mut odds: Vec<(Solution, f64)> = vec![(best.clone(), 1.0)];
    let share = gap.left / gap.retuned.max(thresholds.null_excess);
    let temperature = thresholds.temperature + thresholds.rho * share;
    for (slot, rival) in rivals {
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

//! Groups of stages that are linked by a fitted parameter that acts in several of them.

use crate::problem::simulator::Simulator;

/// Stages in groups that share no fitted parameter, each in order; the groups in the order of their first stage.
pub(crate) fn groups(simulator: &dyn Simulator) -> Vec<Vec<usize>> {
    let mut left: Vec<usize> = (0..simulator.stages().len()).collect();
    let mut out = Vec::new();
    while let Some(&first) = left.first() {
        let group = linked(simulator, &[first]);
        left.retain(|s| !group.contains(s));
        out.push(group);
    }
    out
}

/// Some stages with all that share a fitted parameter with one of them, in order.
pub(crate) fn linked(simulator: &dyn Simulator, stages: &[usize]) -> Vec<usize> {
    let specs = simulator.stages();
    let is_fitted = |p: &&usize| simulator.parameters()[**p].sd > 0.0;
    let mut all = stages.to_vec();
    let mut at = 0;
    while at < all.len() {
        for &p in specs[all[at]].parameters.iter().filter(is_fitted) {
            let more = (0..specs.len()).filter(|s| specs[*s].parameters.contains(&p));
            let more: Vec<usize> = more.filter(|s| !all.contains(s)).collect();
            all.extend(more);
        }
        at += 1;
    }
    all.sort_unstable();
    all
}

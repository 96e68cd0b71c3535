//! Groups of stages that are linked by fitted parameters that act in several stages.

use crate::problem::simulator::Simulator;

/// Divides the stages into groups that share no fitted parameter. Each group is in order, and the
/// groups are ordered by their first stages.
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

/// Returns the given stages and all stages linked to them, directly or through others, by a fitted
/// parameter, in order.
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

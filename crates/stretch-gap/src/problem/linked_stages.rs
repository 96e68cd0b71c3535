//! Groups of stages that share fitted parameters and must therefore be fitted together.

use crate::problem::simulator::Simulator;

/// Divides the stages into groups such that no fitted parameter acts in two groups. The stages of a
/// group are sorted, and the groups are sorted by their first stages.
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

/// Returns, sorted, the given stages and all stages that are linked to them by fitted parameters,
/// directly or through other stages.
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

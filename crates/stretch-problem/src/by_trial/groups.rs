//! Divides samples into runs: one run for each trial, or one for each value of a column.

use stretch_data::ends;
use stretch_gap::TrialSpec;

/// Samples that are fitted together, as indices into all trials concatenated.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Group {
    pub(super) name: String,
    pub(super) samples: Vec<usize>,
}

/// Greatest number of distinct values of a column that is set, such as a supply voltage. A column
/// with more values counts as measured.
const MOST_LEVELS: usize = 12;
/// Smallest share of the samples at which a column that is set repeats the value of the sample before.
const HELD: f64 = 0.9;
/// Smallest distance between the medians of two set-ups, as a share of the range of all medians.
/// The distance must also exceed the spread within every trial.
const APART: f64 = 0.1;
/// Number of groups into which the samples are divided at the quartiles of a column that changes within trials.
const PARTS: usize = 4;
/// Smallest number of samples of a group; smaller groups are dropped.
const FEWEST: usize = 20;

/// Returns one group for each trial.
pub(super) fn by_trial(trials: &[TrialSpec]) -> Vec<Group> {
    let each = TrialSpec::ranges(trials).into_iter().zip(trials);
    each.map(|(samples, trial)| Group { name: trial.name.clone(), samples: samples.collect() })
        .collect()
}

/// Returns one group for each value or set-up of a column.
///
/// - A column that is set (it repeats nine samples of ten and has at most twelve values) gives one
///   group for each value.
/// - A measured column that changes less within trials than between trials gives one group for the
///   trials of each set-up.
/// - Any other column is divided at its quartiles into four groups of equal size.
pub(super) fn by_column(name: &str, values: &[f64], trials: &[TrialSpec]) -> Vec<Group> {
    let bounds =
        levels(values).or_else(|| set_ups(values, trials)).unwrap_or_else(|| parts(values));
    let mut samples = vec![Vec::new(); bounds.len() + 1];
    for (i, value) in values.iter().enumerate() {
        samples[bounds.partition_point(|bound| bound <= value)].push(i);
    }
    let group = |samples: Vec<usize>| {
        let (low, high) = ends(samples.iter().map(|i| &values[*i]));
        Group { name: group_name(name, low, high), samples }
    };
    samples.into_iter().filter(|samples| samples.len() >= FEWEST).map(group).collect()
}

fn group_name(name: &str, low: f64, high: f64) -> String {
    let [low, high] = [low, high]
        .map(|x| format!("{:.4}", x).trim_end_matches('0').trim_end_matches('.').to_owned());
    if low == high { format!("{name} {low}") } else { format!("{name} {low} to {high}") }
}

/// Bounds between the values of a column that is set.
fn levels(values: &[f64]) -> Option<Vec<f64>> {
    let mut held: Vec<f64> = values.windows(2).filter(|w| w[0] == w[1]).map(|w| w[1]).collect();
    if (held.len() as f64) < HELD * values.len() as f64 {
        return None;
    }
    held.sort_by(f64::total_cmp);
    held.dedup();
    let bounds: Vec<f64> = held.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
    (bounds.len() < MOST_LEVELS).then_some(bounds)
}

/// Bounds between set-ups of a measured column. A bound lies between two neighbouring trial medians
/// whose distance exceeds the spread (5 to 95 %) within every trial.
fn set_ups(values: &[f64], trials: &[TrialSpec]) -> Option<Vec<f64>> {
    let mut medians = Vec::new();
    let mut widest = 0.0_f64;
    for range in TrialSpec::ranges(trials) {
        let mut own = values[range].to_vec();
        own.sort_by(f64::total_cmp);
        let at = |share: f64| own.get((share * own.len() as f64) as usize).copied();
        let (Some(low), Some(median), Some(high)) = (at(0.05), at(0.5), at(0.95)) else { continue };
        widest = widest.max(high - low);
        medians.push(median);
    }
    medians.sort_by(f64::total_cmp);
    let span = medians.last()? - medians.first()?;
    let least = (APART * span).max(widest);
    let apart = medians.windows(2).filter(|w| w[1] - w[0] > least);
    let bounds: Vec<f64> = apart.map(|w| 0.5 * (w[0] + w[1])).collect();
    (!bounds.is_empty()).then_some(bounds)
}

/// Bounds between parts of equal size.
fn parts(values: &[f64]) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let mut bounds: Vec<f64> =
        (1..PARTS).filter_map(|part| sorted.get(part * sorted.len() / PARTS).copied()).collect();
    bounds.dedup();
    bounds
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trials(count: usize, samples: usize) -> Vec<TrialSpec> {
        (0..count).map(|i| TrialSpec::new(&format!("t{i}"), samples, 0.0, false)).collect()
    }

    fn sizes(groups: &[Group]) -> Vec<(&str, usize)> {
        groups.iter().map(|g| (g.name.as_str(), g.samples.len())).collect()
    }

    #[test]
    fn a_column_that_is_set_has_a_group_for_each_value() {
        // Each trial has two values, and one sample between them that comes from interpolation onto
        // an even grid.
        let one = [vec![0.5; 50], vec![1.0], vec![2.0; 49]].concat();
        let groups = by_column("voltage_v", &[one.clone(), one].concat(), &trials(2, 100));
        assert_eq!(sizes(&groups), [("voltage_v 0.5 to 1", 102), ("voltage_v 2", 98)]);
    }

    #[test]
    fn trials_of_one_set_up_are_together_however_noisy_the_column_is() {
        let noisy = |level: f64| (0..100).map(move |i| level + 0.01 * f64::from(i * 37 % 10));
        let values: Vec<f64> = [3.0, 8.0, 3.1].into_iter().flat_map(noisy).collect();
        let groups = by_column("pull_n", &values, &trials(3, 100));
        assert_eq!(sizes(&groups), [("pull_n 3 to 3.19", 200), ("pull_n 8 to 8.09", 100)]);
    }

    #[test]
    fn a_column_that_moves_is_cut_into_four() {
        let values: Vec<f64> = (0..400).map(|i| f64::from(i * 7 % 400)).collect();
        let groups = by_column("angle_deg", &values, &trials(2, 200));
        assert_eq!(groups.len(), 4);
        assert!(groups.iter().all(|g| g.samples.len() == 100), "{:?}", sizes(&groups));
        assert_eq!(groups[3].name, "angle_deg 300 to 399");
    }

    #[test]
    fn a_column_that_never_changes_is_one_group() {
        assert_eq!(by_column("load_n", &[1.0; 100], &trials(1, 100)).len(), 1);
    }
}

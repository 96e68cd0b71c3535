//! Rows that a recorder loses.

use crate::support::Noise;

/// Removes rows of trials, as a recorder that loses rows does: each row except the first with the
/// probability `share`, or one row of every trial if `share` is 0.
pub(crate) fn with_lost_rows(
    trials: &[stretch_data::SessionTrial],
    share: f64,
    seed: u64,
) -> Vec<stretch_data::SessionTrial> {
    let mut noise = Noise(seed);
    let lose = |one: &stretch_data::SessionTrial| {
        let mut one = one.clone();
        let rows = one.trial.len();
        let single = 1 + (noise.unit() * (rows - 2) as f64) as usize;
        let kept: Vec<usize> = (0..rows)
            .filter(|&i| match share {
                0.0 => i != single,
                _ => i == 0 || noise.unit() >= share,
            })
            .collect();
        one.trial.time_s = kept.iter().map(|&i| one.trial.time_s[i]).collect();
        for channel in &mut one.trial.channels {
            channel.values = kept.iter().map(|&i| channel.values[i]).collect();
        }
        one
    };
    trials.iter().map(lose).collect()
}

/// Allowed change of the best candidate's probability if rows are lost: as much as between two
/// seeds of the noise.
pub(crate) const PROBABILITY: f64 = 0.1;

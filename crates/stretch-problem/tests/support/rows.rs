//! Rows that a recorder loses.

use crate::support::Noise;

/// Trials as a recorder leaves them that loses rows: each row but the first with a probability of `share`, or one row of
/// every trial when it is zero.
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

/// The best candidate's probability may move so far when rows are lost: as far as between two seeds of the noise.
pub(crate) const PROBABILITY: f64 = 0.1;

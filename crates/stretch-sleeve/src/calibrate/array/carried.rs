//! The contribution of each channel.

use serde::Serialize;

use super::parted::Parted;

/// Contribution of one channel to the estimate: errors on left-out data, in the reference's unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Carried {
    /// Column of the channel.
    pub signal: String,
    /// Root mean square error of this channel alone.
    pub rmse_alone: Option<f64>,
    /// Root mean square error of all others.
    pub rmse_without: Option<f64>,
    /// Share by which this channel reduces the mean squared error of the others; negative if it
    /// increases it.
    pub adds: Option<f64>,
}

/// The table of all channels, each judged as all together were.
pub(crate) fn carried(
    parted: &Parted,
    signals: &[String],
    together: f64,
    unit: f64,
) -> Vec<Carried> {
    let one = |(k, signal): (usize, &String)| {
        let others: Vec<usize> = (0..signals.len()).filter(|&c| c != k).collect();
        let alone = parted.choose(&[k]).map(|held| held.rmse);
        let without = match others.is_empty() {
            true => None,
            false => parted.choose(&others).map(|held| held.rmse),
        };
        Carried {
            signal: signal.clone(),
            rmse_alone: alone.map(|rmse| rmse * unit),
            rmse_without: without.map(|rmse| rmse * unit),
            adds: without.map(|without| 1.0 - (together / without).powi(2)),
        }
    };
    signals.iter().enumerate().map(one).collect()
}

//! Cross-validation: the rows are divided into parts, and each part is left out in turn.

use nalgebra::DVector;
use serde::Serialize;
use stretch_calibrate::toolkit::{LinearFactor, RowAccumulator, leave_one_out};

use crate::calibrate::{bank::Bank, channels::Channels};

/// Ridge penalties that are tried, as shares of a term's power.
const RIDGES: [f64; 5] = [1e-5, 1e-4, 1e-3, 1e-2, 1e-1];
/// Number of parts into which the data are divided if there are fewer than three trials.
const PARTS: usize = 6;
/// Seconds on either side of a left-out part that are not fitted either.
const GAP_S: f64 = 2.0;

/// Root mean square error on left-out data, and the chosen ridge penalties.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct HeldOut {
    pub(crate) rmse: f64,
    pub(crate) ridges: Vec<f64>,
}

/// Rows of all trials in parts.
pub(crate) struct Parted {
    pub(crate) terms: usize,
    /// Factor (triangle of a QR decomposition) of all rows, and for each part the factor of the
    /// rows outside it and its neighbouring samples.
    pub(crate) whole: LinearFactor,
    pub(crate) others: Vec<LinearFactor>,
    pub(crate) places: Places,
    pub(crate) parts: Vec<(f64, LinearFactor)>,
}

/// Assignment of samples to parts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Places {
    by_trial: bool,
    count: usize,
    total: usize,
}

impl Places {
    /// Returns the part of a sample. `at` is its index among the samples of all stretches (pieces
    /// without gaps).
    pub(crate) fn of(&self, trial: usize, at: usize) -> usize {
        if self.by_trial { trial } else { at * self.count / self.total }
    }
}

/// Divides the rows into parts for cross-validation: one part per trial if there are three or more,
/// otherwise six parts of equal length. Computes the factor of all rows, and for each part the factor
/// of the rows outside it.
pub(crate) fn parted(
    channels: &Channels,
    bank: &Bank,
    normalised: impl Fn(f64) -> f64,
    trials: usize,
) -> Option<Parted> {
    let terms = bank.terms();
    let total: usize = channels.stretches.iter().map(|s| s.len()).sum();
    let count = if trials >= 3 { trials } else { PARTS };
    let gap = if trials >= 3 { 0 } else { (GAP_S * channels.sample_rate.hz()) as usize };
    // For each part: its first rows, its middle rows and its last rows. If a neighbouring part is left out of a fit,
    // the rows at the adjoining end are left out as well.
    let mut sums: Vec<[RowAccumulator; 3]> =
        (0..count).map(|_| [0; 3].map(|_| RowAccumulator::new(terms))).collect();
    let mut rows = vec![0.0; count];
    let (mut row, mut scratch) = (Vec::new(), (Vec::new(), Vec::new()));
    let places = Places { by_trial: trials >= 3, count, total };
    for (before, stretch) in channels.placed() {
        for sample in stretch.warmed_up() {
            let at = before + sample;
            let part = places.of(stretch.trial, at);
            let (from, to) = (part * total / count, (part + 1) * total / count);
            let place = match gap {
                0 => 1,
                gap if at < from + gap => 0,
                gap if at + gap >= to => 2,
                _ => 1,
            };
            bank.fill(stretch.at(sample), &mut row, &mut scratch);
            sums[part][place].push(&row, normalised(stretch.reference[sample]));
            rows[part] += 1.0;
        }
    }
    let factors: Vec<[LinearFactor; 3]> =
        sums.into_iter().map(|own| own.map(RowAccumulator::factor)).collect();
    let joined = |own: &[LinearFactor; 3]| own[0].merged(&own[1]).merged(&own[2]);
    let parts: Vec<_> = rows.into_iter().zip(factors.iter().map(joined)).collect();
    let whole = parts.iter().map(|(_, f)| f.clone()).reduce(|a, b| a.merged(&b))?;
    let others = match gap {
        0 => leave_one_out(&parts.iter().map(|(_, f)| f.clone()).collect::<Vec<_>>())?.1,
        _ => (0..count).map(|left| without(&factors, left)).collect::<Option<_>>()?,
    };
    Some(Parted { terms, whole, others, places, parts })
}

/// Returns the factor of all rows except those of the part `left` and those of the adjoining ends
/// of its neighbours.
fn without(factors: &[[LinearFactor; 3]], left: usize) -> Option<LinearFactor> {
    let pieces = factors.iter().enumerate().flat_map(|(part, [first, middle, last])| {
        let mut own = Vec::new();
        if part != left {
            own.push(middle);
            if part != left + 1 {
                own.push(first);
            }
            if part + 1 != left {
                own.push(last);
            }
        }
        own
    });
    pieces.cloned().reduce(|a, b| a.merged(&b))
}

impl Parted {
    /// Returns the channel of a term.
    fn channel_of(term: usize) -> usize {
        (term - 1) / Bank::terms_a_channel()
    }

    /// Fits some channels by least squares with their ridge penalties. The coefficients of the
    /// other channels are zero.
    pub(crate) fn fit(
        &self,
        factor: &LinearFactor,
        keep: &[usize],
        ridges: &[f64],
    ) -> Option<DVector<f64>> {
        let stays = |term: usize| term == 0 || keep.contains(&Self::channel_of(term));
        let kept: Vec<usize> = (0..self.terms).filter(|&term| stays(term)).collect();
        let mut columns = kept.clone();
        columns.push(self.terms);
        let triangle = factor.triangle.select_columns(&columns).qr().unpack_r();
        let penalty = |place: usize, power: f64| match kept[place] {
            0 => 0.0,
            term => ridges[Self::channel_of(term)] * power.max(f64::MIN_POSITIVE),
        };
        let solution = LinearFactor { triangle }.solve(penalty)?;
        let mut weights = DVector::zeros(self.terms);
        kept.iter().zip(solution.weights).for_each(|(&term, w)| weights[term] = w);
        Some(weights)
    }

    /// Returns the root mean square error on the left-out parts.
    pub(crate) fn held_out(&self, keep: &[usize], ridges: &[f64]) -> Option<f64> {
        let (mut squares, mut count) = (0.0, 0.0);
        for ((rows, part), others) in self.parts.iter().zip(&self.others) {
            let weights = self.fit(others, keep, ridges)?;
            let with_value = weights.push(-1.0);
            squares += (&part.triangle * with_value).norm_squared();
            count += rows;
        }
        (count > 0.0).then(|| (squares / count).sqrt())
    }

    /// Returns the ridge penalties with the smallest error on the left-out parts, first one for all
    /// channels, then channel by channel.
    pub(crate) fn choose(&self, keep: &[usize]) -> Option<HeldOut> {
        let channels = (self.terms - 1) / Bank::terms_a_channel();
        let mut best: Option<HeldOut> = None;
        let try_these = |best: &mut Option<HeldOut>, ridges: Vec<f64>| {
            if let Some(rmse) = self.held_out(keep, &ridges)
                && best.as_ref().is_none_or(|b| rmse < b.rmse)
            {
                *best = Some(HeldOut { rmse, ridges });
            }
        };
        for ridge in RIDGES {
            try_these(&mut best, vec![ridge; channels]);
        }
        if keep.len() > 1 {
            for &channel in keep {
                for ridge in RIDGES.into_iter().chain([1.0, 100.0]) {
                    let mut ridges = best.as_ref()?.ridges.clone();
                    ridges[channel] = ridge;
                    try_these(&mut best, ridges);
                }
            }
        }
        best
    }
}

/// Contribution of one channel to the estimate, from errors on left-out data in the reference's
/// unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Carried {
    /// Column of the channel.
    pub signal: String,
    /// Root mean square error of this channel alone.
    pub rmse_alone: Option<f64>,
    /// Root mean square error of all other channels together.
    pub rmse_without: Option<f64>,
    /// Share by which this channel reduces the mean squared error of the others; negative if it
    /// increases that error.
    pub adds: Option<f64>,
}

/// Returns the contributions of all channels. `together` is the error of all channels together.
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

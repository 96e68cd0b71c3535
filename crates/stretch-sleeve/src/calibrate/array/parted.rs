//! Rows in parts, each of which is left out in turn.

use nalgebra::DVector;
use serde::Serialize;
use stretch_calibrate::toolkit::{LinearFactor, RowAccumulator, leave_one_out};

use crate::calibrate::{bank::Bank, channels::Channels};

/// Ridges that are tried, as shares of a term's power.
const RIDGES: [f64; 5] = [1e-5, 1e-4, 1e-3, 1e-2, 1e-1];
/// Number of parts into which trials are divided if there are fewer than three.
const PARTS: usize = 6;
/// Seconds next to a left-out part that are not fitted either.
const GAP_S: f64 = 2.0;

/// Root mean square error on data left out, and the ridges that were chosen.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct HeldOut {
    pub(crate) rmse: f64,
    pub(crate) ridges: Vec<f64>,
}

/// Rows of all trials, in parts, each of which is left out in turn.
pub(crate) struct Parted {
    pub(crate) terms: usize,
    /// Factors of the parts' rows, and of each part's with the samples next to it.
    pub(crate) whole: LinearFactor,
    pub(crate) others: Vec<LinearFactor>,
    pub(crate) places: Places,
    pub(crate) parts: Vec<(f64, LinearFactor)>,
}

/// Which part a sample is in.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Places {
    by_trial: bool,
    count: usize,
    total: usize,
}

impl Places {
    /// The part of a sample of a trial, which is the `at`-th of all stretches.
    pub(crate) fn of(&self, trial: usize, at: usize) -> usize {
        if self.by_trial { trial } else { at * self.count / self.total }
    }
}

/// The rows in parts; `None` if a part has fewer rows than terms.
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
    // of each part: the rows at its ends that its neighbours' fits leave out, and those within
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

/// The factor of all parts but one and the ends of its neighbours.
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
    /// The terms of a channel.
    fn channel_of(term: usize) -> usize {
        (term - 1) / Bank::terms_a_channel()
    }

    /// Least squares of some channels with their ridges; the coefficients of the others are zero.
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

    /// Root mean square error on the parts left out.
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

    /// The ridges with the smallest error on the left-out parts: one for all, then channel by
    /// channel.
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

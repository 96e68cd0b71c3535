//! Limits beyond which a gauge is reported as shifted against the others.
//!
//! Each part of the data is estimated by a fit without that part. The errors in a block are
//! therefore like those of another day with the same sensor.

use nalgebra::{DMatrix, DVector};
use stretch_calibrate::{CalibrateError, toolkit::LinearFactor};
use stretch_core::Values;
use stretch_metrics::student_t::critical;

use crate::{
    ArrayShifts, MAX_CHANNELS, SleeveError, block_of,
    calibrate::{
        bank::Bank,
        channels::{Channels, Levels, independent, levels},
        linear::Linear,
    },
};

use super::parted::Parted;

/// Length of a block, s: a few movements of a body or a muscle.
const BLOCK_S: f64 = 5.0;
/// Rate of false alarms per hour of all channels together. With the alarms for slips and for stuck
/// channels the sum is one per hour.
const FALSE_ALARMS_AN_HOUR: f64 = 0.25;
/// Smallest number of independent blocks, for three degrees of freedom.
const LEAST_BLOCKS: f64 = 4.0;

/// Measures the usual difference of each channel from the others, and its limit. Returns `None` for
/// a single channel or too little data.
pub(crate) fn shifts(
    parted: &Parted,
    channels: &Channels,
    linear: &Linear,
    ridges: &[f64],
) -> Result<Option<ArrayShifts<MAX_CHANNELS>>, SleeveError> {
    let count = linear.signals.len();
    if count < 2 {
        return Ok(None);
    }
    let undetermined = || CalibrateError::Undetermined { model: "array".into() };
    let contrasts = contrasts(parted, linear, ridges).ok_or_else(undetermined)?;
    let hz = linear.sample_rate_hz;
    let (samples_a_value, values_a_block) = block_of(hz, BLOCK_S);
    let gain = linear.zero_and_gain().1;
    let bank = Bank::new(linear.domains.clone());
    let (mut row, mut scratch) = (Vec::new(), (Vec::new(), Vec::new()));
    // For each channel: the means of blocks, for one stretch (piece without a gap) after another.
    let mut blocks: Vec<Vec<Vec<f64>>> = vec![Vec::new(); count];
    for (before, stretch) in channels.placed() {
        let samples: Vec<usize> = stretch.warmed_up().step_by(samples_a_value as usize).collect();
        blocks.iter_mut().for_each(|own| own.push(Vec::new()));
        for block in samples.chunks_exact(values_a_block as usize) {
            let mut sums = vec![0.0; count];
            for &sample in block {
                bank.fill(stretch.at(sample), &mut row, &mut scratch);
                let row = DVector::from_column_slice(&row);
                let of = &contrasts[parted.places.of(stretch.trial, before + sample)];
                for (sum, contrast) in sums.iter_mut().zip(of) {
                    *sum += gain * contrast.dot(&row) / block.len() as f64;
                }
            }
            for (own, mean) in blocks.iter_mut().zip(sums) {
                own.last_mut().into_iter().for_each(|stretch| stretch.push(mean));
            }
        }
    }
    let share = FALSE_ALARMS_AN_HOUR * BLOCK_S / 3600.0 / count as f64;
    let found: Option<Vec<(f64, f64)>> = blocks.iter().map(|own| limit(own, share)).collect();
    let Some(found) = found else { return Ok(None) };
    let (usual, limits): (Vec<f64>, Vec<f64>) = found.into_iter().unzip();
    Ok(Some(ArrayShifts {
        block_s: BLOCK_S,
        false_alarms_an_hour: FALSE_ALARMS_AN_HOUR,
        usual: Values::new("usual", &usual)?,
        limits: Values::new("limits", &limits)?,
    }))
}

/// Returns for each part and each channel the coefficients of the estimate from that channel alone
/// minus those of the estimate from all others, fitted without that part.
fn contrasts(parted: &Parted, linear: &Linear, ridges: &[f64]) -> Option<Vec<Vec<DVector<f64>>>> {
    let count = linear.signals.len();
    let everything: Vec<usize> = (0..count).collect();
    let of_part = |factor: &LinearFactor| {
        let weights = parted.fit(factor, &everything, ridges)?;
        let terms = parted.terms;
        let gram: DMatrix<f64> =
            factor.triangle.tr_mul(&factor.triangle).view((0, 0), (terms, terms)).into_owned();
        let own = Linear { weights: weights.iter().copied().collect(), gram, ..linear.clone() };
        let one = |k: usize| {
            let others: Vec<usize> = everything.iter().copied().filter(|&c| c != k).collect();
            Some(own.remaining(&[k])?.0 - own.remaining(&others)?.0)
        };
        (0..count).map(one).collect()
    };
    parted.others.iter().map(of_part).collect()
}

/// Returns the mean of the blocks, and the deviation from it that a further block exceeds with
/// probability `share`.
fn limit(stretches: &[Vec<f64>], share: f64) -> Option<(f64, f64)> {
    let Levels { mean, variance, alike, count } = levels(stretches)?;
    let (independent, sd) = independent(count, variance, alike.clamp(0.0, 0.99));
    if !(independent >= LEAST_BLOCKS && variance > 0.0) {
        return None;
    }
    let t = critical(share, (independent - 1.0).floor());
    Some((mean, t * sd * (1.0 + 1.0 / independent).sqrt()))
}

#[cfg(test)]
mod tests {
    use testkit::random::Random;

    use super::limit;

    /// Simulates how often a further block exceeds the limits from `blocks` blocks. Neighbouring
    /// blocks have the correlation `alike`.
    fn exceeds(blocks: usize, share: f64, alike: f64) -> f64 {
        let mut random = Random::new(30);
        let draws = 20_000;
        let mut beyond = 0.0;
        for _ in 0..draws {
            let mut at = random.noise();
            let own: Vec<f64> = (0..blocks)
                .map(|_| {
                    at = alike * at + (1.0 - alike * alike).sqrt() * random.noise();
                    3.0 + 0.5 * at
                })
                .collect();
            let Some((mean, limit)) = limit(&[own], share) else { continue };
            let further = 3.0 + 0.5 * random.noise();
            beyond += f64::from(u8::from((further - mean).abs() > limit));
        }
        beyond / f64::from(draws)
    }

    #[test]
    fn a_further_block_exceeds_the_limit_as_often_as_is_said() {
        // Tolerance: three binomial standard deviations of 20,000 draws.
        let room = |share: f64| 3.0 * (share * (1.0 - share) / 20_000.0).sqrt();
        for blocks in [6, 12, 60] {
            let share = exceeds(blocks, 0.05, 0.0);
            // If independent blocks appear correlated by chance, the limits only become wider.
            assert!(share < 0.05 + room(0.05), "{blocks} blocks: {share}");
            assert!(share > 0.02, "{blocks} blocks: {share}");
        }
        let share = exceeds(60, 0.05, 0.6);
        assert!(share < 0.08, "alike: {share}");
        assert_eq!(limit(&[vec![1.0, 2.0, 3.0]], 0.05), None);
    }
}

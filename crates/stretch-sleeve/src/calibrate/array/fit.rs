//! Fits one model of many channels. Each channel has a ridge penalty that is chosen by
//! cross-validation.

use stretch_calibrate::{
    CalibrateError,
    toolkit::{extent, pooled_range, provenance},
};
use stretch_core::{Interval, Normalisation, Target};
use stretch_data::Trial;

use crate::{
    SleeveError, SleeveFit, SleeveOptions,
    calibrate::{channels::Channels, linear::Linear},
};

use super::{
    parted::{Carried, carried, parted},
    shifts::shifts,
    watch::Still,
};

/// Note on data that are too short to show the usual differences between channels.
const TOO_SHORT: &str = "the trials are too short to detect later whether a gauge has shifted relative to the others: record at least a minute";

/// Errors of a calibration of several gauges.
#[derive(Debug, Clone)]
pub struct ArraySummary {
    /// The contribution of each channel.
    pub carried: Vec<Carried>,
    /// Root mean square error on data left out, in the reference's unit.
    pub rmse: f64,
}

/// Fits one linear model of all channels and their memories.
///
/// Each channel has its own ridge penalty. Penalties are chosen by cross-validation, first one for
/// all channels, then channel by channel. Each trial is left out in turn. With fewer than three
/// trials, each sixth of all data is left out in turn, and two seconds on either side of it are
/// excluded from the fit as well.
///
/// # Errors
/// [`SleeveError`], which names the trial and column.
pub fn calibrate_array(
    trials: &[Trial],
    options: &SleeveOptions,
) -> Result<SleeveFit<ArraySummary>, SleeveError> {
    let channels = Channels::new(trials, &options.signals, &options.reference)?;
    let undetermined = || CalibrateError::Undetermined { model: "array".into() };
    let longest = extent(channels.reference()).max;
    let target = match options.rest_length {
        Some(rest_length) => Target::Contraction { rest_length },
        None if options.reference.starts_with("length") => {
            Target::Contraction { rest_length: longest }
        }
        None => Target::Direct,
    };
    let seen = extent(channels.reference().map(|x| target.from_reference(x)));
    let target_range = pooled_range(&options.reference, Normalisation::MinMax, 0.0, seen)?;
    let estimate = [seen.min, seen.max].map(|end| target_range.normalise(end));
    let bank = channels.bank();
    if bank.domains.iter().flatten().any(|d| d.min >= d.max) {
        return Err(undetermined().into());
    }
    let normalised = |x: f64| target_range.normalise(target.from_reference(x));
    let parted = parted(&channels, &bank, normalised, trials.len()).ok_or_else(undetermined)?;
    let everything: Vec<usize> = (0..options.signals.len()).collect();
    let held = parted.choose(&everything).ok_or_else(undetermined)?;
    let weights = parted.fit(&parted.whole, &everything, &held.ridges).ok_or_else(undetermined)?;
    let count: f64 = parted.parts.iter().map(|(rows, _)| rows).sum();
    let triangle = &parted.whole.triangle;
    let terms = parted.terms;
    let gram = (triangle.tr_mul(triangle) / count).view((0, 0), (terms, terms)).into_owned();
    let unit = target.reference_per_normalised(target_range).abs();
    let carried = carried(&parted, &options.signals, held.rmse, unit);
    let linear = Linear {
        signals: options.signals.clone(),
        reference: options.reference.clone(),
        sample_rate_hz: channels.sample_rate.hz(),
        target,
        target_range,
        estimate: Interval { min: estimate[0], max: estimate[1] },
        domains: bank.domains,
        weights: weights.iter().copied().collect(),
        gram,
        variance: held.rmse * held.rmse,
        samples: count as u64,
        still: Still::of(&channels),
        zero_moves: Vec::new(),
    };
    let shifts = shifts(&parted, &channels, &linear, &held.ridges)?;
    let mut notes = channels.notes.clone();
    if shifts.is_none() && options.signals.len() > 1 {
        notes.push(TOO_SHORT.into());
    }
    let columns = options.signals.iter().chain([&options.reference]);
    let provenance = provenance(&options.date, trials, columns).with_time(&options.time);
    Ok(SleeveFit {
        calibration: linear.record(Some(&channels), shifts, provenance)?,
        summary: ArraySummary { carried, rmse: held.rmse * unit },
        notes,
    })
}

//! A calibration on logs that are too long to be held as a whole, pass by pass over blocks of rows.
//!
//! ```text
//! pass 1   values in clusters                 -> what has a gross error
//! pass 2   extents, covariance, noise, count  -> ranges, polarity, dead band
//! pass 3   extents of the rates by branch     -> ranges of the rates
//! pass 4   a triangle a branch and fold       -> the fit
//! pass 5   counts in parts of the extent      -> the least movement
//! pass 6   movements, from block to block     -> where they turn
//! ```
//!
//! A block is treated as the part of a trial behind a gap: at its beginning the estimator of the rate warms up again,
//! which costs ten samples of hundreds of thousands. The noise is the median of the noises of the blocks. Everything
//! else equals the result of [`calibrate`](crate::calibrate) for the whole log.

use std::cell::RefCell;

use stretch_core::{Model, Provenance};
use stretch_files::Checksum;

use crate::{
    CalibrateError, Calibrated, FitReport, ModelKind, Options, Robust, SplitBy,
    blocks::{GrossErrors, LONGEST, Log},
    passes::Passes,
    turns::holding,
    twice::fitted_twice,
};

/// Whether a calibration can be fitted block by block: lines and surfaces can, by least squares, with samples
/// assigned to the branches one by one. Models that remember are searched on the whole log, and robust weights need
/// the residuals of the whole log.
pub fn is_plain(options: &Options) -> bool {
    !matches!(options.model, ModelKind::Remembering { .. })
        && options.robust == Robust::Off
        && options.split == SplitBy::Rate
}

/// Fits a calibration to trials that are read block by block, six times; `names` are the names of the trials.
///
/// The memory used is that of one block, however long the log is. Gross errors of signal and reference are removed as
/// in [`without_gross_errors`](crate::without_gross_errors).
///
/// # Errors
/// The errors of [`calibrate`](crate::calibrate), those of the log, and [`CalibrateError::TooLong`] where the options
/// are not [`is_plain`].
///
/// ```
/// use stretch_calibrate::{Options, calibrate, calibrate_long};
/// use stretch_data::{Channel, Trial};
/// # let time_s: Vec<f64> = (0..6000).map(|n| f64::from(n) * 0.01).collect();
/// # let length_mm: Vec<f64> = time_s.iter().map(|t| 165.0 + 15.0 * (0.7 * t).cos()).collect();
/// # let bridge_v = length_mm.iter().map(|l| 1.24 + 0.03 * (180.0 - l)).collect();
/// # let channel = |name: &str, values| Channel { name: name.into(), values };
/// # let channels = vec![channel("length_mm", length_mm), channel("bridge_v", bridge_v)];
/// # let trial = Trial { name: "loop".into(), time_s, channels };
/// let options = Options::default();
/// let block = |from: usize, to: usize| Trial {
///     name: trial.name.clone(),
///     time_s: trial.time_s[from..to].to_vec(),
///     channels: trial.channels.iter()
///         .map(|c| Channel { name: c.name.clone(), values: c.values[from..to].to_vec() })
///         .collect(),
/// };
/// let long = calibrate_long(
///     &["loop".into()],
///     &|take| (0..6000).step_by(2000).try_for_each(|from| take(0, block(from, from + 2000))),
///     &options,
/// )?;
/// let whole = calibrate(std::slice::from_ref(&trial), &options)?;
/// assert_eq!(long.calibration.signal_range, whole.calibration.signal_range);
/// approx::assert_relative_eq!(long.fits[0].r_squared, whole.fits[0].r_squared, epsilon = 1e-6);
/// # Ok::<(), stretch_calibrate::CalibrateError>(())
/// ```
pub fn calibrate_long(
    names: &[String],
    log: &Log<'_>,
    options: &Options,
) -> Result<Calibrated, CalibrateError> {
    let too_long = || CalibrateError::TooLong { model: options.model.to_string(), most: LONGEST };
    if !is_plain(options) {
        return Err(too_long());
    }
    let columns = [options.reference.as_str(), options.signal.as_str()];
    let gross = GrossErrors::of(log, columns)?;
    // the rows that are fitted are those that a record tells its trials by
    let checksums = RefCell::new(vec![Checksum::default(); names.len()]);
    let summed: &Log<'_> = &|take| {
        log(&mut |trial, block| {
            let block = gross.without(block);
            if let Some(own) = checksums.borrow_mut().get_mut(trial) {
                block.add_to(own, &[&options.signal, &options.reference]);
            }
            take(trial, block)
        })
    };
    let long = Passes { log, gross: &gross, options, trials: names.len() };
    let (prepared, seen) = Passes { log: summed, ..long }.prepared(names)?;
    let (model, fits) = match options.model {
        ModelKind::Linear => long.line(&prepared, seen.samples)?,
        ModelKind::Surface(degree) => long.surfaces(&prepared, degree, seen.samples)?,
        ModelKind::Blended(degree) => match long.surfaces(&prepared, degree, seen.samples)? {
            (Model::Surfaces { inflation, deflation }, fits) => {
                (Model::Blended { inflation, deflation }, fits)
            }
            other => other,
        },
        // `is_plain` refused this model above
        ModelKind::Remembering { .. } => return Err(too_long()),
    };
    let mut notes = gross.sentences.clone();
    notes.extend(prepared.notes.iter().cloned());
    if !matches!(options.model, ModelKind::Linear) {
        notes.extend(fits.iter().filter_map(FitReport::note));
    }
    let names = names.iter().map(String::as_str);
    let checksums: Vec<u32> = checksums.borrow().iter().map(Checksum::value).collect();
    notes.extend(fitted_twice(names.clone(), checksums.iter().copied().map(Some)));
    let provenance = Provenance::new(&options.date, names).with_checksums(checksums);
    let calibration = prepared.calibration(model, provenance)?;
    let turns = long.turns(&calibration, &seen, &prepared)?;
    Ok(Calibrated { calibration: holding(calibration, turns)?, fits, notes })
}

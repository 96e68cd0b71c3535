//! Acceptance criteria: whether a calibration can be used, and whether a log belongs to it.

use stretch_core::{Label, Provenance};
use stretch_data::{Trial, in_digits};

use crate::{
    fit::FitReport,
    prepare::{DEGREES_IN_A_RADIAN, Line, without_gross_errors},
};

use super::{
    doubt::Doubt,
    evaluate::{MethodErrors, TrialErrors},
};

/// A fit explains nothing if its error exceeds this share of the reference's standard deviation: a constant estimate,
/// the mean of the reference, would then have an error that is at most about 5 % larger. (The same margin decides
/// between models.)
const LEFT: f64 = 0.95;

/// Returns why a fit should not be used: its error is about that of a constant estimate, the mean of the reference.
///
/// ```text
/// sqrt(1 - R^2) > 0.95,  R^2 < 0.0975
/// ```
///
/// Returns `None` for any other fit. Typical causes are errors of the reference (a placeholder that the recorder writes
/// for a missing value), a sensor that is not connected, or a column with another quantity.
pub fn explains_nothing(fits: &[FitReport]) -> Option<String> {
    let worst = fits.iter().min_by(|a, b| a.r_squared.total_cmp(&b.r_squared))?;
    let left = (1.0 - worst.r_squared).max(0.0).sqrt();
    (left > LEFT || worst.r_squared.is_nan()).then(|| {
        format!(
            "the {} explains nothing: R^2 is {:.4}, so that its error is {:.0} % of the error of a constant, the mean of \
             the reference; plot signal and reference (possible causes: the sensor is not connected, a column holds \
             another quantity, or the recorder writes a placeholder for missing values)",
            worst.name,
            worst.r_squared,
            100.0 * left
        )
    })
}

/// Returns a sentence for a fit that explains less than half of the reference's variance; `None` for any other fit.
pub fn explains_little(fits: &[FitReport]) -> Option<String> {
    let worst = fits.iter().min_by(|a, b| a.r_squared.total_cmp(&b.r_squared))?;
    (worst.r_squared < 0.5).then(|| {
        let (name, r_squared) = (&worst.name, worst.r_squared);
        format!(
            "the {name} explains less than half of the variance of the reference: R^2 is {r_squared:.4}"
        )
    })
}

/// Returns a doubt for a log if more than half of its samples lie outside the calibrated domain.
///
/// Most estimates of such a log are computed from inputs that are clamped to the ends of the domain.
pub fn outside_range(clamped: u64, samples: u64) -> Option<Doubt> {
    let text = (2 * clamped > samples).then(|| {
        format!(
            "{} % of the samples have a signal or a rate of change outside the range of the calibration, and were limited to it: the \
             estimates are less accurate there; calibrate on trials with this range and these speeds",
            share(clamped, samples)
        )
    });
    text.map(|text| Doubt::new("outside_range", text))
}

/// Returns a doubt if estimates are missing after the first estimate of a trial, because the errors do not include
/// these samples. Samples before the first estimate belong to the warm-up and cause no doubt.
pub(super) fn without_estimate<'a>(trials: impl Iterator<Item = &'a [f64]>) -> Option<Doubt> {
    let (mut missing, mut all) = (0, 0);
    for estimates in trials {
        let after = estimates.iter().skip_while(|estimate| estimate.is_nan());
        missing += after.filter(|estimate| estimate.is_nan()).count();
        all += estimates.len();
    }
    let percent = whole_percent(missing, all)?;
    let text = format!(
        "{percent} % of the samples have no estimate, and the errors are those of the others"
    );
    Some(Doubt::new("without_estimate", text))
}

/// Returns a doubt if the estimates have a larger error than a constant estimate, the mean of the reference.
pub(super) fn worse_than_the_mean(errors: &MethodErrors) -> Option<Doubt> {
    let text = (errors.r_squared < 0.0).then(|| {
        let r_squared = errors.r_squared;
        format!(
            "its error is larger than that of a constant, the mean of the reference (R^2 {r_squared:.4}): this log does \
             not belong to that calibration, or its reference is another quantity than that of the calibration"
        )
    });
    text.map(|text| Doubt::new("worse_than_the_mean", text))
}

/// Constant error, in percent of the range of the reference, above which it is always reported.
const FAR_OFF_PERCENT: f64 = 5.0;
/// A smaller constant error is reported if it is more than this percentage of the range, and several times the RMSE of
/// the fit.
const OFF_PERCENT: f64 = 1.0;
const SEVERAL: f64 = 5.0;

/// Formats a number with its unit.
fn with_unit(x: f64, unit: &str) -> String {
    format!("{} {unit}", in_digits(x, 4)).trim_end().to_owned()
}

/// Largest ratio of the RMSE without the mean error to the RMSE of the fit at which a shift is the only fault of the
/// estimates.
const ALIKE: f64 = 1.25;

/// Returns a doubt if the estimates of a trial are shifted. Two conditions must hold. First, the mean error exceeds 5 %
/// of the range, or both 1 % of the range and five times the error of the fit. Second, the mean error is at least half
/// of the mean square, or the error without the mean error is about that of the fit:
///
/// ```text
/// |bias| > min(0.05 range, max(0.01 range, 5 fit))  and
/// (bias^2 >= rmse^2 / 2,  or  sqrt(rmse^2 - bias^2) <= 1.25 fit < rmse)
/// ```
///
/// Here `fit` is the RMSE of the fit, and `range` the range of the reference, both in the unit of the reference.
pub(super) fn off_throughout(
    errors: &MethodErrors,
    (fit_rmse, range): (f64, f64),
    unit: &str,
) -> Option<Doubt> {
    let MethodErrors { bias, rmse, .. } = *errors;
    let least = (0.01 * OFF_PERCENT * range).max(SEVERAL * fit_rmse);
    let is_far = bias.abs() > least.min(0.01 * FAR_OFF_PERCENT * range);
    let unshifted = (rmse * rmse - bias * bias).max(0.0).sqrt();
    let alike = ALIKE * fit_rmse;
    let is_shift = unshifted <= bias.abs() || (unshifted <= alike && alike < rmse);
    let text = (is_far && is_shift).then(|| {
        let side = if bias > 0.0 { "above" } else { "below" };
        format!(
            "was the sensor put on again? The estimate is shifted: it is {} {side} the reference on average. Without this shift, the \
             RMSE would be {} instead of {}. Calibrate again: half a minute of reference is enough (stretch calibrate --model auto; \
             several gauges: with a prior of earlier sessions, --prior)",
            with_unit(bias.abs(), unit),
            with_unit(unshifted, unit),
            with_unit(rmse, unit)
        )
    });
    text.map(|text| Doubt::new("constant_error", text))
}

/// Returns a doubt if the estimates of a trial are later or earlier than the reference by a constant time, and this
/// time causes most of the error:
///
/// ```text
/// rmse > 1.25 fit  and  mean of (estimate(t + lag) - reference(t))^2 <= rmse^2 / 2
/// ```
pub(super) fn delayed(
    trial: &TrialErrors,
    method: usize,
    fit_rmse: f64,
    unit: &str,
) -> Option<Doubt> {
    let MethodErrors { rmse, lag_s, .. } = trial.methods[method];
    let (first, last) = (trial.time_s.first()?, trial.time_s.last()?);
    let samples = (lag_s? * (trial.time_s.len() - 1) as f64 / (last - first)).round();
    let (late, early) = (samples.max(0.0) as usize, (-samples).max(0.0) as usize);
    let estimates = trial.estimates[method].iter().skip(late);
    let pairs = estimates.zip(trial.reference.iter().skip(early));
    let errors = pairs.map(|(estimate, truth)| estimate - truth).filter(|error| error.is_finite());
    let (sum, count) = errors.fold((0.0, 0.0), |(sum, n), error| (sum + error * error, n + 1.0));
    let undelayed = (sum / f64::max(count, 1.0)).sqrt();
    let is_most = samples != 0.0 && 2.0 * undelayed * undelayed <= rmse * rmse;
    let text = (is_most && rmse > ALIKE * fit_rmse).then(|| {
        let ms = 1e3 * lag_s.unwrap_or_default().abs();
        let [side, shift] = match samples > 0.0 {
            true => ["after".to_owned(), format!("subtract {ms:.0} ms from")],
            false => ["before".to_owned(), format!("add {ms:.0} ms to")],
        };
        format!(
            "the estimate comes {ms:.0} ms {side} the reference, and without this delay the RMSE would be {} instead of {}. If two \
             recorders did not start together, {shift} the times of the signal; if they did, calibrate again",
            with_unit(undelayed, unit),
            with_unit(rmse, unit)
        )
    });
    text.map(|text| Doubt::new("delayed", text))
}

/// Factors between units of a reference: decimal prefixes, and degrees in a radian.
const FACTORS: [f64; 4] = [10.0, 100.0, 1000.0, DEGREES_IN_A_RADIAN];

/// Returns a doubt if the reference of a trial falls while the estimates rise, or if it is in another unit. `line` is
/// the regression line of the reference over the estimates. Without such a mistake its slope is about 1.
pub(super) fn other_reference(line: &Line, reference: &str) -> Option<Doubt> {
    let doubt = |text| Some(Doubt::new("other_reference", text));
    if !line.is_clear() {
        return None;
    }
    let slope = line.slope();
    if slope < 0.0 {
        return doubt(format!(
            "the estimate rises while {reference} falls: is {reference} (such as 180 minus the angle), or the signal, reversed? Convert \
             it with stretch convert --column '{reference}={reference}*-1+180', with its own offset"
        ));
    }
    let factors = FACTORS.into_iter().flat_map(|factor| [factor, 1.0 / factor]);
    let factor = factors.into_iter().find(|factor| (slope * factor - 1.0).abs() < 0.2)?;
    let is_angle = [factor, 1.0 / factor].contains(&DEGREES_IN_A_RADIAN);
    let example = if is_angle { ", such as radians and degrees" } else { "" };
    doubt(format!(
        "{reference} changes by {} for 1 of the estimate: are they in different units{example}? Convert it with stretch convert \
         --column '{reference}={reference}*{}'",
        in_digits(slope, 4),
        in_digits(factor, 6)
    ))
}

/// Returns a doubt if the reference is constant, because R^2 is then undefined.
pub(super) fn beside_a_constant(errors: &MethodErrors) -> Option<Doubt> {
    let text = (!errors.r_squared.is_finite()).then(|| {
        format!(
            "the reference is constant, so that R^2 is undefined, and the mean absolute error is {:.4}: is the reference connected?",
            errors.mae
        )
    });
    text.map(|text| Doubt::new("constant_reference", text))
}

/// Returns a doubt that lists the trials to which a calibration was fitted; `None` if there are none. `columns` are the
/// signals and the reference. The calibration stores names and checksums of its first trials. A trial with the checksum
/// of a fitted trial is recognised even if it was renamed. If only the names are equal, the doubt says so.
pub fn fitted_trials(provenance: &Provenance, columns: &[&str], trials: &[Trial]) -> Option<Doubt> {
    let is_known = |trial: &Trial| {
        let checksum = trial.checksum(columns);
        checksum.is_some_and(|sum| provenance.checksums().contains(&sum))
    };
    // A fit leaves out rows with gross errors, and its checksums are those of the remaining rows.
    let cleaned = |trial: &Trial| {
        let reversed: Vec<&str> = columns.iter().rev().copied().collect();
        let (kept, _) = without_gross_errors(vec![trial.clone()], &reversed);
        kept.iter().any(is_known)
    };
    let has_checksums = !provenance.checksums().is_empty();
    let fitted = trials.iter().filter_map(|trial| {
        let label = Label::truncated(&trial.name);
        let is_named = provenance.trials().any(|fitted| fitted == label.as_str());
        let how = match has_checksums && (is_known(trial) || cleaned(trial)) {
            true if is_named => "",
            true => " (under another name)",
            false if !is_named => return None,
            false if has_checksums => " (only the name is the same: its samples differ)",
            false => "",
        };
        Some(format!("{}{how}", trial.name))
    });
    let fitted: Vec<String> = fitted.collect();
    let text = (!fitted.is_empty()).then(|| {
        format!(
            "it was fitted on {}, so that these numbers do not show how good it is on other trials; evaluate trials that were not used for the fit",
            fitted.join(", ")
        )
    });
    text.map(|text| Doubt::new("fitted_trials", text))
}

/// Returns a share in whole percent; `None` if it is less than half a percent.
pub(super) fn whole_percent(part: usize, of: usize) -> Option<f64> {
    Some((100.0 * part as f64 / of as f64).round()).filter(|percent| *percent > 0.0)
}

/// Returns a share in percent. It is 100 only if `part` equals `of`.
fn share(part: u64, of: u64) -> f64 {
    let percent = 100.0 * part as f64 / of.max(1) as f64;
    if part < of { (10.0 * percent).floor() / 10.0 } else { percent }
}

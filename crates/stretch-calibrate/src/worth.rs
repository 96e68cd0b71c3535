//! Whether a calibration is worth having, and whether a log is one of its own.

use crate::{FitReport, MethodErrors};

/// A fit that leaves this share of the reference's standard deviation explains nothing: the mean of
/// the reference alone would err as little, but for a twentieth. (A twentieth is also what a model
/// may cost before another form is preferred.)
const LEFT: f64 = 0.95;

/// Why a fit should not be used: it errs as somebody would who knows the mean and no signal.
///
/// ```text
/// sqrt(1 - R^2) > 0.95,  R^2 < 0.0975
/// ```
///
/// None for a fit that explains more. An error of the reference itself (a value that the recorder
/// writes where it has none), a sensor that is not connected, or a column that is another's look
/// like that.
pub fn explains_nothing(fits: &[FitReport]) -> Option<String> {
    let worst = fits.iter().min_by(|a, b| a.r_squared.total_cmp(&b.r_squared))?;
    let left = (1.0 - worst.r_squared).max(0.0).sqrt();
    (left > LEFT || worst.r_squared.is_nan()).then(|| {
        format!(
            "the {} explains nothing: R^2 is {:.4}, so that its error is {:.0} % of what the mean of the reference alone \
             would err; look at signal and reference side by side (a sensor that is not connected, a column of \
             something else, values that the recorder makes up)",
            worst.name,
            worst.r_squared,
            100.0 * left
        )
    })
}

/// What to say of a fit that leaves more of the reference than it explains; none of one that does not.
pub fn explains_little(fits: &[FitReport]) -> Option<String> {
    let worst = fits.iter().min_by(|a, b| a.r_squared.total_cmp(&b.r_squared))?;
    (worst.r_squared < 0.5).then(|| {
        let (name, r_squared) = (&worst.name, worst.r_squared);
        format!("the {name} leaves more of the reference than it explains: R^2 is {r_squared:.4}")
    })
}

/// What to say of a log most of whose samples lie where the calibration was not fitted.
///
/// Most: the estimates of such a log are those of the domain's ends more often than not.
pub fn not_its_own(clamped: u64, samples: u64) -> Option<String> {
    (2 * clamped > samples).then(|| {
        format!(
            "{} % of the samples lie outside of what was calibrated and were clamped to it: is this a log of that \
             sensor, in that unit? If it is, calibrate on trials that reach as far",
            share(clamped, samples)
        )
    })
}

/// What to say of estimates that are further from the reference than its mean is.
pub fn worse_than_the_mean(errors: &MethodErrors) -> Option<String> {
    (errors.r_squared < 0.0).then(|| {
        let r_squared = errors.r_squared;
        format!(
            "it errs more than the mean of the reference would (R^2 {r_squared:.4}): this log does not belong to \
             that calibration, or its reference is not what was calibrated on"
        )
    })
}

/// In percent, and never 100 where something is left.
fn share(part: u64, of: u64) -> f64 {
    let percent = 100.0 * part as f64 / of.max(1) as f64;
    if part < of { (10.0 * percent).floor() / 10.0 } else { percent }
}

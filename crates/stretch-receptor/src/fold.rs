//! Numbers that every receptor folds out of a calibration.

use stretch_core::{Calibration, Range};

/// Reference units per normalised target, and the reference at a target of zero.
pub(crate) fn output(calibration: &Calibration) -> (f64, f64) {
    let range: Range = calibration.target_range;
    let target = calibration.target;
    (target.reference_per_target() * range.span(), target.to_reference(range.offset()))
}

/// The dead band as a rate of the reference, by the ratio of the two ranges.
pub(crate) fn reference_dead_band(calibration: &Calibration) -> f64 {
    let (gain, _) = output(calibration);
    calibration.dead_band * (gain / calibration.signal_range.span()).abs()
}

/// What a first-order low-pass of time constant `tau_s` takes up in a sample:
/// exact for a signal that holds between samples.
pub(crate) fn share_of(period_s: f64, tau_s: f64) -> f64 {
    -libm::expm1(-period_s / tau_s)
}

//! Whether samples come as often as a calibration takes them to.

use stretch_calibrate::PACE_TOLERANCE;
use stretch_core::Calibration;

/// Number of intervals that determine the pace.
const INTERVALS: usize = 51;

/// The usual interval of a stream beside the calibration's.
#[derive(Debug)]
pub(super) struct Pace {
    rate_hz: f64,
    needs_signal_only: bool,
    last_s: Option<f64>,
    intervals_s: Vec<f64>,
    is_told: bool,
}

impl Pace {
    pub(super) fn of(calibration: &Calibration) -> Self {
        let rate_hz = calibration.spec().sample_rate_hz.hz();
        let needs_signal_only = calibration.spec().model.needs_signal_only();
        Self { rate_hz, needs_signal_only, last_s: None, intervals_s: Vec::new(), is_told: false }
    }

    /// Takes the time of a sample; says so, once, where the usual interval is another. Each sample that does not come in
    /// time counts as one that is missing, so that a slower stream has right rates, but gaps; a faster
    /// one has wrong rates.
    pub(super) fn take(&mut self, time_s: f64) -> Option<String> {
        let before_s = self.last_s.replace(time_s)?;
        if self.is_told || time_s <= before_s {
            return None;
        }
        self.intervals_s.push(time_s - before_s);
        if self.intervals_s.len() < INTERVALS {
            return None;
        }
        self.is_told = true;
        let mut sorted = std::mem::take(&mut self.intervals_s);
        sorted.sort_by(f64::total_cmp);
        let usual_s = sorted[INTERVALS / 2];
        // stamps of a coarse clock have the right interval on average only
        let near = &sorted[..sorted.partition_point(|interval_s| *interval_s <= 2.5 * usual_s)];
        let mean_s = near.iter().sum::<f64>() / near.len() as f64;
        let (share, rate_hz) = (usual_s * self.rate_hz, self.rate_hz);
        let is_usual = |interval_s: f64| (interval_s * rate_hz - 1.0).abs() <= PACE_TOLERANCE;
        if is_usual(usual_s) || is_usual(mean_s) {
            return None;
        }
        let what = if self.needs_signal_only {
            "its estimates are right, the rates are not"
        } else if share < 1.0 {
            "its rates, and estimates that rest on them, are wrong"
        } else {
            "the samples in between count as missing"
        };
        Some(format!(
            "{:.4} samples a second come where the calibration was recorded at {rate_hz:.4}: {what}; log at that rate, or bring \
             the log there with stretch convert --grid {rate_hz}",
            1.0 / usual_s
        ))
    }
}

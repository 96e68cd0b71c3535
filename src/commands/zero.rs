//! What `stretch apply` tells of the zero of a single gauge.

use stretch_data::unit;
use stretch_sleeve::{GaugeCalibration, Turns, Zero};

use crate::{display::warn, table::number};

/// Tells when a zero has shifted, once until it is back.
pub(super) struct Told {
    turns: Option<Turns>,
    period_s: f64,
    unit: String,
    /// The name of the trial, with a colon; empty of a stream.
    trial: String,
    shifted: bool,
    needs_signal_only: bool,
    last: Option<Zero<f64>>,
}

impl Told {
    pub(super) fn of(gauge: &GaugeCalibration, trial: &str) -> Self {
        let calibration = gauge.calibration();
        Self {
            turns: gauge.turns().copied(),
            period_s: calibration.spec().sample_rate_hz.period_s(),
            unit: unit(calibration.spec().reference.as_str()).unwrap_or_default().to_string(),
            trial: if trial.is_empty() { String::new() } else { format!("{trial}: ") },
            shifted: false,
            needs_signal_only: calibration.spec().model.needs_signal_only(),
            last: None,
        }
    }

    /// What a movement said that ended at a time.
    pub(super) fn take(&mut self, time_s: f64, zero: &Zero<f64>) {
        if let Some(turns) = self.turns.filter(|_| zero.has_shifted && !self.shifted) {
            let usual = |limit: f64| number((limit * turns.reference_per_signal).abs());
            warn(format!(
                "stretch: {}put on again? The zero is {} {unit} off since {:.2} s; usual is up to {} {unit} over five movements and {} {unit} over \
                 some twenty, with {} false alarms an hour. Calibrate again",
                self.trial,
                number(zero.off_reference.abs()),
                time_s - f64::from(zero.since_samples) * self.period_s,
                usual(turns.limit),
                usual(turns.mean_limit),
                turns.false_alarms_an_hour,
                unit = self.unit,
            ));
        }
        self.shifted = zero.has_shifted;
        self.last = Some(*zero);
    }

    /// How far the zero was followed, and that a record tells no shifts.
    pub(super) fn end(&self) {
        let Some(turns) = self.turns else {
            // a load cell need not move
            if self.needs_signal_only {
                return;
            }
            return warn(
                "the calibration does not hold where movements turn: whether the gauge was put on again is not told",
            );
        };
        if let Some(zero) = self.last.filter(|zero| zero.followed != 0.0) {
            let followed = number(zero.followed * turns.reference_per_signal);
            warn(format!("the zero was followed, by {followed} {} at the end", self.unit));
        }
    }
}

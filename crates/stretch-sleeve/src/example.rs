//! The calibration that is used in the examples of the documentation.

use stretch_core::{DesignError, Interval, Label, Provenance, SampleRate, Schema, Values};

use crate::{ArrayCalibration, ArrayChannel, ArrayGains, ArrayShifts, ArraySpec};

/// Returns the calibration of two gauges on a knee: 1 to 2 V for 0 to 90 degrees, with a memory of 0.3 s. Either gauge
/// may be lost.
///
/// ```
/// assert_eq!(stretch_sleeve::example_array().spec().channels.len(), 2);
/// ```
pub fn example_array() -> ArrayCalibration<2> {
    array().expect("the parts are constants and in range")
}

fn array() -> Result<ArrayCalibration<2>, DesignError> {
    let channel = |name: &str, follows: [f64; 2]| {
        Ok::<_, DesignError>(ArrayChannel {
            signal: Label::new(name)?,
            state_min: Values::new("state_min", &[1.0, -0.5])?,
            state_max: Values::new("state_max", &[2.0, 0.5])?,
            possible: Interval { min: 0.5, max: 2.5 },
            still_samples: 0,
            follows: Values::new("follows", &follows)?,
            largest_jump: 0.1,
        })
    };
    let gains = |of: [&[f64]; 2]| {
        let terms = of.iter().map(|own| Values::new("terms", own)).collect::<Result<_, _>>()?;
        Ok::<_, DesignError>(ArrayGains { constant: 45.0, terms, sd: 2.0 })
    };
    let [half, whole]: [&[f64]; 2] = [&[22.5, 1.0], &[45.0, 2.0]];
    ArrayCalibration::new(ArraySpec {
        schema: Schema::CURRENT,
        reference: Label::new("angle_deg")?,
        sample_rate_hz: SampleRate::new(100.0)?,
        relaxations_s: Values::new("relaxations_s", &[0.3])?,
        degree: 1,
        memory_degree: 1,
        estimate_domain: Interval { min: 0.0, max: 90.0 },
        channels: [channel("front_v", [0.0, 1.0])?, channel("back_v", [1.0, 0.0])?]
            .into_iter()
            .collect(),
        all: gains([half, half])?,
        without: [gains([&[], whole])?, gains([whole, &[]])?].into_iter().collect(),
        alone: [gains([whole, &[]])?, gains([&[], whole])?].into_iter().collect(),
        shifts: Some(ArrayShifts {
            block_s: 5.0,
            false_alarms_an_hour: 0.25,
            usual: Values::new("usual", &[0.0, 0.0])?,
            limits: Values::new("limits", &[6.0, 6.0])?,
        }),
        provenance: Provenance::new("", ["example"]),
    })
}

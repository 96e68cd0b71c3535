//! Proptest strategies for the types of this crate: ranges, surfaces, calibrations.
//!
//! ```
//! use proptest::prelude::*;
//! use stretch_core::strategies;
//! proptest!(|(range in strategies::range(), x in -1e3..1e3)| {
//!     let back = range.denormalise(range.normalise(x));
//!     prop_assert!((back - x).abs() <= 1e-9 * (1.0 + x.abs() + range.offset().abs()));
//! });
//! ```

extern crate std;

use std::vec::Vec;

use proptest::{collection, prelude::*};

use crate::{
    BranchSurface, Calibration, CalibrationSpec, Degree, FitSummary, Interval, Label, LinearMap,
    Model, Normalisation, Polarity, Provenance, Range, RangeSpec, RateEstimator, RateSource,
    SampleRate, Schema, Surface, Target,
};

/// Either way of normalising.
pub fn normalisation() -> impl Strategy<Value = Normalisation> {
    prop_oneof![Just(Normalisation::Range), Just(Normalisation::MinMax)]
}

/// Ranges of any mode, offset -100..100 and span 1e-3..1e3.
pub fn range() -> impl Strategy<Value = Range> {
    (normalisation(), -100.0..100.0, -100.0..100.0, -3.0..3.0).prop_map(
        |(mode, zero, min, log_span)| {
            let max = min + 10f64.powf(log_span);
            Range::new(RangeSpec { mode, zero, min, max }).expect("a span above zero")
        },
    )
}

/// Every degree from poly00 to poly55.
pub fn degree() -> impl Strategy<Value = Degree> {
    (0u8..=5, 0u8..=5).prop_map(|(rate, volts)| Degree::new(rate, volts).expect("at most 5"))
}

/// Surfaces of a given degree with coefficients in -3..3.
pub fn surface_of(degree: Degree) -> impl Strategy<Value = Surface> {
    collection::vec(-3.0..3.0, degree.terms()).prop_map(move |coefficients: Vec<f64>| {
        Surface::new(degree, &coefficients).expect("one finite coefficient a term")
    })
}

/// Surfaces of any degree with coefficients in -3..3.
pub fn surface() -> impl Strategy<Value = Surface> {
    degree().prop_flat_map(surface_of)
}

/// Rate estimators that can run live.
pub fn live_rate_estimator() -> impl Strategy<Value = RateEstimator> {
    prop_oneof![
        (3u16..=25, 1u8..=3).prop_flat_map(|(window, degree)| {
            let degree = degree.min((window - 1) as u8);
            (0..window / 2 + 1).prop_map(move |delay| RateEstimator::SavitzkyGolay {
                window,
                degree,
                delay,
            })
        }),
        (1.0..20.0).prop_map(|cutoff_hz| RateEstimator::Differentiator { cutoff_hz }),
        (1e-3..1.0).prop_map(|tracking_index| RateEstimator::Tracker { tracking_index }),
    ]
}

fn fit_summary() -> impl Strategy<Value = FitSummary> {
    (10u64..1_000_000, 0.0..1.0, 0.0..0.2).prop_map(|(samples, r_squared, rmse)| FitSummary {
        samples,
        r_squared,
        rmse,
    })
}

fn branch_surface(signal: Interval) -> impl Strategy<Value = BranchSurface> {
    (surface(), 0.1..10.0f64, normalisation(), fit_summary()).prop_map(
        move |(surface, rate, mode, fit)| BranchSurface {
            rate_range: Range::new(RangeSpec { mode, zero: 0.0, min: -rate, max: rate })
                .expect("a span above zero"),
            surface,
            signal_domain: signal,
            rate_domain: Interval { min: -rate, max: rate },
            fit,
        },
    )
}

/// Calibrations of every model, estimator, normalisation and polarity, for a
/// signal of 1..2 V or so.
pub fn calibration() -> impl Strategy<Value = Calibration> {
    let signal = (normalisation(), 0.5..1.5, 0.2..2.0).prop_map(|(mode, min, span)| {
        Range::new(RangeSpec { mode, zero: min, min, max: min + span }).expect("a span above zero")
    });
    let polarity = prop_oneof![Just(Polarity::Rising), Just(Polarity::Falling)];
    let target = prop_oneof![
        (50.0..500.0).prop_map(|rest_length| Target::Contraction { rest_length }),
        Just(Target::Direct),
    ];
    (signal, polarity, target, live_rate_estimator(), 0.0..0.5).prop_flat_map(
        |(signal_range, polarity, target, rate_estimator, dead_band)| {
            let domain = Interval { min: signal_range.min(), max: signal_range.max() };
            let linear =
                (-3.0..3.0, -1.0..1.0, fit_summary()).prop_map(move |(slope, intercept, fit)| {
                    Model::Linear(LinearMap { slope, intercept, signal_domain: domain, fit })
                });
            let surfaces = (branch_surface(domain), branch_surface(domain))
                .prop_map(|(inflation, deflation)| Model::Surfaces { inflation, deflation });
            prop_oneof![linear, surfaces].prop_map(move |model| {
                Calibration::new(CalibrationSpec {
                    schema: Schema::CURRENT,
                    signal: Label::truncated("bridge_v"),
                    reference: Label::truncated("length_mm"),
                    sample_rate_hz: SampleRate::new(100.0).expect("above zero"),
                    target,
                    polarity,
                    signal_range,
                    target_range: Range::new(RangeSpec {
                        mode: Normalisation::MinMax,
                        zero: 0.0,
                        min: 0.0,
                        max: 0.17,
                    })
                    .expect("a span above zero"),
                    rate_estimator,
                    rate_source: RateSource::Voltage,
                    dead_band,
                    model,
                    provenance: Provenance::new("", ["generated"]),
                })
                .expect("every part is in range")
            })
        },
    )
}

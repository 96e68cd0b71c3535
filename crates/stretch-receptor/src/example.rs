//! The calibrations that the documentation's examples use.

use stretch_core::{
    BranchSurface, Calibration, CalibrationSpec, DesignError, DiagnosedMap, Fading, FitSummary,
    Interval, Label, Model, Normalisation, ObserverMap, Plays, Polarity, Poly13, Provenance, Range,
    RangeSpec, RateEstimator, RateSource, RestTracker, SampleRate, Schema, Target, Values,
};

/// The surfaces of the published method ("the paper", section 3.2) as a calibration, for an 180 mm muscle and a bridge
/// that rises from 1.24 V by 1 V over the stroke.
///
/// The calibration is for examples and tests. The paper prints no ranges, so the ranges here are plausible, not
/// published.
///
/// ```
/// use stretch_core::Model;
/// let calibration = stretch_receptor::example_calibration();
/// assert!(matches!(calibration.spec().model, Model::Surfaces { .. }));
/// ```
pub fn example_calibration() -> Calibration {
    build().expect("the parts are constants and in range")
}

/// An observer as fitted by `stretch calibrate --model observer+rest` on the simulated rig that resembles the
/// paper's: a gauge that overshoots by 40 % over a quarter of a second, behind a curve that flattens towards full
/// contraction.
///
/// ```
/// use stretch_core::Model;
/// let calibration = stretch_receptor::example_observer();
/// assert!(matches!(calibration.spec().model, Model::Observer(_)));
/// ```
pub fn example_observer() -> Calibration {
    observer().expect("the parts are constants and in range")
}

/// A gauge with two named defects, as fitted by `stretch calibrate --model diagnosed`: the gauge overshoots by a
/// fifth over a quarter of a second, and its sleeve slips by 2 % of the stroke.
///
/// ```
/// use stretch_core::Model;
/// let calibration = stretch_receptor::example_diagnosed();
/// assert!(matches!(calibration.spec().model, Model::Diagnosed(_)));
/// ```
pub fn example_diagnosed() -> Calibration {
    diagnosed().expect("the parts are constants and in range")
}

fn diagnosed() -> Result<Calibration, DesignError> {
    let observer = observer()?;
    let Model::Observer(map) = observer.spec().model else {
        return Err(observer.spec().model.instead_of("observer"));
    };
    let map = DiagnosedMap {
        slip: Some(Plays { share: 1.0, radii: [0.007, 0.01, 0.013] }),
        relaxation: Some(Fading { share: 0.2, taus_s: [0.15, 0.25, 0.4] }),
        initial_hysteresis: [-1.0, 1.0],
        curve: map.curve,
        drive_domain: map.drive_domain,
        noise: 0.005,
        agility: 10.0,
        steady_s: 1.0,
        spread: 1.0,
        estimate_domain: map.estimate_domain,
        fit: map.fit,
        ..DiagnosedMap::default()
    };
    Calibration::new(CalibrationSpec { model: Model::Diagnosed(map), ..observer.into_spec() })
}

fn observer() -> Result<Calibration, DesignError> {
    let mut curve = [0.0; 25];
    for (k, volts) in curve.iter_mut().enumerate() {
        let x = k as f64 / 24.0;
        *volts = 1.24 + x * (1.64 - 0.82 * x);
    }
    let map = ObserverMap {
        rest: Some(RestTracker { level: 1.243, catch_up_s: 0.02, leak: 0.0 }),
        curve: Values::new("curve", &curve)?,
        drive_domain: Interval { min: -0.0025, max: 1.0716 },
        relaxations_s: Values::new("relaxations_s", &[0.2475])?,
        amplitudes: Values::new("amplitudes", &[0.397])?,
        lead_s: 0.0123,
        radii: Values::EMPTY,
        play_weights: Values::EMPTY,
        noise: 0.0115,
        agility: 1.0,
        estimate_domain: Interval { min: 0.0, max: 1.0 },
        fit: FitSummary { samples: 29860, r_squared: 0.9991, rmse: 0.0126 },
    };
    let spec = CalibrationSpec { model: Model::Observer(map), ..build()?.into_spec() };
    Calibration::new(spec)
}

fn build() -> Result<Calibration, DesignError> {
    let range =
        |zero, min, max| Range::new(RangeSpec { mode: Normalisation::Range, zero, min, max });
    let branch = |surface: Poly13, rate_range, rate_domain, r_squared, rmse| BranchSurface {
        rate_range,
        surface: surface.into(),
        signal_domain: Interval { min: 1.1, max: 2.06 },
        rate_domain,
        fit: FitSummary { samples: 9000, r_squared, rmse },
    };
    let inflation = Poly13 {
        p00: 0.058,
        p10: 0.001,
        p01: 0.774,
        p11: -0.121,
        p02: 2.30,
        p12: 0.094,
        p03: -2.26,
    };
    let deflation = Poly13 {
        p00: 0.225,
        p10: -0.218,
        p01: 0.825,
        p11: -0.773,
        p02: -0.481,
        p12: 1.05,
        p03: 0.564,
    };
    Calibration::new(CalibrationSpec {
        schema: Schema::CURRENT,
        signal: Label::new("bridge_v")?,
        reference: Label::new("length_mm")?,
        sample_rate_hz: SampleRate::new(100.0)?,
        target: Target::Contraction { rest_length: 180.0 },
        polarity: Polarity::Rising,
        signal_range: range(1.24, 1.1, 2.1)?,
        target_range: range(0.0, 0.0, 0.165)?,
        rate_estimator: RateEstimator::SAVGOL_11_2,
        rate_source: RateSource::Strain,
        dead_band: 0.02,
        model: Model::Surfaces {
            inflation: branch(
                inflation,
                range(0.0, 0.0, 8.0)?,
                Interval { min: 0.0, max: 8.0 },
                0.9934,
                0.02851,
            ),
            deflation: branch(
                deflation,
                range(0.0, -6.0, 0.0)?,
                Interval { min: -6.0, max: 0.0 },
                0.9943,
                0.01821,
            ),
        },
        provenance: Provenance::new("", ["published coefficients"]),
    })
}

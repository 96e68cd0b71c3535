//! The complete pipeline, built directly from the crates. Copy this example as a starting point.
//!
//! A logged trial of a liquid-metal strain gauge on an artificial muscle becomes
//! a calibration (two poly13 surfaces, as in the paper), the calibration becomes
//! a receptor, and the receptor turns voltage into length, one sample at a time.
//!
//! Run with: `cargo run --release --example liquid_wire`

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stretch_core::{
    Branch, BranchSurface, Calibration, CalibrationSpec, Degree, Design, FitSummary, Interval,
    Label, Model, Normalisation, Polarity, Provenance, Range, RangeSpec, RateEstimator, RateSource,
    Runner, SampleRate, Schema, Stage, Target, Volts,
};
use stretch_filter::SgRate;
use stretch_fit::{Sample, SurfaceAccumulator};
use stretch_metrics::{Agreement, Delta, Pair};
use stretch_receptor::StretchReceptor;

const REST_LENGTH_MM: f64 = 180.0;
const SEED: u64 = 20;

/// Simulates a trial: a muscle that shortens by up to 29 mm, and a gauge with a delay of 40 ms, a
/// nonlinearity, and 2 mV of noise.
fn record(seed: u64, seconds: f64) -> (Vec<f64>, Vec<f64>) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let phase = 6.0 * random.random::<f64>();
    let contraction = |t: f64| 0.08 - 0.08 * (1.9 * t + phase).cos() * (0.23 * t).cos();
    let samples = (seconds * 100.0) as u32;
    (0..samples)
        .map(|n| {
            let t = f64::from(n) * 0.01;
            let stretch = contraction(t - 0.04);
            let noise_v = 0.002 * (2.0 * random.random::<f64>() - 1.0);
            let bridge_v = 1.24 + 6.0 * stretch - 9.0 * stretch * stretch + noise_v;
            (REST_LENGTH_MM * (1.0 - contraction(t)), bridge_v)
        })
        .unzip()
}

fn range(zero: f64, values: &[f64]) -> Result<Range, stretch_core::DesignError> {
    let min = values.iter().copied().fold(f64::INFINITY, f64::min);
    let max = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Range::new(RangeSpec { mode: Normalisation::Range, zero, min, max })
}

fn calibrate(
    length_mm: &[f64],
    bridge_v: &[f64],
) -> Result<Calibration, Box<dyn std::error::Error>> {
    let sample_rate = SampleRate::new(100.0)?;
    let dead_band = 0.05; // volts per second

    // 1. the rate of the voltage, with the estimator that is used live
    let mut rate = Runner::new(SgRate::<f64, 11, 1>::new(sample_rate)?);
    let rates: Vec<Option<f64>> = bridge_v.iter().map(|&v| rate.step(v)).collect();

    // 2. assign each sample to the branch given by its rate
    let mut branches: [Vec<Sample<f64>>; 2] = [Vec::new(), Vec::new()];
    let mut branch = Branch::Inflation;
    let target = Target::Contraction { rest_length: REST_LENGTH_MM };
    for ((&length, &volts), rate) in length_mm.iter().zip(bridge_v).zip(&rates) {
        let Some(rate) = *rate else { continue };
        branch = branch.next(rate, dead_band);
        let row = Sample { rate, volts, value: target.from_reference(length) };
        branches[usize::from(branch == Branch::Deflation)].push(row);
    }

    // 3. normalise by the total range, and fit one surface per branch
    let signal_range = range(1.24, bridge_v)?;
    let contractions: Vec<f64> = length_mm.iter().map(|&l| target.from_reference(l)).collect();
    let target_range = range(0.0, &contractions)?;
    let fit = |rows: &[Sample<f64>]| -> Result<BranchSurface, Box<dyn std::error::Error>> {
        let rates: Vec<f64> = rows.iter().map(|row| row.rate).collect();
        let volts: Vec<f64> = rows.iter().map(|row| row.volts).collect();
        let (rate_range, volts_range) = (range(0.0, &rates)?, range(0.0, &volts)?);
        let mut sums = SurfaceAccumulator::<f64>::new(Degree::POLY13);
        for row in rows {
            sums.push(Sample {
                rate: rate_range.normalise(row.rate),
                volts: signal_range.normalise(row.volts),
                value: target_range.normalise(row.value),
            })?;
        }
        let fit = sums.fit()?;
        Ok(BranchSurface {
            rate_range,
            surface: fit.surface(),
            signal_domain: Interval { min: volts_range.min(), max: volts_range.max() },
            rate_domain: Interval { min: rate_range.min(), max: rate_range.max() },
            fit: FitSummary {
                samples: fit.samples(),
                r_squared: fit.r_squared().unwrap_or(0.0),
                rmse: fit.rmse().unwrap_or(0.0),
            },
        })
    };
    let (inflation, deflation) = (fit(&branches[0])?, fit(&branches[1])?);

    // 4. the calibration: the data for a board, and their provenance
    Ok(Calibration::new(CalibrationSpec {
        schema: Schema::CURRENT,
        signal: Label::new("bridge_v")?,
        reference: Label::new("length_mm")?,
        sample_rate_hz: sample_rate,
        target,
        polarity: Polarity::Rising,
        signal_range,
        target_range,
        rate_estimator: RateEstimator::SavitzkyGolay { window: 11, degree: 1, delay: 0 },
        rate_source: RateSource::Voltage,
        dead_band,
        model: Model::Surfaces { inflation, deflation },
        provenance: Provenance::new("", ["simulated trial"]),
    })?)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("seed {SEED}");
    let (length_mm, bridge_v) = record(SEED, 120.0);
    let calibration = calibrate(&length_mm, &bridge_v)?;
    if let Model::Surfaces { inflation, deflation } = &calibration.spec().model {
        for (name, surface) in [("inflation", inflation), ("deflation", deflation)] {
            println!(
                "{name}: {} samples, R^2 {:.4}, RMSE {:.2} % of the stroke",
                surface.fit.samples,
                surface.fit.r_squared,
                100.0 * surface.fit.rmse
            );
        }
    }

    // live: f32, one voltage every 10 ms; channels share the design, and each has its own memory
    let rate = SgRate::<f32, 11, 1>::new(SampleRate::new(100.0)?)?;
    let receptor = StretchReceptor::with_rate(&calibration, rate)?;
    let mut memory = receptor.memory();
    let mut agreement = Agreement::<f64>::new();
    let (length_mm, bridge_v) = record(SEED + 1, 60.0);
    for (&truth, &volts) in length_mm.iter().zip(&bridge_v) {
        if let Ok(reading) = receptor.step(&mut memory, Volts(volts as f32)) {
            agreement.push(Pair { truth, estimate: f64::from(reading.length().0) });
        }
    }
    let rmse_mm = agreement.errors().rmse().ok_or("no sample was estimated")?;
    let percent = agreement.average_error_percent(Delta::Truth).ok_or("no sample")?;
    println!("another trial: RMSE {rmse_mm:.3} mm, average error {percent:.2} % of the stroke");
    assert!(rmse_mm < 0.5, "the gauge lags by 40 ms; its rate makes up for most of that");
    Ok(())
}

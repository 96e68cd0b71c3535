//! Fits of poly13 from slices of rate, volts and value to seven coefficients, compared with
//! nalgebra's QR in the same run.
//!
//! The surface is ill-conditioned: raw volts between 1.23 and 1.25, condition number about 1e8. The
//! relative error of the coefficients (norm) is printed first, because speed is irrelevant if the
//! result is wrong. `reference/fit/numpy_lstsq_speed.py` measures NumPy on the same data.

use std::{hint::black_box, time::Duration};

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::{DMatrix, DVector};
use stretch_core::Degree;
use stretch_fit::{Factor, Sample, SurfaceAccumulator};

const TERMS: usize = Degree::POLY13.terms();

/// Order of the coefficients: p00 p10 p01 p11 p02 p12 p03.
const TRUTH: [f64; 7] = [0.058, 0.001, 0.774, -0.121, 2.30, 0.094, -2.26];

struct Log {
    rates: Vec<f64>,
    volts: Vec<f64>,
    values: Vec<f64>,
}

/// Two golden-ratio sequences fill the rectangle evenly, with the same values in any language.
fn log(samples: usize, centre: f64, width: f64) -> Log {
    let fraction = |k: usize, step: f64| (k as f64 * step).fract();
    let rates: Vec<f64> =
        (0..samples).map(|k| 2.0 * fraction(k, 0.754_877_666_246_692_7) - 1.0).collect();
    let volts: Vec<f64> = (0..samples)
        .map(|k| centre + width * (fraction(k, 0.569_840_290_998_053_2) - 0.5))
        .collect();
    let values = rates.iter().zip(&volts).map(|(&r, &v)| surface(r, v)).collect();
    Log { rates, volts, values }
}

fn surface(r: f64, v: f64) -> f64 {
    let [p00, p10, p01, p11, p02, p12, p03] = TRUTH;
    p00 + p01 * v + p02 * v * v + p03 * v * v * v + r * (p10 + p11 * v + p12 * v * v)
}

fn streamed<const ROWS: usize>(log: &Log) -> [f64; 7] {
    let mut sums = SurfaceAccumulator::<f64, TERMS, ROWS>::of::<1, 3>();
    for ((&rate, &volts), &value) in log.rates.iter().zip(&log.volts).zip(&log.values) {
        sums.push(Sample { rate, volts, value }).expect("a finite sample");
    }
    sums.fit().expect("full rank").coefficients().try_into().expect("seven coefficients")
}

fn nalgebra_qr(log: &Log) -> [f64; 7] {
    let rows = log.rates.len();
    let mut a = DMatrix::zeros(rows, 7);
    for (k, (&r, &v)) in log.rates.iter().zip(&log.volts).enumerate() {
        for (j, x) in [1.0, r, v, r * v, v * v, r * v * v, v * v * v].into_iter().enumerate() {
            a[(k, j)] = x;
        }
    }
    let mut z = DVector::from_column_slice(&log.values);
    let qr = a.qr();
    qr.q_tr_mul(&mut z);
    let r = qr.r();
    let c = r.solve_upper_triangular(&z.rows(0, 7).into_owned()).expect("full rank");
    c.as_slice().try_into().expect("seven coefficients")
}

fn relative_error(found: &[f64; 7]) -> f64 {
    let norm = |x: &mut dyn Iterator<Item = f64>| x.map(|e| e * e).sum::<f64>().sqrt();
    norm(&mut found.iter().zip(TRUTH).map(|(f, t)| f - t)) / norm(&mut TRUTH.into_iter())
}

fn fits(criterion: &mut Criterion) {
    let small = log(100_000, 1.24, 0.02);
    eprintln!("relative error, 1e5 samples, raw volts 1.23 .. 1.25:");
    eprintln!("  streamed, 128 rows  {:.1e}", relative_error(&streamed::<128>(&small)));
    eprintln!("  nalgebra QR         {:.1e}", relative_error(&nalgebra_qr(&small)));

    let samples = 1_000_000;
    let log = log(samples, 1.24, 0.02);
    eprintln!("relative error, 1e6 samples:");
    eprintln!("  streamed, 128 rows  {:.1e}", relative_error(&streamed::<128>(&log)));
    let mut group = criterion.benchmark_group("poly13_from_1e6_samples");
    group.throughput(Throughput::Elements(samples as u64)).sample_size(10);
    group.warm_up_time(Duration::from_secs(1)).measurement_time(Duration::from_secs(3));
    group.bench_function("streamed_16_rows", |b| b.iter(|| streamed::<16>(black_box(&log))));
    group.bench_function("streamed_64_rows", |b| b.iter(|| streamed::<64>(black_box(&log))));
    group.bench_function("streamed_128_rows", |b| b.iter(|| streamed::<128>(black_box(&log))));
    group.bench_function("streamed_256_rows", |b| b.iter(|| streamed::<256>(black_box(&log))));
    group.bench_function("nalgebra_qr", |b| b.iter(|| nalgebra_qr(black_box(&log))));
    group.finish();
}

fn merges(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("merge_two_factors");
    let halves: [Factor<f64, TERMS>; 2] = [1.24, 1.26].map(|centre| {
        let log = log(10_000, centre, 0.02);
        let mut sums = SurfaceAccumulator::<f64, TERMS, 64>::of::<1, 3>();
        for ((&rate, &volts), &value) in log.rates.iter().zip(&log.volts).zip(&log.values) {
            sums.push(Sample { rate, volts, value }).expect("a finite sample");
        }
        sums.factor()
    });
    group.bench_with_input(BenchmarkId::from_parameter("poly13"), &halves, |b, [one, other]| {
        b.iter(|| {
            let mut sum = *black_box(one);
            sum.merge(black_box(other)).expect("one degree");
            sum
        });
    });
    group.finish();
}

criterion_group!(benches, fits, merges);
criterion_main!(benches);

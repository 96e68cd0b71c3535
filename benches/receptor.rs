//! The live step of a receptor, compared with a hand-written kernel that does nothing but the arithmetic. The time of
//! the kernel is a lower limit.
//!
//! One step: normalise, causal 11-point Savitzky-Golay rate, branch, poly13, denormalise. The
//! kernel uses a transposed filter, evaluates both surfaces and selects one. It has no domain
//! check, no dead band, no handling of missing samples, and no rate of the length.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use stretch_core::{Design, Model, Poly13, SampleRate, Stage, Volts};
use stretch_filter::SgRate;
use stretch_receptor::{StretchReceptor, example_calibration};

const SAMPLES: usize = 4096;

fn stream() -> Vec<f64> {
    (0..SAMPLES).map(|n| 1.6 + 0.3 * (0.03 * n as f64).sin() * (0.0041 * n as f64).cos()).collect()
}

struct Limit {
    taps: [f64; 11],
    surfaces: [Poly13; 2],
    signal: (f64, f64),
    rate_scale: [f64; 2],
    target: (f64, f64),
}

impl Limit {
    fn new() -> Self {
        let calibration = example_calibration();
        let Model::Surfaces { inflation, deflation } = &calibration.spec().model else {
            unreachable!("the example has surfaces")
        };
        let poly = |s: &stretch_core::Surface| s.as_poly13().expect("poly13");
        let (signal, target) = (calibration.spec().signal_range, calibration.spec().target_range);
        let per_target = calibration.spec().target.reference_per_target();
        Self {
            taps: *SgRate::<f64, 11, 2>::new(SampleRate::new(100.0).expect("above zero"))
                .expect("a design")
                .taps(),
            surfaces: [poly(&inflation.surface), poly(&deflation.surface)],
            signal: (signal.offset(), 1.0 / signal.span()),
            rate_scale: [1.0 / inflation.rate_range.span(), 1.0 / deflation.rate_range.span()],
            target: (
                calibration.spec().target.to_reference(target.offset()),
                per_target * target.span(),
            ),
        }
    }

    #[inline(always)]
    fn step(&self, state: &mut [f64; 11], volts: f64) -> f64 {
        let rate = state[0] + self.taps[0] * volts;
        for i in 0..10 {
            state[i] = state[i + 1] + self.taps[i + 1] * volts;
        }
        let v = (volts - self.signal.0) * self.signal.1;
        let up = self.surfaces[0].eval(rate * self.rate_scale[0], v);
        let down = self.surfaces[1].eval(rate * self.rate_scale[1], v);
        self.target.0 + self.target.1 * if rate >= 0.0 { up } else { down }
    }
}

fn live_step(c: &mut Criterion) {
    let stream = stream();
    let mut group = c.benchmark_group("live step, f64");
    group.throughput(Throughput::Elements(SAMPLES as u64));

    let limit = Limit::new();
    group.bench_function("limit: arithmetic alone", |b| {
        let mut state = [0.0; 11];
        b.iter(|| black_box(&stream).iter().map(|&v| limit.step(&mut state, v)).sum::<f64>());
    });

    let calibration = example_calibration();
    let rate = SgRate::<f64, 11, 2>::new(calibration.spec().sample_rate_hz).expect("a design");
    let receptor = StretchReceptor::with_rate(&calibration, rate).expect("valid");
    group.bench_function("receptor, shape in the type, length", |b| {
        let mut memory = receptor.memory();
        b.iter(|| {
            let lengths = black_box(&stream).iter();
            lengths
                .map(|&v| receptor.step(&mut memory, Volts(v)).map_or(0.0, |r| r.estimate))
                .sum::<f64>()
        });
    });
    group.bench_function("receptor, shape in the type, length and rate", |b| {
        let mut memory = receptor.memory();
        b.iter(|| {
            let readings = black_box(&stream).iter();
            readings
                .map(|&v| receptor.step(&mut memory, Volts(v)).map_or(0.0, |r| r.estimate + r.rate))
                .sum::<f64>()
        });
    });
    let general = StretchReceptor::<f64>::new(&calibration).expect("valid");
    group.bench_function("receptor, shape from the calibration, length and rate", |b| {
        let mut memory = general.memory();
        b.iter(|| {
            let readings = black_box(&stream).iter();
            readings
                .map(|&v| general.step(&mut memory, Volts(v)).map_or(0.0, |r| r.estimate + r.rate))
                .sum::<f64>()
        });
    });
    group.finish();
}

criterion_group!(benches, live_step);
criterion_main!(benches);

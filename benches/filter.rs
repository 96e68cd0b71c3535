//! One step of a Savitzky-Golay rate (11 taps) and of a biquad, per sample,
//! and one step of `sci-rs`, `biquad` and `idsp` in the same run.
//!
//! Before the timing, the results of all candidates are checked for agreement. The ratios that are printed first come
//! from alternating rounds. Other load on the machine then slows all candidates equally. Criterion's own figures
//! follow.

use std::{
    hint::black_box,
    time::{Duration, Instant},
};

use biquad::Biquad as _;
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use dsp_process::SplitProcess;
use sci_rs::signal::filter::savgol_filter_dyn;
use stretch_core::{Hertz, RateEstimator, Runner, SampleRate};
use stretch_filter::{
    Biquad, Differentiator, LowPassSpec, RateFilter, SgFilter, SgRate, SgShape, Tracker,
    TrackerSpec,
};

const SAMPLES: usize = 100_000;
const HZ: f64 = 100.0;

/// A timed candidate: fills the output from the input.
type Candidate<'a> = (&'static str, Box<dyn FnMut(&[f64], &mut [f64]) + 'a>);

fn rate() -> SampleRate {
    SampleRate::new(HZ).expect("above zero")
}

/// A slow signal with a bend, identical on every machine.
fn signal() -> Vec<f64> {
    (0..SAMPLES)
        .map(|n| 0.4 + 0.3 * (n as f64 * 0.013).sin() * (n as f64 * 0.000_7).cos())
        .collect()
}

/// A plain causal filter: the sum of the newest window of a slice times the taps.
fn plain_fir(taps_oldest_first: &[f64], x: &[f64], y: &mut [f64]) {
    for (window, y) in x.windows(taps_oldest_first.len()).zip(&mut y[10..]) {
        *y = window.iter().zip(taps_oldest_first).map(|(x, h)| x * h).sum();
    }
}

/// The live derivative as usually written in firmware: a ring buffer indexed with a modulo.
struct Ring {
    taps: [f64; 11],
    samples: [f64; 11],
    newest: usize,
}

impl Ring {
    fn step(&mut self, x: f64) -> f64 {
        self.newest = (self.newest + 1) % 11;
        self.samples[self.newest] = x;
        (0..11).map(|lag| self.taps[lag] * self.samples[(self.newest + 11 - lag) % 11]).sum()
    }
}

fn derivatives<'a>() -> Vec<Candidate<'a>> {
    let causal = SgRate::<f64, 11, 2>::new(rate()).expect("a shape");
    let centred = SgRate::<f64, 11, 2, 5>::new(rate()).expect("a shape");
    let single = SgRate::<f32, 11, 2>::new(rate()).expect("a shape");
    let named = RateFilter::<f64>::new(RateEstimator::SAVGOL_11_2, rate()).expect("a shape");
    let log = SgFilter::<f64, 16>::new(SgShape::centred_rate(11, 2), rate()).expect("a shape");
    let mut oldest_first = *causal.taps();
    oldest_first.reverse();
    let mut ring = Ring { taps: *causal.taps(), samples: [0.0; 11], newest: 0 };
    let mut live = Runner::new(causal);
    let mut live_centred = Runner::new(centred);
    let mut live_single = Runner::new(single);
    let mut live_named = Runner::new(named);
    vec![
        (
            "SgRate, live",
            Box::new(move |x, y| {
                for (&x, y) in x.iter().zip(y) {
                    *y = live.step(x).unwrap_or(0.0);
                }
            }),
        ),
        (
            "SgRate centred, live",
            Box::new(move |x, y| {
                for (&x, y) in x.iter().zip(y) {
                    *y = live_centred.step(x).unwrap_or(0.0);
                }
            }),
        ),
        (
            "SgRate f32, live",
            Box::new(move |x, y| {
                for (&x, y) in x.iter().zip(y) {
                    *y = f64::from(live_single.step(x as f32).unwrap_or(0.0));
                }
            }),
        ),
        (
            "RateFilter, live",
            Box::new(move |x, y| {
                for (&x, y) in x.iter().zip(y) {
                    *y = live_named.step(x).unwrap_or(0.0);
                }
            }),
        ),
        ("SgFilter over a log", Box::new(move |x, y| log.over_log(x, y).expect("a good log"))),
        ("plain FIR over a log", Box::new(move |x, y| plain_fir(&oldest_first, x, y))),
        (
            "ring buffer, live",
            Box::new(move |x, y| {
                for (&x, y) in x.iter().zip(y) {
                    *y = ring.step(x);
                }
            }),
        ),
        (
            "sci-rs over a log",
            Box::new(|x, y| {
                let out = savgol_filter_dyn(x.iter(), 11, 2, Some(1), Some(1.0 / HZ));
                y.copy_from_slice(&out);
            }),
        ),
    ]
}

fn sections<'a>() -> Vec<Candidate<'a>> {
    let spec = LowPassSpec { cutoff: Hertz(5.0), sample_rate: rate() };
    let low_pass = spec.design::<f64, 2>().expect("a cutoff");
    let c = low_pass.sections()[0].spec();
    let mut ours = Runner::new(Biquad::<f64>::new(c).expect("stable"));
    let mut butterworth = Runner::new(low_pass);
    let mut differentiator = Runner::new(Differentiator::<f64>::new(spec).expect("a cutoff"));
    let tracker = TrackerSpec { tracking_index: 0.1, sample_rate: rate() };
    let mut tracker = Runner::new(Tracker::<f64>::new(tracker).expect("an index"));
    let mut peer = biquad::DirectForm2Transposed::<f64>::new(biquad::Coefficients {
        a1: c.a1,
        a2: c.a2,
        b0: c.b0,
        b1: c.b1,
        b2: c.b2,
    });
    let idsp = idsp::iir::Biquad { ba: [c.b0, c.b1, c.b2, -c.a1, -c.a2] };
    let mut idsp_state = idsp::iir::DirectForm2Transposed::<f64>::default();
    vec![
        (
            "Biquad",
            Box::new(move |x, y| {
                for (&x, y) in x.iter().zip(y) {
                    *y = ours.step(x);
                }
            }),
        ),
        (
            "biquad DF2T",
            Box::new(move |x, y| {
                for (&x, y) in x.iter().zip(y) {
                    *y = peer.run(x);
                }
            }),
        ),
        (
            "idsp DF2T",
            Box::new(move |x, y| {
                for (&x, y) in x.iter().zip(y) {
                    *y = idsp.process(&mut idsp_state, x);
                }
            }),
        ),
        (
            "LowPass, order 2",
            Box::new(move |x, y| {
                for (&x, y) in x.iter().zip(y) {
                    *y = butterworth.step(x);
                }
            }),
        ),
        (
            "Differentiator",
            Box::new(move |x, y| {
                for (&x, y) in x.iter().zip(y) {
                    *y = differentiator.step(x).unwrap_or(0.0);
                }
            }),
        ),
        (
            "Tracker",
            Box::new(move |x, y| {
                for (&x, y) in x.iter().zip(y) {
                    *y = tracker.step(x).map_or(0.0, |track| track.rate);
                }
            }),
        ),
    ]
}

/// Returns the largest difference, excluding the transients at start and end.
fn differ(a: &[f64], b: &[f64], shift: usize) -> f64 {
    let inside = 2000..SAMPLES - 2000;
    inside.map(|n| (a[n + shift] - b[n]).abs()).fold(0.0, f64::max)
}

fn outputs(candidates: &mut [Candidate], x: &[f64]) -> Vec<Vec<f64>> {
    let run = |(_, run): &mut Candidate| {
        let mut y = vec![0.0; x.len()];
        run(x, &mut y);
        y
    };
    candidates.iter_mut().map(run).collect()
}

/// Prints the fastest of many rounds, in which the candidates alternate.
fn print_ratios(title: &str, candidates: &mut [Candidate], x: &[f64], baseline: usize) {
    let mut y = vec![0.0; x.len()];
    let mut best = vec![f64::INFINITY; candidates.len()];
    for _ in 0..60 {
        for ((_, run), best) in candidates.iter_mut().zip(&mut best) {
            let start = Instant::now();
            run(black_box(x), black_box(&mut y));
            *best = best.min(start.elapsed().as_secs_f64() * 1e9 / x.len() as f64);
        }
    }
    eprintln!(
        "{title}: fastest of 60 interleaved rounds, ns a sample (ratio to {})",
        candidates[baseline].0
    );
    for ((name, _), ns) in candidates.iter().zip(&best) {
        eprintln!("  {name:<22} {ns:6.2}  {:5.2}", ns / best[baseline]);
    }
}

fn bench(criterion: &mut Criterion, title: &str, mut candidates: Vec<Candidate>, x: &[f64]) {
    let mut y = vec![0.0; x.len()];
    let mut group = criterion.benchmark_group(title);
    group.throughput(Throughput::Elements(x.len() as u64));
    group.warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(1));
    group.sample_size(30);
    for (name, run) in &mut candidates {
        group.bench_function(BenchmarkId::from_parameter(name), |b| {
            b.iter(|| run(black_box(x), black_box(&mut y)));
        });
    }
    group.finish();
}

fn filters(criterion: &mut Criterion) {
    let x = signal();

    let mut candidates = derivatives();
    let y = outputs(&mut candidates, &x);
    // The live output is that of the centred filter, delayed by five samples.
    assert!(differ(&y[1], &y[4], 5) < 1e-10 && differ(&y[4], &y[7], 0) < 1e-10);
    assert!(differ(&y[0], &y[5], 0) < 1e-10 && differ(&y[0], &y[6], 0) < 1e-10);
    assert!(differ(&y[0], &y[3], 0) == 0.0);
    print_ratios("derivative, 11 taps", &mut candidates, &x, 7);
    bench(criterion, "derivative, 11 taps", candidates, &x);

    let mut candidates = sections();
    let y = outputs(&mut candidates, &x);
    assert!(differ(&y[0], &y[1], 0) < 1e-12 && differ(&y[0], &y[2], 0) < 1e-12);
    print_ratios("second-order section", &mut candidates, &x, 1);
    bench(criterion, "second-order section", candidates, &x);
}

criterion_group!(benches, filters);
criterion_main!(benches);

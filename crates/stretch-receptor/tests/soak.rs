//! Long streams with the faults of sensors, cables and converters: no estimate drifts, readings continue, and no memory
//! grows.

use std::fmt::Debug;

use proptest::{
    strategy::{Strategy, ValueTree},
    test_runner::TestRunner,
};
use stretch_core::{Calibration, Design, Model, Real, RestTracker, Runner, Stage, Volts};
use stretch_receptor::{
    Reading, Receptor, Withheld,
    code::{Adc, AdcCode, AdcSpec, CodeReading, FixedCalibration, FixedObserver, FixedReceptor},
    example_calibration, example_diagnosed, example_observer,
};

/// Source of a stream: a muscle that moves, with occasional samples that are not motion.
struct Faults {
    seed: u64,
    phase: f64,
    stuck: Option<(u32, f64)>,
    jump: f64,
}

impl Faults {
    fn new() -> Self {
        Self { seed: 0x9e37_79b9_7f4a_7c15, phase: 0.0, stuck: None, jump: 0.0 }
    }

    /// xorshift64*: Vigna 2016, doi:10.1145/2845077.
    fn draw(&mut self) -> u64 {
        self.seed ^= self.seed >> 12;
        self.seed ^= self.seed << 25;
        self.seed ^= self.seed >> 27;
        self.seed.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    /// The next sample as a share of the calibrated range.
    fn next(&mut self) -> f64 {
        // a triangle of changing speed: no transcendental, so that 1e8 samples take seconds
        let draw = self.draw();
        self.phase += 1e-4 + 3e-2 * (draw & 0xff) as f64 / 255.0;
        self.phase -= self.phase.floor();
        let clean = 0.05 + 1.8 * (self.phase - 0.5).abs();
        match (draw >> 8) % 1000 {
            0..4 => return f64::NAN,
            4 => return 1e30,
            5 => return -1e30,
            6 => return f64::INFINITY,
            7..9 => self.stuck = Some(((draw >> 40) as u32 % 300, clean)),
            9..12 => self.jump = ((draw >> 40) % 200) as f64 / 100.0 - 1.0,
            12..16 => self.jump = 0.0,
            _ => {}
        }
        if let Some((left, value)) = self.stuck {
            self.stuck = left.checked_sub(1).map(|left| (left, value));
            return value;
        }
        clean + self.jump
    }
}

/// Sample `n` of a clean motion over the whole range.
///
/// At 100 Hz it moves by [`CLEAN_RATE`] of the range a second.
fn clean(n: u32) -> f64 {
    let phase = f64::from(n % 400) / 400.0;
    0.05 + 1.8 * (phase - 0.5).abs()
}

/// Clean samples after which a memory must have forgotten the faults. The slowest time constants are of minutes.
const FORGOTTEN: u32 = 100_000;

/// Rate of the clean motion, in ranges a second.
const CLEAN_RATE: f64 = 0.45;

/// Clean samples after which a receptor of this calibration must have forgotten the faults; `None` if it never does.
///
/// If the dead band is wider than the rate of the clean motion, the branch stays that of the last fault. A baseline
/// falls quickly to a lower resting level, but rises only by its leak, by up to twice its largest magnitude.
fn clean_samples(calibration: &Calibration) -> Option<u32> {
    if calibration.spec().dead_band >= CLEAN_RATE * calibration.spec().signal_range.span() {
        return None;
    }
    let rest = match &calibration.spec().model {
        Model::History(map) => map.rest,
        Model::Observer(map) => map.rest,
        Model::Diagnosed(map) => map.rest,
        _ => None,
    };
    let Some(rest) = rest else { return Some(FORGOTTEN) };
    let leak = rest.leak / calibration.spec().sample_rate_hz.hz();
    let back = 2.0 * RestTracker::FURTHEST * calibration.spec().signal_range.span() / leak;
    (back < 1e8).then(|| FORGOTTEN + back as u32)
}

/// Steps a receptor through `samples` faulty samples, then together with a fresh receptor through clean samples.
/// Returns the final difference between the two estimates.
fn soak<D, S, O>(
    design: D,
    (samples, clean_samples): (u64, u32),
    sample: impl Fn(f64) -> S,
    estimate: impl Fn(O) -> f64,
) -> f64
where
    D: Design + Stage<S, Out = Result<O, Withheld>> + Copy,
    // a `Copy` type owns no heap memory, so its size cannot grow
    D::Memory: Copy + Debug,
{
    let (mut receptor, mut faults) = (Runner::new(design), Faults::new());
    let mut answered = 0u64;
    for n in 0..samples {
        if let Ok(reading) = receptor.step(sample(faults.next())) {
            let estimate = estimate(reading);
            assert!(estimate.is_finite(), "sample {n}: {estimate}");
            answered += 1;
        }
    }
    assert!(answered > samples / 2, "{answered} of {samples} answered");
    let mut fresh = Runner::new(design);
    let mut apart = f64::INFINITY;
    for n in 0..clean_samples {
        let both = (receptor.step(sample(clean(n))), fresh.step(sample(clean(n))));
        if let (Ok(old), Ok(new)) = both {
            apart = (estimate(old) - estimate(new)).abs();
        }
    }
    apart
}

/// Returns calibrations of every model; the same in every run.
fn records() -> Vec<(String, Calibration)> {
    let mut runner = TestRunner::deterministic();
    let mut all = vec![
        ("poly13".to_owned(), example_calibration()),
        ("observer".to_owned(), example_observer()),
        ("diagnosed".to_owned(), example_diagnosed()),
    ];
    for n in 0..4 {
        let mut draw = |name: &str, tree: proptest::strategy::BoxedStrategy<Calibration>| {
            let record = tree.new_tree(&mut runner).expect("a record").current();
            (format!("{name} {n}"), record)
        };
        all.push(draw("surfaces or line", stretch_strategies::paper_calibration().boxed()));
        all.push(draw("history", stretch_strategies::history_calibration().boxed()));
        all.push(draw("observer", stretch_strategies::observer_calibration().boxed()));
        all.push(draw("diagnosed", stretch_strategies::diagnosed_calibration().boxed()));
    }
    all
}

/// Largest difference, as a share of the range, between a soaked receptor (one that has processed a long stream with
/// faults) and a fresh receptor, after both have seen the same clean samples.
///
/// Receptors with a window of samples differ by rounding only, because the whole window was replaced. The differences
/// of exponential filters decay to rounding errors. Plays can keep two different states under the same signal: the
/// difference is the part of the play that the motion does not cover.
fn allowed(calibration: &Calibration, rounding: f64) -> f64 {
    match &calibration.spec().model {
        Model::Linear(_) | Model::Surfaces { .. } => rounding,
        _ => 0.02,
    }
}

fn soak_floats<T: Real>(samples: u64, rounding: f64) {
    for (name, calibration) in records() {
        let Ok(receptor) = Receptor::<T>::new(&calibration) else { continue };
        let clean_samples = clean_samples(&calibration);
        let range = calibration.spec().signal_range;
        let volts = |share: f64| Volts(T::from_f64(range.min() + share * range.span()));
        let apart = soak(
            receptor,
            (samples, clean_samples.unwrap_or(FORGOTTEN)),
            volts,
            |r: Reading<T>| r.estimate.as_f64(),
        );
        let span = calibration.spec().target.reference_per_target()
            * calibration.spec().target_range.span();
        let share = apart / span.abs();
        println!("{name}: {samples} samples, {share:.1e} of the range apart");
        let forgets = clean_samples.is_some();
        assert!(
            !forgets || share <= allowed(&calibration, rounding),
            "{name}: {share:e} of the range apart"
        );
    }
}

fn soak_codes(samples: u64) {
    let adc = Adc::new(AdcSpec { bits: 12, zero_v: 0.0, full_scale_v: 3.3 }).unwrap();
    // a value that is not a number becomes a code that no converter has
    let code = |share: f64| {
        if share.abs() < 10.0 { AdcCode((4095.0 * share) as i32) } else { AdcCode(-1) }
    };
    let estimate = |r: CodeReading<i32>| f64::from(r.estimate);
    let fixed = FixedCalibration::<11, 2>::new(&example_calibration(), &adc).unwrap();
    let apart = soak(FixedReceptor::new(fixed), (samples, FORGOTTEN), code, estimate);
    println!("poly13 in integers: {samples} samples, {apart} um apart");
    assert_eq!(apart, 0.0);
    let observer = FixedObserver::new(&example_observer(), &adc).unwrap();
    let apart = soak(observer, (samples, FORGOTTEN), code, estimate);
    println!("observer in integers: {samples} samples, {apart} um apart");
    assert!(apart <= 2.0);
}

/// The variable `STRETCH_SAMPLES` sets the number of samples per receptor; 100000000 take minutes in a release build.
#[test]
#[ignore = "a million samples a receptor; ./ci.sh runs it"]
fn streams_with_faults_leave_nothing_behind() {
    let samples = std::env::var("STRETCH_SAMPLES").map_or(1_000_000, |n| n.parse().unwrap());
    soak_floats::<f64>(samples, 1e-9);
    soak_floats::<f32>(samples, 1e-4);
    soak_codes(samples);
}

//! Comparison of rate estimators on a noisy triangle wave.
//!
//! A stretch sensor is pulled and released at constant speed, with 1 % noise. Each estimator
//! estimates the speed and its sign. The sign matters most, because it selects the calibration
//! surface: a wrong sign gives a wrong length.
//!
//! ```text
//! cargo run --release -p stretch-filter --example rate_on_a_noisy_ramp
//! ```

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stretch_core::{RateEstimator, Runner, SampleRate};
use stretch_filter::{RateFilter, SgFilter, SgShape, log::central_difference};

const HZ: f64 = 100.0;
/// Speed in full scale per second: two seconds up, two seconds down.
const SPEED: f64 = 0.5;
const LEG: usize = 200;
const LEGS: usize = 100;
/// Standard deviation of the noise, as a share of full scale.
const NOISE: f64 = 0.01;

/// Results of one estimator.
struct Score {
    name: String,
    delay_s: f64,
    noise_gain: f64,
    /// RMS error of the rate at least 0.5 s after a reversal.
    rmse_straight: f64,
    /// RMS error of the rate over all samples.
    rmse: f64,
    /// Share of all samples with the wrong sign.
    wrong: f64,
    /// Share of samples with the wrong sign at least 0.5 s after a reversal.
    wrong_straight: f64,
}

/// Returns the triangle wave from 0 to 1 and its rate.
fn truth(n: usize) -> (f64, f64) {
    let (leg, within) = (n / LEG, (n % LEG) as f64 / HZ);
    if leg.is_multiple_of(2) { (SPEED * within, SPEED) } else { (1.0 - SPEED * within, -SPEED) }
}

fn score(name: String, delay_s: f64, noise_gain: f64, rates: &[Option<f64>]) -> Score {
    let (mut all, mut straight) = (Tally::default(), Tally::default());
    // The first leg is skipped, because the estimators warm up during it.
    for (n, rate) in rates.iter().enumerate().skip(LEG) {
        let Some(rate) = *rate else { continue };
        all.add(rate, truth(n).1);
        if n % LEG >= 50 {
            straight.add(rate, truth(n).1);
        }
    }
    Score {
        name,
        delay_s,
        noise_gain,
        rmse_straight: straight.rmse(),
        rmse: all.rmse(),
        wrong: all.wrong_share(),
        wrong_straight: straight.wrong_share(),
    }
}

#[derive(Default)]
struct Tally {
    count: u32,
    squares: f64,
    wrong: u32,
}

impl Tally {
    fn add(&mut self, rate: f64, truth: f64) {
        self.count += 1;
        self.squares += (rate - truth).powi(2);
        self.wrong += u32::from(rate * truth <= 0.0);
    }

    fn rmse(&self) -> f64 {
        (self.squares / f64::from(self.count)).sqrt()
    }

    fn wrong_share(&self) -> f64 {
        f64::from(self.wrong) / f64::from(self.count)
    }
}

fn live(name: &str, estimator: RateEstimator, log: &[f64]) -> Score {
    let sample_rate = SampleRate::new(HZ).expect("above zero");
    let design = RateFilter::<f64>::new(estimator, sample_rate).expect("a live estimator");
    let mut rate = Runner::new(design);
    let rates: Vec<Option<f64>> = log.iter().map(|&x| rate.step(x)).collect();
    score(name.to_string(), design.delay_s(), design.noise_gain(), &rates)
}

fn main() {
    let sample_rate = SampleRate::new(HZ).expect("above zero");
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    // The sum of twelve uniform numbers minus 6 is nearly normal, and the same on every machine.
    let mut noise = || NOISE * ((0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0);
    let log: Vec<f64> = (0..LEG * LEGS).map(|n| truth(n).0 + noise()).collect();

    let mut rates = vec![0.0; log.len()];
    central_difference(sample_rate, &log, &mut rates).expect("a good log");
    let some: Vec<Option<f64>> = rates.iter().copied().map(Some).collect();
    let central = score("central difference (log)".into(), 0.0, HZ / 2f64.sqrt(), &some);

    let shape = SgShape::centred_rate(11, 2);
    let centred = SgFilter::<f64>::new(shape, sample_rate).expect("a shape");
    centred.over_log(&log, &mut rates).expect("a good log");
    let some: Vec<Option<f64>> = rates.iter().copied().map(Some).collect();
    let centred = score("centred SG 11,2 (log)".into(), 0.0, centred.noise_gain(), &some);

    let sg = |window, degree, delay| RateEstimator::SavitzkyGolay { window, degree, delay };
    let scores = [
        central,
        centred,
        live("SG 11,1", sg(11, 1, 0), &log),
        live("SG 11,2", sg(11, 2, 0), &log),
        live("SG 11,2 five samples late", sg(11, 2, 5), &log),
        live("SG 25,2", sg(25, 2, 0), &log),
        live("SG 31,1", sg(31, 1, 0), &log),
        live("differentiator 2 Hz", RateEstimator::Differentiator { cutoff_hz: 2.0 }, &log),
        live("differentiator 5 Hz", RateEstimator::Differentiator { cutoff_hz: 5.0 }, &log),
        live("tracker 0.01", RateEstimator::Tracker { tracking_index: 0.01 }, &log),
        live("tracker 0.1", RateEstimator::Tracker { tracking_index: 0.1 }, &log),
    ];

    println!(
        "A ramp of {SPEED} of full scale per second that reverses every {} s, noise {} %, {HZ} Hz",
        LEG as f64 / HZ,
        100.0 * NOISE
    );
    println!();
    println!("                            delay  noise gain   rate RMSE, 1/s     wrong sign, %");
    println!("estimator                      ms         1/s   straight     all   straight    all");
    for s in &scores {
        println!(
            "{:<26} {:>6.1} {:>11.2} {:>10.3} {:>7.3} {:>10.2} {:>6.2}",
            s.name,
            1e3 * s.delay_s.max(0.0), // no -0.0
            s.noise_gain,
            s.rmse_straight,
            s.rmse,
            100.0 * s.wrong_straight,
            100.0 * s.wrong,
        );
    }

    // The noise gain predicts the error on a straight leg ...
    for s in &scores {
        let predicted = NOISE * s.noise_gain;
        let ratio = s.rmse_straight / predicted;
        assert!((0.9..1.1).contains(&ratio), "{}: {ratio} times its prediction", s.name);
    }
    let find = |name: &str| scores.iter().find(|s| s.name.starts_with(name)).expect("a row");
    let (central, newest, line) = (find("central"), find("SG 11,2"), find("SG 11,1"));
    let (long, slow) = (find("SG 31,1"), find("differentiator 2"));
    // ... the sign of a central difference is often wrong, ...
    assert!(central.wrong_straight > 0.15);
    // ... a parabola at its newest sample has no delay, but more noise, ...
    assert!(newest.noise_gain > 3.0 * line.noise_gain && newest.wrong_straight > 0.05);
    // ... a straight line through the same samples nearly always has the right sign, ...
    assert!(line.wrong_straight < 0.001 && line.wrong < 0.05);
    // ... and more smoothing lowers the errors on straight legs but adds errors after reversals.
    assert!(long.rmse_straight < line.rmse_straight && long.wrong > line.wrong);
    assert!(slow.wrong > line.wrong);

    println!();
    println!(
        "At {} % of noise a central difference takes the wrong direction for {:.0} % of the\n\
         samples of a straight leg, a parabola's newest end for {:.0} %, a line through the\n\
         same eleven samples for {:.2} %; reversals included {:.0}, {:.1} and {:.1} %. A longer\n\
         window buys a quieter rate with later reversals: {:.1} % at 31 samples. Delay and\n\
         noise gain, known before the first sample, predict both.",
        100.0 * NOISE,
        100.0 * central.wrong_straight,
        100.0 * newest.wrong_straight,
        100.0 * line.wrong_straight,
        100.0 * central.wrong,
        100.0 * newest.wrong,
        100.0 * line.wrong,
        100.0 * long.wrong,
    );
}

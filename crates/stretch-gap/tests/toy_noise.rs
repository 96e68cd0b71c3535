//! Tests the noise of a channel that is estimated from its recording, and signals that cannot be distinguished from
//! noise.

use stretch_gap::{Noise, NoteCode, RandomGenerator, VerdictKind, WINDOW, noise_variance};

use crate::toys::{Effect, Law, Toy, noted, slow};

const SAMPLES: usize = 20_000;
/// Tolerance of an estimated standard deviation: five relative standard errors of 1.6/sqrt n. The
/// estimate uses the median of n squared second differences. The median of a squared normal
/// variable is known to 0.5/(0.4711 sqrt n) of 0.4549. Neighbouring differences share samples, so a
/// third of them are independent: 1/(1 + 2 (4/6)^2 + 2 (1/6)^2).
const TOLD: f64 = 5.0 * 1.6 / 141.0;

fn white(sd: f64, seed: u64) -> Vec<f64> {
    let mut random = RandomGenerator::new(seed, 0);
    (0..SAMPLES).map(|_| sd * random.gauss()).collect()
}

fn deviation(record: &[f64], dt_s: f64) -> f64 {
    noise_variance([record].into_iter(), dt_s).sqrt()
}

#[test]
fn white_noise_is_found_beside_motion_and_rests() {
    for (seed, sd) in [1e-6, 0.02, 3.0].into_iter().enumerate() {
        let noise = white(sd, seed as u64);
        approx::assert_relative_eq!(deviation(&noise, 0.01), sd, max_relative = TOLD);
        // One-second movements with rests of two seconds between them. The second differences are 0.01^2 (2 pi)^2 of
        // the amplitude, in a third of the samples.
        let moved = |i: usize| match (i / 100) % 3 {
            0 => 20.0 * sd * (1.0 - (std::f64::consts::TAU * 0.01 * (i % 100) as f64).cos()),
            _ => 0.0,
        };
        let record: Vec<f64> = noise.iter().enumerate().map(|(i, x)| x + moved(i)).collect();
        approx::assert_relative_eq!(deviation(&record, 0.01), sd, max_relative = TOLD);
    }
}

/// The estimated noise scales with the unit of the recording. If the factor is a power of two, it does so to the last
/// bit.
#[test]
fn noise_is_in_the_unit_of_its_record() {
    let record = white(0.1, 1);
    let scaled: Vec<f64> = record.iter().map(|x| 1024.0 * x + 5.0 * 1024.0).collect();
    let shifted: Vec<f64> = record.iter().map(|x| x + 5.0).collect();
    assert_eq!(deviation(&scaled, 0.01), 1024.0 * deviation(&shifted, 0.01));
}

/// A converter with the step q adds the variance q^2/12. The median second difference is 0.6745 sqrt 6 = 1.65 standard
/// deviations and is rounded to whole steps, so it is wrong by at most half a step.
#[test]
fn rounding_is_noise_to_half_a_step_of_the_median() {
    for share in [0.25, 0.5, 1.0, 2.0] {
        let record: Vec<f64> = white(0.1, 2)
            .iter()
            .enumerate()
            .map(|(i, x)| {
                let step = share * 0.1;
                ((x + 1e-4 * i as f64) / step).round() * step
            })
            .collect();
        let expected = 0.1 * (1.0 + share * share / 12.0).sqrt();
        let most = TOLD + 0.5 * share * 0.1 / (1.65 * expected);
        approx::assert_relative_eq!(deviation(&record, 0.01), expected, max_relative = most);
    }
}

/// Mains hum does not count as noise, also if it is aliased: 50 Hz at sample rates of 250 and 100 Hz, and 60 Hz, which
/// appears at 40 Hz, at 100 Hz. Hum of less than 0.15 periods per sample may be motion and stays.
#[test]
fn a_hum_of_the_mains_is_left_out() {
    for (hertz, dt_s) in [(50.0, 0.01), (60.0, 0.01), (50.0, 0.004), (60.0, 0.004)] {
        let wave = |i: usize| (std::f64::consts::TAU * hertz * dt_s * i as f64 + 0.7).cos();
        let record: Vec<f64> = white(0.1, 3).iter().enumerate().map(|(i, x)| x + wave(i)).collect();
        // Some noise is removed together with the hum; the estimate is corrected for this.
        approx::assert_relative_eq!(deviation(&record, dt_s), 0.1, max_relative = 1.5 * TOLD);
    }
}

/// A permanent oscillation of a resonance counts as noise, because the recording does not show the difference. Second
/// differences of A sin(2 pi f t) have the mean square A^2 (2 - 2 cos(2 pi f dt))^2/2. A sixth of it is reported as
/// variance, and up to 1/0.4549 times that, because the estimate assumes the median of a squared normal variable,
/// whereas the median of a squared sine equals its mean.
#[test]
fn a_resonance_passes_for_noise_as_far_as_its_bends_do() {
    for (hertz, amplitude) in [(5.0, 1.0), (12.0, 0.3), (20.0, 1.0)] {
        let turn = std::f64::consts::TAU * hertz * 0.01;
        let record: Vec<f64> = white(0.1, 4)
            .iter()
            .enumerate()
            .map(|(i, x)| x + amplitude * (turn * i as f64).sin())
            .collect();
        let bends = 0.5 * (amplitude * (2.0 - 2.0 * turn.cos())).powi(2) / 6.0;
        let least = (0.01 + bends).sqrt();
        let most = least / 0.4549_f64.sqrt();
        let found = deviation(&record, 0.01);
        assert!(
            ((1.0 - TOLD) * least..(1.0 + TOLD) * most).contains(&found),
            "{least} {found} {most}"
        );
    }
}

/// Correlated noise is only partly visible from sample to sample: with a correlation rho^k second differences have 6 -
/// 8 rho + 2 rho^2 times the variance, and a sixth of that is reported.
#[test]
fn differences_tell_of_slow_noise_what_changes_from_sample_to_sample() {
    for memory in [2.0_f64, 10.0, 50.0] {
        let record = slow(0.1, 0.01 * memory, (SAMPLES, 0.01), 5);
        let kept = (-1.0 / memory).exp();
        let expected = 0.1 * ((6.0 - 8.0 * kept + 2.0 * kept * kept) / 6.0).sqrt();
        // The differences of this noise are at most as correlated as those of white noise, so the
        // tolerance is the same.
        approx::assert_relative_eq!(deviation(&record, 0.01), expected, max_relative = TOLD);
    }
}

/// Windows in which nothing moves also show slow noise, which second differences miss. Noise that is drawn from the
/// estimate has the same level.
#[test]
fn windows_tell_slow_noise_that_differences_miss() {
    let record = slow(0.1, 0.2, (100 * WINDOW, 0.01), 6);
    let mut random = RandomGenerator::new(6, 1);
    let noisy: Vec<f64> = record.iter().map(|x| x + 0.02 * random.gauss()).collect();
    let windows: Vec<Vec<f64>> = noisy.chunks(WINDOW).map(<[f64]>::to_vec).collect();
    let found = Noise::of_windows(&windows, Some(0.02), true, 0.01).expect("enough windows");
    // 100 windows of 1.28 s contain about 320 independent samples of a process with a correlation time of 0.2 s, which
    // determine its deviation to 5 %. Subtracting a parabola also removes noise that is slower than a window.
    approx::assert_relative_eq!(found.sd(), 0.1, max_relative = 0.25);
    let (share, memory) = found.slow();
    assert!(share > 0.85 && (10.0..40.0).contains(&memory), "{share} {memory}");
    // If the signals move, only the fast part of the noise is estimated, not the slow part.
    let quick = Noise::of_windows(&windows, Some(0.02), false, 0.01).expect("enough windows");
    assert!(quick.sd() < 0.05 && quick.slow().0 == 0.0, "{quick:?}");
    let samples = found.samples(50_000, &mut random);
    let power = samples.iter().map(|x| x * x).sum::<f64>() / 50_000.0;
    // 50 000 samples with a memory of 20 samples contain 1250 independent squares, which determine their mean to 4 %.
    // The tolerance is about two of these.
    approx::assert_relative_eq!(power.sqrt(), found.sd(), max_relative = 0.08);
}

/// A diagnosis that estimates its noise from the recording finds the same missing effects as one with stated noise.
#[test]
fn noise_from_the_record_names_what_stated_noise_names() {
    for law in [Law::Line, Law::Lag, Law::Oscillator] {
        for hidden in [None, Some(Effect::Play)] {
            let mut toy = Toy::of(&[law]).may_lack(&Effect::ALL);
            toy.hidden = hidden.iter().map(|effect| (0, *effect, vec![0.1])).collect();
            let named = [Some(1.0), None].map(|stated| {
                let toy = Toy { stated, ..toy.clone() };
                toy.measured(7).diagnosed().0.named()
            });
            let expected: Vec<&str> = hidden.iter().map(|e| e.name()).collect();
            assert_eq!(named, [expected.clone(), expected], "{law:?}");
        }
    }
}

/// If the stated noise is half too large, a recording without a missing effect still agrees. If it is 30 % too small,
/// there is a gap, but no effect is named.
#[test]
fn stated_noise_that_is_wrong_names_nothing() {
    for seed in 0..5 {
        let toy = Toy::of(&[Law::Line]).may_lack(&Effect::ALL);
        let told = |times| Toy { stated: Some(times), ..toy.clone() }.measured(seed).diagnosed().0;
        let large = told(1.5);
        assert_eq!(large.verdict(), VerdictKind::NoGap, "{}", large.sentence);
        // The excess is 1/0.7^2 - 1 = 1.04: the noise has twice the stated variance.
        let small = told(0.7);
        assert!(small.named().is_empty(), "{}", small.sentence);
        // With 1000 test samples, a chi-square of 2.04 has a standard deviation of 0.09. The tolerance is three of
        // these.
        approx::assert_abs_diff_eq!(small.gap.retuned, 1.04, epsilon = 0.28);
    }
}

/// A few gross errors do not count as noise, single or in a row and of any size. Mains hum is still removed.
#[test]
fn gross_errors_are_no_noise() {
    for (size, row, hum) in
        [(5.0, 1, 0.0), (-40.0, 3, 0.0), (1e6, 1, 0.0), (40.0, 1, 1.0), (1e6, 3, 1.0)]
    {
        let wave = |i: usize| hum * (std::f64::consts::TAU * 60.0 * 0.01 * i as f64 + 0.7).cos();
        let gross = |i: usize| if i % 2000 < row { size } else { 0.0 };
        let record: Vec<f64> =
            white(0.1, 8).iter().enumerate().map(|(i, x)| x + wave(i) + gross(i)).collect();
        approx::assert_relative_eq!(deviation(&record, 0.01), 0.1, max_relative = 1.5 * TOLD);
    }
}

/// If a coarse converter repeats most values, its flips between two steps count as noise, but a few gross errors do
/// not.
#[test]
fn gross_errors_are_no_noise_of_a_coarse_converter() {
    let flips = |step: f64, gross: f64| -> Vec<f64> {
        let coarse = |(i, x): (usize, &f64)| {
            let far = if i % 5000 == 7 { gross } else { 0.0 };
            0.3 + step * f64::from(x.abs() > 2.5) + far
        };
        white(1.0, 9).iter().enumerate().map(coarse).collect()
    };
    // At a thousand samples per second, mains hum is too slow to be removed.
    let plain = deviation(&flips(0.7, 0.0), 0.001);
    // One value in 80 differs by a step, so the variance is 0.012 of the squared step.
    approx::assert_relative_eq!(plain, 0.7 * 0.0124_f64.sqrt(), max_relative = 0.1);
    for gross in [30.0, -1e5] {
        // Each of four errors affects three differences, which are left out: one in 60 of the differences that are not
        // 0.
        let found = deviation(&flips(0.7, gross), 0.001);
        approx::assert_relative_eq!(found, plain, max_relative = 0.02);
    }
}

/// Gross errors hide no missing effect, and a note gives their number.
#[test]
fn gross_errors_hide_no_effect() {
    for (size, row) in [(5.0, 1), (-40.0, 1), (5.0, 3)] {
        for stated in [Some(1.0), None] {
            let toy = Toy { stated, ..Toy::of(&[Law::Line]).may_lack(&Effect::ALL) };
            let mut record = toy.hiding(&[(Effect::Play, &[0.1])]).measured(7);
            for from in [500, 3500] {
                record.outputs[0][from..from + row].fill(size);
            }
            let told = record.diagnosed().0;
            assert_eq!(told.named(), [Effect::Play.name()], "{}", told.sentence);
            let note =
                format!("{} of 4000 values of y0 are gross errors and do not count", 2 * row);
            assert_eq!(noted(&told, NoteCode::GrossErrors), [note]);
        }
    }
}

/// If the noise is stated so large that no real recording could have so small a residual, the diagnosis does not report
/// agreement.
#[test]
fn noise_that_no_record_has_is_told() {
    let toy = Toy::of(&[Law::Line]).may_lack(&Effect::ALL);
    let told = |times| Toy { stated: Some(times), ..toy.clone() }.measured(3).diagnosed().0;
    for times in [3.0, 40.0] {
        let far = told(times);
        assert_eq!(far.verdict(), VerdictKind::NoGap);
        assert!(!far.is_agreement());
        let [note] = &noted(&far, NoteCode::ImplausibleNoise)[..] else { panic!("one note") };
        assert!(note.starts_with("the noise of y0 is implausible, "));
    }
    assert!(told(1.0).is_agreement() && told(1.5).is_agreement());
}

//! Tests with simulated residuals: with jitter of a known size, and without jitter.

use super::jitter_sd_s;
use crate::numerics::random::RandomGenerator;

const DT_S: f64 = 0.01;
const SAMPLES: usize = 3000;
/// Amplitude of the signal in multiples of the sensor noise, which is the unit of all signals in
/// these tests.
const SIGNAL: f64 = 100.0;

/// The effect that the simulator lacks in a test.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Lack {
    Nothing,
    /// Time stamps that jitter, s.
    Jitter(f64),
    /// A constant delay, s.
    Late(f64),
    /// Noise proportional to the value.
    ByLevel(f64),
    /// Jumps of this size, back and forth.
    Jumps(f64),
    /// Play of this width.
    Play(f64),
}

/// Noise of the recorder.
#[derive(Debug, Clone, Copy)]
enum Noise {
    White,
    /// White noise plus an autoregressive process of first order that keeps this share from sample
    /// to sample.
    Coloured(f64),
}

/// Returns the signal at the time t. Its motion fades to rest and returns, again and again.
fn at(t: f64) -> f64 {
    let moves = (0.5 + 0.8 * (0.7 * t).cos()).max(0.0);
    SIGNAL * moves * moves * ((1.3 * t).sin() + 0.4 * (4.7 * t + 1.0).sin())
}

fn found(lack: Lack, noise: Noise, seed: u64) -> Option<f64> {
    let mut random = RandomGenerator::new(seed, 3);
    let (mut residuals, mut shown) = (Vec::new(), Vec::new());
    for trial in 0..2 {
        let time = |i: usize| DT_S * (i + trial * SAMPLES) as f64;
        let y: Vec<f64> = (0..SAMPLES).map(|i| at(time(i))).collect();
        let (mut colour, mut level, mut held) = (0.0, 0.0, y[0]);
        let mut residual = Vec::new();
        for (i, y) in y.iter().enumerate() {
            let lacking = match lack {
                Lack::Nothing => 0.0,
                Lack::Jitter(sd_s) => at(time(i) + sd_s * random.gauss()) - y,
                Lack::Late(s) => at(time(i) - s) - y,
                Lack::ByLevel(share) => share * y * random.gauss(),
                Lack::Jumps(size) => {
                    if random.unit() < 0.01 {
                        level = size - level;
                    }
                    level
                }
                Lack::Play(width) => {
                    held = held.clamp(y - width, y + width);
                    held - y
                }
            };
            let own = match noise {
                Noise::White => 0.0,
                Noise::Coloured(kept) => {
                    colour = kept * colour + (1.0 - kept * kept).sqrt() * random.gauss();
                    colour
                }
            };
            residual.push(lacking + own + random.gauss());
        }
        shown.push(y);
        residuals.push(residual);
    }
    let stretches: Vec<&[f64]> = residuals.iter().map(Vec::as_slice).collect();
    let all = residuals.iter().flatten();
    let above = all.clone().map(|r| r * r).sum::<f64>() - all.count() as f64;
    jitter_sd_s(&stretches, &shown, DT_S, 0.5 * above)
}

/// Half of 6,000 samples move enough to show jitter, so its variance is estimated to about 3 %.
#[test]
fn jitter_is_told_with_its_size_in_white_noise() {
    for seed in 0..4 {
        for sd_s in [0.006, 0.012, 0.025] {
            let told = found(Lack::Jitter(sd_s), Noise::White, seed);
            let told = told.unwrap_or_else(|| panic!("{sd_s} s, {seed}: it is not told"));
            assert!((told / sd_s - 1.0).abs() < 0.08, "{sd_s} s, {seed}: {told}");
        }
    }
}

/// The coloured noise is as large as the white noise and has a correlation time of 2 to 50 samples.
#[test]
fn jitter_is_told_with_its_size_in_coloured_noise() {
    for seed in 0..4 {
        for (sd_s, kept) in [(0.015, 0.6), (0.025, 0.98), (0.015, 0.9)] {
            let told = found(Lack::Jitter(sd_s), Noise::Coloured(kept), seed);
            let told = told.unwrap_or_else(|| panic!("{sd_s} s, {seed}: it is not told"));
            assert!((told / sd_s - 1.0).abs() < 0.1, "{sd_s} s, {seed}: {told}");
        }
    }
}

/// None of 96 recordings without jitter is reported to have any.
#[test]
fn nothing_else_is_jitter() {
    let lacks = [
        Lack::Nothing,
        Lack::Late(0.03),
        Lack::ByLevel(0.05),
        Lack::Jumps(30.0),
        Lack::Jumps(8.0),
        Lack::Play(12.0),
    ];
    for lack in lacks {
        for noise in [Noise::White, Noise::Coloured(0.95)] {
            let told: Vec<u64> =
                (0..8).filter(|&seed| found(lack, noise, seed).is_some()).collect();
            assert!(told.is_empty(), "{lack:?} in {noise:?}: seeds {told:?}");
        }
    }
}

#[test]
fn what_stands_still_or_is_short_has_none() {
    let residual: Vec<f64> = (0..500).map(|i| 10.0 * f64::from(i % 7)).collect();
    let flat = vec![vec![3.0; 500]];
    assert_eq!(jitter_sd_s(&[&residual], &flat, DT_S, 1.0), None);
    let short = vec![(0..20).map(f64::from).collect()];
    assert_eq!(jitter_sd_s(&[&residual[..20]], &short, DT_S, 1.0), None);
    assert_eq!(jitter_sd_s(&[], &[], DT_S, 1.0), None);
}

//! Divides a residual by octaves of frequency.

use std::f64::consts::TAU;

use super::excess::Cells;
use crate::problem::sample_roles::SampleRoles;

/// Number of samples in a window; neighbouring windows overlap by half.
const WINDOW: usize = 512;
/// Number of octaves, counted down from half the sample rate; the last band holds all lower
/// frequencies.
const BANDS: usize = 8;

/// Computes the power in octave bands by window (Welch's method with Hann's window), scaled such
/// that white noise of variance 1 has power 1 in every line. Segments of the recording that are
/// shorter than a window are left out.
pub(super) fn cells(roles: &SampleRoles, residual: &[f64], dt_s: f64) -> (Vec<String>, Cells) {
    let window: Vec<f64> =
        (0..WINDOW).map(|i| 0.5 - 0.5 * (TAU * i as f64 / WINDOW as f64).cos()).collect();
    let power: f64 = window.iter().map(|w| w * w).sum();
    let mut cells = Vec::new();
    for segment in &roles.segments {
        let mut from = segment.from;
        while from + WINDOW <= segment.to.min(residual.len()) {
            let mut wave: Vec<(f64, f64)> = residual[from..from + WINDOW]
                .iter()
                .zip(&window)
                .map(|(r, w)| (r * w, 0.0))
                .collect();
            transform(&mut wave);
            let base = cells.len();
            cells.resize(base + BANDS, (0.0, 0.0));
            for (line, (re, im)) in wave.iter().enumerate().take(WINDOW / 2) {
                let cell = &mut cells[base + band(line)];
                cell.0 += (re * re + im * im) / power;
                cell.1 += 1.0;
            }
            from += WINDOW / 2;
        }
    }
    if cells.is_empty() {
        return (Vec::new(), Cells::new(0, cells));
    }
    let hertz = |band: usize| {
        let f = 0.5 / dt_s / (1 << band) as f64;
        // Print one decimal; below 0.1 Hz, print up to the first digit that is not zero.
        let places = (-f.log10().floor()).clamp(1.0, 9.0) as usize;
        let text = format!("{f:.places$}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    let labels = (0..BANDS)
        .map(|b| match b + 1 {
            BANDS => format!("below {} Hz", hertz(b)),
            next => format!("{} to {} Hz", hertz(next), hertz(b)),
        })
        .collect();
    (labels, Cells::new(BANDS, cells))
}

/// Returns the index of the band to which a spectral line belongs; band 0 has the highest
/// frequencies.
fn band(line: usize) -> usize {
    (1..BANDS).take_while(|b| line <= (WINDOW / 2) >> b).count()
}

/// In-place discrete Fourier transform of a power of two of values (Cooley and Tukey).
fn transform(x: &mut [(f64, f64)]) {
    let n = x.len();
    let mut j = 0;
    for i in 1..n {
        let mut bit = n >> 1;
        while j & bit != 0 {
            j ^= bit;
            bit >>= 1;
        }
        j |= bit;
        if i < j {
            x.swap(i, j);
        }
    }
    let mut length = 2;
    while length <= n {
        let half = length / 2;
        let turns: Vec<(f64, f64)> =
            (0..half).map(|k| (-TAU * k as f64 / length as f64).sin_cos()).collect();
        for part in x.chunks_exact_mut(length) {
            let (a, b) = part.split_at_mut(half);
            for ((a, b), (s, c)) in a.iter_mut().zip(b).zip(&turns) {
                let t = (b.0 * c - b.1 * s, b.0 * s + b.1 * c);
                *b = (a.0 - t.0, a.1 - t.1);
                *a = (a.0 + t.0, a.1 + t.1);
            }
        }
        length *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;
    use testkit::tolerance::LOCAL_VALUE;

    #[test]
    fn the_transform_is_the_sum_it_stands_for() {
        let mut random = crate::numerics::random::RandomGenerator::new(9, 2);
        let x: Vec<f64> = (0..32).map(|_| random.gauss()).collect();
        let mut fast: Vec<(f64, f64)> = x.iter().map(|x| (*x, 0.0)).collect();
        transform(&mut fast);
        for (k, (re, im)) in fast.iter().enumerate() {
            let (mut c, mut s) = (0.0, 0.0);
            for (i, x) in x.iter().enumerate() {
                let angle = -TAU * (i * k) as f64 / 32.0;
                c += x * angle.cos();
                s += x * angle.sin();
            }
            // The largest of 32 lines of noise is about 10.
            assert_abs_diff_eq!(*re, c, epsilon = LOCAL_VALUE);
            assert_abs_diff_eq!(*im, s, epsilon = LOCAL_VALUE);
        }
    }

    #[test]
    fn lines_fall_into_octaves() {
        assert_eq!(band(255), 0);
        assert_eq!((band(129), band(128), band(64), band(3), band(2), band(0)), (0, 1, 2, 6, 7, 7));
    }

    fn whole(samples: usize) -> SampleRoles {
        use crate::problem::sample_roles::{Role, Segment};
        let segments = vec![Segment { trial: 0, from: 0, to: samples, role: Role::Fit }];
        SampleRoles { segments, block: 50, fit_trials: 1, borrowed_test: true }
    }

    /// Returns the excess by band of a residual at 100 Hz.
    fn excesses(residual: &[f64]) -> Vec<f64> {
        let (_, cells) = cells(&whole(residual.len()), residual, 0.01);
        cells.sliced(1, 0).iter().map(|s| s.excess).collect()
    }

    /// Energy is kept: sum |X|^2 = n sum |x|^2.
    #[test]
    fn the_transform_keeps_energy() {
        let mut random = crate::numerics::random::RandomGenerator::new(10, 2);
        let mut x: Vec<(f64, f64)> = (0..256).map(|_| (random.gauss(), random.gauss())).collect();
        let energy = |x: &[(f64, f64)]| x.iter().map(|(a, b)| a * a + b * b).sum::<f64>();
        let before = energy(&x);
        transform(&mut x);
        approx::assert_relative_eq!(energy(&x), 256.0 * before, max_relative = 1e-12);
    }

    /// Octaves count down from half of 100 Hz. A tone in the middle of an octave has almost all of
    /// its power there: two spectral lines away, the power of Hann's window has fallen to 1e-3, and
    /// it falls with the sixth power of the distance.
    #[test]
    fn a_tone_is_in_its_octave() {
        for band in 0..BANDS - 1 {
            let hertz = 0.75 * 50.0 / f64::from(1 << band);
            let tone: Vec<f64> =
                (0..8192).map(|i| 3.0 * (TAU * hertz * 0.01 * f64::from(i)).sin()).collect();
            let power: Vec<f64> = excesses(&tone).iter().map(|e| e + 1.0).collect();
            let lines = |b: usize| if b + 1 == BANDS { 3.0 } else { f64::from(128 >> b) };
            let all: f64 = power.iter().enumerate().map(|(b, p)| p * lines(b)).sum();
            let own = power[band] * lines(band) / all;
            // The narrowest octave has two spectral lines, and a third of the power of the window
            // lies beyond its edges.
            let least = if band < BANDS - 3 { 0.99 } else { 0.6 };
            assert!(own > least, "{hertz} Hz: {own} of {power:?}");
        }
    }

    /// Noise of variance 1 has power 1 in every octave. The lowest band has 3 lines in each of 127
    /// windows that overlap by half. These are some 200 independent powers, whose mean is known to
    /// 0.07. The tolerance is three times 0.07; the means of wider bands are known better.
    #[test]
    fn white_noise_has_the_same_power_in_every_octave() {
        let mut random = crate::numerics::random::RandomGenerator::new(11, 2);
        let noise: Vec<f64> = (0..32_768).map(|_| random.gauss()).collect();
        let found = excesses(&noise);
        assert!(found.iter().all(|e| e.abs() < 0.21), "{found:?}");
        assert!(found[0].abs() < 0.05, "{found:?}");
    }

    #[test]
    fn what_is_shorter_than_a_window_has_no_octaves() {
        let (labels, found) = cells(&whole(WINDOW - 1), &vec![1.0; WINDOW - 1], 0.01);
        assert!(labels.is_empty() && found.sliced(1, 0).is_empty());
        let (labels, _) = cells(&whole(WINDOW), &vec![1.0; WINDOW], 0.01);
        assert_eq!(labels.len(), BANDS);
        assert_eq!((labels[0].as_str(), labels[7].as_str()), ("25 to 50 Hz", "below 0.4 Hz"));
        let (labels, _) = cells(&whole(WINDOW), &vec![1.0; WINDOW], 1.0);
        assert_eq!((labels[0].as_str(), labels[7].as_str()), ("0.2 to 0.5 Hz", "below 0.004 Hz"));
    }
}

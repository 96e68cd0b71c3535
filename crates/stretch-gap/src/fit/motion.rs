//! Tests whether a residual depends on the motion.
//!
//! The noise of a recorder does not depend on the position or the direction of the machine; the
//! residual of a missing effect does. The samples are divided into cells c by level and direction
//! of the simulated output, and into parts b of 10 s of the recording. Cell c has n_c samples. With
//! the sum S_bc of the residual over the samples in part b and cell c, the statistic
//!
//! ```text
//! T(e) = sum over c of ( sum over b of e_b S_bc )^2 / n_c,     e_b = +1 or -1
//! ```
//!
//! has the same distribution for all signs e if a residual and its negative are equally likely in
//! each part. This holds for any autocorrelation within a part. Therefore T with all signs positive
//! is compared with T for random signs (randomisation test; Davison and Hinkley 1997, section 4.3).
//! The mean of each part is subtracted first, because a drift slower than a part would correlate
//! neighbouring parts.

use crate::{numerics::random::RandomGenerator, problem::sample_roles::SampleRoles};

/// Number of bins into which the output's range is divided.
const BINS: usize = 24;
/// Number of cells: each bin has one for rest, one for falling and one for rising output.
const CELLS: usize = 3 * BINS;
/// Length of a part, s.
const PART_S: f64 = 10.0;
/// Smallest number of parts for the test.
const LEAST_PARTS: usize = 8;
/// Number of draws of the signs.
const DRAWS: usize = 399;
/// Significance level: largest share of draws whose T is at least as large.
const RARE: f64 = 0.01;
/// Smallest variance of the motion-dependent part of the residual that counts, in variances of the
/// noise. Any machine has faint unmodelled effects, and in a long recording they would be
/// significant.
const LEAST_VARIANCE: f64 = 0.05;
/// Largest change of the output within a block at which the output counts as at rest, as a share of
/// its range.
const AT_REST: f64 = 1e-3;

/// Whether a residual, in multiples of the noise, depends significantly on the level or the
/// direction of the simulated output, by at least a twentieth of the noise's variance. False if the
/// recording has too few parts.
pub(crate) fn depends_on_motion(
    roles: &SampleRoles,
    residual: &[f64],
    output: &[f64],
    dt_s: f64,
) -> bool {
    let cells = cells(roles, residual.len(), output);
    let (counts, parts) = sums(roles, residual, &cells, (PART_S / dt_s).ceil() as usize);
    if parts.len() < LEAST_PARTS {
        return false;
    }
    let mut random = RandomGenerator::new(0, 0);
    let mut statistic = |is_drawn: bool| {
        let mut sums = [0.0; CELLS];
        for part in &parts {
            let sign = if is_drawn && random.unit() < 0.5 { -1.0 } else { 1.0 };
            sums.iter_mut().zip(part).for_each(|(sum, x)| *sum += sign * x);
        }
        sums.iter().zip(&counts).map(|(sum, n)| sum * sum / f64::max(*n, 1.0)).sum::<f64>()
    };
    let own = statistic(false);
    let drawn: Vec<f64> = (0..DRAWS).map(|_| statistic(true)).collect();
    let as_large = drawn.iter().filter(|x| **x >= own).count();
    let by_chance = drawn.iter().sum::<f64>() / DRAWS as f64;
    let variance = (own - by_chance) / counts.iter().sum::<f64>();
    (1 + as_large) as f64 <= RARE * (DRAWS + 1) as f64 && variance >= LEAST_VARIANCE
}

/// Returns the cell of each of the first `samples` samples, by the level and the direction of the
/// output. A constant output has one cell.
fn cells(roles: &SampleRoles, samples: usize, output: &[f64]) -> Vec<usize> {
    let segments = || roles.looked_at().filter(|s| s.to <= samples);
    let all = segments().flat_map(|s| &output[s.from..s.to]);
    let (least, most) = all.fold((f64::MAX, f64::MIN), |(a, b), &x| (a.min(x), b.max(x)));
    let range = f64::max(most - least, f64::MIN_POSITIVE);
    let mut cells = vec![0; samples];
    for segment in segments() {
        for i in segment.from..segment.to {
            let moved = output[(i + roles.block).min(segment.to - 1)] - output[i];
            let is_moving = moved.abs() > AT_REST * range;
            let direction = if is_moving { 1 + usize::from(moved > 0.0) } else { 0 };
            let bin = ((output[i] - least) / range * BINS as f64) as usize;
            cells[i] = direction * BINS + bin.min(BINS - 1);
        }
    }
    cells
}

/// Returns n_c, and S_bc by part, as defined in the module documentation.
fn sums(
    roles: &SampleRoles,
    residual: &[f64],
    cells: &[usize],
    length: usize,
) -> ([f64; CELLS], Vec<[f64; CELLS]>) {
    let (mut counts, mut parts) = ([0.0; CELLS], Vec::new());
    for segment in roles.looked_at().filter(|s| s.to <= residual.len()) {
        let range = segment.from..segment.to;
        for (values, cells) in
            residual[range.clone()].chunks(length).zip(cells[range].chunks(length))
        {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let mut sums = [0.0; CELLS];
            for (value, &cell) in values.iter().zip(cells) {
                sums[cell] += value - mean;
                counts[cell] += 1.0;
            }
            parts.push(sums);
        }
    }
    (counts, parts)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::problem::sample_roles::{Role, Segment};

    const TRIAL: usize = 6_000;

    /// Tests a residual of noise, drift and a ripple that depends on the position, in six trials of
    /// one minute each.
    fn depends(seed: u64, drift: f64, time_s: f64, ripple: impl Fn(f64, bool) -> f64) -> bool {
        let mut random = RandomGenerator::new(3, seed);
        let kept = (-0.01 / time_s).exp();
        let (mut state, mut output, mut residual) = (random.gauss(), Vec::new(), Vec::new());
        for i in 0..6 * TRIAL {
            let t_s = 0.01 * i as f64;
            let position = (1.3 * t_s).sin() + 0.6 * (2.9 * t_s).sin();
            let rises = 1.3 * (1.3 * t_s).cos() + 0.6 * 2.9 * (2.9 * t_s).cos() > 0.0;
            state = kept * state + (1.0 - kept * kept).sqrt() * random.gauss();
            residual.push(drift * state + ripple(position, rises) + random.gauss());
            output.push(position);
        }
        let segment = |trial: usize| Segment {
            trial,
            from: trial * TRIAL,
            to: (trial + 1) * TRIAL,
            role: Role::Fit,
        };
        let segments = (0..6).map(segment).collect();
        let roles = SampleRoles { segments, block: 50, fit_trials: 6, borrowed_test: false };
        depends_on_motion(&roles, &residual, &output, 0.01)
    }

    #[test]
    fn noise_and_drift_do_not_depend_on_motion() {
        let times_s = [0.3, 1.0, 3.0, 12.0, 30.0];
        let alarms = (0..100).zip(times_s.into_iter().cycle());
        let alarms = alarms.filter(|(seed, time_s)| depends(*seed, 0.7, *time_s, |_, _| 0.0));
        // One false alarm in a hundred is expected.
        assert!(alarms.count() <= 4);
    }

    #[test]
    fn a_ripple_and_a_difference_of_directions_depend_on_motion() {
        let detent = |x: f64, _: bool| 0.5 * (TAU * 2.0 * x).sin();
        let asymmetry = |x: f64, rises: bool| if rises { x } else { 0.0 };
        let bump = |x: f64, _: bool| if (0.4..0.6).contains(&x) { 2.0 } else { 0.0 };
        for seed in 0..10 {
            for (drift, time_s) in [(0.0, 1.0), (0.3, 0.3), (0.3, 3.0)] {
                assert!(depends(seed, drift, time_s, detent), "detent {seed} {drift} {time_s}");
                assert!(
                    depends(seed, drift, time_s, asymmetry),
                    "asymmetry {seed} {drift} {time_s}"
                );
                assert!(depends(seed, drift, time_s, bump), "bump {seed} {drift} {time_s}");
            }
        }
    }
}

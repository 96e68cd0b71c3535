//! Decides whether a drifting parameter swings, i.e. oscillates. Two hypotheses are compared: a
//! drift plus a spectral line (an oscillation with one frequency), and the drift alone.
//!
//! Size and correlation time of a drift are adapted to the recording. If a parameter swings, this
//! drift explains the swing as a fast drift, so that no gap is left. The covariance V of the
//! residual r contains this drift; [cleaning](crate::fit::metric::Metric::clean) turns r into V^-1
//! r. With the spectral line, the parameter swings with one frequency f and amplitude s, and with a
//! separate phase in each segment k. B is the ratio of the two likelihoods (the Bayes factor):
//!
//! ```text
//! a_k cos(2 pi f t) + b_k sin(2 pi f t),     a_k, b_k ~ N(0, s^2/2),     U_k = C (cos, sin) at the knots of the drift
//! ln B = sum_k ( q_k' M_k^-1 q_k - ln det M_k + 2 ln(2/s^2) )/2,     M_k = A_k + (2/s^2) I
//! A_k = U_k' V^-1 U_k,     q_k = U_k' V^-1 r
//! ```
//!
//! The equations are those of Rasmussen and Williams (2006, section 2.7). Without a drift, ln B is
//! the periodogram of Bretthorst (1988, doi 10.1007/978-1-4684-9399-3). If the median of |q|^2
//! around f is larger than V predicts, V is scaled up, because a wrong form of an effect also
//! leaves power, but not only at f. B is averaged over all amplitudes and frequencies of the line. It is
//! computed only at the strongest peaks and counts as 0 elsewhere, which favours the drift. The
//! prior odds are even.

use std::f64::consts::TAU;

use crate::{
    fit::{
        metric::{Loose, Metric},
        nuisance::Nuisance,
    },
    numerics::linear::dot,
    problem::sample_roles::SampleRoles,
};

/// A drifting parameter that may swing instead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Swing {
    /// Index of the parameter.
    pub(crate) parameter: usize,
    /// Frequency, Hz.
    pub(crate) hertz: f64,
    /// Amplitude, in the parameter's unit.
    pub(crate) amplitude: f64,
    /// Probability of the swing, against the drift alone.
    pub(crate) probability: f64,
}

/// Amplitudes that are tried, as multiples of the drift's standard deviation.
const AMPLITUDES: [f64; 4] = [0.25, 0.5, 1.0, 2.0];
/// A period must contain at least [`KNOTS`] knots of the drift, and the longest segment at least
/// [`TURNS`] periods.
const KNOTS: f64 = 4.0;
const TURNS: f64 = 2.0;
/// Largest number of frequencies that are tried, the low ones first. It suffices for all
/// frequencies of a segment of five minutes.
const MOST: usize = 1500;
/// Number of neighbouring frequencies on either side, whose median power is the usual power at a frequency.
const BESIDE: usize = 10;
/// Number of peaks at which B is computed: those whose power exceeds the usual power most.
const PEAKS: usize = 6;

impl Metric {
    /// Returns the most likely swing of every drifting parameter. `clean` is a residual over all
    /// segments without nuisances.
    pub(crate) fn swings(&self, roles: &SampleRoles, clean: &[f64]) -> Vec<Swing> {
        let is_drift = |l: &&Loose| l.drift.is_some() && !l.is_by_tick && l.level.size > 0.0;
        let drifts = self.loose().iter().filter(is_drift);
        let one = |(which, loose): (usize, &Loose)| {
            let parameter = loose.parameter?;
            let (hertz, share, probability) = self.likeliest(which, roles, clean)?;
            let sd = loose.drift.map_or(0.0, |drift| drift.sd) * loose.level.size;
            Some(Swing { parameter, hertz, amplitude: share * sd, probability })
        };
        drifts.enumerate().filter_map(one).collect()
    }

    /// Returns the frequency of the most likely swing of one drift, its amplitude as a multiple of
    /// the drift's standard deviation, and its probability.
    fn likeliest(
        &self,
        which: usize,
        roles: &SampleRoles,
        clean: &[f64],
    ) -> Option<(f64, f64, f64)> {
        let there = self.nuisances().iter().zip(&roles.segments);
        let parts: Vec<Part<'_>> = there
            .filter_map(|(nuisance, segment)| {
                Some(Part::of(nuisance.as_ref()?, which, &clean[segment.from..segment.to]))
            })
            .collect();
        let longest = parts.iter().max_by(|a, b| a.lasts_s().total_cmp(&b.lasts_s()))?;
        let (lasts_s, step_s) = (longest.lasts_s(), longest.step_s);
        let count = ((2.0 * lasts_s / (KNOTS * step_s) - 2.0 * TURNS) as usize).min(MOST);
        let hertz = |k: usize| (TURNS + 0.5 * k as f64) / lasts_s;
        let waves = |hertz: f64| waves(TAU * hertz * step_s, longest.heard.len());
        let power = |k: usize| {
            let waves = waves(hertz(k));
            parts.iter().flat_map(|part| part.q(&waves)).map(|q| q * q).sum()
        };
        let powers: Vec<f64> = (0..count).map(power).collect();
        let is_peak = |&k: &usize| {
            let beside = [k.wrapping_sub(1), k + 1].map(|at| powers.get(at).copied());
            beside.iter().flatten().all(|power| *power <= powers[k])
        };
        let mut peaks: Vec<usize> = (0..count).filter(is_peak).collect();
        let standing: Vec<f64> = (0..count).map(|k| powers[k] / usual(&powers, k)).collect();
        peaks.sort_by(|&a, &b| standing[b].total_cmp(&standing[a]));
        peaks.truncate(PEAKS);
        let mut sum = 0.0;
        let mut best: Option<(f64, f64, f64)> = None;
        for k in peaks {
            let (hertz, waves) = (hertz(k), waves(hertz(k)));
            let heard: Vec<Heard> = parts.iter().map(|part| part.line(&waves)).collect();
            let predicted: f64 = heard.iter().map(|h| h.a[0] + h.a[2]).sum();
            let times = (usual(&powers, k) / predicted).max(1.0);
            let heard: Vec<Heard> = heard.into_iter().map(|h| h.in_noise(times)).collect();
            for amplitude in AMPLITUDES {
                let precision = 2.0 / (amplitude * amplitude);
                let factor: f64 = heard.iter().map(|h| h.ln_factor(precision)).sum();
                // The limit keeps the odds finite.
                sum += factor.min(300.0).exp();
                if best.as_ref().is_none_or(|(most, ..)| factor > *most) {
                    best = Some((factor, hertz, rms_amplitude(&heard, precision)));
                }
            }
        }
        let factor = sum / (count * AMPLITUDES.len()) as f64;
        best.map(|(_, hertz, share)| (hertz, share, factor / (1.0 + factor)))
    }
}

/// Returns the median power of the frequencies around index `k`.
fn usual(powers: &[f64], k: usize) -> f64 {
    let mut beside = powers[k.saturating_sub(BESIDE)..(k + BESIDE).min(powers.len())].to_vec();
    beside.sort_by(f64::total_cmp);
    beside[beside.len() / 2].max(f64::MIN_POSITIVE)
}

/// One segment of the residual, projected on one of its drifts.
struct Part<'a> {
    nuisance: &'a Nuisance,
    which: usize,
    step_s: f64,
    /// C'V^-1 r at the knots.
    heard: Vec<f64>,
}

impl<'a> Part<'a> {
    fn of(nuisance: &'a Nuisance, which: usize, clean: &[f64]) -> Self {
        let (step_s, heard) = nuisance.at_knots(which, clean);
        Self { nuisance, which, step_s, heard }
    }

    fn lasts_s(&self) -> f64 {
        self.heard.len() as f64 * self.step_s
    }

    /// Returns q of the module documentation. `waves` may be longer than the segment.
    fn q(&self, waves: &[Vec<f64>; 2]) -> [f64; 2] {
        [0, 1].map(|i| dot(&waves[i][..self.heard.len()], &self.heard))
    }

    /// Returns A and q of the module documentation.
    fn line(&self, waves: &[Vec<f64>; 2]) -> Heard {
        let columns = [0, 1].map(|i| self.nuisance.course(self.which, &waves[i]));
        let tails = [0, 1].map(|i| self.nuisance.tail(&columns[i]));
        let product =
            |i: usize, j: usize| dot(&columns[i], &columns[j]) - dot(&tails[i], &tails[j]);
        Heard { a: [product(0, 0), product(0, 1), product(1, 1)], q: self.q(waves) }
    }
}

/// Returns cosine and sine at the knots, computed by repeated rotation. The phase grows by `turn`
/// rad from knot to knot.
fn waves(turn: f64, knots: usize) -> [Vec<f64>; 2] {
    let (sin, cos) = (libm::sin(turn), libm::cos(turn));
    let turned = |&(c, s): &(f64, f64)| Some((c * cos - s * sin, s * cos + c * sin));
    let (c, s) = std::iter::successors(Some((1.0, 0.0)), turned).take(knots).unzip();
    [c, s]
}

/// Statistics of one segment for a spectral line: the upper triangle of A, and q of the module
/// documentation.
struct Heard {
    a: [f64; 3],
    q: [f64; 2],
}

impl Heard {
    /// Returns the statistics if the power of the noise around the frequency is `times` as large as
    /// V predicts.
    fn in_noise(self, times: f64) -> Self {
        Self { a: self.a.map(|a| a / times), q: self.q.map(|q| q / times) }
    }

    /// Returns the upper triangle of M, and its determinant.
    fn with(&self, precision: f64) -> ([f64; 3], f64) {
        let m = [self.a[0] + precision, self.a[1], self.a[2] + precision];
        (m, m[0] * m[2] - m[1] * m[1])
    }

    /// Returns the most likely amplitudes of cosine and sine: M^-1 q.
    fn likeliest(&self, precision: f64) -> [f64; 2] {
        let ([a, b, d], det) = self.with(precision);
        let [x, y] = self.q;
        [(d * x - b * y) / det, (a * y - b * x) / det]
    }

    /// Returns the segment's part of ln B.
    fn ln_factor(&self, precision: f64) -> f64 {
        let (_, det) = self.with(precision);
        let best = self.likeliest(precision);
        0.5 * (dot(&best, &self.q) - det.ln() + 2.0 * precision.ln())
    }
}

/// Returns the root mean square, over segments, of the most likely amplitude. Each segment is
/// weighted by its information.
fn rms_amplitude(heard: &[Heard], precision: f64) -> f64 {
    let (mut sum, mut weight) = (0.0, 0.0);
    for own in heard {
        let [x, y] = own.likeliest(precision);
        let told = own.a[0] + own.a[2];
        sum += told * (x * x + y * y);
        weight += told;
    }
    (sum / f64::max(weight, f64::MIN_POSITIVE)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        fit::noise_level::NoiseLevel,
        numerics::random::RandomGenerator,
        problem::{
            sample_roles::{Role, Segment},
            spec::SlowDrift,
        },
    };

    const TRIAL: usize = 2000;
    const TRIALS: usize = 8;

    /// Returns the swing that is found for a parameter that drifts and swings. The drift has the
    /// described size and the correlation time `time_s`. The swing has a frequency of 0.7 Hz and
    /// the given amplitude, in multiples of the drift's standard deviation.
    fn found(seed: u64, time_s: f64, amplitude: f64) -> Swing {
        let mut random = RandomGenerator::new(seed, 0);
        let samples = TRIAL * TRIALS;
        let drive: Vec<f64> = (0..samples).map(|i| 2.0 + (0.003 * i as f64).sin()).collect();
        let kept = (-0.01 / time_s).exp();
        let (mut drift, mut phase) = (random.gauss(), 0.0);
        let mut residual = Vec::new();
        for (i, drive) in drive.iter().enumerate() {
            if i.is_multiple_of(TRIAL) {
                (drift, phase) = (random.gauss(), TAU * random.unit());
            }
            drift = kept * drift + (1.0 - kept * kept).sqrt() * random.gauss();
            let swing = amplitude * (phase + TAU * 0.7 * 0.01 * i as f64).sin();
            residual.push(drive * (drift + swing) + random.gauss());
        }
        let noise = NoiseLevel {
            sd: vec![1.0; samples],
            rms: 1.0,
            source: String::new(),
            known_to: 0.0,
            isolated: 0,
        };
        let segment = |trial: usize| Segment {
            trial,
            from: trial * TRIAL,
            to: (trial + 1) * TRIAL,
            role: Role::Fit,
        };
        let segments: Vec<Segment> = (0..TRIALS).map(segment).collect();
        let roles = SampleRoles { segments, block: 50, fit_trials: TRIALS, borrowed_test: false };
        let described = SlowDrift { sd: 3.0, correlation_s: 4.0 };
        let metric = Metric::with_drift(noise, drive, described, &roles, 0.01);
        let (adapted, _) = metric.adapted(&roles, &residual, |_| false);
        let mut clean = residual;
        adapted.clean(&roles, &mut clean);
        adapted.swings(&roles, &clean)[0]
    }

    #[test]
    fn a_drift_alone_does_not_swing() {
        for (seed, time_s) in (0..40).zip([0.5, 1.0, 4.0, 12.0].into_iter().cycle()) {
            let swing = found(seed, time_s, 0.0);
            assert!(swing.probability < 0.5, "{seed}: {swing:?}");
        }
    }

    #[test]
    fn a_swing_is_told_with_its_frequency_and_amplitude() {
        for (seed, time_s) in [(1, 1.0), (2, 4.0), (3, 12.0)] {
            for amplitude in [0.5, 1.0, 1.5] {
                let swing = found(seed, time_s, amplitude);
                assert!(swing.probability > 0.95, "{swing:?}");
                approx::assert_abs_diff_eq!(swing.hertz, 0.7, epsilon = 0.025);
                // The amplitude is in the parameter's unit: one standard deviation of the drift is
                // 3.
                approx::assert_relative_eq!(swing.amplitude, 3.0 * amplitude, max_relative = 0.3);
            }
        }
    }
}

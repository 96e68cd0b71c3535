//! Computes the strength of a case: the excess (reduced chi-square minus one) that remains after
//! the nominal rig is re-tuned.

use crate::disturbances::Surroundings;
use crate::effect::{Causes, Stage};
use crate::protocol::{Script, Split};
use crate::rig::{L_0, L_STEP, Rig, UNCERTAIN, V_STEP};
use crate::session::{COARSE, Conditions, Trace, run};

/// A residual or a sensitivity in the three channels pressure, length and voltage, in multiples of
/// the noise, for all samples.
type Channels = [Vec<f64>; 3];

/// The simulated session of a rig without effects, and the sessions with one parameter changed,
/// which are computed when needed.
#[derive(Debug)]
pub(crate) struct Yardstick<'a> {
    rig: &'a Rig,
    scripts: &'a [Script],
    conditions: &'a Conditions,
    pressure_column: bool,
    nominal: Vec<Trace>,
    moved: Vec<Option<Vec<Trace>>>,
    noise: [f64; 3],
}

impl<'a> Yardstick<'a> {
    pub(crate) fn new(
        rig: &'a Rig,
        scripts: &'a [Script],
        conditions: &'a Conditions,
        around: &Surroundings,
        pressure_column: bool,
    ) -> Self {
        let [sigma_p, sigma_l, sigma_v] = around.noise.map(|noise| noise.sigma);
        let nominal = run(rig, &Causes::default(), scripts, conditions, COARSE);
        let full = rig.static_contraction(rig.p_s() + crate::rig::P_ATM);
        let slope = (rig.volts(full) - rig.volts(0.0)) / (full * L_0);
        // The simulated gauge is driven by the measured length, so noise of the length reaches its
        // voltage.
        let volts = sigma_v.powi(2) + V_STEP.powi(2) / 12.0 + (slope * sigma_l).powi(2);
        let noise = [sigma_p, (sigma_l.powi(2) + L_STEP.powi(2) / 12.0).sqrt(), volts.sqrt()];
        let moved = vec![None; UNCERTAIN.len()];
        Self { rig, scripts, conditions, pressure_column, nominal, moved, noise }
    }

    /// Returns the excess on the test trials, summed over the channels, and the smallest strain.
    /// The nominal parameters are first re-tuned on the fit trials.
    pub(crate) fn excess(&mut self, causes: &Causes) -> (f64, f64) {
        let truth = run(self.rig, causes, self.scripts, self.conditions, COARSE);
        let least = truth.iter().map(|t| t.least_strain).fold(f64::INFINITY, f64::min);
        let residual = self.residual(&truth);
        let used: Vec<usize> = (0..UNCERTAIN.len())
            .filter(|&i| self.shows(UNCERTAIN[i].stage, UNCERTAIN[i].name, &residual))
            .collect();
        let columns: Vec<Channels> = used.iter().map(|&i| self.sensitivity(i, &truth)).collect();
        let shift = self.retune(&residual, &columns);
        let mut excess = 0.0;
        for channel in 0..3 {
            let (mut sum, mut count) = (0.0, 0usize);
            for (at, r) in self.samples(Split::Test).map(|at| (at, residual[channel].get(at))) {
                let Some(r) = r else { continue };
                let fitted: f64 = columns.iter().zip(&shift).map(|(c, s)| s * c[channel][at]).sum();
                sum += (r - fitted).powi(2);
                count += 1;
            }
            excess += if count > 0 { sum / count as f64 } else { 0.0 };
        }
        (excess, least)
    }

    /// Returns the indices of the samples of a split in all trials concatenated.
    fn samples(&self, split: Split) -> impl Iterator<Item = usize> + '_ {
        let mut begin = 0;
        self.scripts.iter().flat_map(move |script| {
            let range = begin..begin + script.openings.len();
            begin = range.end;
            if script.split == split { range } else { 0..0 }
        })
    }

    fn join<F: Fn(&Trace, &Trace, usize) -> f64>(
        &self,
        truth: &[Trace],
        noise: f64,
        f: F,
    ) -> Vec<f64> {
        let pairs = truth.iter().zip(&self.nominal);
        pairs
            .flat_map(|(t, n)| {
                let f = &f;
                (0..t.length.len()).map(move |i| f(t, n, i) / noise)
            })
            .collect()
    }

    /// Returns the residual of the nominal rig in each channel. Every stage is driven by its
    /// measured input.
    fn residual(&self, truth: &[Trace]) -> Channels {
        let is_measured = self.pressure_column;
        let pressure = match is_measured {
            true => self.join(truth, self.noise[0], |t, n, i| t.pressure[i] - n.pressure[i]),
            false => Vec::new(),
        };
        let length = self.join(truth, self.noise[1], |t, n, i| {
            t.length[i] - if is_measured { t.shadow[i] } else { n.length[i] }
        });
        let volts = self.join(truth, self.noise[2], |t, _, i| {
            t.volts[i] - self.rig.volts(1.0 - t.length[i] / L_0)
        });
        [pressure, length, volts]
    }

    /// Whether a parameter can explain a part of the residual.
    fn shows(&self, stage: Stage, name: &str, residual: &Channels) -> bool {
        let alive = |c: usize| residual[c].iter().any(|r| r.abs() > 1e-3);
        match stage {
            Stage::Pneumatics if self.pressure_column => alive(0),
            Stage::Pneumatics | Stage::Muscle => alive(1),
            // The trimmed arm scales with the resistance, so R0 has no effect.
            _ => alive(2) && name != "R0",
        }
    }

    /// Returns the change of every channel by one standard deviation of a parameter.
    fn sensitivity(&mut self, index: usize, truth: &[Trace]) -> Channels {
        let parameter = &UNCERTAIN[index];
        let step = 0.25 * parameter.sd;
        let samples = self.nominal.iter().map(|t| t.length.len()).sum();
        let zero = || vec![0.0; samples];
        if parameter.stage == Stage::Sensing {
            let rig = self.rig.moved(index, step);
            let scale = 0.25 * self.noise[2];
            let volts = self.join(truth, scale, |t, _, i| {
                let k = 1.0 - t.length[i] / L_0;
                rig.volts(k) - self.rig.volts(k)
            });
            return [zero(), zero(), volts];
        }
        if self.moved[index].is_none() {
            let rig = self.rig.moved(index, step);
            let traces = run(&rig, &Causes::default(), self.scripts, self.conditions, COARSE);
            self.moved[index] = Some(traces);
        }
        let moved = self.moved[index].as_deref().unwrap_or_default();
        let pressure = match self.pressure_column {
            true => self.join(moved, 0.25 * self.noise[0], |t, n, i| t.pressure[i] - n.pressure[i]),
            false => zero(),
        };
        let length = match self.pressure_column && parameter.stage == Stage::Pneumatics {
            true => zero(),
            false => self.join(moved, 0.25 * self.noise[1], |t, n, i| t.length[i] - n.length[i]),
        };
        [pressure, length, zero()]
    }

    /// Returns the shifts of the parameters, in standard deviations, that best explain the residual
    /// of the fit trials: least squares with the tolerances as prior and bounds of three standard
    /// deviations.
    fn retune(&self, residual: &Channels, columns: &[Channels]) -> Vec<f64> {
        let n = columns.len();
        let mut normal = vec![vec![0.0; n]; n];
        let mut right = vec![0.0; n];
        // Residuals are correlated over about 50 samples, which count as one.
        let weight = 1.0 / 50.0;
        for channel in 0..3 {
            if residual[channel].is_empty() {
                continue;
            }
            for at in self.samples(Split::Fit) {
                for i in 0..n {
                    let x = columns[i][channel][at];
                    if x == 0.0 {
                        continue;
                    }
                    right[i] += weight * x * residual[channel][at];
                    for j in 0..=i {
                        normal[i][j] += weight * x * columns[j][channel][at];
                    }
                }
            }
        }
        let lower = normal.clone();
        for (i, row) in normal.iter_mut().enumerate() {
            row[i] += 1.0;
            row.iter_mut().enumerate().skip(i + 1).for_each(|(j, x)| *x = lower[j][i]);
        }
        bounded(&normal, &right, 3.0)
    }
}

/// Minimises 0.5 x'Ax - b'x with every |x_i| at most `bound`, for a positive definite A, by cyclic
/// coordinate descent with projection.
fn bounded(a: &[Vec<f64>], b: &[f64], bound: f64) -> Vec<f64> {
    let mut x = vec![0.0; b.len()];
    for _ in 0..20_000 {
        let mut change = 0.0_f64;
        for i in 0..x.len() {
            let other: f64 = (0..x.len()).filter(|&j| j != i).map(|j| a[i][j] * x[j]).sum();
            let next = ((b[i] - other) / a[i][i]).clamp(-bound, bound);
            change = change.max((next - x[i]).abs());
            x[i] = next;
        }
        if change < 1e-7 {
            break;
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;
    use testkit::tolerance::BOUNDED_SQUARES;

    #[test]
    fn bounded_least_squares_stops_at_its_bound() {
        let a = vec![vec![2.0, 0.5], vec![0.5, 1.0]];
        let free = bounded(&a, &[1.0, 1.0], 3.0);
        assert_abs_diff_eq!(free[0], 0.5 / 1.75, epsilon = BOUNDED_SQUARES);
        assert_abs_diff_eq!(free[1], 1.5 / 1.75, epsilon = BOUNDED_SQUARES);
        // With x1 held at its bound, x0 = (b0 - 0.5 x1) / 2.
        let held = bounded(&a, &[1.0, 9.0], 3.0);
        assert_eq!(held[1], 3.0);
        assert_abs_diff_eq!(held[0], -0.25, epsilon = BOUNDED_SQUARES);
    }
}

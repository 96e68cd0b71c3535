//! A plant with two stages, of which the second is driven by the output of the first: parameters,
//! candidate effects, equations.

use super::label::Form;

/// A nominal parameter.
#[derive(Debug)]
pub(super) struct Parameter {
    pub(super) name: &'static str,
    pub(super) unit: &'static str,
    pub(super) value: f64,
    /// One standard deviation, as a share of the value.
    pub(super) tolerance: f64,
    /// Stage in which it acts.
    pub(super) stage: usize,
}

/// An effect that may be missing from the simulator.
#[derive(Debug)]
pub(super) struct Candidate {
    pub(super) name: &'static str,
    pub(super) stage: usize,
    pub(super) action: Action,
    /// Strength at which the effect does nothing, and the largest strength that is drawn.
    pub(super) range: (f64, f64),
}

impl Candidate {
    pub(super) const fn new(
        name: &'static str,
        stage: usize,
        action: Action,
        range: (f64, f64),
    ) -> Self {
        Self { name, stage, action, range }
    }
}

/// An operator on a sampled signal, with the strength, the form and the times of the samples.
pub(super) type Operator = fn(&[f64], f64, &Form, Grid) -> Vec<f64>;

/// Place and operation of an effect.
#[derive(Debug, Clone, Copy)]
pub(super) enum Action {
    /// Acts on the input of the stage.
    Before(Operator),
    /// Acts on the output of the stage.
    Behind(Operator),
    /// Acts in the differential equation. The function returns the amount that is subtracted from
    /// the drive, from the state, strength, form and input.
    Inside(fn(f64, f64, &Form, f64) -> f64),
}

/// An active effect.
#[derive(Debug, Clone, Copy)]
pub(super) struct Act {
    pub(super) candidate: &'static Candidate,
    pub(super) strength: f64,
    pub(super) form: Form,
}

/// Times of the samples of a trial: the sample time in s; the start of the trial and the sample time as
/// shares of the session.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    pub(super) dt_s: f64,
    pub(super) start: f64,
    pub(super) step: f64,
}

/// One trial.
#[derive(Debug, Clone)]
pub(super) struct Drive {
    pub(super) input: Vec<f64>,
    pub(super) grid: Grid,
}

/// A stage: its output, its noise, and its equation x' = f(x, input, taken). `taken` is the amount
/// that effects inside subtract from the drive.
#[derive(Debug)]
pub(super) struct StageSpec {
    pub(super) name: &'static str,
    pub(super) output: &'static str,
    pub(super) unit: &'static str,
    pub(super) noise: f64,
    /// Derivative of the states as a function of states, input, parameters and `taken`.
    pub(super) derivative: fn([f64; 2], f64, &[f64], f64) -> [f64; 2],
    /// States at rest.
    pub(super) rest: [f64; 2],
    /// Index of the state that is the output.
    pub(super) shown: usize,
    /// Whether the input is held between samples, or linearly interpolated.
    pub(super) is_held: bool,
}

/// A plant.
#[derive(Debug)]
pub(super) struct PlantSpec {
    pub(super) name: &'static str,
    pub(super) dt_s: f64,
    /// Largest number of samples of a trial.
    pub(super) samples: usize,
    pub(super) input: &'static str,
    pub(super) input_unit: &'static str,
    /// Smallest and largest input.
    pub(super) span: (f64, f64),
    pub(super) parameters: &'static [Parameter],
    pub(super) stages: [StageSpec; 2],
    pub(super) candidates: &'static [Candidate],
    pub(super) foreign: &'static [Candidate],
    /// Effects that the simulator itself implements, as lines of a problem file.
    pub(super) effects: &'static str,
}

/// Number of integration steps between two samples. The published simulators use four.
const SUBSTEPS: usize = 12;

impl PlantSpec {
    /// Returns the noise-free output of a stage for one trial.
    pub(super) fn stage(&self, stage: usize, p: &[f64], acts: &[Act], drive: &Drive) -> Vec<f64> {
        let spec = &self.stages[stage];
        let acts: Vec<&Act> = acts.iter().filter(|a| a.candidate.stage == stage).collect();
        let mut input = drive.input.clone();
        for act in &acts {
            if let Action::Before(operator) = act.candidate.action {
                input = operator(&input, act.strength, &act.form, drive.grid);
            }
        }
        let mut out = self.integrated(spec, p, &acts, &input);
        for act in &acts {
            if let Action::Behind(operator) = act.candidate.action {
                out = operator(&out, act.strength, &act.form, drive.grid);
            }
        }
        out
    }

    fn integrated(&self, spec: &StageSpec, p: &[f64], acts: &[&Act], input: &[f64]) -> Vec<f64> {
        let step = self.dt_s / SUBSTEPS as f64;
        let mut x = spec.rest;
        let mut out = Vec::with_capacity(input.len());
        for (i, &now) in input.iter().enumerate() {
            out.push(x[spec.shown]);
            let next = if spec.is_held { now } else { *input.get(i + 1).unwrap_or(&now) };
            for k in 0..SUBSTEPS {
                let u = now + (next - now) * (k as f64 + 0.5) / SUBSTEPS as f64;
                let taken: f64 = acts
                    .iter()
                    .filter_map(|act| match act.candidate.action {
                        Action::Inside(f) => Some(f(x[spec.shown], act.strength, &act.form, u)),
                        _ => None,
                    })
                    .sum();
                let slope = (spec.derivative)(x, u, p, taken);
                x = [x[0] + step * slope[0], x[1] + step * slope[1]];
            }
        }
        out
    }
}

// Operators in front of or behind a stage, on sampled signals, each in a form that need not be in the catalogue.

/// y(t) = x(t - delay). The share `softness` of the delay is a first-order lag instead of a dead
/// time.
pub(super) fn delay(x: &[f64], delay_s: f64, form: &Form, grid: Grid) -> Vec<f64> {
    let dead = delay_s * (1.0 - form.softness) / grid.dt_s;
    let (whole, rest) = (dead.floor() as usize, dead.fract());
    let at = |i: usize| x[i.saturating_sub(whole)];
    let moved: Vec<f64> =
        (0..x.len()).map(|i| at(i) * (1.0 - rest) + at(i.saturating_sub(1)) * rest).collect();
    lag(&moved, delay_s * form.softness, &Form::default(), grid)
}

/// Two first-order lags in series, with time constants of 1 - spread/2 and spread/2 times `tau_s`,
/// exact for an input that is constant between samples.
pub(super) fn lag(x: &[f64], tau_s: f64, form: &Form, grid: Grid) -> Vec<f64> {
    let second = 0.5 * form.spread;
    let mut out = x.to_vec();
    for tau in [tau_s * (1.0 - second), tau_s * second] {
        if tau < 1e-9 {
            continue;
        }
        let share = 1.0 - (-grid.dt_s / tau).exp();
        let mut y = out[0];
        for value in &mut out {
            y += share * (*value - y);
            *value = y;
        }
    }
    out
}

/// Dead zone: values with a magnitude below `width` have no effect. The corners are rounded by a softplus. The
/// asymmetry makes the widths of the two sides different.
pub(super) fn dead_zone(x: &[f64], width: f64, form: &Form, _: Grid) -> Vec<f64> {
    let corner = (form.softness * width).max(1e-9);
    let rise = |z: f64| {
        let z = z / corner;
        corner * if z > 30.0 { z } else { z.exp().ln_1p() }
    };
    let (up, down) = (width * (1.0 + form.asymmetry), width * (1.0 - form.asymmetry));
    x.iter().map(|&x| if width < 1e-12 { x } else { rise(x - up) - rise(-x - down) }).collect()
}

/// Limits values to the range from -`limit` to `limit`: y = x (1 + |x/limit|^q)^(-1/q) with q =
/// 2/softness. At a softness of 0, values are clamped.
pub(super) fn saturation(x: &[f64], limit: f64, form: &Form, _: Grid) -> Vec<f64> {
    x.iter()
        .map(|&x| {
            let end = limit * if x > 0.0 { 1.0 } else { 1.0 - form.asymmetry.abs() };
            if form.softness < 0.02 {
                return x.clamp(-end, end);
            }
            let q = 2.0 / form.softness;
            x * (1.0 + (x / end).abs().powf(q)).powf(-1.0 / q)
        })
        .collect()
}

/// One play operator: the output is constant until x is farther from it than `radius`.
fn play(x: &[f64], radius: f64) -> Vec<f64> {
    let mut y = x[0];
    x.iter()
        .map(|&x| {
            y = y.clamp(x - radius, x + radius);
            y
        })
        .collect()
}

/// Mean of four plays with different radii around `width`.
pub(super) fn backlash(x: &[f64], width: f64, form: &Form, _: Grid) -> Vec<f64> {
    let steps = [-1.0, -0.3, 0.3, 1.0];
    let plays = steps.map(|s| play(x, width * (1.0 + s * form.spread).max(0.0)));
    let shift = form.asymmetry * width;
    (0..x.len()).map(|i| plays.iter().map(|p| p[i]).sum::<f64>() / 4.0 + shift).collect()
}

/// y = x - share (weighted mean of x - play(x, r)), with the radii r = `scale` {1, 1/2, 1/4}. The
/// spread sets the weights.
pub(super) fn hysteresis(x: &[f64], share: f64, scale: f64, form: &Form) -> Vec<f64> {
    let plays = [1.0, 0.5, 0.25].map(|r| play(x, scale * r));
    let weights = [1.0, 1.0 + form.spread, 1.0 - 0.5 * form.spread];
    let total: f64 = weights.iter().sum();
    (0..x.len())
        .map(|i| {
            let held = (0..3).map(|k| weights[k] * (x[i] - plays[k][i])).sum::<f64>() / total;
            x[i] - share * held
        })
        .collect()
}

/// y = x + share (x - lagged x). The output overshoots after a change, or creeps if the share is
/// negative.
pub(super) fn relaxation(x: &[f64], share: f64, tau_s: f64, form: &Form, grid: Grid) -> Vec<f64> {
    let spread = 1.0 + 3.0 * form.spread;
    let [fast, slow] = [tau_s / spread, tau_s * spread].map(|s| lag(x, s, &Form::default(), grid));
    (0..x.len()).map(|i| x[i] + share * (x[i] - 0.5 * (fast[i] + slow[i]))).collect()
}

/// Drift of the zero by `change` from the start to the end of the session. The drift is exponential
/// in time; a larger softness makes it more curved.
pub(super) fn drift(x: &[f64], change: f64, form: &Form, grid: Grid) -> Vec<f64> {
    let bend = 3.0 * form.softness + 1e-9;
    let shape = |t: f64| (1.0 - (-bend * t).exp()) / (1.0 - (-bend).exp());
    x.iter()
        .enumerate()
        .map(|(i, x)| x + change * shape(grid.start + grid.step * i as f64))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { dt_s: 0.5, start: 0.0, step: 0.1 };
    const X: [f64; 6] = [0.0, 1.0, 3.0, 2.0, -2.0, -3.0];

    #[test]
    fn sharp_forms_are_the_textbook_ones() {
        let sharp = Form::default();
        assert_eq!(delay(&X, 0.5, &sharp, GRID), [0.0, 0.0, 1.0, 3.0, 2.0, -2.0]);
        assert_eq!(saturation(&X, 2.0, &sharp, GRID), [0.0, 1.0, 2.0, 2.0, -2.0, -2.0]);
        assert_eq!(backlash(&X, 1.0, &sharp, GRID), [0.0, 0.0, 2.0, 2.0, -1.0, -2.0]);
        let dead = dead_zone(&X, 1.0, &sharp, GRID);
        for (found, expected) in dead.iter().zip([0.0, 0.0, 2.0, 1.0, -1.0, -2.0]) {
            assert!((found - expected).abs() < 1e-6, "{dead:?}");
        }
    }

    #[test]
    fn effects_that_are_off_change_nothing() {
        let form = Form { softness: 0.4, asymmetry: 0.2, spread: 0.5 };
        let off = [
            delay(&X, 0.0, &form, GRID),
            lag(&X, 0.0, &form, GRID),
            dead_zone(&X, 0.0, &form, GRID),
            backlash(&X, 0.0, &form, GRID),
            hysteresis(&X, 0.0, 1.0, &form),
            relaxation(&X, 0.0, 2.0, &form, GRID),
            drift(&X, 0.0, &form, GRID),
        ];
        off.iter().for_each(|y| assert_eq!(y, &X));
    }
}

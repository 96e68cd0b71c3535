//! A plant of two stages, the second driven by the output of the first: parameters, candidates,
//! equations.

use super::{label::Form, operators};

/// A nominal parameter.
#[derive(Debug)]
pub(super) struct Parameter {
    pub(super) name: &'static str,
    pub(super) unit: &'static str,
    pub(super) value: f64,
    /// One standard deviation, as a share of the value.
    pub(super) tolerance: f64,
    /// Stage it acts in.
    pub(super) stage: usize,
}

/// Something that may be missing from the simulator.
#[derive(Debug)]
pub(super) struct Candidate {
    pub(super) name: &'static str,
    pub(super) stage: usize,
    pub(super) action: Action,
    /// A hardly visible strength, and the largest one that is drawn.
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

/// What an effect does, with its constants.
#[derive(Debug, Clone, Copy)]
pub(super) enum Action {
    /// In front of the stage: s.
    Delay,
    /// In front of the stage: half width.
    DeadZone,
    /// In front of the stage: limit.
    Saturation,
    /// Behind the stage: half width.
    Backlash,
    /// Behind the stage: s.
    Lag,
    /// Behind the stage: change over the session.
    Drift,
    /// Behind the stage: share; the time constant, s.
    Relaxation(f64),
    /// Behind the stage: share; the largest radius.
    Hysteresis(f64),
    /// Effect inside the differential equation: what it subtracts from the drive, given state,
    /// strength, form and input.
    Inside(fn(f64, f64, &Form, f64) -> f64),
}

/// An effect at work.
#[derive(Debug, Clone, Copy)]
pub(super) struct Act {
    pub(super) candidate: &'static Candidate,
    pub(super) strength: f64,
    pub(super) form: Form,
}

/// One trial: its input, its beginning in the session and its speed, as shares of the session.
#[derive(Debug, Clone)]
pub(super) struct Drive {
    pub(super) input: Vec<f64>,
    pub(super) start: f64,
    pub(super) step: f64,
}

/// A stage: its output, its noise, and its equation x' = f(x, input, what the effects inside take).
#[derive(Debug)]
pub(super) struct StageSpec {
    pub(super) name: &'static str,
    pub(super) output: &'static str,
    pub(super) unit: &'static str,
    pub(super) noise: f64,
    /// Derivative of the states, given states, input, parameters and what the effects inside take from the drive.
    pub(super) derivative: fn([f64; 2], f64, &[f64], f64) -> [f64; 2],
    /// States at rest.
    pub(super) rest: [f64; 2],
    /// Which state is the output.
    pub(super) shown: usize,
    /// Whether the input is held between samples, or linearly interpolated.
    pub(super) is_held: bool,
}

/// A plant.
#[derive(Debug)]
pub(super) struct PlantSpec {
    pub(super) name: &'static str,
    pub(super) dt_s: f64,
    /// Samples of a trial, at most.
    pub(super) samples: usize,
    pub(super) input: &'static str,
    pub(super) input_unit: &'static str,
    /// Least and greatest input.
    pub(super) span: (f64, f64),
    pub(super) parameters: &'static [Parameter],
    pub(super) stages: [StageSpec; 2],
    pub(super) candidates: &'static [Candidate],
    pub(super) foreign: &'static [Candidate],
    /// Effects of the simulator's own, as lines of a problem file.
    pub(super) effects: &'static str,
}

/// Steps of integration between two samples; the distributed simulators take four.
const SUBSTEPS: usize = 12;

impl PlantSpec {
    /// The noise-free output of a stage for one trial.
    pub(super) fn stage(&self, stage: usize, p: &[f64], acts: &[Act], drive: &Drive) -> Vec<f64> {
        let spec = &self.stages[stage];
        let acts: Vec<&Act> = acts.iter().filter(|a| a.candidate.stage == stage).collect();
        let mut input = drive.input.clone();
        for act in &acts {
            input = match act.candidate.action {
                Action::Delay => operators::delay(&input, act.strength, &act.form, self.dt_s),
                Action::DeadZone => operators::dead_zone(&input, act.strength, &act.form),
                Action::Saturation => operators::saturation(&input, act.strength, &act.form),
                _ => input,
            };
        }
        let mut out = self.integrated(spec, p, &acts, &input);
        for act in &acts {
            out = self.behind(act, out, drive);
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

    fn behind(&self, act: &Act, out: Vec<f64>, drive: &Drive) -> Vec<f64> {
        let (s, form, dt) = (act.strength, &act.form, self.dt_s);
        match act.candidate.action {
            Action::Backlash => operators::backlash(&out, s, form),
            Action::Lag => operators::lag(&out, s, form, dt),
            Action::Drift => operators::drift(&out, s, drive.start, drive.step, form),
            Action::Relaxation(tau_s) => operators::relaxation(&out, s, tau_s, form, dt),
            Action::Hysteresis(scale) => operators::hysteresis(&out, s, scale, form),
            _ => out,
        }
    }
}

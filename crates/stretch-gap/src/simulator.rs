//! The one trait through which any simulator is diagnosed.

use std::ops::RangeInclusive;

use serde::Serialize;

use crate::error::GapError;

/// A stage of a simulator: it turns a measured input into one measured output channel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StageSpec {
    /// Name in reports.
    pub name: String,
    /// Output channel: the column that it is held against.
    pub channel: String,
    /// Unit of the output.
    pub unit: String,
    /// Indices of the nominal parameters that act in it.
    pub parameters: Vec<usize>,
    /// Known noise of the output, one standard deviation, rounding included; none when it has to be taken from
    /// the record's second differences.
    pub noise: Option<f64>,
}

impl StageSpec {
    /// A stage whose noise is taken from the record.
    pub fn new(name: &str, channel: &str, unit: &str, parameters: &[usize]) -> Self {
        Self {
            name: name.into(),
            channel: channel.into(),
            unit: unit.into(),
            parameters: parameters.into(),
            noise: None,
        }
    }
}

/// A slow wander of a parameter around its value that nobody models: it belongs to the floor.
///
/// An Ornstein-Uhlenbeck process of standard deviation `sd` and correlation time `correlation_s`, linear
/// between knots `knot_s` apart.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Wander {
    /// Standard deviation, in the parameter's unit.
    pub sd: f64,
    /// Correlation time, s.
    pub correlation_s: f64,
    /// Distance of the knots, s.
    pub knot_s: f64,
}

/// A nominal parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterSpec {
    /// Name in reports.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Value that the simulator ships with.
    pub nominal: f64,
    /// Tolerance, one standard deviation in the parameter's unit; 0 when exact. The re-tuned value stays within
    /// three of them.
    pub sd: f64,
    /// Least value that makes sense.
    pub least: f64,
    /// Slow wander within a trial, when there is one.
    pub wander: Option<Wander>,
    /// Standard deviation of a constant offset in each trial, in the parameter's unit.
    pub per_trial_sd: Option<f64>,
    /// Whether its re-tuned value says anything by itself (not when others can stand in for it).
    pub is_evidence: bool,
}

impl ParameterSpec {
    /// An exact parameter; [`ParameterSpec::within`] gives it a tolerance.
    pub fn new(name: &str, unit: &str, nominal: f64) -> Self {
        Self {
            name: name.into(),
            unit: unit.into(),
            nominal,
            sd: 0.0,
            least: f64::NEG_INFINITY,
            wander: None,
            per_trial_sd: None,
            is_evidence: true,
        }
    }

    /// The same with a tolerance: one standard deviation, in the parameter's unit.
    pub fn within(self, sd: f64) -> Self {
        Self { sd, ..self }
    }
}

/// A parameter of an effect.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectParameterSpec {
    /// Name in reports.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Least plausible value.
    pub min: f64,
    /// Greatest plausible value.
    pub max: f64,
    /// Value at which it does nothing; none for a shape.
    pub off: Option<f64>,
    /// Whether it is searched in equal ratios.
    pub is_log: bool,
    /// Usual value of what only gives the effect its form (a knee's width, a spread): fitted around it within its range,
    /// and not counted as a parameter of the effect.
    pub form: Option<f64>,
    /// Whether it is fitted; otherwise it keeps the value of the start.
    pub is_fitted: bool,
}

impl EffectParameterSpec {
    /// A strength that does nothing at 0.
    pub fn strength(name: &str, unit: &str, range: RangeInclusive<f64>) -> Self {
        Self {
            name: name.into(),
            unit: unit.into(),
            min: *range.start(),
            max: *range.end(),
            off: Some(0.0),
            is_log: false,
            form: None,
            is_fitted: true,
        }
    }

    /// A shape (a time constant, a spread) above 0, searched in equal ratios.
    pub fn shape(name: &str, unit: &str, range: RangeInclusive<f64>) -> Self {
        Self { off: None, is_log: true, ..Self::strength(name, unit, range) }
    }

    /// Values to screen at: a strength at a fiftieth and a fifth of its range, of both signs where it has both; a shape at
    /// a sixth, a half and five sixths of its range, in equal ratios.
    fn points(&self) -> Vec<f64> {
        if self.off.is_none() {
            let ratio = self.max / self.min;
            return [1.0, 3.0, 5.0].map(|k| self.min * libm::pow(ratio, k / 6.0)).into();
        }
        let ends = [self.min, self.max].into_iter().filter(|end| *end != 0.0);
        ends.flat_map(|end| [0.02 * end, 0.2 * end]).collect()
    }
}

/// An effect that the nominal simulator leaves out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectSpec {
    /// Name in reports.
    pub name: String,
    /// Stage that it belongs to, in the vocabulary of reports.
    pub stage: String,
    /// Indices of the stages whose output it changes.
    pub touches: Vec<usize>,
    /// Its parameters.
    pub parameters: Vec<EffectParameterSpec>,
    /// Values to screen it at, a few per shape and threshold; strengths in between are interpolated.
    pub starts: Vec<Vec<f64>>,
    /// Whether it shows between trials rather than inside them (drift, softening): it is then seen once a trial.
    pub is_between_trials: bool,
    /// Names of effects that are hard to tell from it.
    pub twins: Vec<String>,
}

impl EffectSpec {
    /// An effect in one stage, screened at a small and a large value of each strength and at three of each shape.
    pub fn new(name: &str, stage: (usize, &str), parameters: Vec<EffectParameterSpec>) -> Self {
        let starts = parameters.iter().fold(vec![Vec::new()], |starts, parameter| {
            let points = parameter.points();
            let with = |start: &Vec<f64>, x: &f64| [start.as_slice(), &[*x]].concat();
            starts.iter().flat_map(|s| points.iter().map(move |x| with(s, x))).collect()
        });
        Self {
            name: name.into(),
            stage: stage.1.into(),
            touches: vec![stage.0],
            parameters,
            starts,
            is_between_trials: false,
            twins: Vec::new(),
        }
    }
}

/// What is known of a trial.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrialSpec {
    /// Name in reports.
    pub name: String,
    /// How many samples it has.
    pub samples: usize,
    /// Session time of its first sample, s.
    pub start_s: f64,
    /// Whether it is a test trial: read once, at the end.
    pub is_test: bool,
}

impl TrialSpec {
    /// A trial that began at a session time, s, to be fitted or tested on.
    pub fn new(name: &str, samples: usize, start_s: f64, is_test: bool) -> Self {
        Self { name: name.into(), samples, start_s, is_test }
    }
}

/// Nominal parameters and effects with their values.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Model {
    /// Every nominal parameter, in the simulator's order.
    pub parameters: Vec<f64>,
    /// Effects that are on: index in the catalogue, values.
    pub effects: Vec<(usize, Vec<f64>)>,
}

impl Model {
    /// The simulator as it ships.
    pub fn nominal(simulator: &dyn Simulator) -> Self {
        let parameters = simulator.parameters().iter().map(|p| p.nominal).collect();
        Self { parameters, effects: Vec::new() }
    }

    /// Values of an effect that is on.
    pub fn effect(&self, index: usize) -> Option<&[f64]> {
        self.effects.iter().find(|(i, _)| *i == index).map(|(_, values)| values.as_slice())
    }
}

/// One run of one stage over the session.
#[derive(Debug, Clone, Copy)]
pub struct Run<'a> {
    /// Which stage.
    pub stage: usize,
    /// Parameters and effects.
    pub model: &'a Model,
    /// How many of the session's trials, from the first.
    pub trials: usize,
    /// Adds another draw of their noise to the measured inputs, from this seed: tells how much of it arrives at
    /// the output.
    pub shake: Option<u64>,
    /// Share of the usual step of integration: 0.5 for the solver check.
    pub step: f64,
}

/// The measured motion that slices go by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion<'a> {
    /// All trials end to end.
    pub values: &'a [f64],
    /// Unit.
    pub unit: &'a str,
    /// What it is called when the values fall.
    pub falling: &'a str,
    /// What it is called when they rise.
    pub rising: &'a str,
}

/// What a simulator is made of and what was recorded beside it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Description {
    /// Its stages.
    pub stages: Vec<StageSpec>,
    /// Its nominal parameters.
    pub parameters: Vec<ParameterSpec>,
    /// The catalogue of effects that it may lack.
    pub effects: Vec<EffectSpec>,
    /// The trials, in the order of the session.
    pub trials: Vec<TrialSpec>,
    /// Sample time, s, the same in every trial.
    pub dt_s: f64,
}

/// A simulator bound to the measurements that it is held against.
///
/// Every stage is run alone on its measured input (teacher forcing), so that what one stage gets wrong does not
/// spread to the next. Memories are carried from trial to trial in the order of the session.
///
/// Three methods do: [`Simulator::description`], [`Simulator::measured`] and [`Simulator::simulate`].
pub trait Simulator: Sync {
    /// Stages, parameters, effects and trials in one.
    fn description(&self) -> &Description;
    /// Its stages.
    fn stages(&self) -> &[StageSpec] {
        &self.description().stages
    }
    /// Its nominal parameters.
    fn parameters(&self) -> &[ParameterSpec] {
        &self.description().parameters
    }
    /// The catalogue of effects that it may lack.
    fn effects(&self) -> &[EffectSpec] {
        &self.description().effects
    }
    /// The trials, in the order of the session.
    fn trials(&self) -> &[TrialSpec] {
        &self.description().trials
    }
    /// Sample time, s, the same in every trial.
    fn dt_s(&self) -> f64 {
        self.description().dt_s
    }
    /// Measured output of a stage, all trials end to end.
    fn measured(&self, stage: usize) -> &[f64];
    /// Time, in samples, at which the wander of a parameter last had a way into the outputs, for every sample of all
    /// trials end to end, counted from each trial's start; none when it always has.
    fn wander_clock(&self, _parameter: usize) -> Option<Vec<u32>> {
        None
    }
    /// Simulates a stage on its measured input; effects of other stages in the model are passed over.
    ///
    /// `out` takes the samples of the first `run.trials` trials.
    ///
    /// # Errors
    /// When the simulation is not possible with these values: the fit then turns back.
    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError>;
    /// The motion by which the gap is cut into regimes, levels and rates: the first stage's output unless said
    /// otherwise.
    fn motion(&self) -> Motion<'_> {
        let unit = self.stages().first().map_or("", |s| s.unit.as_str());
        Motion { values: self.measured(0), unit, falling: "falling", rising: "rising" }
    }
    /// The stage whose output a user turns back into the motion with a calibration; none where there is no such sensor.
    fn sensor(&self) -> Option<usize> {
        None
    }
    /// Share of a channel's variance that may be left before the names of effects mean nothing.
    fn foreign_share(&self) -> f64 {
        0.1
    }
    /// Measured input of a stage as it is fed with it, all trials end to end; none where it is not the output of the
    /// stage before.
    fn input(&self, stage: usize) -> Option<Vec<f64>> {
        let _ = stage;
        None
    }
    /// As [`Simulator::simulate`] on an input that was not measured; says whether the stage can.
    ///
    /// # Errors
    /// When the simulation is not possible with these values.
    fn simulate_on(&self, run: Run<'_>, input: &[f64], out: &mut [f64]) -> Result<bool, GapError> {
        let _ = (run, input, out);
        Ok(false)
    }
}

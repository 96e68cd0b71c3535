//! Computes probes: the change of the output by each effect at a strength near its detection limit,
//! without the part for which the nominal parameters can compensate (they are projected out).

use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::{
    evidence::detection_limit::{LimitInputs, lags::Lags},
    fit::{
        comparison::Comparison, coordinate::coordinates, hypothesis::Hypothesis, metric::Column,
        prepared::PreparedProblem,
    },
    numerics::linear::Cholesky,
    problem::{
        error::GapError,
        sample_roles::{Role, SampleRoles},
        simulator::{Model, Run},
        spec::EffectSpec,
    },
    search::{screen::Ground, selection::Looked},
};

/// Number of starts (parameter values at which fits begin) that are probed per effect: the one at
/// which the effect is easiest to detect, and another at which it may resemble a different effect.
const STARTS: usize = 2;
/// Smallest and largest exponent of the strength that is estimated from two probes.
const POWERS: [f64; 2] = [0.5, 60.0];

/// Parameter values at which an effect is probed.
#[derive(Debug, Clone)]
pub(super) struct Start {
    pub(super) values: Vec<f64>,
    /// Index of the parameter that is the strength of the effect.
    pub(super) main: usize,
    /// Exponent p of the power law: the squared change is proportional to strength^p.
    power: f64,
}

/// A probed effect.
pub(super) struct Probe {
    pub(super) effect: usize,
    pub(super) start: Start,
    /// `distance` is the signed distance of the strength from the value at which the effect is off
    /// (`off`). `reach` is the largest distance within the range of the strength on the same side.
    pub(super) distance: f64,
    pub(super) reach: f64,
    off: f64,
    /// Range of the amplitude in a fit, as multiples of the probe's change.
    pub(super) range: [f64; 2],
    /// Penalty of the effect in the score, nats.
    pub(super) price: f64,
    /// Projected changes of the stages in which the effect acts.
    pub(super) changes: Vec<Change>,
}

/// The projected change of one stage.
pub(super) struct Change {
    pub(super) stage: usize,
    pub(super) column: Column,
    /// Shifts of the nominal parameters that the projection subtracts, in tolerances.
    pub(super) shifts: Vec<f64>,
}

impl Probe {
    /// Returns the size of the change as a multiple of the probe's change, if the strength is at
    /// this distance from the value at which the effect is off.
    pub(super) fn amplitude(&self, distance: f64) -> f64 {
        (distance / self.distance.abs()).powf(0.5 * self.start.power)
    }

    /// Squared change over the fitted samples.
    fn size(&self, problem: &PreparedProblem<'_>) -> f64 {
        let one = |c: &Change| problem.compare.product(c.stage, &c.column, &c.column);
        self.changes.iter().map(one).sum()
    }

    /// Returns the strength at this distance from the value at which the effect is off.
    pub(super) fn strength(&self, distance: f64) -> f64 {
        self.off + distance * self.distance.signum()
    }
}

/// Estimates the exponent p of the power law from two squared changes and the ratio of their
/// strengths.
fn power_of(size: f64, other: f64, ratio: f64) -> f64 {
    let power = (other / size).ln() / ratio.abs().ln();
    if power.is_finite() { power.clamp(POWERS[0], POWERS[1]) } else { 2.0 }
}

/// Returns the squared change <d,d>, over the fitted samples, that each start of each effect makes
/// around the re-tuned nominal simulator.
pub(super) fn sizes(
    problem: &PreparedProblem<'_>,
    looked: Option<&Looked>,
) -> Result<Vec<Vec<Option<f64>>>, GapError> {
    let effects = problem.simulator().effects();
    let mut known: Vec<Option<Vec<Option<f64>>>> = vec![None; effects.len()];
    for screened in looked.into_iter().flat_map(|looked| &looked.screened) {
        known[screened.effect] = Some(screened.sizes.clone());
    }
    if known.iter().all(Option::is_some) {
        return Ok(known.into_iter().flatten().collect());
    }
    let ground = Ground::around(&problem.compare, problem.nominal.model.clone())?;
    let size = |(e, spec): (usize, &EffectSpec)| {
        let changes = problem.compare.changes(&ground, e, &spec.starts)?;
        Ok(changes.into_iter().map(|change| Some(change?.0)).collect())
    };
    effects.par_iter().enumerate().map(size).collect()
}

/// Returns the index of the main parameter of a start, and its distance from the value at which the
/// effect is off. The main parameter is the first strength that is not off.
fn main_of(spec: &EffectSpec, values: &[f64]) -> Option<(usize, f64)> {
    let mut strengths = spec.parameters.iter().zip(values).enumerate();
    strengths.find_map(|(i, (p, value))| {
        let distance = value - p.off()?;
        (distance != 0.0 && distance.is_finite()).then_some((i, distance))
    })
}

/// Returns at most `STARTS` starts of an effect at which it changes the output, the one that is
/// easiest to detect first. Starts that differ only in the strength count as one. Unless runs are
/// costly, the strength of each start is moved to where the effect is about to be detected. `sizes`
/// is the effect's entry in the result of [`sizes`].
pub(super) fn easiest(
    problem: &PreparedProblem<'_>,
    effect: usize,
    sizes: Vec<Option<f64>>,
    inputs: LimitInputs<'_>,
) -> Vec<Start> {
    let spec = &problem.simulator().effects()[effect];
    // Squared change that makes the smallest gap that counts. If only the size of the gap decides,
    // this is the detection limit.
    let target = inputs.thresholds.least_gap * problem.compare.roles.count(Role::Fit) as f64;
    let is_costly = problem.simulator().model_runs().is_some();
    let mut known: Vec<(usize, f64, f64, &Vec<f64>)> = Vec::new();
    for (values, size) in spec.starts.iter().zip(sizes) {
        let (Some((main, distance)), Some(size)) = (main_of(spec, values), size) else { continue };
        known.push((main, distance, size, values));
    }
    let mut found: Vec<((bool, f64), Start)> = Vec::new();
    let is_family = |a: &[f64], b: &[f64], main: usize| {
        a.iter().zip(b).enumerate().all(|(i, (x, y))| i == main || x == y)
    };
    for &(main, distance, size, values) in &known {
        let alike = |k: &&(usize, f64, f64, &Vec<f64>)| {
            k.0 == main && k.1 * distance > 0.0 && is_family(k.3, values, main)
        };
        let parameter = &spec.parameters[main];
        let off = parameter.off().unwrap_or(0.0);
        // If a strength can have either sign, probe only positive values; the fit can change the
        // sign.
        if distance < 0.0 && off == 0.0 && parameter.max > 0.0 {
            continue;
        }
        // Of the starts that differ only in the strength, keep the one whose squared change is
        // nearest to the target.
        let near = |size: f64| (size / target).ln().abs();
        if known.iter().filter(alike).any(|k| near(k.2) < near(size)) {
            continue;
        }
        // At strengths below that of the weakest start, the change is usually linear.
        let weakest = known.iter().filter(alike).all(|k| k.1.abs() >= distance.abs());
        let other = known.iter().filter(alike).find(|k| k.1 != distance);
        let other = other.filter(|_| off != 0.0 || !weakest || size < target);
        let power = other.map_or(2.0, |k| power_of(size, k.2, k.1 / distance));
        let told = distance * (target / size).powf(1.0 / power);
        let moved = (off + told).clamp(parameter.min.min(off), parameter.max.max(off));
        let mut start = Start { values: values.clone(), main, power };
        if !is_costly && moved != off {
            start.values[main] = moved;
        }
        // An effect of an unusual form may act although its strength is off, so starts with an
        // unusual form come last.
        let forms = spec.parameters.iter().zip(values);
        let is_odd =
            forms.into_iter().any(|(p, v)| p.usual_form().is_some_and(|usual| usual != *v));
        found.push(((is_odd, told.abs() / (parameter.max - parameter.min)), start));
    }
    found.sort_by(|a, b| a.0.0.cmp(&b.0.0).then(a.0.1.total_cmp(&b.0.1)));
    found.into_iter().take(STARTS).map(|(_, start)| start).collect()
}

/// All probes, and the stages whose nominal parameters are projected out.
pub(super) struct Probes {
    pub(super) all: Vec<Probe>,
    trials: usize,
    stages: Vec<TunedStage>,
    /// By stage: autocorrelation sums of the best set's residual, which is taken for noise.
    noise_lags: Vec<Lags>,
}

impl Probes {
    /// Runs every start in one batch: over all trials, or only over the fitted ones if runs are
    /// costly.
    pub(super) fn of(
        problem: &PreparedProblem<'_>,
        best: &Hypothesis,
        starts: &[Vec<Start>],
    ) -> Result<Self, GapError> {
        let simulator = problem.simulator();
        let trials = match simulator.model_runs() {
            Some(_) => problem.compare.roles.fit_trials,
            None => simulator.trials().len(),
        };
        let model = &problem.nominal.model;
        let stages = 0..problem.compare.metrics.len();
        let tuned = stages
            .into_par_iter()
            .map(|stage| TunedStage::of(&problem.compare, stage, model, trials))
            .collect::<Result<_, GapError>>()?;
        let compare = &problem.compare;
        let noise = |stage: usize| {
            let mut clean = compare.residual_values(stage, &best.model)?;
            compare.metrics[stage].clean(&compare.roles, &mut clean);
            Ok(Lags::of(compare, &clean))
        };
        let stages = (0..compare.metrics.len()).into_par_iter();
        let noise_lags = stages.map(noise).collect::<Result<_, GapError>>()?;
        let mut probes = Self { all: Vec::new(), trials, stages: tuned, noise_lags };
        let all = starts.iter().enumerate();
        let all = all.flat_map(|(e, own)| own.iter().map(move |start| (e, start.clone())));
        probes.all = probes.run(problem, all.collect())?;
        Ok(probes)
    }

    /// Whether the test trials were run.
    pub(super) fn covers_test(&self, roles: &SampleRoles) -> bool {
        let end = roles.samples(self.trials);
        roles.of_role(Role::Test).all(|s| s.to <= end)
    }

    /// Returns the autocorrelation sums of a stage's residual, which is taken for noise.
    pub(super) fn noise_lags(&self, stage: usize) -> &Lags {
        &self.noise_lags[stage]
    }

    /// Returns the index of the probe around which an effect's own limit is searched.
    pub(super) fn first(&self, effect: usize) -> Option<usize> {
        self.all.iter().position(|p| p.effect == effect)
    }

    /// Probes an effect again if the ratio of its limit to the strength of its probe exceeds `far`
    /// in either direction. Returns the effects that were probed again.
    pub(super) fn moved(
        &mut self,
        problem: &PreparedProblem<'_>,
        found: &[Option<f64>],
        far: f64,
    ) -> Result<Vec<usize>, GapError> {
        let mut moved = Vec::new();
        for (effect, limit) in found.iter().enumerate() {
            let Some(own) = self.first(effect) else { continue };
            let probe = &self.all[own];
            // Without a limit, the effect may resemble others at the strength of the probe:
            // continue at the geometric mean of this strength and the end of the range.
            let farther = (probe.distance.abs() * probe.reach).sqrt();
            let to = limit.unwrap_or_else(|| probe.strength(farther));
            let ratio = ((to - probe.off) / probe.distance).abs();
            if ratio > far || ratio < 1.0 / far {
                let mut start = probe.start.clone();
                start.values[start.main] = to;
                moved.push((effect, start));
            }
        }
        let effects = moved.iter().map(|(effect, _)| *effect).collect();
        for mut probe in self.run(problem, moved)? {
            let Some(own) = self.first(probe.effect) else { continue };
            let before = &self.all[own];
            let ratio = probe.distance / before.distance;
            probe.start.power = power_of(before.size(problem), probe.size(problem), ratio);
            probe.range[1] = (probe.reach / probe.distance.abs()).powf(0.5 * probe.start.power);
            self.all[own] = probe;
        }
        Ok(effects)
    }

    fn run(
        &self,
        problem: &PreparedProblem<'_>,
        starts: Vec<(usize, Start)>,
    ) -> Result<Vec<Probe>, GapError> {
        let effects = problem.simulator().effects();
        let models: Vec<Model> = starts
            .iter()
            .map(|(effect, start)| problem.nominal.model.with(*effect, &start.values))
            .collect();
        let places = starts.iter().zip(&models).flat_map(|((effect, _), model)| {
            effects[*effect].touches.iter().map(move |stage| Run::exact(*stage, model, self.trials))
        });
        let places: Vec<Run<'_>> = places.collect();
        let mut outputs = problem.compare.runs.run_many(&places).into_iter();
        let mut begun = Vec::new();
        for ((effect, start), model) in starts.into_iter().zip(&models) {
            let touches = &effects[effect].touches;
            let own: Result<Vec<_>, GapError> = outputs.by_ref().take(touches.len()).collect();
            match own {
                Ok(own) => begun.push((effect, start, model, own)),
                Err(error) if error.ends_all() => return Err(error),
                Err(_) => {}
            }
        }
        let probe =
            |(effect, start, model, outputs)| self.probe(problem, (effect, start), model, outputs);
        Ok(begun.into_par_iter().filter_map(probe).collect())
    }

    /// Returns a probe, given its simulated outputs in the stages in which the effect acts; `None`
    /// if the outputs do not change.
    fn probe(
        &self,
        problem: &PreparedProblem<'_>,
        (effect, start): (usize, Start),
        model: &Model,
        outputs: Vec<Vec<f64>>,
    ) -> Option<Probe> {
        let spec = &problem.simulator().effects()[effect];
        let stages = spec.touches.iter().zip(outputs);
        let changes: Vec<Change> =
            stages.map(|(&stage, there)| self.projected(problem, stage, there)).collect();
        let parameter = &spec.parameters[start.main];
        let off = parameter.off()?;
        let distance = start.values[start.main] - off;
        let reach = if distance > 0.0 { parameter.max - off } else { off - parameter.min };
        let most = (reach / distance.abs()).powf(0.5 * start.power);
        // If a strength can have either sign, a fit may change the sign; a threshold has only one
        // side.
        let back = if distance > 0.0 { off - parameter.min } else { parameter.max - off };
        let least = if off == 0.0 && back > 0.0 { -back / distance.abs() } else { 0.0 };
        let range = [least, most];
        let price = problem.price(model);
        let probe = Probe { effect, start, distance, reach, off, range, price, changes };
        (probe.size(problem) > 0.0).then_some(probe)
    }

    /// Returns the change of one stage's output, with the nominal parameters projected out.
    fn projected(&self, problem: &PreparedProblem<'_>, stage: usize, there: Vec<f64>) -> Change {
        let (compare, tuned) = (&problem.compare, &self.stages[stage]);
        let metric = &compare.metrics[stage];
        let mut values = change(compare, stage, &tuned.output, there, 1.0);
        let whole = metric.column(&compare.roles, values.clone());
        let of = tuned.sensitivities.iter();
        let mut shifts: Vec<f64> = of.map(|k| compare.product(stage, k, &whole)).collect();
        tuned.factor.solve(&mut shifts);
        for (k, shift) in tuned.sensitivities.iter().zip(&shifts) {
            values.iter_mut().zip(&k.values).for_each(|(x, k)| *x -= shift * k);
        }
        let column = metric.column(&compare.roles, values);
        Change { stage, column, shifts }
    }
}

/// One stage of the re-tuned nominal simulator: its output, the sensitivities to its parameters,
/// and the Cholesky factor of their normal matrix, which includes the prior.
struct TunedStage {
    output: Vec<f64>,
    sensitivities: Vec<Column>,
    factor: Cholesky,
}

impl TunedStage {
    fn of(
        compare: &Comparison<'_>,
        stage: usize,
        model: &Model,
        trials: usize,
    ) -> Result<Self, GapError> {
        let run = Run::exact(stage, model, trials);
        let output = compare.runs.run(run)?;
        let own = coordinates(compare.simulator(), &[stage], model);
        let mut models = Vec::new();
        for (coordinate, bounds) in &own {
            let x = coordinate.read(model);
            let step = coordinate.probe(x);
            let step = if x + step > bounds[1] { -step } else { step };
            let mut moved = model.clone();
            coordinate.write(&mut moved, x + step);
            models.push((step, moved));
        }
        let runs: Vec<Run<'_>> = models
            .iter()
            .map(|(_, moved)| Run {
                near: Some(&model.parameters),
                ..Run::exact(stage, moved, trials)
            })
            .collect();
        let mut sensitivities = Vec::new();
        for (there, (step, _)) in compare.runs.run_many(&runs).into_iter().zip(&models) {
            match there {
                Ok(there) => {
                    let change = change(compare, stage, &output, there, *step);
                    sensitivities.push(compare.metrics[stage].column(&compare.roles, change));
                }
                Err(error) if error.ends_all() => return Err(error),
                // If this parameter value cannot be simulated, a fit does not reach it either.
                Err(_) => {}
            }
        }
        let n = sensitivities.len();
        let normal = DMatrix::from_fn(n, n, |i, j| {
            let prior = if i == j { compare.roles.block as f64 } else { 0.0 };
            compare.product(stage, &sensitivities[i], &sensitivities[j]) + prior
        });
        Ok(Self { output, sensitivities, factor: Cholesky::of(normal) })
    }
}

/// Returns the change of an output per unit of `step`, in multiples of the noise.
fn change(
    compare: &Comparison<'_>,
    stage: usize,
    here: &[f64],
    mut there: Vec<f64>,
    step: f64,
) -> Vec<f64> {
    let sds = &compare.metrics[stage].noise.sd;
    for ((x, here), sd) in there.iter_mut().zip(here).zip(sds) {
        *x = (*x - here) / (sd * step);
    }
    there
}

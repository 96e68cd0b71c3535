//! The experiment that distinguishes two hypotheses.
//!
//! The method is T-optimality (Atkinson and Fedorov 1975, doi 10.1093/biomet/62.1.57). In the best
//! experiment, the predictions of the alternative model differ as much as possible from those of
//! the true one, even after the parameters of the alternative are fitted as far as existing data
//! and tolerances allow. Let x be the shifts of these parameters in a box, b the number of samples
//! per block, A the derivatives of the alternative's predictions and d the differences between the
//! two predictions, for the data measured so far (index 0) and for the experiment (index 1):
//!
//! ```text
//! x = argmin of 0.5/b (|d_0 + A_0 x|^2 + |d_1 + A_1 x|^2) + 0.5 |x|^2 in its box,     D^2 = |d_1 + A_1 x|^2/samples
//! ```
//!
//! Because it is unknown which model is true, each is assumed to be the true one in turn, and the
//! smaller D counts.

use nalgebra::DMatrix;
use rayon::prelude::*;
use stretch_data::Trial;

use crate::{
    evidence::gathered::Evidence,
    fit::coordinate::coordinates,
    numerics::linear::{boxed, dot},
    problem::{
        error::GapError,
        sample_roles::BLOCK_S,
        simulator::{Model, Simulator},
    },
    verdict::diagnosis::{Diagnosis, NextExperiment},
};

/// Evidence that distinguishes two hypotheses with 95 % probability, nats.
const ENOUGH: f64 = 3.0;
/// Describes the next experiment if there is none.
const HOPELESS: &str =
    "The rivals are so alike that none of the candidate experiments is likely to distinguish them.";

/// A candidate experiment: a description, and the trial that performs it.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// A sentence that says how the experiment is done.
    pub how: String,
    /// Time to prepare the experiment, minutes.
    pub prepare_min: f64,
    /// The commands and the quantities imposed from outside, evenly sampled. Its name is that of the experiment.
    pub trial: Trial,
}

impl Plan {
    /// Returns the duration including the preparation, minutes.
    pub fn minutes(&self) -> f64 {
        self.prepare_min + self.runs_min()
    }

    fn runs_min(&self) -> f64 {
        self.trial.len() as f64 * self.dt_s() / 60.0
    }

    fn dt_s(&self) -> f64 {
        self.trial.rate_hz().map_or(0.01, |rate| 1.0 / rate)
    }
}

/// A simulator that can predict the outcome of experiments that have not been done yet. A trial describes an experiment
/// completely.
pub trait Laboratory: Simulator {
    /// Experiments to choose from, all with the same sample time.
    fn experiments(&self) -> Vec<Plan>;
    /// A trial that represents the data measured so far.
    fn done(&self) -> Trial;
    /// Returns the prediction of a model for a trial: every recorded channel in units of its noise.
    ///
    /// # Errors
    /// The simulation is not possible with these values.
    fn predict(&self, model: &Model, trial: &Trial) -> Result<Vec<Vec<f64>>, GapError>;
}

/// The recommended experiment, and the trial that performs it.
#[derive(Debug, Clone, PartialEq)]
pub struct Proposal {
    /// The recommendation.
    pub next: NextExperiment,
    /// The trial: valve openings over time, and the quantities imposed from outside.
    pub trial: Trial,
    /// Every candidate experiment with its name, difference in multiples of the noise, and minutes;
    /// the best first.
    pub experiments: Vec<(String, f64, f64)>,
}

/// Recommends an experiment that distinguishes the leading hypotheses of a diagnosis. Returns
/// `None` if no effect outside the most probable set is among the effects that the data cannot
/// distinguish (`Diagnosis::ambiguous`).
///
/// D(x) is the root mean square difference between the predictions of the two leading hypotheses
/// for the experiment x, in multiples of the noise. It is the difference that remains after the
/// nominal and effect parameters of one hypothesis were changed, in a linearised model, so that its
/// predictions come as close to the other's as tolerances and the fit to existing data allow. Both
/// directions are computed, and the smaller one counts. The experiment with the largest evidence
/// per minute is recommended. Evidence is proportional to D^2 times the number of blocks, and the
/// minutes include the preparation.
///
/// # Errors
/// Errors of the simulator.
pub fn next_experiment(
    simulator: &dyn Laboratory,
    diagnosis: &Diagnosis,
    evidence: &Evidence,
) -> Result<Option<Proposal>, GapError> {
    let Some((one, two, separates)) = rivals(simulator, diagnosis, evidence) else {
        return Ok(None);
    };
    let experiments = simulator.experiments();
    let rated = rate(simulator, one, two, &experiments)?.into_iter().enumerate();
    let value = |&(i, d): &(usize, f64)| {
        let plan = &experiments[i];
        d * d * plan.runs_min() / plan.minutes()
    };
    let mut rated: Vec<(usize, f64)> = rated.collect();
    rated.sort_by(|a, b| value(b).total_cmp(&value(a)));
    let Some(&(best, d)) = rated.first().filter(|r| r.1.is_finite()) else { return Ok(None) };
    let chosen = &experiments[best];
    let repeats = repeats(d, chosen.runs_min());
    let next = NextExperiment {
        name: chosen.trial.name.clone(),
        separates: if repeats.is_some() { separates } else { Vec::new() },
        d,
        minutes: chosen.minutes(),
        why: repeats.map_or(HOPELESS.to_owned(), |more| chosen.how.clone() + &more),
    };
    let trial = chosen.trial.clone();
    let named =
        |&(i, d): &(usize, f64)| (experiments[i].trial.name.clone(), d, experiments[i].minutes());
    let rated = rated.iter().map(named);
    Ok(Some(Proposal { next, trial, experiments: rated.collect() }))
}

/// Returns D of every candidate experiment for two models, in multiples of the noise; see
/// [`next_experiment`].
///
/// # Errors
/// Errors of the simulator.
pub fn differences(
    simulator: &dyn Laboratory,
    one: &Model,
    two: &Model,
) -> Result<Vec<(String, f64)>, GapError> {
    let experiments = simulator.experiments();
    let rated = rate(simulator, one, two, &experiments)?;
    Ok(experiments.into_iter().map(|plan| plan.trial.name).zip(rated).collect())
}

fn rate(
    simulator: &dyn Laboratory,
    one: &Model,
    two: &Model,
    experiments: &[Plan],
) -> Result<Vec<f64>, GapError> {
    let done = simulator.done();
    let block = experiments.first().map_or(1.0, |plan| BLOCK_S / plan.dt_s());
    let known = [Tangent::of(simulator, one, &done)?, Tangent::of(simulator, two, &done)?];
    experiments
        .par_iter()
        .map(|Plan { trial, .. }| {
            let here = [Tangent::of(simulator, one, trial)?, Tangent::of(simulator, two, trial)?];
            let there = left(block, &known[0], &known[1], &here[0], &here[1]);
            let back = left(block, &known[1], &known[0], &here[1], &here[0]);
            Ok(there.min(back))
        })
        .collect()
}

/// Returns a sentence on how often the experiment must be run to distinguish the hypotheses; empty
/// if one run suffices, `None` if no number of runs is likely to.
fn repeats(d: f64, minutes: f64) -> Option<String> {
    let nats = 0.5 * d * d * 60.0 * minutes / BLOCK_S;
    match (ENOUGH / nats).ceil() {
        n if n <= 1.0 => Some(String::new()),
        n if n <= 20.0 => Some(format!(" One run is probably not enough: plan {n} runs.")),
        _ => None,
    }
}

/// Returns two models and the effects in which they differ. One is the most probable candidate. The
/// other is the most probable candidate with an effect that the first lacks and that the data
/// cannot distinguish (`ambiguous`).
fn rivals<'a>(
    simulator: &dyn Simulator,
    diagnosis: &Diagnosis,
    evidence: &'a Evidence,
) -> Option<(&'a Model, &'a Model, Vec<String>)> {
    let one = evidence.candidates.first()?;
    let own = &diagnosis.candidates.first()?.effects;
    let at = diagnosis.candidates.iter().position(|c| {
        c.effects.iter().any(|e| diagnosis.ambiguous.contains(e) && !own.contains(e))
    })?;
    let others = &diagnosis.candidates[at].effects;
    let mut separates: Vec<String> = own.iter().filter(|e| !others.contains(e)).cloned().collect();
    separates.extend(others.iter().filter(|e| !own.contains(e)).cloned());
    let two = evidence.candidates.get(at)?;
    let specs = simulator.effects();
    let holds = |m: &Model| m.effects.iter().all(|(e, _)| *e < specs.len());
    (holds(one) && holds(two)).then_some((one, two, separates))
}

/// Prediction of a model for an experiment, with its derivatives with respect to each free
/// parameter.
struct Tangent {
    values: Vec<f64>,
    slopes: Vec<Vec<f64>>,
    /// How far each parameter may move down and up, on the scale of its
    /// [coordinate](crate::fit::coordinate).
    bounds: Vec<[f64; 2]>,
    channels: usize,
}

impl Tangent {
    fn of(simulator: &dyn Laboratory, model: &Model, trial: &Trial) -> Result<Self, GapError> {
        let run = |model: &Model| -> Result<(Vec<f64>, usize), GapError> {
            let channels = simulator.predict(model, trial)?;
            let count = channels.len();
            Ok((channels.into_iter().flatten().collect(), count))
        };
        let (values, channels) = run(model)?;
        let (mut slopes, mut bounds) = (Vec::new(), Vec::new());
        let stages: Vec<usize> = (0..simulator.description().spec().stages.len()).collect();
        for (coordinate, [low, high]) in coordinates(simulator, &stages, model) {
            let x = coordinate.read(model);
            let step = coordinate.probe(x);
            let step = if x + step > high { -step } else { step };
            let mut moved = model.clone();
            coordinate.write(&mut moved, x + step);
            let (there, _) = run(&moved)?;
            slopes.push(there.iter().zip(&values).map(|(a, b)| (a - b) / step).collect());
            bounds.push([low - x, high - x]);
        }
        Ok(Self { values, slopes, bounds, channels })
    }

    fn samples(&self) -> f64 {
        self.values.len() as f64 / self.channels.max(1) as f64
    }
}

/// Returns the root mean square difference, summed over channels, that remains after `rival` came
/// as close to `truth` as possible. Because residuals are correlated, `block` samples count as one
/// observation.
fn left(
    block: f64,
    truth_known: &Tangent,
    rival_known: &Tangent,
    truth: &Tangent,
    rival: &Tangent,
) -> f64 {
    let n = rival.slopes.len();
    // The prior precision is 1, because one tolerance is one unit of x.
    let mut normal = DMatrix::identity(n, n);
    let mut slope = vec![0.0; n];
    for (truth, rival) in [(truth_known, rival_known), (truth, rival)] {
        let gap: Vec<f64> = rival.values.iter().zip(&truth.values).map(|(a, b)| a - b).collect();
        for i in 0..n {
            slope[i] += dot(&rival.slopes[i], &gap) / block;
            for j in 0..=i {
                let product = dot(&rival.slopes[i], &rival.slopes[j]) / block;
                normal[(i, j)] += product;
                if i != j {
                    normal[(j, i)] += product;
                }
            }
        }
    }
    let low: Vec<f64> = rival.bounds.iter().map(|b| b[0].min(0.0)).collect();
    let high: Vec<f64> = rival.bounds.iter().map(|b| b[1].max(0.0)).collect();
    let step = boxed(&normal, &slope, &low, &high);
    let mut gap: Vec<f64> = rival.values.iter().zip(&truth.values).map(|(a, b)| a - b).collect();
    for (slopes, x) in rival.slopes.iter().zip(&step) {
        gap.iter_mut().zip(slopes).for_each(|(g, s)| *g += x * s);
    }
    (gap.iter().map(|g| g * g).sum::<f64>() / rival.samples()).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    use approx::assert_relative_eq;
    use testkit::tolerance::F64_ROUNDING;

    /// A prediction of one channel, with parameters that may move by three tolerances in both
    /// directions.
    fn tangent(values: &[f64], slopes: &[&[f64]]) -> Tangent {
        Tangent {
            values: values.into(),
            slopes: slopes.iter().map(|s| s.to_vec()).collect(),
            bounds: vec![[-3.0, 3.0]; slopes.len()],
            channels: 1,
        }
    }

    fn wave(step: f64) -> Vec<f64> {
        (0..400).map(|i| (step * f64::from(i)).sin()).collect()
    }

    #[test]
    fn rivals_that_predict_the_same_are_not_distinguished() {
        let (one, two) = (tangent(&wave(0.1), &[]), tangent(&wave(0.1), &[&wave(0.1)]));
        assert_eq!(left(50.0, &one, &two, &one, &two), 0.0);
    }

    /// No parameter can change, so the result is the root mean square of the difference.
    #[test]
    fn without_parameters_the_difference_stays() {
        let (one, two) = (tangent(&[0.0; 100], &[]), tangent(&[0.3; 100], &[]));
        let d = left(50.0, &one, &two, &one, &two);
        assert_relative_eq!(d, 0.3, epsilon = 0.0, max_relative = F64_ROUNDING);
        // Only one of two channels differs. The channels are summed, not averaged.
        let wide = |values| Tangent { channels: 2, ..tangent(values, &[]) };
        let both = [[0.3; 100], [0.0; 100]].concat();
        let d = left(50.0, &one, &two, &wide(&[0.0; 200]), &wide(&both));
        assert_relative_eq!(d, 0.3, epsilon = 0.0, max_relative = F64_ROUNDING);
    }

    /// One parameter has the difference itself as its sensitivity. With n/b observations of size
    /// s^2 both in the existing data and in the experiment, x = -2 n s^2/b/(2 n s^2/b + 1), and the
    /// share 1 + x of the difference remains.
    #[test]
    fn what_re_tuning_can_do_is_taken_out_at_its_price() {
        let (n, s, block) = (200_usize, 0.4, 50.0);
        let values = vec![s; n];
        let (truth, rival) = (tangent(&vec![0.0; n], &[]), tangent(&values, &[&values]));
        let scale = 2.0 * n as f64 * s * s / block;
        let d = left(block, &truth, &rival, &truth, &rival);
        // The solver raises the diagonal by 1e-13.
        assert_relative_eq!(d, s / (scale + 1.0), epsilon = 0.0, max_relative = 1e-9);
    }

    /// Existing data prevent a re-tuning that would explain the experiment: a parameter that these
    /// data determine cannot move.
    #[test]
    fn what_is_known_pins_the_rival() {
        let [none, one, much, half] = [0.0, 1.0, 100.0, 0.5].map(|value| vec![value; 200]);
        let (truth, rival) = (tangent(&none, &[]), tangent(&half, &[&one]));
        let d = |slope: &[f64]| left(50.0, &truth, &tangent(&none, &[slope]), &truth, &rival);
        // If the data do not determine the parameter, the four blocks of the experiment compete
        // with the prior, and 1/(4 + 1) of 0.5 remains.
        assert_relative_eq!(d(&none), 0.1, epsilon = 0.0, max_relative = 1e-9);
        // If the data determine the parameter with 1e4 times as much evidence, 4e4, the difference
        // remains except for the share 4/(4e4 + 5).
        let kept = 1.0 - 4.0 / 40_005.0;
        assert_relative_eq!(d(&much), 0.5 * kept, epsilon = 0.0, max_relative = 1e-9);
    }

    #[test]
    fn no_parameter_leaves_its_box() {
        let (flat, slope) = (vec![0.0; 4000], vec![1.0; 4000]);
        let truth = tangent(&flat, &[]);
        let far = tangent(&vec![10.0; 4000], &[&slope]);
        // The parameter moves by three tolerances of the ten it would need, so seven remain.
        let d = left(50.0, &truth, &tangent(&flat, &[&flat]), &truth, &far);
        assert_relative_eq!(d, 7.0, epsilon = 0.0, max_relative = 1e-9);
    }

    /// Evidence in nats is half the squared difference times the number of blocks. 3 nats suffice.
    #[test]
    fn runs_are_planned_where_one_will_hardly_do() {
        // A minute contains 120 blocks, so d^2 = 0.05 gives 3 nats.
        let planned = |d| repeats(d, 1.0);
        assert_eq!(planned(0.05_f64.sqrt() + 1e-9).as_deref(), Some(""));
        let three = planned(0.02_f64.sqrt() + 1e-9);
        assert_eq!(three.as_deref(), Some(" One run is probably not enough: plan 3 runs."));
        assert_eq!((planned(1e-3), planned(0.0)), (None, None));
    }

    #[test]
    fn a_plan_takes_its_samples_and_its_preparation() {
        let time_s: Vec<f64> = (0..6000).map(|i| 0.01 * f64::from(i)).collect();
        let trial = Trial { time_s, ..Trial::default() };
        let plan = Plan { how: "slowly.".into(), prepare_min: 2.0, trial };
        assert_relative_eq!(plan.minutes(), 3.0, epsilon = 0.0, max_relative = 1e-6);
    }
}

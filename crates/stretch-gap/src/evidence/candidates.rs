//! Builds the lists of a diagnosis: candidates (sets of effects), gaps of the stages, and shifts of
//! the parameters.
//!
//! The excess of a channel is its reduced chi-square minus one, here on the test trials. A
//! candidate's closed-gap fraction is 1 - sum max(0, excess with its effects)/sum max(0, excess of
//! the re-tuned nominal simulator), where both sums run over the channels.

use std::collections::BTreeMap;

use rayon::prelude::*;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use stretch_effects::EffectParameter;

use crate::{
    evidence::{
        bootstrap::closed_interval,
        gathered::{Blocks, Evidence, Excess, StageEvidence},
        localise::location::StageGap,
        probability::{Function, Gap, Posterior, Standing, Weighed, allowed, weigh},
    },
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem},
    problem::{
        error::{GapError, unless_lost},
        simulator::Simulator,
        thresholds::Thresholds,
    },
};

/// A set of effects that was compared with the data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Candidate {
    /// Effects of the set, the strongest first. The last candidate is always `unknown`, any cause
    /// outside the catalogue.
    pub effects: Vec<String>,
    /// Probability among the candidates.
    pub probability: f64,
    /// Score relative to the re-tuned nominal simulator, nats.
    pub score: f64,
    /// Excess of the re-tuned nominal on the test trials, summed over channels.
    pub gap_before: f64,
    /// Excess with the effects.
    pub gap_after: f64,
    /// Excess that the set leaves: the larger of those on fitted and test trials.
    pub left: f64,
    /// Whether the strongest effect of the set is at an end of its range, which makes a cause
    /// outside the catalogue more probable. [`EffectValue::at_bound`] gives this for the parameters
    /// of every effect.
    pub at_bound: bool,
    /// Closed-gap fraction.
    pub closed: f64,
    /// 95 % interval of the closed-gap fraction, by block bootstrap.
    pub closed_ci: [f64; 2],
    /// Whether the mean square error falls on the test trials, by the same bootstrap.
    pub is_confirmed: bool,
    /// Values of the effects' parameters by name; with several effects by `effect.parameter`.
    #[serde(rename = "parameters")]
    pub by_name: BTreeMap<String, f64>,
    /// Parameters of the effects with units and standard deviations.
    #[serde(rename = "parameter_values")]
    pub parameters: Vec<EffectValue>,
}

impl Candidate {
    /// Whether the set leaves much more on the fitted trials than on the test trials: the root mean
    /// square residual of [`left`](Self::left) is more than 1.2 times that of
    /// [`gap_after`](Self::gap_after).
    pub fn fits_worse(&self) -> bool {
        1.0 + self.left > 1.2 * 1.2 * (1.0 + self.gap_after)
    }

    /// Root mean square of the residual that the set leaves, in multiples of the noise: on test
    /// trials, or on the fitted trials if the set [fits these worse](Self::fits_worse).
    ///
    /// ```
    /// use stretch_gap::Candidate;
    /// fn check(candidate: &Candidate) {
    ///     let fits = Candidate { gap_after: 3.0, left: 3.2, ..candidate.clone() };
    ///     assert_eq!(fits.leaves(), 2.0);
    /// }
    /// ```
    pub fn leaves(&self) -> f64 {
        multiple(if self.fits_worse() { self.left } else { self.gap_after })
    }
}

/// Returns the root mean square of a residual in multiples of the noise, from its excess (reduced
/// chi-square minus 1).
pub(crate) fn multiple(excess: f64) -> f64 {
    (1.0 + excess).max(0.0).sqrt()
}

/// A fitted parameter of an effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EffectValue {
    /// Effect.
    pub effect: String,
    /// Parameter.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Fitted value.
    pub value: f64,
    /// One standard deviation, from the curvature of the fit with one observation per 0.5 s.
    pub sd: f64,
    /// 95 % interval of the value, within the range that was searched.
    pub interval: [f64; 2],
    /// Whether the parameter describes only the form of the effect, not its strength.
    pub is_form: bool,
    /// Whether the value is a strength at an end of its range. The effect then probably compensates
    /// for another cause.
    pub at_bound: bool,
}

/// A nominal parameter, re-tuned.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ParameterShift {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Value as shipped.
    pub nominal: f64,
    /// Value in the final model.
    pub fitted: f64,
    /// One standard deviation of the fitted value, as for an [`EffectValue`].
    pub sd: f64,
    /// Distance of the fitted from the nominal value, in tolerances.
    pub sigmas: f64,
    /// Value after re-tuning without effects.
    pub bent: f64,
    /// Distance of `bent` from the nominal value, in tolerances.
    pub bent_sigmas: f64,
    /// Whether the value is evidence by itself. It is not if other parameters can compensate for
    /// it.
    pub is_evidence: bool,
}

/// Number of standard deviations on either side of the mean within which 95 % of a Gaussian lie.
const COVERS: f64 = 1.96;

/// Name of the candidate for any cause outside the catalogue.
const UNKNOWN: &str = "unknown";

/// A candidate, and its reduced chi-squares: one [`Blocks`] per stage.
pub(crate) type Held = (Candidate, Vec<Blocks>);

/// Simulates every hypothesis on the test trials. Returns those that can be simulated, each with
/// its candidate and its reduced chi-squares by stage and block. `posterior` fills in the
/// probabilities.
pub(crate) fn candidates(
    problem: &PreparedProblem<'_>,
    evidence: &Evidence,
    hypotheses: Vec<Hypothesis>,
    seed: u64,
) -> Result<(Vec<Hypothesis>, Vec<Held>), GapError> {
    let held = hypotheses.into_par_iter().map(|one| {
        let held = unless_lost(candidate(problem, evidence, &one, seed))?;
        if held.is_none() {
            problem.compare.runs.not_judged(&one.effects);
        }
        Ok(held.map(|held| (one, held)))
    });
    let held: Result<Vec<_>, GapError> = held.collect();
    Ok(held?.into_iter().flatten().unzip())
}

/// Smallest share of the gap that a set of effects must close to count as a cause; the verdict
/// `partial` promises this share. Gaps without and with the effects are the larger of the gaps on
/// fitted and on test trials, because the lack of an effect that acts only in long trials causes
/// little gap in short ones.
pub(crate) const LEAST_CLOSED: f64 = 0.3;

/// Computes the posterior. Returns it with the candidates and their blocks, in the order of the
/// posterior's sets. A set of effects that closes less than [`LEAST_CLOSED`] of the gap is dropped.
/// If every remaining set leaves more than noise and model discrepancy would, `function` is called
/// with the set of the highest score. It computes one more hypothesis: a function of the recorded
/// signals, which represents a cause outside the catalogue.
pub(crate) fn posterior(
    problem: &PreparedProblem<'_>,
    thresholds: &Thresholds,
    (evidence, null_band): (&mut Evidence, f64),
    (hypotheses, candidates): (Vec<Hypothesis>, Vec<Held>),
    function: impl FnOnce(&Evidence, &Hypothesis) -> Result<Option<Function>, GapError>,
) -> Result<(Posterior, Vec<Held>), GapError> {
    let (mut kept, mut by_effects) = (Vec::new(), BTreeMap::new());
    for (hypothesis, (candidate, blocks)) in hypotheses.into_iter().zip(candidates) {
        let left = evidence.gap_of(problem, &hypothesis.misfits).max(candidate.gap_after);
        let closed = 1.0 - left / evidence.gap.retuned;
        if hypothesis.effects.is_empty() || closed >= LEAST_CLOSED {
            by_effects.insert(hypothesis.effects.clone(), (candidate, blocks));
            let (score, catalogue) = (hypothesis.score, problem.simulator().effects());
            let strongest = hypothesis.effects.first();
            let is_at_bound = strongest.is_some_and(|&e| hypothesis.is_at_bound(e, catalogue));
            let is_nothing = hypothesis.effects.is_empty();
            kept.push((hypothesis, Standing { score, left, is_at_bound, is_nothing }));
        }
    }
    let retuned = evidence.gap.retuned;
    let sets = || kept.iter().filter(|(_, standing)| !standing.is_nothing);
    let is_left = sets().all(|(_, s)| s.left > allowed(retuned, s.left, thresholds));
    let best = sets().max_by(|a, b| a.1.score.total_cmp(&b.1.score));
    let function = match best.filter(|_| is_left) {
        Some((best, _)) => function(evidence, best)?,
        None => None,
    };
    let posterior = weigh(thresholds, Gap { retuned, null_band }, kept, function);
    let mut probabilities = posterior.sets.iter().map(|w| w.probability).chain([posterior.unknown]);
    if probabilities.any(|p| !p.is_finite()) {
        return Err(GapError::NoProbability { retuned });
    }
    let of = |w: &Weighed| {
        let (candidate, blocks) = by_effects.remove(&w.hypothesis.effects)?;
        let Standing { left, is_at_bound: at_bound, .. } = w.standing;
        Some((Candidate { probability: w.probability, left, at_bound, ..candidate }, blocks))
    };
    let candidates = posterior.sets.iter().filter_map(of).collect();
    evidence.candidates = posterior.sets.iter().map(|w| w.hypothesis.model.clone()).collect();
    let spreads = posterior.sets.iter().map(|w| w.hypothesis.spread.clone());
    evidence.candidate_spreads = spreads.collect();
    Ok((posterior, candidates))
}

fn candidate(
    problem: &PreparedProblem<'_>,
    evidence: &Evidence,
    hypothesis: &Hypothesis,
    seed: u64,
) -> Result<Held, GapError> {
    let stages = 0..evidence.stages.len();
    let blocks = stages.map(|s| evidence.blocks(problem, s, &hypothesis.model));
    let blocks = blocks.collect::<Result<Vec<Blocks>, GapError>>()?;
    let tested = |all: &[Blocks]| all.iter().map(|b| b.test.clone()).collect::<Vec<_>>();
    let interval = closed_interval(&tested(&evidence.nominal_blocks), &tested(&blocks), seed);
    let parameters = effect_values(problem.simulator(), hypothesis);
    let is_alone = hypothesis.effects.len() == 1;
    let name = |p: &EffectValue| match is_alone {
        true => p.name.clone(),
        false => format!("{}.{}", p.effect, p.name),
    };
    let specs = problem.simulator().effects();
    let candidate = Candidate {
        by_name: parameters.iter().map(|p| (name(p), p.value)).collect(),
        effects: hypothesis.effects.iter().map(|&e| specs[e].name.clone()).collect(),
        probability: 0.0,
        score: hypothesis.score,
        gap_before: interval.before,
        gap_after: interval.after,
        left: interval.after,
        at_bound: false,
        closed: interval.closed,
        closed_ci: interval.interval,
        is_confirmed: interval.falls,
        parameters,
    };
    Ok((candidate, blocks))
}

/// Appends the candidate `unknown`. Its score and remaining excess are those of the function that
/// describes a cause outside the catalogue. Without such a function, its score is 0 and it leaves
/// the whole gap.
pub(crate) fn beside_unknown(
    mut candidates: Vec<Candidate>,
    gap: Excess,
    (probability, function): (f64, Option<Function>),
) -> Vec<Candidate> {
    let nothing = Function { score: 0.0, left: gap.retuned };
    let Function { score, left } = function.unwrap_or(nothing);
    candidates.push(Candidate {
        effects: vec![UNKNOWN.into()],
        probability,
        score,
        gap_before: gap.retuned,
        gap_after: gap.retuned,
        left,
        at_bound: false,
        closed: 0.0,
        closed_ci: [0.0; 2],
        is_confirmed: false,
        by_name: BTreeMap::new(),
        parameters: Vec::new(),
    });
    candidates
}

fn effect_values(simulator: &dyn Simulator, hypothesis: &Hypothesis) -> Vec<EffectValue> {
    let mut all = Vec::new();
    for &e in &hypothesis.effects {
        let spec = &simulator.effects()[e];
        let values = hypothesis.model.effect(e).unwrap_or(&[]);
        for (i, (p, value)) in spec.parameters.iter().zip(values).enumerate() {
            let sd = hypothesis.spread.of_effect(e, i, *value);
            all.push(EffectValue {
                effect: spec.name.clone(),
                name: p.name.to_string(),
                unit: p.unit.to_string(),
                value: *value,
                sd,
                interval: interval(p, *value, sd),
                is_form: p.usual_form().is_some(),
                at_bound: spec.ends(p, *value),
            });
        }
    }
    all
}

/// Returns the 95 % interval of a fitted parameter, limited to its range. The interval of a
/// parameter on a logarithmic scale is symmetric in the logarithm.
fn interval(p: &EffectParameter, value: f64, sd: f64) -> [f64; 2] {
    let ends = match p.is_log() && value > 0.0 {
        true => [-COVERS, COVERS].map(|k| value * libm::exp(k * sd / value)),
        false => [-COVERS, COVERS].map(|k| value + k * sd),
    };
    // A value outside its range (a threshold that is off) extends the range.
    let (low, high) = (p.min.min(value), p.max.max(value));
    ends.map(|end| end.clamp(low, high))
}

/// Returns the gap of every stage on the test trials.
pub(crate) fn stage_gaps(problem: &PreparedProblem<'_>, evidence: &Evidence) -> Vec<StageGap> {
    let total: f64 = evidence.stages.iter().map(|s| s.excess_retuned.max(0.0)).sum();
    let one = |(stage, s): (usize, &StageEvidence)| {
        let spec = &problem.simulator().stages()[stage];
        let noise = &problem.compare.metrics[stage].noise;
        StageGap {
            stage: spec.name.clone(),
            channel: spec.channel.clone(),
            share: if total > 0.0 { s.excess_retuned.max(0.0) / total } else { 0.0 },
            raw: s.excess_raw,
            excess: s.excess_retuned,
            after: s.excess_after,
            rms: (1.0 + s.excess_retuned).max(0.0).sqrt() * s.noise,
            floor: s.noise,
            floor_source: noise.source.clone(),
            unit: spec.unit.clone(),
            is_cause_only: false,
        }
    };
    evidence.stages.iter().enumerate().map(one).collect()
}

/// Returns how far every parameter with a tolerance moved: in the fit with the best set of effects, or without effects
/// if the verdict names none because the simulator agrees, perhaps after re-tuning.
pub(crate) fn shifts(
    simulator: &dyn Simulator,
    evidence: &Evidence,
    agrees: bool,
) -> Vec<ParameterShift> {
    let bent = &evidence.retuned.parameters;
    let (fitted, spread) = match agrees {
        true => (bent, &evidence.retuned_spread),
        false => (&evidence.best.parameters, &evidence.best_spread),
    };
    let all = simulator.parameters().iter().enumerate().filter(|(_, p)| p.sd > 0.0);
    all.map(|(i, p)| ParameterShift {
        name: p.name.clone(),
        unit: p.unit.clone(),
        nominal: p.nominal,
        fitted: fitted[i],
        sd: spread.of_parameter(i),
        sigmas: (fitted[i] - p.nominal) / p.sd,
        bent: bent[i],
        bent_sigmas: (bent[i] - p.nominal) / p.sd,
        is_evidence: p.is_evidence,
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use testkit::tolerance::F64_ROUNDING;

    fn candidate(effect: &str, probability: f64) -> Candidate {
        let mut unknown = beside_unknown(Vec::new(), Excess::default(), (probability, None));
        let candidate = unknown.remove(0);
        Candidate { effects: vec![effect.into()], ..candidate }
    }

    /// 95 % of a Gaussian lie within 1.96 standard deviations. If the parameter is on a logarithmic
    /// scale, these are deviations of the logarithm.
    #[test]
    fn intervals_reach_two_deviations_to_either_side() {
        let strength = EffectParameter::sized("c", "1", -1.0..=1.0);
        assert_eq!(interval(&strength, 0.2, 0.1), [0.2 - 0.196, 0.2 + 0.196]);
        let shape = EffectParameter::shaped("tau", "s", 0.01..=10.0);
        let [low, high] = interval(&shape, 1.0, 0.1);
        assert_relative_eq!(low * high, 1.0, epsilon = 0.0, max_relative = F64_ROUNDING);
        assert_relative_eq!(high.ln(), 0.196, epsilon = 0.0, max_relative = 1e-12);
    }

    #[test]
    fn intervals_stay_in_the_range_and_hold_the_value() {
        let strength = EffectParameter::sized("c", "1", 0.0..=1.0);
        let shape = EffectParameter::shaped("tau", "s", 0.01..=10.0);
        for (spec, values) in [(&strength, [0.0, 0.03, 0.5, 1.0]), (&shape, [0.01, 0.1, 3.0, 10.0])]
        {
            for value in values {
                for sd in [0.0, 0.02, 0.4, 50.0] {
                    let [low, high] = interval(spec, value, sd);
                    assert!(spec.min <= low && high <= spec.max, "{value} {sd}: {low} {high}");
                    assert!(low <= value && value <= high, "{value} {sd}: {low} {high}");
                }
            }
        }
    }

    #[test]
    fn what_is_left_where_it_was_fitted_counts_where_it_is_much_more() {
        let leaves =
            |gap_after, left| Candidate { gap_after, left, ..candidate("play", 1.0) }.fits_worse();
        // An excess e is a root mean square of sqrt(1 + e): 2.0 and 4.4, 2.0 and 2.2, 1.0 and 1.3.
        assert_eq!([leaves(3.0, 18.4), leaves(3.0, 3.84), leaves(0.0, 0.69)], [true, false, true]);
    }

    /// A threshold that is off may have a value outside its range. The interval then ends at that
    /// value.
    #[test]
    fn a_value_outside_of_its_range_is_an_end() {
        let spec = EffectParameter::sized("threshold", "V", 1.0..=2.0).off_at(9.0);
        assert_eq!(interval(&spec, 9.0, 100.0), [1.0, 9.0]);
        assert_eq!(interval(&spec, 9.0, 0.0), [9.0, 9.0]);
    }

    #[test]
    fn unknown_stands_last() {
        let gap = Excess { raw: 9.0, retuned: 4.0, left: 1.0 };
        let all = beside_unknown(vec![candidate("a", 0.7), candidate("b", 0.2)], gap, (0.1, None));
        let last = &all[2];
        assert_eq!((last.effects.as_slice(), last.probability), (&["unknown".to_owned()][..], 0.1));
        assert_eq!((last.gap_before, last.gap_after, last.closed), (4.0, 4.0, 0.0));
    }
}

//! Detection limits: how strong each effect would have to be for a diagnosis of these data to name
//! it.
//!
//! Assume that the re-tuned nominal simulator is true, that the residual of the best set of effects
//! is noise, and that the rig has one more effect of the strength s. A *probe* is a simulation with
//! this effect at a strength s_0. The effect changes the output by d(s), of which
//! [the screen](crate::search::screen) projects out what the nominal parameters can cause. The
//! squared change that is left grows with the strength like
//!
//! ```text
//! <d(s),d(s)> = a^2 <d(s_0),d(s_0)>,     a = (s/s_0)^(p/2)
//! ```
//!
//! If the change is linear in the strength, p is 2. A fit finds the amplitude a with the standard
//! deviation
//!
//! ```text
//! sd = 1/sqrt(W),     W = <d(s_0),d(s_0)>/(m x)
//! ```
//!
//! x is the variance of the residual, relative to the noise, and m the number of samples that count
//! as [one observation](crate::fit::score). The effect is *seen* at the amplitude a if an amplitude
//! of a - 1.28 sd, which nine of ten recordings exceed, meets the criteria for adding an effect to
//! the nominal simulator. It is *named* if its likelihood is also larger than that of the most
//! similar other effect in nine of ten recordings (Cox 1961). If c is the correlation of the
//! changes by the two effects, the difference of the log-likelihoods has the mean
//! W a^2 (1 - c^2)/2 and the variance W a^2 (1 - c^2), so that this requires
//!
//! ```text
//! W a^2 (1 - c^2) > (2 * 1.28)^2
//! ```
//!
//! The detection limit is the smallest strength at which the effect is named. The power law holds
//! only near the probe, because an effect may have a kink. Therefore, if a limit is far from its
//! probe, the effect is probed again at the limit, and p is computed from the last two probes.

use std::collections::BTreeMap;

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    fit::{hypothesis::Hypothesis, octaves::Octaves, prepared::PreparedProblem},
    problem::{error::GapError, sample_roles::Role, spec::EffectSpec, thresholds::Thresholds},
    search::{
        acceptance::Acceptance,
        screen::{Ground, Projected},
        selection::Looked,
    },
};

/// Quantile of the standard normal distribution that nine of ten draws do not exceed.
const NINE_OF_TEN: f64 = 1.2816;
/// A limit is searched between the shares [`LEAST`] and [`INSIDE`] of the range, because an effect
/// at the end of its range is not named: it probably compensates for another cause.
const LEAST: f64 = 1e-6;
const INSIDE: f64 = 0.99;
/// Number of bisection steps of the logarithm of the amplitude. They determine a limit with an
/// accuracy below 0.1 %.
const HALVINGS: usize = 30;
/// If the ratio of a limit to its probe exceeds [`FAR`], the effect is probed again, at most
/// [`ROUNDS`] times.
const FAR: f64 = 1.4;
const ROUNDS: usize = 4;
/// Smallest and largest exponent of the strength that is estimated from two probes.
const POWERS: [f64; 2] = [0.5, 60.0];

/// Smallest strength of an effect that would be named on these data.
///
/// ```
/// let limit: stretch_gap::DetectionLimit =
///     serde_json::from_str(r#"{ "effect": "leak", "parameter": "g", "strength": null, "unit": "1/s", "others": {} }"#)?;
/// assert_eq!(limit.strength, None); // these data do not show it at any strength that makes sense
/// # Ok::<(), serde_json::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DetectionLimit {
    /// Effect.
    pub effect: String,
    /// Parameter that is the strength of the effect.
    pub parameter: String,
    /// Value of the parameter at which the effect would be named with probability 0.9 if the
    /// re-tuned nominal simulator were otherwise true. A fit of an effect begins at several sets of
    /// values, its starts. The effect's other parameters have the values of the start at which the
    /// effect is easiest to detect. `None` if the effect would not be named at any value within the
    /// parameter's range.
    pub strength: Option<f64>,
    /// Unit of the value.
    pub unit: String,
    /// Values of the other parameters.
    pub others: BTreeMap<String, f64>,
    /// Value of the parameter at which a missing effect would be detected with probability 0.9,
    /// although another effect may be named in its place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seen: Option<f64>,
    /// The effect that changes the output most similarly. Given only if it makes the limit larger
    /// than the value in `seen`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub like: Option<String>,
}

/// Inputs of the computation of detection limits. The residual of the best set is treated as noise.
/// The thresholds define the rule by which effects are named.
#[derive(Clone, Copy)]
pub(crate) struct LimitInputs<'a> {
    pub(crate) problem: &'a PreparedProblem<'a>,
    pub(crate) best: &'a Hypothesis,
    pub(crate) thresholds: &'a Thresholds,
}

/// An effect at the strength at which it was simulated.
struct Probe {
    values: Vec<f64>,
    /// Index of the parameter that is the strength of the effect.
    main: usize,
    /// Exponent p of the power law.
    power: f64,
    /// Signed distance of the strength from `off`, the value at which the effect does nothing.
    distance: f64,
    off: f64,
    /// Largest distance within the range of the strength on the same side.
    reach: f64,
    /// Penalty of the effect in the score, nats.
    price: f64,
    changes: Vec<Change>,
}

/// The change of one stage's output by a probe.
struct Change {
    stage: usize,
    projected: Projected,
    /// <d,d>.
    square: f64,
    octaves: Octaves,
    /// x of the module documentation.
    level: f64,
    /// The product m x of the module documentation.
    weight: f64,
}

/// Limits of one effect as amplitudes a of its probe.
struct Limits {
    seen: Option<f64>,
    named: Option<f64>,
    /// The most similar other effect.
    like: Option<usize>,
}

/// Returns the detection limit of every effect, in the order of the catalogue. Effects whose course
/// in time is estimated from the recording have no strength and are left out. `looked` holds the
/// results of a screening around the re-tuned nominal simulator, if there was one.
pub(crate) fn detection_limits(
    inputs: LimitInputs<'_>,
    looked: Option<&Looked>,
) -> Result<Vec<DetectionLimit>, GapError> {
    let problem = inputs.problem;
    let effects = problem.simulator().effects();
    let around;
    let ground = match looked {
        Some(looked) => &looked.ground,
        None => {
            around = Ground::around(&problem.compare, problem.nominal.model.clone())?;
            &around
        }
    };
    let prober = Prober { inputs, ground, noise: noise(inputs)? };
    let first = effects.par_iter().enumerate().map(|(e, spec)| {
        let known = looked.and_then(|looked| looked.screened.iter().find(|s| s.effect == e));
        let sizes = match known {
            Some(screened) => screened.sizes.clone(),
            None => {
                let changes = problem.compare.changes(ground, e, &spec.starts)?;
                changes.into_iter().map(|change| change.map(|(own, _)| own)).collect()
            }
        };
        let starts = moved_starts(inputs, spec, &sizes).into_iter();
        starts.filter_map(|(values, power)| prober.probe(e, &values, power).transpose()).collect()
    });
    // By effect; the first probe of an effect is the one that its own limit is computed from.
    let mut probes = first.collect::<Result<Vec<Vec<Probe>>, GapError>>()?;
    // If runs are costly, the first probe has to suffice.
    let rounds = if problem.simulator().model_runs().is_none() { ROUNDS } else { 0 };
    for _ in 0..rounds {
        let moved: Vec<(usize, f64)> = (0..effects.len())
            .filter_map(|e| Some((e, prober.moved(&probes, e, probes[e].first()?)?)))
            .collect();
        if moved.is_empty() {
            break;
        }
        let again = moved.into_par_iter().map(|(e, to)| Ok((e, prober.again(&probes, e, to)?)));
        for (e, probe) in again.collect::<Result<Vec<_>, GapError>>()? {
            if let Some(probe) = probe {
                probes[e][0] = probe;
            }
        }
    }
    let shown = effects.iter().enumerate().filter(|(_, spec)| !spec.is_found);
    Ok(shown.map(|(e, spec)| prober.shown(&probes, e, spec)).collect())
}

/// Returns the residual of the best set by stage, without its nuisances.
fn noise(inputs: LimitInputs<'_>) -> Result<Vec<Vec<f64>>, GapError> {
    let compare = &inputs.problem.compare;
    let one = |stage: usize| {
        Ok(compare.clean(stage, &compare.residual_values(stage, &inputs.best.model)?))
    };
    (0..compare.metrics.len()).into_par_iter().map(one).collect()
}

/// Returns the starts of an effect, each moved to where it is about to be detected, with the
/// exponent of the power law. The start at which the effect is easiest to detect comes first, and is
/// the only one if runs are costly. Starts that differ only in the strength count as one. `sizes`
/// holds <d,d> at every start.
fn moved_starts(
    inputs: LimitInputs<'_>,
    spec: &EffectSpec,
    sizes: &[Option<f64>],
) -> Vec<(Vec<f64>, f64)> {
    // Squared change that makes the smallest gap that counts. If only the size of the gap decides,
    // this is the detection limit.
    let fitted = inputs.problem.compare.roles.count(Role::Fit) as f64;
    let target = inputs.thresholds.least_gap.max(1e-3) * fitted;
    let known = spec.starts.iter().zip(sizes).filter_map(|(values, size)| {
        let (main, distance) = main_of(spec, values)?;
        Some((main, distance, (*size)?, values))
    });
    let known: Vec<(usize, f64, f64, &Vec<f64>)> = known.collect();
    let is_costly = inputs.problem.simulator().model_runs().is_some();
    let mut found: Vec<(bool, f64, (Vec<f64>, f64))> = Vec::new();
    for &(main, distance, size, values) in &known {
        let is_same = |k: &&(usize, f64, f64, &Vec<f64>)| {
            let mut pairs = k.3.iter().zip(values).enumerate();
            k.0 == main && k.1 * distance > 0.0 && pairs.all(|(i, (x, y))| i == main || x == y)
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
        let same: Vec<_> = known.iter().filter(is_same).collect();
        if same.iter().any(|k| near(k.2) < near(size)) {
            continue;
        }
        // At strengths below that of the weakest start, the change is usually linear.
        let is_weakest = same.iter().all(|k| k.1.abs() >= distance.abs());
        let other = same.iter().find(|k| k.1 != distance);
        let other = other.filter(|_| off != 0.0 || !is_weakest || size < target);
        let power = other.map_or(2.0, |k| power_of(size, k.2, k.1 / distance));
        let limit = distance * (target / size).powf(1.0 / power);
        let moved = (off + limit).clamp(parameter.min.min(off), parameter.max.max(off));
        let mut values = values.clone();
        if moved != off && !is_costly {
            values[main] = moved;
        }
        // An effect with an unusual form may change the output even if its strength is off.
        // Therefore starts with an unusual form come last.
        let mut forms = spec.parameters.iter().zip(&values);
        let is_odd = forms.any(|(p, v)| p.usual_form().is_some_and(|usual| usual != *v));
        let share = limit.abs() / (parameter.max - parameter.min);
        found.push((is_odd, share, (values, power)));
    }
    found.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    found.truncate(if is_costly { 1 } else { found.len() });
    found.into_iter().map(|(_, _, start)| start).collect()
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

/// Estimates the exponent p of the power law from two squared changes and the ratio of their
/// strengths.
fn power_of(size: f64, other: f64, ratio: f64) -> f64 {
    let power = (other / size).ln() / ratio.abs().ln();
    if power.is_finite() { power.clamp(POWERS[0], POWERS[1]) } else { 2.0 }
}

/// Simulates probes around the re-tuned nominal simulator and computes limits from them.
struct Prober<'a> {
    inputs: LimitInputs<'a>,
    ground: &'a Ground,
    noise: Vec<Vec<f64>>,
}

impl Prober<'_> {
    /// Simulates an effect at some values. `None` if the simulation fails or nothing changes.
    fn probe(&self, effect: usize, values: &[f64], power: f64) -> Result<Option<Probe>, GapError> {
        let problem = self.inputs.problem;
        if (problem.stop())() {
            return Err(GapError::Stopped);
        }
        let (compare, spec) = (&problem.compare, &problem.simulator().effects()[effect]);
        let Some((main, distance)) = main_of(spec, values) else { return Ok(None) };
        let model = self.ground.model.with(effect, values);
        let price = problem.price(&model);
        let Some(there) = compare.possible_residuals(&spec.touches, &[model])?.remove(0) else {
            return Ok(None);
        };
        let parameter = &spec.parameters[main];
        let off = values[main] - distance;
        let reach = if distance > 0.0 { parameter.max - off } else { off - parameter.min };
        let stages = spec.touches.iter().zip(&there);
        let changes: Vec<Change> = stages.map(|(&s, there)| self.change(s, there)).collect();
        let values = values.to_vec();
        let probe = Probe { values, main, power, distance, off, reach, price, changes };
        Ok((probe.square() > 0.0).then_some(probe))
    }

    fn change(&self, stage: usize, there: &[f64]) -> Change {
        let compare = &self.inputs.problem.compare;
        let projected = compare.projected_change(self.ground, stage, there);
        let octaves = compare.octaves(stage, &projected.column.values);
        let noise = &self.noise[stage];
        let both: Vec<f64> =
            projected.column.values.iter().zip(noise).map(|(d, r)| d + r).collect();
        let level = compare.mean_square(&self.inputs.best.misfits[stage]).max(f64::MIN_POSITIVE);
        let square = compare.inner(stage, &projected, &projected);
        Change { stage, square, projected, octaves, level, weight: compare.memory(&both) * level }
    }

    /// Whether an effect is seen at an amplitude of its probe.
    fn is_seen(&self, probe: &Probe, amplitude: f64) -> bool {
        let problem = self.inputs.problem;
        let (compare, thresholds) = (&problem.compare, self.inputs.thresholds);
        let certain = amplitude - NINE_OF_TEN / probe.information().sqrt();
        if certain <= 0.0 {
            return false;
        }
        let square = certain * certain;
        let count = |role| compare.roles.count(role) as f64;
        let all = count(Role::Fit) + count(Role::Held);
        let (mut closed, mut score, mut rise) = (0.0, -probe.price, 0.0);
        for change in &probe.changes {
            let misfit = &self.inputs.best.misfits[change.stage];
            let gap = square * change.square / count(Role::Fit);
            closed += gap;
            score += 0.5 * all * change.level / change.weight * (gap / change.level).ln_1p();
            rise += misfit.octaves.plus(&change.octaves.scaled(square)).rise(&misfit.octaves);
        }
        let acceptance = Acceptance { problem, thresholds };
        score > acceptance.least_rise(closed)
            && rise > thresholds.rise
            && closed > thresholds.least_gap
    }

    /// Returns the limits of an effect.
    fn limits(&self, probes: &[Vec<Probe>], effect: usize, probe: &Probe) -> Limits {
        let most = probe.amplitude(INSIDE * probe.reach);
        let seen = self.is_seen(probe, most).then(|| {
            let (mut low, mut high) = (probe.amplitude(LEAST * probe.reach), most);
            for _ in 0..HALVINGS {
                let middle = (low * high).sqrt();
                if self.is_seen(probe, middle) { high = middle } else { low = middle }
            }
            high
        });
        let others = probes.iter().enumerate().filter(|(e, _)| *e != effect);
        let others = others.flat_map(|(e, all)| all.iter().map(move |other| (e, other)));
        let others = others.map(|(e, other)| (e, self.likeness(probe, other)));
        let nearest = others.max_by(|a, b| a.1.total_cmp(&b.1));
        let likeness = nearest.map_or(0.0, |(_, likeness)| likeness);
        let apart = 2.0 * NINE_OF_TEN / (probe.information() * (1.0 - likeness)).sqrt();
        let named = seen.map(|seen| seen.max(apart)).filter(|named| *named <= most);
        let like = nearest.map(|(e, _)| e).filter(|_| named != seen);
        Limits { seen, named, like }
    }

    /// Returns the squared correlation of the changes by two probes.
    fn likeness(&self, probe: &Probe, other: &Probe) -> f64 {
        let compare = &self.inputs.problem.compare;
        let pairs = probe.changes.iter().flat_map(|x| other.changes.iter().map(move |y| (x, y)));
        let of_stage = pairs.filter(|(x, y)| x.stage == y.stage);
        let product = of_stage
            .map(|(x, y)| {
                compare.inner(x.stage, &x.projected, &y.projected) / (x.weight * y.weight).sqrt()
            })
            .sum::<f64>();
        (product * product / (probe.information() * other.information())).min(1.0)
    }

    /// Returns the strength at which an effect has to be probed again, if its limit is far from its
    /// probe.
    fn moved(&self, probes: &[Vec<Probe>], effect: usize, probe: &Probe) -> Option<f64> {
        let limits = self.limits(probes, effect, probe);
        // Without a limit, the effect may resemble others at the strength of the probe: continue at
        // the geometric mean of this strength and the end of the range.
        let farther = (probe.distance.abs() * probe.reach).sqrt();
        let to = limits.named.map_or(farther, |amplitude| probe.distance_at(amplitude));
        let ratio = to / probe.distance.abs();
        (!(1.0 / FAR..=FAR).contains(&ratio)).then(|| probe.strength(to))
    }

    /// Probes an effect again at another strength.
    fn again(
        &self,
        probes: &[Vec<Probe>],
        effect: usize,
        to: f64,
    ) -> Result<Option<Probe>, GapError> {
        let Some(before) = probes[effect].first() else { return Ok(None) };
        let mut values = before.values.clone();
        values[before.main] = to;
        let probe = self.probe(effect, &values, before.power)?;
        Ok(probe.map(|probe| {
            let ratio = probe.distance / before.distance;
            let power = power_of(before.square(), probe.square(), ratio);
            Probe { power, ..probe }
        }))
    }

    fn shown(&self, probes: &[Vec<Probe>], effect: usize, spec: &EffectSpec) -> DetectionLimit {
        let probe = probes[effect].first();
        let limits = probe.map(|probe| self.limits(probes, effect, probe));
        let value = |of: fn(&Limits) -> Option<f64>| {
            let (probe, amplitude) = (probe?, of(limits.as_ref()?)?);
            Some(probe.strength(probe.distance_at(amplitude)))
        };
        let main = probe.map_or(0, |probe| probe.main);
        let parameter = &spec.parameters[main];
        let values = spec.parameters.iter().zip(probe.map_or(&[][..], |probe| &probe.values));
        let others = values.enumerate().filter(|(i, _)| *i != main);
        let effects = self.inputs.problem.simulator().effects();
        let like = limits.as_ref().and_then(|limits| limits.like);
        DetectionLimit {
            effect: spec.name.clone(),
            parameter: parameter.name.to_string(),
            strength: value(|limits| limits.named),
            unit: parameter.unit.to_string(),
            others: others.map(|(_, (p, value))| (p.name.to_string(), *value)).collect(),
            seen: value(|limits| limits.seen),
            like: like.map(|like| effects[like].name.clone()),
        }
    }
}

impl Probe {
    /// <d,d>, summed over stages.
    fn square(&self) -> f64 {
        self.changes.iter().map(|change| change.square).sum()
    }

    /// W of the module documentation.
    fn information(&self) -> f64 {
        self.changes.iter().map(|change| change.square / change.weight).sum()
    }

    /// Returns the amplitude a at a distance of the strength from the value at which the effect is
    /// off.
    fn amplitude(&self, distance: f64) -> f64 {
        (distance / self.distance.abs()).powf(0.5 * self.power)
    }

    /// Inverse of [`Probe::amplitude`].
    fn distance_at(&self, amplitude: f64) -> f64 {
        self.distance.abs() * amplitude.powf(2.0 / self.power)
    }

    /// Returns the strength at this distance from the value at which the effect is off.
    fn strength(&self, distance: f64) -> f64 {
        self.off + distance * self.distance.signum()
    }
}

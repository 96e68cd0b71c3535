//! Makes two checks: whether the data can come from the simulated rig at all (the verdict depends
//! on this), and whether the noise level is plausible (only a note depends on this).
//!
//! Two signs show that the data come from something other than the simulated rig:
//!
//! * *gross misfit*: on the test trials, a larger share of a channel's variance is left than a
//!   missing effect could leave
//!   ([`RecordFacts::gross_misfit_share`](crate::RecordFacts::gross_misfit_share)). The cause is
//!   another rig, or a column that is not what its name says. The share is 1 - R^2 with the noise
//!   subtracted: (sum (y - y_sim)^2 - N s^2)/sum (y - mean y)^2 for N samples y, the simulated
//!   y_sim and the standard deviation s of the noise;
//! * *at bounds*: two parameters of a stage are at the ends of their tolerances, and more than
//!   noise is left. If these parameters, with wider tolerances, explain as much without any effect,
//!   the rig has other parameter values, not an additional effect.
//!
//! *Implausible noise*: a simulator without effects leaves less than [`LEAST_NOISE`] of the noise.
//! Real noise cannot be simulated, so the noise was estimated or stated too large, and a gap of
//! that size would be invisible.

use crate::{
    evidence::gathered::Evidence,
    fit::{
        hypothesis::Hypothesis,
        levenberg_marquardt::FINE,
        prepared::PreparedProblem,
        score::{gap, mean_square},
    },
    problem::{
        altered::Altered,
        error::{GapError, unless_lost},
        sample_roles::Role,
        spec::ParameterSpec,
    },
    search::sets::LEFT,
};

/// Factor by which the tolerances of parameters at their bounds are widened, to test whether these
/// parameters then explain everything.
const LOOSE: f64 = 5.0;
/// Smallest value of a parameter with a widened tolerance, as a share of its nominal value.
const KEPT: f64 = 0.02;

/// Smallest plausible ratio of the root mean square residual to the noise. A simulator without
/// effects cannot follow noise.
const LEAST_NOISE: f64 = 0.5;

/// Whether the data can come from the simulator at all.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sanity {
    /// By stage: share of its channel's variance that the best set of effects leaves.
    pub(crate) left: Vec<f64>,
    /// Largest share that may be left. If more is left, the names of effects mean nothing.
    pub(crate) allowed: f64,
    /// The stage with the largest remaining excess of those with parameters at their bounds, if
    /// there is one.
    pub(crate) at_bounds: Option<AtBounds>,
    /// Stages whose noise level is implausible, each with the ratio of its residual to the noise.
    pub(crate) implausible: Vec<(usize, f64)>,
}

/// A stage with two or more parameters at the end of their tolerances.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct AtBounds {
    pub(crate) stage: usize,
    /// Indices of the parameters at the end of their tolerances.
    pub(crate) ended: Vec<usize>,
    /// Excess that is left on the test trials.
    pub(crate) left: f64,
    /// Two excesses over the fitted trials: with the best set of effects, and without effects but
    /// with wider tolerances of these parameters. `None` if there is no effect to compare with, or
    /// if the second case cannot be simulated.
    pub(crate) rivals: Option<(f64, f64)>,
}

impl Sanity {
    pub(crate) fn of(
        problem: &PreparedProblem<'_>,
        best: &Hypothesis,
        evidence: &Evidence,
    ) -> Result<Self, GapError> {
        let simulator = problem.simulator();
        let stages = || 0..evidence.stages.len();
        let left = stages().map(|stage| left(problem, evidence, stage));
        let of_noise = stages().map(|stage| (stage, of_noise(problem, evidence, stage)));
        Ok(Self {
            left: left.collect(),
            allowed: simulator.record().gross_misfit_share,
            at_bounds: at_bounds(problem, best, evidence)?,
            implausible: of_noise.filter(|(_, share)| *share < LEAST_NOISE).collect(),
        })
    }
}

fn left(problem: &PreparedProblem<'_>, evidence: &Evidence, stage: usize) -> f64 {
    let simulator = problem.simulator();
    let (traces, measured) = (&evidence.stages[stage], simulator.measured(stage));
    let sd = &problem.compare.metrics[stage].noise.sd;
    let (mut count, mut sum, mut squares, mut left) = (0.0, 0.0, 0.0, 0.0);
    for segment in evidence.roles.of_role(Role::Test) {
        // Samples that were not measured and isolated outliers have infinite noise. They do not
        // count.
        for i in (segment.from..segment.to).filter(|i| sd[*i].is_finite()) {
            count += 1.0;
            sum += measured[i];
            squares += measured[i] * measured[i];
            left += (measured[i] - traces.after[i]).powi(2);
        }
    }
    let variance = squares - sum * sum / f64::max(count, 1.0);
    // The contribution of the noise is not a misfit.
    let noise = count * traces.noise * traces.noise;
    (left - noise) / variance.max(noise).max(f64::MIN_POSITIVE)
}

/// Returns the root mean square of a stage's residual in multiples of the noise: the smaller of the
/// values as shipped and re-tuned.
fn of_noise(problem: &PreparedProblem<'_>, evidence: &Evidence, stage: usize) -> f64 {
    let (traces, measured) = (&evidence.stages[stage], problem.simulator().measured(stage));
    let sd = &problem.compare.metrics[stage].noise.sd;
    let left = |output: &[f64]| {
        let all = measured.iter().zip(output).zip(sd).filter(|(_, sd)| sd.is_finite());
        let squares: Vec<f64> = all.map(|((m, s), sd)| ((m - s) / sd).powi(2)).collect();
        mean_square(&squares).sqrt()
    };
    left(&traces.raw).min(left(&traces.retuned))
}

fn at_bounds(
    problem: &PreparedProblem<'_>,
    best: &Hypothesis,
    evidence: &Evidence,
) -> Result<Option<AtBounds>, GapError> {
    let simulator = problem.simulator();
    let at_end =
        |index: &usize| simulator.parameters()[*index].is_at_end(evidence.best.parameters[*index]);
    let all = simulator.stages().iter().zip(&evidence.stages).enumerate();
    let worst = all
        .filter(|(_, (_, traces))| traces.excess_after > LEFT)
        .map(|(stage, (spec, traces))| {
            let ended: Vec<usize> = spec.parameters.iter().copied().filter(at_end).collect();
            AtBounds { stage, ended, left: traces.excess_after, rivals: None }
        })
        .filter(|found| found.ended.len() >= 2)
        .max_by(|a, b| a.left.total_cmp(&b.left));
    let Some(worst) = worst else { return Ok(None) };
    let rivals = match best.effects.is_empty() {
        true => None,
        false => {
            let loose = unless_lost(loosened(problem, evidence, worst.stage, &worst.ended))?;
            loose.map(|loose| (problem.gap_in(best, worst.stage), loose))
        }
    };
    Ok(Some(AtBounds { rivals, ..worst }))
}

/// Fits a stage without effects and with wider tolerances of the parameters `ended`, and returns
/// its excess.
fn loosened(
    problem: &PreparedProblem<'_>,
    evidence: &Evidence,
    stage: usize,
    ended: &[usize],
) -> Result<f64, GapError> {
    let loose = Altered::of(problem.simulator(), |i, p| match ended.contains(&i) {
        true => ParameterSpec {
            sd: LOOSE * p.sd,
            least: p.least.min(KEPT * p.nominal.abs()),
            ..p.clone()
        },
        false => p.clone(),
    });
    let free = problem.compare.beside(&loose, problem.compare.metrics.clone());
    let fitted = free.fit(&[stage], evidence.retuned.clone(), &[], FINE)?;
    Ok(fitted.misfits.iter().map(|m| gap(free.mean_square(m))).sum())
}

//! Is it the right simulator at all?

use crate::{
    altered::Altered,
    diagnosis::{Diagnosis, VerdictKind},
    error::GapError,
    evidence::Evidence,
    fit::{Bench, FINE},
    frame::Role,
    select::Solution,
    simulator::Simulator,
    spec::ParameterSpec,
};

/// Tolerances at which a parameter stands at its end: two of the five or so of a stage do so by chance in one rig of a few
/// thousand.
const END: f64 = 2.75;
/// Excess that must be left for that to count: more error than noise.
const LEFT: f64 = 1.0;
/// What the tolerances of such parameters are multiplied by to see whether they would explain all.
const LOOSE: f64 = 5.0;
/// Share of its nominal value that a parameter keeps then.
const KEPT: f64 = 0.02;

/// Takes names back where the data come from something else than the simulator is of.
///
/// Either more of a channel's variance is left on the test trials with the best effects in than the simulator says that
/// may be ([`Simulator::foreign_share`]): another rig, or a column that is not what its name says. Or two parameters of a
/// stage stand at the end of their tolerances, more than noise is left of it all the same, and set loose, these parameters
/// explain as much as the effects do: what bends them is no effect but other parameters.
pub(crate) fn check(
    bench: &Bench<'_>,
    best: &Solution,
    evidence: &Evidence,
    diagnosis: &mut Diagnosis,
) -> Result<(), GapError> {
    let sentence = match foreign(bench.simulator, evidence) {
        Some(sentence) => Some(sentence),
        None => strained(bench, best, evidence)?,
    };
    let Some(sentence) = sentence else { return Ok(()) };
    diagnosis.notes.push(format!("before that was seen: {}", diagnosis.sentence));
    diagnosis.verdict = VerdictKind::Unknown;
    diagnosis.named.clear();
    diagnosis.sentence = sentence;
    Ok(())
}

/// The channel that the simulator has least to do with, if any.
fn foreign(simulator: &dyn Simulator, evidence: &Evidence) -> Option<String> {
    let mut worst: Option<(usize, f64)> = None;
    for (stage, traces) in evidence.stages.iter().enumerate() {
        let measured = simulator.measured(stage);
        let (mut count, mut sum, mut squares, mut left) = (0.0, 0.0, 0.0, 0.0);
        for segment in evidence.frame.of_role(Role::Test) {
            for i in segment.from..segment.to {
                count += 1.0;
                sum += measured[i];
                squares += measured[i] * measured[i];
                left += (measured[i] - traces.after[i]).powi(2);
            }
        }
        let variance = squares - sum * sum / f64::max(count, 1.0);
        // What is noise is nobody's fault.
        let noise = count * traces.floor * traces.floor;
        let share = (left - noise) / variance.max(noise).max(f64::MIN_POSITIVE);
        if share > simulator.foreign_share() && worst.is_none_or(|w| share > w.1) {
            worst = Some((stage, share));
        }
    }
    let (stage, share) = worst?;
    let spec = &simulator.stages()[stage];
    Some(format!(
        "The gap is everything: {:.0} % of what {} does is not in the simulator of {}. Is it the right rig, and is every \
         column what its name says?",
        100.0 * share.min(1.0),
        spec.channel,
        spec.name
    ))
}

/// The stage whose parameters are strained most, if any.
fn strained(
    bench: &Bench<'_>,
    best: &Solution,
    evidence: &Evidence,
) -> Result<Option<String>, GapError> {
    let simulator = bench.simulator;
    let specs = simulator.parameters();
    let at_end = |index: &&usize| {
        let spec = &specs[**index];
        spec.sd > 0.0 && (evidence.best.parameters[**index] - spec.nominal).abs() >= END * spec.sd
    };
    let left = |stage: usize| evidence.stages[stage].excess_after;
    let stages = simulator.stages().iter().enumerate().filter(|(stage, _)| left(*stage) > LEFT);
    let strained = stages.filter_map(|(stage, spec)| {
        let ended: Vec<usize> = spec.parameters.iter().filter(at_end).copied().collect();
        (ended.len() >= 2).then_some((stage, spec, ended))
    });
    let Some((stage, spec, ended)) = strained.max_by(|a, b| left(a.0).total_cmp(&left(b.0))) else {
        return Ok(None);
    };
    if !best.effects.is_empty()
        && loosened(bench, evidence, stage, &ended)? > bench.excess(&best.misfits[stage])
    {
        return Ok(None);
    }
    let names: Vec<&str> = ended.iter().map(|&p| specs[p].name.as_str()).collect();
    Ok(Some(format!(
        "The parameters of {} do not fit within their tolerances: {} stand at the end of them, and a gap of {:.1} floors is left \
         all the same. Is it the right rig? If its parameters are right, something is missing that is not in the catalogue.",
        spec.name,
        names.join(", "),
        left(stage)
    )))
}

/// Excess of a stage without effects, some of its parameters set loose.
fn loosened(
    bench: &Bench<'_>,
    evidence: &Evidence,
    stage: usize,
    ended: &[usize],
) -> Result<f64, GapError> {
    let loose = Altered::of(bench.simulator, |i, p| match ended.contains(&i) {
        true => ParameterSpec {
            sd: LOOSE * p.sd,
            least: p.least.min(KEPT * p.nominal.abs()),
            ..p.clone()
        },
        false => p.clone(),
    });
    let free = bench.beside(&loose, bench.metrics.clone());
    let fitted = free.fit(&[stage], evidence.retuned.clone(), &[], FINE)?;
    Ok(fitted.misfits.iter().map(|m| free.excess(m)).sum())
}

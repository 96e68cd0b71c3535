//! What the catalogue lacks, where a gap is left: proposed as a term, told to be random, or taken for noise.

use crate::{
    evidence::excess::Excess,
    fit::{hypothesis::Hypothesis, prepared::Problem, score::gap},
    missing::{Proposed, propose},
    problem::error::GapError,
    verdict::{diagnosis::VerdictKind, judge::Verdict},
};

/// Noise is known to a factor of two of its variance: what is left below that and random in time is noise.
const NOISE: f64 = 1.0;
/// What the catalogue lacks where a gap is left, and the verdict beside it: a gap that is random in time may be noise. So may be one that is
/// smaller than the noise of a measured input that arrives there, though it follows that input: its noise does so, too, where the input
/// rests and nothing else moves it.
///
/// What a known cause leaves because its form is another, and what an unknown cause leaves, are two hypotheses: the named effects with a sum of
/// terms beside them, and a sum of terms alone. The names stand where the first closes more of the held-out gap.
pub(crate) fn lacking(
    problem: &Problem<'_>,
    best: &Hypothesis,
    (verdict, gaps): (Verdict, Excess),
    progress: &dyn Fn(&str),
) -> Result<(Verdict, Option<Proposed>), GapError> {
    if !matches!(verdict.kind, VerdictKind::Partial | VerdictKind::Unknown) {
        return Ok((verdict, None));
    }
    progress("what the catalogue lacks");
    let instead = propose(problem, &problem.nominal)?;
    if verdict.kind == VerdictKind::Unknown {
        let is_random = instead.as_ref().is_some_and(|p| p.random);
        let is_noise = gaps.left < NOISE && (is_random || problem.is_transmitted(best));
        let noise = VerdictKind::Parameters;
        return Ok(match is_noise && verdict.overruled.is_none() {
            true => (Verdict { kind: noise, seen: noise, ..verdict }, None),
            false => (verdict, instead),
        });
    }
    let beside = propose(problem, best)?;
    let held = |h: &Hypothesis, stage: usize| gap(h.misfits[stage].held);
    let of = |p: &Proposed| problem.simulator().stages().iter().position(|s| s.name == p.stage);
    let is_beaten = instead.as_ref().is_some_and(|other| {
        of(other).is_some_and(|stage| {
            let whole = held(&problem.nominal, stage).max(f64::MIN_POSITIVE);
            let own = beside.as_ref().filter(|own| own.stage == other.stage);
            let left = held(best, stage) / whole * (1.0 - own.map_or(0.0, |p| p.closes_held));
            other.closes_held > 1.0 - left
        })
    });
    Ok(if is_beaten { (verdict.nameless(), instead) } else { (verdict, beside) })
}

//! What the catalogue lacks, where a gap is left: proposed as a term, told to be random, or taken for noise.

use crate::{
    diagnosis::{Excess, VerdictKind},
    error::GapError,
    hypothesis::Hypothesis,
    judge::Verdict,
    missing::{Proposed, propose},
    problem::Problem,
    score::gap,
};

/// Noise is known to a factor of two of its variance: what is left below that and random in time is noise.
const NOISE: f64 = 1.0;
/// Share of a gap by which a sum of terms must close more than the names do to stand in their place: it has more freedom.
const BEATEN: f64 = 0.15;

/// What the catalogue lacks where a gap is left, and the verdict beside it: a gap that is random in time may be noise, and names do not stand for
/// most of a gap of which a sum of terms, that stands for something else, closes clearly more, held out.
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
        let is_noise = instead.as_ref().is_some_and(|p| p.random) && gaps.left < NOISE;
        return Ok(match is_noise && verdict.overruled.is_none() {
            true => (Verdict { kind: VerdictKind::Parameters, ..verdict }, None),
            false => (verdict, instead),
        });
    }
    let held = |h: &Hypothesis, stage: usize| gap(h.misfits[stage].held);
    let named = |name: &String| problem.simulator().stages().iter().position(|s| s.name == *name);
    let is_beaten = instead.as_ref().is_some_and(|other| {
        named(&other.stage).is_some_and(|stage| {
            let whole = held(&problem.nominal, stage).max(f64::MIN_POSITIVE);
            other.closes_held >= 1.0 - held(best, stage) / whole + BEATEN
        })
    });
    if is_beaten {
        let verdict = Verdict { kind: VerdictKind::Unknown, ..verdict };
        return Ok((verdict, instead));
    }
    Ok((verdict, propose(problem, best)?))
}

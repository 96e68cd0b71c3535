//! What each effect of the best set closes, so that an answer without a name still says what is known.

use serde::{Deserialize, Serialize};

use crate::{
    diagnosis::{Diagnosis, VerdictKind},
    error::GapError,
    select::{Search, Solution},
};

/// Least share of the gap that is told.
const TOLD: f64 = 0.05;

/// What one effect of the best set closes of the gap in the trials that were fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectShare {
    /// Effect.
    pub effect: String,
    /// Share of the re-tuned nominal's gap that opens again when it is taken out, those that closed less than it gone
    /// before: the shares add up to what the set closes.
    pub closes: f64,
}

/// Takes one effect after the other out of the best set, the weakest first, the rest fitted anew.
pub(crate) fn shares(
    search: &mut Search<'_>,
    best: &Solution,
) -> Result<Vec<EffectShare>, GapError> {
    let bench = search.bench;
    let whole = search.nominal.excess(bench);
    let (mut set, mut out) = (best.clone(), Vec::new());
    while !set.effects.is_empty() {
        let mut weakest: Option<(usize, Solution)> = None;
        for effect in set.effects.clone() {
            let less = search.without(&set, effect)?;
            if weakest.as_ref().is_none_or(|(_, w)| less.excess(bench) < w.excess(bench)) {
                weakest = Some((effect, less));
            }
        }
        let Some((effect, less)) = weakest else { break };
        let closes = (less.excess(bench) - set.excess(bench)) / whole.max(f64::MIN_POSITIVE);
        out.push(EffectShare { effect: bench.simulator.effects()[effect].name.clone(), closes });
        set = less;
    }
    out.reverse();
    Ok(out)
}

/// Says in an answer without a name what closes parts of the gap.
pub(crate) fn tell(diagnosis: &mut Diagnosis) {
    let told: Vec<String> = diagnosis
        .shares
        .iter()
        .filter(|s| s.closes >= TOLD)
        .map(|s| format!("{} {:.0} %", s.effect, 100.0 * s.closes))
        .collect();
    if diagnosis.verdict == VerdictKind::Unknown && !told.is_empty() {
        let all: f64 = diagnosis.shares.iter().map(|s| s.closes).sum();
        diagnosis.sentence += &format!(
            " Parts of it close: {} ({:.0} % together, on trials that were fitted).",
            told.join(", "),
            100.0 * all
        );
    }
}

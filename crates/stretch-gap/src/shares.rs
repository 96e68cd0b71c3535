//! What each effect of the best set closes, so that an answer without a name still says what is known.

use serde::{Deserialize, Serialize};

use crate::{
    diagnosis::{Diagnosis, VerdictKind},
    error::GapError,
    select::{Search, Solution},
    spec::EffectSpec,
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
    /// Whether one of its parameters went to an end of its range: it then rather stands in for something else.
    pub at_bound: bool,
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
        let spec = &bench.simulator.effects()[effect];
        let at_bound = best.model.effect(effect).is_some_and(|values| is_at_bound(spec, values));
        out.push(EffectShare { effect: spec.name.clone(), closes, at_bound });
        set = less;
    }
    out.reverse();
    Ok(out)
}

/// Whether a parameter that is no form stands at an end of its range where the effect is not off.
fn is_at_bound(spec: &EffectSpec, values: &[f64]) -> bool {
    let mut fitted = spec.parameters.iter().zip(values).filter(|(p, _)| p.is_fitted);
    fitted.any(|(p, value)| {
        let near = |end: f64| (value - end).abs() < 1e-3 * (p.max - p.min);
        p.form.is_none() && (near(p.min) || near(p.max)) && !p.off.is_some_and(near)
    })
}

/// Says in an answer without a name what closes parts of the gap.
pub(crate) fn tell(diagnosis: &mut Diagnosis) {
    let told: Vec<String> = diagnosis
        .shares
        .iter()
        .filter(|s| s.closes >= TOLD)
        .map(|s| {
            let end = if s.at_bound { " (at the end of its range)" } else { "" };
            format!("{} {:.0} %{end}", s.effect, 100.0 * s.closes)
        })
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

//! What each effect of the best set closes, so that an answer without a name still says what is known.
//!
//! Effects overlap: what each closes alone adds up to more than the whole. Taken out from the weakest to the strongest, with the rest
//! fitted anew each time, their shares (gap without - gap with)/gap of the nominal telescope to what the set closes.

use crate::{
    diagnosis::EffectShare, error::GapError, hypothesis::Hypothesis, sets::Sets, spec::EffectSpec,
};

/// Takes one effect after the other out of the best set, the weakest first, the rest fitted anew.
pub(crate) fn shares(sets: &mut Sets<'_>, best: &Hypothesis) -> Result<Vec<EffectShare>, GapError> {
    let problem = sets.problem;
    let whole = problem.gap(&problem.nominal);
    let (mut set, mut out) = (best.clone(), Vec::new());
    while !set.effects.is_empty() {
        let mut weakest: Option<(usize, Hypothesis)> = None;
        for effect in set.effects.clone() {
            let less = sets.without(&set, effect)?;
            if weakest.as_ref().is_none_or(|(_, w)| problem.gap(&less) < problem.gap(w)) {
                weakest = Some((effect, less));
            }
        }
        let Some((effect, less)) = weakest else { break };
        let closes = (problem.gap(&less) - problem.gap(&set)) / whole.max(f64::MIN_POSITIVE);
        let spec = &problem.simulator().effects()[effect];
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

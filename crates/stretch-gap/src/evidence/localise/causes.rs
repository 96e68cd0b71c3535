//! Locates the gap at its cause, if there are named effects.
//!
//! The stage in which a gap shows need not be the stage of its cause. For example, a non-linear
//! potentiometer also shows in the voltage of the gauge, because the simulated gauge is driven by
//! the length that the potentiometer measures. Therefore the part of the gap that a named effect
//! closes belongs to the stage of the effect, and the part that is left belongs to the stage that
//! leaves it:
//!
//! ```text
//! share_s = (sum of what named effects of s close + max(0, e_s left)/e)/sum of the same over all stages
//! ```
//!
//! with the gap e of the re-tuned nominal simulator, and the excess e_s left that remains in stage
//! s.

use crate::{
    evidence::{localise::location::StageGap, shares::EffectShare},
    problem::{simulator::Simulator, spec::EffectSpec},
};

/// Name of the stage in which lengths are measured. No simulator has this stage.
const REFERENCE: &str = "reference";

/// Returns the stages with their shares of the gap by cause. The shares are unchanged if no effect
/// is named.
pub(crate) fn with_causes(
    mut stages: Vec<StageGap>,
    shares: &[EffectShare],
    named: &[String],
    simulator: &dyn Simulator,
) -> Vec<StageGap> {
    let whole: f64 = stages.iter().map(|s| s.excess.max(0.0)).sum();
    if named.is_empty() || whole <= 0.0 {
        return stages;
    }
    let mut caused: Vec<f64> = stages.iter().map(|s| s.after.max(0.0) / whole).collect();
    for share in shares.iter().filter(|s| named.contains(&s.effect)) {
        let spec = simulator.effects().iter().find(|spec| spec.name == share.effect);
        let Some(stage) = spec.and_then(|spec| place(&mut stages, spec)) else { continue };
        caused.resize(stages.len(), 0.0);
        caused[stage] += share.closes.max(0.0);
        if stages[stage].is_cause_only {
            stages[stage].excess += share.closes.max(0.0) * whole;
        }
    }
    let all: f64 = caused.iter().sum();
    if all > 0.0 {
        stages.iter_mut().zip(caused).for_each(|(stage, caused)| stage.share = caused / all);
    }
    stages
}

/// Returns the index of the stage to which an effect belongs. If the simulator lacks this stage, it
/// is appended to `stages`.
fn place(stages: &mut Vec<StageGap>, spec: &EffectSpec) -> Option<usize> {
    let shows = *spec.touches.first()?;
    let is_own = spec.stage == REFERENCE;
    match stages.iter().position(|s| s.stage == spec.stage) {
        Some(stage) => Some(stage),
        // The effect belongs to a part of a stage that is simulated as a whole, such as the
        // pneumatics of the actuation.
        None if !is_own => Some(shows),
        None => {
            let own = StageGap {
                stage: spec.stage.clone(),
                share: 0.0,
                raw: 0.0,
                excess: 0.0,
                after: 0.0,
                is_cause_only: true,
                ..stages.get(shows)?.clone()
            };
            stages.push(own);
            Some(stages.len() - 1)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::toys::{Effect, Law, Toy};

    fn stage(name: &str, excess: f64, after: f64) -> StageGap {
        StageGap {
            stage: name.into(),
            channel: "y".into(),
            share: 0.5,
            raw: excess,
            excess,
            after,
            rms: 1.0,
            floor: 0.1,
            floor_source: String::new(),
            unit: "mm".into(),
            is_cause_only: false,
        }
    }

    fn share(effect: &str, closes: f64) -> EffectShare {
        EffectShare { effect: effect.into(), closes, closes_excess: closes, at_bound: false }
    }

    /// A toy of two stages with one effect in each.
    #[test]
    fn a_gap_lies_where_its_cause_does() {
        let mut toy = Toy::of(&[Law::Lag, Law::Line]);
        toy.catalogue = vec![(0, Effect::Play), (1, Effect::Quadratic)];
        let measured = toy.measured(1);
        let simulator: &dyn Simulator = &measured;
        let names: Vec<String> = simulator.effects().iter().map(|e| e.name.clone()).collect();
        let before = [stage("lag", 2.0, 0.0), stage("line", 8.0, 1.0)];
        let shares = [share(&names[1], 0.7), share(&names[0], 0.2)];
        let told = with_causes(before.to_vec(), &shares, &names, simulator);
        let found: Vec<f64> = told.iter().map(|s| s.share).collect();
        // The first effect closes 0.2, the second 0.7, and 0.1 is left in the second stage.
        approx::assert_abs_diff_eq!(found[0], 0.2, epsilon = 1e-12);
        approx::assert_abs_diff_eq!(found[1], 0.8, epsilon = 1e-12);
        // If no effect is named, the shares are those of the channels.
        assert_eq!(with_causes(before.to_vec(), &shares, &[], simulator), before);
    }

    #[test]
    fn a_fault_of_the_reference_has_a_place_of_its_own() {
        let mut stages = vec![stage("actuation", 1.0, 0.0), stage("sensing", 9.0, 0.0)];
        let pot = EffectSpec {
            touches: vec![0, 1],
            ..EffectSpec::new("pot_nonlinearity", (0, REFERENCE), Vec::new())
        };
        assert_eq!(place(&mut stages, &pot), Some(2));
        assert_eq!((stages[2].stage.as_str(), stages[2].is_cause_only), (REFERENCE, true));
        // The stage was added by the first call, so this call adds none.
        assert_eq!((place(&mut stages, &pot), stages.len()), (Some(2), 3));
        let valve = EffectSpec::new("leak", (0, "pneumatics"), Vec::new());
        assert_eq!(place(&mut stages, &valve), Some(0));
    }
}

//! Effects as the engine of the diagnosis takes them.

use stretch_gap::{EffectParameterSpec, EffectSpec};
use stretch_sim::{Effect, EffectParameter, Role, Scale, Search};

/// Where an effect acts, and where it is looked for.
pub(crate) struct Place {
    /// Stages whose output it changes.
    pub(crate) touches: Vec<usize>,
    pub(crate) search: Search,
    /// The catalogue's unit of a parameter in the unit that it has there.
    pub(crate) unit: fn(&EffectParameter) -> f64,
}

/// An effect at a place.
pub(crate) fn spec(effect: &Effect, place: Place) -> EffectSpec {
    let Place { touches, search, unit } = place;
    let parameter = |(p, range): (&EffectParameter, &[f64; 2])| {
        let unit = unit(p);
        EffectParameterSpec {
            name: p.name.into(),
            unit: if unit == 1.0 { p.unit } else { "1" }.into(),
            min: range[0],
            max: range[1],
            off: p.off().map(|off| off * unit),
            is_log: p.scale == Scale::Log,
            is_fitted: p.role != Role::Choice,
            form: matches!(p.role, Role::Form { .. }).then(|| p.usual() * unit),
        }
    };
    EffectSpec {
        name: effect.name.into(),
        stage: effect.stage.name().into(),
        touches,
        parameters: effect.fitted().zip(&search.ranges).map(parameter).collect(),
        starts: search.starts,
        is_between_trials: effect.is_between_trials,
        twins: effect.twins.iter().map(|twin| (*twin).to_owned()).collect(),
    }
}

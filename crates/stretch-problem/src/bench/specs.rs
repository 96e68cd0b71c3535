//! Converts effects of the catalogue into effects for the diagnosis.

use stretch_data::in_digits;
use stretch_effects::{Family, Measure};
use stretch_gap::{Description, EffectSpec};
use stretch_sim::{Acts, Effect, EffectParameter, Search};

/// Where an effect acts, and the values at which it is looked for.
pub(crate) struct Place {
    /// Stages whose output the effect changes.
    pub(crate) touches: Vec<usize>,
    pub(crate) search: Search,
    /// Factor from the catalogue's unit of a parameter to its unit at this place.
    pub(crate) unit: fn(&EffectParameter) -> f64,
}

/// Converts an effect that acts at a place.
fn spec(effect: &Effect, place: Place) -> EffectSpec {
    let Place { touches, search, unit } = place;
    let parameter = |(p, range): (&EffectParameter, &[f64; 2])| {
        let unit = unit(p);
        let name = if unit == 1.0 { &p.unit } else { "1" };
        EffectParameter { min: range[0], max: range[1], ..p.times(unit, name) }
    };
    let parameters = effect.fitted().zip(&search.ranges).map(parameter).collect();
    let stage = (touches.first().copied().unwrap_or(0), effect.stage.name());
    EffectSpec {
        touches,
        starts: search.starts,
        is_found: effect.find().is_some(),
        drifts: effect.drifts(),
        twins: effect.twins.iter().map(|twin| (*twin).to_owned()).collect(),
        family: lateness(effect),
        ..EffectSpec::new(effect.name, stage, parameters)
    }
}

/// The time by which an effect makes a signal late; `None` for an effect that does something else.
fn lateness(effect: &Effect) -> Option<(Family, Measure)> {
    match effect.acts {
        Acts::At { kind, values: None, .. } => {
            kind.family.filter(|(what, _)| *what == Family::Late)
        }
        _ => None,
    }
}

/// Name of the effect of a channel that is sampled a little late or early.
const SKEW: &str = "channel_skew";

/// Range of the delays that the catalogue's skew covers, s; the `usual` range if the catalogue has
/// no skew.
pub(crate) fn skew_of(about: &Description, usual: [f64; 2]) -> [f64; 2] {
    let skew = about.spec().effects.iter().find(|e| e.name == SKEW);
    skew.and_then(|e| e.parameters.first()).map_or(usual, |p| [p.min, p.max])
}

/// Returns a note on an effect that cannot be seen at a sample rate (Hz) because it needs a higher
/// rate.
pub(crate) fn too_slow(name: &str, rate_hz: f64, needed_hz: f64) -> String {
    format!(
        "{name} is not looked for, because at {} samples a second it cannot be distinguished from other causes; record at \
         least {needed_hz} samples a second",
        in_digits(rate_hz, 6)
    )
}

/// Effects that a recording of this sample time can show, and their entries for the diagnosis; a note for each other
/// effect says why it is left out.
pub(super) fn shown(
    effects: impl Iterator<Item = (&'static Effect, Place)>,
    dt_s: f64,
    notes: &mut Vec<String>,
) -> (Vec<&'static Effect>, Vec<EffectSpec>) {
    let rate_hz = 1.0 / dt_s;
    effects
        .filter_map(|(effect, mut place)| {
            let Some(needed) = place.search.at_rate(|values| effect.least_rate_hz(values), rate_hz)
            else {
                return Some((effect, spec(effect, place)));
            };
            notes.push(too_slow(effect.name, rate_hz, needed));
            None
        })
        .unzip()
}

#[cfg(test)]
mod tests {
    use stretch_sim::Catalogue;

    use super::*;

    #[test]
    fn effects_that_make_a_signal_late_say_by_how_much() {
        let late = |effect: &'static Effect| {
            let (_, measure) = lateness(effect)?;
            Some((effect.name, measure(&[0.06, 0.25])))
        };
        let late: Vec<(&str, f64)> = Catalogue::default().iter().filter_map(late).collect();
        // An inertia delays slow motions by 2 damping m.
        let expected =
            [("crossbeam_inertia", 0.03), ("amplifier_lowpass", 0.06), ("channel_skew", 0.06)];
        assert_eq!(late, expected);
    }
}

//! Effects that the data cannot distinguish, described by the property that they share.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stretch_effects::Family;

use crate::{
    evidence::candidates::Candidate,
    problem::{simulator::Simulator, spec::EffectSpec},
};

/// An effect and alternatives that change the same output in the same way, such as a delay and a lag.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EffectFamily {
    /// The effects, the named one first.
    pub names: Vec<String>,
    /// Titles of their kinds, each once, such as "a delay"; none if the effects have titles of their own.
    pub titles: Vec<String>,
    /// The property that they share: `late` or `loop`.
    #[schemars(with = "String")]
    pub property: Family,
    /// The output that is late, or the side of the stage at which a loop acts.
    pub place: String,
    /// Range of the property, from the least to the greatest value of any effect.
    pub range: [f64; 2],
    /// Unit of the range.
    pub unit: String,
}

impl EffectFamily {
    /// Returns the family of an effect among its alternatives; `None` if no alternative is of its
    /// family, or if the sign of the property is unknown.
    pub(crate) fn of(
        name: &str,
        alternatives: &[String],
        candidates: &[Candidate],
        simulator: &dyn Simulator,
    ) -> Option<Self> {
        let spec = |name: &str| simulator.effects().iter().find(|e| e.name == name);
        let own = spec(name)?;
        let (property, _) = own.family?;
        let is_alike = |other: &&EffectSpec| {
            let is_there = property == Family::Late || side(other) == side(own);
            is_there
                && other.touches == own.touches
                && other.family.is_some_and(|(p, _)| p == property)
        };
        let others = alternatives.iter().filter_map(|name| spec(name)).filter(is_alike);
        let all: Vec<&EffectSpec> = std::iter::once(own).chain(others).collect();
        let sizes = all.iter().filter_map(|one| size(one, candidates));
        let range =
            sizes.map(|x| [x, x]).reduce(|[a, b], [low, high]| [a.min(low), b.max(high)])?;
        let mut titles: Vec<String> = Vec::new();
        for title in all.iter().filter_map(|one| Some(one.kind?.title.to_owned())) {
            if !titles.contains(&title) {
                titles.push(title);
            }
        }
        let place = match (property, &own.touches[..]) {
            (Family::Loop, _) => side(own).to_owned(),
            (Family::Late, [stage]) => simulator.stages()[*stage].channel.clone(),
            (Family::Late, _) => "every output".to_owned(),
        };
        let unit = match property {
            Family::Late => "s".to_owned(),
            Family::Loop => own.parameters.first().map_or(String::new(), |p| p.unit.to_string()),
        };
        let names: Vec<String> = all.iter().map(|one| one.name.clone()).collect();
        let is_known = names.len() > 1 && range[0] * range[1] > 0.0;
        is_known.then_some(Self { names, titles, property, place, range, unit })
    }

    /// Describes the effects by what they do.
    ///
    /// ```
    /// use stretch_effects::Family;
    /// use stretch_gap::EffectFamily;
    /// let of = |range: [f64; 2]| EffectFamily {
    ///     names: vec!["output.delay".into(), "output.lag".into()],
    ///     titles: vec!["a delay".into(), "a lag".into()],
    ///     property: Family::Late,
    ///     place: "angle_rad".into(),
    ///     range,
    ///     unit: "s".into(),
    /// };
    /// assert_eq!(
    ///     of([0.0201, 0.0203]).words(),
    ///     "an effect that makes angle_rad late by 20 ms (a delay or a lag: these data cannot tell which)"
    /// );
    /// assert!(of([0.018, 0.0203]).words().contains("late by 18 to 20 ms"));
    /// assert!(of([-0.0203, -0.018]).words().contains("early by 18 to 20 ms"));
    /// ```
    pub fn words(&self) -> String {
        let [low, high] = self.range.map(f64::abs);
        let by = by([low.min(high), low.max(high)], &self.unit);
        let place = &self.place;
        let effect = match self.property {
            Family::Late if self.range[0] < 0.0 => {
                format!("an effect that makes {place} early by {by}")
            }
            Family::Late => format!("an effect that makes {place} late by {by}"),
            Family::Loop => {
                format!("an effect at {place} that stays {by} behind after each reversal")
            }
        };
        let titles = match self.titles.split_last() {
            Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
            _ => self.names.join(" or "),
        };
        format!("{effect} ({titles}: these data cannot tell which)")
    }
}

/// Formats a positive range with two significant digits, and seconds below one as milliseconds.
fn by(range: [f64; 2], unit: &str) -> String {
    let (scale, unit) = if unit == "s" && range[1] < 1.0 { (1e3, "ms") } else { (1.0, unit) };
    let [low, high] = range.map(|x| {
        let x = scale * x;
        let places = (1.0 - x.max(1e-12).log10().floor()).clamp(0.0, 9.0) as usize;
        format!("{x:.places$}")
    });
    let range = if low == high { high } else { format!("{low} to {high}") };
    format!("{range} {unit}").trim_end().to_owned()
}

/// Returns the stage and the side of an effect, from its name.
fn side(effect: &EffectSpec) -> &str {
    effect.name.rsplit_once('.').map_or("", |(side, _)| side)
}

/// Returns the property's size for an effect, from the most probable candidate with this effect.
fn size(effect: &EffectSpec, candidates: &[Candidate]) -> Option<f64> {
    let (_, measure) = effect.family?;
    let candidate = candidates.iter().find(|c| c.effects.contains(&effect.name))?;
    let own = candidate.parameters.iter().filter(|p| p.effect == effect.name);
    Some(measure(&own.map(|p| p.value).collect::<Vec<_>>()))
}

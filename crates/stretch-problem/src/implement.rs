//! What a diagnosis names, as something to type into a simulator.

use stretch_gap::{Diagnosis, EffectValue, Evidence};
use stretch_sim::{Effect, Language, Sketch, Surroundings};

use crate::fix::{Chosen, digits};

/// A named effect with the numbers that were fitted: its equation, its initial state, and its code.
#[derive(Debug, Clone)]
pub struct Implementation {
    /// The effect.
    pub effect: &'static Effect,
    /// Its parameters and forms, with intervals.
    pub numbers: Vec<EffectValue>,
    /// How it is typed; none for an effect of a user's own that says nothing of that.
    pub sketch: Option<Sketch>,
}

impl Implementation {
    /// Its equation with its numbers.
    pub fn equation(&self) -> String {
        let numbers: Vec<String> = self.numbers.iter().map(told).collect();
        match numbers.is_empty() {
            true => self.effect.equation.to_owned(),
            false => format!("{}; with {}", self.effect.equation, numbers.join(", ")),
        }
    }

    /// What it remembers and where that begins, in words.
    pub fn state(&self) -> String {
        let state = self.sketch.as_ref().and_then(Sketch::initial_state);
        state.unwrap_or_else(|| "it remembers nothing".to_owned())
    }

    /// A function of its name that takes a sample and hands back the next one.
    pub fn code(&self, language: Language) -> Option<String> {
        let comments = [
            format!("{}: {}.", self.effect.name, self.effect.words),
            self.equation(),
            format!("State: {}.", self.state()),
        ];
        let sketch = self.sketch.as_ref()?;
        Some(sketch.code(language, self.effect.name, &comments))
    }
}

/// The effects that a diagnosis names; `complete` finds what it leaves to the record.
pub(crate) fn implementations(
    diagnosis: &Diagnosis,
    evidence: &Evidence,
    rows: &[&'static Effect],
    around: &Surroundings<'_>,
    complete: impl Fn(&Effect, Vec<f64>) -> Vec<f64>,
) -> Vec<Implementation> {
    let Ok(chosen) = Chosen::of(diagnosis, evidence) else { return Vec::new() };
    let is_named = |effect: &Effect| diagnosis.named.iter().any(|name| name == effect.name);
    let effects = chosen.effects(rows, |_, _| ()).into_iter();
    let one = |(effect, values): (&'static Effect, Vec<f64>)| {
        let values = complete(effect, values);
        Implementation {
            effect,
            numbers: chosen.numbers(effect),
            sketch: effect.sketch.map(|sketch| sketch(&values, around)),
        }
    };
    let mut all: Vec<Implementation> = effects.filter(|(e, _)| is_named(e)).map(one).collect();
    let place = |i: &Implementation| diagnosis.named.iter().position(|n| n == i.effect.name);
    all.sort_by_key(place);
    all
}

/// A number with its unit and its 95 % interval.
fn told(p: &EffectValue) -> String {
    let unit = if p.unit == "1" { String::new() } else { format!(" {}", p.unit) };
    let [low, high] = p.interval.map(digits);
    format!("{} = {}{unit} ({low} .. {high})", p.name, digits(p.value))
}

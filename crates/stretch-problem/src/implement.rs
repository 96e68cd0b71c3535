//! The effects that a diagnosis names, as code to type into a simulator.

use stretch_data::{after_number, in_digits};
use stretch_gap::EffectValue;
use stretch_sim::{Language, Sketch};

/// A named effect with the numbers that were fitted: its equation, its initial state, and its code.
#[derive(Debug, Clone)]
pub struct Implementation {
    /// The effect's name.
    pub name: String,
    /// What the effect does, for someone who does not know its name.
    pub words: String,
    /// The stage that the effect belongs to.
    pub stage: String,
    /// The effect's equation, in the names of its parameters.
    pub formula: String,
    /// The effect's parameters and forms, with intervals.
    pub numbers: Vec<EffectValue>,
    /// The effect as code; none for an effect without a sketch.
    pub sketch: Option<Sketch>,
}

impl Implementation {
    /// The equation with the fitted numbers.
    pub fn equation(&self) -> String {
        let numbers: Vec<String> = self.numbers.iter().map(with_interval).collect();
        match numbers.is_empty() {
            true => self.formula.clone(),
            false => format!("{}; with {}", self.formula, numbers.join(", ")),
        }
    }

    /// The internal state of the effect and its initial value, in words.
    pub fn state(&self) -> String {
        let state = self.sketch.as_ref().and_then(Sketch::initial_state);
        state.unwrap_or_else(|| "it remembers nothing".to_owned())
    }

    /// A function with the effect's name that takes a sample and returns the sample with the effect.
    pub fn code(&self, language: Language) -> Option<String> {
        let comments = [
            format!("{}: {}.", self.name, self.words),
            self.equation(),
            format!("State: {}.", self.state()),
        ];
        let sketch = self.sketch.as_ref()?;
        Some(sketch.code(language, &Language::identifier(&self.name), &comments))
    }
}

/// A number with its unit and its 95 % interval.
fn with_interval(p: &EffectValue) -> String {
    let unit = after_number(&p.unit);
    let [low, high] = p.interval.map(|x| in_digits(x, 4));
    format!("{} = {}{unit} ({low} .. {high})", p.name, in_digits(p.value, 4))
}

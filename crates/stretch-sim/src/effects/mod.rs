//! The catalogue of the rig's effects. Effects of supply, valves, chamber and muscle are defined here; effects of the
//! gauge come from `stretch_effects`.

use stretch_effects::{Effect, GAUGE};

use crate::SimError;

mod actuation;
mod set;

pub use set::{ActiveEffect, EffectSet};

/// Effects of valves, chamber and muscle.
static ACTUATION: [&Effect; 8] = [
    &actuation::SUPPLY_SAG,
    &actuation::VALVE_DELAY,
    &actuation::VALVE_DEADBAND,
    &actuation::LEAK,
    &actuation::CHAMBER_VOLUME,
    &actuation::MUSCLE_HYSTERESIS,
    &actuation::MUSCLE_CREEP,
    &actuation::CROSSBEAM_INERTIA,
];

/// Every effect: actuation first, then the gauge. Several effects of one stage act in this order.
pub static CATALOGUE: &[&Effect] = &joined();

const fn joined() -> [&'static Effect; ACTUATION.len() + GAUGE.len()] {
    let mut all = [ACTUATION[0]; ACTUATION.len() + GAUGE.len()];
    let mut i = 0;
    while i < all.len() {
        all[i] = if i < ACTUATION.len() { ACTUATION[i] } else { GAUGE[i - ACTUATION.len()] };
        i += 1;
    }
    all
}

/// The catalogue's effect called `name`, if there is one.
///
/// ```
/// let effect = stretch_sim::effect_named("leak").unwrap();
/// assert_eq!(effect.parameters[0].name, "c");
/// ```
pub fn effect_named(name: &str) -> Option<&'static Effect> {
    CATALOGUE.iter().copied().find(|e| e.name == name)
}

/// The effects that a diagnosis can find.
///
/// ```
/// use stretch_sim::{Catalogue, Effect};
/// static OWN: Effect = Effect { name: "own", ..Effect::PLAIN };
/// let catalogue = Catalogue::default().without(&["leak"])?.with(&OWN)?;
/// assert!(catalogue.named("leak").is_none() && catalogue.named("own").is_some());
/// # Ok::<(), stretch_sim::SimError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Catalogue {
    effects: Vec<&'static Effect>,
}

impl Default for Catalogue {
    /// The built-in catalogue.
    fn default() -> Self {
        Self { effects: CATALOGUE.to_vec() }
    }
}

impl Catalogue {
    /// Adds an effect after the others.
    ///
    /// # Errors
    /// An effect with that name exists.
    pub fn with(mut self, effect: &'static Effect) -> Result<Self, SimError> {
        if self.named(effect.name).is_some() {
            return Err(SimError::repeated_effect(effect.name));
        }
        self.effects.push(effect);
        Ok(self)
    }

    /// Removes the effects with these names.
    ///
    /// # Errors
    /// An unknown name.
    pub fn without(mut self, names: &[impl AsRef<str>]) -> Result<Self, SimError> {
        for name in names.iter().map(AsRef::as_ref) {
            let known = |e: &&&'static Effect| e.name == name;
            if self.effects.iter().chain(CATALOGUE).find(known).is_none() {
                return Err(SimError::unknown_effect(name, &self.effects));
            }
            self.effects.retain(|e| e.name != name);
        }
        Ok(self)
    }

    /// The effect called `name`, if the catalogue contains it.
    pub fn named(&self, name: &str) -> Option<&'static Effect> {
        self.effects.iter().copied().find(|e| e.name == name)
    }

    /// Iterates over the effects.
    pub fn iter(&self) -> impl Iterator<Item = &'static Effect> {
        self.effects.iter().copied()
    }
}

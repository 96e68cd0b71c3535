//! A catalogue: effects to be diagnosed, the built-in ones and a user's additions.

use stretch_effects::Effect;

use super::CATALOGUE;
use crate::{SimError, nearest::nearest};

/// Effects that a diagnosis knows.
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
    /// With one more effect, after the others.
    ///
    /// # Errors
    /// An effect with that name exists.
    pub fn with(mut self, effect: &'static Effect) -> Result<Self, SimError> {
        if self.named(effect.name).is_some() {
            return Err(SimError::RepeatedEffect { name: effect.name.to_owned() });
        }
        self.effects.push(effect);
        Ok(self)
    }

    /// Without effects of these names.
    ///
    /// # Errors
    /// An unknown name.
    pub fn without(mut self, names: &[impl AsRef<str>]) -> Result<Self, SimError> {
        for name in names.iter().map(AsRef::as_ref) {
            let known = |e: &&&'static Effect| e.name == name;
            if self.effects.iter().chain(CATALOGUE).find(known).is_none() {
                let nearest = nearest(name, self.effects.iter().map(|e| e.name));
                return Err(SimError::UnknownEffect { name: name.to_owned(), nearest });
            }
            self.effects.retain(|e| e.name != name);
        }
        Ok(self)
    }

    /// The effect called `name`, if it is in.
    pub fn named(&self, name: &str) -> Option<&'static Effect> {
        self.effects.iter().copied().find(|e| e.name == name)
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = &'static Effect> {
        self.effects.iter().copied()
    }
}

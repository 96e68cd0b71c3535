//! Effects that are on, with their values.

use stretch_data::EffectEntry;
use stretch_effects::{Action, Effect, EffectParameter, Grid, RigStage, Role, Surroundings};

use super::{CATALOGUE, effect_named};
use crate::{SimError, error::nearest, params::RigParams, stages::check_length};

/// One effect with the values of its parameters, in the order of [`Effect`]'s parameters.
#[derive(Debug, Clone)]
pub struct ActiveEffect {
    effect: &'static Effect,
    values: Vec<f64>,
}

impl ActiveEffect {
    /// The effect's entry in the catalogue.
    pub fn effect(&self) -> &'static Effect {
        self.effect
    }

    /// Name of the effect.
    pub fn name(&self) -> &'static str {
        self.effect.name
    }

    /// Values, one per parameter.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The effect's action with these values.
    pub fn action(&self, around: &Surroundings<'_>) -> Action {
        self.effect.action(&self.values, around)
    }

    /// Whether these values have no effect.
    pub fn is_off(&self) -> bool {
        self.effect.is_off(&self.values)
    }
}

impl PartialEq for ActiveEffect {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name() && self.values == other.values
    }
}

/// A combination of effects, kept in the catalogue's order whatever the order of insertion.
///
/// ```
/// use stretch_sim::EffectSet;
/// let mut effects = EffectSet::new();
/// effects.insert("pot_backlash", &[("w", 0.5)])?;
/// effects.insert("gauge_hysteresis", &[("h", 0.2)])?; // s takes its typical value
/// let names: Vec<_> = effects.iter().map(|e| e.name()).collect();
/// assert_eq!(names, ["gauge_hysteresis", "pot_backlash"]);
/// assert!(effects.insert("leek", &[]).unwrap_err().to_string().contains("did you mean `leak`?"));
/// # Ok::<(), stretch_sim::SimError>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EffectSet {
    entries: Vec<ActiveEffect>,
}

impl EffectSet {
    /// No effect: the nominal rig.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds an effect of the catalogue by name. Missing shape parameters take their typical value,
    /// missing form parameters their neutral value.
    ///
    /// # Errors
    /// An unknown name or parameter, a missing strength, a value outside its range, or an effect
    /// that the set contains already.
    pub fn insert(&mut self, name: &str, given: &[(&str, f64)]) -> Result<(), SimError> {
        let effect = known(name)?;
        let values = resolve(effect, given, |_| 1.0)?;
        for (p, value) in effect.parameters.iter().zip(&values) {
            if !p.allowed().contains(value) {
                return Err(out_of_range(effect, p, *value));
            }
        }
        self.push(effect, &values)
    }

    /// Like [`insert`](Self::insert), with values in other units. `unit` gives the size of the catalogue's unit of each
    /// parameter in the other unit, and converts the defaults. Ranges are not enforced, because they belong to the rig.
    pub(crate) fn insert_in(
        &mut self,
        entry: &EffectEntry,
        unit: impl Fn(&EffectParameter) -> f64,
    ) -> Result<(), SimError> {
        let effect = known(&entry.name)?;
        let values = resolve(effect, &given(entry), unit)?;
        self.push(effect, &values)
    }

    /// The effects that a rig file lists, in its order.
    ///
    /// # Errors
    /// As for [`insert`](Self::insert).
    pub fn from_entries(entries: &[EffectEntry]) -> Result<Self, SimError> {
        let mut effects = Self::new();
        for entry in entries {
            effects.insert(&entry.name, &given(entry))?;
        }
        Ok(effects)
    }

    /// The effects as a rig file lists them.
    pub fn to_entries(&self) -> Vec<EffectEntry> {
        let entry = |e: &ActiveEffect| EffectEntry {
            name: e.name().to_string(),
            parameters: e
                .effect()
                .parameters
                .iter()
                .zip(e.values())
                .map(|(p, value)| (p.name.to_string(), *value))
                .collect(),
        };
        self.iter().map(entry).collect()
    }

    /// Adds any effect, of the catalogue or of a user, with the values of its parameters. Trailing
    /// form parameters may be left out. Ranges are plausible values, not limits, so they are not
    /// enforced here.
    ///
    /// # Errors
    /// An effect with that name exists, there are too few or too many values, or one is not finite.
    pub fn push(&mut self, effect: &'static Effect, values: &[f64]) -> Result<(), SimError> {
        let name = effect.name;
        if self.find(name).is_some() {
            return Err(SimError::repeated_effect(name));
        }
        let (expected, found) = (effect.parameters.len(), values.len());
        let left_out = effect.parameters.get(found..).unwrap_or(&[]);
        let is_needed = |p: &EffectParameter| matches!(p.role, Role::Strength { .. } | Role::Shape);
        if found > expected || left_out.iter().any(is_needed) {
            check_length(name, expected, found)?;
        }
        let mut values = values.to_vec();
        values.extend(left_out.iter().map(|p| p.typical));
        if let Some((p, value)) =
            effect.parameters.iter().zip(&values).find(|(_, v)| !v.is_finite())
        {
            return Err(out_of_range(effect, p, *value));
        }
        let place =
            |name: &str| CATALOGUE.iter().position(|e| e.name == name).unwrap_or(usize::MAX);
        let mine = place(name);
        let at =
            self.entries.iter().position(|e| place(e.name()) > mine).unwrap_or(self.entries.len());
        self.entries.insert(at, ActiveEffect { effect, values });
        Ok(())
    }

    /// The effect called `name`, if the set contains it.
    pub fn find(&self, name: &str) -> Option<&ActiveEffect> {
        self.entries.iter().find(|e| e.name() == name)
    }

    /// Removes the effect called `name`.
    pub fn remove(&mut self, name: &str) -> Option<ActiveEffect> {
        let at = self.entries.iter().position(|e| e.name() == name)?;
        Some(self.entries.remove(at))
    }

    /// The effects that meet a condition.
    pub fn only(&self, is_wanted: impl Fn(&Effect) -> bool) -> Self {
        let wanted = self.entries.iter().filter(|e| is_wanted(e.effect));
        Self { entries: wanted.cloned().collect() }
    }

    /// Iterates over the effects in the order in which they act.
    pub fn iter(&self) -> impl Iterator<Item = &ActiveEffect> {
        self.entries.iter()
    }

    /// Iterates over the effects of the stage whose values are not off.
    pub fn acting_in(&self, stage: RigStage) -> impl Iterator<Item = &ActiveEffect> {
        self.entries.iter().filter(move |e| stage.holds(e.effect.stage) && !e.is_off())
    }

    /// Returns the time steps for trials sampled every `dt_s`. No step is longer than `max_step_s`,
    /// and a step is split where a delayed valve command takes effect.
    ///
    /// # Errors
    /// Times that are not positive.
    pub fn grid(&self, params: &RigParams, dt_s: f64, max_step_s: f64) -> Result<Grid, SimError> {
        let whole = Grid::samples(dt_s)?;
        let around = params.surroundings(&whole);
        let mut delay_s = 0.0;
        for active in self.acting_in(RigStage::Pneumatics) {
            if let Action::Delay(seconds) = active.action(&around) {
                delay_s += seconds;
            }
        }
        Ok(Grid::new(dt_s, max_step_s, delay_s)?)
    }

    /// Number of effects.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether the set is empty.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }
}

/// The catalogue's effect of that name.
fn known(name: &str) -> Result<&'static Effect, SimError> {
    effect_named(name).ok_or_else(|| SimError::unknown_effect(name, CATALOGUE))
}

fn out_of_range(effect: &Effect, p: &EffectParameter, value: f64) -> SimError {
    SimError::out_of_range((effect.name, &p.name, &p.unit), value, &p.allowed())
}

/// Names and values of a rig file's entry.
fn given(entry: &EffectEntry) -> Vec<(&str, f64)> {
    entry.parameters.iter().map(|(name, value)| (name.as_str(), *value)).collect()
}

/// Returns the values in the order of the effect's parameters. A missing value is the default in
/// the catalogue's unit times `unit`.
fn resolve(
    effect: &Effect,
    given: &[(&str, f64)],
    unit: impl Fn(&EffectParameter) -> f64,
) -> Result<Vec<f64>, SimError> {
    let parameters = effect.parameters;
    if let Some((name, _)) =
        given.iter().find(|(name, _)| parameters.iter().all(|p| p.name != *name))
    {
        let nearest = nearest(name, parameters.iter().map(|p| &*p.name));
        return Err(SimError::unknown_parameter(effect.name, name, nearest));
    }
    // If an effect has several strengths (the two limits of an amplifier), one is enough: the others stay off.
    let strengths = |p: &&EffectParameter| p.off().is_some();
    let any =
        parameters.iter().filter(strengths).any(|p| given.iter().any(|(name, _)| *name == p.name));
    if let (false, Some(missing)) = (any, parameters.iter().find(strengths)) {
        return Err(SimError::missing_parameter(effect.name, &missing.name));
    }
    Ok(parameters
        .iter()
        .map(|p| {
            given
                .iter()
                .rev()
                .find(|(name, _)| *name == p.name)
                .map_or_else(|| p.off().unwrap_or(p.typical) * unit(p), |(_, value)| *value)
        })
        .collect())
}

//! Effects by name.

use stretch_sim::EffectSet;

pub(crate) fn effect(name: &str, values: &[(&str, f64)]) -> EffectSet {
    let mut effects = EffectSet::new();
    effects.insert(name, values).expect("an effect");
    effects
}

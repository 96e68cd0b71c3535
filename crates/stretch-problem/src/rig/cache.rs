//! Intermediate results that several runs share: pressures of the chamber, lengths of the muscle.
//!
//! Runs that differ only in the muscle share the chamber's pressure. Runs that differ only in the gauge share the
//! chamber's pressure and the muscle's length, where these are simulated because they were not measured.

use std::{
    hash::Hash,
    num::NonZeroUsize,
    sync::{Arc, Mutex, PoisonError},
};

use lru::LruCache;
use stretch_sim::{ActiveEffect, EffectSet, Grid, PARAMETERS, ParameterInfo, RigParams, RigStage};

/// Values by trial.
pub(super) type ByTrial = Vec<Vec<f64>>;
/// Names of effects, and the bits of all numbers.
pub(super) type Causes = (Vec<&'static str>, Vec<u64>);

/// What is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Kept {
    /// Pressure at every node, kPa.
    Nodes,
    /// Simulated pressure at every sample, for recordings without a pressure column, kPa.
    Samples,
    /// Length without play in the reference, mm.
    Lengths,
}

/// Intermediate results by trial, by the causes that they depend on.
pub(super) type RigCache = LastResults<(Kept, Causes), ByTrial>;

/// Number of results that are kept: enough for the probes and steps of the fits under way.
pub(super) const MOST: NonZeroUsize = NonZeroUsize::new(36).expect("not 0");

/// Everything that the outputs of some stages depend on. `others` are the numbers of a run in addition to parameters
/// and effects.
pub(super) fn causes(
    stages: &[RigStage],
    params: &RigParams,
    effects: &EffectSet,
    grid: &Grid,
    others: impl IntoIterator<Item = f64>,
) -> Causes {
    let acting = || stages.iter().flat_map(|stage| effects.acting_in(*stage));
    let acts = acting().next().is_some();
    // An effect may depend on the scales of the muscle.
    let counts = |info: &&ParameterInfo| {
        stages.contains(&info.stage) || (acts && info.stage == RigStage::Muscle)
    };
    let numbers = PARAMETERS
        .iter()
        .filter(counts)
        .map(|info| params[info.key])
        .chain(acting().flat_map(|e| e.values().iter().copied()))
        .chain(grid.steps().iter().copied())
        .chain(others)
        .map(f64::to_bits);
    (acting().map(ActiveEffect::name).collect(), numbers.collect())
}

/// The last few results of a function, by its arguments. A clone begins empty, because the owner of a clone will change what the function depends on.
#[derive(Debug)]
pub(crate) struct LastResults<K: Hash + Eq, V> {
    last: Mutex<LruCache<K, Arc<V>>>,
    most: NonZeroUsize,
}

impl<K: Hash + Eq, V> LastResults<K, V> {
    /// A cache of at most `most` results.
    pub(crate) fn new(most: NonZeroUsize) -> Self {
        Self { last: Mutex::new(LruCache::new(most)), most }
    }

    /// The result for a key, computed if it is not stored. If two threads need the same new result, both compute it.
    pub(crate) fn or_make<E>(
        &self,
        key: K,
        make: impl FnOnce() -> Result<V, E>,
    ) -> Result<Arc<V>, E> {
        // The results of a poisoned list can be made again.
        let lock = || self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(kept) = lock().get(&key) {
            return Ok(Arc::clone(kept));
        }
        let made = Arc::new(make()?);
        lock().put(key, Arc::clone(&made));
        Ok(made)
    }
}

impl<K: Hash + Eq, V> Clone for LastResults<K, V> {
    fn clone(&self) -> Self {
        Self::new(self.most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_is_not_made_again_and_a_clone_has_none() {
        let two = NonZeroUsize::new(2).expect("not 0");
        let kept: LastResults<u32, u32> = LastResults::new(two);
        let never = || Err("made again");
        assert_eq!(kept.or_make(1, || Ok::<_, &str>(10)).as_deref(), Ok(&10));
        assert_eq!(kept.or_make(1, never).as_deref(), Ok(&10));
        assert!(kept.clone().or_make(1, never).is_err());
        assert!(kept.or_make(2, never).is_err());
        for key in [2, 3] {
            assert_eq!(kept.or_make(key, || Ok::<_, &str>(key)).as_deref(), Ok(&key));
        }
        assert!(kept.or_make(1, never).is_err());
    }
}

//! A cache of the last few results of a function.

use std::{
    hash::Hash,
    num::NonZeroUsize,
    sync::{Arc, Mutex, PoisonError},
};

use lru::LruCache;

/// The last few results of a function, by its arguments. A clone begins empty, for the owner of a clone will change what the function depends on.
#[derive(Debug)]
pub(crate) struct Kept<K: Hash + Eq, V> {
    last: Mutex<LruCache<K, Arc<V>>>,
    most: NonZeroUsize,
}

impl<K: Hash + Eq, V> Kept<K, V> {
    /// A cache of at most `most` results.
    pub(crate) fn new(most: NonZeroUsize) -> Self {
        Self { last: Mutex::new(LruCache::new(most)), most }
    }

    /// The result for a key, made where it is not kept. Two threads that miss a result both make it, and get the same.
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

impl<K: Hash + Eq, V> Clone for Kept<K, V> {
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
        let kept: Kept<u32, u32> = Kept::new(two);
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

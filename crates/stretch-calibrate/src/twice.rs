//! Trials that are given twice, under one name or two.

use std::collections::{HashMap, hash_map::Entry};

/// A sentence for each trial that holds the samples of one before it, by the checksums of the trials.
pub(crate) fn fitted_twice<'a>(
    names: impl IntoIterator<Item = &'a str>,
    checksums: impl IntoIterator<Item = Option<u32>>,
) -> Vec<String> {
    let mut seen = HashMap::new();
    let told = names.into_iter().zip(checksums).filter_map(|(name, checksum)| {
        match seen.entry(checksum?) {
            Entry::Vacant(first) => {
                first.insert(name);
                None
            }
            Entry::Occupied(first) => Some(format!(
                "{name} holds the samples of {}: they weigh double, and cross-validation judges a fit by what it was fitted on; name one of the two",
                first.get()
            )),
        }
    });
    told.collect()
}

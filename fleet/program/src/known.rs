//! Which trials a lake has, by content and by name.

use std::{collections::HashMap, ffi::OsString, path::Path};

use crate::lake::{Footer, LakeFile, Place};

/// Trials of a lake, those of the run that writes among them.
#[derive(Debug, Default)]
pub(crate) struct Known {
    /// Where a trial came from, by the digest of its samples.
    by_samples: HashMap<String, String>,
    /// Where a trial came from, by its place and its name without ending.
    by_name: HashMap<(Place, OsString), String>,
}

impl Known {
    pub(crate) fn of(files: &[LakeFile]) -> Self {
        let mut known = Self::default();
        files.iter().for_each(|file| known.insert(&file.footer, &file.place));
        known
    }

    /// Adds a trial that is about to be written, or says in which other file the lake already has
    /// it.
    pub(crate) fn claim(&mut self, footer: &Footer, place: &Place) -> Result<(), String> {
        if let Some(other) = self.by_samples.get(&footer.samples) {
            return Err(format!(
                "its samples are those of {other}, which is in the lake already: a trial counted twice would weigh double"
            ));
        }
        if let Some(other) = self.by_name.get(&name(footer, place)) {
            return Err(format!(
                "it is a second record of trial {} of {place}, with other samples than {other}, which stays: rename it if it is \
                 another trial, or take that one out of the lake",
                footer.trial
            ));
        }
        self.insert(footer, place);
        Ok(())
    }

    fn insert(&mut self, footer: &Footer, place: &Place) {
        self.by_samples.entry(footer.samples.clone()).or_insert_with(|| footer.source.clone());
        self.by_name.entry(name(footer, place)).or_insert_with(|| footer.source.clone());
    }
}

fn name(footer: &Footer, place: &Place) -> (Place, OsString) {
    (place.clone(), Path::new(&footer.trial).file_stem().unwrap_or_default().to_owned())
}

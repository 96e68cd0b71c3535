//! Files to be added to a lake, and detection of copies among them.

use std::{collections::HashMap, ffi::OsString, path::Path};

use rayon::{iter::Either, prelude::*};

use crate::{
    lake::{Footer, LakeFile, Place, digest_of_file},
    sources::Source,
};

/// A file to be added to the lake.
#[derive(Debug, Clone)]
pub(crate) struct Candidate<'a> {
    pub source: &'a Source,
    pub place: &'a Place,
    /// SHA-256 of the file.
    pub digest: String,
}

/// Returns the readable files with a known place, and for the others the reason.
pub(crate) fn candidates(sources: &[Source]) -> (Vec<Candidate<'_>>, Vec<(&Path, String)>) {
    sources.par_iter().partition_map(|source| match candidate(source) {
        Ok(one) => Either::Left(one),
        Err(why) => Either::Right((source.path.as_path(), why)),
    })
}

fn candidate(source: &Source) -> Result<Candidate<'_>, String> {
    let place = source.place.as_ref().map_err(|why| format!("{why:#}"))?;
    if source.is_endless() {
        let why = "it is not a regular file but a device or a pipe, which may have no end";
        return Err(why.to_owned());
    }
    let digest = digest_of_file(&source.path).map_err(|e| format!("it cannot be read: {e}"))?;
    Ok(Candidate { source, place, digest })
}

/// The files of a lake and of this run, by the digest of their bytes.
pub(crate) struct Seen<'a> {
    lake: HashMap<&'a str, &'a Place>,
    new: HashMap<String, &'a Path>,
}

impl<'a> Seen<'a> {
    pub(crate) fn new(files: &'a [LakeFile]) -> Self {
        let lake = files.iter().map(|file| (file.footer.digest.as_str(), &file.place)).collect();
        Self { lake, new: HashMap::new() }
    }

    /// Returns the reason why a file is a byte-identical copy of another one, or `None` if it is not. Of several
    /// identical files, one is the original: the one at the place where the lake already has it, otherwise the first.
    pub(crate) fn copy(&mut self, one: &Candidate<'a>) -> Option<String> {
        if let Some(place) = self.lake.get(one.digest.as_str()).filter(|place| **place != one.place)
        {
            return Some(format!(
                "the lake already has it as a trial of {place}, but here it is given as a trial of {}: remove it from the lake first, or leave it there",
                one.place
            ));
        }
        let path = self.new.insert(one.digest.clone(), &one.source.path)?;
        self.new.insert(one.digest.clone(), path);
        Some(format!(
            "it has the same bytes as {}, which is used: a trial that is used twice would have twice its weight",
            path.display()
        ))
    }
}

/// The trials of a lake, including those written in this run.
#[derive(Debug, Default)]
pub(crate) struct Known {
    /// Source file of a trial, by the digest of its samples.
    by_samples: HashMap<String, String>,
    /// Source file of a trial, by its place and its name without extension.
    by_name: HashMap<(Place, OsString), String>,
}

impl Known {
    pub(crate) fn of(files: &[LakeFile]) -> Self {
        let mut known = Self::default();
        files.iter().for_each(|file| known.insert(&file.footer, &file.place));
        known
    }

    /// Registers a trial that is about to be written. If the lake already has it, returns an error
    /// that names its source file.
    pub(crate) fn claim(&mut self, footer: &Footer, place: &Place) -> Result<(), String> {
        if let Some(other) = self.by_samples.get(&footer.samples) {
            return Err(format!(
                "it has the same samples as {other}, which is already in the lake: a trial that is used twice would have twice its weight"
            ));
        }
        if let Some(other) = self.by_name.get(&name(footer, place)) {
            return Err(format!(
                "the lake already has a trial {} of {place} with other samples, from {other}: rename this file if it is another trial, \
                 or remove that trial from the lake",
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

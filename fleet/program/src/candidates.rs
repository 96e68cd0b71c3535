//! Files that may become trials of a lake, and which of them are copies.

use std::{collections::HashMap, path::Path};

use rayon::prelude::*;

use crate::{
    lake::{LakeFile, Place, digest_of_file},
    sources::Source,
};

/// A file that is to be a trial of the lake.
#[derive(Debug, Clone)]
pub(crate) struct Candidate<'a> {
    pub source: &'a Source,
    pub place: &'a Place,
    /// SHA-256 of the file.
    pub digest: String,
}

/// The files that can be read and whose place is known, and for the others the reason.
pub(crate) fn candidates(sources: &[Source]) -> (Vec<Candidate<'_>>, Vec<(&Path, String)>) {
    let all: Vec<Result<Candidate<'_>, String>> = sources.par_iter().map(candidate).collect();
    let (mut found, mut refused) = (Vec::new(), Vec::new());
    for (source, one) in sources.iter().zip(all) {
        match one {
            Ok(one) => found.push(one),
            Err(why) => refused.push((source.path.as_path(), why)),
        }
    }
    (found, refused)
}

fn candidate(source: &Source) -> Result<Candidate<'_>, String> {
    let place = source.place.as_ref().map_err(|why| format!("{why:#}"))?;
    if source.is_endless() {
        return Err("it is no file, but a device or a pipe, which may have no end".to_owned());
    }
    let digest = digest_of_file(&source.path).map_err(|e| format!("it cannot be read: {e}"))?;
    Ok(Candidate { source, place, digest })
}

/// Why each file is a byte-identical copy of another one, or `None` if it is the one that counts.
/// That is the file at the place where the lake has it, otherwise the first of the list.
pub(crate) fn copies(all: &[Candidate<'_>], there: &[LakeFile]) -> Vec<Option<String>> {
    let in_lake: HashMap<&str, &LakeFile> =
        there.iter().map(|file| (file.footer.digest.as_str(), file)).collect();
    let mut counting: HashMap<&str, &Path> = HashMap::new();
    for one in all {
        let counts = in_lake.get(one.digest.as_str()).is_none_or(|file| file.place == *one.place);
        if counts {
            counting.entry(&one.digest).or_insert(one.source.path.as_path());
        }
    }
    let why = |one: &Candidate<'_>| {
        let counts = counting.get(one.digest.as_str()).copied();
        match in_lake.get(one.digest.as_str()) {
            _ if counts == Some(one.source.path.as_path()) => None,
            Some(file) if file.place != *one.place => Some(format!(
                "the lake has it already as a trial of {}, and here it is said to be of {}: take it out there, or leave it",
                file.place, one.place
            )),
            _ => counts.map(|path| {
                format!(
                    "it has the same bytes as {}, which counts: a trial counted twice would weigh double",
                    path.display()
                )
            }),
        }
    };
    all.iter().map(why).collect()
}

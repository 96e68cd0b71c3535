//! Makes cases in a new folder, and records the seeds of sets whose labels were opened.

use std::{fs, path::Path};

use anyhow::{Context, ensure};
use serde::{Deserialize, Serialize};
use stretch_blind::{FormFamily, OpenScore, Plan, PlantName, Truth, make, make_set, sealed_beside};
use stretch_data::files::{write_folder, write_whole};

use crate::text::progress;

/// Makes the cases of a plan in an empty folder, completely or not at all. Existing cases are never
/// replaced, so labels that were opened cannot be exchanged for others in the same folder.
///
/// # Errors
/// A folder that is not empty, a plan without a case, a file that cannot be written.
pub fn make_cases(folder: &Path, seed: u64, plan: &Plan) -> anyhow::Result<String> {
    let cases = plan.cases();
    ensure!(cases > 0, "--cases 0: there is nothing to make");
    let progress = progress("making cases", cases);
    write_folder(folder, false, |draft| {
        make(draft, seed, plan, &|_| progress.inc(1))?;
        anyhow::Ok(())
    })?;
    Ok(Truth::open(folder)?.1)
}

/// Makes a set of cases of a plant, completely or not at all; refuses a spent seed.
///
/// # Errors
/// A spent seed, a folder that is not empty, a private family that cannot be read.
pub fn make_open(
    plant: PlantName,
    set: &Path,
    (cases, seed): (usize, u64),
    private: Option<&Path>,
    spent: &Path,
) -> anyhow::Result<String> {
    let is_spent = spent_seeds(spent)?.iter().any(|s| s.plant == plant.name() && s.seed == seed);
    ensure!(
        !is_spent,
        "--seed {seed}: {} says that {} cases of it have been opened; take another",
        spent.display(),
        plant.name()
    );
    let private = private.map(FormFamily::read).transpose()?;
    let (sealed, mut hash) = (sealed_beside(set), None);
    let made = write_folder(set, false, |cases_draft| {
        write_folder(&sealed, false, |labels_draft| {
            let folders = (cases_draft, labels_draft);
            hash = Some(make_set(plant, folders, cases, seed, private)?);
            anyhow::Ok(())
        })
    });
    if made.is_err() && hash.is_some() {
        // the labels are already in their folder, but the cases could not be made
        let _ = fs::remove_dir_all(&sealed);
    }
    made?;
    hash.context("no set was made")
}

/// A seed whose labels were opened: a row of the file of spent seeds.
#[derive(Debug, Serialize, Deserialize)]
struct SpentSeed {
    plant: String,
    seed: u64,
    sha256: String,
    first_opened_for: String,
}

fn spent_seeds(path: &Path) -> anyhow::Result<Vec<SpentSeed>> {
    if !path.exists() {
        return Ok(Vec::new());
    }
    let read = || csv::Reader::from_path(path)?.deserialize().collect();
    let rows: Result<_, csv::Error> = read();
    rows.with_context(|| path.display().to_string())
}

/// Adds the seed of a set to the file of spent seeds, unless it is there already.
pub(crate) fn record_spent(path: &Path, score: &OpenScore) -> anyhow::Result<()> {
    let mut spent = spent_seeds(path)?;
    if spent.iter().any(|s| s.plant == score.plant && s.seed == score.seed) {
        return Ok(());
    }
    let OpenScore { plant, seed, set, method, .. } = score.clone();
    spent.push(SpentSeed { plant, seed, sha256: set, first_opened_for: method });
    let mut rows = csv::Writer::from_writer(Vec::new());
    spent.iter().try_for_each(|seed| rows.serialize(seed))?;
    let text = rows.into_inner()?;
    Ok(write_whole(path, |out| out.write_all(&text))?)
}

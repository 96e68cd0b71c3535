//! Cases in a new folder.

use std::path::Path;

use anyhow::ensure;
use stretch_blind::{Plan, Seal, make};
use stretch_files::write_folder;

use crate::text::Progress;

/// Makes the cases of a plan in a folder that holds nothing yet, whole or not at all: whoever opened a seal must not get another under its
/// name.
///
/// # Errors
/// A folder that holds something, a plan without a case, a file that cannot be written.
pub fn make_cases(folder: &Path, seed: u64, plan: &Plan) -> anyhow::Result<Seal> {
    let cases = plan.cases();
    ensure!(cases > 0, "--cases 0: there is nothing to make");
    stretch_files::recover(folder)?;
    let progress = Progress::new("making cases", cases);
    let mut seal = None;
    write_folder(folder, false, |draft| {
        seal = Some(make(draft, seed, plan, &|_| progress.step())?);
        anyhow::Ok(())
    })?;
    // the seal that was made names the folder in which the cases were made
    ensure!(seal.is_some(), "no case was made");
    Ok(Seal::open(folder)?.0)
}

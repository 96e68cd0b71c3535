//! Cases in a new folder.

use std::path::Path;

use anyhow::ensure;
use stretch_blind::{Plan, Seal, make};
use stretch_data::files::write_folder;

use crate::text::Progress;

/// Makes the cases of a plan in an empty folder, completely or not at all, so that a person who
/// opened a seal cannot get another one under its name.
///
/// # Errors
/// A folder that is not empty, a plan without a case, a file that cannot be written.
pub fn make_cases(folder: &Path, seed: u64, plan: &Plan) -> anyhow::Result<Seal> {
    let cases = plan.cases();
    ensure!(cases > 0, "--cases 0: there is nothing to make");
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

//! The diagnosis of one case, which knows its data and what its hint strikes out of the catalogue.

use std::path::Path;

use stretch_data::files::write_whole;
use stretch_gap::{Diagnosis, Evidence, Options, diagnose};
use stretch_problem::{Problem, Reading, RigSimulator};
use stretch_sim::Catalogue;

/// What a diagnosis is asked, in addition to its data.
#[derive(Debug, Clone, Default)]
pub struct Asked {
    /// Effects that the catalogue must do without.
    pub without: Vec<String>,
    /// Whether simpler methods are asked, too.
    pub baselines: bool,
}

/// Diagnoses the data set of a folder as `stretch diagnose FOLDER` does, and writes its JSON.
///
/// # Errors
/// Data that the diagnosis refuses, a file that cannot be written.
pub fn write_diagnosis(folder: &Path, asked: &Asked, file: &Path) -> anyhow::Result<()> {
    let problem =
        Problem::read(folder, &Reading { without: &asked.without, ..Reading::default() })?;
    let options = Options { baselines: asked.baselines, ..Options::default() };
    let examined = problem.examine(&options, false, &|_| (), &|| false)?;
    let text = serde_json::to_string_pretty(&examined.to_json())? + "\n";
    Ok(write_whole(file, |out| out.write_all(text.as_bytes()))?)
}

/// The diagnosis of a case in this process, by an engine with the given options: for tools that
/// know the label.
///
/// # Errors
/// Data that the diagnosis refuses, an effect to strike out that there is none.
pub fn diagnosed(
    folder: &Path,
    without: &[impl AsRef<str>],
    options: &Options,
    progress: &(dyn Fn(&str) + Sync),
) -> anyhow::Result<(Diagnosis, Evidence)> {
    let catalogue = Catalogue::default().without(without)?;
    let simulator = RigSimulator::read(folder, None, &catalogue, Default::default())?;
    Ok(diagnose(&simulator, options, progress, &|| false)?)
}

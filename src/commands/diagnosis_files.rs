//! What a diagnosis writes: the file with what was found, and the code of what is named.

use std::path::Path;

use stretch_data::files::{Outputs, write_whole};
use stretch_data::listed;
use stretch_problem::{Examined, Fixed, Implementation};
use stretch_sim::Language;

use super::shared::stage_text;

/// Writes the rig file or the problem's file where there is something to write; says what it did.
pub(super) fn write_fix(
    outputs: &mut Outputs,
    path: &Path,
    examined: &Examined,
) -> anyhow::Result<String> {
    let shown = path.display();
    let mut fix = match &examined.fix {
        Err(why) => return Ok(format!("{shown} is not written: {why}")),
        Ok(fix) => fix.clone(),
    };
    let Examined { name, seed, .. } = examined;
    let from =
        format!("Found by stretch {} diagnose {name}, seed {seed}.", env!("CARGO_PKG_VERSION"));
    fix.remarks.head.insert(0, from);
    let is_there = path.exists();
    stage_text(outputs, path, &fix.text(path))?;
    let what = match fix.file {
        Fixed::Rig(_) => "the rig",
        Fixed::Problem(_) => "the problem",
    };
    let with = if fix.effects.is_empty() { "no effect".to_owned() } else { listed(&fix.effects) };
    let replaced = if is_there { ", in place of the file that was there" } else { "" };
    Ok(format!("wrote {shown}: {what} re-tuned, with {with}{replaced}"))
}

/// Writes the code of what is named where there is something; says what it did.
pub(super) fn write_snippets(
    outputs: &mut Outputs,
    folder: &Path,
    all: &[Implementation],
) -> anyhow::Result<String> {
    let shown = folder.display();
    let mut files = Vec::new();
    for one in all {
        for language in Language::ALL {
            let name = format!("{}.{}", one.name, language.ending());
            files.extend(one.code(language).map(|code| (name, code)));
        }
    }
    if files.is_empty() {
        let why =
            if all.is_empty() { "no effect is named" } else { "nobody has its code written down" };
        return Ok(format!("{shown} is not written: {why}"));
    }
    outputs.folder(folder, false, |folder| {
        files.iter().try_for_each(|(name, code)| {
            write_whole(folder.join(name), |out| out.write_all(code.as_bytes()))
        })
    })?;
    Ok(format!("wrote {shown}: {} files", files.len()))
}

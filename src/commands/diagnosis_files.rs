//! What a diagnosis writes: its JSON, the rig file with what was found, and the code of what is named.

use std::path::Path;

use anyhow::ensure;
use serde_json::json;
use stretch_data::{DataSet, RigFile};
use stretch_files::{Outputs, write_whole};
use stretch_gap::Diagnosis;
use stretch_problem::{Fix, Implementation, NoFix};
use stretch_report::listed;
use stretch_sim::{Language, Quantity};

use super::shared::stage_text;

/// Refuses to write where something is read from.
pub(super) fn not_read(fix: &Path, data_set: &Path, rig: Option<&Path>) -> anyhow::Result<()> {
    let real = |path: &Path| path.canonicalize().ok();
    let own = DataSet::read(data_set).ok().and_then(|set| set.rig);
    let own = own.map(|file| data_set.join(file));
    let mut read = rig.into_iter().chain(own.as_deref()).chain([data_set]);
    let is_read = read.any(|path: &Path| real(path).is_some() && real(path) == real(fix));
    ensure!(
        !is_read,
        "{}: --fix would replace a file that is read; give it another name",
        fix.display()
    );
    Ok(())
}

/// Writes the rig file where there is something to write; says what it did.
pub(super) fn write_fix(
    outputs: &mut Outputs,
    path: &Path,
    fix: &Result<Fix, NoFix>,
    name: &str,
    seed: u64,
) -> anyhow::Result<String> {
    let shown = path.display();
    let mut fix = match fix {
        Err(why) => return Ok(format!("{shown} is not written: {why}")),
        Ok(fix) => fix.clone(),
    };
    let from =
        format!("Found by stretch {} diagnose {name}, seed {seed}.", env!("CARGO_PKG_VERSION"));
    fix.remarks.head.insert(0, from);
    let is_there = path.exists();
    stage_text(outputs, path, &fix.text())?;
    let effects: Vec<String> = fix.file.effects.iter().map(|e| e.name.clone()).collect();
    let with = if effects.is_empty() { "no effect".to_owned() } else { listed(&effects) };
    let replaced = if is_there { ", in place of the file that was there" } else { "" };
    Ok(format!("wrote {shown}: the rig re-tuned, with {with}{replaced}"))
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
            let name = format!("{}.{}", one.effect.name, language.ending());
            files.extend(one.code(language).map(|code| (name, code)));
        }
    }
    if files.is_empty() {
        return Ok(format!("{shown} is not written: no effect is named"));
    }
    outputs.folder(folder, false, |folder| {
        files.iter().try_for_each(|(name, code)| {
            write_whole(folder.join(name), |out| out.write_all(code.as_bytes()))
        })
    })?;
    Ok(format!("wrote {shown}: {} files", files.len()))
}

/// The diagnosis in its schema, with what it was made from, what is named as something to implement, and the rig file that comes of it.
pub(super) fn to_json(
    diagnosis: &Diagnosis,
    implement: Vec<serde_json::Value>,
    fixed_rig: Option<&RigFile>,
    name: &str,
    seed: u64,
) -> anyhow::Result<serde_json::Value> {
    let mut value = serde_json::to_value(diagnosis)?;
    value["implement"] = implement.into();
    value["fixed_rig"] = serde_json::to_value(fixed_rig)?;
    value["data_set"] = name.into();
    value["seed"] = seed.into();
    value["version"] = env!("CARGO_PKG_VERSION").into();
    Ok(value)
}

/// A named effect as something to implement.
pub(super) fn implement_json(one: &Implementation) -> serde_json::Value {
    let quantity = |q: &Quantity| json!({ "name": q.name, "unit": q.unit, "meaning": q.meaning });
    let sketch = one.sketch.as_ref();
    json!({
        "effect": one.effect.name,
        "words": one.effect.words,
        "stage": one.effect.stage.name(),
        "equation": one.effect.equation,
        "numbers": one.numbers,
        "inputs": sketch.map(|s| s.inputs.iter().map(quantity).collect::<Vec<_>>()),
        "output": sketch.map(|s| quantity(&s.output)),
        "state": sketch.and_then(stretch_sim::Sketch::initial_state),
    })
}

//! The rig's cases in the layout of an open set: the generator and its forms are those of the sealed check.

use std::{collections::BTreeMap, fs, path::Path};

use super::label::{Level, OpenLabel, OpenTruth};
use super::written::write;
use crate::{
    effect::Kind, error::BlindError, make::make, plan::Plan, protocol::Protocol, truth::CaseKind,
};

/// Excess below which a single effect is faint.
const FAINT: f64 = 1.0;

pub(super) fn make_rig(set: &Path, cases: usize, seed: u64) -> Result<OpenTruth, BlindError> {
    let each = cases / 5;
    let plan = Plan {
        single: cases - 3 * each,
        null: each,
        compound: each,
        out_of_catalogue: each,
        dominant: 0,
        struck: 0,
        excess: (0.1, 100.0),
        protocol: Protocol::Paper,
        ..Plan::of(0)
    };
    let seal = make(set, seed, &plan, &|_| ())?;
    let labels: crate::Truth = serde_json::from_str(
        &fs::read_to_string(seal.path()).map_err(BlindError::io(seal.path()))?,
    )
    .map_err(BlindError::json(seal.path()))?;
    // move these labels to the neighbouring folder
    let inside = set.join("sealed");
    fs::remove_dir_all(&inside).map_err(BlindError::io(&inside))?;
    let mut opened = BTreeMap::new();
    for (name, label) in labels.cases {
        let builtin =
            format!("name = {name:?}\n\n[simulator]\nbuiltin = \"rig\"\ndata_set = \".\"\n");
        write(&set.join(&name).join("problem.toml"), &builtin)?;
        let level = match label.kind {
            CaseKind::Null => Level::Nothing,
            CaseKind::OutOfCatalogue => Level::Foreign,
            CaseKind::Single if label.excess < FAINT => Level::Faint,
            CaseKind::Single => Level::Strong,
            _ => Level::Two,
        };
        let truth = OpenLabel {
            level,
            effects: label.effects,
            places: label.stages.iter().map(|s| s.name().to_owned()).collect(),
            excess: label.excess,
            oracle_closed: if level == Level::Nothing { 0.0 } else { 1.0 },
            family: label.family.name().to_owned(),
            strengths: label.acting.iter().map(|a| a.strength).collect(),
            forms: Vec::new(),
            parameters: label.parameters,
        };
        opened.insert(name, truth);
    }
    let known = Kind::catalogued().iter().map(|kind| kind.spec());
    let candidates = known.map(|s| (s.name.to_owned(), s.stage.name().to_owned())).collect();
    Ok(OpenTruth { schema: 1, plant: "rig".to_owned(), seed, candidates, cases: opened })
}

//! LeRobot data sets: Parquet tables of episodes. The file `meta/info.json` describes their columns.

use std::{io::Read, path::Path};

use serde_json::Value;

use stretch_data::{Channel, files::open_input};

use crate::grid::Track;

/// Column with the number of the episode of each row.
const EPISODE: &str = "episode_index";
/// Largest size of a description that is read, bytes.
const LONGEST: u64 = 16 << 20;

/// Renames list items as the description of the data set names them: `action.0` becomes `action.elbow.pos`. The items
/// of a file outside a data set keep their numbers.
pub(crate) fn name(file: &Path, channels: &mut [Channel]) {
    let Some(features) = features(file) else { return };
    for channel in channels {
        let Some((feature, item)) = channel.name.rsplit_once('.') else { continue };
        let Some(names) = features.get(feature).and_then(|f| listed(f.get("names")?)) else {
            continue;
        };
        let own = item.parse::<usize>().ok().and_then(|item| names.get(item)?.as_str());
        if let Some(own) = own {
            channel.name = format!("{feature}.{own}");
        }
    }
}

/// Reads the description of the columns from `meta/info.json`, in the folder that contains
/// `data/chunk-000/file.parquet`.
fn features(file: &Path) -> Option<Value> {
    let root = file.ancestors().nth(3)?;
    let mut text = String::new();
    let info = open_input(root.join("meta").join("info.json")).ok()?;
    info.take(LONGEST).read_to_string(&mut text).ok()?;
    let mut info: Value = serde_json::from_str(&text).ok()?;
    info.get_mut("features").map(Value::take)
}

/// Returns the names of the items: a list, or a list under a key such as `motors`.
fn listed(names: &Value) -> Option<&Vec<Value>> {
    names.as_array().or_else(|| match names.as_object()?.values().next() {
        Some(Value::Array(names)) => Some(names),
        _ => None,
    })
}

/// Keeps one episode of a table: the requested one, or else the episode of the first row.
pub(crate) fn episode(
    mut track: Track,
    asked: Option<u32>,
    notes: &mut Vec<String>,
) -> Result<Track, String> {
    let Some(of) = track.channels.iter().find(|c| c.name == EPISODE).map(|c| c.values.clone())
    else {
        return match asked {
            Some(_) => Err(format!(
                "there is no column {EPISODE}; remove the # and the number from the file's name"
            )),
            None => Ok(track),
        };
    };
    let finite = || of.iter().copied().filter(|e| e.is_finite());
    let (low, high) = (finite().fold(f64::INFINITY, f64::min), finite().fold(0.0, f64::max));
    let wanted = asked.map_or(of[0], f64::from);
    if !of.contains(&wanted) {
        return Err(format!("there is no episode {wanted} in it; it holds {low} to {high}"));
    }
    if high > low && asked.is_none() {
        notes.push(format!(
            "it holds the episodes {low} to {high}, and {wanted} is read; FILE#{high} reads another"
        ));
    }
    let others: Vec<usize> = (0..of.len()).filter(|i| of[*i] != wanted).collect();
    track.remove(&others);
    Ok(track)
}

//! HDF5, and with it MATLAB's files of version 7.3: every data set of numbers in every group.

use hdf5_pure::{File, Group};

use crate::{
    ReadOptions, RecordingError,
    arrays::{Array, beside, tracks},
    grid::{Track, listed, note},
    room::Room,
};

/// Groups within groups.
const DEEPEST: usize = 16;
/// Where MATLAB keeps what nobody asked for.
const INTERNAL: &str = "#";

/// Reads a file's data sets.
pub(crate) fn read(
    (bytes, room): (Vec<u8>, Room),
    file: &str,
    options: &ReadOptions,
) -> Result<(Vec<Track>, Vec<String>), RecordingError> {
    let fail = |problem| RecordingError::Format { file: file.to_owned(), format: "HDF5", problem };
    let broken = |e: hdf5_pure::Error| fail(format!("{e}; write it again, or export it as CSV"));
    let opened = File::from_bytes(bytes).map_err(broken)?;
    let mut found = Found { room, arrays: Vec::new(), other: Vec::new(), full: None };
    found.group(&opened.root(), "", 0).map_err(broken)?;
    if let Some(full) = found.full.take() {
        return Err(fail(full));
    }
    if found.arrays.is_empty() {
        let told = match &found.other[..] {
            [] => "nothing".to_owned(),
            other => listed(other),
        };
        return Err(fail(format!("there is no data set of numbers in it, but {told}")));
    }
    let mut notes = Vec::new();
    note(&mut notes, "left out", &found.other);
    beside(&found.arrays, &mut found.room).map_err(fail)?;
    tracks(file, found.arrays, notes, options)
}

struct Found {
    arrays: Vec<Array>,
    other: Vec<String>,
    room: Room,
    /// Why no more is taken: the room is used up.
    full: Option<String>,
}

impl Found {
    fn group(&mut self, group: &Group, path: &str, depth: usize) -> Result<(), hdf5_pure::Error> {
        for name in group.datasets()? {
            let full = format!("{path}{name}");
            // what a data set says of its shape is known before its values are unpacked
            let shape = group.dataset(&name)?.shape().unwrap_or_default();
            let count = shape
                .iter()
                .fold(1_usize, |n, m| n.saturating_mul(usize::try_from(*m).unwrap_or(usize::MAX)));
            // the unpacked chunk and the bytes of all chunks stand beside the numbers until those are made
            if let Err(no_room) = self.room.take_numbers(count.saturating_mul(3)) {
                self.full = Some(format!("{full}: {no_room}"));
                return Ok(());
            }
            self.room.give_back(2 * count * size_of::<f64>());
            match array(group, &name, &full) {
                Ok(array) => self.arrays.push(array),
                Err(e) => self.other.push(format!("{full} ({e})")),
            }
        }
        if depth < DEEPEST {
            for name in group.groups()? {
                if !name.starts_with(INTERNAL) {
                    self.group(&group.group(&name)?, &format!("{path}{name}/"), depth + 1)?;
                }
            }
        }
        Ok(())
    }
}

fn array(group: &Group, name: &str, full: &str) -> Result<Array, hdf5_pure::Error> {
    let set = group.dataset(name)?;
    let values = set.read_f64()?;
    let shape: Vec<usize> = set.shape()?.into_iter().map(|n| n as usize).collect();
    // A shape that does not go with the values is none.
    let whole = shape.iter().try_fold(1_usize, |n, &m| n.checked_mul(m)) == Some(values.len());
    let shape = if whole { shape } else { vec![values.len()] };
    Ok(Array { name: full.to_owned(), shape, values })
}

//! Parquet: a table whose columns are numbers, time stamps, or lists of numbers of equal length. LeRobot data sets are
//! such tables.

mod column;
mod lerobot;

use std::path::Path;

use ::parquet::{
    errors::ParquetError,
    file::reader::{FileReader, SerializedFileReader},
};
use bytes::Bytes;

use stretch_data::Channel;

use crate::{
    ReadOptions, RecordingError,
    clock::{Rows, Stamps, note_on_rate, time_among},
    grid::{Track, note},
    parquet::column::{Refused, stamp_counts},
    room::Room,
};

/// Reads the columns of a file. Missing values are NaN.
pub(crate) fn read(
    (bytes, mut room): (Vec<u8>, Room),
    file: &str,
    options: &ReadOptions,
) -> Result<(Vec<Track>, Vec<String>), RecordingError> {
    let fail = |problem: String| RecordingError::format(file, "Parquet", problem);
    let broken = |e: ParquetError| fail(format!("{e}; write it again, or export it as CSV"));
    let reader = SerializedFileReader::new(Bytes::from(bytes)).map_err(broken)?;
    let schema = reader.metadata().file_metadata().schema_descr_ptr();
    let rows = usize::try_from(reader.metadata().file_metadata().num_rows()).unwrap_or(0);
    room.take_time(rows).map_err(fail)?;
    let (mut channels, mut stamps, mut other) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..schema.num_columns() {
        let descriptor = schema.column(i);
        match column::read(&reader, i, rows, &mut room) {
            Ok(own) => {
                let is_one = own.len() == 1;
                let counts = stamp_counts(&descriptor).filter(|_| is_one);
                stamps.extend(own.iter().map(|_| counts));
                channels.extend(own);
            }
            Err(Refused::LeftOut(why)) => {
                other.push(format!("{} ({why})", descriptor.path().string()));
            }
            Err(Refused::File(why)) => return Err(fail(why)),
            Err(Refused::Damaged(why)) => return Err(broken(why)),
        }
    }
    let mut notes = Vec::new();
    note(&mut notes, "left out", &other);
    lerobot::name(Path::new(file), &mut channels);
    let track = on_its_clock(file, channels, &stamps, options, &mut notes)?;
    if track.stamps.counts.is_empty() {
        return Err(RecordingError::header_only(file));
    }
    let track = lerobot::episode(track, options.episode, &mut notes).map_err(fail)?;
    Ok((vec![track], notes))
}

/// Creates a track from channels, one of which is the time.
fn on_its_clock(
    file: &str,
    mut channels: Vec<Channel>,
    stamps: &[Option<f64>],
    options: &ReadOptions,
    notes: &mut Vec<String>,
) -> Result<Track, RecordingError> {
    let names: Vec<String> = channels.iter().map(|c| c.name.clone()).collect();
    let time = time_among(&names, options);
    if let Some(rate_hz) = options.sample_rate_hz {
        notes.push(note_on_rate(time.map(|i| &*names[i]), rate_hz, "as given by the option"));
        let time = time.map(|i| channels.remove(i));
        let rows = channels.first().or(time.as_ref()).map_or(0, |c| c.values.len());
        return Ok(Track::new(Stamps::at_rate(rows, rate_hz), channels));
    }
    let Some(time) = time else {
        return Err(RecordingError::missing_time(file, &options.time, &names));
    };
    let Channel { name, values: counts } = channels.remove(time);
    if name != options.time {
        notes.push(format!("the time is column {name}"));
    }
    let (per_second, rows) = (stamps[time], Rows::counted(counts.len()));
    Ok(Track::new(Stamps { name, counts, origin: 0.0, per_second, rows }, channels))
}

//! Named arrays, as NPZ, MAT and HDF5 hold them: which of them are clocks, and whose.

#[cfg(feature = "hdf5")]
pub(crate) mod hdf5;
#[cfg(feature = "mat")]
pub(crate) mod mat;
#[cfg(feature = "npz")]
pub(crate) mod npy;

use stretch_data::Channel;

use crate::{
    ReadOptions, RecordingError, TimeUnit,
    grid::{Track, listed, note},
    names::{clock_of, time_rank},
    options::TIME,
    room::Room,
};

/// Blocks in which a matrix is taken apart.
const BLOCKS: usize = 32;

/// Columns of one array that are taken.
const MOST_COLUMNS: usize = 64;

/// One array of numbers, the last index running fastest.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Array {
    /// Path within the file.
    pub(crate) name: String,
    /// Lengths, the slowest index first.
    pub(crate) shape: Vec<usize>,
    pub(crate) values: Vec<f64>,
}

impl Array {
    /// Rows and columns; none where it has more than two lengths above 1, or no values: beside a length of 0 any other may be told.
    fn matrix(&self) -> Option<(usize, usize)> {
        if self.values.is_empty() {
            return None;
        }
        let long: Vec<usize> = self.shape.iter().copied().filter(|&n| n != 1).collect();
        match (long[..].len(), &self.shape[..]) {
            (0, _) => Some((1, 1)),
            (1, _) => Some((long[0], 1)),
            (2, _) => Some((long[0], long[1])),
            _ => None,
        }
    }

    /// Number of its columns over `samples` instants, whichever way it lies, and the steps to the next sample and to the next column;
    /// none where it has another length.
    fn layout(&self, samples: usize) -> Option<(usize, usize, usize)> {
        let (rows, columns) = self.matrix()?;
        let (count, step, next) = match (rows == samples, columns == samples) {
            (true, _) => (columns, columns, 1),
            (_, true) => (rows, 1, columns),
            _ => return None,
        };
        (count <= MOST_COLUMNS).then_some((count, step, next))
    }

    /// Its columns over `samples` instants; none where it has another length.
    ///
    /// Rows are moved from the last to the first, block by block, and what was moved is given back: beside the array itself there is never
    /// more than a block.
    fn into_columns(mut self, samples: usize) -> Option<Vec<Channel>> {
        let (count, step, next) = self.layout(samples)?;
        if count == 1 {
            return Some(vec![Channel { name: self.name, values: self.values }]);
        }
        let mut columns = vec![Vec::new(); count];
        if next == 1 {
            // a row behind the other
            let block = samples.div_ceil(BLOCKS);
            let mut left = samples;
            while left > 0 {
                let from = left.saturating_sub(block);
                for (i, column) in columns.iter_mut().enumerate() {
                    column.reserve_exact(left - from);
                    column.extend((from..left).rev().map(|k| self.values[k * step + i]));
                }
                self.values.truncate(from * step);
                self.values.shrink_to_fit();
                left = from;
            }
            columns.iter_mut().for_each(|column| column.reverse());
        } else {
            // a column behind the other
            for (i, column) in columns.iter_mut().enumerate().rev() {
                *column = self.values.split_off(i * next);
                self.values.shrink_to_fit();
            }
        }
        let named = |(i, values)| Channel { name: format!("{}.{i}", self.name), values };
        Some(columns.into_iter().enumerate().map(named).collect())
    }
}

/// Takes room for the time that the longest of some arrays will have.
pub(crate) fn beside(arrays: &[Array], room: &mut Room) -> Result<(), String> {
    let lengths = arrays.iter().filter_map(Array::matrix).map(|(rows, columns)| rows.max(columns));
    room.take_time(lengths.max().unwrap_or(0))
}

/// A clock among the arrays.
struct ClockArray {
    array: Array,
    /// The group that it is the clock of.
    of: String,
}

/// Gives each array to the clock that it runs on.
pub(crate) fn tracks(
    file: &str,
    arrays: Vec<Array>,
    mut notes: Vec<String>,
    options: &ReadOptions,
) -> Result<(Vec<Track>, Vec<String>), RecordingError> {
    let found: Vec<_> = arrays.iter().map(|array| clock(array, options)).collect();
    // One that does not rise is a clock only by its name, and told as one where there is no other.
    let one_rises = found.iter().flatten().any(|(_, rises)| *rises);
    let (mut clocks, mut others) = (Vec::new(), Vec::new());
    for (array, found) in arrays.into_iter().zip(found) {
        match found.filter(|(_, rises)| *rises || !one_rises) {
            Some((of, _)) => clocks.push(ClockArray { array, of }),
            None => others.push(array),
        }
    }
    if clocks.is_empty() {
        return counted(file, others, notes, options);
    }
    let mut channels: Vec<Vec<Channel>> = clocks.iter().map(|_| Vec::new()).collect();
    let mut left_out = Vec::new();
    for array in others {
        let Some(i) = on(&array, &clocks) else {
            left_out.push(array.name);
            continue;
        };
        channels[i].extend(array.into_columns(clocks[i].array.values.len()).into_iter().flatten());
    }
    note(&mut notes, "left out, no clock has their length or two clocks have", &left_out);
    let track = |(clock, channels): (ClockArray, _)| Track {
        per_second: options.divisor(&clock.array.name),
        clock: clock.array.name,
        counts: clock.array.values,
        channels,
    };
    Ok((clocks.into_iter().zip(channels).map(track).collect(), notes))
}

/// What the array is the clock of and whether it rises, if it can be a clock: named so, of one dimension, and rising.
fn clock(array: &Array, options: &ReadOptions) -> Option<(String, bool)> {
    let (samples, 1) = array.matrix()? else { return None };
    let last = array.name.rsplit(['/', '.']).next().unwrap_or_default();
    let wanted = options.time.as_str();
    let of = if array.name == wanted || last == wanted {
        array.name.rsplit_once(['/', '.']).map_or(String::new(), |(group, _)| group.to_owned())
    } else if wanted == TIME {
        clock_of(&array.name)?
    } else {
        return None;
    };
    let rises = array.values.windows(2).all(|t| t[1] > t[0]);
    let is_named = array.name == wanted || last == wanted || time_rank(last).is_some();
    (samples > 1 && (rises || is_named)).then_some((of, rises))
}

/// The clock of an array: of its length, and by its name the nearest; none where two are as near.
fn on(array: &Array, clocks: &[ClockArray]) -> Option<usize> {
    let fits = clocks.iter().enumerate().filter_map(|(i, clock)| {
        array.layout(clock.array.values.len())?;
        Some((nearness(&array.name, &clock.of), i))
    });
    let mut fits: Vec<_> = fits.collect();
    fits.sort_by_key(|(near, _)| std::cmp::Reverse(*near));
    match &fits[..] {
        [first, second, ..] if first.0 == second.0 => {
            let (a, b) = (&clocks[first.1].array, &clocks[second.1].array);
            (a.values == b.values).then_some(first.1)
        }
        [first, ..] => Some(first.1),
        [] => None,
    }
}

/// How much a name says that it runs on the clock of `of`: its letters, if it is in that group or named after it.
fn nearness(name: &str, of: &str) -> usize {
    let path = name.to_lowercase().replace('.', "/");
    let of = of.to_lowercase().replace('.', "/");
    let parts = path.split(['/', '_']);
    match () {
        () if of.is_empty() => 1,
        () if path.starts_with(&format!("{of}/")) || path.starts_with(&format!("{of}_")) => {
            1 + of.len()
        }
        () if parts.into_iter().any(|part| part == of) => 1 + of.len(),
        () => 0,
    }
}

/// Arrays without a clock, at a rate that the file or somebody says.
fn counted(
    file: &str,
    others: Vec<Array>,
    mut notes: Vec<String>,
    options: &ReadOptions,
) -> Result<(Vec<Track>, Vec<String>), RecordingError> {
    let scalar = |names: &[&str]| {
        others.iter().find_map(|a| match a.values[..] {
            [value] if names.contains(&a.name.to_lowercase().as_str()) => Some(value),
            _ => None,
        })
    };
    let own = scalar(&["fs", "fs_hz", "rate_hz", "sample_rate", "sample_rate_hz", "sampling_rate"])
        .or_else(|| scalar(&["dt", "dt_s", "ts", "sample_time"]).map(|dt| 1.0 / dt));
    let samples = others.iter().filter_map(Array::matrix).map(|(r, c)| r.max(c)).max();
    let (Some(rate_hz), Some(samples)) = (options.sample_rate_hz.or(own), samples) else {
        let names: Vec<&str> = others.iter().map(|a| a.name.as_str()).collect();
        let hint = format!(
            "save it as an array {} beside the others ({}), or say --sample-rate",
            &options.time,
            listed(&names)
        );
        return Err(RecordingError::NoTime { file: file.to_owned(), hint });
    };
    let said = if options.sample_rate_hz.is_some() { "was said" } else { "the file says" };
    notes.push(format!("there is no time: {rate_hz} samples a second, as {said}"));
    let per_second = options.time_unit.unwrap_or(TimeUnit::Seconds).per_second();
    let channels = others.into_iter().filter(|a| a.values.len() > 1);
    let channels = channels.filter_map(|a| a.into_columns(samples));
    let channels = channels.flatten().collect();
    let counts = (0..samples).map(|i| i as f64 / rate_hz * per_second).collect();
    Ok((vec![Track { clock: TIME.to_owned(), counts, per_second, channels }], notes))
}

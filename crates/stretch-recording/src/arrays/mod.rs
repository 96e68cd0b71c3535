//! Named arrays, as an NPZ file contains them or as the Python package converts them from other formats. This module
//! decides which arrays are clocks (arrays of sample times) and which clock each other array belongs to.

pub(crate) mod npy;

use stretch_data::Channel;

use crate::{
    ReadOptions, Recording, RecordingError,
    clock::{self, Rows, Stamps, note_on_rate},
    grid::{Track, listed, merged, note},
    names::{clock_of, time_rank},
    options::TIME,
    room::Room,
    text::bad_rows::BadRows,
};

/// Number of blocks of rows in which a matrix is split into columns.
const BLOCKS: usize = 32;

/// Largest number of columns of one array. An array with more columns is left out.
const MOST_COLUMNS: usize = 64;

/// An array of at most this length is taken for a date or a time of day, and not for a clock, if there is a clock that
/// is `MUCH_LONGER` times as long.
const DATE: usize = 3;
/// Smallest ratio of the length of a clock to the length of an array of `DATE` or fewer values, for which the array is
/// a date.
const MUCH_LONGER: usize = 10;

/// One array of numbers, stored so that the last index varies fastest.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Array {
    /// Path within the file, with `/` or `.` between its parts.
    pub name: String,
    /// Length of each dimension, that of the slowest index first.
    pub shape: Vec<usize>,
    /// Elements, as many as the product of the lengths in `shape`.
    pub values: Vec<f64>,
}

/// Channels that were recorded at the same instants.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Clock {
    /// Name of the array of sample times.
    pub name: String,
    /// Sample times, s.
    pub time_s: Vec<f64>,
    /// One value for each sample time, NaN if there is none.
    pub channels: Vec<Channel>,
}

impl Recording {
    /// Reads named arrays in the same way as those of an NPZ file. Returns the recording, with all channels on one
    /// clock, and the clocks as they were recorded, with their channels.
    ///
    /// # Errors
    /// The errors of [`Recording::read`] for an NPZ file, and an error if the shape of an array does not match its
    /// number of values.
    ///
    /// ```
    /// use stretch_recording::{Array, ReadOptions, Recording};
    /// let array = |name: &str, values: &[f64]| Array {
    ///     name: name.into(),
    ///     shape: vec![values.len()],
    ///     values: values.into(),
    /// };
    /// let arrays = vec![
    ///     array("gauge.time_s", &[0.0, 0.1, 0.2]),
    ///     array("gauge.bridge_v", &[1.5, 1.6, 1.7]),
    ///     array("valve.time_s", &[0.0, 0.2]),
    ///     array("valve.pressure_kpa", &[100.0, 120.0]),
    /// ];
    /// let (recording, clocks) =
    ///     Recording::from_arrays("run.mcap", arrays, Vec::new(), &ReadOptions::new())?;
    /// assert_eq!(clocks.len(), 2);
    /// assert_eq!(recording.trial.require("pressure_kpa")?, [100.0, 110.0, 120.0]);
    /// # Ok::<(), stretch_recording::RecordingError>(())
    /// ```
    pub fn from_arrays(
        name: &str,
        arrays: Vec<Array>,
        notes: Vec<String>,
        options: &ReadOptions,
    ) -> Result<(Self, Vec<Clock>), RecordingError> {
        let unfit = |a: &&Array| a.shape.iter().product::<usize>() != a.values.len();
        if let Some(Array { name: array, shape, .. }) = arrays.iter().find(unfit) {
            let problem =
                format!("the number of values of array {array} does not match its shape {shape:?}");
            return Err(RecordingError::format(name, "array", problem));
        }
        let (tracks, notes) = tracks(name, arrays, notes, options)?;
        let clocks = tracks.iter().map(|track| {
            let mut read = track.clone();
            // A clock that cannot be read is returned as recorded. If the recording needs this clock, `merged` returns
            // the error.
            if clock::read(name, &mut read, options, &mut Vec::new()).is_err() {
                read = track.clone();
            }
            let Stamps { name, counts, per_second, .. } = read.stamps;
            let per_second = per_second.unwrap_or_else(|| options.divisor(&name));
            let time_s = counts.iter().map(|count| count / per_second).collect();
            Clock { name, time_s, channels: read.channels }
        });
        let clocks = clocks.collect();
        let recording = merged(name, tracks, notes, options)?;
        Ok((recording, clocks))
    }
}

impl Array {
    /// Returns the number of rows and columns, without dimensions of length 1. Returns `None` if more than two
    /// dimensions remain. Also returns `None` for an empty array: if one dimension has length 0, the others can have
    /// any length.
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

    /// Returns the number of columns of `samples` values, and the steps in memory to the next sample and to the next
    /// column. Samples may run along either dimension. Returns `None` if neither dimension has this length or if there
    /// are too many columns.
    fn layout(&self, samples: usize) -> Option<(usize, usize, usize)> {
        let (rows, columns) = self.matrix()?;
        let (count, step, next) = match (rows == samples, columns == samples) {
            (true, _) => (columns, columns, 1),
            (_, true) => (rows, 1, columns),
            _ => return None,
        };
        (count <= MOST_COLUMNS).then_some((count, step, next))
    }

    /// Splits the array into columns of `samples` values. Returns `None` if no dimension has this length or if there
    /// are too many columns.
    ///
    /// Blocks of rows are moved from the last to the first, and the memory of each moved block is released. The peak
    /// memory is therefore that of the array and one block.
    fn into_columns(mut self, samples: usize) -> Option<Vec<Channel>> {
        let (count, step, next) = self.layout(samples)?;
        if count == 1 {
            return Some(vec![Channel { name: self.name, values: self.values }]);
        }
        let mut columns = vec![Vec::new(); count];
        if next == 1 {
            // The values of one row are contiguous.
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
            // The values of one column are contiguous.
            for (i, column) in columns.iter_mut().enumerate().rev() {
                *column = self.values.split_off(i * next);
                self.values.shrink_to_fit();
            }
        }
        let named = |(i, values)| Channel { name: format!("{}.{i}", self.name), values };
        Some(columns.into_iter().enumerate().map(named).collect())
    }
}

/// Reserves memory in `room` for the time of the longest array.
pub(crate) fn beside(arrays: &[Array], room: &mut Room) -> Result<(), String> {
    let lengths = arrays.iter().filter_map(Array::matrix).map(|(rows, columns)| rows.max(columns));
    room.take_time(lengths.max().unwrap_or(0))
}

/// An array that may be a clock.
#[derive(Debug, Clone)]
struct Candidate {
    /// Name of the group of arrays that the clock belongs to. It can be empty.
    of: String,
    /// Rank of the array's name among the usual names of a time. 0 is the likeliest.
    rank: usize,
    rises: bool,
}

/// An array that is a clock, and the group that it belongs to.
struct ClockArray {
    array: Array,
    of: String,
}

/// Assigns each array to its clock. Returns one track (channels on one clock) per clock, and notes.
pub(crate) fn tracks(
    file: &str,
    arrays: Vec<Array>,
    mut notes: Vec<String>,
    options: &ReadOptions,
) -> Result<(Vec<Track>, Vec<String>), RecordingError> {
    let found: Vec<_> = arrays.iter().map(|array| candidate(array, options)).collect();
    let are_clocks = choose(&arrays, &found);
    let (mut clocks, mut others) = (Vec::new(), Vec::new());
    for ((array, found), is_clock) in arrays.into_iter().zip(found).zip(are_clocks) {
        match found.filter(|_| is_clock) {
            Some(Candidate { of, .. }) => clocks.push(ClockArray { array, of }),
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
    note(
        &mut notes,
        "left out, because no time array or more than one has their length",
        &left_out,
    );
    if let Some(rate_hz) = options.sample_rate_hz {
        let [ClockArray { array, .. }] = &clocks[..] else {
            let names: Vec<&str> = clocks.iter().map(|clock| clock.array.name.as_str()).collect();
            let problem = format!(
                "one rate is given for several time arrays ({}); name one with --time, or give no rate",
                listed(&names)
            );
            return Err(RecordingError::format(file, "array", problem));
        };
        notes.push(note_on_rate(Some(&array.name), rate_hz, "as given by the option"));
        let stamps = Stamps::at_rate(array.values.len(), rate_hz);
        return Ok((vec![Track::new(stamps, channels.remove(0))], notes));
    }
    let track = |(clock, channels): (ClockArray, _)| {
        let Array { name, values: counts, .. } = clock.array;
        let rows = Rows::counted(counts.len());
        Track::new(Stamps { name, counts, origin: 0.0, per_second: None, rows }, channels)
    };
    Ok((clocks.into_iter().zip(channels).map(track).collect(), notes))
}

/// Returns the array as a candidate if it may be a clock: it has one dimension, more than one value and a suitable
/// name, and it rises or its name is usual for a time.
fn candidate(array: &Array, options: &ReadOptions) -> Option<Candidate> {
    let (samples, 1) = array.matrix()? else { return None };
    let (group, last) = parts(&array.name);
    let wanted = options.time.as_str();
    let is_wanted = array.name == wanted || last == wanted;
    let of = match is_wanted {
        true => group.to_owned(),
        false if wanted == TIME || options.may_lack_time => clock_of(&array.name)?,
        false => return None,
    };
    let rank = if is_wanted { Some(0) } else { time_rank(last).map(|rank| rank + 1) };
    // Some steps back are allowed, because a clock may roll over, repeat stamps or begin with an outdated stamp.
    let back = array.values.windows(2).filter(|t| t[1] < t[0]).count();
    let rises =
        BadRows::are_few(back, samples) && array.values.iter().any(|t| *t != array.values[0]);
    (samples > 1 && (rises || rank.is_some())).then_some(Candidate {
        of,
        rank: rank.unwrap_or(usize::MAX),
        rises,
    })
}

/// Decides which of the candidates are clocks.
fn choose(arrays: &[Array], found: &[Option<Candidate>]) -> Vec<bool> {
    let all = || arrays.iter().zip(found).filter_map(|(a, found)| Some((a, found.as_ref()?)));
    // A candidate that does not rise has only the name of a clock. It is accepted if no candidate rises; the error then
    // names this array.
    let one_rises = all().any(|(_, found)| found.rises);
    let longest = all().filter(|(_, c)| c.rises).map(|(a, _)| a.values.len()).max().unwrap_or(0);
    let is_clock = |array: &Array, own: &Candidate| {
        let samples = array.values.len();
        let is_date = samples <= DATE && longest >= MUCH_LONGER * samples;
        let (group, _) = parts(&array.name);
        // An array of times is a channel if its group has a clock of the same length with a likelier name, such as
        // `time_s`.
        let has_better = all().any(|(other, better)| {
            let is_same = better.of == own.of || (!group.is_empty() && group == better.of);
            let is_likelier = better.rank < own.rank && (better.rises || !own.rises);
            is_same && is_likelier && other.values.len() == samples
        });
        (own.rises || !one_rises) && !is_date && !has_better
    };
    let pairs = arrays.iter().zip(found);
    pairs.map(|(array, own)| own.as_ref().is_some_and(|own| is_clock(array, own))).collect()
}

/// Splits a path into its group and its last part.
fn parts(path: &str) -> (&str, &str) {
    path.rsplit_once(['/', '.']).unwrap_or(("", path))
}

/// Returns the index of the clock that has the length of the array and the best-matching name. Returns `None` if no
/// clock fits, or if two clocks match equally well and have different times.
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

/// Rates how well the name of an array matches the group of a clock, whose name is `of`: 1 if `of` is empty, 1 plus the
/// length of `of` if the array is in the group or named after it, and 0 otherwise.
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

/// Gives a clock of constant rate to arrays that have no clock. The rate comes from the option, or else from a scalar
/// in the file.
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
        let problem = format!(
            "there is no time; save it as an array {} together with the others ({}), or give its rate with --time 100hz",
            &options.time,
            listed(&names)
        );
        return Err(RecordingError::unusable(file, problem));
    };
    let said = if options.sample_rate_hz.is_some() {
        "as given by the option"
    } else {
        "as given in the file"
    };
    notes.push(note_on_rate(None, rate_hz, said));
    let channels = others.into_iter().filter(|a| a.values.len() > 1);
    let channels = channels.filter_map(|a| a.into_columns(samples));
    let channels = channels.flatten().collect();
    Ok((vec![Track::new(Stamps::at_rate(samples, rate_hz), channels)], notes))
}

//! Determines which column is the time, which unit it has, and when each row was recorded.
//!
//! Every reader passes its time column to [`read`]; a live stream uses [`live::LiveClock`]. Repairs and rows that are
//! left out are counted in a note. An ambiguous time is an error that names the option to use.

pub(crate) mod live;
mod order;
mod spread;
pub(crate) mod unit;

use stretch_data::{Place, column_meant, out_of_order};

use crate::{
    ReadOptions, RecordingError,
    grid::Track,
    names::{are_a_stamp, may_be_time, time_rank},
    options::TIME,
    stamps::date,
    text::bad_rows::BadRows,
};

/// Smallest time, s, that is taken for seconds since 1970. It is about three years, and no recorder runs that long.
pub(crate) const EPOCH_S: f64 = 1e8;
/// Longest step, in sample periods, that does not count as a gap and is accepted where a clock rolls over. A live
/// receptor bridges three lost samples, which is a step of four periods.
pub(crate) const BRIDGED: f64 = 4.5;

/// A column of time as it was recorded.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Stamps {
    /// Name of the column.
    pub(crate) name: String,
    /// Recorded values minus `origin`.
    pub(crate) counts: Vec<f64>,
    /// Recorded value at which `counts` is 0.
    pub(crate) origin: f64,
    /// Counts per second, if the format defines them or the samples are counted.
    pub(crate) per_second: Option<f64>,
    /// Where each count is in the file.
    pub(crate) rows: Rows,
}

/// Row numbers of the samples, in the order in which they were read. Consecutive rows form a run: `begins` holds the
/// first sample of each run and its row.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Rows {
    begins: Vec<(usize, u64)>,
    count: usize,
    next: u64,
}

impl Rows {
    /// Creates `count` rows, the first of which is row 1.
    pub(crate) fn counted(count: usize) -> Self {
        Self { begins: vec![(0, 1)], count, next: count as u64 + 1 }
    }

    #[inline]
    pub(crate) fn push(&mut self, row: u64) {
        if row != self.next || self.count == 0 {
            self.begins.push((self.count, row));
        }
        (self.count, self.next) = (self.count + 1, row + 1);
    }

    /// The row of the file from which sample `index` was read.
    pub(crate) fn row(&self, index: usize) -> u64 {
        let after = self.begins.partition_point(|(begin, _)| *begin <= index);
        let (begin, row) = after.checked_sub(1).map_or((0, 1), |i| self.begins[i]);
        row + (index - begin) as u64
    }

    /// The rows of some of the samples.
    pub(crate) fn of(&self, samples: impl Iterator<Item = usize>) -> Self {
        let mut rows = Self::default();
        samples.for_each(|i| rows.push(self.row(i)));
        rows
    }
}

impl Stamps {
    /// Creates the time of `count` samples at a constant rate.
    pub(crate) fn at_rate(count: usize, rate_hz: f64) -> Self {
        Self {
            name: TIME.to_owned(),
            counts: (0..count).map(|i| i as f64).collect(),
            origin: 0.0,
            per_second: Some(rate_hz),
            rows: Rows::counted(count),
        }
    }

    fn place(&self, file: &str, index: usize) -> Place {
        Place { file: file.to_owned(), row: self.rows.row(index), column: self.name.clone() }
    }

    /// The stamp of a sample as it was recorded.
    fn recorded(&self, index: usize) -> f64 {
        self.origin + self.counts[index]
    }
}

/// Statistics of the steps from one stamp to the next, in counts.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Steps {
    /// Median positive step.
    tick: f64,
    /// Mean step from sample to sample without gaps. It is shorter than `tick` if stamps repeat.
    sample: f64,
    /// Number of steps that are zero, and number of steps that go back.
    repeated: usize,
    back: usize,
}

impl Steps {
    /// Returns `None` if no step is positive.
    fn of(counts: &[f64]) -> Option<Self> {
        let mut rising = Vec::with_capacity(counts.len());
        let (mut repeated, mut back) = (0, 0);
        for pair in counts.windows(2) {
            let step = pair[1] - pair[0];
            if step > 0.0 {
                rising.push(step);
            } else if step == 0.0 {
                repeated += 1;
            } else {
                back += 1;
            }
        }
        let (middle, count) = (rising.len() / 2, rising.len());
        if count == 0 {
            return None;
        }
        let tick = *rising.select_nth_unstable_by(middle, f64::total_cmp).1;
        let sample = tick * count as f64 / (count + repeated) as f64;
        tick.is_finite().then_some(Self { tick, sample, repeated, back })
    }
}

/// Returns the index of the time among column names. The time has the requested name or, if none was requested, a name
/// that is usual for a time.
pub(crate) fn time_among(names: &[String], options: &ReadOptions) -> Option<usize> {
    let wanted = &options.time;
    let usual = || {
        let ranked = names.iter().enumerate().filter_map(|(i, name)| Some((time_rank(name)?, i)));
        let stamp = || names.iter().position(|s| names.iter().any(|ns| are_a_stamp(s, ns)));
        ranked.min().map(|(_, i)| i).or_else(stamp)
    };
    // A name that only contains a word for time must be the only such name.
    let only = || {
        let mut may_be = names.iter().enumerate().filter(|(_, name)| may_be_time(name));
        may_be.next().filter(|_| may_be.next().is_none()).map(|(i, _)| i)
    };
    let guessed = || usual().or_else(|| options.sample_rate_hz.map_or_else(only, |_| None));
    let meant = || {
        let name = column_meant(wanted, names.iter().map(String::as_str))?;
        names.iter().position(|other| other == name)
    };
    names
        .iter()
        .position(|name| name == wanted)
        .or_else(|| if wanted == TIME { guessed() } else { meant() })
        .or_else(|| if options.may_lack_time { guessed() } else { None })
}

/// Returns the note that samples are counted and that a time column, if there is one, is not read. With a rate of 1, the
/// time is the number of the row.
pub(crate) fn note_on_rate(column: Option<&str>, rate_hz: f64, by: &str) -> String {
    let time = column
        .map_or("there is no time column".to_owned(), |name| format!("column {name} is not read"));
    if rate_hz == 1.0 {
        return format!("{time}: the rows are counted, without a rate per second, {by}");
    }
    format!("{time}: the time is computed from a rate of {rate_hz} Hz, {by}")
}

/// Returns the note that time is counted from the first sample, because the recorded time is a time of day or is
/// counted from a distant origin.
pub(crate) fn note_on_epoch(first_s: f64) -> String {
    if first_s.abs() < EPOCH_S {
        return "time counts from the first sample".to_owned();
    }
    format!("time counts from the first sample, {}", date(first_s))
}

/// Repairs the clock of a track (channels on one clock). Afterwards its counts increase, are free of roll-overs and
/// have a known unit.
///
/// # Errors
/// The unit is ambiguous, the sample rate is implausible, or too many rows have an impossible stamp.
pub(crate) fn read(
    file: &str,
    track: &mut Track,
    options: &ReadOptions,
    notes: &mut Vec<String>,
) -> Result<(), RecordingError> {
    notes.extend(add_nanoseconds(track));
    let not_finite = |i: &usize| !track.stamps.counts[*i].is_finite();
    let lost: Vec<usize> = (0..track.stamps.counts.len()).filter(not_finite).collect();
    leave_out(file, track, &lost, "is not a number", options, notes)?;
    let stamps = &mut track.stamps;
    let Some(mut steps) = Steps::of(&stamps.counts) else {
        return match stamps.counts[..] {
            [] | [_] => {
                stamps.per_second.get_or_insert(options.divisor(&stamps.name));
                Ok(())
            }
            _ => Err(never_rises(file, stamps)),
        };
    };
    let samples = stamps.counts.len();
    let per_second = unit::decide(file, stamps, steps, options, notes)?;
    stamps.per_second = Some(per_second);
    if steps.back > 0 {
        notes.extend(order::unroll(stamps, steps.tick, per_second));
        let stale = out_of_order(&stamps.counts);
        leave_out(file, track, &stale, "is not in order", options, notes)?;
    } else {
        let unset = order::before_the_clock_was_set(&stamps.counts, steps.tick);
        let what = "is long before the others";
        leave_out(file, track, &(0..unset).collect::<Vec<_>>(), what, options, notes)?;
    }
    // Compute the steps a second time only after a repair. Most recordings need none.
    if steps.back > 0 || track.stamps.counts.len() < samples {
        let anew = Steps::of(&track.stamps.counts);
        steps = anew.ok_or_else(|| never_rises(file, &track.stamps))?;
    }
    let copies = spread::spread(&mut track.stamps, steps, per_second, notes);
    leave_out(file, track, &copies, "repeats that of the row before", options, notes)?;
    unit::check_rate(file, &track.stamps, steps, options)
}

/// Adds a separate column of nanoseconds to the whole seconds, and returns a note.
fn add_nanoseconds(track: &mut Track) -> Option<String> {
    let Track { stamps, channels, .. } = track;
    let at = channels.iter().position(|c| are_a_stamp(&stamps.name, &c.name))?;
    let nanoseconds = channels.remove(at);
    // Subtract the first stamp first, so that no digits are lost.
    let first = stamps.counts.iter().copied().find(|count| count.is_finite())?;
    stamps.origin += first;
    for (count, ns) in stamps.counts.iter_mut().zip(&nanoseconds.values) {
        *count = *count - first + ns / 1e9;
    }
    stamps.per_second = Some(1.0);
    Some(format!("column {} is added to column {} to give the time", nanoseconds.name, stamps.name))
}

/// Leaves out rows with impossible stamps, and adds a note.
///
/// # Errors
/// There are too many rows with impossible stamps, or there is one and the option `strict` is set.
fn leave_out(
    file: &str,
    track: &mut Track,
    rows: &[usize],
    what: &str,
    options: &ReadOptions,
    notes: &mut Vec<String>,
) -> Result<(), RecordingError> {
    let [first, ..] = rows else { return Ok(()) };
    let (stamps, all) = (&track.stamps, track.stamps.counts.len());
    let (at, count) = (stamps.place(file, *first), rows.len());
    let evidence = format!("its time stamp {} {what}", stamps.recorded(*first));
    if options.strict || !BadRows::are_few(count, all) {
        let (at, evidence) = goes_back(file, stamps).unwrap_or((at, evidence));
        let why = match options.strict {
            true => "--strict leaves no row out".to_owned(),
            false => format!(
                "{count} of {all} rows have bad time stamps, and at most one in five may be left out; split the recording where its time begins again"
            ),
        };
        return Err(bad_stamps(&at, &format!("{evidence}: {why}")));
    }
    notes.push(match (count, goes_back(file, stamps)) {
        (1, _) => format!("row {} is left out: {evidence}", at.row),
        (_, Some((back, how))) => format!(
            "row {}: {how}; {count} rows are left out, the first of them row {}; if the file holds two recordings, split it",
            back.row, at.row
        ),
        _ => format!("{count} rows are left out, the first of them row {}: {evidence}", at.row),
    });
    track.remove(rows);
    Ok(())
}

/// Returns the place at which time goes back for the first time, and a description.
fn goes_back(file: &str, stamps: &Stamps) -> Option<(Place, String)> {
    let last = stamps.counts.windows(2).position(|t| t[1] < t[0])?;
    let (from, to) = (stamps.recorded(last), stamps.recorded(last + 1));
    Some((stamps.place(file, last + 1), format!("time goes back from {from} to {to}")))
}

/// Returns the error for stamps without a positive step.
fn never_rises(file: &str, stamps: &Stamps) -> RecordingError {
    let still =
        || (stamps.place(file, 1), format!("time does not advance at {}", stamps.recorded(1)));
    let (at, problem) = goes_back(file, stamps).unwrap_or_else(still);
    bad_stamps(&at, &problem)
}

fn bad_stamps(at: &Place, problem: &str) -> RecordingError {
    let problem = format!("{problem}; to replace the time column by a rate, give --time RATEhz");
    RecordingError::unusable(at, problem)
}

#[cfg(test)]
mod tests {
    use super::Rows;

    #[test]
    fn rows_are_found_by_their_sample() {
        let mut rows = Rows::default();
        [2, 3, 4, 7, 9, 10].into_iter().for_each(|row| rows.push(row));
        assert_eq!((0..6).map(|i| rows.row(i)).collect::<Vec<_>>(), [2, 3, 4, 7, 9, 10]);
        let some = rows.of([1, 2, 5].into_iter());
        assert_eq!((0..3).map(|i| some.row(i)).collect::<Vec<_>>(), [3, 4, 10]);
        assert_eq!(Rows::counted(3).row(2), 3);
    }
}

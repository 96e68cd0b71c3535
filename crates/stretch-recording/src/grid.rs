//! Brings channels that were recorded on separate clocks to one grid.

use stretch_data::{Channel, DataError, Place, Trial, can_name, rate_of, tidy_time};

use crate::{
    ReadOptions, Recording, RecordingError, TimeUnit,
    clock::{
        self, BRIDGED, EPOCH_S, Stamps, note_on_epoch,
        unit::{RATES_HZ, check_range},
    },
    names::tidy,
    room::Room,
    text::{bad_rows::BadRows, columns::KNOWN},
};

/// Channels that are held from one sample to the next instead of interpolated, because they are commands.
const HELD: [&str; 2] = ["inlet", "outlet"];
/// Number of names in a note. Further names are only counted.
const TOLD: usize = 4;

/// Channels that were recorded at the same instants.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Track {
    /// Name of the clock in messages.
    pub(crate) label: String,
    pub(crate) stamps: Stamps,
    /// NaN where a sample has no value.
    pub(crate) channels: Vec<Channel>,
}

impl Track {
    /// Creates a track whose clock is named after its time column.
    pub(crate) fn new(stamps: Stamps, channels: Vec<Channel>) -> Self {
        Self { label: stamps.name.clone(), stamps, channels }
    }

    /// Removes the samples with these indices, which must be in ascending order.
    pub(crate) fn remove(&mut self, samples: &[usize]) {
        if samples.is_empty() {
            return;
        }
        let is_kept = |i: &usize| samples.binary_search(i).is_err();
        let kept = (0..self.stamps.counts.len()).filter(is_kept);
        self.stamps.rows = self.stamps.rows.of(kept);
        let columns = self.channels.iter_mut().map(|channel| &mut channel.values);
        for values in columns.chain([&mut self.stamps.counts]) {
            let (mut gone, mut at) = (samples.iter().peekable(), 0);
            values.retain(|_| {
                at += 1;
                gone.next_if(|i| **i == at - 1).is_none()
            });
        }
    }
}

/// A track whose time is in seconds from the origin that all tracks share.
struct Timed {
    clock: String,
    time_s: Vec<f64>,
    channels: Vec<Channel>,
}

impl Timed {
    fn rate_hz(&self) -> f64 {
        rate_of(&self.time_s).unwrap_or(0.0)
    }
}

/// Merges tracks into one recording. The channels still have the names from the file.
pub(crate) fn merged(
    file: &str,
    mut tracks: Vec<Track>,
    mut notes: Vec<String>,
    options: &ReadOptions,
) -> Result<Recording, RecordingError> {
    tidy_names(&mut tracks, &mut notes, options);
    let names: Vec<String> =
        tracks.iter().flat_map(|t| &t.channels).map(|c| c.name.clone()).collect();
    let options = &options.named_as(names.iter().map(String::as_str));
    for wanted in options.required() {
        find(file, &mut tracks, wanted)?;
    }
    for known in KNOWN {
        // The error is ignored, because a file need not contain every known channel.
        let _ = find(file, &mut tracks, known);
    }
    let tracks = tracks.into_iter().flat_map(|track| sparse(track, options, &mut notes));
    let tracks = tracks.collect();
    let recording = joined(file, tracks, notes, options)?;
    match recording.trial.channels.is_empty() {
        true => Err(no_channels(file, &recording.notes)),
        false => Ok(recording),
    }
}

fn no_channels(file: &str, notes: &[String]) -> RecordingError {
    let notes = if notes.is_empty() { String::new() } else { format!(" ({})", notes.join("; ")) };
    let problem = format!("it holds no column of numbers besides the time{notes}");
    RecordingError::unusable(file, problem)
}

/// Joins tracks into one recording: on the only clock, on the fastest of several clocks, or on an even grid.
pub(crate) fn joined(
    file: &str,
    mut tracks: Vec<Track>,
    mut notes: Vec<String>,
    options: &ReadOptions,
) -> Result<Recording, RecordingError> {
    // Clocks without a requested column are left out, because each additional clock can shorten the time that all
    // clocks cover.
    if tracks.len() > 1 && !options.required().is_empty() {
        let is_asked = |c: &Channel| options.required().contains(&c.name);
        let (needed, other): (Vec<_>, Vec<_>) =
            tracks.into_iter().partition(|t| t.channels.iter().any(is_asked));
        tracks = needed;
        let clocks: Vec<_> = other.into_iter().map(|t| t.label).collect();
        note(&mut notes, "left out, because no requested column is on these clocks", &clocks);
    }
    let mut left_out = Vec::new();
    for track in &mut tracks {
        whole_channels(file, track, options, &mut left_out, &mut notes)?;
    }
    note(
        &mut notes,
        "columns left out because not all of their values are finite numbers",
        &left_out,
    );
    if tracks.len() > 1 {
        tracks.retain(|t| !t.channels.is_empty() && t.stamps.counts.len() > 1);
    }
    for track in &mut tracks {
        clock::read(file, track, options, &mut notes)?;
    }
    let mut timed = timed(file, tracks, &mut notes)?;
    if timed.is_empty() {
        return Err(no_channels(file, &notes));
    }
    if timed.len() == 1
        && options.grid_hz.is_none()
        && let Some(Timed { time_s, channels, .. }) = timed.pop()
    {
        return Ok(Recording { trial: Trial { name: file.to_owned(), time_s, channels }, notes });
    }
    on_one_grid(file, &timed, options.grid_hz, notes)
}

/// Returns whether a column is requested or, if none is requested, is one of the format's known columns.
pub(crate) fn is_needed(name: &str, options: &ReadOptions) -> bool {
    let asked = options.required();
    asked.iter().any(|asked| asked == name) || (asked.is_empty() && KNOWN.contains(&name))
}

/// Moves the columns of a sparse table to separate tracks, each with the stamps of its filled rows. In a sparse table,
/// each row has the values of one clock and blanks for the others.
///
/// A column is moved if it has many blanks between its first and last value, and if nearly all of its blank rows have a
/// value in another column. A column that is not needed is moved only if all columns of the table have many blanks.
pub(crate) fn sparse(
    mut track: Track,
    options: &ReadOptions,
    notes: &mut Vec<String>,
) -> Vec<Track> {
    let samples = track.stamps.counts.len();
    if track.channels.iter().all(|c| c.values.iter().all(|x| x.is_finite())) {
        return vec![track];
    }
    let filled: Vec<usize> = (0..samples)
        .map(|i| track.channels.iter().filter(|c| c.values[i].is_finite()).count())
        .collect();
    let blank = |c: &Channel| c.values.iter().filter(|x| !x.is_finite()).count();
    let is_whole = |c: &Channel| BadRows::are_few(blank(c), samples);
    let any_whole = track.channels.iter().any(is_whole);
    let is_sparse = |c: &Channel| {
        let lone = c.values.iter().zip(&filled).filter(|(x, n)| !x.is_finite() && **n == 0).count();
        let is_taken = !any_whole || is_needed(&c.name, options);
        let is_on_and_off = options.may_have_gaps(&c.name) && !alternates(&c.values);
        is_taken
            && !is_on_and_off
            && has_blanks_between(&c.values)
            && BadRows::are_few(lone, blank(c))
    };
    let (own, others): (Vec<_>, Vec<_>) = track.channels.into_iter().partition(is_sparse);
    let mut tracks: Vec<(Vec<usize>, Track)> = Vec::new();
    let mut names = Vec::new();
    for channel in own {
        names.push(format!("{} ({} of {samples})", channel.name, samples - blank(&channel)));
        let is_filled = |i: &usize| channel.values[*i].is_finite();
        let rows: Vec<usize> = (0..samples).filter(is_filled).collect();
        let values = rows.iter().map(|i| channel.values[*i]).collect();
        let channel = Channel { values, name: channel.name };
        if let Some((_, same)) = tracks.iter_mut().find(|(other, _)| *other == rows) {
            same.channels.push(channel);
            continue;
        }
        let stamps = Stamps {
            counts: rows.iter().map(|i| track.stamps.counts[*i]).collect(),
            rows: track.stamps.rows.of(rows.iter().copied()),
            name: track.stamps.name.clone(),
            ..track.stamps
        };
        let label = format!("{} of {}", stamps.name, channel.name);
        tracks.push((rows, Track { label, stamps, channels: vec![channel] }));
    }
    note(notes, "columns with blanks keep the time stamps of their filled rows", &names);
    track.channels = others;
    let own = tracks.into_iter().map(|(_, track)| track);
    std::iter::once(track).filter(|t| !t.channels.is_empty()).chain(own).collect()
}

/// Returns whether more than one in five of the values between the first and the last one are blank. Blanks at the ends
/// do not count, because they mean that the sensor was lost.
fn has_blanks_between(values: &[f64]) -> bool {
    let is_value = |x: &f64| x.is_finite();
    let ends = values.iter().position(is_value).zip(values.iter().rposition(is_value));
    let Some((first, last)) = ends.filter(|(first, last)| first < last) else { return false };
    let between = &values[first..=last];
    let blank = between.iter().filter(|x| !x.is_finite()).count();
    !BadRows::are_few(blank, between.len())
}

/// Returns whether values and blanks alternate as often as in a column with a separate clock: on average, at least one
/// run of blanks for each ten values.
fn alternates(values: &[f64]) -> bool {
    let runs = values.windows(2).filter(|pair| pair[0].is_finite() && !pair[1].is_finite()).count();
    runs * 10 >= values.iter().filter(|x| x.is_finite()).count()
}

/// Rewrites names with units in the project's notation, such as `pos_mm` for `Pos (mm)`. Requested names stay.
fn tidy_names(tracks: &mut [Track], notes: &mut Vec<String>, options: &ReadOptions) {
    let mut told = Vec::new();
    for channel in tracks.iter_mut().flat_map(|t| &mut t.channels) {
        let is_asked = options.required().contains(&channel.name);
        if let Some(tidied) = tidy(&channel.name, None).filter(|_| !is_asked) {
            told.push(format!("{} -> {tidied}", channel.name));
            channel.name = tidied;
        }
    }
    note(notes, "columns named with their units", &told);
}

/// Finds a channel by its name, or by the last part of its path if only one path ends with it. The channel is then
/// renamed to that last part.
fn find(file: &str, tracks: &mut [Track], wanted: &str) -> Result<(), RecordingError> {
    let all = || tracks.iter().flat_map(|t| &t.channels).map(|c| c.name.as_str());
    if all().any(|name| name == wanted) {
        return Ok(());
    }
    let ends_so =
        |name: &str| name.strip_suffix(wanted).is_some_and(|path| path.ends_with(['/', '.']));
    let found: Vec<String> = all().filter(|n| ends_so(n)).map(str::to_owned).collect();
    let [name] = &found[..] else {
        return Err(DataError::missing_column(file, wanted, all()).into());
    };
    for channel in tracks.iter_mut().flat_map(|t| &mut t.channels) {
        if channel.name == *name {
            wanted.clone_into(&mut channel.name);
        }
    }
    Ok(())
}

/// Leaves out channels with holes (values that are not finite), with a name that occurred before, or with an invalid
/// name. If a needed channel has few holes, leaves out their rows instead.
fn whole_channels(
    file: &str,
    track: &mut Track,
    options: &ReadOptions,
    left_out: &mut Vec<String>,
    notes: &mut Vec<String>,
) -> Result<(), RecordingError> {
    let mut kept: Vec<Channel> = Vec::new();
    let mut holes: Vec<usize> = Vec::new();
    for channel in std::mem::take(&mut track.channels) {
        let of_it = || (0..channel.values.len()).filter(|i| !channel.values[*i].is_finite());
        let few = || BadRows::are_few(of_it().count() + holes.len(), channel.values.len());
        let is_needed = is_needed(&channel.name, options) || (options.all_columns && few());
        let may_have_gaps = options.may_have_gaps(&channel.name);
        if let Some(hole) = of_it().next().filter(|_| is_needed && !may_have_gaps) {
            let value = channel.values[hole].to_string();
            let row = track.stamps.rows.row(hole);
            holes.extend(of_it());
            holes.sort_unstable();
            holes.dedup();
            let at = Place { file: file.to_owned(), row, column: channel.name.clone() };
            if options.strict || !BadRows::are_few(holes.len(), channel.values.len()) {
                return Err(DataError::NotFinite { at, value }.into());
            }
            let (count, name) = (of_it().count(), &channel.name);
            notes.push(format!(
                "{count} rows without a number in {name} are left out, the first of them row {row}"
            ));
        }
        let has_holes = !is_needed && of_it().next().is_some();
        let is_twice = kept.iter().any(|other| other.name == channel.name);
        if has_holes || is_twice || !can_name(&channel.name) {
            left_out.push(channel.name.escape_debug().to_string());
        } else {
            kept.push(channel);
        }
    }
    track.channels = kept;
    track.remove(&holes);
    Ok(())
}

/// Converts the clocks to seconds. If they count from a distant or separate origin, the time starts at the beginning of
/// the recording.
fn timed(
    file: &str,
    tracks: Vec<Track>,
    notes: &mut Vec<String>,
) -> Result<Vec<Timed>, RecordingError> {
    let per_second = |stamps: &Stamps| stamps.per_second.unwrap_or(1.0);
    let begins = tracks.iter().filter_map(|t| {
        let first = t.stamps.counts.first()?;
        Some(((t.stamps.origin + first) / per_second(&t.stamps), *first, &t.stamps))
    });
    let first = begins.min_by(|a, b| a.0.total_cmp(&b.0));
    let epoch = first.filter(|(first_s, _, s)| first_s.abs() >= EPOCH_S || s.origin != 0.0);
    let base = epoch.map(|(first_s, first, stamps)| {
        let are_days = per_second(stamps) == TimeUnit::Days.per_second();
        notes.push(note_on_epoch(if are_days { 0.0 } else { first_s }));
        (first, stamps.origin, per_second(stamps))
    });
    let timed = tracks.into_iter().map(|Track { label, stamps, channels }| {
        let per_second = per_second(&stamps);
        let from = base.map_or(0.0, |(first, origin, own)| {
            let scale = per_second / own;
            first * scale + (origin * scale - stamps.origin)
        });
        let (mut time_s, rows, column) = (stamps.counts, stamps.rows, stamps.name);
        time_s.iter_mut().for_each(|t| *t = (*t - from) / per_second);
        let place =
            |i: usize| Place { file: file.to_owned(), row: rows.row(i), column: column.clone() };
        if let Some(i) = time_s.iter().position(|t| !t.is_finite()) {
            return Err(DataError::NotFinite { at: place(i), value: time_s[i].to_string() }.into());
        }
        // Stamps become equal if they differ by less than the resolution of floating-point numbers of their size.
        if let Some(i) = time_s.windows(2).position(|t| t[1] <= t[0]) {
            let (previous_s, time_s) = (time_s[i], time_s[i + 1]);
            return Err(DataError::TimeNotRising { at: place(i + 1), time_s, previous_s }.into());
        }
        Ok(Timed { clock: label, time_s, channels })
    });
    timed.collect()
}

fn fastest(timed: &[Timed]) -> usize {
    let rates = timed.iter().enumerate();
    // Of equal rates, take the first.
    rates.rev().max_by(|a, b| a.1.rate_hz().total_cmp(&b.1.rate_hz())).map_or(0, |(i, _)| i)
}

/// Resamples tracks to the stamps of the fastest track, or to an even grid, within the time that all tracks cover.
fn on_one_grid(
    file: &str,
    timed: &[Timed],
    grid_hz: Option<f64>,
    mut notes: Vec<String>,
) -> Result<Recording, RecordingError> {
    let span = |t: &Timed| (t.time_s[0], t.time_s[t.time_s.len() - 1]);
    let late = |a: &&Timed, b: &&Timed| span(a).0.total_cmp(&span(b).0);
    let early = |a: &&Timed, b: &&Timed| span(a).1.total_cmp(&span(b).1);
    let (Some(last), Some(soonest)) = (timed.iter().max_by(late), timed.iter().min_by(early))
    else {
        return Ok(Recording { trial: Trial { name: file.to_owned(), ..Trial::default() }, notes });
    };
    let (from_s, to_s) = (span(last).0, span(soonest).1);
    if from_s > to_s {
        let told = |t: &Timed| format!("{:.3} .. {:.3}", span(t).0, span(t).1);
        let problem = format!(
            "{} and {} have no time in common ({} s and {} s); they cannot be brought to one grid: leave one of them out",
            soonest.clock,
            last.clock,
            told(soonest),
            told(last)
        );
        return Err(RecordingError::unusable(file, problem));
    }
    let own = fastest(timed);
    let mut time_s: Vec<f64> = match grid_hz {
        None => timed[own].time_s.iter().copied().filter(|t| (from_s..=to_s).contains(t)).collect(),
        Some(rate_hz) => {
            let columns = 1 + timed.iter().map(|t| t.channels.len()).sum::<usize>();
            let own = timed.iter().map(|t| t.time_s.len() * (1 + t.channels.len())).sum::<usize>();
            let count = ((to_s - from_s) * rate_hz).max(0.0) * columns as f64;
            let mut room = Room::beside((own * size_of::<f64>()) as u64);
            room.take_numbers(count as usize).map_err(|_| {
                let span_s = to_s - from_s;
                let problem = format!(
                    "a grid of {rate_hz} Hz has {:.1e} instants in its {span_s} s, many times what was recorded; give a lower rate with --grid, or split the recording at the gap in its time",
                    rate_hz * span_s
                );
                RecordingError::unusable(file, problem)
            })?;
            even(from_s, to_s, rate_hz, file)?
        }
    };
    let before = time_s.len();
    for track in timed {
        leave_gaps(&mut time_s, track);
    }
    tell(timed, own, grid_hz, (from_s, to_s), before - time_s.len(), &mut notes);
    if time_s.is_empty() {
        return Err(DataError::NoSamples.into());
    }
    let mut channels: Vec<Channel> = Vec::new();
    for track in timed {
        for channel in &track.channels {
            if channels.iter().any(|other| other.name == channel.name) {
                notes.push(format!("{} appears on two clocks; the first is used", channel.name));
                continue;
            }
            let held = HELD.contains(&channel.name.as_str());
            let values = onto(&time_s, &track.time_s, &channel.values, held);
            channels.push(Channel { name: channel.name.clone(), values });
        }
    }
    Ok(Recording { trial: Trial { name: file.to_owned(), time_s, channels }, notes })
}

fn even(from_s: f64, to_s: f64, rate_hz: f64, file: &str) -> Result<Vec<f64>, RecordingError> {
    let count = ((to_s - from_s) * rate_hz + 1e-6).floor();
    check_range(file, "grid", rate_hz, RATES_HZ)?;
    let largest_s = from_s.abs().max(to_s.abs());
    let at = |i: u64| tidy_time(from_s + i as f64 / rate_hz, largest_s);
    // Rounding must not push the last instant beyond the last sample.
    Ok((0..=count as u64).map(|i| at(i).min(to_s)).collect())
}

/// Removes the instants of the grid that lie in a gap of a track, because interpolation across a gap would invent data.
fn leave_gaps(grid: &mut Vec<f64>, track: &Timed) {
    let longest_s = BRIDGED / track.rate_hz();
    let mut gaps = track.time_s.windows(2).filter(|t| t[1] - t[0] > longest_s).peekable();
    grid.retain(|t| {
        while gaps.next_if(|gap| gap[1] <= *t).is_some() {}
        !gaps.peek().is_some_and(|gap| gap[0] < *t)
    });
}

/// Interpolates values linearly at the instants of a grid, or holds the previous value.
fn onto(grid: &[f64], time_s: &[f64], values: &[f64], held: bool) -> Vec<f64> {
    let mut right = 1;
    let at = |t: &f64| {
        while right + 1 < time_s.len() && time_s[right] < *t {
            right += 1;
        }
        if right >= time_s.len() {
            return values[0];
        }
        let (before, after) = (time_s[right - 1], time_s[right]);
        if *t >= after {
            return values[right];
        }
        if held {
            return values[right - 1];
        }
        let share = (t - before) / (after - before);
        values[right - 1] + share * (values[right] - values[right - 1])
    };
    grid.iter().map(at).collect()
}

fn tell(
    timed: &[Timed],
    own: usize,
    grid_hz: Option<f64>,
    (from_s, to_s): (f64, f64),
    dropped: usize,
    notes: &mut Vec<String>,
) {
    let moved = timed.iter().enumerate().filter(|(i, _)| grid_hz.is_some() || *i != own);
    let moved: Vec<String> =
        moved.map(|(_, t)| format!("{} ({:.2} Hz)", t.clock, t.rate_hz())).collect();
    let moved: Vec<&str> = moved.iter().map(String::as_str).collect();
    let onto = match grid_hz {
        Some(rate_hz) => format!("a grid of {rate_hz} Hz"),
        None => format!("the clock of {} ({:.2} Hz)", timed[own].clock, timed[own].rate_hz()),
    };
    let commands =
        if timed.iter().any(|t| t.channels.iter().any(|c| HELD.contains(&c.name.as_str()))) {
            ", commands held"
        } else {
            ""
        };
    let slower = timed.iter().any(|t| grid_hz.is_some_and(|hz| hz < 0.99 * t.rate_hz()));
    let unfiltered = if slower {
        "; no low-pass filter is applied, so content above half the new rate aliases"
    } else {
        ""
    };
    notes.push(format!(
        "resampled to {onto} by linear interpolation{commands}: {}{unfiltered}",
        listed(&moved)
    ));
    let ends = timed.iter().fold((f64::MAX, f64::MIN), |(first, last), t| {
        (first.min(t.time_s[0]), last.max(t.time_s[t.time_s.len() - 1]))
    });
    let (begin_s, end_s) = (from_s - ends.0, ends.1 - to_s);
    if begin_s > 0.0 || end_s > 0.0 {
        notes.push(format!(
            "{begin_s:.3} s at the beginning and {end_s:.3} s at the end are left out, because not every clock covers them"
        ));
    }
    if dropped > 0 {
        notes.push(format!("{dropped} rows are left out because a clock has a gap there"));
    }
}

/// Adds a note with a list of names, unless the list is empty.
pub(crate) fn note<S: AsRef<str>>(notes: &mut Vec<String>, what: &str, names: &[S]) {
    if !names.is_empty() {
        notes.push(format!("{what}: {}", listed(names)));
    }
}

/// Lists the first names and the number of the others.
pub(crate) fn listed<S: AsRef<str>>(names: &[S]) -> String {
    let names: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
    match names.len() {
        n if n > TOLD + 1 => format!("{} and {} more", names[..TOLD].join(", "), n - TOLD),
        _ => names.join(", "),
    }
}

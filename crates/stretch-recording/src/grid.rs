//! Channels on clocks of their own, brought to one grid.

use stretch_data::{Channel, DataError, Place, Trial, can_name, rate_of, tidy_time};

use crate::{
    ReadOptions, Recording, RecordingError,
    clock::{EPOCH_S, told_epoch},
    names::tidy,
    room::Room,
    text::columns::KNOWN,
};

/// Channels that a device holds from one sample to the next.
const HELD: [&str; 2] = ["inlet", "outlet"];
/// Periods of a channel's own clock over which a straight line is drawn: as many lost samples as a live receptor bridges, and one.
const BRIDGED: f64 = 4.5;
/// Names that a sentence holds; more are counted.
const TOLD: usize = 4;

/// Channels that were recorded at the same instants.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Track {
    /// What the clock is called: a topic, the array of the stamps.
    pub(crate) clock: String,
    /// Stamps as they were recorded.
    pub(crate) counts: Vec<f64>,
    /// Counts in a second.
    pub(crate) per_second: f64,
    /// NaN where a sample has no value.
    pub(crate) channels: Vec<Channel>,
}

/// A track whose clock counts seconds from the recording's beginning.
struct Timed {
    clock: String,
    time_s: Vec<f64>,
    rate_hz: f64,
    channels: Vec<Channel>,
}

/// One recording of tracks, and the clock's name.
pub(crate) fn merged(
    file: &str,
    mut tracks: Vec<Track>,
    mut notes: Vec<String>,
    options: &ReadOptions,
) -> Result<(Recording, String), RecordingError> {
    tidy_names(&mut tracks, &mut notes, options);
    for wanted in options.required() {
        find(file, &mut tracks, wanted)?;
    }
    for known in KNOWN {
        // Whether or not it is there.
        let _ = find(file, &mut tracks, known);
    }
    let is_needed =
        |c: &Channel| options.required().contains(&c.name) || KNOWN.contains(&c.name.as_str());
    // Every clock that is taken shortens what all of them cover: those that nobody asks for are not.
    if tracks.len() > 1 && !options.required().is_empty() {
        let is_asked = |c: &Channel| options.required().contains(&c.name);
        let (needed, other): (Vec<_>, Vec<_>) =
            tracks.into_iter().partition(|t| t.channels.iter().any(is_asked));
        tracks = needed;
        let clocks: Vec<_> = other.into_iter().map(|t| t.clock).collect();
        note(&mut notes, "left out, nothing asked for is on these clocks", &clocks);
    }
    let mut left_out = Vec::new();
    for track in &mut tracks {
        whole_channels(file, track, is_needed, &mut left_out)?;
    }
    note(&mut notes, "left out, not all of their values are finite numbers", &left_out);
    tracks.retain(|t| !t.channels.is_empty());
    if tracks.len() > 1 {
        tracks.retain(|t| t.counts.len() > 1);
    }
    let mut timed = timed(file, tracks, &mut notes)?;
    if timed.is_empty() {
        let hint = format!("no channel of numbers has a clock ({})", notes.join("; "));
        return Err(RecordingError::NoTime { file: file.to_owned(), hint });
    }
    if timed.len() == 1
        && options.grid_hz.is_none()
        && let Some(Timed { clock, time_s, channels, .. }) = timed.pop()
    {
        let trial = Trial { name: file.to_owned(), time_s, channels };
        return Ok((Recording { trial, notes }, clock));
    }
    let recording = on_one_grid(file, &timed, options.grid_hz, notes)?;
    let clock = timed[fastest(&timed)].clock.clone();
    Ok((recording, clock))
}

/// A recording on an even grid of another rate.
pub(crate) fn resampled(recording: Recording, rate_hz: f64) -> Result<Recording, RecordingError> {
    let Recording { trial, notes } = recording;
    let Some(own_hz) = trial.rate_hz() else { return Ok(Recording { trial, notes }) };
    let timed = Timed {
        clock: "the recording".to_owned(),
        time_s: trial.time_s,
        rate_hz: own_hz,
        channels: trial.channels,
    };
    on_one_grid(&trial.name, &[timed], Some(rate_hz), notes)
}

/// Names with units in this project's way.
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

/// Finds a channel by its name, or by the last part of its path where only one ends so, which is then called by that alone.
fn find(file: &str, tracks: &mut [Track], wanted: &str) -> Result<(), RecordingError> {
    let all = || tracks.iter().flat_map(|t| &t.channels).map(|c| c.name.as_str());
    if all().any(|name| name == wanted) {
        return Ok(());
    }
    let ends_so =
        |name: &str| name.strip_suffix(wanted).is_some_and(|path| path.ends_with(['/', '.']));
    let found: Vec<String> = all().filter(|n| ends_so(n)).map(str::to_owned).collect();
    let [name] = &found[..] else {
        return Err(RecordingError::missing_column(file, wanted, all()));
    };
    for channel in tracks.iter_mut().flat_map(|t| &mut t.channels) {
        if channel.name == *name {
            wanted.clone_into(&mut channel.name);
        }
    }
    Ok(())
}

/// Leaves out channels with holes and those of a name that was there before; refuses a hole in a channel that is needed.
fn whole_channels(
    file: &str,
    track: &mut Track,
    is_needed: impl Fn(&Channel) -> bool,
    left_out: &mut Vec<String>,
) -> Result<(), RecordingError> {
    let mut kept: Vec<Channel> = Vec::new();
    for channel in std::mem::take(&mut track.channels) {
        let hole = channel.values.iter().position(|x| !x.is_finite());
        if let Some(hole) = hole.filter(|_| is_needed(&channel)) {
            let value = channel.values[hole].to_string();
            let at = Place { file: file.to_owned(), row: hole as u64 + 1, column: channel.name };
            return Err(DataError::NotFinite { at, value }.into());
        }
        let is_twice = kept.iter().any(|other| other.name == channel.name);
        if hole.is_some() || is_twice || !can_name(&channel.name) {
            left_out.push(channel.name.escape_debug().to_string());
        } else {
            kept.push(channel);
        }
    }
    track.channels = kept;
    Ok(())
}

/// Clocks in seconds, from the recording's beginning where they count from 1970.
fn timed(
    file: &str,
    tracks: Vec<Track>,
    notes: &mut Vec<String>,
) -> Result<Vec<Timed>, RecordingError> {
    let begins = tracks.iter().filter_map(|t| Some((*t.counts.first()? / t.per_second, t)));
    let first = begins.min_by(|a, b| a.0.total_cmp(&b.0));
    let epoch = first.filter(|(first_s, _)| first_s.abs() >= EPOCH_S);
    if let Some((first_s, _)) = epoch {
        notes.push(told_epoch(first_s));
    }
    let origin = epoch.map_or((0.0, 1.0), |(_, t)| (t.counts[0], t.per_second));
    let mut timed = Vec::new();
    for Track { clock, counts, per_second, channels } in tracks {
        let from = origin.0 * (per_second / origin.1);
        let mut time_s = counts;
        time_s.iter_mut().for_each(|t| *t = (*t - from) / per_second);
        let place =
            |i: usize| Place { file: file.to_owned(), row: i as u64 + 1, column: clock.clone() };
        if let Some(i) = time_s.iter().position(|t| !t.is_finite()) {
            return Err(DataError::NotFinite { at: place(i), value: time_s[i].to_string() }.into());
        }
        if let Some(i) = time_s.windows(2).position(|t| t[1] <= t[0]) {
            let (previous_s, time_s) = (time_s[i], time_s[i + 1]);
            return Err(DataError::TimeNotRising { at: place(i + 1), time_s, previous_s }.into());
        }
        let rate_hz = rate_of(&time_s).unwrap_or(0.0);
        timed.push(Timed { clock, time_s, rate_hz, channels });
    }
    Ok(timed)
}

fn fastest(timed: &[Timed]) -> usize {
    let rates = timed.iter().enumerate();
    // The first of equals.
    rates.rev().max_by(|a, b| a.1.rate_hz.total_cmp(&b.1.rate_hz)).map_or(0, |(i, _)| i)
}

/// Brings tracks to the stamps of the fastest, or to a rate, within the time that all of them cover.
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
        return Err(RecordingError::NoOverlap {
            file: file.to_owned(),
            first: soonest.clock.clone(),
            first_s: told(soonest),
            second: last.clock.clone(),
            second_s: told(last),
        });
    }
    let own = fastest(timed);
    let mut time_s: Vec<f64> = match grid_hz {
        None => timed[own].time_s.iter().copied().filter(|t| (from_s..=to_s).contains(t)).collect(),
        Some(rate_hz) => {
            let columns = 1 + timed.iter().map(|t| t.channels.len()).sum::<usize>();
            let own = timed.iter().map(|t| t.time_s.len() * (1 + t.channels.len())).sum::<usize>();
            let count = ((to_s - from_s) * rate_hz).max(0.0) * columns as f64;
            let mut room = Room::beside((own * size_of::<f64>()) as u64);
            room.take_numbers(count as usize).map_err(|_| RecordingError::Grid {
                file: file.to_owned(),
                rate_hz,
                span_s: to_s - from_s,
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
                notes.push(format!("{} stands on two clocks; the first is taken", channel.name));
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
    if !(1e-3..=1e7).contains(&rate_hz) {
        let (file, column) = (file.to_owned(), "grid".to_owned());
        return Err(RecordingError::Rate { file, column, rate_hz });
    }
    let largest_s = from_s.abs().max(to_s.abs());
    let at = |i: u64| tidy_time(from_s + i as f64 / rate_hz, largest_s);
    // Rounding must not push the last instant beyond the last sample.
    Ok((0..=count as u64).map(|i| at(i).min(to_s)).collect())
}

/// Takes instants out of the grid that stand where a track has a gap: a line across it would be invented.
fn leave_gaps(grid: &mut Vec<f64>, track: &Timed) {
    let longest_s = BRIDGED / track.rate_hz;
    let mut gaps = track.time_s.windows(2).filter(|t| t[1] - t[0] > longest_s).peekable();
    grid.retain(|t| {
        while gaps.next_if(|gap| gap[1] <= *t).is_some() {}
        !gaps.peek().is_some_and(|gap| gap[0] < *t)
    });
}

/// Values at instants within the track's time.
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
        moved.map(|(_, t)| format!("{} ({:.2} Hz)", t.clock, t.rate_hz)).collect();
    let moved: Vec<&str> = moved.iter().map(String::as_str).collect();
    let onto = match grid_hz {
        Some(rate_hz) => format!("a grid of {rate_hz} Hz"),
        None => format!("the clock of {} ({:.2} Hz)", timed[own].clock, timed[own].rate_hz),
    };
    let commands =
        if timed.iter().any(|t| t.channels.iter().any(|c| HELD.contains(&c.name.as_str()))) {
            ", commands held"
        } else {
            ""
        };
    let slower = timed.iter().any(|t| grid_hz.is_some_and(|hz| hz < 0.99 * t.rate_hz));
    let unfiltered =
        if slower { "; nothing is filtered, so that what is faster folds down" } else { "" };
    notes.push(format!(
        "brought to {onto} by straight lines{commands}: {}{unfiltered}",
        listed(&moved)
    ));
    let ends = timed.iter().fold((f64::MAX, f64::MIN), |(first, last), t| {
        (first.min(t.time_s[0]), last.max(t.time_s[t.time_s.len() - 1]))
    });
    let (begin_s, end_s) = (from_s - ends.0, ends.1 - to_s);
    if begin_s > 0.0 || end_s > 0.0 {
        notes.push(format!(
            "{begin_s:.3} s at the beginning and {end_s:.3} s at the end are left out: not every clock runs there"
        ));
    }
    if dropped > 0 {
        notes.push(format!("{dropped} rows are left out: a clock has a gap there"));
    }
}

/// Notes what is true of some names, if there are any.
pub(crate) fn note<S: AsRef<str>>(notes: &mut Vec<String>, what: &str, names: &[S]) {
    if !names.is_empty() {
        notes.push(format!("{what}: {}", listed(names)));
    }
}

/// A few names, and how many more there are.
pub(crate) fn listed<S: AsRef<str>>(names: &[S]) -> String {
    let names: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
    match names.len() {
        n if n > TOLD + 1 => format!("{} and {} more", names[..TOLD].join(", "), n - TOLD),
        _ => names.join(", "),
    }
}

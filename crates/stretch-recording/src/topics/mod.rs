//! Messages of topics, from whatever they were kept in: each topic is a clock, each number of its messages a channel.

pub(crate) mod cdr;
pub(crate) mod definitions;
#[cfg(feature = "rosbag")]
pub(crate) mod known;
pub(crate) mod leaves;

use std::collections::BTreeMap;

use stretch_data::Channel;

use crate::{
    clock::{EPOCH_S, told_epoch},
    grid::{Track, listed, note},
    room::Room,
    topics::leaves::Topic,
};

/// Longest array whose numbers become channels; images and scans are longer.
pub(crate) const LONGEST: usize = 64;
/// Where messages say themselves when they were measured: seconds, and the nanoseconds beside them.
const STAMPS: [(&str, &str); 8] = [
    ("header.stamp.sec", "header.stamp.nanosec"),
    ("header.stamp.sec", "header.stamp.nsec"),
    ("stamp.sec", "stamp.nanosec"),
    ("timestamp.sec", "timestamp.nsec"),
    ("header.stamp.seconds", "header.stamp.nanos"),
    ("stamp.seconds", "stamp.nanos"),
    ("timestamp.seconds", "timestamp.nanos"),
    ("time.seconds", "time.nanos"),
];

/// What has come so far.
#[derive(Debug, Default)]
pub(crate) struct Topics {
    read: BTreeMap<String, Topic>,
    /// Topics that cannot be read, and why.
    other: BTreeMap<String, String>,
}

impl Topics {
    /// Takes a message of a topic, which `decode` hands to the topic; a topic of which one message cannot be read is left out.
    ///
    /// # Errors
    /// There is no more room.
    pub(crate) fn take(
        &mut self,
        name: &str,
        room: &mut Room,
        decode: impl FnOnce(&mut Topic, &mut Room) -> Result<(), String>,
    ) -> Result<(), String> {
        if self.other.contains_key(name) {
            return Ok(());
        }
        let topic = self.read.entry(name.to_owned()).or_default();
        let taken = decode(topic, room);
        let full = topic.full.take();
        if let Err(why) = taken {
            self.read.remove(name);
            self.other.insert(name.to_owned(), why);
        }
        full.map_or(Ok(()), Err)
    }

    /// The tracks; `wanted` says what is to be recorded where none of the topics can be read.
    ///
    /// # Errors
    /// There is no message that can be read, or no more room.
    pub(crate) fn into_tracks(
        self,
        wanted: &str,
        room: &mut Room,
        notes: &mut Vec<String>,
    ) -> Result<Vec<Track>, String> {
        let other: Vec<String> =
            self.other.into_iter().map(|(topic, why)| format!("{topic} ({why})")).collect();
        if self.read.is_empty() {
            return Err(match other[..] {
                [] => "there is no message in it".to_owned(),
                _ => format!("no topic can be read: {}; {wanted}", listed(&other)),
            });
        }
        note(notes, "left out", &other);
        self.read.values().try_for_each(|topic| topic.take_rest(room))?;
        Ok(tracks(self.read, notes))
    }
}

/// A track a topic, counted from the first message of all.
fn tracks(topics: BTreeMap<String, Topic>, notes: &mut Vec<String>) -> Vec<Track> {
    let (mut stamped, mut doubled) = (Vec::new(), Vec::new());
    let mut read: Vec<(String, Vec<i128>, Vec<Channel>)> = Vec::new();
    for (topic, messages) in topics {
        let (mut ns, mut columns) = messages.into_columns();
        if let Some(own) = own_stamps(&mut columns) {
            ns = own;
            stamped.push(topic.clone());
        }
        let before = ns.len();
        in_order(&mut ns, &mut columns);
        if ns.len() < before {
            doubled.push(format!("{topic} ({})", before - ns.len()));
        }
        read.push((topic, ns, columns));
    }
    note(notes, "time is what the messages' own stamps say", &stamped);
    note(notes, "messages with the stamp of another are left out", &doubled);
    let first = read.iter().filter_map(|(_, ns, _)| ns.first()).min().copied().unwrap_or(0);
    let first_s = first as f64 / 1e9;
    let origin = if first_s >= EPOCH_S { first } else { 0 };
    if origin != 0 {
        notes.push(told_epoch(first_s));
    }
    let track = |(topic, ns, columns): (String, Vec<i128>, Vec<Channel>)| {
        let path = topic.trim_start_matches('/');
        let channels = columns.into_iter().map(|column| Channel {
            name: format!("{path}.{}", column.name).trim_end_matches('.').to_owned(),
            values: column.values,
        });
        let counts = ns.iter().map(|ns| (ns - origin) as f64).collect();
        Track { channels: channels.collect(), clock: topic, counts, per_second: 1e9 }
    };
    read.into_iter().map(track).collect()
}

/// Stamps within the messages, ns, where they go on from message to message; they are then no channels.
fn own_stamps(columns: &mut Vec<Channel>) -> Option<Vec<i128>> {
    let position = |columns: &[Channel], name: &str| columns.iter().position(|c| c.name == name);
    let (seconds, nanoseconds) = STAMPS.iter().find_map(|(seconds, nanoseconds)| {
        Some((position(columns, seconds)?, position(columns, nanoseconds)?))
    })?;
    let pairs = columns[seconds].values.iter().zip(&columns[nanoseconds].values);
    let whole: Option<Vec<i128>> = pairs
        .map(|(s, ns)| {
            (s.is_finite() && ns.is_finite()).then(|| *s as i128 * 1_000_000_000 + *ns as i128)
        })
        .collect();
    let ns = whole.filter(|ns| ns.windows(2).filter(|t| t[1] > t[0]).count() * 2 > ns.len())?;
    let names = [columns[seconds].name.clone(), columns[nanoseconds].name.clone()];
    columns.retain(|c| !names.contains(&c.name));
    Some(ns)
}

/// Sorts messages by their stamps and leaves out those whose stamp stands there already.
fn in_order(ns: &mut Vec<i128>, columns: &mut [Channel]) {
    if ns.windows(2).all(|t| t[1] > t[0]) {
        return;
    }
    let mut order: Vec<usize> = (0..ns.len()).collect();
    order.sort_by_key(|&i| ns[i]);
    order.dedup_by_key(|i| ns[*i]);
    *ns = order.iter().map(|&i| ns[i]).collect();
    for column in columns {
        column.values = order.iter().map(|&i| column.values[i]).collect();
    }
}

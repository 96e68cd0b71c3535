//! MCAP: messages in JSON or in ROS 2's CDR, a clock a topic.

mod cdr;
mod kept;
mod leaves;
mod messages;

use std::collections::{BTreeMap, HashMap};

use ::mcap::{Channel as Source, Message};
use serde_json::Value;

use stretch_data::Channel;

use crate::{
    RecordingError,
    clock::{EPOCH_S, told_epoch},
    grid::{Track, listed, note},
    mcap::kept::Messages,
    mcap::leaves::{Leaves, Topic},
    mcap::messages::Schema,
    room::Room,
};

/// Bytes that a byte of JSON takes at most while it is read: a digit and a comma are a value of 32, in a list that grows to twice its length.
const JSON: usize = 32;
/// Longest array whose numbers become channels.
const LONGEST: usize = 64;
/// Where messages say themselves when they were measured: seconds, and the nanoseconds beside them.
const STAMPS: [(&str, &str); 4] = [
    ("header.stamp.sec", "header.stamp.nanosec"),
    ("header.stamp.sec", "header.stamp.nsec"),
    ("stamp.sec", "stamp.nanosec"),
    ("timestamp.sec", "timestamp.nsec"),
];

/// Reads all topics whose messages can be understood.
pub(crate) fn read(
    (bytes, mut room): (Vec<u8>, Room),
    file: &str,
) -> Result<(Vec<Track>, Vec<String>), RecordingError> {
    let fail = |problem| RecordingError::Format { file: file.to_owned(), format: "MCAP", problem };
    let mut bag = Bag::default();
    let mut notes = Vec::new();
    for (count, message) in Messages::new(&bytes).enumerate() {
        match message {
            Ok(message) => bag.take(&message, &mut room).map_err(fail)?,
            Err(e) if count > 0 => {
                notes.push(format!("it breaks off after {count} messages ({e}); those are read"));
                break;
            }
            Err(e) => return Err(fail(format!("{e}; record it again, or try `mcap recover`"))),
        }
    }
    let other: Vec<String> = bag.other.into_iter().map(|(t, why)| format!("{t} ({why})")).collect();
    if bag.topics.is_empty() {
        return Err(fail(match other[..] {
            [] => "there is no message in it".to_owned(),
            _ => format!(
                "no topic can be read: {}; record JSON, or ROS 2 messages in CDR with their schemas",
                listed(&other)
            ),
        }));
    }
    note(&mut notes, "left out", &other);
    bag.topics.values().try_for_each(|topic| topic.take_rest(&mut room)).map_err(fail)?;
    let tracks = tracks(bag.topics, &mut notes);
    Ok((tracks, notes))
}

/// What has come so far.
#[derive(Default)]
struct Bag {
    topics: BTreeMap<String, Topic>,
    schemas: HashMap<u16, Result<Schema, String>>,
    /// Topics that cannot be read, and why.
    other: BTreeMap<String, String>,
}

impl Bag {
    /// Takes a message; an error is that there is no more room.
    fn take(&mut self, message: &Message<'_>, room: &mut Room) -> Result<(), String> {
        let (source, data) = (&message.channel, &message.data[..]);
        let logged_ns = message.log_time.into();
        if self.other.contains_key(&source.topic) {
            return Ok(());
        }
        let topic = self.topics.entry(source.topic.clone()).or_default();
        let taken = match source.message_encoding.as_str() {
            "json" => {
                // while it is read
                let parsed = JSON.saturating_mul(data.len());
                room.take(parsed as u64)?;
                let value: Result<Value, _> = serde_json::from_slice(data);
                room.give_back(parsed);
                value.map_err(|e| format!("a message is no JSON: {e}")).map(|value| {
                    json(&value, &mut topic.begin(logged_ns, room));
                })
            }
            "cdr" => {
                let schema = self.schemas.entry(source.id).or_insert_with(|| schema(source));
                match schema {
                    Err(why) => Err(why.clone()),
                    Ok(schema) => cdr::decode(data, schema, &mut topic.begin(logged_ns, room))
                        .inspect_err(|_| topic.undo()),
                }
            }
            other => Err(format!("messages in {other}")),
        };
        let full = topic.full.take();
        if let Err(why) = taken {
            self.topics.remove(&source.topic);
            self.other.insert(source.topic.clone(), why);
        }
        full.map_or(Ok(()), Err)
    }
}

fn schema(source: &Source<'_>) -> Result<Schema, String> {
    let Some(schema) = &source.schema else { return Err("no schema".to_owned()) };
    match schema.encoding.as_str() {
        "ros2msg" => Schema::parse(&schema.name, &String::from_utf8_lossy(&schema.data)),
        other => Err(format!("a schema in {other}")),
    }
}

/// Numbers of a JSON value, under their paths; true and false are 1 and 0.
fn json(value: &Value, leaves: &mut Leaves<'_>) {
    match value {
        Value::Number(number) => {
            if let Some(number) = number.as_f64() {
                leaves.number(number);
            }
        }
        Value::Bool(is_true) => leaves.number(f64::from(u8::from(*is_true))),
        Value::String(text) => leaves.text(text),
        Value::Object(fields) => {
            for (name, value) in fields {
                let before = leaves.enter(name);
                json(value, leaves);
                leaves.leave(before);
            }
        }
        Value::Array(items) if items.len() <= LONGEST => {
            for (i, value) in items.iter().enumerate() {
                let before = leaves.enter(&i.to_string());
                json(value, leaves);
                leaves.leave(before);
            }
        }
        Value::Array(_) | Value::Null => {}
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

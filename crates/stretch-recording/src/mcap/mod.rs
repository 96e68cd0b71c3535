//! MCAP: messages in JSON, in ROS 2's CDR, or in protobuf, a clock a topic.

mod kept;
mod proto;

use std::collections::HashMap;

use ::mcap::{Channel as Source, Message};
use prost_reflect::MessageDescriptor;
use serde_json::Value;

use crate::{
    RecordingError,
    grid::Track,
    mcap::kept::Messages,
    room::Room,
    topics::{LONGEST, Topics, cdr, definitions::Schema, leaves::Leaves},
};

/// Bytes that a byte of JSON takes at most while it is read: a digit and a comma are a value of 32, in a list that grows to twice its length.
const JSON: usize = 32;
/// What is to be recorded where nothing can be read.
const WANTED: &str = "record JSON, protobuf, or ROS 2 messages in CDR with their schemas";

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
    let tracks = bag.topics.into_tracks(WANTED, &mut room, &mut notes).map_err(fail)?;
    Ok((tracks, notes))
}

/// What has come so far, and what the file says of its messages.
#[derive(Default)]
struct Bag {
    topics: Topics,
    schemas: HashMap<u16, Result<Schema, String>>,
    described: HashMap<u16, Result<MessageDescriptor, String>>,
}

impl Bag {
    /// Takes a message; an error is that there is no more room.
    fn take(&mut self, message: &Message<'_>, room: &mut Room) -> Result<(), String> {
        let (source, data) = (&message.channel, &message.data[..]);
        let (schemas, described) = (&mut self.schemas, &mut self.described);
        let logged_ns = message.log_time.into();
        self.topics.take(&source.topic, room, |topic, room| {
            match source.message_encoding.as_str() {
                "json" => {
                    // while it is read
                    let parsed = JSON.saturating_mul(data.len());
                    if let Err(full) = room.take(parsed as u64) {
                        topic.full = Some(full);
                        return Ok(());
                    }
                    let value: Result<Value, _> = serde_json::from_slice(data);
                    room.give_back(parsed);
                    let value = value.map_err(|e| format!("a message is no JSON: {e}"))?;
                    json(&value, &mut topic.begin(logged_ns, room));
                    Ok(())
                }
                "cdr" => {
                    let schema = schemas.entry(source.id).or_insert_with(|| schema(source));
                    let schema = schema.as_ref().map_err(Clone::clone)?;
                    cdr::decode(data, schema, &mut topic.begin(logged_ns, room))
                        .inspect_err(|_| topic.undo())
                }
                "protobuf" => {
                    let own = described.entry(source.id).or_insert_with(|| descriptor(source));
                    let message = proto::decode(data, own.as_ref().map_err(Clone::clone)?)?;
                    proto::leaves(&message, &mut topic.begin(logged_ns, room), 0);
                    Ok(())
                }
                other => Err(format!("messages in {other}")),
            }
        })
    }
}

fn schema(source: &Source<'_>) -> Result<Schema, String> {
    let Some(schema) = &source.schema else { return Err("no schema".to_owned()) };
    match schema.encoding.as_str() {
        "ros2msg" => Schema::parse(&schema.name, &String::from_utf8_lossy(&schema.data)),
        other => Err(format!("a schema in {other}")),
    }
}

fn descriptor(source: &Source<'_>) -> Result<MessageDescriptor, String> {
    let Some(schema) = &source.schema else { return Err("no schema".to_owned()) };
    match schema.encoding.as_str() {
        "protobuf" => proto::descriptor(&schema.name, &schema.data),
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

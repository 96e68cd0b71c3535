//! Messages in protobuf, read with the description that the file holds of them.

use prost_reflect::{DescriptorPool, DynamicMessage, MessageDescriptor, ReflectMessage, Value};

use crate::topics::{LONGEST, leaves::Leaves};

/// Messages within messages.
const DEEPEST: usize = 16;
/// The longest message that is read, bytes: one that holds an image is longer, and in memory a byte of fields takes up to two hundred.
const LONGEST_MESSAGE: usize = 1 << 19;
/// The longest description of messages that is read, bytes.
const LONGEST_SET: usize = 1 << 20;

/// The description of a message from a set of files' descriptions, which is what MCAP keeps as its schema.
pub(crate) fn descriptor(name: &str, set: &[u8]) -> Result<MessageDescriptor, String> {
    if set.len() > LONGEST_SET {
        return Err(format!("a schema of {} kB", set.len() >> 10));
    }
    let pool = DescriptorPool::decode(set).map_err(|e| format!("its schema is damaged: {e}"))?;
    pool.get_message_by_name(name).ok_or_else(|| format!("the schema does not say what {name} is"))
}

/// A message by its description.
pub(crate) fn decode(data: &[u8], own: &MessageDescriptor) -> Result<DynamicMessage, String> {
    if data.len() > LONGEST_MESSAGE {
        return Err(format!("a message of {} kB", data.len() >> 10));
    }
    DynamicMessage::decode(own.clone(), data).map_err(|e| format!("a message is damaged: {e}"))
}

/// Hands every number and text of a message to `leaves`, under its path. A number that is not there is 0, as protobuf means it; a message that
/// is not there has no numbers.
pub(crate) fn leaves(message: &DynamicMessage, into: &mut Leaves<'_>, depth: usize) {
    if depth == DEEPEST {
        return;
    }
    for field in message.descriptor().fields() {
        let is_absent = field.supports_presence() && !message.has_field(&field);
        if is_absent && field.kind().as_message().is_some() {
            continue;
        }
        let before = into.enter(field.name());
        value(&message.get_field(&field), into, depth);
        into.leave(before);
    }
}

fn value(given: &Value, into: &mut Leaves<'_>, depth: usize) {
    match given {
        Value::Bool(is_true) => into.number(f64::from(u8::from(*is_true))),
        Value::I32(x) | Value::EnumNumber(x) => into.number(f64::from(*x)),
        Value::U32(x) => into.number(f64::from(*x)),
        Value::I64(x) => into.number(*x as f64),
        Value::U64(x) => into.number(*x as f64),
        Value::F32(x) => into.number(f64::from(*x)),
        Value::F64(x) => into.number(*x),
        Value::String(text) => into.text(text),
        Value::Message(inner) => leaves(inner, into, depth + 1),
        Value::List(items) if items.len() <= LONGEST => {
            for (i, item) in items.iter().enumerate() {
                let before = into.enter(&i.to_string());
                value(item, into, depth);
                into.leave(before);
            }
        }
        Value::List(_) | Value::Bytes(_) | Value::Map(_) => {}
    }
}

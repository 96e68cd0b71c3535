//! Messages in CDR, the wire format of ROS 2: little or big end first, numbers aligned to their length.

use crate::{
    topics::{
        LONGEST,
        definitions::{Count, Field, Kind, Schema},
        leaves::Leaves,
    },
    whole::{signed, word},
};

/// Messages within messages.
const DEEPEST: usize = 16;

/// Hands every number and text of a message to `leaves`, under its path.
pub(crate) fn decode(data: &[u8], schema: &Schema, leaves: &mut Leaves<'_>) -> Result<(), String> {
    let [_, kind, _, _, body @ ..] = data else {
        return Err("a message ends within its header".to_owned());
    };
    let (is_big, widest) = match (data[0], kind) {
        (0, 0) => (true, 8),
        (0, 1) => (false, 8),
        (0, 6) => (true, 4),
        (0, 7) => (false, 4),
        _ => return Err(format!("encoding {:02x} {kind:02x} is not plain CDR", data[0])),
    };
    Reader { body, at: 0, is_big, widest }
        .message(schema, 0, leaves, 0)
        .ok_or_else(|| format!("a message of {} bytes is shorter than its schema says", data.len()))
}

struct Reader<'a> {
    body: &'a [u8],
    at: usize,
    is_big: bool,
    widest: usize,
}

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let bytes = self.body.get(self.at..self.at.checked_add(count)?)?;
        self.at += count;
        Some(bytes)
    }

    fn align(&mut self, bytes: usize) {
        let to = bytes.min(self.widest);
        self.at = self.at.next_multiple_of(to);
    }

    fn word(&mut self, bytes: usize) -> Option<u64> {
        self.align(bytes);
        Some(word(self.take(bytes)?, self.is_big))
    }

    fn message(
        &mut self,
        schema: &Schema,
        index: usize,
        leaves: &mut Leaves<'_>,
        depth: usize,
    ) -> Option<()> {
        let fields = schema.messages.get(index).filter(|_| depth < DEEPEST)?;
        if fields.is_empty() {
            // A structure needs a member: there is a byte that says nothing.
            self.take(1)?;
        }
        fields.iter().try_for_each(|field| self.field(schema, field, leaves, depth))
    }

    fn field(
        &mut self,
        schema: &Schema,
        field: &Field,
        leaves: &mut Leaves<'_>,
        depth: usize,
    ) -> Option<()> {
        let count = match field.count {
            Count::One => {
                let before = leaves.enter(&field.name);
                self.one(schema, field.kind, leaves, depth)?;
                leaves.leave(before);
                return Some(());
            }
            Count::Fixed(count) => count,
            Count::Any => self.word(4)? as usize,
        };
        let is_told = count <= LONGEST;
        if let Some(bytes) = width(field.kind).filter(|_| !is_told) {
            self.align(bytes);
            self.take(bytes.checked_mul(count)?)?;
            return Some(());
        }
        // Each takes a byte at least.
        if count > self.body.len() {
            return None;
        }
        for i in 0..count {
            let before = leaves.enter_item(&field.name, i);
            leaves.mute(!is_told);
            self.one(schema, field.kind, leaves, depth)?;
            leaves.mute(false);
            leaves.leave(before);
        }
        Some(())
    }

    fn one(
        &mut self,
        schema: &Schema,
        kind: Kind,
        leaves: &mut Leaves<'_>,
        depth: usize,
    ) -> Option<()> {
        match kind {
            Kind::Bool => leaves.number(self.word(1)? as f64),
            Kind::Unsigned(bytes) => leaves.number(self.word(bytes)? as f64),
            Kind::Signed(bytes) => leaves.number(signed(self.word(bytes)?, bytes)),
            Kind::Float(4) => leaves.number(f32::from_bits(self.word(4)? as u32).into()),
            Kind::Float(_) => leaves.number(f64::from_bits(self.word(8)?)),
            Kind::Text => {
                let count = self.word(4)? as usize;
                let text = self.take(count)?;
                leaves.text(&String::from_utf8_lossy(text.strip_suffix(b"\0").unwrap_or(text)));
            }
            Kind::WideText => {
                let count = self.word(4)? as usize;
                self.take(count.checked_mul(2)?)?;
            }
            Kind::Message(index) => self.message(schema, index, leaves, depth + 1)?,
        }
        Some(())
    }
}

fn width(kind: Kind) -> Option<usize> {
    match kind {
        Kind::Bool => Some(1),
        Kind::Signed(bytes) | Kind::Unsigned(bytes) | Kind::Float(bytes) => Some(bytes),
        Kind::Text | Kind::WideText | Kind::Message(_) => None,
    }
}

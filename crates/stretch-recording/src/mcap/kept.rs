//! The messages of an MCAP file, one after the other, with lengths that are believed only as far as a file can reach.
//!
//! The reader of the crate `mcap` adds to lengths without a check, and parses attachments that it was not asked for; both
//! end in a panic on a damaged file. Here lengths have a limit, and of the records only those are parsed that are needed.

use std::borrow::Cow;

use ::mcap::{
    McapError, McapResult, Message, parse_record,
    read::ChannelAccumulator,
    records::{Record, op},
    sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions},
};

/// The longest record, bytes: recorders begin a new chunk after some megabytes.
const LONGEST: usize = 1 << 26;

/// Reads messages in the order of the file; ends at the end of its data, or after the first error.
pub(super) struct Messages<'a> {
    rest: &'a [u8],
    reader: LinearReader,
    known: ChannelAccumulator<'static>,
    is_done: bool,
}

impl<'a> Messages<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        let options = LinearReaderOptions::default()
            .with_skip_end_magic(true)
            .with_record_length_limit(LONGEST);
        let reader = LinearReader::new_with_options(options);
        Self { rest: bytes, reader, known: ChannelAccumulator::default(), is_done: false }
    }

    fn step(&mut self) -> McapResult<Option<Message<'static>>> {
        while let Some(event) = self.reader.next_event() {
            let (opcode, data) = match event? {
                LinearReadEvent::ReadRequest(need) => {
                    let (own, rest) = self.rest.split_at(need.min(self.rest.len()));
                    self.reader.insert(own.len()).copy_from_slice(own);
                    self.reader.notify_read(own.len());
                    self.rest = rest;
                    continue;
                }
                LinearReadEvent::Record { opcode, data } => (opcode, data),
            };
            match opcode {
                op::SCHEMA | op::CHANNEL | op::MESSAGE => {}
                op::DATA_END => return Ok(None),
                _ => continue,
            }
            match parse_record(opcode, data)? {
                Record::Schema { header, data } => {
                    self.known.add_schema(header, Cow::Owned(data.into_owned()))?;
                }
                Record::Channel(channel) => self.known.add_channel(channel)?,
                Record::Message { header, data } => {
                    let unknown = || McapError::UnknownChannel(header.sequence, header.channel_id);
                    return Ok(Some(Message {
                        channel: self.known.get(header.channel_id).ok_or_else(unknown)?,
                        sequence: header.sequence,
                        log_time: header.log_time,
                        publish_time: header.publish_time,
                        data: Cow::Owned(data.into_owned()),
                    }));
                }
                _ => {}
            }
        }
        Ok(None)
    }
}

impl Iterator for Messages<'_> {
    type Item = McapResult<Message<'static>>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.is_done {
            return None;
        }
        let next = self.step().transpose();
        self.is_done = !matches!(next, Some(Ok(_)));
        next
    }
}

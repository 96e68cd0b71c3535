//! The numbers of messages of one topic, a column a path.

use std::collections::{BTreeMap, HashMap};

use stretch_data::Channel;

use crate::room::Room;

/// Memory of a message's time, bytes: its stamp in a list that grows to twice its length, its time, and the step to it.
const STAMP: u64 = 48;
/// Columns of one topic.
const MOST_COLUMNS: usize = 512;

/// Columns that grow by a message.
#[derive(Debug, Default)]
pub(crate) struct Topic {
    /// When each message was logged, ns.
    pub(crate) logged_ns: Vec<i128>,
    index: HashMap<String, usize>,
    columns: Vec<Channel>,
    texts: BTreeMap<String, String>,
    /// Why no more is taken: the room is used up.
    pub(crate) full: Option<String>,
}

impl Topic {
    /// Begins a message; what it holds goes into what is returned.
    pub(crate) fn begin<'a>(&'a mut self, logged_ns: i128, room: &'a mut Room) -> Leaves<'a> {
        let row = self.logged_ns.len();
        self.full = room.take(STAMP).err();
        self.logged_ns.push(logged_ns);
        Leaves { topic: self, room, row, path: String::new(), is_mute: false }
    }

    /// Takes room for what its columns lack, of messages that had no such number.
    ///
    /// # Errors
    /// There is no more.
    pub(crate) fn take_rest(&self, room: &mut Room) -> Result<(), String> {
        let rows = self.logged_ns.len();
        let lack = self.columns.iter().map(|column| rows.saturating_sub(column.values.len()));
        room.take_numbers(lack.sum())
    }

    /// Takes the last message back.
    pub(crate) fn undo(&mut self) {
        self.logged_ns.pop();
        let rows = self.logged_ns.len();
        self.columns.iter_mut().for_each(|column| column.values.truncate(rows));
    }

    /// Its columns, all of one length, NaN where a message had no such number; joints go by their names where messages
    /// carry them (`name[]` beside `position[]`).
    pub(crate) fn into_columns(mut self) -> (Vec<i128>, Vec<Channel>) {
        let rows = self.logged_ns.len();
        for column in &mut self.columns {
            column.values.resize(rows, f64::NAN);
            if let Some((array, item)) = column.name.rsplit_once('.') {
                let group = array.rsplit_once('.').map_or(String::new(), |(g, _)| format!("{g}."));
                let name = self.texts.get(&format!("{group}name.{item}"));
                if let Some(name) = name.filter(|_| item.bytes().all(|b| b.is_ascii_digit())) {
                    column.name = format!("{array}.{name}");
                }
            }
        }
        (self.logged_ns, self.columns)
    }
}

/// Where the numbers of one message go.
#[derive(Debug)]
pub(crate) struct Leaves<'a> {
    topic: &'a mut Topic,
    room: &'a mut Room,
    row: usize,
    path: String,
    is_mute: bool,
}

impl Leaves<'_> {
    /// Goes into a field; what comes back leads out again.
    pub(crate) fn enter(&mut self, name: &str) -> usize {
        let before = self.path.len();
        if before > 0 {
            self.path.push('.');
        }
        self.path.push_str(name);
        before
    }

    /// Goes into an item of an array.
    pub(crate) fn enter_item(&mut self, name: &str, item: usize) -> usize {
        let before = self.enter(name);
        self.path.push('.');
        self.path.push_str(&item.to_string());
        before
    }

    pub(crate) fn leave(&mut self, before: usize) {
        self.path.truncate(before);
    }

    /// Whether what comes is passed over.
    pub(crate) fn mute(&mut self, is_mute: bool) {
        self.is_mute = is_mute;
    }

    pub(crate) fn number(&mut self, value: f64) {
        if self.is_mute || self.topic.full.is_some() {
            return;
        }
        let at = match self.topic.index.get(&self.path) {
            Some(at) => *at,
            None if self.topic.columns.len() == MOST_COLUMNS => return,
            None => {
                self.topic.index.insert(self.path.clone(), self.topic.columns.len());
                self.topic.columns.push(Channel { name: self.path.clone(), values: Vec::new() });
                self.topic.columns.len() - 1
            }
        };
        let values = &mut self.topic.columns[at].values;
        // a message may have a number that a million before it had not; what grows has up to twice its length
        let more = (self.row + 1).saturating_sub(values.len());
        if let Err(full) = self.room.take_numbers(more.saturating_mul(2)) {
            self.topic.full = Some(full);
            return;
        }
        values.resize(self.row, f64::NAN);
        values.push(value);
    }

    pub(crate) fn text(&mut self, text: &str) {
        // Names of joints are those of the first message.
        if !self.is_mute && self.row == 0 {
            self.topic.texts.insert(self.path.clone(), text.to_owned());
        }
    }
}

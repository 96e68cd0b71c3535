//! ROS 2 bags in SQLite (`.db3`): messages in CDR, a clock a topic.
//!
//! A bag may be anything that somebody sends: it is opened from memory, to be read only, and of a database nothing is asked but rows of
//! plain tables, of which a damaged one cannot give more than it has bytes.

use std::{collections::HashMap, path::Path};

use rusqlite::{Connection, OptionalExtension, config::DbConfig, limits::Limit, types::ValueRef};

use crate::{
    RecordingError,
    grid::Track,
    room::Room,
    topics::{Topics, cdr, definitions::Schema, known},
};

/// What is to be recorded where nothing can be read.
const WANTED: &str = "record messages in CDR with MCAP, which keeps their definitions";
/// The longest message, bytes.
const LONGEST: i32 = 1 << 26;
/// Bytes of the file's head that say how it is written: 2 is a log beside the file, which nothing in memory has.
const JOURNAL: std::ops::Range<usize> = 18..20;

/// A topic as the bag describes it.
struct Source {
    name: String,
    schema: Result<Schema, String>,
}

/// Reads all topics whose messages can be understood.
pub(crate) fn read(
    (mut bytes, mut room): (Vec<u8>, Room),
    file: &str,
) -> Result<(Vec<Track>, Vec<String>), RecordingError> {
    let fail =
        |problem| RecordingError::Format { file: file.to_owned(), format: "SQLite", problem };
    let broken =
        |e: rusqlite::Error| fail(format!("{e}; copy it again, or try `ros2 bag reindex`"));
    let mut notes = Vec::new();
    let log = format!("{file}-wal");
    if Path::new(&log).metadata().is_ok_and(|log| log.len() > 0) {
        notes.push(format!("the last messages are in {log} and are not read: it was not closed"));
    }
    if let Some(journal) = bytes.get_mut(JOURNAL) {
        journal.fill(1);
    }
    let length = bytes.len();
    room.take(length as u64).map_err(fail)?;
    let bag = open(bytes).map_err(broken)?;
    for table in ["topics", "messages"] {
        if !has_table(&bag, table).map_err(broken)? {
            return Err(fail(format!(
                "there is no table {table} in it, as a ROS 2 bag has; export what it holds as CSV"
            )));
        }
    }
    let sources = sources(&bag).map_err(broken)?;
    let mut topics = Topics::default();
    match messages(&bag, &sources, length, &mut topics, &mut room) {
        Ok(full) => full.map_err(fail)?,
        Err((0, e)) => return Err(broken(e)),
        Err((count, e)) => {
            notes.push(format!("it breaks off after {count} messages ({e}); those are read"));
        }
    }
    let tracks = topics.into_tracks(WANTED, &mut room, &mut notes).map_err(fail)?;
    Ok((tracks, notes))
}

/// A database that stands in memory, of which nothing but rows can be had.
fn open(bytes: Vec<u8>) -> rusqlite::Result<Connection> {
    let mut bag = Connection::open_in_memory()?;
    bag.set_limit(Limit::SQLITE_LIMIT_LENGTH, LONGEST)?;
    bag.deserialize_read_exact("main", &bytes[..], bytes.len(), true)?;
    bag.set_db_config(DbConfig::SQLITE_DBCONFIG_DEFENSIVE, true)?;
    bag.set_db_config(DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false)?;
    Ok(bag)
}

/// Whether there is a plain table of that name: a view or a virtual table may compute for ever.
fn has_table(bag: &Connection, name: &str) -> rusqlite::Result<bool> {
    let asked = "SELECT sql FROM sqlite_schema WHERE type = 'table' AND name = ?1";
    let sql = bag.query_row(asked, [name], |row| row.get::<_, String>(0)).optional()?;
    let is_plain = |sql: String| {
        let sql = sql.to_ascii_uppercase();
        !sql.contains("VIRTUAL") && !sql.contains("GENERATED") && !sql.contains(" AS ")
    };
    Ok(sql.is_some_and(is_plain))
}

/// The topics by their numbers.
fn sources(bag: &Connection) -> rusqlite::Result<HashMap<i64, Source>> {
    let defines = has_table(bag, "message_definitions")?;
    let mut asked = bag.prepare("SELECT id, name, type, serialization_format FROM topics")?;
    let mut rows = asked.query([])?;
    let mut sources = HashMap::new();
    while let Some(row) = rows.next()? {
        let (kind, form): (String, String) = (row.get(2)?, row.get(3)?);
        let schema = match form.as_str() {
            "cdr" => schema(bag, &kind, defines)?,
            other => Err(format!("messages in {other}")),
        };
        sources.insert(row.get(0)?, Source { name: row.get(1)?, schema });
    }
    Ok(sources)
}

/// The definition of a message, from the bag, else as it is known.
fn schema(bag: &Connection, kind: &str, defines: bool) -> rusqlite::Result<Result<Schema, String>> {
    let asked = "SELECT encoding, encoded_message_definition FROM message_definitions WHERE topic_type = ?1";
    let own = match defines {
        true => bag
            .query_row(asked, [kind], |row| {
                Ok((row.get::<_, String>(0)?, row.get::<_, String>(1)?))
            })
            .optional()?,
        false => None,
    };
    Ok(match own {
        Some((encoding, text)) if encoding == "ros2msg" => Schema::parse(kind, &text),
        own => match (known::definition(kind), own) {
            (Some(text), _) => Schema::parse(kind, &text),
            (None, Some((encoding, _))) => Err(format!("a schema in {encoding}")),
            (None, None) => Err(format!("the bag does not say what {kind} is")),
        },
    })
}

/// Hands all messages to the topics; within is whether there was room. An error comes with the number of messages before it.
fn messages(
    bag: &Connection,
    sources: &HashMap<i64, Source>,
    length: usize,
    topics: &mut Topics,
    room: &mut Room,
) -> Result<Result<(), String>, (usize, rusqlite::Error)> {
    let mut count = 0;
    let mut each = || -> rusqlite::Result<Result<(), String>> {
        let mut asked = bag.prepare("SELECT topic_id, timestamp, data FROM messages")?;
        let mut rows = asked.query([])?;
        while let Some(row) = rows.next()? {
            let (id, logged_ns): (i64, i64) = (row.get(0)?, row.get(1)?);
            let Some(source) = sources.get(&id) else { continue };
            let data = match row.get_ref(2)? {
                ValueRef::Blob(data) => data,
                _ => &[],
            };
            let taken = topics.take(&source.name, room, |topic, room| {
                let schema = source.schema.as_ref().map_err(Clone::clone)?;
                if data.starts_with(b"\x28\xb5\x2f\xfd") {
                    return Err("packed one by one; unpack it with `ros2 bag convert`".to_owned());
                }
                cdr::decode(data, schema, &mut topic.begin(logged_ns.into(), room))
                    .inspect_err(|_| topic.undo())
            });
            count += 1;
            if taken.is_err() || count > length {
                let why = "it gives more messages than it has bytes; copy it again";
                return Ok(taken.and(Err(why.to_owned())));
            }
        }
        Ok(Ok(()))
    };
    each().map_err(|e| (count, e))
}

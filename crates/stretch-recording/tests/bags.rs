//! ROS 2 bags in SQLite, made here as a recorder makes them.
#![cfg(feature = "rosbag")]

use rusqlite::{Connection, params};
use stretch_recording::{ReadOptions, Recording, RecordingError};

const TABLES: &str = "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);";
const DEFINITIONS: &str = "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL, encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);";
const SAMPLES: i64 = 200;
const BEGUN_NS: i64 = 1_714_564_800_000_000_000;

fn angle(i: i64) -> f64 {
    (0.1 * i as f64).sin()
}

/// Plain CDR, little end first: numbers aligned to their length behind a head of four bytes.
struct Cdr(Vec<u8>);

impl Cdr {
    fn new() -> Self {
        Self(vec![0, 1, 0, 0])
    }

    fn put(mut self, bytes: &[u8], align: usize) -> Self {
        let length = (self.0.len() - 4).next_multiple_of(align) + 4;
        self.0.resize(length, 0);
        self.0.extend(bytes);
        self
    }

    fn u32(self, value: usize) -> Self {
        self.put(&(value as u32).to_le_bytes(), 4)
    }

    fn f64(self, value: f64) -> Self {
        self.put(&value.to_le_bytes(), 8)
    }

    fn text(self, text: &str) -> Self {
        let with_end = format!("{text}\0");
        self.u32(with_end.len()).put(with_end.as_bytes(), 1)
    }
}

/// The state of two joints, `sensor_msgs/msg/JointState`.
fn joints(i: i64) -> Vec<u8> {
    let ns = BEGUN_NS + 10_000_000 * i;
    let head = Cdr::new().u32((ns / 1_000_000_000) as usize).u32((ns % 1_000_000_000) as usize);
    let names = head.text("base").u32(2).text("elbow").text("wrist");
    names.u32(2).f64(angle(i)).f64(i as f64).u32(0).u32(0).0
}

/// A bag with joint states, and messages of a type of one's own that only a newer bag describes.
fn bag(is_newer: bool) -> Connection {
    let bag = Connection::open_in_memory().unwrap();
    bag.execute_batch(TABLES).unwrap();
    if is_newer {
        bag.execute_batch(DEFINITIONS).unwrap();
        let define = "INSERT INTO message_definitions(topic_type, encoding, encoded_message_definition, type_description_hash) VALUES (?1, 'ros2msg', ?2, '')";
        bag.execute(define, params!["rig_msgs/msg/Gauge", "float64 bridge_v\nbool is_on"]).unwrap();
    }
    let topic = "INSERT INTO topics VALUES (?1, ?2, ?3, 'cdr', '')";
    bag.execute(topic, params![1, "/joint_states", "sensor_msgs/msg/JointState"]).unwrap();
    bag.execute(topic, params![2, "/gauge", "rig_msgs/msg/Gauge"]).unwrap();
    let message = "INSERT INTO messages(topic_id, timestamp, data) VALUES (?1, ?2, ?3)";
    for i in 0..SAMPLES {
        let at_ns = BEGUN_NS + 10_000_000 * i;
        // they are logged late, which their own stamps know
        bag.execute(message, params![1, at_ns + 3_000_000 + 1000 * (i % 7), joints(i)]).unwrap();
        let gauge = Cdr::new().f64(1.5 + angle(i)).put(&[1], 1).0;
        bag.execute(message, params![2, at_ns, gauge]).unwrap();
    }
    bag
}

fn bytes(mut bag: Connection) -> Vec<u8> {
    bag.serialize("main").unwrap().to_vec()
}

fn read(bytes: &[u8]) -> Result<Recording, RecordingError> {
    Recording::from_reader(bytes, "run_0.db3", &ReadOptions::new())
}

#[test]
fn a_bag_that_describes_its_messages() {
    let Recording { trial, notes } = read(&bytes(bag(true))).unwrap();
    assert_eq!(trial.len(), SAMPLES as usize);
    let elbow = trial.require("joint_states.position.elbow").expect("by its name");
    let volts = trial.require("bridge_v").unwrap();
    for i in 0..SAMPLES {
        let (at, wanted) = (i as usize, angle(i));
        assert!((trial.time_s[at] - 0.01 * i as f64).abs() < 1e-9, "their own stamps");
        assert_eq!((elbow[at], volts[at]), (wanted, 1.5 + wanted));
    }
    assert!(notes.iter().any(|n| n.contains("own stamps")), "{notes:?}");
}

#[test]
fn an_older_bag_is_read_as_far_as_its_messages_are_known() {
    let Recording { trial, notes } = read(&bytes(bag(false))).unwrap();
    assert_eq!(trial.require("joint_states.position.wrist").unwrap()[7], 7.0);
    let told = "left out: /gauge (the bag does not say what rig_msgs/msg/Gauge is)";
    assert!(notes.iter().any(|n| n == told), "{notes:?}");
}

#[test]
fn a_bag_whose_head_says_that_a_log_is_beside_it_is_read() {
    let mut whole = bytes(bag(true));
    whole[18..20].fill(2);
    assert_eq!(read(&whole).unwrap().trial.len(), SAMPLES as usize);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run_0.db3");
    std::fs::write(&path, &whole).unwrap();
    std::fs::write(folder.path().join("run_0.db3-wal"), "messages").unwrap();
    let notes = Recording::read(&path, &ReadOptions::new()).unwrap().notes;
    assert!(notes[0].ends_with("run_0.db3-wal and are not read: it was not closed"), "{notes:?}");
}

#[test]
fn what_is_no_bag_or_would_compute_is_refused() {
    let refused = |tables: &str| {
        let bag = Connection::open_in_memory().unwrap();
        bag.execute_batch(tables).unwrap();
        read(&bytes(bag)).expect_err("no bag").to_string()
    };
    let told = refused("CREATE TABLE log(t REAL, bridge_v REAL)");
    assert!(told.contains("there is no table topics in it, as a ROS 2 bag has"), "{told}");
    let topics = TABLES.split_once(';').unwrap().0;
    let endless = format!(
        "{topics}; INSERT INTO topics VALUES (1, '/a', 'std_msgs/msg/Float64', 'cdr', '');
        CREATE VIEW messages AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT 1 AS topic_id, i AS timestamp, x'' AS data FROM n"
    );
    let told = refused(&endless);
    assert!(told.contains("there is no table messages in it"), "{told}");
    let other = "INSERT INTO topics VALUES (1, '/a', 'a/msg/A', 'cbor', ''); INSERT INTO messages VALUES (1, 1, 5, x'00')";
    let told = refused(&format!("{TABLES} {other}"));
    assert!(
        told.contains("no topic can be read: /a (messages in cbor); record messages"),
        "{told}"
    );
    assert!(refused(TABLES).contains("there is no message in it"));
}

#[test]
fn a_bag_that_breaks_off_or_is_damaged_is_told() {
    let whole = bytes(bag(true));
    for cut in (16..whole.len()).step_by(whole.len() / 97) {
        match read(&whole[..cut]) {
            Ok(Recording { trial, .. }) => trial.check().expect("what is read is sound"),
            Err(error) => assert!(error.to_string().starts_with("run_0.db3"), "{error}"),
        }
    }
    for at in (16..whole.len()).step_by(31) {
        let mut damaged = whole.clone();
        damaged[at] ^= 0x55;
        damaged[(at * 7919) % whole.len()] = 0xff;
        if let Ok(Recording { trial, .. }) = read(&damaged) {
            trial.check().expect("what is read is sound");
        }
    }
}

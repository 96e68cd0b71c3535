//! Peak memory of every reader: four times the file and 256 MB at most, or a refusal.
//!
//! Each file is read by a process of its own, which tells the most memory that it had. The files are such as take most for their size: what
//! they hold repeats, and numbers of a byte have eight in memory.
#![cfg(all(
    target_os = "linux",
    feature = "gzip",
    feature = "npz",
    feature = "mat",
    feature = "hdf5",
    feature = "mcap",
    feature = "parquet",
    feature = "rosbag"
))]

use std::{collections::BTreeMap, fs, io::Cursor, path::Path, process::Command, sync::Arc};

use ::mcap::records::MessageHeader;
use flate2::{Compression, write::GzEncoder, write::ZlibEncoder};
use stretch_recording::{ReadOptions, Recording};

/// Memory that any file may take beside four times its size, bytes.
const BESIDE: u64 = 256 << 20;

/// What the test starts as a process of its own; by itself it does nothing.
#[test]
fn a_child_that_reads() {
    let Some(path) = std::env::var_os("READ_IN_CHILD") else { return };
    let read = Recording::read(Path::new(&path), &ReadOptions::new().sample_rate_hz(100.0));
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    let peak_kb: u64 = peak.trim().trim_end_matches(" kB").parse().unwrap();
    let told = match read {
        Ok(recording) => format!("read {} rows", recording.trial.time_s.len()),
        Err(why) => format!("refused: {why}"),
    };
    println!("\nCHILD {peak_kb} {told}");
}

/// Reads a file in a process of its own: the most memory that it had, bytes, and what came of it.
fn peak(path: &Path) -> (u64, String) {
    let mut child = Command::new(std::env::current_exe().unwrap());
    child.args(["memory::a_child_that_reads", "--exact", "--nocapture", "--test-threads=1"]);
    let output = child.env("READ_IN_CHILD", path).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    let line = text.lines().find_map(|line| line.strip_prefix("CHILD "));
    let line = line.unwrap_or_else(|| panic!("{}: {:?}: {text}", path.display(), output.status));
    let (kb, told) = line.split_once(' ').unwrap();
    (kb.parse::<u64>().unwrap() << 10, told.to_owned())
}

/// Numbers that with their time nearly fill the memory that a small file may take.
const MANY: usize = 7_000_000;

fn text() -> Vec<u8> {
    let rows = (0..2_000_000).map(|i| format!("{:.2},{}\n", 0.01 * f64::from(i), i % 7));
    std::iter::once("time_s,a\n".to_owned()).chain(rows).collect::<String>().into_bytes()
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut out = GzEncoder::new(Vec::new(), Compression::new(6));
    std::io::Write::write_all(&mut out, bytes).unwrap();
    out.finish().unwrap()
}

fn npy(count: usize) -> Vec<u8> {
    let told = format!("{{'descr': '|u1', 'fortran_order': False, 'shape': ({count},), }}");
    let told = format!("{told:<117}\n");
    let head = [b"\x93NUMPY\x01\x00", &(told.len() as u16).to_le_bytes()[..], told.as_bytes()];
    [&head.concat()[..], &vec![1; count]].concat()
}

/// MATLAB's variable of numbers of a byte, packed.
fn mat(count: usize) -> Vec<u8> {
    let padded = |mut bytes: Vec<u8>| {
        bytes.resize(bytes.len().next_multiple_of(8), 0);
        bytes
    };
    let element = |kind: u32, bytes: &[u8]| {
        let head = [kind.to_le_bytes(), (bytes.len() as u32).to_le_bytes()].concat();
        [head, padded(bytes.to_vec())].concat()
    };
    let flags = [9_u32.to_le_bytes(), 0_u32.to_le_bytes()].concat();
    let shape = [(count as u32).to_le_bytes(), 1_u32.to_le_bytes()].concat();
    let parts = [(6, flags), (5, shape), (1, b"a".to_vec()), (2, vec![1; count])];
    let inside: Vec<u8> = parts.iter().flat_map(|(kind, bytes)| element(*kind, bytes)).collect();
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::new(6));
    std::io::Write::write_all(&mut packed, &element(14, &inside)).unwrap();
    let packed = packed.finish().unwrap();
    let mut file = format!("{:<124}", "MATLAB 5.0 MAT-file").into_bytes();
    file.extend([0, 1, b'I', b'M']);
    file.extend(15_u32.to_le_bytes());
    file.extend((packed.len() as u32).to_le_bytes());
    file.extend(packed);
    file
}

fn hdf5(count: usize) -> Vec<u8> {
    let mut file = hdf5_pure::FileBuilder::new();
    let set = file.create_dataset("a").with_f64_data(&vec![1.0; count]);
    set.with_shape(&[count as u64]).with_chunks(&[count as u64]).with_deflate(6);
    file.finish().unwrap()
}

fn parquet(count: usize) -> Vec<u8> {
    use ::parquet::{
        data_type::Int32Type, file::writer::SerializedFileWriter,
        schema::parser::parse_message_type,
    };
    let schema = Arc::new(parse_message_type("message m { OPTIONAL INT32 a; }").unwrap());
    let mut bytes = Vec::new();
    let mut file = SerializedFileWriter::new(&mut bytes, schema, Arc::default()).unwrap();
    let mut group = file.next_row_group().unwrap();
    let mut column = group.next_column().unwrap().unwrap();
    let (values, levels) = (vec![1; count], vec![1; count]);
    column.typed::<Int32Type>().write_batch(&values, Some(&levels), None).unwrap();
    column.close().unwrap();
    group.close().unwrap();
    file.close().unwrap();
    bytes
}

/// So many messages of the same few bytes, and one of another kind behind them.
fn mcap(count: u32, last: &str) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let options = ::mcap::WriteOptions::new().compression(Some(::mcap::Compression::Zstd));
    let mut file = options.create(&mut out).unwrap();
    let channel_id = file.add_channel(0, "a", "json", &BTreeMap::new()).unwrap();
    for sequence in 0..=count {
        let log_time = u64::from(sequence) * 10_000_000;
        let header = MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
        let data = if sequence < count { "1" } else { last };
        file.write_to_known_channel(&header, data.as_bytes()).unwrap();
    }
    file.finish().unwrap();
    drop(file);
    out.into_inner()
}

/// Lists of numbers of a byte.
fn lists(count: usize) -> Vec<u8> {
    use ::parquet::{
        data_type::Int32Type, file::writer::SerializedFileWriter,
        schema::parser::parse_message_type,
    };
    let schema =
        "message m { REQUIRED GROUP a (LIST) { REPEATED GROUP list { REQUIRED INT32 element; } } }";
    let schema = Arc::new(parse_message_type(schema).unwrap());
    let mut bytes = Vec::new();
    let mut file = SerializedFileWriter::new(&mut bytes, schema, Arc::default()).unwrap();
    let mut group = file.next_row_group().unwrap();
    let mut column = group.next_column().unwrap().unwrap();
    let begins: Vec<i16> = (0..count).map(|i| i16::from(i % 4 > 0)).collect();
    let (values, levels) = (vec![1; count], vec![1; count]);
    column.typed::<Int32Type>().write_batch(&values, Some(&levels), Some(&begins)).unwrap();
    column.close().unwrap();
    group.close().unwrap();
    file.close().unwrap();
    bytes
}

#[test]
fn no_file_takes_more_than_four_times_its_size_and_256_mb() {
    let folder = tempfile::tempdir().unwrap();
    // each once small enough to be read, and once beyond what a file of its size may take
    let text = text();
    // what the last message alone has, the others lack
    let keys: Vec<String> = (0..500).map(|i| format!("\"k{i}\":1")).collect();
    let wide = format!("{{{}}}", keys.join(","));
    let cases = [
        ("text.csv", text.clone(), true),
        ("text.csv.gz", gzip(&text), true),
        ("blank.csv.gz", gzip(&[&b"time_s,a\n"[..], &vec![b'\n'; 300_000_000]].concat()), false),
        ("a.npy", npy(MANY), true),
        ("a.npy.gz", gzip(&npy(10 * MANY)), false),
        ("a.mat", mat(MANY), true),
        ("many.mat", mat(3 * MANY), false),
        ("a.h5", hdf5(MANY), true),
        ("many.h5", hdf5(3 * MANY), false),
        ("a.parquet", parquet(MANY), true),
        ("many.parquet", parquet(3 * MANY), false),
        ("lists.parquet", lists(1_000_000), true),
        ("many_lists.parquet", lists(MANY), false),
        ("a.mcap", mcap(1_000_000, "1"), true),
        ("long.mcap", mcap(10, &format!("[1{}]", ",1".repeat(20_000_000))), false),
        ("wide.mcap", mcap(400_000, &wide), false),
    ];
    drop(text);
    let mut wrong = Vec::new();
    for (name, bytes, is_read) in cases {
        let path = folder.path().join(name);
        let most = 4 * bytes.len() as u64 + BESIDE;
        fs::write(&path, &bytes).unwrap();
        let (peak, told) = peak(&path);
        let line = format!(
            "{name}: {} kB, peak {} MB of {}: {told}",
            bytes.len() >> 10,
            peak >> 20,
            most >> 20
        );
        println!("{line}");
        if peak > most || told.starts_with("read ") != is_read {
            wrong.push(line);
        }
        fs::remove_file(path).unwrap();
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

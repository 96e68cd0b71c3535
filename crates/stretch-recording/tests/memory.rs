//! Peak memory of every reader: at most four times the size of the file and 256 MB. Other files are refused.
//!
//! A separate process reads each file and reports its peak memory. The files are those that need most memory for their
//! size: their content is repetitive, and numbers of one byte become eight bytes in memory.
#![cfg(target_os = "linux")]

use std::{fs, path::Path, process::Command};

use flate2::{Compression, write::GzEncoder};

/// Memory that any file may take in addition to four times its size, bytes.
const BESIDE: u64 = 256 << 20;

/// Reads a file in a separate process. Returns its peak memory, bytes, and the result of reading.
///
/// The process is the example `peak_memory`, which `cargo test` builds with the tests.
fn peak(path: &Path) -> (u64, String) {
    let tests = std::env::current_exe().unwrap();
    let program = tests.ancestors().nth(2).unwrap().join("examples/peak_memory");
    assert!(program.is_file(), "{}: cargo build --examples builds it", program.display());
    let output = Command::new(program).arg(path).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    let line = text.trim_end();
    let (kb, told) =
        line.split_once(' ').unwrap_or_else(|| panic!("{}: {output:?}", path.display()));
    (kb.parse::<u64>().unwrap() << 10, told.to_owned())
}

/// Count of numbers that, with their time, nearly fill the memory that a small file may take.
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

/// Returns a file with one column, of lists of four numbers or of one number per row.
#[cfg(feature = "parquet")]
fn parquet(count: usize, is_list: bool) -> Vec<u8> {
    use ::parquet::{
        data_type::Int32Type, file::writer::SerializedFileWriter,
        schema::parser::parse_message_type,
    };
    let schema = match is_list {
        true => "REQUIRED GROUP a (LIST) { REPEATED GROUP list { REQUIRED INT32 element; } }",
        false => "OPTIONAL INT32 a;",
    };
    let schema = parse_message_type(&format!("message m {{ {schema} }}")).unwrap();
    let mut bytes = Vec::new();
    let mut file =
        SerializedFileWriter::new(&mut bytes, schema.into(), Default::default()).unwrap();
    let mut group = file.next_row_group().unwrap();
    let mut column = group.next_column().unwrap().unwrap();
    let begins: Vec<i16> = (0..count).map(|i| i16::from(i % 4 > 0)).collect();
    let (values, levels) = (vec![1; count], vec![1; count]);
    let begins = is_list.then_some(&begins[..]);
    column.typed::<Int32Type>().write_batch(&values, Some(&levels), begins).unwrap();
    column.close().unwrap();
    group.close().unwrap();
    file.close().unwrap();
    bytes
}

#[test]
fn no_file_takes_more_than_four_times_its_size_and_256_mb() {
    let folder = tempfile::tempdir().unwrap();
    // For most formats there are two files: one that is read, and one that is refused because it would take too much
    // memory for its size.
    let text = text();
    let cases = [
        ("text.csv", text.clone(), true),
        ("text.csv.gz", gzip(&text), true),
        ("blank.csv.gz", gzip(&[&b"time_s,a\n"[..], &vec![b'\n'; 300_000_000]].concat()), false),
        ("a.npy", npy(MANY), true),
        ("a.npy.gz", gzip(&npy(10 * MANY)), false),
        #[cfg(feature = "parquet")]
        ("a.parquet", parquet(MANY, false), true),
        #[cfg(feature = "parquet")]
        ("many.parquet", parquet(3 * MANY, false), false),
        #[cfg(feature = "parquet")]
        ("lists.parquet", parquet(1_000_000, true), true),
        #[cfg(feature = "parquet")]
        ("many_lists.parquet", parquet(MANY, true), false),
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

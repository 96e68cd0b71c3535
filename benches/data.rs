//! Reading a trial of a million rows, compared with `csv` and serde on the same bytes.

use std::{hint::black_box, time::Duration};

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use serde::Deserialize;
use stretch_data::{Channel, Trial};
use stretch_recording::{ReadOptions, Recording, RowReader};

const ROWS: usize = 1_000_000;
const SIX: [&str; 5] = ["inlet", "outlet", "pressure_kpa", "length_mm", "bridge_v"];

/// Writes a file as a recorder does: 100 Hz, five decimals.
fn file(names: &[&str]) -> Vec<u8> {
    let mut seed = 1_u64;
    let mut noise = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 40) as f64 / (1 << 24) as f64
    };
    let round = |x: f64, unit: f64| (x / unit).round() * unit;
    let channels = names
        .iter()
        .map(|name| {
            let value = |i: usize| match *name {
                "inlet" | "outlet" => f64::from(u8::from(i % 300 < 150)),
                "pressure_kpa" => round(300.0 + 300.0 * (i as f64 * 1e-3).sin() + noise(), 1e-2),
                "length_mm" => round(165.0 + 15.0 * (i as f64 * 1e-3).sin() + 0.1 * noise(), 1e-4),
                _ => round(1.24 + (i as f64 * 1e-3).sin() + 0.01 * noise(), 1e-5),
            };
            Channel { name: (*name).to_owned(), values: (0..ROWS).map(value).collect() }
        })
        .collect();
    let time_s = (0..ROWS).map(|i| i as f64 / 100.0).collect();
    let mut text = Vec::new();
    let trial = Trial { name: "bench".to_owned(), time_s, channels };
    trial.write_to(&mut text).expect("memory takes everything");
    // Times are rounded, because a recorder does not print digits such as those of 0.30000000000000004.
    let fields = String::from_utf8(text).expect("text");
    fields.lines().map(|line| shorten(line) + "\n").collect::<String>().into_bytes()
}

fn shorten(line: &str) -> String {
    let short = |field: &str| match field.parse::<f64>() {
        Ok(x) if field.len() > 9 => format!("{x:.5}"),
        _ => field.to_owned(),
    };
    line.split(',').map(short).collect::<Vec<_>>().join(",")
}

/// A row with three columns for `csv`.
#[derive(Deserialize)]
struct Three {
    time_s: f64,
    length_mm: f64,
    bridge_v: f64,
}

/// A row with six columns for `csv`.
#[derive(Deserialize)]
struct Six {
    time_s: f64,
    inlet: f64,
    outlet: f64,
    pressure_kpa: f64,
    length_mm: f64,
    bridge_v: f64,
}

fn with_serde<R: for<'de> Deserialize<'de>>(text: &[u8], mut take: impl FnMut(R)) {
    let mut reader = csv::Reader::from_reader(text);
    for row in reader.deserialize() {
        take(row.expect("a row"));
    }
}

/// The faster way to use `csv`: one reused record, parsed by the standard library.
fn with_records(text: &[u8], columns: &mut [Vec<f64>]) {
    let mut reader = csv::Reader::from_reader(text);
    let mut record = csv::ByteRecord::new();
    while reader.read_byte_record(&mut record).expect("a row") {
        for (column, field) in columns.iter_mut().zip(&record) {
            let text = std::str::from_utf8(field).expect("text");
            column.push(text.parse().expect("a number"));
        }
    }
}

fn read(c: &mut Criterion) {
    for names in [&SIX[3..], &SIX[..]] {
        let text = file(names);
        let count = names.len() + 1;
        let mut group = c.benchmark_group(format!("read_{count}_columns"));
        group.throughput(Throughput::Elements(ROWS as u64)).sample_size(10);
        group.warm_up_time(Duration::from_secs(1)).measurement_time(Duration::from_secs(5));
        let options = ReadOptions::new().require("length_mm").require("bridge_v");
        group.bench_function("stretch", |b| {
            b.iter(|| {
                Recording::from_reader(black_box(&text[..]), "bench", &options).expect("a trial")
            })
        });
        group.bench_function("stretch_live", |b| {
            b.iter(|| {
                let mut rows =
                    RowReader::new(black_box(&text[..]), "bench", &options).expect("rows");
                let mut sum = 0.0;
                while let Some(row) = rows.next_row() {
                    sum += row.expect("a row").values[1];
                }
                sum
            })
        });
        group.bench_function("csv_serde", |b| {
            b.iter(|| {
                let mut columns = vec![Vec::new(); count];
                let mut push = |values: &[f64]| {
                    columns.iter_mut().zip(values).for_each(|(column, &x)| column.push(x));
                };
                if count == 3 {
                    with_serde(black_box(&text), |r: Three| {
                        push(&[r.time_s, r.length_mm, r.bridge_v])
                    });
                } else {
                    with_serde(black_box(&text), |r: Six| {
                        push(&[
                            r.time_s,
                            r.inlet,
                            r.outlet,
                            r.pressure_kpa,
                            r.length_mm,
                            r.bridge_v,
                        ])
                    });
                }
                columns
            })
        });
        group.bench_function("csv_record", |b| {
            b.iter(|| {
                let mut columns = vec![Vec::new(); count];
                with_records(black_box(&text), &mut columns);
                columns
            })
        });
        group.bench_function("lines_only", |b| {
            b.iter(|| black_box(&text[..]).split(|&byte| byte == b'\n').count())
        });
        group.finish();
    }
}

criterion_group!(benches, read);
criterion_main!(benches);

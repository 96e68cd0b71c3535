//! Compares diagnoses of a measured recording before and after a known effect is added to it.
//!
//! There are eight recordings of a knitted sleeve on a knee, each with an unknown gap, and five effects at
//! three strengths. `book/src/results/injections.md` has the tables and explains how to read them.
//!
//! `cargo run --release -p stretch-challenge --example injections -- ../shared/data/knit_sleeve`

mod inject;
mod tables;

use std::path::Path;

use inject::{ALL, Injection};
use stretch_challenge::shared_out;
use stretch_data::{Channel, SessionTrial, Trial};
use stretch_gap::{Options, diagnose};
use stretch_problem::{Diagnosable, GaugeSetup, GaugeSimulator};
use stretch_recording::{ReadOptions, Recording};
use stretch_sim::Catalogue;
use tables::{Said, tables};

/// Sessions and sensors; each occurs at least once. The last two recordings have the verdict `partial` at
/// their full length.
const RECORDS: [(&str, &str); 8] = [
    ("heel_curl_45_1", "s1"),
    ("heel_curl_45_2", "s2"),
    ("heel_curl_90_1", "s3"),
    ("heel_curl_90_2", "s4"),
    ("lift_up_1", "s5"),
    ("lift_up_2", "s1"),
    ("heel_curl_90_2", "s3"),
    ("lift_up_1", "s3"),
];
const REFERENCE: &str = "angle_deg";
/// Length of the part of a session that is used, s.
const LENGTH_S: f64 = 120.0;
const WORKERS: usize = 2;

/// Reads the reference and one sensor over the first [`LENGTH_S`] of a session.
fn record(folder: &Path, session: &str, sensor: &str) -> anyhow::Result<Trial> {
    let options = ReadOptions::new().require(REFERENCE).require(sensor);
    let whole = Recording::read(folder.join(format!("{session}.csv")), &options)?.trial;
    let samples = whole.time_s.iter().take_while(|t| **t < LENGTH_S).count();
    let cut = |name: &str| -> anyhow::Result<Channel> {
        Ok(Channel { name: name.into(), values: whole.require(name)?[..samples].to_vec() })
    };
    let channels = vec![cut(REFERENCE)?, cut(sensor)?];
    Ok(Trial { name: whole.name.clone(), time_s: whole.time_s[..samples].to_vec(), channels })
}

/// Diagnoses a recording unchanged, or with an effect added to its signal.
fn said(record: &Trial, injected: Option<(&Injection, usize)>) -> anyhow::Result<Said> {
    let mut trial = record.clone();
    if let Some((injection, which)) = injected {
        let (time_s, signal) = (&record.time_s, &mut trial.channels[1].values);
        injection.apply(injection.strengths[which], time_s, signal);
    }
    let signal = trial.channels[1].name.clone();
    let trials = [SessionTrial::new(trial)];
    let gauge = GaugeSimulator::new(&GaugeSetup {
        trials: &trials,
        reference: REFERENCE,
        signal: &signal,
        rig: None,
        catalogue: &Catalogue::default(),
    })?;
    // Each diagnosis uses one thread, because recordings run in parallel. The answers do not depend on it.
    let options = Options { threads: 1, ..Options::default() };
    let (diagnosis, _) = diagnose(&gauge, &options, &|_| (), &|| false)?;
    Ok(Said { diagnosis, noticed: gauge.notes().to_vec() })
}

fn main() -> anyhow::Result<()> {
    let Some(folder) = std::env::args().nth(1) else {
        println!(
            "SKIPPED: no folder was given; one with {}.csv holds the recordings",
            RECORDS[0].0
        );
        return Ok(());
    };
    let folder = Path::new(&folder);
    if !folder.is_dir() {
        println!("SKIPPED: there is no folder {}", folder.display());
        return Ok(());
    }
    let records = RECORDS
        .iter()
        .map(|(session, sensor)| record(folder, session, sensor))
        .collect::<anyhow::Result<Vec<_>>>()?;
    // Case 0 of a recording is the unchanged recording.
    let cases: Vec<Option<(&Injection, usize)>> = std::iter::once(None)
        .chain(ALL.iter().flat_map(|i| (0..i.strengths.len()).map(move |which| Some((i, which)))))
        .collect();
    let all = shared_out(WORKERS, records.len() * cases.len(), |at| {
        let (case, which) = (cases[at / records.len()], at % records.len());
        let said = said(&records[which], case)?;
        let (session, sensor) = RECORDS[which];
        let what = case.map_or("untouched".into(), |(i, s)| i.in_words(i.strengths[s]));
        eprintln!("{session} {sensor}, {what}: {}", said.in_short());
        Ok(said)
    })?;
    let by_case: Vec<&[Said]> = all.chunks(records.len()).collect();
    print!("{}", tables(by_case[0], &by_case[1..]));
    Ok(())
}

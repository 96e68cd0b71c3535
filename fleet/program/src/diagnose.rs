//! `stretch-fleet diagnose`: diagnoses every partition of a lake as a data set.

use std::{path::PathBuf, sync::Arc};

use anyhow::Context;
use datafusion::arrow::array::{ArrayRef, Float64Array, RecordBatch, StringArray, UInt64Array};
use stretch_gap::{Diagnosis, Options};
use stretch_problem::{GaugeSetup, GaugeSimulator, Problem, RigSession, RigSetup, RigSimulator};
use stretch_sim::{Catalogue, Rig};

use crate::{
    answers::table,
    data_sets::{By, Name, data_sets, lake_with_trials, read, trials},
    lake::{Lake, LakeFile, digest, write_parquet},
    lock::remove_abandoned,
    show::{bar, say},
};

/// Diagnose for every sensor and day which effect causes a gap
///
///   stretch-fleet diagnose --lake lake --out verdicts
///   stretch-fleet diagnose --lake lake --out verdicts --by sensor --share 1/3
///
/// Trials of a sensor and a day (or of a sensor, or of a sensor and a month) are a data set: of a
/// whole rig if they have the openings inlet and outlet, otherwise of a gauge alone. A verdict is
/// written as soon as it is complete, and the next run does not compute it again; verdicts.parquet
/// holds all of them. Diagnoses do not depend on each other: with --share 1/3, 2/3 and 3/3 three
/// machines share them.
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Folder of the lake
    #[arg(long, value_name = "DIR")]
    lake: PathBuf,
    /// Folder for verdicts.parquet
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Which trials form a data set
    #[arg(long, value_enum, default_value_t = By::Day)]
    by: By,
    /// Share of the data sets that is diagnosed here, such as 1/3 for the first third
    #[arg(long, default_value = "1/1", value_parser = share)]
    share: (usize, usize),
    /// Threads of each diagnosis, at most one per core, 0 for all; they do not change the verdict
    #[arg(long, value_name = "N", default_value_t = 0)]
    threads: usize,
    /// Seed of the random numbers for the intervals
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

fn share(text: &str) -> Result<(usize, usize), String> {
    let (which, of) = text.split_once('/').unwrap_or_default();
    match (which.parse(), of.parse()) {
        (Ok(which), Ok(of)) if (1..=of).contains(&which) => Ok((which, of)),
        _ => Err(format!("{text:?} is not a share: write 1/3, 2/3 or 3/3")),
    }
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let lake = lake_with_trials(&args.lake)?;
    let sets = data_sets(&lake, args.by);
    let parts = args.out.join("verdicts");
    std::fs::create_dir_all(&parts).with_context(|| parts.display().to_string())?;
    // Several processes write their shares into the folder in parallel, so it is not locked.
    remove_abandoned(&args.out, 1)?;
    let (which, of) = args.share;
    let open: Vec<_> = sets
        .iter()
        .enumerate()
        .filter(|(i, _)| i % of == which - 1)
        .map(|(_, (name, files))| (parts.join(part(name, files, args.seed)), name, files))
        .filter(|(path, ..)| !path.exists())
        .collect();
    let bar = bar("data sets", open.len());
    for (path, name, files) in &open {
        bar.set_message(name.join("/"));
        let verdict = verdict(&lake, files, &args);
        write_parquet(path, &row(name, files.len(), verdict)?, Vec::new(), None)?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    let done: Vec<PathBuf> = sets
        .iter()
        .map(|(name, files)| parts.join(part(name, files, args.seed)))
        .filter(|path| path.exists())
        .collect();
    let all = read(&done)?;
    write_parquet(&args.out.join("verdicts.parquet"), &all, Vec::new(), None)?;
    say(table(&all)?)?;
    say(format!(
        "{}: {} of {} data sets have a verdict, {} diagnosed now",
        args.out.join("verdicts.parquet").display(),
        all.num_rows(),
        sets.len(),
        open.len()
    ))
}

/// Returns the file name of a verdict. It contains a digest of the trials and the seed.
fn part(name: &Name, files: &[&LakeFile], seed: u64) -> String {
    let seed = seed.to_le_bytes();
    let of = files.iter().map(|file| file.footer.digest.as_bytes());
    let of = digest(std::iter::once(&seed[..]).chain(of));
    format!("{}-{}.parquet", name.join(","), &of[..16])
}

/// Diagnoses a data set.
fn verdict(lake: &Lake, files: &[&LakeFile], args: &Args) -> anyhow::Result<Diagnosis> {
    let trials = trials(files)?;
    let options = Options { threads: args.threads, seed: args.seed, ..Options::default() };
    let catalogue = Catalogue::default();
    let is_rig = trials.iter().all(|t| t.trial.channel("inlet").is_some());
    let problem: Problem = if is_rig {
        let (session, rig) = (RigSession::new(&trials)?, Rig::default());
        RigSimulator::new(RigSetup { session, rig, catalogue: &catalogue })?.into()
    } else {
        let setup = GaugeSetup {
            trials: &trials,
            reference: &lake.about.reference,
            signal: &lake.about.signal,
            rig: None,
            catalogue: &catalogue,
        };
        GaugeSimulator::new(&setup)?.into()
    };
    Ok(problem.examine(&options, false, &|_| (), &|| false)?.diagnosis)
}

/// Returns a verdict as a row: the named effects, their probability, the share of the held-out gap
/// that they close, and the remaining share.
fn row(
    name: &Name,
    trials: usize,
    verdict: anyhow::Result<Diagnosis>,
) -> anyhow::Result<RecordBatch> {
    let text = |value: Option<String>| Arc::new(StringArray::from(vec![value])) as ArrayRef;
    let number = |value: Option<f64>| Arc::new(Float64Array::from(vec![value])) as ArrayRef;
    let (diagnosis, refused) = match verdict {
        Ok(diagnosis) => (Some(diagnosis), None),
        Err(why) => (None, Some(format!("{why:#}"))),
    };
    let diagnosis = diagnosis.as_ref();
    let kind = diagnosis.map(|d| serde_json::to_value(d.verdict())).transpose()?;
    let named = diagnosis.map(|d| d.named().join(" "));
    let best = diagnosis.and_then(|d| {
        d.candidates
            .iter()
            .find(|candidate| !candidate.effects.is_empty() && candidate.effects == d.named())
    });
    let left = diagnosis.and_then(|d| d.answer.unexplained().map(|left| left.share));
    let left = left.or(best.map(|best| 1.0 - best.closed));
    let columns: Vec<(&str, ArrayRef)> = vec![
        ("site", text(Some(name[0].clone()))),
        ("rig", text(Some(name[1].clone()))),
        ("sensor", text(Some(name[2].clone()))),
        ("when", text(Some(name[3].clone()))),
        ("trials", Arc::new(UInt64Array::from(vec![trials as u64])) as ArrayRef),
        ("verdict", text(kind.and_then(|kind| Some(kind.as_str()?.to_owned())))),
        ("named", text(named)),
        ("probability", number(best.map(|best| best.probability))),
        ("closed", number(best.map(|best| best.closed))),
        ("left", number(left)),
        ("sentence", text(diagnosis.map(|d| d.sentence.clone()))),
        ("refused", text(refused)),
    ];
    let columns = columns.into_iter().map(|(name, array)| (name, array, true));
    Ok(RecordBatch::try_from_iter_with_nullable(columns)?)
}

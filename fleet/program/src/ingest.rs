//! `stretch-fleet ingest`: adds trials to a lake.

use std::{
    collections::{BTreeMap, HashMap, HashSet},
    fs,
    path::{Path, PathBuf},
    sync::Mutex,
};

use anyhow::{Context, bail, ensure};
use rayon::prelude::*;
use stretch_calibrate::{parse_rate, rated};
use stretch_core::RateEstimator;
use stretch_data::{Split, Trial, TrialKind, unit};
use stretch_recording::ReadOptions;

use crate::{
    candidates::{Candidate, Known, Seen, candidates},
    lake::{
        About, Footer, Lake, LakeFile, Refused, Samples, accept, digest, refuse, set_aside, write,
    },
    lock::Lock,
    show::{bar, say, warn_of},
    sources::{Source, Where, sources},
};

/// Add trials to a lake, and compute their rates
///
///   stretch-fleet ingest logs --lake lake --from-path '{site}/{rig}/{sensor}/{date}_*.csv'
///   stretch-fleet ingest monday/*.csv --lake lake --sensor 0042 --date 2026-11-21
///
/// A trial is a recording in any format that the program stretch can read. A folder with a
/// dataset.toml contributes the trials that this file lists, any other folder contributes every file
/// below it. Each trial becomes one Parquet file, whole or not at all.
/// Trials that are already in the lake are left unchanged. Files that cannot be read are named in the
/// lake's folder refused, and the rest continues. If anything was refused the exit status is 1. Of
/// files with the same bytes only one counts, whatever their names and dates.
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Trials, or folders of them
    #[arg(required = true, value_name = "TRIAL")]
    trials: Vec<PathBuf>,
    /// Folder of the lake; created if it does not exist
    #[arg(long, value_name = "DIR")]
    lake: PathBuf,
    #[command(flatten)]
    places: Where,
    /// Column of the signal, from which rates are computed [default: the lake's, else bridge_v]
    #[arg(long, value_name = "COL")]
    signal: Option<String>,
    /// Column of the reference [default: the lake's, else length_mm]
    #[arg(long, value_name = "COL")]
    reference: Option<String>,
    /// Estimator of the rate [default: the lake's, else savgol:11,2]
    #[arg(long, value_parser = parse_rate)]
    rate: Option<RateEstimator>,
    /// Length at a contraction of zero [default: the greatest length of a sensor's first trial]
    #[arg(long, value_name = "X")]
    rest_length: Option<f64>,
    /// Column of the time; its last part may be ms, us or ns
    #[arg(long, default_value = "time_s", value_name = "COL")]
    time: String,
}

/// Summary of the run.
#[derive(Debug, Default)]
struct Summary {
    written: usize,
    rows: u64,
    there_already: usize,
    refused: Vec<Refused>,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    if let Some(length) = args.rest_length {
        ensure!(length.is_finite() && length > 0.0, "--rest-length {length} must be above 0");
    }
    fs::create_dir_all(&args.lake).with_context(|| args.lake.display().to_string())?;
    let _lock = Lock::of(&args.lake, usize::MAX)?;
    let mut sources = sources(&args.trials, &args.places)?;
    // A file that was named twice counts once.
    let mut named = HashSet::new();
    sources.retain(|source| {
        let path = source.path.canonicalize().unwrap_or_else(|_| source.path.clone());
        named.insert((path, source.place.as_ref().ok().cloned()))
    });
    ensure!(!sources.is_empty(), "the named paths contain no file");
    let about = about(&args, &sources)?;
    let there = Lake::open(&args.lake)?;
    let mut summary = Summary { refused: set_aside(&there)?, ..Summary::default() };
    let ingest = Ingest {
        folder: &there.folder,
        about: &about,
        options: args.options(&about),
        rest_length: args.rest_length,
        there: there.files.iter().map(|file| file.footer.digest.as_str()).collect(),
        known: Mutex::new(Known::of(&there.files)),
    };
    let (all, mut refused) = candidates(&sources);
    let mut seen = Seen::new(&there.files);
    let mut by_gauge: BTreeMap<[String; 3], Vec<Candidate<'_>>> = BTreeMap::new();
    for one in all {
        match seen.copy(&one) {
            Some(why) => refused.push((&one.source.path, why)),
            None => by_gauge.entry(one.place.gauge().map(str::to_owned)).or_default().push(one),
        }
    }
    for (path, why) in refused {
        summary.refused.push(refuse(&there.folder, path, &why)?);
    }
    let rests = rest_lengths(&there);
    let bar = bar("trials", sources.len());
    let summary = Mutex::new(summary);
    // Trials of one sensor are processed in order, because the first one defines its rest length.
    by_gauge.par_iter().try_for_each(|(gauge, candidates)| {
        let mut rest = rests.get(gauge).copied();
        for candidate in candidates {
            let done = ingest.one(candidate, &mut rest)?;
            bar.inc(1);
            let mut summary = summary.lock().map_err(|_| anyhow::anyhow!("a thread has failed"))?;
            match done {
                Done::Written(rows) => {
                    summary.written += 1;
                    summary.rows += rows;
                }
                Done::There => summary.there_already += 1,
                Done::Refused(refused) => summary.refused.push(refused),
            }
        }
        anyhow::Ok(())
    })?;
    bar.finish_and_clear();
    let summary = summary.into_inner().map_err(|_| anyhow::anyhow!("a thread has failed"))?;
    warn_of("refused:", &summary.refused);
    let Summary { written, rows, there_already, refused } = summary;
    let (refused, lake) = (refused.len(), args.lake.display());
    say(format!(
        "{lake}: {written} trials written ({rows} rows), {there_already} there already, {refused} refused"
    ))?;
    ensure!(
        refused == 0,
        "{refused} files were not added to the lake: {lake}/refused contains the reason for each"
    );
    Ok(())
}

impl Args {
    fn options(&self, about: &About) -> ReadOptions {
        ReadOptions::new().time(&self.time).require(&about.signal).require(&about.reference)
    }
}

/// Returns the description of the lake. For a new lake, uses the requested one, with the sample
/// rate of the first readable trial.
fn about(args: &Args, sources: &[Source]) -> anyhow::Result<About> {
    let there = About::read(&args.lake)?;
    let said = |given: &Option<String>, own: Option<&String>, usual: &str| {
        given.as_ref().or(own).map_or_else(|| usual.to_owned(), Clone::clone)
    };
    let signal = said(&args.signal, there.as_ref().map(|about| &about.signal), "bridge_v");
    let reference =
        said(&args.reference, there.as_ref().map(|about| &about.reference), "length_mm");
    let own = there.as_ref().map(|about| about.rate);
    let rate = args.rate.or(own).unwrap_or(RateEstimator::SAVGOL_11_2);
    if let Some(there) = there {
        let asked = About::new(&signal, &reference, rate, there.sample_rate()?);
        let shown = args.lake.display();
        return match there.check(&asked) {
            Ok(()) => Ok(there),
            Err(why) => bail!("{shown}: the options do not fit this lake: {why}"),
        };
    }
    let options = ReadOptions::new().time(&args.time).require(&signal).require(&reference);
    let mut first = None;
    for source in sources.iter().filter(|source| !source.is_endless()) {
        let rated = source.read(&options).map_err(anyhow::Error::from).and_then(|recording| {
            Ok(rated(&recording.trial, &signal, &[], rate, None)?.sample_rate)
        });
        match (rated, &first) {
            (Ok(sample_rate), _) => {
                let about = About::new(&signal, &reference, rate, sample_rate);
                about.write(&args.lake)?;
                return Ok(about);
            }
            (Err(why), None) => first = Some(format!("{}: {why:#}", source.path.display())),
            _ => {}
        }
    }
    bail!("none of {} trials can be read; the first, {}", sources.len(), first.unwrap_or_default())
}

fn rest_lengths(lake: &Lake) -> HashMap<[String; 3], f64> {
    let known =
        |file: &LakeFile| Some((file.place.gauge().map(str::to_owned), file.footer.rest_length?));
    lake.files.iter().filter_map(known).collect()
}

/// Settings and state of an ingest.
struct Ingest<'a> {
    folder: &'a Path,
    about: &'a About,
    options: ReadOptions,
    rest_length: Option<f64>,
    /// Digests of the source files of the lake's trials.
    there: HashSet<&'a str>,
    known: Mutex<Known>,
}

enum Done {
    Written(u64),
    There,
    Refused(Refused),
}

impl Ingest<'_> {
    fn one(
        &self,
        Candidate { source, place, digest }: &Candidate<'_>,
        rest: &mut Option<f64>,
    ) -> anyhow::Result<Done> {
        let refused = |why: &str| refuse(self.folder, &source.path, why).map(Done::Refused);
        if self.there.contains(digest.as_str()) {
            // A killed run may have written the trial without removing an old refusal.
            accept(self.folder, &source.path)?;
            return Ok(Done::There);
        }
        let path = self.folder.join("trials").join(place.folder());
        let path = path.join(format!("{}.parquet", &digest[..16]));
        let read = source.read(&self.options).map_err(anyhow::Error::from);
        let made = read.and_then(|recording| {
            let (footer, samples) = prepared(self.about, recording.trial, self.rest(*rest)?)?;
            let footer = Footer {
                kind: source.kind(),
                split: source.split(),
                start_s: source.start_s(),
                source: source.path.display().to_string(),
                digest: digest.clone(),
                notes: recording.notes,
                ..footer
            };
            Ok((footer, samples))
        });
        let (footer, samples) = match made {
            Ok(made) => made,
            Err(why) => return refused(&format!("{why:#}")),
        };
        let claimed = match self.known.lock() {
            Ok(mut known) => known.claim(&footer, place),
            Err(_) => bail!("a thread has failed"),
        };
        if let Err(why) = claimed {
            return refused(&why);
        }
        let rows = samples.time_s.len() as u64;
        write(&path, &footer, samples)?;
        accept(self.folder, &source.path)?;
        *rest = footer.rest_length;
        Ok(Done::Written(rows))
    }

    /// Returns the length at a contraction of zero, if the lake (`known`) or the user states it.
    fn rest(&self, known: Option<f64>) -> anyhow::Result<Option<f64>> {
        if let (Some(known), Some(given)) = (known, self.rest_length)
            && known != given
        {
            bail!(
                "the rest length of its sensor is {known} in the lake, but --rest-length is {given}, and one fit cannot use both: \
                 leave out --rest-length"
            );
        }
        Ok(known.or(self.rest_length))
    }
}

/// Returns the rows of a trial and their description, without the source of the trial. `rest` is the length at a
/// contraction of zero; by default, it is the greatest length of the trial.
pub(crate) fn prepared(
    about: &About,
    trial: Trial,
    rest: Option<f64>,
) -> anyhow::Result<(Footer, Samples)> {
    let About { signal, reference, rate, .. } = about;
    let of_samples = samples_digest(&trial);
    let reserved = ["trial", "rate", "is_bridged", "contraction", "site", "rig", "sensor", "date"];
    let others: Vec<&str> = trial
        .channels
        .iter()
        .map(|channel| channel.name.as_str())
        .filter(|name| name != signal && (name == reference || !reserved.contains(name)))
        .collect();
    let names: Vec<String> =
        std::iter::once(signal.as_str()).chain(others.iter().copied()).map(str::to_owned).collect();
    let rated = rated(&trial, signal, &others, *rate, Some(about.sample_rate()?))?;
    let period_s = trial.rate_hz().map_or(1.0 / about.sample_rate_hz, |hz| 1.0 / hz);
    let mut samples = Samples {
        channels: names.iter().map(|name| (name.clone(), Vec::new())).collect(),
        ..Samples::default()
    };
    for part in rated.parts {
        let begin_s = trial.time_s[0] + part.even.begin_s;
        samples.time_s.extend((0..part.even.len()).map(|i| begin_s + i as f64 * period_s));
        samples.is_bridged.extend(&part.even.is_lost);
        for ((_, values), column) in samples.channels.iter_mut().zip(part.even.columns) {
            values.extend(column);
        }
        samples.rate.extend(part.rate);
    }
    let mut rest_length = None;
    if about.is_contraction {
        let own = samples.channels.iter().find(|(name, _)| name == reference);
        let lengths = own.map_or(&[][..], |(_, values)| values);
        let own = rest.unwrap_or_else(|| lengths.iter().copied().fold(f64::MIN, f64::max));
        ensure!(own > 0.0, "the greatest {reference} is {own}, but a rest length must be above 0");
        rest_length = Some(own);
        samples.contraction = Some(lengths.iter().map(|x| (own - x) / own).collect());
    }
    let units = names.iter().filter_map(|name| Some((name.clone(), unit(name)?.to_owned())));
    let footer = Footer {
        about: about.clone(),
        units: units.collect(),
        rest_length,
        dead_band: rated.dead_band,
        kind: TrialKind::Other,
        split: Split::Fit,
        start_s: 0.0,
        source: String::new(),
        samples: of_samples,
        trial: trial.name,
        digest: String::new(),
        notes: Vec::new(),
    };
    Ok((footer, samples))
}

/// Returns a digest of time stamps and channels, independent of the file format.
fn samples_digest(trial: &Trial) -> String {
    let mut bytes = Vec::new();
    let mut take = |name: &str, values: &[f64]| {
        bytes.extend_from_slice(name.as_bytes());
        bytes.extend(values.iter().flat_map(|x| x.to_le_bytes()));
    };
    take("time_s", &trial.time_s);
    trial.channels.iter().for_each(|channel| take(&channel.name, &channel.values));
    digest([bytes.as_slice()])
}

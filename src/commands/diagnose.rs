//! `stretch diagnose`: where simulator and measurement part, which effect causes it, how far the gap closes.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use indicatif::{ProgressBar, ProgressStyle};
use stretch_bench::{GaugeSimulator, RigSimulator};
use stretch_data::RigFile;
use stretch_gap::{
    Diagnosis, Evidence, GapError, Laboratory, Options, Simulator, diagnose, next_experiment,
};
use stretch_sim::Catalogue;

use super::{
    diagnosis_text::text,
    rails::rails,
    shared::{say, short_name, write_text},
};
use crate::report::{Subject, diagnosis_page};

/// Say where a simulator and a measurement part, which effect causes it, and how far the gap closes
///
///   stretch diagnose bench --report gap.html
///
/// DATASET is a folder with dataset.toml and its trials (inlet, outlet, length_mm, bridge_v and,
/// where it was recorded, pressure_kpa), or, for a gauge alone, one trial or such a folder without
/// openings; its columns are length_mm and bridge_v unless they are named:
///
///   stretch diagnose knit.csv --reference angle_deg --signal s2
///
/// Test trials are read once, at the end. Without --rig the rig file that the data set names is
/// the simulator, else the stock rig.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Folder with dataset.toml, or a trial
    #[arg(value_name = "DATASET")]
    data_set: PathBuf,
    /// Rig file: nominal parameters with their tolerances
    #[arg(long, value_name = "rig.toml")]
    rig: Option<PathBuf>,
    /// Write the diagnosis as JSON
    #[arg(long, value_name = "d.json")]
    json: Option<PathBuf>,
    /// Write a report that opens in any browser
    #[arg(long, value_name = "d.html")]
    report: Option<PathBuf>,
    /// Leave an effect out of the catalogue; may be given several times
    #[arg(long, value_name = "EFFECT")]
    without: Vec<String>,
    /// Most effects named at once
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u8).range(1..=8))]
    depth: u8,
    /// Threads, 0 for all; the result is the same
    #[arg(long, value_name = "N", default_value_t = 0)]
    threads: usize,
    /// Seed of the intervals
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Reference column of a gauge alone
    #[arg(long, value_name = "COLUMN", requires = "signal")]
    reference: Option<String>,
    /// Signal column of a gauge alone
    #[arg(long, value_name = "COLUMN", requires = "reference")]
    signal: Option<String>,
    /// Write the recommended experiment as a trial file
    #[arg(long, value_name = "next.csv")]
    experiment: Option<PathBuf>,
    /// Do not look for the experiment that would tell rivals apart
    #[arg(long, hide = true, conflicts_with = "experiment")]
    no_next: bool,
    /// Say what simpler methods would have named, too
    #[arg(long)]
    baselines: bool,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    ensure!(args.data_set.exists(), "{}: there is no such file or folder", args.data_set.display());
    let options = Options {
        depth: args.depth.into(),
        threads: args.threads,
        seed: args.seed,
        baselines: args.baselines,
        ..Options::default()
    };
    let bar = spinner();
    let rig = args.rig.as_deref().map(RigFile::read).transpose()?;
    let shown = || args.data_set.display().to_string();
    let columns = args.reference.as_deref().zip(args.signal.as_deref());
    let catalogue = Catalogue::default().without(&args.without)?;
    let gauge = GaugeSimulator::read(&args.data_set, columns, rig.as_ref(), &catalogue);
    if let Some(simulator) = gauge.with_context(shown)? {
        return answer(&args, &options, &bar, &simulator, simulator.notes(), &[]);
    }
    if !args.data_set.is_dir() {
        bail!(
            "{}: a single trial is diagnosed as a gauge alone: say which columns with \
             --reference and --signal, or give the folder of a data set",
            args.data_set.display()
        );
    }
    let simulator =
        RigSimulator::read(&args.data_set, rig.as_ref(), &catalogue).with_context(shown)?;
    let rails = rails(simulator.nominal(), simulator.session());
    answer(&args, &options, &bar, &simulator, &simulator.session().notes, &rails)
}

/// Diagnoses, looks for the next experiment, and writes; `before` and `after` are notes around the diagnosis' own.
fn answer<L: Laboratory>(
    args: &Args,
    options: &Options,
    bar: &ProgressBar,
    simulator: &L,
    before: &[String],
    after: &[String],
) -> anyhow::Result<()> {
    let shown = || args.data_set.display().to_string();
    let (mut diagnosis, evidence) = work(simulator, options, bar).with_context(shown)?;
    let mut proposal = None;
    if diagnosis.ambiguous.len() > 1 && !args.no_next {
        bar.set_message("the next experiment");
        proposal = next_experiment(simulator, &diagnosis, &evidence).with_context(shown)?;
    }
    diagnosis.next_experiment = proposal.as_ref().map(|p| p.next.clone());
    if let Some(path) = &args.experiment {
        match &proposal {
            Some(proposal) => proposal.trial.write(path)?,
            None => diagnosis
                .notes
                .push("no experiment is recommended: there are no rivals to tell apart".into()),
        }
    }
    diagnosis.notes.extend_from_slice(after);
    diagnosis.notes.splice(0..0, before.iter().cloned());
    bar.finish_and_clear();
    conclude(args, &diagnosis, &evidence, simulator)
}

fn work(
    simulator: &dyn Simulator,
    options: &Options,
    bar: &ProgressBar,
) -> Result<(Diagnosis, Evidence), GapError> {
    let progress = |what: &str| bar.set_message(what.to_owned());
    diagnose(simulator, options, &progress, &stretch_data::interrupted)
}

/// Writes the files first: a message that they are there is then true.
fn conclude(
    args: &Args,
    diagnosis: &Diagnosis,
    evidence: &Evidence,
    simulator: &dyn Simulator,
) -> anyhow::Result<()> {
    let name = name_of(&args.data_set);
    if let Some(path) = &args.json {
        write_text(path, &json(diagnosis, &name, args.seed)?)?;
    }
    if let Some(path) = &args.report {
        let subject = Subject { name: &name, diagnosis, evidence, simulator };
        write_text(path, &diagnosis_page(&subject))?;
    }
    say(&diagnosis.sentence)?;
    say(text(diagnosis))?;
    for path in [&args.json, &args.report].into_iter().flatten() {
        say(format!("wrote {}", path.display()))?;
    }
    Ok(())
}

/// The diagnosis in its schema, with what it was made from.
fn json(diagnosis: &Diagnosis, name: &str, seed: u64) -> anyhow::Result<String> {
    let mut value = serde_json::to_value(diagnosis)?;
    value["data_set"] = name.into();
    value["seed"] = seed.into();
    value["version"] = env!("CARGO_PKG_VERSION").into();
    Ok(serde_json::to_string_pretty(&value)? + "\n")
}

/// What the data are called: the folder's or the file's name.
fn name_of(path: &Path) -> String {
    let real = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    short_name(&real)
}

/// Seen on a terminal only: what goes on, and for how long already.
fn spinner() -> ProgressBar {
    let bar = ProgressBar::new_spinner().with_message("reading");
    // the template is a constant: were it wrong, the plain spinner is shown
    if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} {elapsed}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(std::time::Duration::from_millis(120));
    bar
}

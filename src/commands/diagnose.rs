//! `stretch diagnose`: where simulator and measurement part, which effect causes it, how far the gap closes.

use std::{
    io,
    path::{Path, PathBuf},
};

use anyhow::{Context, ensure};
use indicatif::{ProgressBar, ProgressStyle};
use stretch_bench::{Fix, GaugeSimulator, Implementation, NoFix, RigSimulator};
use stretch_data::{DataError, Outputs, Trial};
use stretch_gap::{
    Diagnosis, Evidence, GapError, Laboratory, Options, Simulator, diagnose, next_experiment,
};
use stretch_report::{Subject, diagnosis_page};
use stretch_sim::Catalogue;

use super::{
    diagnosis_files::{implement_json, not_read, to_json, write_fix, write_snippets},
    diagnosis_text::text,
    problem,
    rails::rails,
    shared::{give_stdout, say, short_name, stage_text},
};

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
/// What is named can be written into a rig file, beside which nothing is missing any more, and
/// as code for a simulator of your own:
///
///   stretch diagnose bench --fix fixed.toml --snippets code
///   stretch diagnose bench --rig fixed.toml
///
/// A simulator of your own, in any language, stands in a problem.toml with its parameters, the
/// recordings, and what may wrap it (stretch init FOLDER writes a first one):
///
///   stretch diagnose problem.toml --jobs 4 --budget 400
///
/// Test trials are read once, at the end. Without --rig the rig file that the data set names is
/// the simulator, else the stock rig. Its parameters may be re-tuned within their tolerances, its
/// effects are part of it.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Folder with dataset.toml, a trial in any format, - for standard input, or problem.toml
    #[arg(value_name = "DATASET")]
    data_set: PathBuf,
    /// Rig file: nominal parameters with their tolerances, and effects that it has already
    #[arg(long, value_name = "rig.toml")]
    rig: Option<PathBuf>,
    /// Write the diagnosis as JSON
    #[arg(long, value_name = "d.json")]
    json: Option<PathBuf>,
    /// Write a report that opens in any browser
    #[arg(long, value_name = "d.html")]
    report: Option<PathBuf>,
    /// Write a rig file with what was found: parameters re-tuned, effects added; a file that exists is replaced
    #[arg(long, value_name = "fixed.toml")]
    fix: Option<PathBuf>,
    /// Write the code of each named effect in C, Python and MATLAB into a new folder
    #[arg(long, value_name = "DIR")]
    snippets: Option<PathBuf>,
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
    /// Workers of a simulator of your own that run at once, where its file does not say
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    jobs: u16,
    /// Most runs of a simulator of your own
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(20..))]
    budget: Option<u32>,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let is_there = args.data_set.as_os_str() == "-" || args.data_set.exists();
    give_stdout(
        [&args.json, &args.report, &args.fix, &args.experiment].map(|path| path.as_deref()),
    )?;
    ensure!(is_there, "{}: there is no such file or folder", args.data_set.display());
    if let Some(fix) = &args.fix {
        not_read(fix, &args.data_set, args.rig.as_deref())?;
    }
    if let Some(folder) = args.snippets.as_deref().filter(|folder| folder.exists()) {
        let is_empty = std::fs::read_dir(folder).is_ok_and(|mut held| held.next().is_none());
        ensure!(is_empty, DataError::Exists { path: folder.display().to_string() });
    }
    let options = Options {
        depth: args.depth.into(),
        threads: args.threads,
        seed: args.seed,
        baselines: args.baselines,
        ..Options::default()
    };
    let bar = spinner();
    let mut args = args;
    let asked = args.data_set.display().to_string();
    if let Some(file) = problem::read(&args.data_set)? {
        let Some(builtin) = problem::builtin(&file) else {
            return of_own(&args, &file, &options, &bar).context(asked);
        };
        args.data_set = builtin.data_set;
        args.rig = args.rig.or(builtin.rig);
        if let (None, Some((reference, signal))) = (&args.reference, builtin.columns) {
            (args.reference, args.signal) = (Some(reference), Some(signal));
        }
    }
    ensure!(
        args.budget.is_none(),
        "--budget counts runs of a simulator of your own; the built-in ones need none"
    );
    let shown = || args.data_set.display().to_string();
    let rig = args.rig.as_deref();
    // what a simulation makes of numbers is the rig file's matter as much as the data's
    let beside = || match rig {
        Some(rig) => format!("{} beside {}", shown(), rig.display()),
        None => shown(),
    };
    let columns = args.reference.as_deref().zip(args.signal.as_deref());
    let catalogue = Catalogue::default().without(&args.without)?;
    let bench = Bench::read(&args.data_set, columns, rig, &catalogue).with_context(shown)?;
    let mut examined = bench.examine(&options, !args.no_next, &bar).with_context(beside)?;
    if args.experiment.is_some() && examined.experiment.is_none() {
        let none = "no experiment is recommended: there are no rivals to tell apart";
        examined.diagnosis.notes.push(none.to_owned());
    }
    bar.finish_and_clear();
    conclude(&args, &examined, &bench)
}

/// A simulator of the user's own.
fn of_own(
    args: &Args,
    file: &stretch_problem::ProblemFile,
    options: &Options,
    bar: &ProgressBar,
) -> anyhow::Result<()> {
    problem::refuse(&[
        ("--rig", args.rig.is_some()),
        ("--fix", args.fix.is_some()),
        ("--snippets", args.snippets.is_some()),
        ("--reference", args.reference.is_some()),
        ("--experiment", args.experiment.is_some()),
        ("--without", !args.without.is_empty()),
    ])?;
    let asked = problem::Asked {
        options,
        json: args.json.as_deref(),
        report: args.report.as_deref(),
        jobs: args.jobs.into(),
        budget: args.budget.map(|n| n as usize),
    };
    problem::run(file, &asked, bar)
}

/// What is diagnosed: a whole rig, or a gauge alone.
pub(super) enum Bench {
    Rig(Box<RigSimulator>),
    Gauge(Box<GaugeSimulator>),
}

/// A diagnosis, what it was found from, and the experiment that it recommends.
pub(super) struct Examined {
    pub(super) diagnosis: Diagnosis,
    pub(super) evidence: Evidence,
    pub(super) experiment: Option<Trial>,
    /// What is named, as something to type.
    pub(super) implementations: Vec<Implementation>,
}

impl Bench {
    /// A data set's folder, or a trial of which `columns` are reference and signal.
    pub(super) fn read(
        path: &Path,
        columns: Option<(&str, &str)>,
        rig: Option<&Path>,
        catalogue: &Catalogue,
    ) -> anyhow::Result<Self> {
        if let Some(gauge) = GaugeSimulator::read(path, columns, rig, catalogue)? {
            return Ok(Self::Gauge(Box::new(gauge)));
        }
        ensure!(
            path.is_dir(),
            "a single trial is diagnosed as a gauge alone: say which columns with --reference and --signal, \
             or give the folder of a data set"
        );
        Ok(Self::Rig(Box::new(RigSimulator::read(path, rig, catalogue)?)))
    }

    pub(super) fn simulator(&self) -> &dyn Simulator {
        match self {
            Self::Rig(rig) => rig.as_ref(),
            Self::Gauge(gauge) => gauge.as_ref(),
        }
    }

    /// The rig or the gauge with what was found of it.
    fn fixed(&self, examined: &Examined) -> Result<Fix, NoFix> {
        let Examined { diagnosis, evidence, .. } = examined;
        match self {
            Self::Rig(rig) => rig.fixed(diagnosis, evidence),
            Self::Gauge(gauge) => gauge.fixed(diagnosis, evidence),
        }
    }

    /// Diagnoses; with `look_on` it looks for the experiment that would tell rivals apart.
    pub(super) fn examine(
        &self,
        options: &Options,
        look_on: bool,
        bar: &ProgressBar,
    ) -> Result<Examined, GapError> {
        let examined = match self {
            Self::Gauge(gauge) => {
                examine(gauge.as_ref(), options, look_on, bar, gauge.notes(), &[])
            }
            Self::Rig(rig) => {
                let rails = rails(rig.nominal(), rig.session());
                examine(rig.as_ref(), options, look_on, bar, rig.notes(), &rails)
            }
        }?;
        let Examined { diagnosis, evidence, .. } = &examined;
        let implementations = match self {
            Self::Rig(rig) => rig.implementations(diagnosis, evidence),
            Self::Gauge(gauge) => gauge.implementations(diagnosis, evidence),
        };
        // A sample time that was diagnosed is one.
        Ok(Examined { implementations: implementations.unwrap_or_default(), ..examined })
    }
}

/// `before` and `after` are notes around the diagnosis' own.
fn examine<L: Laboratory>(
    simulator: &L,
    options: &Options,
    look_on: bool,
    bar: &ProgressBar,
    before: &[String],
    after: &[String],
) -> Result<Examined, GapError> {
    let progress = |what: &str| bar.set_message(what.to_owned());
    let (mut diagnosis, evidence) =
        diagnose(simulator, options, &progress, &stretch_data::interrupted)?;
    let mut proposal = None;
    if diagnosis.ambiguous.len() > 1 && look_on {
        bar.set_message("the next experiment");
        proposal = next_experiment(simulator, &diagnosis, &evidence)?;
    }
    diagnosis.next_experiment = proposal.as_ref().map(|p| p.next.clone());
    diagnosis.notes.extend_from_slice(after);
    diagnosis.notes.splice(0..0, before.iter().cloned());
    let experiment = proposal.map(|p| p.trial);
    Ok(Examined { diagnosis, evidence, experiment, implementations: Vec::new() })
}

/// Writes the files first, all or none: a message that they are there is then true.
fn conclude(args: &Args, examined: &Examined, bench: &Bench) -> anyhow::Result<()> {
    let Examined { diagnosis, evidence, implementations, .. } = examined;
    let name = name_of(&args.data_set);
    let fix = bench.fixed(examined);
    let (mut said, mut outputs) = (Vec::new(), Outputs::default());
    if let (Some(path), Some(trial)) = (&args.experiment, &examined.experiment) {
        trial.check()?;
        outputs.file(path, |out| trial.write_to(out).map_err(io::Error::other))?;
    }
    if let Some(path) = &args.json {
        let implement = implementations.iter().map(implement_json).collect();
        let fixed_rig = fix.as_ref().ok().map(|fix| &fix.file);
        let json = to_json(diagnosis, implement, fixed_rig, &name, args.seed)?;
        stage_text(&mut outputs, path, &json)?;
        said.push(format!("wrote {}", path.display()));
    }
    if let Some(path) = &args.report {
        let simulator = bench.simulator();
        let subject = Subject { name: &name, diagnosis, evidence, implementations, simulator };
        stage_text(&mut outputs, path, &diagnosis_page(&subject))?;
        said.push(format!("wrote {}", path.display()));
    }
    if let Some(path) = &args.fix {
        said.push(write_fix(&mut outputs, path, &fix, &name, args.seed)?);
    }
    if let Some(folder) = &args.snippets {
        said.push(write_snippets(&mut outputs, folder, implementations)?);
    }
    outputs.keep()?;
    print(examined)?;
    said.iter().try_for_each(say)
}

/// The sentence, and everything behind it.
pub(super) fn print(examined: &Examined) -> anyhow::Result<()> {
    say(&examined.diagnosis.sentence)?;
    say(text(&examined.diagnosis, &examined.implementations))
}

/// What the data are called: the folder's or the file's name.
pub(super) fn name_of(path: &Path) -> String {
    if path.as_os_str() == "-" {
        return "standard input".to_owned();
    }
    let real = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    short_name(&real)
}

/// Seen on a terminal only: what goes on, and for how long already.
pub(super) fn spinner() -> ProgressBar {
    let bar = ProgressBar::new_spinner().with_message("reading");
    // the template is a constant: were it wrong, the plain spinner is shown
    if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} {elapsed}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(std::time::Duration::from_millis(120));
    bar
}

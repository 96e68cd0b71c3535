//! `stretch blind`: does the diagnosis name causes that it was never told?

use std::{
    fs,
    path::{Path, PathBuf},
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering::SeqCst},
    },
};

use anyhow::{Context, bail, ensure};
use stretch_blind::{Clutter, Family, Plan, Protocol, make};
use stretch_data::write_folder;

use super::{
    blind_answers::{ANSWER, cases},
    blind_room::Room,
    blind_score,
    json::Json,
    shared::{recover, steps, tell, write_text},
    stop,
};

/// Check the diagnosis on cases whose causes are sealed until it has answered
///
///   stretch blind --cases 360 --seed 7 --out check
///
/// makes the cases, prints the hash of the sealed labels, diagnoses a copy of every case in a
/// temporary folder and a process of its own that is not told where the labels are, and only then
/// opens the seal and scores. The cases come from
/// a second simulator that shares no code with the first and draws other forms of every effect, and
/// what is around each rig. The
/// three steps can be run one by one; `run` goes on where it was stopped.
#[derive(clap::Args)]
#[command(verbatim_doc_comment, args_conflicts_with_subcommands = true)]
pub(crate) struct Args {
    #[command(subcommand)]
    step: Option<Step>,
    /// How many cases
    #[arg(long, value_name = "N", value_parser = count)]
    cases: Option<usize>,
    /// Seed of the cases; those below 1000000 are for development
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Folder that the cases, the answers and the report go to; it must not hold anything
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    forms: Forms,
    #[command(flatten)]
    options: RunOptions,
    #[command(flatten)]
    json: Json,
}

#[derive(clap::Subcommand)]
enum Step {
    /// Make the cases and seal their labels
    Make(MakeArgs),
    /// Diagnose every case without its label
    Run(RunArgs),
    /// Open the seal and score the answers
    Score(ScoreArgs),
}

/// Most cases: a case is a megabyte or two, so that these fill a disk.
const MOST_CASES: usize = 100_000;

fn count(text: &str) -> Result<usize, String> {
    let cases = text.parse::<usize>().ok().filter(|cases| *cases <= MOST_CASES);
    cases.ok_or_else(|| format!("\"{text}\" is not a number of cases up to {MOST_CASES}"))
}

#[derive(clap::Args)]
struct MakeArgs {
    /// How many cases: single effects, none, several, foreign ones and ones struck out
    #[arg(long, value_name = "N", value_parser = count)]
    cases: usize,
    /// Seed; those below 1000000 are for development
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Folder that the cases go to; it must not hold anything
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    forms: Forms,
}

/// Where the forms of the effects, and what is around a rig, come from.
#[derive(clap::Args)]
struct Forms {
    /// Family that the forms are drawn from: written, splines, spectra, rate_laws, asymmetric, or
    /// all of them in turn
    #[arg(long, value_name = "NAME|all", default_value = "all", value_parser = family)]
    family: Families,
    /// Supply, noise, clock and pauses: plain is the same for every rig, drawn another for each
    #[arg(long, value_name = "plain|drawn", default_value = "drawn", value_parser = clutter)]
    clutter: Clutter,
    /// Trials of a session: paper, or paper+ with one more at 0.7 of the excitation
    #[arg(long, value_name = "paper|paper+", default_value = "paper", value_parser = protocol)]
    protocol: Protocol,
}

/// One family, or all in turn.
#[derive(Clone, Copy)]
struct Families(Option<Family>);

fn family(name: &str) -> Result<Families, String> {
    if name == "all" {
        return Ok(Families(None));
    }
    let known = || Family::ALL.map(Family::name).join(", ");
    Family::named(name)
        .map(|family| Families(Some(family)))
        .ok_or_else(|| format!("there are {}, all", known()))
}

fn clutter(name: &str) -> Result<Clutter, String> {
    let found = Clutter::ALL.into_iter().find(|clutter| clutter.name() == name);
    found.ok_or_else(|| "there are plain, drawn".to_owned())
}

fn protocol(name: &str) -> Result<Protocol, String> {
    let found = Protocol::ALL.into_iter().find(|protocol| protocol.name() == name);
    found.ok_or_else(|| "there are paper, paper+".to_owned())
}

#[derive(clap::Args)]
struct RunArgs {
    /// Folder with the cases
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    #[command(flatten)]
    options: RunOptions,
}

#[derive(clap::Args)]
struct RunOptions {
    /// Cases diagnosed at a time [default: one a core]
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// Answer again where there is an answer
    #[arg(long)]
    again: bool,
    /// Leave out the simpler methods that are run beside for comparison
    #[arg(long)]
    no_baselines: bool,
}

#[derive(clap::Args)]
struct ScoreArgs {
    /// Folder with the cases and their answers
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Leave out the fits that know the labels
    #[arg(long)]
    no_oracle: bool,
    #[command(flatten)]
    json: Json,
}

/// Why there is none.
const REFUSAL: &str = "refusal.txt";
/// What the diagnosis is told beside the data.
const HINT: &str = "hint.toml";

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    match args.step {
        Some(Step::Make(args)) => return make_cases(&args),
        Some(Step::Run(args)) => return answer(&args.folder, &args.options),
        Some(Step::Score(args)) => {
            return blind_score::score(&args.folder, !args.no_oracle, &args.json);
        }
        None => {}
    }
    args.json.share_stdout([])?;
    let (Some(cases), Some(out)) = (args.cases, args.out) else {
        bail!("say how many cases and where to: stretch blind --cases 360 --seed 7 --out check");
    };
    let make = MakeArgs { cases, seed: args.seed, out, forms: args.forms };
    make_cases(&make)?;
    answer(&make.out, &args.options)?;
    blind_score::score(&make.out, true, &args.json)
}

fn make_cases(args: &MakeArgs) -> anyhow::Result<()> {
    ensure!(args.cases > 0, "--cases 0: there is nothing to make");
    let bar = steps("making cases", args.cases);
    let Forms { family: Families(family), clutter, protocol } = args.forms;
    let plan = Plan { family, clutter, protocol, ..Plan::of(args.cases) };
    recover(&args.out)?;
    let mut seal = None;
    let told = |done| bar.set_position(done as u64);
    // whoever opened a seal must not get another under its name: nothing is ever replaced
    write_folder(&args.out, false, |folder| {
        seal = Some(make(folder, args.seed, &plan, &told)?);
        anyhow::Ok(())
    })?;
    bar.finish_and_clear();
    let sha256 = seal.map_or(String::new(), |seal| seal.sha256().to_owned());
    tell(format!(
        "made {} cases in {}; labels sealed, SHA-256 {sha256}",
        args.cases,
        args.out.display(),
    ))
}

/// Diagnoses every case that has no answer yet.
fn answer(folder: &Path, options: &RunOptions) -> anyhow::Result<()> {
    ensure!(
        folder.join("seal.sha256").is_file(),
        "{}: the labels are not sealed (no seal.sha256): make the cases first",
        folder.display()
    );
    stop::tidy();
    let program = std::env::current_exe().context("the program's own path")?;
    let all = cases(folder)?;
    let waiting: Vec<&(String, PathBuf)> =
        all.iter().filter(|(_, path)| options.again || !path.join(ANSWER).is_file()).collect();
    let bar = steps("diagnosing", all.len());
    bar.set_position((all.len() - waiting.len()) as u64);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = options.jobs.unwrap_or(cores).clamp(1, waiting.len().max(1));
    let next = AtomicUsize::new(0);
    let failed: Mutex<Option<anyhow::Error>> = Mutex::new(None);
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| {
                while let Some((name, path)) = waiting.get(next.fetch_add(1, SeqCst)) {
                    if stretch_data::interrupted() {
                        return;
                    }
                    let done = one(&program, path, jobs > 1, options).with_context(|| name.clone());
                    if let Err(error) = done {
                        // The others stop at their next case.
                        next.store(waiting.len(), SeqCst);
                        if let Ok(mut failed) = failed.lock() {
                            failed.get_or_insert(error);
                        }
                    }
                    bar.inc(1);
                }
            });
        }
    });
    bar.finish_and_clear();
    ensure!(!stretch_data::interrupted(), "interrupted");
    if let Some(error) = failed.into_inner().unwrap_or(None) {
        return Err(error);
    }
    let refused = all.iter().filter(|(_, path)| !path.join(ANSWER).is_file()).count();
    let answered = all.len() - refused;
    tell(format!("answered {answered} of {} cases, {refused} refused", all.len()))
}

/// Diagnoses one case in a process that is given a copy of its data and nothing else.
fn one(program: &Path, case: &Path, alone: bool, options: &RunOptions) -> anyhow::Result<()> {
    let room = Room::of(case, &[ANSWER, REFUSAL, HINT])?;
    let mut command = room.command(program);
    command.args(["diagnose", ".", "--json-out", ANSWER, "--no-next"]);
    for name in struck(case)? {
        command.args(["--without", &name]);
    }
    if alone {
        command.args(["--threads", "1"]);
    }
    if !options.no_baselines {
        command.arg("--baselines");
    }
    let output = command.output().context("the program cannot run itself")?;
    let (file, text) = if output.status.success() {
        (ANSWER, room.read(ANSWER)?)
    } else {
        let why = String::from_utf8_lossy(&output.stderr).into_owned();
        ensure!(output.status.code() == Some(1), "the diagnosis broke off: {why}");
        // A refusal is an answer, too: it is scored as none.
        (REFUSAL, why)
    };
    room.close()?;
    write_text(&case.join(file), &text)
}

/// Effects that a case's `hint.toml` takes out of the catalogue.
fn struck(case: &Path) -> anyhow::Result<Vec<String>> {
    let path = case.join(HINT);
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    let hint: Hint = toml::from_str(&text).with_context(|| path.display().to_string())?;
    Ok(hint.without)
}

#[derive(serde::Deserialize)]
struct Hint {
    #[serde(default)]
    without: Vec<String>,
}

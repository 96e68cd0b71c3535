//! The program `challenge`, which tests whether a diagnosis names causes that were sealed before it
//! ran.

use std::{path::PathBuf, process::ExitCode};

use clap::Parser;
use stretch_blind::{Family, Plan, PlantName};
use stretch_challenge::{
    Asked, RunOptions, board, is_stopped, make_cases, make_open, on_ctrl_c, run_cases, say,
    score_answers, score_open, write_diagnosis,
};

/// Check the diagnosis on cases whose causes are sealed until it has answered
///
///   challenge --cases 360 --seed 7 --out check
///
/// makes the cases, prints the hash of the sealed labels, diagnoses a copy of every case in a
/// temporary folder, in a separate process that does not know where the labels are, and only then
/// opens the seal, scores and writes a page. The cases come from a second simulator that shares no
/// code with the first. It draws other forms of every effect and other disturbances of each rig.
/// The three steps can be run one by one; `run` continues where it was stopped.
#[derive(clap::Parser)]
#[command(
    name = "challenge",
    version,
    verbatim_doc_comment,
    args_conflicts_with_subcommands = true
)]
#[command(max_term_width = 100)]
struct Args {
    #[command(subcommand)]
    step: Option<Step>,
    #[command(flatten)]
    make: Option<Make>,
    #[command(flatten)]
    options: RunOptions,
}

#[derive(clap::Subcommand)]
enum Step {
    /// Make the cases and seal their labels
    Make(Make),
    /// Diagnose every case without its label
    Run {
        /// Folder with the cases
        #[arg(value_name = "DIR")]
        folder: PathBuf,
        #[command(flatten)]
        options: RunOptions,
    },
    /// Open the seal, score the answers, write score.json and report.html; or score a submission
    Score {
        /// Folder with the cases and their answers, or a submission.json
        #[arg(value_name = "DIR|submission.json")]
        folder: PathBuf,
        /// Set of the submission; its labels are in DIR-sealed
        #[arg(long, value_name = "DIR", default_value = "set")]
        set: PathBuf,
        /// File with the seeds whose labels were opened
        #[arg(long, value_name = "FILE", default_value = SPENT)]
        spent: PathBuf,
        /// Score only the first N cases of a set, for a submission that is not complete
        #[arg(long, value_name = "N")]
        first: Option<usize>,
    },
    /// Write the leaderboard of scores
    Board {
        /// Scores that `challenge score submission.json` wrote
        #[arg(value_name = "FILE.score.json", required = true)]
        scores: Vec<PathBuf>,
        /// The page
        #[arg(long, value_name = "FILE.html", default_value = "leaderboard.html")]
        out: PathBuf,
    },
    /// Diagnose one folder, as `run` does in a separate process
    #[command(hide = true)]
    Diagnose(Asked),
}

/// Arguments of the command that makes cases.
#[derive(clap::Args)]
struct Make {
    /// Number of cases: single effects, none, several, causes outside the catalogue, and effects
    /// whose entry is removed
    #[arg(long, value_name = "N", value_parser = count)]
    cases: usize,
    /// Seed; those below 1000000 are for development
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Folder for the cases; it must be empty
    #[arg(long, value_name = "DIR", default_value = "challenge-check")]
    out: PathBuf,
    /// Family from which the forms are drawn: written, splines, spectra, rate_laws or asymmetric
    /// [default: all of them in turn]
    #[arg(long, value_name = "NAME")]
    family: Option<Family>,
    /// Make an open set for other methods, of this plant: rig, servo or thermal; its labels go to
    /// DIR-sealed
    #[arg(long, value_name = "NAME")]
    plant: Option<PlantName>,
    /// Family of forms and noise in addition to the published ones: a JSON file that is not published
    #[arg(long, value_name = "FILE.json", requires = "plant")]
    private: Option<PathBuf>,
    /// File with the seeds whose labels were opened; these seeds are refused
    #[arg(long, value_name = "FILE", default_value = SPENT)]
    spent: PathBuf,
}

/// File with the spent seeds, in the working folder.
const SPENT: &str = "spent_seeds.csv";

/// Largest number of cases. A case needs one to two megabytes, so this number fills a disk.
const MOST_CASES: usize = 100_000;

fn count(text: &str) -> Result<usize, String> {
    let cases = text.parse::<usize>().ok().filter(|cases| *cases <= MOST_CASES);
    cases.ok_or_else(|| format!("\"{text}\" is not a number of cases up to {MOST_CASES}"))
}

fn main() -> ExitCode {
    // without a handler Ctrl-C still ends the program; only the cleaning up is lost
    let _ = ctrlc::set_handler(on_ctrl_c);
    match run(Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(_) if is_stopped() => ExitCode::from(130),
        Err(error) => {
            eprintln!("challenge: {}", stretch_data::error_sentence(error.as_ref()));
            ExitCode::FAILURE
        }
    }
}

fn run(args: Args) -> anyhow::Result<()> {
    match (args.step, args.make) {
        (Some(Step::Make(make)), _) => made(&make),
        (Some(Step::Run { folder, options }), _) => answered(&folder, &options),
        (Some(Step::Score { folder, set, spent, first }), _) if folder.is_file() => {
            say(score_open(&folder, &set, &spent, first)?);
            Ok(())
        }
        (Some(Step::Score { folder, .. }), _) => scored(&folder),
        (Some(Step::Board { scores, out }), _) => {
            let page = board(&scores)?;
            stretch_data::files::write_whole(&out, |file| file.write_all(page.as_bytes()))?;
            say(format!("wrote {}", out.display()));
            Ok(())
        }
        (Some(Step::Diagnose(asked)), _) => write_diagnosis(&asked),
        (None, Some(make)) => {
            made(&make)?;
            answered(&make.out, &args.options)?;
            scored(&make.out)
        }
        (None, None) => anyhow::bail!("say how many cases: challenge --cases 100"),
    }
}

fn made(make: &Make) -> anyhow::Result<()> {
    if let Some(plant) = make.plant {
        let (size, private) = ((make.cases, make.seed), make.private.as_deref());
        let hash = make_open(plant, &make.out, size, private, &make.spent)?;
        let (cases, out) = (make.cases, make.out.display());
        say(format!("made {cases} cases in {out}; labels sealed in {out}-sealed, SHA-256 {hash}"));
        return Ok(());
    }
    let plan = Plan { family: make.family, ..Plan::of(make.cases) };
    let sha256 = make_cases(&make.out, make.seed, &plan)?;
    let (cases, out) = (make.cases, make.out.display());
    say(format!("made {cases} cases in {out}; labels sealed, SHA-256 {sha256}"));
    Ok(())
}

fn answered(folder: &std::path::Path, options: &RunOptions) -> anyhow::Result<()> {
    let (answered, cases) = run_cases(folder, options)?;
    say(format!("answered {answered} of {cases} cases, {} refused", cases - answered));
    Ok(())
}

fn scored(folder: &std::path::Path) -> anyhow::Result<()> {
    say(score_answers(folder)?);
    say(format!("wrote {}", folder.join("report.html").display()));
    Ok(())
}

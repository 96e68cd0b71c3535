//! `stretch demo`: calibration and diagnosis on the simulated rig or on measured sessions, in one
//! report.

mod published;
mod sessions;

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use indicatif::{MultiProgress, ProgressBar};
use stretch_calibrate::{
    Calibrated, Candidate, Evaluation, MODELS_IN_WORDS, MethodErrors, ModelChoice, ModelKind,
    Options, apply, calibrate, choose_model, evaluate, rank_signals, write_calibration,
};
use stretch_data::files::{write_folder, write_whole};
use stretch_data::{Trial, TrialKind, listed};
use stretch_problem::{Causes, Examined, Problem, in_words};
use stretch_report::{Context, Judged, Subject, calibration_verdict, demo_page, readme_picture};
use stretch_sim::{ActiveEffect, RunSettings, TrialPlan, demo_preset, effect_named};

use super::{
    calibration_text::{blocks_of_calibration, blocks_of_models, blocks_of_notes},
    diagnose::{print as print_diagnosis, told_on},
    evaluate::table_of_errors,
    json::Json,
    reading::column,
    shared::{doubt, or_force, say, say_first, spinner, tell, write_text},
    simulate,
};
use crate::display::{is_quiet, is_verbose};
use sessions::Sessions;

/// Demonstration: calibrate, evaluate, find why simulator and rig disagree; one report
///
/// Simulates the paper's experiment on a rig with effects that the simulator lacks,
/// and writes it as a data set. Then, as in a lab, it fits the paper's calibrations
/// to the ramps and a model chosen by cross-validation, evaluates all of them on
/// arbitrary and pulse trials that were not fitted, and diagnoses the simulator.
///
/// The same on measured sessions:
///
///   stretch demo --data bench          a folder with a dataset.toml
///   stretch demo --data knit_sleeve    CSV files with time_s, a reference, signals;
///                                      a_1.csv and a_2.csv are sessions of one group
///   stretch demo --data HC_90/S15_16_HC90
///                                      files as their authors published them
///
/// The last example is a knee in a knitted sleeve with motion capture (MIT licence),
/// github.com/e-Body-Lab/graphene-based-knitted-sensing-sleeve, commit
/// 47369abac95fd43a10ada4156dd22cae91ee7f70, folders of data/Regression: no header,
/// knee angle in degrees, s1 .. s5, 100 rows a second. A file is cut where all five
/// sensors are zero, as they are where a session begins; one without such a row, as in
/// the folder sit, counts as a single session, and is refused.
///
/// The last session of a group is used for testing, the others are fitted. Without a
/// dataset.toml, the first is diagnosed, as a gauge alone.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Folder for the report, the calibrations, the estimates and the simulated data set
    #[arg(long, default_value = "stretch-demo", value_name = "DIR")]
    out: PathBuf,
    /// Measured sessions instead of simulated ones: a folder, FOLDER/GROUP, or a file with several
    ///
    /// Without a group, the first by name is used.
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Column of the reference [default: length_mm or angle_deg]
    #[arg(long, requires = "data", value_name = "COL", value_parser = column)]
    reference: Option<String>,
    /// Column of the signal [default: bridge_v, else the best by cross-validation]
    #[arg(long, requires = "data", value_name = "COL", value_parser = column)]
    signal: Option<String>,
    /// Replace an existing demo; other files in its folder are kept
    #[arg(long)]
    force: bool,
    /// Print the paper's tables instead, with simulated next to published values
    #[arg(long, conflicts_with_all = ["out", "data", "force"])]
    paper: bool,
    #[command(flatten)]
    json: Json,
}

/// Seed of the simulated experiment.
const SEED: u64 = 3;

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    if args.paper {
        return crate::paper::run(SEED, &args.json);
    }
    let mut done = None;
    let written = write_folder(&args.out, args.force, |folder| {
        done = Some(whole_job(&args, folder)?);
        anyhow::Ok(())
    });
    written.map_err(or_force)?;
    let Some((sessions, job, result)) = done else { return Ok(()) };
    let answer = serde_json::json!({
        "seed": args.data.is_none().then_some(SEED),
        "evaluation": job.calibrations.evaluation,
        "kinds": job.calibrations.kinds,
        "diagnosis": job.examined.to_json(),
    });
    args.json.answer(&answer, || print(&sessions, &job, &result))?;
    if args.json.is_printed() {
        return Ok(());
    }
    tell(format!(
        "\n-v prints the details. Wrote estimate.svg, linear.json, poly13.json, chosen.json, estimates.csv{}, and the report: open\n{}",
        if args.data.is_none() { ", bench/ (the data set)" } else { "" },
        args.out.join("report.html").display()
    ))
}

/// Calibrates and diagnoses, writes all files into a folder, and returns the result as a sentence.
fn whole_job(args: &Args, out: &Path) -> anyhow::Result<(Sessions, Job, String)> {
    let (title, sessions) = match &args.data {
        Some(path) => {
            let (reference, signal) = (args.reference.as_deref(), args.signal.as_deref());
            let sessions = Sessions::read(path, reference, signal)?;
            (format!("{}: {} from a stretch sensor", sessions.name, sessions.reference), sessions)
        }
        None => {
            let sessions = simulated(&out.join("bench"))?;
            (format!("The paper's experiment, simulated (seed {SEED})"), sessions)
        }
    };
    let job = Job::of(&sessions).with_context(|| sessions.name.clone())?;
    let result = write(out, title, &sessions, &job)?;
    Ok((sessions, job, result))
}

/// Simulates the session of the published method ("the paper") on the demonstration rig, writes it
/// as a data set, and reads it back.
fn simulated(folder: &Path) -> anyhow::Result<Sessions> {
    let rig = demo_preset()?;
    let settings = RunSettings { seed: SEED, ..RunSettings::default() };
    simulate::write(folder, false, &rig, &settings, &TrialPlan::paper(SEED))?;
    let mut sessions = Sessions::read(folder, None, None)?;
    let in_words = |e: &ActiveEffect| {
        effect_named(e.name()).map_or(e.name(), |effect| effect.title).to_owned()
    };
    let effects: Vec<String> = rig.effects.iter().map(in_words).collect();
    sessions.notes = vec![format!(
        "Simulated: the paper's session, seed {SEED}, on a rig with {}. The simulator has none of these effects, \
         and the diagnosis does not know them.",
        listed(&effects)
    )];
    Ok(sessions)
}

/// Writes all files, and returns the result as a sentence.
fn write(out: &Path, title: String, sessions: &Sessions, job: &Job) -> anyhow::Result<String> {
    let file = |name: &str| out.join(name);
    let calibrations = &job.calibrations;
    let shown = calibrations.shown();
    for (name, (_, calibrated)) in ["linear.json", "poly13.json", "chosen.json"].iter().zip(&shown)
    {
        write_calibration(&file(name), &calibrated.calibration)?;
    }
    if let Some((_, trial)) = sessions.test.first() {
        let chosen = &calibrations.chosen.calibration;
        let applied = apply(chosen, trial)?;
        write_whole(file("estimates.csv"), |out| applied.write_csv(chosen, trial, out))?;
    }
    let names =
        |trials: &[(TrialKind, Trial)]| trials.iter().map(|(_, t)| t.name.clone()).collect();
    let mut notes = sessions.notes.clone();
    let ramps = sessions.ramps().len();
    if ramps < sessions.fit.len() {
        notes.push(format!(
            "Linear and non-linear are fitted on {ramps} ramps, as in the paper, the chosen model on all {} trials \
             that may be fitted.",
            sessions.fit.len()
        ));
    }
    notes.push(format!("{}; {}", calibrations.choice.why, MODELS_IN_WORDS));
    let surfaces = &calibrations.surfaces;
    let remarks = surfaces.doubts.iter().chain(&surfaces.notes);
    notes.extend(remarks.chain(&calibrations.choice.notes).cloned());
    let context = Context {
        title,
        calibrated_on: names(&sessions.fit),
        tested_on: names(&sessions.test),
        signal_choice: job.ranking.clone(),
        notes,
        kinds: calibrations.kinds.clone(),
    };
    let evaluation = &calibrations.evaluation;
    let judged = Judged { calibrated: &shown, evaluation, context: &context };
    let subject = Subject::of(&job.problem, &job.examined);
    write_text(&file("report.html"), &demo_page(&judged, &subject))?;
    write_text(&file("estimate.svg"), &readme_picture(&shown, evaluation))?;
    Ok(format!("{} {}", calibration_verdict(&judged), in_words(&job.examined.diagnosis).sentence))
}

/// All results of the demo.
struct Job {
    /// Candidate signals by error, the best first.
    ranking: Vec<Candidate>,
    problem: Problem,
    examined: Examined,
    calibrations: Calibrations,
}

/// The paper's two calibrations, the chosen one, and their errors on the test trials.
struct Calibrations {
    linear: Calibrated,
    surfaces: Calibrated,
    chosen: Calibrated,
    choice: ModelChoice,
    /// Display name of the chosen model.
    name: String,
    evaluation: Evaluation,
    /// Errors by kind of trial, if there are several kinds.
    kinds: Vec<(String, Vec<MethodErrors>)>,
}

impl Job {
    /// # Errors
    /// Trials that cannot be calibrated on or diagnosed.
    fn of(sessions: &Sessions) -> anyhow::Result<Self> {
        let bars = MultiProgress::new();
        let [fitting, asking] = [(); 2].map(|()| bars.add(spinner()));
        let options = Options { reference: sessions.reference.clone(), ..Options::default() };
        let fit: Vec<Trial> = sessions.fit.iter().map(|(_, trial)| trial.clone()).collect();
        let ranking = match &sessions.signals[..] {
            [_] => Vec::new(),
            several => rank_signals(&fit, several, &options)?,
        };
        let best = ranking.first().map(|best| &best.signal).or(sessions.signals.first());
        let options = Options { signal: best.cloned().unwrap_or_default(), ..options };
        // Calibration and diagnosis are independent and run in parallel.
        let (calibrations, examined) = std::thread::scope(|scope| {
            let asked = scope.spawn(|| -> anyhow::Result<(Problem, Examined)> {
                let problem = sessions.problem(&options.signal)?;
                let options = stretch_gap::Options { responses: true, ..Default::default() };
                let examined = problem.examine(&options, true, &told_on(&asking), &|| false)?;
                asking.finish_and_clear();
                Ok((problem, examined))
            });
            let calibrations = Calibrations::of(sessions, &fit, &options, &fitting);
            fitting.finish_and_clear();
            (calibrations, asked.join())
        });
        let (problem, examined) = match examined {
            Ok(examined) => examined?,
            Err(panic) => std::panic::resume_unwind(panic),
        };
        Ok(Self { ranking, problem, examined, calibrations: calibrations? })
    }
}

impl Calibrations {
    fn of(
        sessions: &Sessions,
        fit: &[Trial],
        options: &Options,
        bar: &ProgressBar,
    ) -> anyhow::Result<Self> {
        bar.set_message("calibrating");
        let ramps = sessions.ramps();
        let linear = calibrate(&ramps, &Options { model: ModelKind::Linear, ..options.clone() })?;
        let surfaces = calibrate(&ramps, options)?;
        // `stretch calibrate --model auto` compares the same candidates.
        bar.set_message("diagnosing the gauge");
        let show = |text: &str| bar.set_message(text.to_owned());
        let causes = Causes::of(fit, options, &show, &|| false).without_missing_pressure(fit);
        let options = &Options { causes: causes.found, ..options.clone() };
        bar.set_message("choosing a model by cross-validation");
        let choice = choose_model(fit, options)?;
        let chosen = calibrate(fit, &Options { model: choice.model, ..options.clone() })?;
        let name = format!("chosen ({})", choice.model);
        bar.set_message("evaluating");
        let methods = [
            ("linear", &linear.calibration),
            ("non-linear", &surfaces.calibration),
            (name.as_str(), &chosen.calibration),
        ];
        let test: Vec<Trial> = sessions.test.iter().map(|(_, trial)| trial.clone()).collect();
        let evaluation = evaluate(&methods, &test)?;
        let mut names: Vec<TrialKind> = sessions.test.iter().map(|(kind, _)| *kind).collect();
        names.sort();
        names.dedup();
        let mut kinds = Vec::new();
        for kind in names.iter().filter(|_| names.len() > 1) {
            let own = sessions.test.iter().filter(|(k, _)| k == kind);
            let trials: Vec<Trial> = own.map(|(_, trial)| trial.clone()).collect();
            kinds.push((kind.to_string(), evaluate(&methods, &trials)?.pooled));
        }
        Ok(Self { linear, surfaces, chosen, choice, name, evaluation, kinds })
    }

    /// Returns the calibrations under the names that the evaluation uses.
    fn shown(&self) -> [(&str, &Calibrated); 3] {
        [("linear", &self.linear), ("non-linear", &self.surfaces), (&self.name, &self.chosen)]
    }
}

fn trials(count: usize) -> String {
    if count == 1 { "one trial".to_owned() } else { format!("{count} trials") }
}

/// Prints the result, and with `-v` the details.
fn print(sessions: &Sessions, job: &Job, result: &str) -> anyhow::Result<()> {
    let Calibrations { surfaces, choice, evaluation, kinds, .. } = &job.calibrations;
    surfaces.doubts.iter().for_each(doubt);
    say_first(result)?;
    if is_quiet() {
        return Ok(());
    }
    sessions.notes.iter().try_for_each(|note| say(format!("\n{note}")))?;
    if is_verbose() {
        say(format!("\nThe paper's calibrations, on {}:", trials(sessions.ramps().len())))?;
        blocks_of_calibration(surfaces, &job.ranking, false).into_iter().try_for_each(say)?;
        blocks_of_notes(&surfaces.notes).try_for_each(say)?;
        say(format!("\nChosen by cross-validation on {}:", trials(sessions.fit.len())))?;
        say(format!("Chosen: {}.", choice.why))?;
        blocks_of_models(choice, &sessions.reference).into_iter().try_for_each(say)?;
        say("\nTested on trials that were not fitted:")?;
        for (kind, methods) in kinds {
            say(table_of_errors(kind, methods, &evaluation.unit))?;
        }
    }
    say("")?;
    let tested = format!("On {} that were not used for any fit", trials(sessions.test.len()));
    say(table_of_errors(&tested, &evaluation.pooled, &evaluation.unit))?;
    if is_verbose() {
        say("\nWhy simulation and recording disagree:")?;
        print_diagnosis(&job.examined)?;
    }
    Ok(())
}

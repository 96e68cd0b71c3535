//! `stretch diagnose problem.toml`: any simulator beside any recording.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, ensure};
use indicatif::ProgressBar;
use serde_json::json;
use stretch_files::Outputs;
use stretch_gap::{Diagnosis, Evidence, Options, diagnose};
use stretch_problem::{BlackBox, Problem, ProblemFile, SimulatorEntry, worker::Workers};
use stretch_report::{Subject, diagnosis_page};

use super::{
    diagnosis_files::to_json,
    diagnosis_text::text,
    json::Json,
    shared::{detail, say, say_first, stage_text, tell},
};

/// What is asked of a problem's diagnosis.
pub(super) struct Asked<'a> {
    pub(super) options: &'a Options,
    pub(super) json: &'a Json,
    pub(super) report: Option<&'a Path>,
    /// Workers at once.
    pub(super) jobs: usize,
    /// Most runs of the simulator.
    pub(super) budget: Option<usize>,
}

/// A data set that the program has a simulator for, as a problem's file names it.
pub(super) struct Builtin {
    pub(super) data_set: PathBuf,
    pub(super) rig: Option<PathBuf>,
    pub(super) columns: Option<(String, String)>,
}

/// Reads a problem's file; none where the path is none.
pub(super) fn read(path: &Path) -> anyhow::Result<Option<ProblemFile>> {
    let inside = path.join("problem.toml");
    let file = match path {
        path if path.is_dir() && inside.is_file() && !path.join("dataset.toml").exists() => inside,
        path if path.extension().is_some_and(|end| end == "toml") => path.to_owned(),
        _ => return Ok(None),
    };
    Ok(Some(ProblemFile::read(file)?))
}

/// What a file names of the built-in simulators.
pub(super) fn builtin(file: &ProblemFile) -> Option<Builtin> {
    let (data_set, rig, columns) = match &file.simulator {
        SimulatorEntry::Rig { data_set, rig } => (data_set, rig, None),
        SimulatorEntry::Gauge { data_set, rig, columns } => (data_set, rig, columns.clone()),
        _ => return None,
    };
    let rig = rig.as_ref().map(|rig| file.folder.join(rig));
    Some(Builtin { data_set: file.folder.join(data_set), rig, columns })
}

/// Diagnoses a user's own simulator.
pub(super) fn run(
    file: &ProblemFile,
    asked: &Asked<'_>,
    bar: &ProgressBar,
) -> anyhow::Result<Diagnosis> {
    let workers = file.workers(asked.jobs)?.context("the simulator is built in")?;
    let problem = Problem::new(file.load()?)?;
    bar.set_message("starting the simulator");
    let source = Workers::start(workers, problem.session())?;
    let budget = asked.budget.or(file.budget);
    let bench = BlackBox::within(problem, Arc::new(source), budget);
    let progress = |what: &str| {
        let told = format!("{what} ({} model runs)", bench.model_runs());
        detail(&told);
        bar.set_message(told);
    };
    let (mut diagnosis, evidence) =
        diagnose(&bench, asked.options, &progress, &stretch_files::interrupted)?;
    bench.annotate(&mut diagnosis);
    bar.finish_and_clear();
    conclude(file, asked, &bench, &diagnosis, &evidence)?;
    Ok(diagnosis)
}

fn conclude(
    file: &ProblemFile,
    asked: &Asked<'_>,
    bench: &BlackBox,
    diagnosis: &Diagnosis,
    evidence: &Evidence,
) -> anyhow::Result<()> {
    let (mut said, mut outputs) = (Vec::new(), Outputs::default());
    let named = implement(bench, diagnosis).map(|one| implement_json(diagnosis, one));
    let answer = to_json(diagnosis, named.collect(), None, &file.name, asked.options.seed)?;
    asked.json.stage(&mut outputs, &answer)?;
    if let Some(path) = asked.report {
        let name = &file.name;
        let subject = Subject { name, diagnosis, evidence, implementations: &[], simulator: bench };
        stage_text(&mut outputs, path, &diagnosis_page(&subject))?;
        said.push(format!("wrote {}", path.display()));
    }
    outputs.keep()?;
    asked.json.say(&answer, || {
        say_first(&diagnosis.sentence)?;
        for (name, words, equation) in implement(bench, diagnosis) {
            say(format!("  {name}: {words}; {equation}"))?;
        }
        say(text(diagnosis, &[]))?;
        said.iter().try_for_each(tell)
    })
}

/// The named wrappers: name, words, equation.
fn implement<'a>(
    bench: &'a BlackBox,
    diagnosis: &'a Diagnosis,
) -> impl Iterator<Item = (&'a str, &'static str, &'static str)> {
    let effects = &bench.problem().description().effects;
    diagnosis.named.iter().filter_map(move |name| {
        let at = effects.iter().position(|e| e.name == *name)?;
        let wrapper = bench.problem().wrapper(at)?;
        Some((name.as_str(), wrapper.words, wrapper.equation))
    })
}

/// A named wrapper as something to implement.
fn implement_json(
    diagnosis: &Diagnosis,
    (name, words, equation): (&str, &str, &str),
) -> serde_json::Value {
    let first = diagnosis.candidates.first();
    let numbers: Vec<_> =
        first.map_or(Vec::new(), |c| c.parameters.iter().filter(|p| p.effect == name).collect());
    json!({ "effect": name, "words": words, "equation": equation, "numbers": numbers })
}

/// What a black box has no answer to is refused before anything is run.
pub(super) fn refuse(given: &[(&str, bool)]) -> anyhow::Result<()> {
    for (option, is_given) in given {
        ensure!(
            !is_given,
            "{option} is for the built-in simulators; the problem's file says what it says of its own"
        );
    }
    Ok(())
}

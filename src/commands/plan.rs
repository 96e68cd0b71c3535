//! `stretch plan`: chooses the recordings to make, before there are any. `stretch rehearse`: tests on
//! the user's own simulator what a diagnosis would answer.

use std::path::PathBuf;

use stretch_data::{
    DataError,
    files::{Outputs, write_whole},
};
use stretch_problem::{Planned, Reading, Rehearsal, Rehearsed, plan, rehearse};
use stretch_report::{limit_table, menu_table, percent, plan_page};

use super::{
    diagnose::{announce, told_on},
    json::Json,
    shared::{say, say_first, spinner, stage_text, tell, with_unit},
};
use crate::{
    display::is_quiet,
    table::{table, table_text},
};

/// Choose the recordings that distinguish effects and determine parameters, before there are any
///
///   stretch plan problem.toml --out runs --report plan.html
///
/// The table [plan] of the problem file states the limits: range and rate of each input, length,
/// sample rate and number of the recordings. Your simulator plays a menu of inputs within these
/// limits, with the noise that the file states, and each result is diagnosed. This shows from which
/// strength every effect would be named, and how well every parameter would be determined.
///
/// The inputs to play are written into a new folder as run_1.csv, run_2.csv, ...
///
/// A problem file is a program: its simulator runs with your rights, and is announced before it runs.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct PlanArgs {
    /// Problem file with the table [plan]; it needs no recordings
    #[arg(value_name = "problem.toml")]
    problem: PathBuf,
    /// Write the inputs to play into a new folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    json: Json,
    /// Write a report that opens in any browser
    #[arg(long, value_name = "p.html")]
    report: Option<PathBuf>,
}

pub(crate) fn run(args: PlanArgs) -> anyhow::Result<()> {
    args.json.share_stdout([args.report.as_deref()])?;
    let bar = spinner();
    let reading = Reading { announce: Some(announce), ..Reading::default() };
    let planned = plan(&args.problem, &reading, &told_on(&bar))?;
    bar.finish_and_clear();
    let mut outputs = Outputs::default();
    if let Some(path) = &args.report {
        stage_text(&mut outputs, path, &plan_page(&planned))?;
    }
    if let Some(folder) = &args.out {
        outputs.folder(folder, false, |folder| {
            planned.chosen().enumerate().try_for_each(|(at, run)| {
                write_whole(folder.join(file_name(at)), |out| {
                    run.trial.write_to(out).map_err(std::io::Error::other)
                })?;
                Ok::<(), DataError>(())
            })
        })?;
    }
    args.json.conclude(outputs, &planned, || {
        say_first(planned.sentence())?;
        if !is_quiet() {
            say(plan_text(&planned))?;
        }
        [&args.out, &args.report]
            .into_iter()
            .flatten()
            .try_for_each(|path| tell(format!("wrote {}", path.display())))
    })
}

fn file_name(at: usize) -> String {
    format!("run_{}.csv", at + 1)
}

fn plan_text(planned: &Planned) -> String {
    let mut out = format!("\n{}\n\n", table_text(&menu_table(planned, false)));
    for (at, run) in planned.chosen().enumerate() {
        out += &format!("{}, {}: {}\n", file_name(at), run.name, run.how);
    }
    out + "\nAll these runs together: " + &table_text(&limit_table(&planned.together.limits))
}

/// Inject every effect into your simulator, and list what a diagnosis would name
///
///   stretch rehearse problem.toml
///   stretch rehearse problem.toml --only input.delay --only output.backlash
///
/// The simulator runs on the inputs of the recordings or, if there are none, of the runs that stretch
/// plan chooses. Each effect of the problem acts at its detection limit and at three times the limit,
/// noise of the recordings' level is added, and the result is diagnosed like a recording. This takes
/// two diagnoses for each effect.
///
/// A problem file is a program: its simulator runs with your rights, and is announced before it runs.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct RehearseArgs {
    /// Problem file
    #[arg(value_name = "problem.toml")]
    problem: PathBuf,
    /// Inject only this effect; can be repeated
    #[arg(long, value_name = "EFFECT")]
    only: Vec<String>,
    #[command(flatten)]
    json: Json,
}

pub(crate) fn run_rehearsal(args: RehearseArgs) -> anyhow::Result<()> {
    let bar = spinner();
    let reading = Reading { announce: Some(announce), ..Reading::default() };
    let rehearsal = rehearse(&args.problem, &reading, &args.only, &told_on(&bar))?;
    bar.finish_and_clear();
    args.json.answer(&rehearsal, || {
        say_first(rehearsal.sentence())?;
        if is_quiet() { Ok(()) } else { say(rehearsal_text(&rehearsal)) }
    })
}

fn rehearsal_text(rehearsal: &Rehearsal) -> String {
    let row = |one: &Rehearsed| {
        let strength = one.strength.map_or(String::new(), |strength| {
            format!("{} = {}", one.parameter, with_unit(strength, &one.unit))
        });
        let others = one.named.iter().chain(&one.rivals).filter(|name| **name != one.effect);
        let others: Vec<&str> = others.map(String::as_str).collect();
        let mut row = vec![one.effect.clone(), one.times.to_string(), strength];
        row.extend([one.outcome.to_owned(), percent(one.probability), others.join(", ")]);
        row
    };
    let head = ["Effect", "x limit", "Injected", "Answer", "Probability", "Others"];
    format!(
        "\n{}\n\nSeed of the noise: {}.",
        table(&head, rehearsal.effects.iter().map(row)),
        rehearsal.seed
    )
}

//! `stretch-fleet prior`: learns a prior for new sensors from all sensors of a lake.

use std::path::PathBuf;

use rayon::{iter::Either, prelude::*};
use stretch_data::Trial;
use stretch_sleeve::{Expected, Prior, Session, SleeveOptions};

use crate::{
    data_sets::{By, Name, data_sets, lake_with_trials, trials},
    lake::{Lake, LakeFile, Refused},
    show::{bar, say, warn_of},
};

/// Learn a prior for a new sensor from the sensors of a lake
///
///   stretch-fleet prior --lake lake --out prior.json
///   stretch calibrate --prior prior.json --of rig-1/s042 today.csv --out cal.json
///
/// Trials of a sensor and a day (or of a sensor, or of a sensor and a month) are a session.
/// Sessions vary around their sensor, sensors around their rig and rigs around their site, as far
/// as there are several, each with a separate covariance; stretch calibrate --prior then needs ten
/// seconds to a minute of reference, or none. A session that cannot be used is reported, and left
/// out.
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Folder of the lake
    #[arg(long, value_name = "DIR")]
    lake: PathBuf,
    /// Output file of the prior
    #[arg(long, value_name = "prior.json")]
    out: PathBuf,
    /// Which trials form a session
    #[arg(long, value_enum, default_value_t = By::Day)]
    by: By,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let lake = lake_with_trials(&args.lake)?;
    let sets: Vec<(Name, Vec<&LakeFile>)> = data_sets(&lake, args.by).into_iter().collect();
    let above = levels_above(sets.iter().map(|(name, _)| name));
    let bar = bar("sessions", sets.len());
    let (sessions, refused): (Vec<Session>, Vec<Refused>) =
        sets.par_iter().partition_map(|(name, files)| {
            let found = session(&lake, name, above, files);
            bar.inc(1);
            let refused = |why| Refused { file: name.join("/"), why: format!("{why:#}") };
            found.map_or_else(|why| Either::Right(refused(why)), Either::Left)
        });
    bar.finish_and_clear();
    warn_of("no session:", &refused);
    let prior = Prior::learn(&sessions)?;
    let text = prior.to_json()?;
    stretch_data::files::write_whole(&args.out, |out| out.write_all(text.as_bytes()))?;
    let number = |rmse: Option<f64>| rmse.map_or_else(|| "-".to_owned(), |x| format!("{x:.4}"));
    let unit = prior.unit();
    say(format!("RMSE on the end of each session if it is left out, {unit}:"))?;
    let whole = LEVELS[above];
    let is_judged = |e: &&Expected| e.rmse_known.or(e.rmse_new).is_some();
    for Expected { seconds, rmse_known, rmse_new, .. } in prior.expected.iter().filter(is_judged) {
        let (known, new) = (number(*rmse_known), number(*rmse_new));
        say(format!(
            "  after {seconds:>2} s of reference: known {whole} {known}, new {whole} {new}"
        ))?;
    }
    let (out, count) = (args.out.display(), prior.sessions);
    let path = LEVELS[above..].join("/").to_uppercase();
    say(format!(
        "{out}: {count} sessions, {} left out; give the sensor to stretch calibrate with --of {path}",
        refused.len()
    ))
}

/// Levels of the hierarchy, from the coarsest to the finest.
const LEVELS: [&str; 3] = ["site", "rig", "sensor"];

/// Returns the number of leading levels that have only one name. They are left out of the prior,
/// because nothing varies there.
fn levels_above<'a>(names: impl Iterator<Item = &'a Name> + Clone) -> usize {
    let is_one = |level: &usize| {
        let mut all = names.clone().map(|name| &name[*level]);
        let first = all.next();
        all.all(|other| Some(other) == first)
    };
    (0..LEVELS.len() - 1).take_while(is_one).count()
}

/// Converts a data set to the sums from which a prior is learnt.
fn session(lake: &Lake, name: &Name, above: usize, files: &[&LakeFile]) -> anyhow::Result<Session> {
    let recorded: Vec<Trial> = trials(files)?.into_iter().map(|t| t.trial).collect();
    let of = name[above..LEVELS.len()].join("/");
    let options = SleeveOptions::new([&*lake.about.signal], &lake.about.reference).of(&of);
    Ok(Session::new(&name.join("/"), &recorded, &options)?.0)
}

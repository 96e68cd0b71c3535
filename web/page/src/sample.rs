//! Sample data: a simulated session of the published method ("the paper") on a rig with effects as
//! large as in the paper, as written by `stretch simulate --rig paper`.

use serde::Serialize;
use stretch_data::DataSet;
use stretch_sim::{Rig, RunSettings, Session, TrialPlan, paper_preset};

use crate::{progress, said::Said};

/// A file of the data set.
#[derive(Debug, Serialize)]
pub(crate) struct File {
    name: String,
    text: String,
}

/// Returns all files of the data set except the rig file with the effects, because it contains the
/// solution.
pub(crate) fn files(seed: u64) -> Result<Vec<File>, Said> {
    let rig = paper_preset()?;
    let settings = RunSettings { seed, ..RunSettings::default() };
    let plans = TrialPlan::paper(seed);
    let nominal = Rig { effects: Default::default(), ..rig.clone() };
    let mut set = DataSet {
        name: format!("sample-{seed}"),
        rate_hz: plans[0].rate_hz,
        rig: Some("nominal.toml".to_owned()),
        trials: Vec::new(),
    };
    let mut session = Session::new(&rig, &settings)?;
    let mut files = Vec::new();
    for plan in &plans {
        progress(&format!("simulating {}", plan.file));
        let (entry, trial) = session.run(plan)?;
        let mut text = Vec::new();
        trial.write_to(&mut text)?;
        files.push(File { name: entry.file.clone(), text: String::from_utf8(text)? });
        set.trials.push(entry);
    }
    files.push(File { name: "nominal.toml".to_owned(), text: nominal.to_file(None).to_toml() });
    files.push(File { name: "dataset.toml".to_owned(), text: set.to_toml() });
    Ok(files)
}

//! `stretch effects --data`: how strong each effect would have to be to be named on some data.

use std::path::Path;

use anyhow::{Context, ensure};
use stretch_gap::{DetectionLimit, Options, diagnose};
use stretch_problem::Reading;
use stretch_report::limit_table;

use super::{
    diagnose::{announce, open, told_on},
    diagnosis_text::table_text,
    json::Json,
    shared::{detail, say, spinner},
};

/// Diagnoses the data and shows the detection limits of the effects with some names, of all without a name.
pub(super) fn run(data: &Path, names: &[String], json: &Json) -> anyhow::Result<()> {
    ensure!(data.exists(), "{}: there is no such file or folder", data.display());
    let bar = spinner();
    bar.set_message("reading; a simulator of your own is started");
    let problem = open(data, &Reading { announce: Some(announce), ..Reading::default() })?;
    detail(format!("read {}", data.display()));
    let options = Options { detection_limits: true, ..Options::default() };
    let (diagnosis, _) = diagnose(problem.simulator(), &options, &told_on(&bar), &|| false)
        .with_context(|| data.display().to_string())?;
    bar.finish_and_clear();
    let mut limits = diagnosis.detection_limits;
    ensure!(
        !limits.is_empty(),
        "{}: these data carry no name, whatever the strength: {}",
        data.display(),
        diagnosis.sentence
    );
    for name in names {
        let is_known = limits.iter().any(|limit| limit.effect == *name);
        let all: Vec<&str> = limits.iter().map(|limit| limit.effect.as_str()).collect();
        ensure!(is_known, "{name}: these data are not asked for it, only for {}", all.join(", "));
    }
    limits.retain(|limit| names.is_empty() || names.contains(&limit.effect));
    json.answer(&limits, || text(&limits))
}

fn text(limits: &[DetectionLimit]) -> anyhow::Result<()> {
    say(table_text(&limit_table(limits)))
}

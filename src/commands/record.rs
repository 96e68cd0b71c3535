//! `stretch record`: whether a record is what was written, and a seal after a hand edit.

use std::path::PathBuf;

use stretch_calibrate::{RecordSummary, describe_record, seal_calibration};

use super::{json::Json, shared::say};

/// Check the seal of a calibration record, or renew it after a hand edit
///
/// Every record carries a checksum, so that a bit that flipped on the way is found when it is
/// read. Whoever edits a record in JSON by hand renews it:
///
///   stretch record check cal.json
///   stretch record seal cal.json
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    #[command(subcommand)]
    step: Step,
}

#[derive(clap::Subcommand)]
enum Step {
    /// Say what a record is and whether its seal holds; the number is that of exported C, too
    Check {
        /// Record from `stretch calibrate`: of --out, or of --fixed
        #[arg(required = true, value_name = "cal.json")]
        records: Vec<PathBuf>,
        #[command(flatten)]
        json: Json,
    },
    /// Check all but the seal and write the record anew under one: after a hand edit, or for a
    /// record of an earlier release
    Seal {
        /// Record from `stretch calibrate --out`
        #[arg(required = true, value_name = "cal.json")]
        records: Vec<PathBuf>,
        #[command(flatten)]
        json: Json,
    },
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let (records, json, is_sealing) = match args.step {
        Step::Check { records, json } => (records, json, false),
        Step::Seal { records, json } => (records, json, true),
    };
    let mut answer = Vec::new();
    let mut lines = Vec::new();
    for path in &records {
        if is_sealing {
            seal_calibration(path)?;
        }
        let RecordSummary { kind, seal, is_sealed } = describe_record(path)?;
        let state = match (is_sealing, is_sealed) {
            (true, _) => "sealed",
            (false, true) => "its seal holds",
            (false, false) => {
                "of an earlier release, without a seal: stretch record seal makes one"
            }
        };
        let (path, seal) = (path.display().to_string(), format!("{seal:08x}"));
        lines.push(format!("{path}: {kind}, {seal}, {state}"));
        answer.push(serde_json::json!({
            "record": path, "kind": kind, "seal": seal, "is_sealed": is_sealing || is_sealed,
        }));
    }
    json.answer(&answer, || lines.iter().try_for_each(say))
}

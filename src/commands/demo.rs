//! `stretch demo`: the whole job on measured sessions that the program brings along.

use std::path::PathBuf;

use stretch_calibrate::{
    ModelKind, Options, apply, calibrate, choose_model, evaluate, rank_signals, write_calibration,
};
use stretch_data::{ReadOptions, Trial};

use super::{
    apply::estimates_csv,
    calibrate::{print as print_calibration, print_models},
    evaluate::print as print_evaluation,
    shared::{progress, say, say_json, write_text},
};
use crate::report::{self, Context};

const FIT: (&str, &str) =
    ("heel_curl_90_1.csv", include_str!("../../data/knit_sleeve/heel_curl_90_1.csv"));
const TEST: (&str, &str) =
    ("heel_curl_90_2.csv", include_str!("../../data/knit_sleeve/heel_curl_90_2.csv"));
const REFERENCE: &str = "angle_deg";

/// Calibrate on one measured session, test on another, write a report
///
/// The sessions are recordings of a knitted strain-sensor sleeve on a knee with
/// a motion-capture reference (MIT licence, data/knit_sleeve in the sources).
/// The sensor is chosen by cross-validation on the first session; the second is
/// used for nothing but the verdict.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Folder for the report, the calibrations and the estimates
    #[arg(long, default_value = "stretch-demo", value_name = "DIR")]
    out: PathBuf,
    /// The paper's experiment instead, end to end on the simulated rig: its tables beside ours
    #[arg(long)]
    paper: bool,
    /// Seed of the simulated experiment
    #[arg(long, default_value_t = 3, requires = "paper", value_name = "N")]
    seed: u64,
    /// Print JSON in place of tables
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    if args.paper {
        return super::paper::run(&args.out, args.seed, args.json);
    }
    let read = |(name, text): (&str, &str)| {
        Trial::from_reader(text.as_bytes(), name, &ReadOptions::new().require(REFERENCE))
    };
    let (fit, test) = (read(FIT)?, read(TEST)?);
    let fits = std::slice::from_ref(&fit);
    let signals: Vec<String> =
        fit.channels.iter().map(|c| c.name.clone()).filter(|name| name != REFERENCE).collect();
    let options = Options { reference: REFERENCE.into(), ..Options::default() };
    let ranking = rank_signals(fits, &signals, &options)?;
    let signal = ranking.first().map(|best| best.signal.clone()).unwrap_or_default();
    let options = Options { signal, ..options };
    let linear = calibrate(fits, &Options { model: ModelKind::Linear, ..options.clone() })?;
    let surfaces = calibrate(fits, &options)?;
    let bar = progress("choosing a model by cross-validation", 1);
    let choice = choose_model(fits, &options)?;
    bar.finish_and_clear();
    let chosen = calibrate(fits, &Options { model: choice.model, ..options.clone() })?;
    let name = format!("chosen ({})", choice.model);
    let shown = [("linear", &linear), ("non-linear", &surfaces), (name.as_str(), &chosen)];
    let evaluation = evaluate(
        &shown.map(|(name, calibrated)| (name, &calibrated.calibration)),
        std::slice::from_ref(&test),
    )?;

    std::fs::create_dir_all(&args.out)
        .map_err(|e| anyhow::anyhow!("{}: cannot make the folder: {e}", args.out.display()))?;
    let file = |name: &str| args.out.join(name);
    write_calibration(&file("linear.json"), &linear.calibration)?;
    write_calibration(&file("poly13.json"), &surfaces.calibration)?;
    write_calibration(&file("chosen.json"), &chosen.calibration)?;
    let applied = apply(&chosen.calibration, &test)?;
    let estimates = estimates_csv(&chosen.calibration, &test, &applied)?;
    stretch_data::write_whole(file("estimates.csv"), |out| out.write_all(&estimates))?;
    let context = Context {
        title: "A knee angle from a knitted strain sensor".into(),
        calibrated_on: vec![fit.name.clone()],
        tested_on: vec![test.name.clone()],
        signal_choice: ranking.clone(),
        notes: surfaces.notes.clone(),
    };
    write_text(&file("report.html"), &report::calibration_page(&shown, &evaluation, &context))?;
    write_text(&file("estimate.svg"), &report::readme_picture(&shown, &evaluation))?;

    if args.json {
        return say_json(&evaluation);
    }
    say(format!("Calibrated on {}, a measured session:", fit.name))?;
    print_calibration(&surfaces, &ranking)?;
    print_models(&choice, REFERENCE)?;
    say(format!("\nTested on {}, which was not used for the fit:", test.name))?;
    print_evaluation(&evaluation)?;
    say(format!(
        "\nwrote {}: report.html (open it), estimate.svg, linear.json, poly13.json, chosen.json, estimates.csv",
        args.out.display()
    ))
}

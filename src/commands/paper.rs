//! `stretch demo --paper`: the paper's experiment on the simulated rig.

use std::path::Path;

use stretch_data::files::write_folder;
use stretch_sim::paper_preset;

use super::{
    json::Json,
    shared::{or_force, progress, say, tell, write_text},
};
use crate::paper::{Experiment, PUBLISHED, Pipeline, error_rows, fit_rows, paper_page, verdicts};
use crate::table::{number, p_value, table};

pub(super) fn run(out: &Path, force: bool, seed: u64, json: &Json) -> anyhow::Result<()> {
    let mut done = None;
    let written = write_folder(out, force, |folder| {
        let bar = progress("simulating, fitting, judging", 1);
        let experiment = Experiment::run(&paper_preset()?, seed)?;
        bar.finish_and_clear();
        write_text(&folder.join("paper.html"), &paper_page(&experiment))?;
        let text = serde_json::to_string_pretty(&experiment.to_serialise())?;
        write_text(&folder.join("paper.json"), &text)?;
        done = Some(experiment);
        anyhow::Ok(())
    });
    written.map_err(or_force)?;
    let Some(experiment) = done else { return Ok(()) };
    json.answer(&experiment.to_serialise(), || print(&experiment, seed))?;
    if json.is_printed() {
        return Ok(());
    }
    tell(format!("\nwrote {}: paper.html (open it), paper.json", out.display()))
}

/// The paper's tables beside ours.
fn print(experiment: &Experiment, seed: u64) -> anyhow::Result<()> {
    say(format!("The paper's experiment on the simulated rig, preset `paper`, seed {seed}"))?;
    say("\nFits, normalised (next lower and next higher order below each):")?;
    let header =
        ["fit", "R^2", "R^2, paper", "RMSE %", "RMSE %, paper", "R^2, ours", "RMSE %, ours"];
    say(table(&header, fit_rows(experiment)))?;
    let (a, b) = line(&experiment.published);
    say(format!(
        "Line: strain = {a:.4} V + {b:.4}; paper: {} V + {}\n",
        PUBLISHED.line.0, PUBLISHED.line.1
    ))?;
    let kinds = [("arbitrary", &PUBLISHED.arbitrary), ("pulses", &PUBLISHED.pulses)];
    for (kind, published) in kinds {
        say(format!("Applied to {kind}:"))?;
        let header = [
            "method",
            "error %",
            "error %, paper",
            "RMSE mm",
            "RMSE mm, paper",
            "error %, ours",
            "RMSE mm, ours",
        ];
        let (there, here) = match kind {
            "arbitrary" => (&experiment.published.arbitrary, &experiment.ours.arbitrary),
            _ => (&experiment.published.pulses, &experiment.ours.pulses),
        };
        say(table(&header, error_rows(there, published, here)))?;
    }
    if let Some(test) = experiment.published.pulses.comparisons.last() {
        say(format!(
            "Linear against non-linear on pulses, paired t test: P {} on samples (the paper: < 0.0001), P {} on {} blocks of 0.5 s",
            p_value(test.p_samples),
            p_value(test.p_blocks),
            test.blocks
        ))?;
    }
    say("\nError against the gap between two pulses, RMSE in mm (non-linear):")?;
    let rows = experiment.gaps.iter().map(|point| {
        vec![
            format!("{:.2}", point.gap_s),
            number(point.ours_rmse_mm[0]),
            number(point.published_rmse_mm[2]),
            number(point.ours_rmse_mm[2]),
            number(point.ours_rmse_mm[3]),
        ]
    });
    say(table(&["gap s", "raw", "as published", "ours", "observer"], rows))?;
    say("\nFrequency response of the sensor (3 mm about mid-stroke):")?;
    let rows = experiment.frequency.iter().map(|point| {
        vec![
            number(point.frequency_hz),
            number(1000.0 * point.gain_v_per_mm),
            format!("{:.1}", point.lead_deg),
        ]
    });
    say(table(&["Hz", "gain mV/mm", "lead deg"], rows))?;
    say("\nWhat agrees and what does not:")?;
    for sentence in verdicts(experiment) {
        say(format!("- {sentence}"))?;
    }
    Ok(())
}

/// Slope and intercept of the linear fit.
fn line(pipeline: &Pipeline) -> (f64, f64) {
    let surface = pipeline.linear.fits[0].surface;
    (surface.coefficient(0, 1), surface.coefficient(0, 0))
}

//! `stretch demo --paper`: the experiment of the published method ("the paper") on the simulated
//! rig, compared with the published figures.
//!
//! The paper's recordings are not public. The simulated rig has a preset of effects. Several presets match the
//! published figures about equally well, so the match does not prove that the effects are the right ones. The errors of
//! trials depend on commands that the paper does not print, so only their order of magnitude can be compared.

mod experiment;
mod tables;

use stretch_sim::paper_preset;

use crate::commands::{
    json::Json,
    shared::{progress, say},
};
use crate::table::table_text;
use experiment::Experiment;
use tables::{PUBLISHED, error_tables, fit_table, verdicts};

pub(crate) fn run(seed: u64, json: &Json) -> anyhow::Result<()> {
    let bar = progress("simulating, fitting, evaluating", 1);
    let experiment = Experiment::run(&paper_preset()?, seed)?;
    bar.finish_and_clear();
    json.answer(&experiment.to_json(), || print(&experiment, seed))
}

/// Prints the paper's tables with our values.
fn print(experiment: &Experiment, seed: u64) -> anyhow::Result<()> {
    say(format!("The paper's experiment on the simulated rig, preset `paper`, seed {seed}"))?;
    say(format!("\n{}", table_text(&fit_table(experiment))))?;
    let surface = experiment.published.linear.fits[0].surface;
    let (a, b) = (surface.coefficient(0, 1), surface.coefficient(0, 0));
    say(format!(
        "Line: strain = {a:.4} V + {b:.4}; paper: {} V + {}\n",
        PUBLISHED.line.0, PUBLISHED.line.1
    ))?;
    error_tables(experiment).iter().try_for_each(|table| say(table_text(table)))?;
    if let Some(test) = experiment.published.pulses.comparisons.last() {
        say(format!(
            "Linear against non-linear on pulses, paired t test: P {} on samples (the paper: < 0.0001), P {} on {} blocks of 0.5 s",
            p_value(test.p_samples),
            p_value(test.p_blocks),
            test.blocks
        ))?;
    }
    say("\nWhat agrees and what does not:")?;
    verdicts(experiment).iter().try_for_each(|sentence| say(format!("- {sentence}")))
}

/// Formats a p-value; values below 1e-4 are shown as "< 0.0001".
fn p_value(p: Option<f64>) -> String {
    match p {
        None => "-".to_owned(),
        Some(p) if p < 1e-4 => "< 0.0001".to_owned(),
        Some(p) => format!("{p:.4}"),
    }
}

#[cfg(test)]
mod tests {
    use super::{experiment::Pipeline, *};

    #[test]
    fn what_the_paper_found_is_found_and_matched_rates_are_better() {
        let experiment = Experiment::run(&stretch_sim::paper_preset().unwrap(), 3).unwrap();
        let line = &experiment.published.linear.fits[0];
        approx::assert_abs_diff_eq!(line.r_squared, PUBLISHED.linear.r_squared, epsilon = 0.02);
        let pulses = &experiment.published.pulses.pooled;
        assert!(pulses[2].rmse < pulses[1].rmse, "the surfaces beat the line on pulses");
        let of = |pipeline: &Pipeline| pipeline.arbitrary.pooled[2].rmse;
        assert!(of(&experiment.ours) < of(&experiment.published), "on arbitrary actuation");
    }
}

//! The paper's experiment end to end on the simulated rig, beside the figures that the paper prints.
//!
//! The paper's recordings are not public; the preset of effects is one of several that come about as close, and never *the* explanation.
//! Errors of trials depend on commands that the paper does not print: only their order of magnitude can be compared.

mod experiment;
mod frequency;
mod gaps;
mod page;
mod pipeline;
mod published;
mod tables;

pub(crate) use experiment::Experiment;
pub(crate) use page::paper_page;
pub(crate) use pipeline::Pipeline;
pub(crate) use published::PUBLISHED;
pub(crate) use tables::{error_rows, fit_rows, verdicts};

#[cfg(test)]
mod tests {
    use super::*;

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

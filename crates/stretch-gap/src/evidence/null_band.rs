//! Computes the null band: the excess (reduced chi-square minus one) that noise alone leaves in
//! data like these. An excess within the band can be chance. If it is above the band, something is
//! missing, although it may be too faint to name.
//!
//! Recordings in which nothing is missing are drawn for the given trials and noise. V is the
//! covariance of the noise and the nuisances (slow drifts and offsets). Whitened by V, the output's
//! own noise is white noise z, whatever the nuisances are, and |z|^2 of N samples is a chi-square
//! variable with N degrees of freedom. The noise t is the part of the measured input's
//! noise that the simulator transmits to the output. This part may be slow, and has the share u of
//! the noise's variance. The reduced chi-square of a drawn recording is
//!
//! ```text
//! X = ((1 - u)|z|^2 + 2 g sqrt((1 - u) t'V^-1 t) + t'V^-1 t) / N,     z ~ N(0, I), g ~ N(0, 1)
//! ```
//!
//! If the level of the output's own noise is an estimate, (1 - u) is drawn with the relative
//! standard deviation of this estimate; its error is the same in all trials of a recording.
//! Re-tuning would remove some of the excess. This is neglected, so the band is rather too wide.

use rayon::prelude::*;

use crate::{
    fit::{prepared::PreparedProblem, score::gap},
    numerics::random::RandomGenerator,
    problem::{
        error::{GapError, if_possible},
        sample_roles::Role,
        simulator::Run,
    },
};

/// Number of recordings that are drawn, and the share of them that lies within the band.
const RECORDS: usize = 40;
const WITHIN: f64 = 0.95;

/// Returns the excess below which 19 of 20 recordings with nothing missing stay. Like every gap, an
/// excess is summed over stages, and is the larger of the sums over fitted and over test trials. If
/// no more runs may be made, all noise is assumed to be the outputs' own.
pub(crate) fn null_band(problem: &PreparedProblem<'_>, seed: u64) -> Result<f64, GapError> {
    let stages = 0..problem.compare.metrics.len();
    let arrives: Result<Vec<Vec<f64>>, GapError> =
        stages.map(|stage| arrives(problem, stage)).collect();
    let arrives = if_possible(arrives)?;
    let one = |record| {
        let random = RandomGenerator::new(seed, record as u64);
        excess(problem, arrives.as_deref(), record, random)
    };
    let mut excesses: Vec<f64> = (0..RECORDS).map(one).collect();
    excesses.sort_by(f64::total_cmp);
    let last = (WITHIN * RECORDS as f64).ceil() as usize - 1;
    Ok(excesses[last])
}

/// Draws the excess of one recording.
fn excess(
    problem: &PreparedProblem<'_>,
    arrives: Option<&[Vec<f64>]>,
    record: usize,
    mut random: RandomGenerator,
) -> f64 {
    let roles = &problem.compare.roles;
    let looked = (roles.count(Role::Fit) + roles.count(Role::Held)) as f64;
    let (mut fitted, mut tested) = (0.0, 0.0);
    for stage in 0..problem.compare.metrics.len() {
        let (share, arrives) = match arrives {
            Some(arrives) => (problem.transmits(stage), arrives[stage][record]),
            None => (0.0, 0.0),
        };
        let known_to = problem.compare.metrics[stage].noise.known_to;
        let level = (1.0 + known_to * random.gauss()).max(0.0);
        let own = level * (1.0 - share).max(0.0);
        let mut chance = |samples: f64| {
            // The sum of N squares is nearly normal, with mean N and variance 2N.
            let white = own * (samples + (2.0 * samples).sqrt() * random.gauss());
            let other = arrives * samples;
            gap((white + 2.0 * random.gauss() * (own * other).sqrt() + other) / samples)
        };
        fitted += chance(looked);
        tested += chance((roles.count(Role::Test) as f64).max(1.0));
    }
    f64::max(fitted, tested)
}

/// Returns t'V^-1 t per sample, by recording.
fn arrives(problem: &PreparedProblem<'_>, stage: usize) -> Result<Vec<f64>, GapError> {
    if problem.transmits(stage) == 0.0 {
        return Ok(vec![0.0; RECORDS]);
    }
    let compare = &problem.compare;
    let (model, trials) = (&problem.nominal.model, compare.roles.fit_trials);
    let run = Run::exact(stage, model, trials);
    let undisturbed = compare.runs.run(run)?;
    let metric = &compare.metrics[stage];
    let samples = compare.roles.count(Role::Fit) + compare.roles.count(Role::Held);
    let one = |record: usize| {
        let disturbed =
            compare.arrived(Run { input_noise: Some(record as u64), ..run }, &undisturbed)?;
        let column = metric.column(&compare.roles, disturbed);
        let square = |role| metric.product(&compare.roles, &column, &column, role);
        Ok((square(Role::Fit) + square(Role::Held)) / samples.max(1) as f64)
    };
    (0..RECORDS).into_par_iter().map(one).collect()
}

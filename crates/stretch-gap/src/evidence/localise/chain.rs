//! Runs the stages in a chain to find which of them cause the gap of the last output.
//!
//! Errors of a stage pass through the following stages, so the share of a stage depends on the
//! order in which stages are corrected. The Shapley value phi_s (1953, doi
//! 10.1515/9781400881970-018) of stage s is the average over all orders of the n stages:
//!
//! ```text
//! phi_s = sum over sets T without s of |T|! (n - |T| - 1)!/n! (gap(T + s) - gap(T))
//! ```
//!
//! gap(T) is the mean square error of the last output if the stages in T are simulated and the
//! others are corrected: from the output of a corrected stage, the error that this stage makes on
//! its measured input is subtracted.

use crate::{
    evidence::gathered::Evidence,
    problem::{error::GapError, runs::Runs, sample_roles::Role, simulator::Run},
};

/// One variant of the output that a stage passes to the next.
struct Variant {
    /// Stages that are simulated, one bit per stage; the others are corrected.
    simulated: usize,
    /// Values; `None` if they are the measured ones.
    output: Option<Vec<f64>>,
}

/// Returns the share of every stage. The result is empty if there are fewer than two or more than
/// six stages, if a stage cannot be run on the output of another, or if the gap is at most a tenth
/// of the noise's variance.
pub(super) fn shapley(runs: &Runs<'_>, evidence: &Evidence) -> Result<Vec<f64>, GapError> {
    let simulator = runs.simulator();
    let stages = simulator.stages().len();
    let trials = simulator.trials().len();
    let model = &evidence.retuned;
    if !(2..=6).contains(&stages) {
        return Ok(Vec::new());
    }
    let mut variants = vec![Variant { simulated: 0, output: None }];
    for stage in 0..stages {
        let alone = &evidence.stages[stage].retuned;
        // A corrected output starts from the measurement in the form in which it is fed to the next
        // stage.
        let base = match stage + 1 {
            next if next == stages => Some(simulator.measured(stage).to_vec()),
            next => simulator.input(next),
        };
        let Some(base) = base else { return Ok(Vec::new()) };
        let mut next = Vec::with_capacity(2 * variants.len());
        for variant in variants {
            let run = Run::exact(stage, model, trials);
            let output = match &variant.output {
                None => alone.clone(),
                Some(input) => match runs.run_on(run, input)? {
                    Some(output) => output,
                    None => return Ok(Vec::new()),
                },
            };
            let corrected = variant.output.as_ref().map(|_| {
                base.iter().zip(output.iter().zip(alone)).map(|(b, (o, a))| b + o - a).collect()
            });
            next.push(Variant { simulated: variant.simulated, output: corrected });
            let simulated = variant.simulated | 1 << stage;
            next.push(Variant { simulated, output: Some(output) });
        }
        variants = next;
    }
    let last = stages - 1;
    let sd = evidence.stages[last].noise;
    let mut gaps = vec![0.0; 1 << stages];
    for variant in &variants {
        let Some(output) = &variant.output else { continue };
        let (mut sum, mut count) = (0.0, 0_usize);
        let measured = simulator.measured(last);
        for segment in evidence.roles.of_role(Role::Test) {
            for i in segment.from..segment.to {
                sum += (measured[i] - output[i]).powi(2);
            }
            count += segment.to - segment.from;
        }
        // If the last stage is corrected, its output equals the measurement including its noise.
        let noise = if variant.simulated >> last & 1 == 1 { sd * sd } else { 0.0 };
        gaps[variant.simulated] = sum / count.max(1) as f64 - noise;
    }
    if gaps[(1 << stages) - 1] <= 0.1 * sd * sd {
        return Ok(Vec::new());
    }
    Ok(shares(&gaps, stages))
}

/// Returns the Shapley values of a game as shares of their sum; negative values count as 0.
/// `value_of` holds the value of every set of players, one bit per player.
fn shares(value_of: &[f64], players: usize) -> Vec<f64> {
    let factorial = |n: usize| (1..=n).map(|i| i as f64).product::<f64>();
    let mut values = vec![0.0; players];
    for (player, value) in values.iter_mut().enumerate() {
        for set in (0..1_usize << players).filter(|set| set >> player & 1 == 0) {
            let size = set.count_ones() as usize;
            let weight = factorial(size) * factorial(players - size - 1) / factorial(players);
            *value += weight * (value_of[set | 1 << player] - value_of[set]);
        }
    }
    let total: f64 = values.iter().map(|v| v.max(0.0)).sum();
    values.iter().map(|v| if total > 0.0 { v.max(0.0) / total } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use testkit::tolerance::F64_ROUNDING;

    #[test]
    fn shares_are_those_of_the_glove_game() {
        // The glove game of the textbooks: two players hold a left glove and one a right glove. A
        // pair is worth 1. The Shapley values are 1/6, 1/6 and 4/6.
        let pairs = |set: usize| if set & 4 != 0 && set & 3 != 0 { 1.0 } else { 0.0 };
        let value_of: Vec<f64> = (0..8).map(pairs).collect();
        let shares = shares(&value_of, 3);
        for (share, expected) in shares.iter().zip([1.0 / 6.0, 1.0 / 6.0, 4.0 / 6.0]) {
            assert_relative_eq!(*share, expected, max_relative = F64_ROUNDING, epsilon = 0.0);
        }
    }

    /// Returns the value of every set of three players. `worth` computes it from who is a member.
    fn game(worth: impl Fn([bool; 3]) -> f64) -> Vec<f64> {
        (0..8).map(|set: usize| worth([set & 1 != 0, set & 2 != 0, set & 4 != 0])).collect()
    }

    #[test]
    fn shares_sum_to_the_whole_and_a_stage_without_gap_has_none() {
        // The errors of two stages add up before they are squared; the third stage makes no error.
        let worth =
            game(|[a, b, _]| (2.0 * f64::from(u8::from(a)) + f64::from(u8::from(b))).powi(2));
        let found = shares(&worth, 3);
        // The total is 9. In the order a, b, the stages add 4 and 5; in the order b, a, stage a
        // adds 8 and stage b 1. The means are 6 for a and 3 for b.
        for (share, expected) in found.iter().zip([6.0 / 9.0, 3.0 / 9.0, 0.0]) {
            assert_relative_eq!(*share, expected, max_relative = F64_ROUNDING, epsilon = 0.0);
        }
        assert_relative_eq!(found.iter().sum::<f64>(), 1.0, max_relative = F64_ROUNDING);
    }

    /// If errors are independent, every stage has the share that it causes alone.
    #[test]
    fn independent_errors_are_shared_as_they_are() {
        let alone = [5.0, 0.25, 2.0];
        let worth =
            game(|on| on.iter().zip(alone).map(|(on, x)| f64::from(u8::from(*on)) * x).sum());
        for (share, own) in shares(&worth, 3).iter().zip(alone) {
            assert_relative_eq!(*share, own / 7.25, max_relative = F64_ROUNDING, epsilon = 0.0);
        }
    }

    /// Random games: the shares sum to 1, and do not depend on the order of the players or on the
    /// unit of the values.
    #[test]
    fn shares_do_not_depend_on_names_or_units() {
        let mut random = crate::numerics::random::RandomGenerator::new(1, 0);
        for _ in 0..50 {
            let worth: Vec<f64> =
                (0..8_u32).map(|set| f64::from(set.count_ones()) + random.unit()).collect();
            let own = shares(&worth, 3);
            assert_relative_eq!(own.iter().sum::<f64>(), 1.0, max_relative = F64_ROUNDING);
            let scaled: Vec<f64> = worth.iter().map(|w| 1e6 * w).collect();
            // Exchanges the first and the last stage, which are bits 0 and 2 of every set.
            let swap = |set: usize| set & 2 | (set & 1) << 2 | set >> 2;
            let swapped: Vec<f64> = (0..8).map(|set| worth[swap(set)]).collect();
            let (scaled, swapped) = (shares(&scaled, 3), shares(&swapped, 3));
            for i in 0..3 {
                assert_relative_eq!(own[i], scaled[i], max_relative = 1e-12);
                assert_relative_eq!(own[i], swapped[2 - i], max_relative = 1e-12);
            }
        }
    }

    /// A stage whose error compensates for another's has no negative share. If there is no gap,
    /// every share is 0.
    #[test]
    fn no_share_is_negative() {
        let helps = game(|[a, b, _]| if a && !b { 4.0 } else { f64::from(u8::from(a)) });
        let found = shares(&helps, 3);
        assert_eq!(found, [1.0, 0.0, 0.0]);
        assert_eq!(shares(&[0.0; 8], 3), [0.0; 3]);
    }
}

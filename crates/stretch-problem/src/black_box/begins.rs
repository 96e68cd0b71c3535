//! Estimates the command that acted before a trial. The operators in front of a stage begin the trial with this
//! command.
//!
//! If the first sample of a trial is already a step of the command, the output still rests at the
//! command from before the step, which was not recorded. An operator with memory in front of the
//! stage (a rate limit, a lag, a delay) still holds that command too. If the output determines that
//! command, the operator begins with it:
//!
//! ```text
//! u = a + b y     least squares over the ends of all spans in which the input is constant and the output has come to rest
//! u_before = a + b y_0,     taken where |u_before - u_0| > 5 sqrt(s^2 + (b sigma)^2)
//! ```
//!
//! Here u_0 and y_0 are the input and the output in the first sample of a trial, s is the residual standard deviation
//! of the line, and sigma is the noise of the output. The line is used only if its squared correlation is at least
//! [`EXPLAINED`]: a servo has such a line, a force that pushes a mass has none. Of a test trial only y_0 is read, as an
//! initial value.

use std::ops::Range;

use stretch_data::ends;

/// Smallest number of samples of a span in which the inputs are constant.
const SPAN: usize = 20;
/// Smallest number of spans that determine a line and its residual.
const FEWEST: usize = 4;
/// Smallest squared correlation for which the line is used.
const EXPLAINED: f64 = 0.99;
/// Smallest difference between the command from before and the first command, in standard deviations.
const FAR: f64 = 5.0;
/// Smallest motion of the output in a trial that begins with a step, as a share of the output's range.
const MOVES: f64 = 0.1;

/// By trial, the command from before a step at its first sample; `None` if a trial begins
/// otherwise, or the command is unknown.
pub(crate) type Before = Vec<Option<f64>>;

/// The beginnings of all trials of a stage.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Begins {
    pub(crate) before: Before,
    /// Trials that begin with a step from an unknown command.
    pub(crate) unknown: usize,
}

/// Finds the beginnings of the trials of a stage; `looked_at` are the samples outside the test
/// samples, `noise` is that of the output.
pub(crate) fn begins(
    (inputs, output): (&[&[f64]], &[f64]),
    (trials, looked_at): (&[Range<usize>], &[Range<usize>]),
    noise: f64,
) -> Begins {
    let line = match inputs {
        [] => return Begins { before: vec![None; trials.len()], unknown: 0 },
        [input] => Line::of(input, output, looked_at),
        // one output cannot determine several commands
        _ => None,
    };
    let (least, greatest) = ends(looked_at.iter().flat_map(|part| &output[part.clone()]));
    let mut unknown = 0;
    let mut one = |trial: &Range<usize>| {
        let first = spans(inputs, trial.clone()).into_iter().next()?;
        if first.start > trial.start {
            return None;
        }
        let (u, y) = (inputs[0][first.start], output[first.start]);
        let Some(line) = &line else {
            let settled = mean(&output[last_third(&first)]);
            unknown += usize::from((settled - y).abs() > MOVES * (greatest - least));
            return None;
        };
        let before = line.offset + line.slope * y;
        let is_far = (before - u).abs() > FAR * line.left.hypot(line.slope * noise);
        is_far.then_some(before)
    };
    let before = trials.iter().map(&mut one).collect();
    Begins { before, unknown }
}

/// Line that gives the command at which an output rests.
struct Line {
    offset: f64,
    slope: f64,
    /// Standard deviation of the commands from the line.
    left: f64,
}

impl Line {
    fn of(input: &[f64], output: &[f64], looked_at: &[Range<usize>]) -> Option<Self> {
        let (least, greatest) = ends(looked_at.iter().flat_map(|part| &output[part.clone()]));
        let spans = looked_at.iter().flat_map(|part| spans(&[input], part.clone()));
        let rests = spans.filter_map(|span| {
            let end = last_third(&span);
            let (first, last) = output[end.clone()].split_at(end.len() / 2);
            let (first, last) = (mean(first), mean(last));
            let rests = (last - first).abs() < (1.0 - EXPLAINED) * (greatest - least);
            rests.then_some((input[span.start], last))
        });
        let (u, y): (Vec<f64>, Vec<f64>) = rests.unzip();
        if u.len() < FEWEST {
            return None;
        }
        let (u_mean, y_mean) = (mean(&u), mean(&y));
        let sum = |a: &[f64], a_mean: f64, b: &[f64], b_mean: f64| -> f64 {
            a.iter().zip(b).map(|(a, b)| (a - a_mean) * (b - b_mean)).sum()
        };
        let (uu, yy) = (sum(&u, u_mean, &u, u_mean), sum(&y, y_mean, &y, y_mean));
        let uy = sum(&u, u_mean, &y, y_mean);
        // a command or an output that never changes determines no line
        if uy == 0.0 || uy * uy < EXPLAINED * uu * yy {
            return None;
        }
        let slope = uy / yy;
        let left = ((uu - slope * uy).max(0.0) / (u.len() - 2) as f64).sqrt();
        Some(Self { offset: u_mean - slope * y_mean, slope, left })
    }
}

/// Spans of at least [`SPAN`] samples in which every input is constant.
fn spans(inputs: &[&[f64]], part: Range<usize>) -> Vec<Range<usize>> {
    let steps = |i: usize| inputs.iter().any(|x| x[i] != x[i - 1]);
    let borders = (part.start + 1..part.end).filter(|i| steps(*i)).chain([part.end]);
    let mut from = part.start;
    let all = borders.map(|to| std::mem::replace(&mut from, to)..to);
    all.filter(|span| span.len() >= SPAN).collect()
}

fn last_third(span: &Range<usize>) -> Range<usize> {
    span.end - span.len() / 3..span.end
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use stretch_gap::RandomGenerator;

    use super::*;

    const SAMPLES: usize = 100;
    const NOISE: f64 = 0.01;

    /// Trials that rest at 0 for `rest` samples and then step to a target. The output follows
    /// within ten samples, with an error of `offset`. If `is_mass`, the output keeps moving
    /// instead.
    fn steps(rest: usize, offset: f64, is_mass: bool) -> (Vec<f64>, Vec<f64>, Vec<Range<usize>>) {
        let mut random = RandomGenerator::new(3, 0);
        let (mut u, mut y, mut trials) = (Vec::new(), Vec::new(), Vec::new());
        for target in [3.0, -2.0, 1.0, -1.5, 0.8, 2.5] {
            let mut at = 0.0;
            trials.push(u.len()..u.len() + rest + SAMPLES);
            for i in 0..rest + SAMPLES {
                u.push(if i < rest { 0.0 } else { target });
                y.push(at + offset + NOISE * random.gauss());
                at += if is_mass { 0.02 * target } else { 0.4 * (u[u.len() - 1] - at) };
            }
        }
        (u, y, trials)
    }

    fn found(u: &[&[f64]], y: &[f64], trials: &[Range<usize>]) -> Begins {
        begins((u, y), (trials, trials), NOISE)
    }

    #[test]
    fn a_trial_that_begins_with_its_step_begins_at_the_command_from_before() {
        for offset in [0.0, 0.3] {
            let (u, y, trials) = steps(0, offset, false);
            let Begins { before, unknown } = found(&[&u], &y, &trials);
            assert_eq!((before.len(), unknown), (6, 0));
            for before in before {
                let before = before.expect("a step");
                assert!(before.abs() < 5.0 * NOISE, "{before}");
            }
        }
    }

    #[test]
    fn a_trial_that_begins_at_rest_begins_as_it_is() {
        for (offset, rest) in [(0.0, 1), (0.3, 25)] {
            let (u, y, trials) = steps(rest, offset, false);
            assert_eq!(found(&[&u], &y, &trials), Begins { before: vec![None; 6], unknown: 0 });
        }
        // a command that always moves does not determine the command from before
        let y: Vec<f64> = (0..600).map(|i| f64::from(i).sin()).collect();
        let (_, _, trials) = steps(0, 0.0, false);
        assert_eq!(found(&[&y], &y, &trials), Begins { before: vec![None; 6], unknown: 0 });
    }

    #[test]
    fn where_no_line_says_the_command_from_before_steps_are_counted() {
        let (u, y, trials) = steps(0, 0.0, true);
        assert_eq!(found(&[&u], &y, &trials), Begins { before: vec![None; 6], unknown: 6 });
        // one output cannot determine two commands
        let (u, y, trials) = steps(0, 0.0, false);
        let still = vec![1.0; u.len()];
        assert_eq!(found(&[&u, &still], &y, &trials).unknown, 6);
        let (u, y, trials) = steps(25, 0.0, true);
        assert_eq!(found(&[&u], &y, &trials), Begins { before: vec![None; 6], unknown: 0 });
        assert_eq!(found(&[], &y, &trials), Begins { before: vec![None; 6], unknown: 0 });
    }
}

//! Whether a source answers the same question twice alike.
//!
//! A diagnosis stands on differences between runs. A simulator that draws random numbers without a seed, or carries its state from one run
//! to the next, makes differences of its own, which would be named as effects. So the first run that a source answers is asked for
//! once more, in a call of its own: a worker then has made a run in between.

use std::time::Duration;

use crate::black_box::source::{RecordedSession, SourceError};

/// Difference beyond rounding, as a share of the greatest value of the output.
const ROUNDING: f64 = 1e-9;
/// A run that takes longer is not made a second time.
pub(super) const LONG: Duration = Duration::from_secs(60);

/// Refuses two answers to the same question that differ by more than rounding. Answers hold `stages` stages, the first of them `stage`, one
/// behind the other.
pub(super) fn alike(
    session: &RecordedSession,
    stage: usize,
    [first, second]: [&[f64]; 2],
    samples: usize,
) -> Result<(), SourceError> {
    for (i, (a, b)) in first.chunks(samples).zip(second.chunks(samples)).enumerate() {
        let most = a.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let differs = |(x, y): (&f64, &f64)| (x - y).abs() > ROUNDING * most;
        let Some(at) = a.iter().zip(b).position(differs) else { continue };
        let trial = session.trials.iter().find(|t| t.samples.contains(&at));
        return Err(SourceError::Changed {
            stage: session.stages[stage + i].name.clone(),
            trial: trial.map_or(String::new(), |t| t.name.clone()),
            row: trial.map_or(at, |t| at - t.samples.start),
            first: a[at],
            second: b[at],
        });
    }
    Ok(())
}

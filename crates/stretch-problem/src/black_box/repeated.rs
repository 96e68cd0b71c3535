//! Whether a source answers the same question twice alike, and a run over more trials begins as one over fewer.
//!
//! A diagnosis is based on differences between runs. A simulator that draws random numbers without a seed, or carries its state from one run
//! to the next, makes differences of its own, which would be named as effects. So the first run that a source answers is asked for
//! once more, in a call of its own: a worker then has made a run in between. Where there are several trials, it is asked for over the first
//! one alone, or over all if that was the first question. A difference between runs of two lengths alone is a note: solvers that choose their steps make one.

use std::time::Duration;

use crate::black_box::source::{RecordedSession, SourceError};

/// Difference beyond rounding, as a share of the greatest value of the output.
const ROUNDING: f64 = 1e-9;
/// A run that takes longer is not made a second time.
pub(super) const LONG: Duration = Duration::from_secs(60);

/// Refuses two answers to the same question, over so many trials each, that differ by more than rounding. Answers hold stages one behind the
/// other, the first of them `stage`.
pub(super) fn alike(
    session: &RecordedSession,
    stage: usize,
    runs: [(usize, &[f64]); 2],
) -> Result<(), SourceError> {
    let [first, second] = runs.map(|(over, values)| values.chunks(session.samples(over)));
    for (i, (a, b)) in first.zip(second).enumerate() {
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
            over: runs.map(|(over, _)| over),
        });
    }
    Ok(())
}

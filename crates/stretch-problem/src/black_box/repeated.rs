//! Checks that a source gives the same answer to the same request twice, and that a run over more
//! trials begins with the samples of a run over fewer.
//!
//! A diagnosis is based on differences between runs. A simulator that draws random numbers without a seed, or carries
//! its state from one run to the next, adds differences that would be named as effects. So the first run that a source
//! answers is requested once more. The second request is a separate call, so that a worker has made a run in between.
//! If there are several trials, the second request is over the first trial alone, or over all if the first request was
//! over one. A difference that occurs only between runs of two lengths is reported as a note, because solvers with
//! variable steps cause it.

use std::time::Duration;

use crate::black_box::source::{RecordedSession, SourceError};

/// Difference beyond rounding, as a share of the greatest value of the output.
const ROUNDING: f64 = 1e-9;
/// If the first runs take longer than this, none is repeated.
pub(super) const LONG: Duration = Duration::from_secs(60);

/// Refuses two answers to the same request that differ by more than rounding. `runs` holds the
/// number of trials and the values of each answer. The values hold the stages one after the other,
/// beginning with `stage`.
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

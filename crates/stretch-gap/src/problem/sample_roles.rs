//! Decides which samples are fitted, held out and tested.
//!
//! A model that is selected by the fitted data looks better than it is, and information criteria
//! alone mislead if all models are wrong (Schoniger et al. 2014, doi 10.1002/2014WR016062).
//! Therefore the last part of each long trial is held out of the fits and used to compare them.
//! Test trials are read only after all decisions.

use serde::Serialize;

use crate::problem::{error::GapError, pace, simulator::Simulator, spec::TrialSpec};

/// How a segment of samples is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Used for fits.
    Fit,
    /// Held out of every fit, used to compare fits.
    Held,
    /// Read only at the end, after all decisions.
    Test,
}

/// A segment of one trial with one role. Sample numbers count over all concatenated trials.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Segment {
    /// Index of the trial.
    pub trial: usize,
    /// First sample.
    pub from: usize,
    /// One past the last sample.
    pub to: usize,
    /// How the segment is used.
    pub role: Role,
}

/// Largest length of a block, s. Because neighbouring residuals are correlated, a block of
/// residuals counts as one observation. If a period of the motion takes less than a second, a block
/// is half a period.
pub const BLOCK_S: f64 = 0.5;
/// Smallest length of a trial, in blocks, whose last part is held out.
const LONG: f64 = 60.0;
/// Share of a long trial that is held out.
const HELD: f64 = 0.3;
/// Share of every trial that is used for testing if there is no test trial.
const TESTED: f64 = 0.25;

/// The session divided into segments.
#[derive(Debug, Clone)]
pub struct SampleRoles {
    /// Segments in order of time.
    pub segments: Vec<Segment>,
    /// Samples per block.
    pub block: usize,
    /// Number of trials up to and including the last one that contains fitted samples.
    pub fit_trials: usize,
    /// Whether there is no test trial, so that the last part of each trial is used for testing.
    pub borrowed_test: bool,
}

/// Returns the number of samples, from a trial's start, that are not test samples.
fn may_fit(trial: &TrialSpec, borrowed_test: bool) -> usize {
    let share = if borrowed_test { TESTED } else { 0.0 };
    if trial.is_test { 0 } else { trial.samples - (share * trial.samples as f64) as usize }
}

/// Returns, for each stage, the parts of its measured output that are not test samples.
fn looked_at(
    simulator: &dyn Simulator,
) -> impl Iterator<Item = impl Iterator<Item = &[f64]> + Clone> {
    let trials = simulator.trials();
    let parts = TrialSpec::ranges(trials).into_iter().zip(SampleRoles::not_tested(trials));
    let parts: Vec<_> = parts.map(|(all, looked)| all.start..all.start + looked).collect();
    (0..simulator.stages().len()).map(move |stage| {
        let measured = simulator.measured(stage);
        parts.clone().into_iter().map(move |part| &measured[part])
    })
}

impl SampleRoles {
    /// Returns for each trial the number of samples, from its start, that are not test samples. A
    /// simulator may use only these samples before the final test.
    ///
    /// ```
    /// use stretch_gap::{SampleRoles, TrialSpec};
    /// let fit = TrialSpec::new("a", 400, 0.0, false);
    /// let test = TrialSpec::new("b", 400, 10.0, true);
    /// assert_eq!(SampleRoles::not_tested(&[fit.clone(), test]), [400, 0]);
    /// assert_eq!(SampleRoles::not_tested(&[fit]), [300]); // without a test trial the last quarter is held back
    /// ```
    pub fn not_tested(trials: &[TrialSpec]) -> Vec<usize> {
        let borrowed_test = trials.iter().all(|t| !t.is_test);
        trials.iter().map(|t| may_fit(t, borrowed_test)).collect()
    }

    /// Assigns a role to every sample of a session.
    ///
    /// # Errors
    /// [`GapError::TooLittle`] if there is nothing to fit.
    pub fn of(simulator: &dyn Simulator) -> Result<Self, GapError> {
        let trials = simulator.trials();
        let dt_s = simulator.dt_s();
        let borrowed_test = trials.iter().all(|t| !t.is_test);
        let block_s = pace::block_s(looked_at(simulator), dt_s, BLOCK_S);
        let mut segments = Vec::new();
        let mut begin = 0;
        for (trial, spec) in trials.iter().enumerate() {
            let end = begin + spec.samples;
            let mut add = |from: usize, to: usize, role: Role| {
                if to > from {
                    segments.push(Segment { trial, from, to, role });
                }
            };
            let test = begin + may_fit(spec, borrowed_test);
            if spec.is_test {
                add(begin, end, Role::Test);
            } else {
                let is_long = (test - begin) as f64 * dt_s >= LONG * block_s;
                let held = if is_long { HELD * (test - begin) as f64 } else { 0.0 };
                let fit = test - held as usize;
                add(begin, fit, Role::Fit);
                add(fit, test, Role::Held);
                add(test, end, Role::Test);
            }
            begin = end;
        }
        let fitted = segments.iter().filter(|s| s.role == Role::Fit);
        let Some(last) = fitted.map(|s| s.trial).max() else {
            return Err(GapError::TooLittle {
                what: "there is no trial to fit".into(),
                hint: "give at least one trial that is not a test trial".into(),
            });
        };
        let block = ((block_s / dt_s).round() as usize).max(1);
        Ok(Self { segments, block, fit_trials: last + 1, borrowed_test })
    }

    /// Returns the number of samples in the first `trials` trials.
    pub fn samples(&self, trials: usize) -> usize {
        self.segments.iter().filter(|s| s.trial < trials).map(|s| s.to).max().unwrap_or(0)
    }

    /// Returns the number of samples in a role.
    pub fn count(&self, role: Role) -> usize {
        self.of_role(role).map(|s| s.to - s.from).sum()
    }

    /// Returns the number of blocks in a role; it may be fractional.
    pub fn blocks(&self, role: Role) -> f64 {
        self.count(role) as f64 / self.block as f64
    }

    /// Returns the segments that may be used before the final test: all except the test segments.
    pub(crate) fn looked_at(&self) -> impl Iterator<Item = &Segment> {
        self.segments.iter().filter(|s| s.role != Role::Test)
    }

    /// Returns the segments in a role.
    pub fn of_role(&self, role: Role) -> impl Iterator<Item = &Segment> {
        self.segments.iter().filter(move |s| s.role == role)
    }
}

//! The time grid: equal steps inside a sample, split where a delayed command switches.

use alloc::vec::Vec;
use core::fmt;

/// An invalid time, which a grid refuses.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct GridError {
    /// Which time is invalid.
    pub name: &'static str,
    /// Its value, s.
    pub value: f64,
}

impl fmt::Display for GridError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} = {} must be finite and positive", self.name, self.value)
    }
}

impl core::error::Error for GridError {}

/// Longest integration step, s, that is short enough for the nominal rig and every effect of the
/// catalogue: with half the step, no channel differs by more than 1e-4 of its full scale.
pub const DEFAULT_STEP_S: f64 = 0.0025;

/// Steps of integration inside one sample of a uniformly sampled trial, the same in every sample.
///
/// Node 0 is the first sample; sample i is node `i * pieces()`.
///
/// ```
/// use stretch_effects::Grid;
/// // A hundred samples a second, steps of at most 5 ms, commands that act 13.5 ms late.
/// let grid = Grid::new(0.01, 0.005, 0.0135)?;
/// assert_eq!(grid.pieces(), 3); // 3.5 ms, then twice 3.25 ms
/// assert_eq!(grid.nodes(101), 301);
/// assert_eq!(grid.command(10, 0), Some(8)); // the switch falls behind the first piece
/// assert_eq!(grid.command(10, 1), Some(9));
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    dt_s: f64,
    /// Length of each piece, s.
    steps: Vec<f64>,
    /// Time of each piece's start within the sample, s.
    offsets: Vec<f64>,
    /// Number of pieces at a sample's start in which the command of `shift + 1` samples ago still
    /// acts.
    late: usize,
    /// Delay of the commands in whole samples, rounded down.
    shift: usize,
    delay_s: f64,
}

impl Grid {
    /// A grid with one step a sample, for a stage driven by a measured, linearly interpolated
    /// input.
    ///
    /// # Errors
    /// Fails if the sample time is not finite and positive.
    pub fn samples(dt_s: f64) -> Result<Self, GridError> {
        Self::new(dt_s, f64::INFINITY, 0.0)
    }

    /// A grid of pieces no longer than `max_step_s`. If commands act `delay_s` late, a piece also
    /// ends at the time within the sample at which a late command takes effect.
    ///
    /// # Errors
    /// Fails if the sample time is not finite and positive, if `max_step_s` is NaN or below 1e-6 of
    /// the sample time, or if the delay is negative or not finite.
    pub fn new(dt_s: f64, max_step_s: f64, delay_s: f64) -> Result<Self, GridError> {
        if !(dt_s.is_finite() && dt_s > 0.0) {
            return Err(GridError { name: "sample time", value: dt_s });
        }
        // Below 1e-6 of a sample time a step resolves nothing, and the number of steps would be
        // excessive.
        if max_step_s.is_nan() || max_step_s < 1e-6 * dt_s {
            return Err(GridError { name: "step of integration", value: max_step_s });
        }
        if !(delay_s.is_finite() && delay_s >= 0.0) {
            return Err(GridError { name: "delay", value: delay_s });
        }
        let samples = delay_s / dt_s;
        let mut shift = libm::floor(samples);
        let mut part = samples - shift;
        // A switch closer than a billionth of a sample to a sample's border is placed on the
        // border.
        if part > 1.0 - 1e-9 {
            shift += 1.0;
            part = 0.0;
        } else if part < 1e-9 {
            part = 0.0;
        }
        let count =
            |length: f64| libm::ceil((length / max_step_s) * (1.0 - 1e-12)).max(1.0) as usize;
        let mut steps = Vec::new();
        let first = part * dt_s;
        let late = if part > 0.0 { count(first) } else { 0 };
        steps.extend(core::iter::repeat_n(first / late.max(1) as f64, late));
        let rest = dt_s - first;
        let pieces = count(rest);
        steps.extend(core::iter::repeat_n(rest / pieces as f64, pieces));
        let mut at = 0.0;
        let offsets = steps
            .iter()
            .map(|h| {
                let t = at;
                at += h;
                t
            })
            .collect();
        // If the delay is longer than any trial, no command ever acts; the cast saturates.
        Ok(Self { dt_s, steps, offsets, late, shift: shift as usize, delay_s })
    }

    /// Sample time, s.
    pub fn dt_s(&self) -> f64 {
        self.dt_s
    }

    /// Delay of the commands, s.
    pub fn delay_s(&self) -> f64 {
        self.delay_s
    }

    /// Lengths of the pieces of a sample, s.
    pub fn steps(&self) -> &[f64] {
        &self.steps
    }

    /// Number of pieces in a sample.
    pub fn pieces(&self) -> usize {
        self.steps.len()
    }

    /// Number of nodes of a trial with that many samples; 0 without samples.
    pub fn nodes(&self, samples: usize) -> usize {
        if samples == 0 { 0 } else { (samples - 1) * self.pieces() + 1 }
    }

    /// Time of a node since the trial's start, s.
    pub fn time_s(&self, node: usize) -> f64 {
        let pieces = self.pieces();
        (node / pieces) as f64 * self.dt_s + self.offsets[node % pieces]
    }

    /// Returns the sample whose command acts in a piece after `sample`; `None` before the trial's
    /// first command acts.
    pub fn command(&self, sample: usize, piece: usize) -> Option<usize> {
        sample.checked_sub(self.shift.saturating_add(usize::from(piece < self.late)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use testkit::tolerance::F64_ROUNDING;

    #[test]
    fn pieces_fill_the_sample_and_split_at_the_switch() {
        let grid = Grid::new(0.01, 0.005, 0.0635).unwrap();
        let whole = grid.steps().iter().sum::<f64>();
        assert_relative_eq!(whole, 0.01, epsilon = 0.0, max_relative = F64_ROUNDING);
        assert_eq!(grid.pieces(), 3);
        assert_relative_eq!(grid.time_s(4), 0.0135, epsilon = 0.0, max_relative = F64_ROUNDING);
        assert_eq!(grid.command(10, 0), Some(3));
        assert_eq!(grid.command(10, 1), Some(4));
        assert_eq!(grid.command(5, 0), None);
        assert_eq!(Grid::new(0.01, 0.005, 0.02).unwrap().pieces(), 2);
        assert_eq!(Grid::samples(0.01).unwrap().nodes(7), 7);
        assert!(Grid::new(0.01, 0.0, 0.0).is_err() && Grid::samples(f64::NAN).is_err());
    }
}

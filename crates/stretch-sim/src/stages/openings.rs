//! The commands of the valves.

use super::check_length;
use crate::SimError;

/// Openings of the two valves, one value a sample, held until the next.
#[derive(Debug, Clone, Copy)]
pub struct Openings<'a> {
    /// Inlet, 0..1.
    pub inlet: &'a [f64],
    /// Outlet, 0..1.
    pub outlet: &'a [f64],
}

impl<'a> Openings<'a> {
    /// The openings as the valves receive them, if they differ from the commands.
    pub(crate) fn of(taken: Option<&'a [Vec<f64>; 2]>, commanded: Self) -> Self {
        taken.map_or(commanded, |[inlet, outlet]| Self { inlet, outlet })
    }
}

impl Openings<'_> {
    /// Number of samples.
    ///
    /// # Errors
    /// The valves have different numbers of samples, or an opening is not within 0..1.
    pub fn check(&self) -> Result<usize, SimError> {
        check_length("outlet", self.inlet.len(), self.outlet.len())?;
        for (column, openings) in [("inlet", self.inlet), ("outlet", self.outlet)] {
            if let Some(sample) = openings.iter().position(|u| !(0.0..=1.0).contains(u)) {
                return Err(SimError::Opening { column, sample, value: openings[sample] });
            }
        }
        Ok(self.inlet.len())
    }
}

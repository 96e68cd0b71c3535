//! The transition from one surface to the other as the rate crosses the dead band.

use stretch_core::{Branch, Calibration, DesignError, Model, Real};

use crate::{
    Domain,
    front::Direction,
    map::{Map, Point},
};

/// The estimate across the dead band.
pub trait Across<T>: Sized {
    /// The surfaces of a calibration of this form.
    fn map(calibration: &Calibration) -> Result<Map<T>, DesignError>;
    /// The transition for a dead band.
    fn new(direction: Direction<T>) -> Self;
    /// Value and slope on a branch at a rate.
    fn point(
        &self,
        map: &Map<T>,
        direction: Direction<T>,
        branch: Branch,
        rate: T,
        signal: T,
    ) -> Point<T>;
}

/// The branch's own surface, up to the end of the dead band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jump;

impl<T: Real> Across<T> for Jump {
    fn map(calibration: &Calibration) -> Result<Map<T>, DesignError> {
        match &calibration.model {
            Model::Linear(line) => Ok(Map::line(calibration, line)),
            Model::Surfaces { inflation, deflation } => {
                Map::surfaces(calibration, inflation, deflation)
            }
            other => Err(other.instead_of("linear or surfaces")),
        }
    }

    fn new(_: Direction<T>) -> Self {
        Self
    }

    #[inline(always)]
    fn point(&self, map: &Map<T>, _: Direction<T>, branch: Branch, rate: T, signal: T) -> Point<T> {
        map.at(branch, rate, signal)
    }
}

/// A mean of both surfaces inside the dead band, weighted by the rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mixed<T> {
    per_band: T,
}

impl<T: Real> Across<T> for Mixed<T> {
    fn map(calibration: &Calibration) -> Result<Map<T>, DesignError> {
        match &calibration.model {
            Model::Blended { inflation, deflation } => {
                Map::surfaces(calibration, inflation, deflation)
            }
            other => Err(other.instead_of("blended")),
        }
    }

    fn new(direction: Direction<T>) -> Self {
        let band = direction.dead_band;
        // without a dead band the weight is never used
        Self { per_band: if band > T::zero() { band.recip() } else { T::zero() } }
    }

    #[inline(always)]
    fn point(
        &self,
        map: &Map<T>,
        direction: Direction<T>,
        branch: Branch,
        rate: T,
        signal: T,
    ) -> Point<T> {
        let here = map.at(branch, rate, signal);
        if rate.abs() >= direction.dead_band {
            return here;
        }
        let there = map.at(branch.opposite(), rate, signal);
        let half = T::from_f64(0.5);
        let rising = half + half * direction.signed(rate) * self.per_band;
        let weight = if branch == Branch::Inflation { rising } else { T::one() - rising };
        let mix = |here: T, there: T| there + weight * (here - there);
        // each surface is fitted to one sign of the rate, so that a rate beyond its domain is expected here
        let outside = here.domain.signal_outside() || there.domain.signal_outside();
        Point {
            estimate: mix(here.estimate, there.estimate),
            slope: mix(here.slope, there.slope),
            domain: Domain::from_flags(outside, false),
        }
    }
}

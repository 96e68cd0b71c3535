//! Where an effect is looked for.

use alloc::vec::Vec;

/// What the search needs to know of the measurement of a gauge alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alone {
    /// From the first to the last sample, s.
    pub session_s: f64,
    /// Time by which the signal seems to trail the reference, s.
    pub lag_s: f64,
}

/// Ranges and starting points of the search for an effect, one number each of its [fitted](crate::Effect::fitted) parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Search {
    /// Least and greatest value of each parameter.
    pub ranges: Vec<[f64; 2]>,
    /// Points at which it is screened.
    pub starts: Vec<Vec<f64>>,
}

impl Search {
    /// The same in other units, one factor a parameter.
    pub fn times(mut self, units: &[f64]) -> Self {
        for (range, unit) in self.ranges.iter_mut().zip(units) {
            *range = range.map(|x| x * unit);
        }
        for start in &mut self.starts {
            start.iter_mut().zip(units).for_each(|(x, unit)| *x *= unit);
        }
        self
    }

    /// Lets the first strength go as far as `most`, either way.
    pub fn reach(&mut self, most: f64) {
        self.ranges[0] = [-most, most];
    }

    /// Lets the first strength go as far as `most`, either way, and begins at a fifth of it.
    pub fn reach_from(&mut self, most: f64) {
        self.reach(most);
        self.starts.iter_mut().for_each(|start| start[0] = 0.2 * most);
    }

    /// Leaves out the points at which an effect does not show at a sample rate, Hz; says which rate would do where none is left.
    /// `least` tells the rate that it needs with some values.
    pub fn at_rate(&mut self, least: impl Fn(&[f64]) -> f64, rate_hz: f64) -> Option<f64> {
        let needed = self.starts.iter().map(|s| least(s)).fold(f64::INFINITY, f64::min);
        // A rate told by rounded stamps may miss its own value by a little.
        self.starts.retain(|start| least(start) <= rate_hz * (1.0 + 1e-6));
        self.starts.is_empty().then_some(needed)
    }
}

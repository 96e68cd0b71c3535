//! Where an effect is looked for.

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
}

/// Starts of one number each.
pub(super) fn each<const N: usize>(values: [f64; N]) -> Vec<Vec<f64>> {
    values.map(|x| vec![x]).into()
}

/// Starts of the same first number and several second ones.
pub(super) fn pairs<const N: usize>(first: f64, seconds: [f64; N]) -> Vec<Vec<f64>> {
    seconds.map(|x| vec![first, x]).into()
}

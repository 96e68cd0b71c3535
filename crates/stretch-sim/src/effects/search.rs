//! Where an effect is looked for.

use super::{Effect, EffectParameter, Extent, Role, Scale};

/// Ranges and starting points of the search for an effect, one number each of its [fitted](Effect::fitted) parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Search {
    /// Least and greatest value of each parameter.
    pub ranges: Vec<[f64; 2]>,
    /// Points at which it is screened.
    pub starts: Vec<Vec<f64>>,
}

impl Search {
    /// In the catalogue's units.
    ///
    /// ```
    /// use stretch_sim::{Extent, Search, effect_named};
    /// let search = Search::of(
    ///     effect_named("muscle_creep").unwrap(),
    ///     &Extent { volts: (1.2, 2.3), strain: 0.02 },
    /// );
    /// assert_eq!(search.ranges[1], [0.5, 40.0]); // tau, s
    /// assert_eq!(search.starts[0], [0.05, 0.6, 1.6]); // c, tau, and the usual spread
    /// ```
    pub fn of(effect: &Effect, extent: &Extent) -> Self {
        let starts = effect.starts.map_or_else(|| points(effect), |starts| starts(extent));
        let complete = |mut start: Vec<f64>| {
            start.extend(effect.fitted().skip(start.len()).map(EffectParameter::usual));
            start
        };
        Self {
            ranges: effect.fitted().map(|p| [p.min, p.max]).collect(),
            starts: starts.into_iter().map(complete).collect(),
        }
    }

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

/// A fiftieth and a fifth of each strength's range, of both signs where it has both, with a sixth, a half and five sixths of
/// each shape's; forms are left out.
fn points(effect: &Effect) -> Vec<Vec<f64>> {
    let mut points = vec![Vec::new()];
    for p in effect.fitted().take_while(|p| !matches!(p.role, Role::Form { .. })) {
        let values: Vec<f64> = match p.off() {
            Some(off) => {
                let ends = [p.min, p.max].into_iter().filter(|end| *end != off);
                ends.flat_map(|end| [0.02, 0.2].map(|s| off + s * (end - off))).collect()
            }
            None => [1.0, 3.0, 5.0].map(|k| between(p, k / 6.0)).into(),
        };
        let with = |start: &Vec<f64>, x: &f64| [start.as_slice(), &[*x]].concat();
        points = points.iter().flat_map(|s| values.iter().map(move |x| with(s, x))).collect();
    }
    points
}

/// A share of the way through a parameter's range.
fn between(p: &EffectParameter, share: f64) -> f64 {
    match p.scale {
        Scale::Linear => p.min + share * (p.max - p.min),
        Scale::Log => p.min * libm::pow(p.max / p.min, share),
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

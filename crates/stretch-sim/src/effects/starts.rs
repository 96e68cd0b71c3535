//! Where the search for an effect begins.

use super::{Effect, EffectParameter, Extent, Role, Scale, Search};

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

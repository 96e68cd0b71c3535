//! Landmarks of a movement that can be found without a reference: its two ends, and its rest.
//!
//! The low and the high end are the 5 % of the samples in which the reference, or an estimate of
//! it, is smallest and largest. The sensor counts as at rest in the 10 % of the samples in which the
//! signals change least.

use serde::{Deserialize, Serialize};
use stretch_calibrate::toolkit::extent;
use stretch_core::Interval;

use crate::calibrate::channels::Channels;

pub(crate) const LANDMARKS: usize = 3;
/// Names of the landmarks, in order.
pub(crate) const NAMES: [&str; LANDMARKS] = ["low end", "high end", "rest"];
const END_SHARE: f64 = 0.05;
const STILL_SHARE: f64 = 0.1;
/// Number of memory states whose sum is the change of a channel over the last 0.3 s.
const MOVED_STATES: usize = 2;

/// A sample: the index of its stretch, and its index in that stretch.
pub(crate) type Place = (usize, usize);

/// The samples after the warm-up.
pub(crate) fn warmed_up(channels: &Channels) -> Vec<Place> {
    let stretches = channels.stretches.iter().enumerate();
    stretches.flat_map(|(i, s)| s.warmed_up().map(move |k| (i, k))).collect()
}

/// Returns the mean reference at each landmark of a session.
pub(crate) fn at_landmarks(channels: &Channels) -> [f64; LANDMARKS] {
    let reference = |&(i, k): &Place| channels.stretches[i].reference[k];
    let sets = landmarks(channels, reference);
    sets.map(|set| set.iter().map(reference).sum::<f64>() / f64::max(set.len() as f64, 1.0))
}

/// Returns the samples at each landmark. `level` is the reference or an estimate of it.
pub(crate) fn landmarks(
    channels: &Channels,
    level: impl Fn(&Place) -> f64,
) -> [Vec<Place>; LANDMARKS] {
    let places = warmed_up(channels);
    let spans: Vec<f64> = channels.bank().domains.iter().map(|d| span(d[0])).collect();
    let motion = |&(i, k): &Place| -> f64 {
        let states = channels.stretches[i].at(k).zip(&spans);
        states.map(|(s, span)| (s[1..=MOVED_STATES].iter().sum::<f64>() / span).powi(2)).sum()
    };
    [
        least(&places, END_SHARE, &level),
        least(&places, END_SHARE, |place| -level(place)),
        least(&places, STILL_SHARE, motion),
    ]
}

/// Returns the samples with the smallest values: a share of all samples, at least one.
fn least(places: &[Place], share: f64, value: impl Fn(&Place) -> f64) -> Vec<Place> {
    let mut valued: Vec<(f64, Place)> = places.iter().map(|p| (value(p), *p)).collect();
    valued.sort_by(|a, b| a.0.total_cmp(&b.0));
    let count = ((share * valued.len() as f64) as usize).max(1);
    valued.into_iter().take(count).map(|(_, place)| place).collect()
}

fn span(domain: Interval) -> f64 {
    (domain.max - domain.min).max(f64::MIN_POSITIVE)
}

/// Counts how often a level passes from its lower third to its upper third or back.
pub(crate) fn passes(levels: impl Iterator<Item = f64> + Clone) -> usize {
    let Interval { min: low, max: high } = extent(levels.clone());
    let third = (high - low) / 3.0;
    let (mut passes, mut was_high) = (0, None);
    for level in levels {
        let is_high = match level {
            x if x >= high - third => true,
            x if x <= low + third => false,
            _ => continue,
        };
        passes += usize::from(was_high.is_some_and(|was| was != is_high));
        was_high = Some(is_high);
    }
    passes
}

/// Mean of a landmark over sessions, and the standard deviation of a new session about that mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Landmark {
    pub(crate) mean: f64,
    pub(crate) sd: f64,
    /// Number of sessions from which the mean was computed.
    pub(crate) sessions: usize,
}

/// The path of a session, and its mean reference at each landmark.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Landmarks {
    pub(crate) path: Vec<String>,
    pub(crate) at: [f64; LANDMARKS],
}

/// Returns the mean and the spread of a landmark over those sessions whose paths have the most
/// first steps in common with the given path. Its variance is `sd^2 = v (1 + 1/n)` for `n` such
/// sessions, where `v` is the pooled variance of all groups of sessions that share equally many
/// steps.
pub(crate) fn expected(
    sessions: &[Landmarks],
    path: &[String],
    landmark: usize,
) -> Option<Landmark> {
    (0..=path.len()).rev().find_map(|depth| {
        let own = sessions.iter().filter(|session| session.path.starts_with(&path[..depth]));
        let own: Vec<f64> = own.map(|session| session.at[landmark]).collect();
        let variance = pooled(sessions, depth, landmark).filter(|_| !own.is_empty())?;
        let (count, sessions) = (own.len() as f64, own.len());
        let mean = own.iter().sum::<f64>() / count;
        Some(Landmark { mean, sd: (variance * (1.0 + 1.0 / count)).sqrt(), sessions })
    })
}

/// Returns the variance within groups of sessions that share the first `depth` steps of their
/// paths; `None` if no group has two sessions.
fn pooled(sessions: &[Landmarks], depth: usize, landmark: usize) -> Option<f64> {
    let mut groups: std::collections::BTreeMap<&[String], Vec<f64>> = Default::default();
    for Landmarks { path, at } in sessions {
        groups.entry(&path[..depth.min(path.len())]).or_default().push(at[landmark]);
    }
    let (mut squares, mut free) = (0.0, 0.0);
    for group in groups.values() {
        let mean = group.iter().sum::<f64>() / group.len() as f64;
        squares += group.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
        free += group.len() as f64 - 1.0;
    }
    (free > 0.0).then(|| squares / free)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_path_narrows_a_landmark_and_a_movement_is_counted() {
        let path = |who: &str| vec![who.to_owned()];
        let sessions: Vec<_> = [("a", 1.0), ("a", 1.2), ("b", 5.0), ("b", 5.2)]
            .map(|(who, x)| Landmarks { path: path(who), at: [x; LANDMARKS] })
            .into();
        let known = expected(&sessions, &path("b"), 0).unwrap();
        // For two groups of two, v = (2 * 0.02)/2 = 0.02, times 3/2.
        assert!((known.mean - 5.1).abs() < 1e-12 && (known.sd.powi(2) - 0.03).abs() < 1e-12);
        let new = expected(&sessions, &path("c"), 0).unwrap();
        assert!(new.sd > 2.0 && new.sessions == 4, "{new:?}");
        let wave = (0..100).map(|k| (0.2 * f64::from(k)).cos());
        assert_eq!(passes(wave), 6);
        assert_eq!(passes([1.0, 1.0].into_iter()), 0);
    }
}

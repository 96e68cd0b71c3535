//! A prior: the distribution of a model's coefficients over sessions, learnt from earlier sessions.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use stretch_calibrate::{
    CalibrateError,
    toolkit::{LinearFactor, extent},
};
use stretch_core::{Interval, Normalisation, Range, RangeSpec, Target};
use stretch_data::{in_digits, listed, resampling, unit_of};

use crate::{
    SleeveError,
    calibrate::{array::Still, bank::Bank},
};

use super::{
    expected::{Expected, expected},
    landmarks::Landmarks,
    record::{triangle, triangles},
    session::{SCHEMA, Session},
    tree::{Known, Leaf, Normal, Spread, Tree},
};

/// Correlation time of the errors of sleeves, s. Samples within this time count as one.
const CORRELATED_S: f64 = 1.0;
/// Smallest absolute correlation at which the sign of the correlation can be trusted.
pub(crate) const CLEAR: f64 = 0.5;
/// Smallest number of sessions from which a spread can be learnt.
pub(crate) const LEAST_SESSIONS: usize = 3;

/// Distribution of the coefficients of a future session, learnt from earlier ones.
///
/// The model is linear in its coefficients. For each channel it has a cubic of the signal. For each of four time
/// constants it has the change of the channel over that time, and this change multiplied by the signal and by its
/// square. All terms are defined over the prior's own domains. The coefficients of sessions vary around those of their
/// wearer, and wearers vary around the population. There are as many levels as the paths of the sessions have steps.
/// Each level has its own covariance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
// Error messages about a file use this name.
#[serde(deny_unknown_fields, expecting = "struct Record")]
pub struct Prior {
    pub(crate) schema: u32,
    /// Columns of the signals.
    pub signals: Vec<String>,
    /// Column of the reference.
    pub reference: String,
    /// Sample rate, Hz.
    pub sample_rate_hz: f64,
    /// Number of sessions from which the prior was learnt.
    pub sessions: usize,
    /// Expected errors after different durations of reference, from left-out sessions.
    pub expected: Vec<Expected>,
    pub(crate) target: Target,
    pub(crate) target_range: Range,
    pub(crate) estimate: Interval,
    pub(crate) domains: Vec<Vec<Interval>>,
    /// Distribution for every known path. The first path is empty.
    pub(crate) known: Vec<Known>,
    /// Covariance of the coefficients at each level below the root.
    #[serde(with = "triangles")]
    pub(crate) levels: Vec<DMatrix<f64>>,
    /// Variance of a sample about the estimate from its session's own coefficients, in normalised target.
    pub(crate) noise: f64,
    /// `X'X` divided by the number of samples, where each row of `X` contains the terms of a sample.
    #[serde(with = "triangle")]
    pub(crate) gram: DMatrix<f64>,
    /// The longest observed runs of equal samples, for each channel.
    pub(crate) still_samples: Vec<u32>,
    /// Number of samples of each channel that were examined.
    pub(crate) still_seen: u64,
    /// Path and landmarks of each session, in normalised target.
    pub(crate) landmarks: Vec<Landmarks>,
    /// Largest changes of the zero within sessions of a single gauge, in standard deviations of levels.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) zero_moves: Vec<f64>,
}

impl Prior {
    /// Returns the size of one unit of the normalised target in the reference's unit, without its sign.
    pub(super) fn unit_of_target(&self) -> f64 {
        self.target.reference_per_normalised(self.target_range).abs()
    }

    /// Returns the longest observed runs of equal samples.
    pub(super) fn still(&self) -> Still {
        Still { longest: self.still_samples.clone(), samples: self.still_seen }
    }

    /// Learns a prior from sessions.
    ///
    /// # Errors
    /// [`SleeveError::Prior`] if there are fewer than three sessions, if a session is a copy of another, or if a
    /// session differs from the first in its channels, unit, rate or polarity.
    pub fn learn(sessions: &[Session]) -> Result<Self, SleeveError> {
        let first = check_all(sessions)?;
        let channels = first.signals.len();
        let pooled = |channel: usize| -> Vec<Interval> {
            let states = first.domains[channel].len();
            let ends = |k: usize| {
                let all = sessions.iter().map(move |s| s.domains[channel][k]);
                extent(all.flat_map(|d| [d.min, d.max]))
            };
            (0..states).map(ends).collect()
        };
        let domains: Vec<_> = (0..channels).map(pooled).collect();
        let ends = sessions.iter().flat_map(|s| [s.reference_range.min, s.reference_range.max]);
        let ends = extent(ends);
        let target = target_of(&first.reference, ends.max);
        let targets = extent([ends.min, ends.max].into_iter().map(|x| target.from_reference(x)));
        let Interval { min, max } = targets;
        let target_range =
            Range::new(RangeSpec { mode: Normalisation::MinMax, zero: 0.0, min, max })?;
        let bank = Bank::new(domains.clone());
        let undetermined = || CalibrateError::Undetermined { model: "prior".into() };
        let parts: Option<Vec<Vec<Leaf>>> =
            sessions.iter().map(|session| leaves(session, &bank, (target, target_range))).collect();
        let parts = parts.ok_or_else(undetermined)?;
        let leaves: Vec<Leaf> = parts.iter().map(|parts| whole(parts)).collect();
        // All paths get the same depth. A session with a shorter path becomes a separate group at the missing levels.
        let depth = sessions.iter().map(|s| s.path.len()).max().unwrap_or(0);
        let paths: Vec<Vec<String>> = sessions.iter().map(|s| filled(s, depth)).collect();
        let paths = without_single_levels(paths);
        let tree = Tree::new(&paths, &leaves);
        let spread = tree.learn().ok_or_else(undetermined)?;
        let known = tree.known(&spread).ok_or_else(undetermined)?;
        let left = tree.left_out(&spread).ok_or_else(undetermined)?;
        let still = sessions.iter().map(Session::still).reduce(|all, one| all.and(&one));
        let still = still.ok_or_else(undetermined)?;
        let count: f64 = leaves.iter().map(|leaf| leaf.count).sum();
        let gram = leaves
            .iter()
            .fold(DMatrix::zeros(bank.terms(), bank.terms()), |sum, leaf| sum + &leaf.gram / count);
        let unit = target.reference_per_normalised(target_range).abs();
        Ok(Self {
            schema: SCHEMA,
            signals: first.signals.clone(),
            reference: first.reference.clone(),
            sample_rate_hz: first.sample_rate_hz,
            sessions: sessions.len(),
            expected: expected(&parts, &left, spread.noise, unit),
            target,
            target_range,
            estimate: Interval {
                min: target_range.normalise(min),
                max: target_range.normalise(max),
            },
            domains,
            known,
            levels: spread.levels,
            noise: spread.noise,
            gram,
            still_samples: still.longest,
            still_seen: still.samples,
            landmarks: normalised_landmarks(sessions, (target, target_range)),
            zero_moves: zero_moves(sessions),
        })
    }

    /// Returns a prior with the same covariances, whose means for wearers and for the population come from `sessions`.
    /// Use it to add sessions that were recorded after the prior was learnt. Earlier sessions count only if they are
    /// given again. The changes of the zero come from `sessions` if there are enough of them, otherwise from the
    /// earlier sessions.
    ///
    /// # Errors
    /// The errors of [`Prior::learn`].
    pub fn knowing(&self, sessions: &[Session]) -> Result<Self, SleeveError> {
        check_all(sessions)?;
        let undetermined = || CalibrateError::Undetermined { model: "prior".into() };
        let bank = Bank::new(self.domains.clone());
        let parts: Option<Vec<Vec<Leaf>>> = sessions
            .iter()
            .map(|session| leaves(session, &bank, (self.target, self.target_range)))
            .collect();
        let leaves: Vec<Leaf> = parts.ok_or_else(undetermined)?.iter().map(|p| whole(p)).collect();
        let depth = self.levels.len().saturating_sub(1);
        let paths: Vec<Vec<String>> = sessions.iter().map(|s| filled(s, depth)).collect();
        let spread = Spread { levels: self.levels.clone(), noise: self.noise };
        let known = Tree::new(&paths, &leaves).known(&spread).ok_or_else(undetermined)?;
        let landmarks = normalised_landmarks(sessions, (self.target, self.target_range));
        let mut zero_moves = zero_moves(sessions);
        if zero_moves.len() < LEAST_SESSIONS {
            zero_moves.clone_from(&self.zero_moves);
        }
        Ok(Self { known, landmarks, zero_moves, sessions: sessions.len(), ..self.clone() })
    }

    /// Returns the unit of the reference.
    pub fn unit(&self) -> String {
        unit_of(&self.reference)
    }

    /// Returns the known paths: sensors, their wearers, and activities.
    pub fn paths(&self) -> impl Iterator<Item = &[String]> {
        self.known.iter().skip(1).map(|known| known.path.as_slice())
    }

    /// Returns the distribution of the coefficients of a new session with a path, and how many steps of the path are
    /// known.
    pub(crate) fn of(&self, path: &[String]) -> (Normal, usize) {
        let fits = |seen: &[String]| {
            seen.len() <= path.len() && seen.iter().zip(path).all(|(a, b)| a == b)
        };
        let seen = self.known.iter().filter(|known| fits(&known.path));
        let Some(Known { path: seen, mean, covariance }) = seen.max_by_key(|own| own.path.len())
        else {
            // The empty path is always known, so this does not occur.
            return (Normal { mean: DVector::zeros(0), covariance: DMatrix::zeros(0, 0) }, 0);
        };
        let below = &self.levels[seen.len().min(self.levels.len())..];
        let covariance = below.iter().fold(covariance.clone(), |sum, level| sum + level);
        (Normal { mean: mean.clone(), covariance }, seen.len())
    }
}

/// Returns the target of a model of this reference: the contraction of a length, otherwise the reference itself.
pub(crate) fn target_of(reference: &str, most: f64) -> Target {
    match reference.starts_with("length") && most > 0.0 {
        true => Target::Contraction { rest_length: most },
        false => Target::Direct,
    }
}

fn zero_moves(sessions: &[Session]) -> Vec<f64> {
    sessions.iter().filter_map(|session| session.zero_move).collect()
}

/// Returns the number of samples that count as one.
pub(crate) fn correlated(sample_rate_hz: f64) -> f64 {
    (CORRELATED_S * sample_rate_hz).max(1.0)
}

/// Returns the sums of a session's parts, with the terms and the target of a prior.
fn leaves(session: &Session, bank: &Bank, (target, range): (Target, Range)) -> Option<Vec<Leaf>> {
    let zero = range.normalise(target.from_reference(0.0));
    let scale = range.normalise(target.from_reference(1.0)) - zero;
    let share = 1.0 / correlated(session.sample_rate_hz);
    let terms = bank.terms();
    let one = |(rows, factor): (f64, LinearFactor)| {
        let all = factor.triangle.tr_mul(&factor.triangle) * share;
        Leaf {
            gram: all.view((0, 0), (terms, terms)).into_owned(),
            cross: all.view((0, terms), (terms, 1)).column(0).into_owned(),
            power: all[(terms, terms)],
            count: rows * share,
        }
    };
    Some(session.factors(bank, (scale, zero))?.into_iter().map(one).collect())
}

/// Returns the landmarks of sessions in normalised target.
fn normalised_landmarks(sessions: &[Session], (target, range): (Target, Range)) -> Vec<Landmarks> {
    let normalised = |x: f64| range.normalise(target.from_reference(x));
    let one = |s: &Session| {
        let [low, high, rest] = s.landmarks.map(normalised);
        // The target may fall when the reference rises.
        Landmarks { path: s.path.clone(), at: [low.min(high), low.max(high), rest] }
    };
    sessions.iter().map(one).collect()
}

/// Returns the sums over all parts of a session.
pub(crate) fn whole(parts: &[Leaf]) -> Leaf {
    let mut all = parts[0].clone();
    for part in &parts[1..] {
        all.gram += &part.gram;
        all.cross += &part.cross;
        all.power += part.power;
        all.count += part.count;
    }
    all
}

/// Returns the path of a session, filled up to `depth` with the session's name.
fn filled(session: &Session, depth: usize) -> Vec<String> {
    let mut path = session.path.clone();
    path.resize(depth, format!("({})", session.name));
    path
}

/// Removes the levels of the tree in which every session has a separate node, and all levels below them, because a
/// covariance cannot be learnt from such levels.
fn without_single_levels(paths: Vec<Vec<String>>) -> Vec<Vec<String>> {
    let depth = paths.first().map_or(0, Vec::len);
    let distinct = |level: usize| {
        let mut heads: Vec<&[String]> = paths.iter().map(|p| &p[..=level]).collect();
        heads.sort_unstable();
        heads.dedup();
        heads.len()
    };
    // Below a level with a separate node for every session, each node contains only this session.
    let keep = (0..depth).take_while(|&level| distinct(level) < paths.len()).count();
    paths.into_iter().map(|path| path[..keep].to_vec()).collect()
}

/// Checks sessions against each other. Returns the first.
fn check_all(sessions: &[Session]) -> Result<&Session, SleeveError> {
    let few = || SleeveError::Prior {
        file: "prior".into(),
        problem: format!(
            "there are too few sessions ({}) to show how sessions vary; give at least {LEAST_SESSIONS}, each written by stretch \
             calibrate --session",
            sessions.len()
        ),
    };
    let first = sessions.first().filter(|_| sessions.len() >= LEAST_SESSIONS).ok_or_else(few)?;
    for (k, session) in sessions.iter().enumerate() {
        let wrong = differs(session, first).or_else(|| copy(session, &sessions[..k]));
        wrong.map_or(Ok(()), |problem| {
            Err(SleeveError::Prior { file: session.name.clone(), problem })
        })?;
    }
    Ok(first)
}

/// Returns a problem if a session is the same as one before it. A copy would count twice.
fn copy(session: &Session, before: &[Session]) -> Option<String> {
    let is_same = |one: &&Session| one.parts == session.parts && one.domains == session.domains;
    before.iter().find(is_same).map(|one| {
        format!("it has the same samples as {}: equal sessions do not show how sessions vary; give it once", one.name)
    })
}

/// Returns the reason why a session cannot share a prior with another one.
fn differs(session: &Session, first: &Session) -> Option<String> {
    if session.signals.len() != first.signals.len() {
        return Some(format!(
            "it has {} channels ({}) and {} has {} ({}): all sessions of a prior need the same channels",
            session.signals.len(),
            listed(&session.signals),
            first.name,
            first.signals.len(),
            listed(&first.signals)
        ));
    }
    if let Some(name) = elsewhere(&session.signals, &first.signals) {
        return Some(format!(
            "{name} does not have the same position in this session ({}) as in {} ({}), and signals are matched by position: write this session again \
             (stretch calibrate --session) in that order",
            session.signals.join(","),
            first.name,
            first.signals.join(",")
        ));
    }
    if unit_of(&session.reference) != unit_of(&first.reference) {
        return Some(format!(
            "its reference is {} and that of {} is {}: convert the recording of one (stretch convert), and write its session again",
            session.reference, first.name, first.reference
        ));
    }
    if (session.sample_rate_hz / first.sample_rate_hz - 1.0).abs() > 0.05 {
        return Some(format!(
            "it was sampled at {} Hz and {} at {} Hz: resample its recording ({}) and write it again",
            in_digits(session.sample_rate_hz, 6),
            first.name,
            in_digits(first.sample_rate_hz, 6),
            resampling(first.sample_rate_hz)
        ));
    }
    let span = |of: &Interval| of.max - of.min;
    let steepness = |of: &Session, k: usize| span(&of.reference_range) / span(&of.domains[k][0]);
    let (own, other) = (session.correlations(), first.correlations());
    let steeper = (0..own.len()).map(|k| (own[k], steepness(session, k) / steepness(first, k)));
    if is_other_unit(steeper) {
        return Some(format!(
            "{} has a range of {:.4} here but in {} one of {:.4}, and the signals do not explain that: is one in radians and the other in degrees, \
             or one in centimetres and the other in millimetres? Convert it (stretch convert), and write the session again",
            session.reference,
            span(&session.reference_range),
            first.name,
            span(&first.reference_range)
        ));
    }
    turned(own.into_iter().zip(other)).map(|opposite| {
        format!(
            "{opposite} of {} channels fall where those of {} rise: swap the wires and record again, change the sign of the signal, or leave one session out",
            session.signals.len(),
            first.name
        )
    })
}

/// Returns the first signal whose position in the list `others` is different.
pub(crate) fn elsewhere<'a>(signals: &'a [String], others: &[String]) -> Option<&'a str> {
    let differs = |(place, name): &(usize, &String)| {
        others.iter().position(|other| other == *name).is_some_and(|other| other != *place)
    };
    signals.iter().enumerate().find(differs).map(|(_, name)| name.as_str())
}

/// Returns whether the reference is in another unit. The pairs contain the correlation of each channel with the
/// reference, and the change of the reference per change of the channel relative to the usual. The ratio between
/// wearers is below ten, the smallest ratio between two units.
pub(crate) fn is_other_unit(channels: impl Iterator<Item = (f64, f64)>) -> bool {
    const USUAL: std::ops::RangeInclusive<f64> = 0.2..=5.0;
    let mut clear = channels.filter(|(correlation, _)| correlation.abs() > CLEAR).peekable();
    clear.peek().is_some() && clear.all(|(_, steeper)| !USUAL.contains(&steeper))
}

/// Returns the number of channels that follow the reference in the opposite direction, if they outnumber those that
/// follow it in the expected one. The pairs contain the found and the expected correlations.
pub(crate) fn turned(pairs: impl Iterator<Item = (f64, f64)>) -> Option<usize> {
    let clear = pairs.filter(|(a, b)| a.abs() > CLEAR && b.abs() > CLEAR);
    let (same, opposite): (Vec<_>, Vec<_>) = clear.partition(|(a, b)| a * b > 0.0);
    (opposite.len() > same.len()).then_some(opposite.len())
}

/// Lists the names of paths for a message.
pub(crate) fn paths_in_words(paths: impl Iterator<Item = Vec<String>>) -> String {
    listed(&paths.map(|path| path.join("/")).collect::<Vec<_>>())
}

//! Makes a calibration from a prior and a session without any reference.
//!
//! This assumes that the movement has the same ends and the same rest as earlier ones. The mean rows of the samples at
//! these [landmarks](super::landmarks) are three additional rows of the Bayesian least squares of
//! [`Prior::update`](super::Prior::update). Their targets are the values of earlier sessions, and their noise is the
//! spread of those values. A shift and a scale are therefore accepted only as far as earlier sessions differed.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use stretch_calibrate::{
    CalibrateError,
    toolkit::{extent, provenance},
};
use stretch_data::{Trial, unit_of};

use crate::{
    SleeveCalibration, SleeveError, SleeveFit, SleeveOptions,
    calibrate::{
        bank::Bank,
        channels::Channels,
        linear::{Linear, inverse, symmetric},
    },
};

use super::{
    landmarks::{LANDMARKS, Landmark, NAMES, Place, expected, landmarks, passes, warmed_up},
    learnt::Prior,
    tree::Normal,
};

/// The 0.999 quantile of chi-square with three degrees of freedom. One in a thousand sessions like those of the prior
/// is refused.
const UNSEEN: f64 = 16.266;
/// Smallest number of passes from one end to the other in a movement.
const LEAST_PASSES: usize = 2;

/// Assumptions and result of a renewal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RenewSummary {
    /// The ends and the rest of the movement.
    pub assumed: Vec<Assumed>,
    /// Squared distance of the signals from those of earlier sessions, in standard deviations: chi-square with three
    /// degrees of freedom.
    pub distance: f64,
    /// Shift of the estimate in the middle of the movement, in the reference's unit.
    pub shift: f64,
    /// Ratio of the movement's span to its previous span.
    pub scale: f64,
    /// Root mean square error of the prior alone on left-out sessions ([`Expected`](super::Expected)), in the
    /// reference's unit; `None` if the prior has no such session. The error after a renewal cannot be estimated.
    pub prior_rmse: Option<f64>,
}

/// An assumed value of the reference.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Assumed {
    /// Name of the landmark: low end, high end or rest.
    pub landmark: String,
    /// The assumed reference at the landmark, in its unit.
    pub reference: f64,
    /// Standard deviation of this value over sessions, in the same unit.
    pub sd: f64,
    /// Number of sessions from which the value was computed.
    pub sessions: usize,
    /// The mean estimate at the landmark before the renewal.
    pub before: f64,
    /// The mean estimate at the landmark after the renewal.
    pub after: f64,
}

/// Mean rows of terms at the landmarks.
type Rows = [DVector<f64>; LANDMARKS];

/// The coefficients after an update with the landmarks of a session, with the mean rows and the squared distance.
struct OnLandmarks {
    after: Normal,
    rows: Rows,
    distance: f64,
}

/// Note on a movement that fits equally well with all gauges reversed.
const REVERSED: &str = "it cannot be determined whether all gauges are reversed, because reversed signals would fit the earlier sessions as well: \
                        check that the estimate rises when the measured quantity does, or record ten seconds with a reference \
                        (stretch calibrate --prior)";

impl Prior {
    /// Renews a calibration by the ends and the rests of a movement, without any reference.
    ///
    /// `X` are the mean rows at the landmarks, and `y` are their values in earlier sessions. `V` is diagonal: the
    /// variances of these values plus that of a sample. The coefficients `N(m, S)` become `m + K(y - X m)`, `S - K X
    /// S`, with `K = S X'(X S X' + V)^-1`. The landmarks are found with the estimates from `m`, then again with those
    /// from the result. A session is refused if `(y - X m)'(X S X' + V)^-1(y - X m)` exceeds the 0.999 quantile of
    /// chi-square.
    ///
    /// # Errors
    /// [`SleeveError::Prior`] if the data have other channels, another rate or another unit than the prior, contain no
    /// complete movement, or differ from all earlier sessions. The error states what to do.
    pub fn renew(
        &self,
        trials: &[Trial],
        options: &SleeveOptions,
        earlier: Option<&SleeveCalibration>,
    ) -> Result<SleeveFit<RenewSummary>, SleeveError> {
        let signals = if options.signals.is_empty() { &self.signals } else { &options.signals };
        self.refuse_columns(signals, &self.reference)?;
        let channels = Channels::without_reference(trials, signals)?;
        self.refuse_signals(&channels)?;
        let undetermined = || CalibrateError::Undetermined { model: "prior".into() };
        let (normal, known) = self.before(&options.path, earlier)?;
        let values: Option<Vec<Landmark>> =
            (0..LANDMARKS).map(|k| expected(&self.landmarks, &options.path, k)).collect();
        let values = values.ok_or_else(undetermined)?;
        let bank = Bank::new(self.domains.clone());
        self.refuse_standing(&bank, &channels, &normal, &values)?;
        let own = self.onto_landmarks(&channels, &normal, &values);
        let OnLandmarks { after, rows, distance } = own.ok_or_else(undetermined)?;
        let mirrored = self.mirrored(trials, signals, &channels)?;
        let is_seen = |mirrored: &Channels| {
            let found = self.onto_landmarks(mirrored, &normal, &values);
            found.is_some_and(|found| found.distance <= UNSEEN)
        };
        let may_be_reversed = mirrored.iter().any(is_seen);
        self.refuse_unseen(distance, &options.path, may_be_reversed)?;
        let mut notes = channels.notes.clone();
        notes.extend(self.whom(&options.path, known));
        notes.extend(may_be_reversed.then(|| REVERSED.to_owned()));
        let predicted = after.covariance.component_mul(&self.gram).sum() + self.noise;
        let [prior_rmse, _] = self.expect(0.0, known > 0);
        let variance = self.variance(prior_rmse).unwrap_or(predicted);
        let linear = self.linear(&after.mean, self.gram.clone(), variance);
        let linear = Linear { signals: signals.clone(), ..linear };
        let provenance = provenance(&options.date, trials, signals).with_time(&options.time);
        Ok(SleeveFit {
            calibration: linear.record(Some(&channels), None, provenance)?,
            summary: self.summary(
                &normal.mean,
                &after.mean,
                &rows,
                &values,
                (distance, prior_rmse),
            ),
            notes,
        })
    }

    /// Returns the coefficients before the renewal, and the number of known steps of the path.
    fn before(
        &self,
        path: &[String],
        earlier: Option<&SleeveCalibration>,
    ) -> Result<(Normal, usize), SleeveError> {
        let (normal, known) = self.of(path);
        let Some(calibration) = earlier else { return Ok((normal, known)) };
        let linear = self.linear(&normal.mean, self.gram.clone(), self.noise);
        let weights = linear.weights_of(calibration).ok_or(SleeveError::OtherPrior)?;
        // The covariance is twice that of a session, because both the earlier and the new session deviate from the mean
        // of their wearer.
        let covariance = self.levels.last().map_or(normal.covariance, |level| level * 2.0);
        Ok((Normal { mean: DVector::from_vec(weights), covariance }, known))
    }

    /// Returns the coefficients after an update with the landmarks. The landmarks are found with the coefficients
    /// before the update, and once more with its result.
    fn onto_landmarks(
        &self,
        channels: &Channels,
        before: &Normal,
        values: &[Landmark],
    ) -> Option<OnLandmarks> {
        let bank = Bank::new(self.domains.clone());
        let mut rows = self.rows(&bank, channels, &before.mean);
        let (first, _) = moved(before, &rows, values, self.noise)?;
        rows = self.rows(&bank, channels, &first.mean);
        let (after, distance) = moved(before, &rows, values, self.noise)?;
        rows = self.rows(&bank, channels, &after.mean);
        Some(OnLandmarks { after, rows, distance })
    }

    /// Returns the mean rows at the landmarks that are found with these coefficients.
    fn rows(&self, bank: &Bank, channels: &Channels, weights: &DVector<f64>) -> Rows {
        let mut row = rows_of(bank, channels);
        let levels: HashMap<Place, f64> =
            warmed_up(channels).iter().map(|place| (*place, row(place).dot(weights))).collect();
        let sets = landmarks(channels, |place| levels.get(place).copied().unwrap_or(0.0));
        sets.map(|set| {
            let sum = set.iter().map(&mut row).fold(DVector::zeros(weights.len()), |a, b| a + b);
            sum / f64::max(set.len() as f64, 1.0)
        })
    }

    /// Refuses a session without a complete movement.
    fn refuse_standing(
        &self,
        bank: &Bank,
        channels: &Channels,
        normal: &Normal,
        values: &[Landmark],
    ) -> Result<(), SleeveError> {
        let mut row = rows_of(bank, channels);
        let levels: Vec<f64> =
            warmed_up(channels).iter().map(|place| row(place).dot(&normal.mean)).collect();
        let ends = extent(levels.iter().copied());
        let span = ends.max - ends.min;
        let usual = values[1].mean - values[0].mean;
        let passes = passes(levels.iter().copied());
        if span >= super::update::MOVEMENT * usual && passes >= LEAST_PASSES {
            return Ok(());
        }
        let unit = self.unit_of_target();
        Err(SleeveError::Prior {
            file: "these data".into(),
            problem: format!(
                "they contain no complete movement: {:.3} {} from end to end (earlier sessions: {:.3}), and {passes} passes between the ends; \
                 move over the whole range, at least once up and down, or record some seconds with a reference (stretch calibrate --prior)",
                span * unit,
                unit_of(&self.reference),
                usual * unit
            ),
        })
    }

    fn refuse_unseen(
        &self,
        distance: f64,
        path: &[String],
        may_be_reversed: bool,
    ) -> Result<(), SleeveError> {
        if distance <= UNSEEN {
            return Ok(());
        }
        let of = match path.is_empty() {
            true => String::new(),
            false => format!(" of {}", path.join("/")),
        };
        let why = match may_be_reversed {
            true => {
                "they would fit if all gauges were reversed: swap the wires or change the signs of the columns (stretch convert), or"
            }
            false => "check the movement, the sensor and the polarity, or",
        };
        Err(SleeveError::Prior {
            file: "these data".into(),
            problem: format!(
                "at the ends and at rest, their signals are further from the sessions{of} than 999 of 1000 sessions would be \
                 (squared distance {distance:.1}, limit {UNSEEN}): {why} record ten seconds or more with a reference (stretch calibrate --prior)"
            ),
        })
    }

    fn summary(
        &self,
        before: &DVector<f64>,
        after: &DVector<f64>,
        rows: &Rows,
        values: &[Landmark],
        (distance, prior_rmse): (f64, Option<f64>),
    ) -> RenewSummary {
        let unit = self.unit_of_target();
        let reference = |t: f64| self.target.to_reference(self.target_range.denormalise(t));
        let one = |((row, value), name): ((&DVector<f64>, &Landmark), &str)| Assumed {
            landmark: name.to_owned(),
            reference: reference(value.mean),
            sd: value.sd * unit,
            sessions: value.sessions,
            before: reference(row.dot(before)),
            after: reference(row.dot(after)),
        };
        let assumed: Vec<Assumed> = rows.iter().zip(values).zip(NAMES).map(one).collect();
        let middle = |of: fn(&Assumed) -> f64| 0.5 * (of(&assumed[0]) + of(&assumed[1]));
        let span = |of: fn(&Assumed) -> f64| of(&assumed[1]) - of(&assumed[0]);
        RenewSummary {
            distance,
            shift: middle(|a| a.after) - middle(|a| a.before),
            scale: span(|a| a.after) / span(|a| a.before),
            prior_rmse,
            assumed,
        }
    }
}

/// Returns a function that gives the row of terms of a sample.
fn rows_of<'a>(bank: &'a Bank, channels: &'a Channels) -> impl FnMut(&Place) -> DVector<f64> + 'a {
    let (mut row, mut scratch) = (Vec::new(), (Vec::new(), Vec::new()));
    move |&(i, k)| {
        bank.fill(channels.stretches[i].at(k), &mut row, &mut scratch);
        DVector::from_column_slice(&row)
    }
}

/// Returns the coefficients after an update with the landmarks, and the squared distance of the landmarks from the
/// expected values.
fn moved(normal: &Normal, rows: &Rows, values: &[Landmark], noise: f64) -> Option<(Normal, f64)> {
    let x = DMatrix::from_fn(LANDMARKS, normal.mean.len(), |i, j| rows[i][j]);
    let off = DVector::from_fn(LANDMARKS, |i, _| values[i].mean) - &x * &normal.mean;
    let own = DMatrix::from_fn(LANDMARKS, LANDMARKS, |i, j| {
        if i == j { values[i].sd.powi(2) + noise } else { 0.0 }
    });
    let cross = &normal.covariance * x.transpose();
    let precision = inverse(&(&x * &cross + own))?;
    let distance = off.dot(&(&precision * &off));
    let gain = &cross * precision;
    let mean = &normal.mean + &gain * off;
    let covariance = symmetric(&normal.covariance - &gain * cross.transpose());
    Some((Normal { mean, covariance }, distance))
}

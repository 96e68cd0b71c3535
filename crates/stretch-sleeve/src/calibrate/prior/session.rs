//! A session with a reference, stored as sums over its samples. A prior is learnt from sessions.

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use stretch_calibrate::{
    CalibrateError,
    toolkit::{LinearFactor, RowAccumulator, extent},
};
use stretch_core::{Interval, Target};
use stretch_data::Trial;

use crate::{
    SleeveError, SleeveOptions,
    calibrate::{
        array::Still,
        bank::Bank,
        channels::{Channels, correlation},
        turns,
    },
};

use super::{
    landmarks::{LANDMARKS, at_landmarks},
    learnt::target_of,
};

/// The schema of sessions and priors that this release writes and reads.
pub(crate) const SCHEMA: u32 = 1;
/// Ends of the parts of a session, in seconds from its beginning. The last part is open-ended.
pub(crate) const PARTS_S: [f64; 4] = [10.0, 20.0, 30.0, 60.0];

/// A session with a reference, as triangular factors of its rows of terms. They contain everything that a prior needs,
/// and no samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Session {
    pub(crate) schema: u32,
    /// Name, for messages.
    pub name: String,
    /// Sensor, wearer, and activity, as far as they are known.
    pub path: Vec<String>,
    /// Columns of the signals.
    pub signals: Vec<String>,
    /// Column of the reference.
    pub reference: String,
    /// Sample rate, Hz.
    pub sample_rate_hz: f64,
    pub(crate) domains: Vec<Vec<Interval>>,
    pub(crate) reference_range: Interval,
    /// For each channel the largest number of equal samples in a row, counted while another channel changes.
    pub(crate) still_samples: Vec<u32>,
    /// The reference at the [landmarks](super::landmarks).
    pub(crate) landmarks: [f64; LANDMARKS],
    pub(crate) parts: Vec<SessionPart>,
    /// Largest change of the zero within the session, in standard deviations of levels, if the session has a single
    /// gauge and enough movements.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) zero_move: Option<f64>,
}

/// The rows between two times of a session, with the terms over the session's own domains.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SessionPart {
    pub(crate) rows: u64,
    /// The upper triangular factor of `[X y]`, row by row, with `y` in the reference's unit.
    pub(crate) triangle: Vec<f64>,
}

impl Session {
    /// Sums up a session, and returns it with notes on the data. Several trials count as one session, in the given
    /// order.
    ///
    /// # Errors
    /// [`SleeveError`], which names the trial and the column: a missing or constant column, channels that are copies,
    /// or different rates.
    pub fn new(
        name: &str,
        trials: &[Trial],
        options: &SleeveOptions,
    ) -> Result<(Self, Vec<String>), SleeveError> {
        let channels = Channels::new(trials, &options.signals, &options.reference)?;
        let reference_range = extent(channels.reference());
        if reference_range.min >= reference_range.max {
            let (column, value) = (options.reference.clone(), reference_range.min);
            return Err(CalibrateError::Constant { column, value }.into());
        }
        let session = Self {
            schema: SCHEMA,
            name: name.to_owned(),
            path: options.path.clone(),
            signals: options.signals.clone(),
            reference: options.reference.clone(),
            sample_rate_hz: channels.sample_rate.hz(),
            domains: channels.bank().domains,
            reference_range,
            still_samples: Still::of(&channels).longest,
            landmarks: at_landmarks(&channels),
            parts: parts(&channels),
            zero_move: zero_move(&channels, target_of(&options.reference, reference_range.max)),
        };
        Ok((session, channels.notes))
    }

    /// Returns the same session with some of its channels, in the given order.
    ///
    /// # Errors
    /// [`SleeveError::Channels`] if a channel does not exist, or if none is given.
    pub fn of_channels(&self, keep: &[usize]) -> Result<Self, SleeveError> {
        let most = self.signals.len();
        let wrong = || SleeveError::Channels { asked: keep.len(), most };
        if keep.is_empty() || keep.iter().any(|&k| k >= most) {
            return Err(wrong());
        }
        let own = Bank::terms_a_channel();
        let (terms, value) = (1 + most * own, 1 + most * own);
        let mut columns = vec![0];
        keep.iter().for_each(|&k| columns.extend(1 + k * own..1 + (k + 1) * own));
        columns.push(value);
        let one = |part: &SessionPart| {
            let triangle = unpacked(&part.triangle, terms + 1)?.select_columns(&columns);
            Some(SessionPart { rows: part.rows, triangle: packed(&triangle.qr().unpack_r()) })
        };
        let parts: Option<_> = self.parts.iter().map(one).collect();
        Ok(Self {
            signals: keep.iter().map(|&k| self.signals[k].clone()).collect(),
            domains: keep.iter().map(|&k| self.domains[k].clone()).collect(),
            still_samples: keep.iter().map(|&k| self.still_samples[k]).collect(),
            parts: parts.ok_or_else(wrong)?,
            ..self.clone()
        })
    }

    /// Returns the longest runs of equal samples.
    pub(crate) fn still(&self) -> Still {
        let samples = self.parts.iter().map(|part| part.rows).sum();
        Still { longest: self.still_samples.clone(), samples }
    }

    /// Returns the correlation of each channel with the reference.
    pub(crate) fn correlations(&self) -> Vec<f64> {
        let own = Bank::terms_a_channel();
        let value = 1 + self.signals.len() * own;
        let mut gram = DMatrix::zeros(value + 1, value + 1);
        for triangle in self.parts.iter().filter_map(|p| unpacked(&p.triangle, value + 1)) {
            gram += triangle.tr_mul(&triangle);
        }
        let covariance = |a: usize, b: usize| {
            let mean = |k: usize| gram[(0, k)] / gram[(0, 0)];
            gram[(a, b)] / gram[(0, 0)] - mean(a) * mean(b)
        };
        let one = |term: usize| {
            let power = covariance(term, term) * covariance(value, value);
            if power > 0.0 { covariance(term, value) / power.sqrt() } else { 0.0 }
        };
        (0..self.signals.len()).map(|k| one(1 + k * own)).collect()
    }

    /// Returns the number of rows and the factor of each part with the terms over `bank`. The reference is multiplied
    /// by `scale`, and `shift` is added.
    pub(crate) fn factors(
        &self,
        bank: &Bank,
        (scale, shift): (f64, f64),
    ) -> Option<Vec<(f64, LinearFactor)>> {
        let own = Bank::new(self.domains.clone());
        // A row over the bank is the row over the session's own domains times this matrix.
        let matrix = own.row_matrix_of(bank).transpose();
        let terms = own.terms();
        let one = |part: &SessionPart| {
            let triangle = unpacked(&part.triangle, terms + 1)?;
            let mut moved = DMatrix::zeros(terms + 1, terms + 1);
            moved
                .view_mut((0, 0), (terms + 1, terms))
                .copy_from(&(triangle.columns(0, terms) * &matrix));
            let value = triangle.column(terms) * scale + triangle.column(0) * shift;
            moved.set_column(terms, &value);
            let triangle = moved.qr().unpack_r();
            Some((part.rows as f64, LinearFactor { triangle }))
        };
        self.parts.iter().map(one).collect()
    }

    /// Checks the conditions that the format does not express.
    pub(crate) fn check(&self, file: &str) -> Result<(), SleeveError> {
        let problem = |problem: &str| SleeveError::Prior {
            file: file.to_owned(),
            problem: format!("{problem}; write the session again with stretch calibrate --session"),
        };
        if self.schema != SCHEMA {
            return Err(problem("it was written by another release"));
        }
        let columns = 1 + self.signals.len() * Bank::terms_a_channel() + 1;
        let is_whole = |part: &SessionPart| {
            part.triangle.len() == columns * (columns + 1) / 2
                && part.triangle.iter().all(|x| x.is_finite())
        };
        let has_domain = |d: &Vec<Interval>| d.iter().all(|d| d.min < d.max);
        let is_good = self.domains.len() == self.signals.len()
            && self.still_samples.len() == self.signals.len()
            && self.domains.iter().all(has_domain)
            && self.parts.iter().all(is_whole)
            && self.zero_move.is_none_or(|x| x.is_finite() && x > 0.0);
        if is_good { Ok(()) } else { Err(problem("its numbers contradict each other")) }
    }
}

/// Returns the largest change of the zero within the session, as [`turns::zero_move`]. Returns `None` if there are
/// several gauges.
fn zero_move(channels: &Channels, target: Target) -> Option<f64> {
    let stretches = channels.stretches.iter();
    let signals: Option<Vec<&[f64]>> =
        stretches.map(|own| (own.signals.len() == 1).then(|| own.signals[0].as_slice())).collect();
    let follows = correlation(channels.signal(0), channels.reference());
    let sign = (follows * target.reference_per_target()).signum();
    turns::zero_move(&signals?, sign, channels.sample_rate)
}

/// Sums up the rows of a session, part by part.
fn parts(channels: &Channels) -> Vec<SessionPart> {
    let bank = channels.bank();
    let hz = channels.sample_rate.hz();
    let mut sums: Vec<(u64, RowAccumulator)> =
        (0..=PARTS_S.len()).map(|_| (0, RowAccumulator::new(bank.terms()))).collect();
    let (mut row, mut scratch) = (Vec::new(), (Vec::new(), Vec::new()));
    for (before, stretch) in channels.placed() {
        for sample in stretch.warmed_up() {
            let time_s = (before + sample) as f64 / hz;
            let part = PARTS_S.iter().take_while(|&&end_s| time_s >= end_s).count();
            bank.fill(stretch.at(sample), &mut row, &mut scratch);
            sums[part].1.push(&row, stretch.reference[sample]);
            sums[part].0 += 1;
        }
    }
    let one = |(rows, sums): (u64, RowAccumulator)| SessionPart {
        rows,
        triangle: packed(&sums.factor().triangle),
    };
    sums.into_iter().map(one).collect()
}

/// Returns the upper triangle of a matrix, row by row.
pub(crate) fn packed(matrix: &DMatrix<f64>) -> Vec<f64> {
    let columns = matrix.ncols();
    (0..columns).flat_map(|i| (i..columns).map(move |j| matrix[(i, j)])).collect()
}

/// Returns the matrix with this upper triangle; `None` if the number of values is wrong.
pub(crate) fn unpacked(numbers: &[f64], columns: usize) -> Option<DMatrix<f64>> {
    if numbers.len() != columns * (columns + 1) / 2 {
        return None;
    }
    let mut matrix = DMatrix::zeros(columns, columns);
    let mut rest = numbers.iter();
    for i in 0..columns {
        for j in i..columns {
            matrix[(i, j)] = *rest.next()?;
        }
    }
    Some(matrix)
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::*;

    #[test]
    fn rows_of_a_session_are_rewritten_over_other_domains() {
        let n = 1500;
        let wave = |k: usize| (0.021 * k as f64).sin() + 0.4 * (0.0067 * k as f64).cos();
        let channel = |name: &str, values| stretch_data::Channel { name: name.into(), values };
        let trial = Trial {
            name: "a".into(),
            time_s: (0..n).map(|k| 0.02 * k as f64).collect(),
            channels: vec![
                channel("s1", (0..n).map(wave).collect()),
                channel("angle_deg", (0..n).map(|k| 3.0 * wave(k)).collect()),
            ],
        };
        let options = SleeveOptions::new(["s1"], "angle_deg");
        let session = Session::new("a", std::slice::from_ref(&trial), &options).unwrap().0;
        let wider = session.domains[0].iter();
        let wider = wider.map(|d| Interval { min: 1.5 * d.min - 0.3, max: 2.0 * d.max + 0.1 });
        let bank = Bank::new(vec![wider.collect()]);
        let weights = DVector::from_fn(bank.terms(), |k, _| 0.3 * (k as f64).cos());
        // If the rows are those over the wider domains, the sum of squared residuals agrees for any weights.
        let channels = Channels::new(&[trial], &["s1".into()], "angle_deg").unwrap();
        let (mut row, mut scratch, mut want) = (Vec::new(), (Vec::new(), Vec::new()), 0.0);
        let stretch = &channels.stretches[0];
        for sample in stretch.warmed_up() {
            bank.fill(stretch.at(sample), &mut row, &mut scratch);
            let told = DVector::from_column_slice(&row).dot(&weights);
            want += (told - 2.0 * stretch.reference[sample] - 1.0).powi(2);
        }
        let parts = session.factors(&bank, (2.0, 1.0)).unwrap();
        let with_value = weights.push(-1.0);
        let got: f64 = parts.iter().map(|(_, f)| (&f.triangle * &with_value).norm_squared()).sum();
        assert!((got / want - 1.0).abs() < 1e-9, "{got} beside {want}");
    }
}

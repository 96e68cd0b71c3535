//! One recorded trial: a time column and named channels.

use std::iter;

use crate::{DataError, Place, column_meant, data_set::CRC};

/// A recording: time stamps and named channels of the same length.
///
/// The last part of a channel's name is its unit (`length_mm`, `bridge_v`, `angle_deg`), as in the
/// file from which it was read.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trial {
    /// Name in messages: the file's name without its folder.
    pub name: String,
    /// Time stamps, s; finite and strictly increasing.
    pub time_s: Vec<f64>,
    /// Channels in the order of the file; each has the length of `time_s`.
    pub channels: Vec<Channel>,
}

/// One named column of a [`Trial`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Channel {
    /// Name with its unit: `length_mm`.
    pub name: String,
    /// One finite value for each time stamp.
    pub values: Vec<f64>,
}

/// Refuses trials that are too long to be processed in memory.
///
/// # Errors
/// [`DataError::TooLong`] if all trials together have more than `most` rows.
///
/// ```
/// use stretch_data::{Trial, check_rows};
/// let trial = Trial { time_s: vec![0.0; 3], ..Trial::default() };
/// assert!(check_rows([&trial, &trial], 6).is_ok());
/// assert!(check_rows([&trial, &trial], 5).is_err());
/// ```
pub fn check_rows<'a>(
    trials: impl IntoIterator<Item = &'a Trial>,
    most: usize,
) -> Result<(), DataError> {
    let rows = trials.into_iter().map(Trial::len).sum();
    if rows <= most { Ok(()) } else { Err(DataError::TooLong { rows, most }) }
}

/// Whether the times are the numbers of at least two rows: 0, 1, 2, ... See [`Trial::counts_rows`].
///
/// ```
/// assert!(stretch_data::are_row_numbers(&[0.0, 1.0]) && !stretch_data::are_row_numbers(&[0.0, 0.1]));
/// ```
pub fn are_row_numbers(time_s: &[f64]) -> bool {
    time_s.len() > 1 && time_s.iter().zip(0_u32..).all(|(time_s, row)| *time_s == f64::from(row))
}

/// Returns the [full name](Trial::full_name) of a column in the first of several trials; without a trial, the name as it is.
///
/// ```
/// use stretch_data::{Channel, Trial, full_name};
/// let channel = Channel { name: "voltage_v".into(), values: vec![1.5] };
/// let trial = Trial { time_s: vec![0.0], channels: vec![channel], ..Trial::default() };
/// assert_eq!([full_name(Some(&trial), "Voltage"), full_name(None, "Voltage")], ["voltage_v", "Voltage"]);
/// ```
pub fn full_name(first: Option<&Trial>, name: &str) -> String {
    first.map_or(name, |first| first.full_name(name)).to_owned()
}

impl Trial {
    /// Returns the number of samples.
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// Returns the channel called `name`, if there is one.
    pub fn channel(&self, name: &str) -> Option<&[f64]> {
        self.channels.iter().find(|c| c.name == name).map(|c| c.values.as_slice())
    }

    /// Returns the full name of the channel that `name` means: see [`column_meant`]. Any other name is returned unchanged.
    ///
    /// ```
    /// use stretch_data::{Channel, Trial};
    /// let channel = Channel { name: "voltage_v".into(), values: vec![1.5] };
    /// let trial = Trial { time_s: vec![0.0], channels: vec![channel], ..Trial::default() };
    /// assert_eq!([trial.full_name("Voltage"), trial.full_name("force_n")], ["voltage_v", "force_n"]);
    /// ```
    pub fn full_name<'a>(&'a self, name: &'a str) -> &'a str {
        let names = self.channels.iter().map(|channel| channel.name.as_str());
        column_meant(name, names).unwrap_or(name)
    }

    /// Returns the channel that `name` means, see [`column_meant`], or an error that lists the existing channels.
    ///
    /// # Errors
    /// [`DataError::MissingColumn`].
    ///
    /// ```
    /// use stretch_data::{Channel, Trial};
    /// let channel = Channel { name: "length_mm".into(), values: vec![180.0] };
    /// let trial = Trial { name: "a.csv".into(), time_s: vec![0.0], channels: vec![channel] };
    /// assert_eq!(trial.require("length_mm")?, [180.0]);
    /// assert_eq!(
    ///     trial.require("lenght_mm").unwrap_err().to_string(),
    ///     "a.csv: there is no column lenght_mm (did you mean length_mm?); \
    ///      the columns are time_s, length_mm"
    /// );
    /// # Ok::<(), stretch_data::DataError>(())
    /// ```
    pub fn require(&self, name: &str) -> Result<&[f64], DataError> {
        self.channel(self.full_name(name)).ok_or_else(|| self.missing(name))
    }

    /// Returns the error that there is no channel called `name`.
    pub(crate) fn missing(&self, name: &str) -> DataError {
        let names = self.channels.iter().map(|channel| channel.name.as_str());
        DataError::missing_column(&self.name, name, iter::once("time_s").chain(names))
    }

    /// Returns the CRC-32C of the values of some columns, row by row. It identifies a trial
    /// independently of its name, its start time and its file format. Returns `None` if the trial
    /// is empty or a column is missing.
    ///
    /// ```
    /// use stretch_data::{Channel, Trial};
    /// let channel = Channel { name: "length_mm".into(), values: vec![180.0, 179.5] };
    /// let trial = Trial { name: "a.csv".into(), time_s: vec![0.0, 0.01], channels: vec![channel] };
    /// let copy = Trial { name: "b.csv".into(), time_s: vec![7.0, 7.01], ..trial.clone() };
    /// assert!(trial.checksum(&["length_mm"]).is_some());
    /// assert_eq!(trial.checksum(&["length_mm"]), copy.checksum(&["length_mm"]));
    /// ```
    pub fn checksum(&self, columns: &[&str]) -> Option<u32> {
        let own: Vec<&[f64]> =
            columns.iter().map(|name| self.channel(name)).collect::<Option<_>>()?;
        let mut checksum = CRC.digest();
        for row in 0..self.len() {
            let values = own.iter().filter_map(|column| column.get(row));
            values.for_each(|value| checksum.update(&value.to_bits().to_le_bytes()));
        }
        (!self.is_empty()).then(|| checksum.finalize())
    }

    /// Whether the time is the number of the row (0, 1, 2, ...), as for a table without a time column. Such a trial has no
    /// rates and no lag.
    ///
    /// ```
    /// use stretch_data::Trial;
    /// let of = |time_s: &[f64]| Trial { time_s: time_s.to_vec(), ..Trial::default() };
    /// assert!(of(&[0.0, 1.0, 2.0]).counts_rows());
    /// assert!(!of(&[0.0, 0.01, 0.02]).counts_rows());
    /// ```
    pub fn counts_rows(&self) -> bool {
        are_row_numbers(&self.time_s)
    }

    /// Returns the time from the first sample to the last, s; 0 for fewer than two samples.
    pub fn duration_s(&self) -> f64 {
        match self.time_s[..] {
            [first, .., last] => last - first,
            _ => 0.0,
        }
    }

    /// Returns the sample rate, Hz, or `None` for fewer than two samples.
    ///
    /// It is the rate of the recorder, even if samples are missing or the time stamps are rounded.
    /// See `rate_of`.
    ///
    /// ```
    /// use stretch_data::Trial;
    /// let time_s = vec![0.0, 0.033, 0.067, 0.1, 0.133, 0.167, 0.2, 0.5, 0.533, 0.567, 0.6];
    /// let trial = Trial { time_s, ..Trial::default() };
    /// approx::assert_abs_diff_eq!(trial.rate_hz().expect("steps"), 30.0, epsilon = 1e-9);
    /// ```
    pub fn rate_hz(&self) -> Option<f64> {
        rate_of(&self.time_s)
    }

    /// Checks that every channel is as long as the time column. A trial that was built in memory
    /// may violate this.
    ///
    /// # Errors
    /// [`DataError::Lengths`] for the first channel that is not.
    ///
    /// ```
    /// use stretch_data::{Channel, Trial};
    /// let channels = vec![Channel { name: "length_mm".into(), values: Vec::new() }];
    /// let trial = Trial { name: "a.csv".into(), time_s: vec![0.0], channels };
    /// assert!(trial.check_lengths().is_err());
    /// ```
    pub fn check_lengths(&self) -> Result<(), DataError> {
        match self.channels.iter().find(|channel| channel.values.len() != self.len()) {
            None => Ok(()),
            Some(Channel { name, values }) => Err(DataError::Lengths {
                trial: self.name.clone(),
                column: name.clone(),
                found: values.len(),
                expected: self.len(),
            }),
        }
    }

    /// Refuses a trial that no file could hold: channels of other lengths, time that does not
    /// increase, numbers that are not finite.
    pub(crate) fn check_samples(&self) -> Result<(), DataError> {
        // The header is row 1.
        let place = |sample: usize, column: &str| Place {
            file: self.name.clone(),
            row: sample as u64 + 2,
            column: column.to_owned(),
        };
        let not_finite = |column: &str, values: &[f64]| {
            let sample = values.iter().position(|x| !x.is_finite())?;
            let value = values[sample].to_string();
            Some(DataError::NotFinite { at: place(sample, column), value })
        };
        if let Some(error) = not_finite("time_s", &self.time_s) {
            return Err(error);
        }
        if let Some(i) = self.time_s.windows(2).position(|t| t[1] <= t[0]) {
            let (previous_s, time_s) = (self.time_s[i], self.time_s[i + 1]);
            return Err(DataError::TimeNotRising {
                at: place(i + 1, "time_s"),
                time_s,
                previous_s,
            });
        }
        self.check_lengths()?;
        for Channel { name, values } in &self.channels {
            if let Some(error) = not_finite(name, values) {
                return Err(error);
            }
        }
        Ok(())
    }
}

/// Returns the smallest and the largest value, ignoring NaN. Without any number they are +infinity
/// and -infinity.
///
/// ```
/// assert_eq!(stretch_data::ends(&[3.0, f64::NAN, -1.0]), (-1.0, 3.0));
/// ```
pub fn ends<'a>(values: impl IntoIterator<Item = &'a f64>) -> (f64, f64) {
    values.into_iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)))
}

/// Number of steps over which the mean interval of time stamps with jitter is taken.
const JITTERED_OVER: usize = 50;
/// Standard deviation of the steps, relative to their median, above which single steps do not
/// determine the interval.
const JITTER: f64 = 0.1;

/// Returns the sample rate of increasing time stamps, Hz, or `None` for fewer than two.
///
/// The sample interval is the mean of the steps that are shorter than 1.5 times the median step and therefore skip no
/// sample. If the jitter of the time stamps exceeds a tenth of the median step, single steps do not show whether a
/// sample is missing. Then the interval is derived from the median length of stretches of 50 steps.
pub fn rate_of(time_s: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = steps.len() / 2;
    let median = match steps.len() {
        0 => return None,
        _ => *steps.select_nth_unstable_by(middle, f64::total_cmp).1,
    };
    let short = steps.iter().filter(|step| **step < 1.5 * median);
    let (count, sum) = short.clone().fold((0_u32, 0.0), |(n, sum), step| (n + 1, sum + step));
    let mean = sum / f64::from(count);
    let variance = short.map(|step| (step - mean).powi(2)).sum::<f64>() / f64::from(count);
    let over = JITTERED_OVER.min(time_s.len() / 2);
    let rate = if variance > (JITTER * median).powi(2) && over > 1 {
        let mut long: Vec<f64> = time_s.windows(over + 1).map(|w| w[over] - w[0]).collect();
        let middle = long.len() / 2;
        over as f64 / *long.select_nth_unstable_by(middle, f64::total_cmp).1
    } else {
        f64::from(count) / sum
    };
    Some(rate).filter(|rate| rate.is_finite())
}

/// Returns the indices of the fewest samples whose removal leaves the others in order.
///
/// ```
/// assert_eq!(stretch_data::out_of_order(&[9.0, 0.0, 0.1, 0.3, 0.2, 0.4]), [0, 3]);
/// assert!(stretch_data::out_of_order(&[0.0, 0.1, 0.1]).is_empty());
/// ```
pub fn out_of_order(times: &[f64]) -> Vec<usize> {
    // Finds the longest subsequence that does not decrease. `ends` holds the last sample of the
    // best run of each length, `before` the predecessor of each sample.
    let (mut ends, mut before): (Vec<usize>, Vec<usize>) = (Vec::new(), Vec::new());
    for (i, time) in times.iter().enumerate() {
        let length = ends.partition_point(|end| times[*end] <= *time);
        before.push(length.checked_sub(1).map_or(usize::MAX, |last| ends[last]));
        match ends.get_mut(length) {
            Some(end) => *end = i,
            None => ends.push(i),
        }
    }
    let mut kept = ends.last().copied().unwrap_or(usize::MAX);
    let mut left_out = Vec::new();
    for i in (0..times.len()).rev() {
        if i == kept {
            kept = before[i];
        } else {
            left_out.push(i);
        }
    }
    left_out.reverse();
    left_out
}

/// Rounds a time computed from other times of up to `largest_s` to the fewest decimals that are
/// within rounding error: two units in the last place of `largest_s`.
///
/// ```
/// use stretch_data::tidy_time;
/// assert_eq!(1.01_f64 - 1.0, 0.010000000000000009);
/// assert_eq!(tidy_time(1.01 - 1.0, 1.01), 0.01);
/// assert_eq!(tidy_time(1.0 / 3.0, 0.0), 1.0 / 3.0);
/// ```
pub fn tidy_time(time_s: f64, largest_s: f64) -> f64 {
    let noise_s = 2.0 * f64::EPSILON * largest_s.abs();
    let scales = std::iter::successors(Some(1.0), |scale| Some(10.0 * scale)).take(16);
    let mut decimals = scales.map(|scale: f64| (time_s * scale).round() / scale);
    decimals.find(|near| (near - time_s).abs() <= noise_s).unwrap_or(time_s)
}

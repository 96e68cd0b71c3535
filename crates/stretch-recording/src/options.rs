//! Options for reading a recording.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, de::value::StrDeserializer};
use stretch_data::column_meant;

use crate::names::{unit, words};

/// Unit of the numbers in a time column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum TimeUnit {
    /// Seconds.
    #[serde(rename = "s")]
    Seconds,
    /// Thousandths of a second.
    #[serde(rename = "ms")]
    Milliseconds,
    /// Millionths of a second.
    #[serde(rename = "us")]
    Microseconds,
    /// Billionths of a second.
    #[serde(rename = "ns")]
    Nanoseconds,
    /// Minutes.
    #[serde(rename = "min")]
    Minutes,
    /// Hours.
    #[serde(rename = "h")]
    Hours,
    /// Days, as spreadsheets and MATLAB count them.
    #[serde(rename = "d")]
    Days,
}

impl TimeUnit {
    /// Returns the counts per second, such as 1000 for milliseconds.
    pub fn per_second(self) -> f64 {
        match self {
            Self::Seconds => 1.0,
            Self::Milliseconds => 1e3,
            Self::Microseconds => 1e6,
            Self::Nanoseconds => 1e9,
            Self::Minutes => 1.0 / 60.0,
            Self::Hours => 1.0 / 3600.0,
            Self::Days => 1.0 / 86_400.0,
        }
    }

    /// Returns the name of the unit in the plural, for a message.
    pub(crate) fn plural(self) -> &'static str {
        match self {
            Self::Seconds => "seconds",
            Self::Milliseconds => "milliseconds",
            Self::Microseconds => "microseconds",
            Self::Nanoseconds => "nanoseconds",
            Self::Minutes => "minutes",
            Self::Hours => "hours",
            Self::Days => "days",
        }
    }

    /// The unit of this abbreviation: s, ms, us, ns, min, h or d.
    ///
    /// ```
    /// use stretch_recording::TimeUnit;
    /// assert_eq!(TimeUnit::abbreviated("us"), Some(TimeUnit::Microseconds));
    /// assert_eq!(TimeUnit::abbreviated("mm"), None);
    /// ```
    pub fn abbreviated(text: &str) -> Option<Self> {
        Self::deserialize(StrDeserializer::<serde::de::value::Error>::new(text)).ok()
    }

    /// Returns the unit that is the last word of a column's name, in upper or lower case.
    ///
    /// ```
    /// use stretch_recording::TimeUnit;
    /// assert_eq!(TimeUnit::of("t_ms"), Some(TimeUnit::Milliseconds));
    /// assert_eq!(TimeUnit::of("TimeUS"), Some(TimeUnit::Microseconds));
    /// assert_eq!(TimeUnit::of("Time (Seconds)"), Some(TimeUnit::Seconds));
    /// assert_eq!(TimeUnit::of("clock"), None);
    /// ```
    pub fn of(column: &str) -> Option<Self> {
        let words = words(column);
        let last = words.rsplit('_').next()?;
        Self::abbreviated(last).or_else(|| Self::abbreviated(&unit(last)?))
    }
}

/// Which number of a date such as 05/01/2024 is the day.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DateOrder {
    /// 5 January.
    DayFirst,
    /// May 1.
    MonthFirst,
}

/// Options for reading a file or stream.
///
/// ```
/// use stretch_recording::{ReadOptions, Recording};
/// let text = "time_ms;angle_deg;note\n0;1.5;start\n10;1.75;\n";
/// let options = ReadOptions::new().time("time_ms").require("angle_deg");
/// let trial = Recording::from_reader(text.as_bytes(), "knee.csv", &options)?.trial;
/// assert_eq!(trial.time_s, [0.0, 0.01]);
/// assert_eq!(trial.channel("angle_deg"), Some(&[1.5, 1.75][..]));
/// assert_eq!(trial.channel("note"), None, "text is kept out of the way");
/// # Ok::<(), stretch_recording::RecordingError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ReadOptions {
    pub(crate) time: String,
    pub(crate) time_unit: Option<TimeUnit>,
    /// Whether a column with a usual name is the time if the column `time` is missing.
    pub(crate) may_lack_time: bool,
    required: Vec<String>,
    gappy: Vec<String>,
    pub(crate) all_columns: bool,
    pub(crate) columns: Option<Vec<String>>,
    pub(crate) sample_rate_hz: Option<f64>,
    pub(crate) untimed_hz: Option<f64>,
    pub(crate) grid_hz: Option<f64>,
    pub(crate) episode: Option<u32>,
    pub(crate) max_line_bytes: usize,
    pub(crate) strict: bool,
    pub(crate) date_order: Option<DateOrder>,
}

/// Default name of the time column.
pub(crate) const TIME: &str = "time_s";

impl Default for ReadOptions {
    fn default() -> Self {
        Self {
            time: TIME.to_owned(),
            time_unit: None,
            may_lack_time: false,
            required: Vec::new(),
            gappy: Vec::new(),
            all_columns: false,
            columns: None,
            sample_rate_hz: None,
            untimed_hz: None,
            grid_hz: None,
            episode: None,
            max_line_bytes: 64 * 1024,
            strict: false,
            date_order: None,
        }
    }
}

impl ReadOptions {
    /// Returns the same options with the number of the episode that is read from a file with several.
    pub(crate) fn of_episode(&self, episode: u32) -> Self {
        Self { episode: Some(episode), ..self.clone() }
    }

    /// Returns the default options: the time is `time_s` or a column with a usual name for it, no other column is
    /// required, and lines have at most 64 KiB.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes the time from another column. Its unit is the last word of its name or follows from its values. Otherwise
    /// the unit is seconds.
    pub fn time(mut self, column: impl Into<String>) -> Self {
        self.time = column.into();
        self
    }

    /// Sets the unit of the time column, whatever its name is.
    pub fn time_unit(mut self, unit: TimeUnit) -> Self {
        self.time_unit = Some(unit);
        self
    }

    /// If a recording lacks the column of [`time`](Self::time), takes the time from a column with a usual name. The
    /// unit of [`time_unit`](Self::time_unit) does not apply to that column.
    ///
    /// ```
    /// use stretch_recording::{ReadOptions, Recording, TimeUnit};
    /// let options = ReadOptions::new().time("tick").time_unit(TimeUnit::Milliseconds).or_usual_time();
    /// for text in ["tick,s1\n0,1\n10,2\n", "time_s,s1\n0,1\n0.01,2\n"] {
    ///     let trial = Recording::from_reader(text.as_bytes(), "a.csv", &options)?.trial;
    ///     assert_eq!(trial.time_s, [0.0, 0.01]);
    /// }
    /// # Ok::<(), stretch_recording::RecordingError>(())
    /// ```
    pub fn or_usual_time(mut self) -> Self {
        self.may_lack_time = true;
        self
    }

    /// Returns the unit that the options give for a time column.
    pub(crate) fn unit_of(&self, column: Option<&str>) -> Option<TimeUnit> {
        self.time_unit.filter(|_| !self.may_lack_time || column == Some(&self.time))
    }

    /// Requires a column. It must be present, and a row in which it is not a finite number cannot be read.
    pub fn require(mut self, column: impl Into<String>) -> Self {
        self.required.push(column.into());
        self
    }

    /// Requires a column in which samples may be missing, such as one of several sensors. Rows without a number in it are
    /// kept, and the sample is NaN.
    ///
    /// ```
    /// use stretch_recording::{ReadOptions, Recording};
    /// let text = "time_s,front_v,back_v\n0,1.1,2.1\n0.01,1.2,2.2\n0.02,,2.3\n0.03,1.4,2.4\n0.04,1.5,2.5\n0.05,1.6,2.6\n";
    /// let options = ReadOptions::new().require_with_gaps("front_v").require_with_gaps("back_v");
    /// let trial = Recording::from_reader(text.as_bytes(), "knee.csv", &options)?.trial;
    /// assert_eq!(trial.channel("back_v"), Some(&[2.1, 2.2, 2.3, 2.4, 2.5, 2.6][..]));
    /// assert!(trial.channel("front_v").is_some_and(|front_v| front_v[2].is_nan()));
    /// # Ok::<(), stretch_recording::RecordingError>(())
    /// ```
    pub fn require_with_gaps(mut self, column: impl Into<String>) -> Self {
        let column = column.into();
        self.gappy.push(column.clone());
        self.require(column)
    }

    /// Returns whether samples of a column may be missing without the loss of their rows.
    pub(crate) fn may_have_gaps(&self, column: &str) -> bool {
        self.gappy.iter().any(|name| name == column)
    }

    /// Also keeps the columns that are not required, if nearly all of their values are numbers. A row in which one of
    /// them has no number is then left out, as for a required column.
    pub fn all_columns(mut self) -> Self {
        self.all_columns = true;
        self
    }

    /// Names the columns of a file that has no header line, or of an array without names.
    pub fn columns<T: Into<String>>(mut self, names: impl IntoIterator<Item = T>) -> Self {
        self.columns = Some(names.into_iter().map(Into::into).collect());
        self
    }

    /// Sets the sample rate of a recording. A time column is then ignored, and the time counts from 0.
    pub fn sample_rate_hz(mut self, rate_hz: f64) -> Self {
        self.sample_rate_hz = Some(rate_hz);
        self
    }

    /// Sets the sample rate of a recording that has no time and does not state a rate. With a rate of 1, the time is
    /// the sample number. The rate also places the samples of a live stream before its clock first advances.
    pub fn untimed_hz(mut self, rate_hz: f64) -> Self {
        self.untimed_hz = Some(rate_hz);
        self
    }

    /// Returns the sample rate if time is counted in samples, and words for a note that say where the rate comes from.
    /// The option `sample_rate_hz` replaces a time column. Without a time, the rate `stated` above the table applies,
    /// then `untimed_hz`.
    pub(crate) fn counted(
        &self,
        has_time: bool,
        stated: Option<(f64, String)>,
    ) -> Option<(f64, String)> {
        let given =
            self.sample_rate_hz.map(|rate_hz| (rate_hz, "as given by the option".to_owned()));
        let stated =
            || stated.map(|(rate_hz, by)| (rate_hz, format!("as given by {by} above the table")));
        let usual = || {
            Some((
                self.untimed_hz?,
                "because no rate is given; set one with --time RATEhz".to_owned(),
            ))
        };
        given.or_else(|| stated().or_else(usual).filter(|_| !has_time))
    }

    /// Resamples a [`Recording`](crate::Recording) to an even grid of this rate.
    pub fn grid_hz(mut self, rate_hz: f64) -> Self {
        self.grid_hz = Some(rate_hz);
        self
    }

    /// Refuses lines longer than this many bytes; the memory for a line is bounded by it.
    pub fn max_line_bytes(mut self, bytes: usize) -> Self {
        self.max_line_bytes = bytes.clamp(1, 1 << 30);
        self
    }

    /// Refuses a recording if a row cannot be read. Otherwise such a row is left out with a note.
    pub fn strict(mut self, is_strict: bool) -> Self {
        self.strict = is_strict;
        self
    }

    /// Sets which number of a date is the day, in case no date of the first rows shows it.
    pub fn date_order(mut self, order: DateOrder) -> Self {
        self.date_order = Some(order);
        self
    }

    /// Returns the names of the required columns and of the time.
    pub(crate) fn asked(&self) -> Vec<&String> {
        self.required.iter().chain([&self.time]).collect()
    }

    /// Returns the columns that were requested with [`require`](Self::require), in this order.
    pub fn required(&self) -> &[String] {
        &self.required
    }

    /// Returns the options with the required columns under their full names in a recording.
    pub(crate) fn named_as<'a>(&self, names: impl IntoIterator<Item = &'a str> + Clone) -> Self {
        let full = |name: &String| column_meant(name, names.clone()).unwrap_or(name).to_owned();
        let of = |columns: &[String]| columns.iter().map(full).collect();
        Self { required: of(&self.required), gappy: of(&self.gappy), ..self.clone() }
    }

    /// Returns the counts per second of a time column with this name.
    pub(crate) fn divisor(&self, column: &str) -> f64 {
        let unit = self.unit_of(Some(column)).or_else(|| TimeUnit::of(column));
        unit.unwrap_or(TimeUnit::Seconds).per_second()
    }
}

//! What a reader asks of a recording.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, de::value::StrDeserializer};

use crate::names::{unit, words};

/// What the numbers of a time column count.
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
    /// Counts in a second.
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

    /// What is counted, in a sentence.
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

    /// The unit that the last word of a column's name says, in whatever case.
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

/// What a reader asks of a file.
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
    required: Vec<String>,
    pub(crate) columns: Option<Vec<String>>,
    pub(crate) sample_rate_hz: Option<f64>,
    pub(crate) untimed_hz: Option<f64>,
    pub(crate) grid_hz: Option<f64>,
    pub(crate) episode: Option<u32>,
    pub(crate) max_line_bytes: usize,
    pub(crate) strict: bool,
    pub(crate) date_order: Option<DateOrder>,
}

/// What the time is called unless an option says otherwise.
pub(crate) const TIME: &str = "time_s";

impl Default for ReadOptions {
    fn default() -> Self {
        Self {
            time: TIME.to_owned(),
            time_unit: None,
            required: Vec::new(),
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
    /// The same, of one episode of a file that holds several.
    pub(crate) fn of_episode(&self, episode: u32) -> Self {
        Self { episode: Some(episode), ..self.clone() }
    }

    /// Asks for `time_s` only, and for lines of at most 64 KiB.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes the time from another column. Its unit is the last word of its name, or what its numbers show; otherwise it is seconds.
    pub fn time(mut self, column: impl Into<String>) -> Self {
        self.time = column.into();
        self
    }

    /// Says what the time column counts, whatever its name says.
    pub fn time_unit(mut self, unit: TimeUnit) -> Self {
        self.time_unit = Some(unit);
        self
    }

    /// Asks for a column: it must be there, and each of its fields a finite number.
    pub fn require(mut self, column: impl Into<String>) -> Self {
        self.required.push(column.into());
        self
    }

    /// Names the columns of a file that has no header line, or of an array without names.
    pub fn columns<T: Into<String>>(mut self, names: impl IntoIterator<Item = T>) -> Self {
        self.columns = Some(names.into_iter().map(Into::into).collect());
        self
    }

    /// Says how many samples a second a recording has, whatever a column of time says; the time then counts from 0.
    pub fn sample_rate_hz(mut self, rate_hz: f64) -> Self {
        self.sample_rate_hz = Some(rate_hz);
        self
    }

    /// Samples a second of a recording without any time where nothing else states them; 1 makes the time the number of the row.
    /// They also place the samples of a stream whose clock has not ticked yet.
    pub fn untimed_hz(mut self, rate_hz: f64) -> Self {
        self.untimed_hz = Some(rate_hz);
        self
    }

    /// Samples a second where they are counted, and who says so: by the options whether there is a time or not, else by what is
    /// stated above a table without one.
    pub(crate) fn counted(
        &self,
        has_time: bool,
        stated: Option<(f64, String)>,
    ) -> Option<(f64, String)> {
        let given = self.sample_rate_hz.map(|rate_hz| (rate_hz, "as the option says".to_owned()));
        let stated = || stated.map(|(rate_hz, by)| (rate_hz, format!("as {by} above it says")));
        let usual = || {
            Some((self.untimed_hz?, "because it states no rate; --time RATEhz sets one".to_owned()))
        };
        given.or_else(|| stated().or_else(usual).filter(|_| !has_time))
    }

    /// Brings a [`Recording`](crate::Recording) onto an even grid of so many samples a second.
    pub fn grid_hz(mut self, rate_hz: f64) -> Self {
        self.grid_hz = Some(rate_hz);
        self
    }

    /// Refuses lines longer than this many bytes; the memory for a line is bounded by it.
    pub fn max_line_bytes(mut self, bytes: usize) -> Self {
        self.max_line_bytes = bytes.clamp(1, 1 << 30);
        self
    }

    /// Refuses a recording with a row that cannot be read, which is otherwise left out with a note.
    pub fn strict(mut self, is_strict: bool) -> Self {
        self.strict = is_strict;
        self
    }

    /// Says which number of a date is the day, where no date of the first rows shows it.
    pub fn date_order(mut self, order: DateOrder) -> Self {
        self.date_order = Some(order);
        self
    }

    /// The names that are asked for: of the time and of the columns.
    pub(crate) fn asked(&self) -> Vec<&String> {
        self.required.iter().chain([&self.time]).collect()
    }

    /// The columns asked for by [`require`](Self::require), in order.
    pub fn required(&self) -> &[String] {
        &self.required
    }

    /// Counts in a second of a time column of this name.
    pub(crate) fn divisor(&self, column: &str) -> f64 {
        let unit = self.time_unit.or_else(|| TimeUnit::of(column));
        unit.unwrap_or(TimeUnit::Seconds).per_second()
    }
}

//! What a reader asks of a recording.

/// What the numbers of a time column count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeUnit {
    /// Seconds.
    Seconds,
    /// Thousandths of a second.
    Milliseconds,
    /// Millionths of a second.
    Microseconds,
    /// Billionths of a second.
    Nanoseconds,
}

impl TimeUnit {
    /// Counts in a second.
    pub fn per_second(self) -> f64 {
        match self {
            Self::Seconds => 1.0,
            Self::Milliseconds => 1e3,
            Self::Microseconds => 1e6,
            Self::Nanoseconds => 1e9,
        }
    }

    /// The unit that the last part of a column's name says; seconds where it says none.
    ///
    /// ```
    /// use stretch_recording::TimeUnit;
    /// assert_eq!(TimeUnit::of("t_ms"), TimeUnit::Milliseconds);
    /// assert_eq!(TimeUnit::of("clock"), TimeUnit::Seconds);
    /// ```
    pub fn of(column: &str) -> Self {
        match column.rsplit(['_', '.', '/']).next() {
            Some("ms" | "millis") => Self::Milliseconds,
            Some("us" | "micros") => Self::Microseconds,
            Some("ns" | "nanos") => Self::Nanoseconds,
            _ => Self::Seconds,
        }
    }
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
    pub(crate) grid_hz: Option<f64>,
    pub(crate) episode: Option<u32>,
    pub(crate) max_line_bytes: usize,
}

/// What the time is called unless somebody says otherwise.
pub(crate) const TIME: &str = "time_s";

impl Default for ReadOptions {
    fn default() -> Self {
        Self {
            time: TIME.to_owned(),
            time_unit: None,
            required: Vec::new(),
            columns: None,
            sample_rate_hz: None,
            grid_hz: None,
            episode: None,
            max_line_bytes: 64 * 1024,
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

    /// Takes the time from another column. Its name's last part is the unit: `_ms`, `_us`,
    /// and `_ns` are divided down to seconds, anything else is seconds.
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

    /// Says how many samples a second a recording without any time has; the time then counts from 0.
    pub fn sample_rate_hz(mut self, rate_hz: f64) -> Self {
        self.sample_rate_hz = Some(rate_hz);
        self
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

    /// The columns asked for by [`require`](Self::require), in order.
    pub fn required(&self) -> &[String] {
        &self.required
    }

    /// What the numbers of a time column of this name are divided by.
    pub(crate) fn divisor(&self, column: &str) -> f64 {
        self.time_unit.unwrap_or_else(|| TimeUnit::of(column)).per_second()
    }

    /// What the time column's numbers are divided by.
    pub(crate) fn time_divisor(&self) -> f64 {
        self.divisor(&self.time)
    }
}

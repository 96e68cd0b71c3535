//! The result of reading a recording: a trial and notes.

use stretch_data::{SessionTrial, Trial};

/// A trial, and notes on how it was read.
///
/// ```
/// use stretch_recording::{ReadOptions, Recording};
/// let text = "# rig 2, Monday\nTime (ms);Pos (mm);bridge\nms;mm;V\n0;180,5;1,24\n10;180,25;1,25\n";
/// let options = ReadOptions::new().require("bridge_v");
/// let recording = Recording::from_reader(text.as_bytes(), "log.csv", &options)?;
/// assert_eq!(recording.trial.time_s, [0.0, 0.01]);
/// assert_eq!(recording.trial.require("pos_mm")?, [180.5, 180.25]);
/// assert_eq!(
///     recording.notes,
///     [
///         "columns named with their units: Time (ms) -> time_ms, Pos (mm) -> pos_mm, bridge -> bridge_v",
///         "the time is column time_ms",
///         "numbers have decimal commas",
///     ]
/// );
/// # Ok::<(), stretch_recording::RecordingError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recording {
    /// The recorded channels, on one clock.
    pub trial: Trial,
    /// Sentences on what was guessed, renamed, resampled or left out. There are none for a file in the project's own
    /// format.
    pub notes: Vec<String>,
}

/// Beginnings of the notes that report a fact about the format. All other notes report a guess or a change.
const CERTAIN: [&str; 5] = [
    "columns named with their units: ",
    "the time is column ",
    "numbers have decimal commas",
    "columns are separated by blanks",
    "the names of the columns are in a comment",
];

/// Returns whether a note only describes the format of a recording, and nothing was left out, resampled or changed.
///
/// ```
/// use stretch_recording::is_format_note;
/// assert!(is_format_note("numbers have decimal commas"));
/// assert!(!is_format_note("3 rows are left out because a clock has a gap there"));
/// ```
pub fn is_format_note(note: &str) -> bool {
    CERTAIN.iter().any(|begin| note.starts_with(begin))
}

impl From<Recording> for SessionTrial {
    fn from(Recording { trial, notes }: Recording) -> Self {
        Self { notes, ..Self::new(trial) }
    }
}

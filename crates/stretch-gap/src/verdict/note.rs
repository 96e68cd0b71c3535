//! A note about a diagnosis: a code, and a text in which effects can be renamed.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::verdict::{answer::Answer, phrases::two_digits};

/// What a [note](Note) is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum NoteCode {
    /// Something may be wrong with the recordings.
    Doubt,
    /// What was done to the recordings, and which effects are not looked for.
    Recording,
    /// Messages and answers of the simulator.
    Simulator,
    /// There is no test trial, so the end of every trial is used for testing.
    NoTestTrial,
    /// Most of a channel is not simulated.
    NotSimulated,
    /// The answer before a check overrode it.
    Overridden,
    /// Samples that are gross errors and do not count.
    GrossErrors,
    /// Models that could not be simulated.
    FailedRuns,
    /// The stated noise is so large that it hides gaps.
    ImplausibleNoise,
    /// Re-tuned parameters could not be simulated, so that earlier ones are kept.
    KeptParameters,
    /// Effects that were not examined because their runs failed.
    NotExamined,
    /// Re-tuning from several starts ended at different values.
    StartsDisagree,
    /// The recorder seems to add slow noise.
    SlowNoise,
    /// A channel jumps at random between levels while the rig is at rest.
    Jumps,
    /// The simulator may start from another state than the rig.
    InitialState,
    /// Re-tuned parameters predict test trials worse than those as shipped.
    RetuningHarms,
    /// A drift was extrapolated from the fitted trials to the test trials.
    ExtrapolatedDrift,
    /// Effects that a first test left out.
    NotFitted,
    /// A named effect may be dry friction inside the machine.
    LooksLikeFriction,
    /// Parameters that change no simulated output.
    UnusedParameters,
    /// The budget of runs was spent.
    BudgetSpent,
    /// Smallest strengths at which effects would be named.
    DetectionLimits,
}

impl NoteCode {
    /// Whether the note gives a reason why a gap may exist although none was found.
    ///
    /// ```
    /// use stretch_gap::NoteCode;
    /// assert!(NoteCode::ImplausibleNoise.is_reservation());
    /// assert!(!NoteCode::NoTestTrial.is_reservation());
    /// ```
    pub fn is_reservation(self) -> bool {
        matches!(
            self,
            Self::Doubt | Self::ImplausibleNoise | Self::KeptParameters | Self::NotExamined
        )
    }
}

/// A note about a diagnosis: its code and its text. The names of effects are stored separately from
/// the text, so that a report can rename them.
///
/// ```
/// use stretch_gap::{Note, NoteCode};
/// let mut note = Note::new(NoteCode::NotExamined, "not looked for: ").effect("input.lag");
/// note.rename(&|_| "a lag at the input".to_owned());
/// assert_eq!(note.to_string(), "not looked for: a lag at the input");
/// let json = serde_json::to_value(&note).expect("written");
/// assert_eq!(json["code"], "not_examined");
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(into = "Written", from = "Written")]
pub struct Note {
    /// What the note is about.
    pub code: NoteCode,
    pieces: Vec<Piece>,
}

/// A note as it is written.
#[derive(Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "Note")]
struct Written {
    /// What the note is about.
    code: NoteCode,
    /// The note in words.
    text: String,
}

#[derive(Debug, Clone, PartialEq)]
enum Piece {
    Text(String),
    Effect(String),
    Answer(Answer, [&'static str; 2]),
}

impl Note {
    /// Returns a note with this code that begins with a text.
    pub fn new(code: NoteCode, text: impl Into<String>) -> Self {
        Self { code, pieces: Vec::new() }.text(text)
    }

    /// Appends text.
    #[must_use]
    pub fn text(self, text: impl Into<String>) -> Self {
        self.and(Piece::Text(text.into()))
    }

    /// Appends the name of an effect.
    #[must_use]
    pub fn effect(self, name: impl Into<String>) -> Self {
        self.and(Piece::Effect(name.into()))
    }

    /// Appends the names of effects.
    #[must_use]
    pub fn effects<'a>(self, names: impl IntoIterator<Item = &'a String>, separator: &str) -> Self {
        names.into_iter().enumerate().fold(self, |note, (i, name)| match i {
            0 => note.effect(name),
            _ => note.text(separator).effect(name),
        })
    }

    /// Appends an answer. `nouns` are the words for the simulator and the machine in its sentences.
    pub(crate) fn answer(self, answer: Answer, nouns: [&'static str; 2]) -> Self {
        self.and(Piece::Answer(answer, nouns))
    }

    fn and(mut self, piece: Piece) -> Self {
        self.pieces.push(piece);
        self
    }

    /// Renames every effect.
    pub fn rename(&mut self, rename: &dyn Fn(&str) -> String) {
        for piece in &mut self.pieces {
            match piece {
                Piece::Text(_) => {}
                Piece::Effect(name) => *name = rename(name),
                Piece::Answer(answer, _) => answer.rename(rename),
            }
        }
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.pieces.iter().try_for_each(|piece| match piece {
            Piece::Text(text) | Piece::Effect(text) => f.write_str(text),
            Piece::Answer(answer, nouns) => f.write_str(&answer.in_sentences(*nouns, &two_digits)),
        })
    }
}

impl From<Written> for Note {
    fn from(Written { code, text }: Written) -> Self {
        Self::new(code, text)
    }
}

impl From<Note> for Written {
    fn from(note: Note) -> Self {
        Self { code: note.code, text: note.to_string() }
    }
}

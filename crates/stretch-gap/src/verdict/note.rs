//! A note about a diagnosis in which effects can be renamed.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::verdict::{answer::Answer, sentence::two_digits};

/// A note about a diagnosis. The names of effects are stored separately from the text, so that a
/// report can rename them. Its serialised form is the text.
///
/// ```
/// use stretch_gap::Note;
/// let mut note = Note::from("not looked for: ".to_owned()).effect("input.lag");
/// note.rename(&|_| "a lag at the input".to_owned());
/// assert_eq!(note.to_string(), "not looked for: a lag at the input");
/// ```
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(into = "String", from = "String")]
pub struct Note(Vec<Piece>);

#[derive(Debug, Clone, PartialEq)]
enum Piece {
    Text(String),
    Effect(String),
    Answer(Answer, [&'static str; 2]),
}

impl Note {
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

    /// Appends an answer in which simulator and machine have these nouns.
    pub(crate) fn answer(self, answer: Answer, nouns: [&'static str; 2]) -> Self {
        self.and(Piece::Answer(answer, nouns))
    }

    fn and(mut self, piece: Piece) -> Self {
        self.0.push(piece);
        self
    }

    /// Renames every effect.
    pub fn rename(&mut self, rename: &dyn Fn(&str) -> String) {
        for piece in &mut self.0 {
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
        self.0.iter().try_for_each(|piece| match piece {
            Piece::Text(text) | Piece::Effect(text) => f.write_str(text),
            Piece::Answer(answer, nouns) => f.write_str(&answer.in_sentences(*nouns, &two_digits)),
        })
    }
}

impl From<String> for Note {
    fn from(text: String) -> Self {
        Self::default().text(text)
    }
}

impl From<Note> for String {
    fn from(note: Note) -> Self {
        note.to_string()
    }
}

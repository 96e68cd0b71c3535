//! Short names stored inline, without an allocator, and a check for invisible characters in names.

use core::fmt;

use crate::DesignError;

/// A short text of at most [`Label::CAPACITY`] bytes, such as the name of a column or trial, or a
/// date.
///
/// ```
/// use stretch_core::Label;
/// let label = Label::new("length_mm")?;
/// assert_eq!(label.as_str(), "length_mm");
/// assert_eq!(label.unit(), "mm");
/// assert_eq!(Label::truncated("a very long name that goes on and on and on").as_str().len(), 40);
/// # Ok::<(), stretch_core::DesignError>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(transparent))]
pub struct Label(heapless::String<{ Label::CAPACITY }>);

impl Label {
    /// The longest label, in bytes of UTF-8.
    pub const CAPACITY: usize = 40;

    /// Creates a label with the whole name.
    ///
    /// # Errors
    /// [`DesignError::TooLarge`] if the name is longer than [`Label::CAPACITY`].
    pub fn new(name: &str) -> Result<Self, DesignError> {
        let too_large =
            DesignError::TooLarge { field: "label", asked: name.len(), most: Self::CAPACITY };
        heapless::String::try_from(name).map(Self).map_err(|_| too_large)
    }

    /// Creates a label with as much of the name as fits, cut between characters.
    pub fn truncated(name: &str) -> Self {
        let mut text = heapless::String::new();
        for c in name.chars() {
            if text.push(c).is_err() {
                break;
            }
        }
        Self(text)
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Returns the unit at the end of a column name, such as `mm` in `length_mm`. Empty if the name has no `_`.
    pub fn unit(&self) -> &str {
        self.0.rsplit_once('_').map_or("", |(_, unit)| unit)
    }
}

impl fmt::Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.0)
    }
}

/// Returns whether a character is not shown as itself: it controls the terminal, ends a line, changes the text
/// direction, or is invisible.
///
/// Names of columns and units come from files of unknown origin. Code that writes them into a program, a page or a
/// terminal omits or escapes such characters, so that readers see the real contents.
///
/// ```
/// use stretch_core::label::is_hidden;
/// assert!(['\n', '\u{7f}', '\u{202e}', '\u{200b}', '\u{2028}', '\u{feff}'].map(is_hidden).iter().all(|hidden| *hidden));
/// assert!(!['a', ' ', '\u{b5}', '\u{3a9}'].map(is_hidden).iter().any(|hidden| *hidden));
/// ```
pub fn is_hidden(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{61c}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}')
}

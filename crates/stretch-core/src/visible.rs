//! Detection of invisible characters.

/// Returns whether a character is not shown as itself: it controls the terminal, ends a line, changes the text
/// direction, or is invisible.
///
/// Names of columns and units come from files of unknown origin. Code that writes them into a program, a page or a
/// terminal omits or escapes such characters, so that readers see the real contents.
///
/// ```
/// use stretch_core::is_hidden;
/// assert!(['\n', '\u{7f}', '\u{202e}', '\u{200b}', '\u{2028}', '\u{feff}'].map(is_hidden).iter().all(|hidden| *hidden));
/// assert!(!['a', ' ', '\u{b5}', '\u{3a9}'].map(is_hidden).iter().any(|hidden| *hidden));
/// ```
pub fn is_hidden(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{61c}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}')
}

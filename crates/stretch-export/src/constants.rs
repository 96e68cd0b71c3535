//! Numbers as C constants, each with a comment.

use std::fmt::{Display, Write};

use stretch_core::label::is_hidden;

/// A number that can be written as a literal in C99 and in C++11.
pub(crate) trait Literal {
    /// Returns the literal.
    fn c(&self) -> String;
}

impl Literal for i32 {
    fn c(&self) -> String {
        // C reads -2147483648 as minus a literal that is too large
        if *self == Self::MIN { "(-2147483647 - 1)".into() } else { self.to_string() }
    }
}

impl Literal for u8 {
    fn c(&self) -> String {
        self.to_string()
    }
}

impl Literal for u32 {
    fn c(&self) -> String {
        format!("{self}u")
    }
}

impl Literal for i64 {
    fn c(&self) -> String {
        format!("INT64_C({self})")
    }
}

/// The literal has as few digits as possible; a compiler reads the same bits from it.
impl Literal for f32 {
    fn c(&self) -> String {
        format!("{self:?}f")
    }
}

/// The constants of a header, in order.
#[derive(Debug, Default)]
pub(crate) struct Constants(String);

impl Constants {
    /// Returns the text of the constants.
    pub(crate) fn into_text(self) -> String {
        self.0
    }

    /// Writes `#define NAME value` with a comment.
    pub(crate) fn define(&mut self, name: &str, value: impl Literal, what: &str) -> &mut Self {
        // without parentheses, a minus sign could join an operator before it
        let value = match value.c() {
            negative if negative.starts_with('-') => format!("({negative})"),
            value => value,
        };
        self.word(name, value, what)
    }

    /// Writes `#define NAME word`, with a comment unless `what` is empty.
    pub(crate) fn word(&mut self, name: &str, word: impl Display, what: &str) -> &mut Self {
        let comment = if what.is_empty() { String::new() } else { format!(" /* {what} */") };
        self.line(&format!("#define STRETCH_{name} {word}{comment}"))
    }

    /// Writes `static const type stretch_name[n] STRETCH_FLASH = {..}`.
    pub(crate) fn array<L: Literal>(&mut self, kind: &str, name: &str, values: &[L]) -> &mut Self {
        let count = values.len();
        self.line(&format!(
            "static const {kind} stretch_{name}[{count}] STRETCH_FLASH = {};",
            braced(values)
        ))
    }

    /// Writes a two-dimensional array whose rows have equal lengths.
    pub(crate) fn rows<L: Literal>(
        &mut self,
        kind: &str,
        name: &str,
        rows: &[impl AsRef<[L]>],
    ) -> &mut Self {
        let count = rows.len();
        let length = rows.first().map_or(0, |row| row.as_ref().len());
        let inner: Vec<String> =
            rows.iter().map(|row| format!("    {}", braced(row.as_ref()))).collect();
        self.line(&format!(
            "static const {kind} stretch_{name}[{count}][{length}] STRETCH_FLASH = {{\n{}\n}};",
            inner.join(",\n")
        ))
    }

    /// Writes the surfaces with their ranges as a macro: one surface for a line, otherwise one for each branch
    /// (direction of motion). A macro is needed because the type of a surface is declared later in the header.
    pub(crate) fn surfaces(&mut self, surfaces: &[String]) -> &mut Self {
        let rows = surfaces.join(", \\\n        ");
        self.line(&format!("#define STRETCH_SURFACES \\\n    {{ \\\n        {rows} \\\n    }}"))
    }

    /// Appends a line unchanged.
    fn line(&mut self, line: &str) -> &mut Self {
        self.0.push_str(line);
        self.0.push('\n');
        self
    }
}

/// Returns `{1, 2, 3}`, with six values per line.
fn braced<L: Literal>(values: &[L]) -> String {
    let mut out = String::from("{");
    for (k, value) in values.iter().enumerate() {
        let before = match k {
            0 => "",
            k if k % 6 == 0 => ",\n        ",
            _ => ", ",
        };
        // writing to memory cannot fail
        let _ = write!(out, "{before}{}", value.c());
    }
    out.push('}');
    out
}

/// Removes the characters of a label that could end a comment, a string or a line.
pub(crate) fn comment_safe(text: &str) -> String {
    text.chars().filter(|c| !is_hidden(*c) && !"*\\?\"".contains(*c)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_float_comes_back_with_its_bits() {
        for x in [0.1f32, -0.0, 1e-40, f32::MAX, f32::MIN_POSITIVE, 1.0, 16_777_217.0] {
            let c = x.c();
            let back: f32 = c.trim_end_matches('f').parse().unwrap();
            assert_eq!(back.to_bits(), x.to_bits(), "{c}");
            assert!(c.contains(['.', 'e']), "{c} would be an integer with a wrong ending");
        }
    }

    #[test]
    fn no_label_ends_a_comment_a_text_or_a_line() {
        for (label, safe) in [
            ("deg*/ int y; /*", "deg/ int y; /"),
            ("mm\nint y;", "mmint y;"),
            ("mm\\", "mm"),
            ("\"; int y; \"", "; int y; "),
            ("?\u{3f}/", "/"),
            ("\u{202e}mm\u{2028}", "mm"),
            ("\u{b5}m", "\u{b5}m"),
        ] {
            assert_eq!(comment_safe(label), safe, "{label:?}");
        }
    }

    #[test]
    fn the_least_integer_is_no_minus_of_a_larger_one() {
        assert_eq!(i32::MIN.c(), "(-2147483647 - 1)");
        assert_eq!((-5i32).c(), "-5");
    }
}

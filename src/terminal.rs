//! How wide a line is, and whether it has colours.

use std::env;

use anstream::{AutoStream, ColorChoice, stream::RawStream};
use clap::builder::styling::{AnsiColor, Style};
use terminal_size::{Width, terminal_size};
use textwrap::{Options, WordSeparator, WordSplitter, WrapAlgorithm};

/// No line is longer, on whatever terminal or none: beyond it the eye loses its row.
const WIDEST: usize = 100;
/// Narrower ones break what words there are.
const NARROWEST: usize = 30;

/// Columns of a line: those of `COLUMNS`, else of the terminal, never more than a hundred.
pub(crate) fn width() -> usize {
    let said = env::var("COLUMNS").ok().and_then(|text| text.trim().parse().ok());
    let found = || terminal_size().map(|(Width(columns), _)| usize::from(columns));
    said.or_else(found).unwrap_or(WIDEST).clamp(NARROWEST, WIDEST)
}

/// A text in lines that are not wider than that: broken between words, further in as the line began. Rows of tables are made
/// as wide as there is room already, and a word is never cut.
pub(crate) fn wrapped(text: &str) -> String {
    wrapped_at(text, width())
}

fn wrapped_at(text: &str, width: usize) -> String {
    let lines = text.split('\n').map(|line| {
        if line.starts_with('|') || line.chars().count() <= width {
            return line.to_owned();
        }
        let body = line.trim_start();
        let marked = body.strip_prefix("- ").unwrap_or(body);
        let indent = " ".repeat((line.len() - marked.len()).min(width / 2));
        let options = Options::new(width)
            .subsequent_indent(&indent)
            .break_words(false)
            .wrap_algorithm(WrapAlgorithm::FirstFit)
            .word_separator(WordSeparator::AsciiSpace)
            .word_splitter(WordSplitter::NoHyphenation);
        textwrap::fill(line, options)
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// What is set off from the rest.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Ink {
    /// The answer.
    Strong,
    /// An error.
    Alarm,
}

/// A text in its ink, where a stream shows one: a terminal, unless `NO_COLOR` is set (or `CLICOLOR_FORCE` says all the same).
pub(crate) fn painted(text: &str, ink: Ink, to: &impl RawStream) -> String {
    if AutoStream::choice(to) == ColorChoice::Never {
        return text.to_owned();
    }
    let style = match ink {
        Ink::Strong => Style::new().bold(),
        Ink::Alarm => AnsiColor::Red.on_default().bold(),
    };
    format!("{style}{text}{style:#}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_break_between_words_and_stand_under_their_begin() {
        let text = "- one two three four\n  five six seven\n| a table is as wide as it is |\nshort";
        let wrapped = wrapped_at(text, 12);
        assert_eq!(
            wrapped,
            "- one two\n  three four\n  five six\n  seven\n| a table is as wide as it is |\nshort"
        );
        let word = "a_path/that_is_longer/than_the_line.csv: there is no such file";
        assert!(
            wrapped_at(word, 20).starts_with("a_path/that_is_longer/than_the_line.csv:\nthere")
        );
    }
}

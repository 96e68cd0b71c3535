//! What the program says, how wide its lines are, and whether they have colours, even if its reader may be gone: no work depends on it.
//!
//! Standard error is a courtesy: what cannot be written there is let go. Standard output may be
//! what was asked for: the first failure is kept, the work goes on, its files are written, and
//! [`lost`] tells the end of the program.

use std::{
    env,
    fmt::Display,
    io::{self, ErrorKind, Write},
    path::Path,
    sync::{
        OnceLock,
        atomic::{AtomicBool, Ordering::SeqCst},
    },
    time::Instant,
};

use anstream::{AutoStream, ColorChoice, stream::RawStream};
use anyhow::ensure;
use clap::builder::styling::{AnsiColor, Style};
use stretch_core::is_hidden;
use stretch_data::files::is_standard_output;
use terminal_size::{Width, terminal_size};
use textwrap::{Options, WordSeparator, WordSplitter, WrapAlgorithm};

/// How much is said in addition to results and errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Volume {
    /// `-q`: nothing, and of a diagnosis the verdict alone.
    Quiet,
    /// What was written, what to look at, and progress on a terminal.
    Usual,
    /// `-v`: also what is read and chosen, how long it takes, in lines of their own, and every detail of a diagnosis.
    Verbose,
}

/// When the program began, and how much it says.
static BEGUN: OnceLock<(Instant, Volume)> = OnceLock::new();

/// Says how much is said from now on, once.
pub(crate) fn begin(volume: Volume) {
    let _ = BEGUN.set((Instant::now(), volume));
}

fn volume() -> Volume {
    BEGUN.get().map_or(Volume::Usual, |(_, volume)| *volume)
}

/// Whether a result is said in one sentence, without what explains it.
pub(crate) fn is_quiet() -> bool {
    volume() == Volume::Quiet
}

/// Whether a result is said with every detail.
pub(crate) fn is_verbose() -> bool {
    volume() == Volume::Verbose
}

/// Whether progress is drawn: what `-v` says is written in separate lines.
pub(crate) fn shows_progress() -> bool {
    volume() == Volume::Usual
}

static LOST: OnceLock<ErrorKind> = OnceLock::new();

/// Whether a file goes to standard output, where nothing else may be written then.
static TAKEN: AtomicBool = AtomicBool::new(false);

/// Gives standard output to the one of some files that is called `-`, or so.
pub(crate) fn give_stdout<'a>(
    files: impl IntoIterator<Item = Option<&'a Path>>,
) -> anyhow::Result<()> {
    let count = files.into_iter().flatten().filter(|path| is_standard_output(path)).count();
    ensure!(count < 2, "two files cannot go to standard output; name one of them");
    TAKEN.fetch_or(count == 1, SeqCst);
    Ok(())
}

/// A result: a text and a line end to standard output, to standard error where a file goes there. Lines are as wide as the
/// terminal at most.
///
/// # Errors
/// None: a result, so that a command can end with what it says.
pub(crate) fn say(text: impl Display) -> anyhow::Result<()> {
    say_as_is(wrapped(&plain(&text.to_string())))
}

/// The result that all others explain: bold where that is shown.
///
/// # Errors
/// None, as [`say`].
pub(crate) fn say_first(text: impl Display) -> anyhow::Result<()> {
    let text = wrapped(&plain(&text.to_string()));
    match TAKEN.load(SeqCst) {
        true => say_as_is(text),
        false => write_out(&painted(&text, Style::new().bold(), &io::stdout())),
    }
}

/// A result that other programs read, in separate lines: code, JSON, TOML.
///
/// # Errors
/// None, as [`say`].
pub(crate) fn say_as_is(text: impl Display) -> anyhow::Result<()> {
    let text = plain(&text.to_string());
    if TAKEN.load(SeqCst) {
        write_err(&text);
        return Ok(());
    }
    write_out(&text)
}

fn write_out(text: &str) -> anyhow::Result<()> {
    // what was lost is kept by `Output`
    let _ = writeln!(Output, "{text}");
    Ok(())
}

/// What was done in addition to the result, such as a file that was written; not with `-q`.
///
/// # Errors
/// None, as [`say`].
pub(crate) fn tell(text: impl Display) -> anyhow::Result<()> {
    if volume() == Volume::Quiet { Ok(()) } else { say(text) }
}

/// What is read, chosen, or begun, and when: with `-v`, on standard error.
pub(crate) fn detail(text: impl Display) {
    if let Some((begun, Volume::Verbose)) = BEGUN.get() {
        let line = format!("[{:7.2} s] {text}", begun.elapsed().as_secs_f64());
        write_err(&wrapped(&plain(&line)));
    }
}

/// What to look at: a text and a line end to standard error if it can be written; not with `-q`.
pub(crate) fn warn(text: impl Display) {
    if volume() != Volume::Quiet {
        write_err(&wrapped(&plain(&text.to_string())));
    }
}

/// What went wrong: to standard error, always, behind the program's name.
pub(crate) fn fail(text: impl Display) {
    let text = wrapped(&plain(&format!("stretch: {text}")));
    let (name, rest) = text.split_at("stretch:".len());
    write_err(&(painted(name, AnsiColor::Red.on_default().bold(), &io::stderr()) + rest));
}

fn write_err(text: &str) {
    let _ = io::stderr().lock().write_all(format!("{text}\n").as_bytes());
}

/// A text without what a terminal acts on, or what turns the text around it or hides: names come from
/// files of any origin. What is written in its place is an escape of JSON, too.
fn plain(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\n' | '\t' => plain.push(c),
            c if is_hidden(c) => plain += &format!("\\u{:04x}", u32::from(c)),
            c => plain.push(c),
        }
    }
    plain
}

/// Why standard output could not take all that it was given, if it could not.
pub(crate) fn lost() -> Option<ErrorKind> {
    LOST.get().copied()
}

/// Standard output that keeps the first failure for [`lost`].
#[derive(Debug)]
pub(crate) struct Output;

fn kept<T>(result: io::Result<T>) -> io::Result<T> {
    result.inspect_err(|error| {
        // a call that was interrupted is made again
        if error.kind() != ErrorKind::Interrupted {
            let _ = LOST.set(error.kind());
        }
    })
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        kept(io::stdout().lock().write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        kept(io::stdout().lock().flush())
    }
}

/// Longest line of text, on any terminal, because longer lines are hard to read. Also the width without a terminal.
const WIDEST: usize = 100;
/// Least width: a narrower terminal breaks the lines itself.
const NARROWEST: usize = 30;

/// Columns of the terminal: those of `COLUMNS`, otherwise those that the terminal reports. A table may use them all.
pub(crate) fn columns() -> usize {
    let set = env::var("COLUMNS").ok().and_then(|text| text.trim().parse().ok());
    let found = || terminal_size().map(|(Width(columns), _)| usize::from(columns));
    set.or_else(found).unwrap_or(WIDEST).max(NARROWEST)
}

/// Breaks a text between words into lines of at most 100 columns; further lines keep the indent of the first. Rows of tables
/// already fit, and a word is never cut.
fn wrapped(text: &str) -> String {
    wrapped_at(text, columns().min(WIDEST))
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

/// A text in a style, where a stream shows one: a terminal, unless `NO_COLOR` is set (or `CLICOLOR_FORCE` says all the same).
fn painted(text: &str, style: Style, to: &impl RawStream) -> String {
    match AutoStream::choice(to) {
        ColorChoice::Never => text.to_owned(),
        _ => format!("{style}{text}{style:#}"),
    }
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

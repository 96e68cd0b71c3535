//! Output of the program: texts on standard output and standard error, the width of lines, and
//! colours.
//!
//! A closed or full stream never stops the work. Failed writes to standard error are ignored. A failed write to
//! standard output may lose the requested result, so the first failure is stored. The command still writes its files,
//! and [`lost`] reports the failure at the end of the program.

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
use stretch_core::label::is_hidden;
use stretch_data::files::is_standard_output;
use terminal_size::{Width, terminal_size};
use textwrap::{Options, WordSeparator, WordSplitter, WrapAlgorithm};

/// How much is printed in addition to results and errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Volume {
    /// `-q`: only the sentence of a result, and for a calibration the files written.
    Quiet,
    /// Files written, warnings, and progress on a terminal.
    Usual,
    /// `-v`: in addition, what is read and chosen and how long it takes, each in a line, and all
    /// details of a diagnosis.
    Verbose,
}

/// Start time of the program, and how much it prints.
static BEGUN: OnceLock<(Instant, Volume)> = OnceLock::new();

/// Sets the start time and the volume, once.
pub(crate) fn begin(volume: Volume) {
    let _ = BEGUN.set((Instant::now(), volume));
}

fn volume() -> Volume {
    BEGUN.get().map_or(Volume::Usual, |(_, volume)| *volume)
}

/// Whether only the sentence of a result is printed, without explanations.
pub(crate) fn is_quiet() -> bool {
    volume() == Volume::Quiet
}

/// Whether results are printed with all details.
pub(crate) fn is_verbose() -> bool {
    volume() == Volume::Verbose
}

/// Whether a progress bar is drawn. With `-v`, separate lines report the progress instead.
pub(crate) fn shows_progress() -> bool {
    volume() == Volume::Usual
}

static LOST: OnceLock<ErrorKind> = OnceLock::new();

/// Whether a file is written to standard output, so that nothing else may be printed there.
static TAKEN: AtomicBool = AtomicBool::new(false);

/// Reserves standard output for a file with the path `-`, if there is one among these files.
pub(crate) fn give_stdout<'a>(
    files: impl IntoIterator<Item = Option<&'a Path>>,
) -> anyhow::Result<()> {
    let count = files.into_iter().flatten().filter(|path| is_standard_output(path)).count();
    ensure!(count < 2, "two files cannot go to standard output; name one of them");
    TAKEN.fetch_or(count == 1, SeqCst);
    Ok(())
}

/// Prints a result to standard output, or to standard error if a file is written to standard
/// output. Lines are wrapped to the width of the terminal.
///
/// # Errors
/// Never. The return value lets a command end with this call.
pub(crate) fn say(text: impl Display) -> anyhow::Result<()> {
    say_as_is(wrapped(&plain(&text.to_string())))
}

/// Prints the main result, in bold if the terminal supports it.
///
/// # Errors
/// Never: see [`say`].
pub(crate) fn say_first(text: impl Display) -> anyhow::Result<()> {
    let text = wrapped(&plain(&text.to_string()));
    match TAKEN.load(SeqCst) {
        true => say_as_is(text),
        false => write_out(&painted(&text, Style::new().bold(), &io::stdout())),
    }
}

/// Most lines below the sentence of a result, without `-v`.
const MOST_LINES: usize = 15;

/// Prints paragraphs and tables below the sentence of a result: with `-q` none, with `-v` all, and
/// otherwise those that fit in [`MOST_LINES`] lines together with the paths of `written` files, which
/// come last.
///
/// # Errors
/// Never: see [`say`].
pub(crate) fn say_below<'a>(
    blocks: impl IntoIterator<Item = String>,
    written: impl IntoIterator<Item = &'a Path>,
) -> anyhow::Result<()> {
    let written: Vec<String> =
        written.into_iter().map(|path| format!("wrote {}", path.display())).collect();
    let lines = |text: &str| wrapped(&plain(text)).lines().count();
    // One line is reserved for the hint that -v prints more.
    let last: usize = 1 + written.iter().map(|text| lines(text)).sum::<usize>();
    let mut room = if is_verbose() { usize::MAX } else { MOST_LINES.saturating_sub(last) };
    let mut left_out = 0;
    for block in blocks.into_iter().filter(|_| !is_quiet()) {
        match room.checked_sub(lines(&block)) {
            Some(rest) => {
                room = rest;
                say(block)?;
            }
            None => left_out += 1,
        }
    }
    if volume() == Volume::Usual {
        let more = match left_out {
            0 => String::new(),
            1 => " and one more paragraph".to_owned(),
            n => format!(" and {n} more paragraphs"),
        };
        say(format!("-v prints the details{more}."))?;
    }
    written.into_iter().try_for_each(say)
}

/// Prints a result that other programs read, without wrapping: code, JSON, TOML.
///
/// # Errors
/// Never: see [`say`].
pub(crate) fn say_as_is(text: impl Display) -> anyhow::Result<()> {
    let text = plain(&text.to_string());
    if TAKEN.load(SeqCst) {
        write_err(&text);
        return Ok(());
    }
    write_out(&text)
}

fn write_out(text: &str) -> anyhow::Result<()> {
    // `Output` stores the error.
    let _ = writeln!(Output, "{text}");
    Ok(())
}

/// Reports an additional action, such as a file that was written. Silent with `-q`.
///
/// # Errors
/// Never: see [`say`].
pub(crate) fn tell(text: impl Display) -> anyhow::Result<()> {
    if volume() == Volume::Quiet { Ok(()) } else { say(text) }
}

/// With `-v`, reports a step of the work and its time on standard error.
pub(crate) fn detail(text: impl Display) {
    if let Some((begun, Volume::Verbose)) = BEGUN.get() {
        let line = format!("[{:7.2} s] {text}", begun.elapsed().as_secs_f64());
        write_err(&wrapped(&plain(&line)));
    }
}

/// Prints a warning to standard error, if it can be written. Silent with `-q`.
pub(crate) fn warn(text: impl Display) {
    if volume() != Volume::Quiet {
        write_err(&wrapped(&plain(&text.to_string())));
    }
}

/// Prints a doubt about a result to standard error, after the program's name, also with `-q`.
pub(crate) fn doubt(text: impl Display) {
    write_err(&wrapped(&plain(&format!("stretch: {text}"))));
}

/// Prints an error to standard error, after the program's name.
pub(crate) fn fail(text: impl Display) {
    let text = wrapped(&plain(&format!("stretch: {text}")));
    let (name, rest) = text.split_at("stretch:".len());
    write_err(&(painted(name, AnsiColor::Red.on_default().bold(), &io::stderr()) + rest));
}

fn write_err(text: &str) {
    let _ = io::stderr().lock().write_all(format!("{text}\n").as_bytes());
}

/// Escapes control and hidden characters, because names in files of any origin may contain them.
/// The escapes are also valid in JSON.
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

/// Returns the first error of writing to standard output, if there was one.
pub(crate) fn lost() -> Option<ErrorKind> {
    LOST.get().copied()
}

/// Standard output that stores its first error for [`lost`].
#[derive(Debug)]
pub(crate) struct Output;

fn kept<T>(result: io::Result<T>) -> io::Result<T> {
    result.inspect_err(|error| {
        // An interrupted call is repeated.
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
/// Smallest width: a narrower terminal breaks the lines itself.
const NARROWEST: usize = 30;

/// Number of columns of the terminal, from the variable `COLUMNS`, otherwise from the terminal. A table may use all of
/// them.
pub(crate) fn columns() -> usize {
    let set = env::var("COLUMNS").ok().and_then(|text| text.trim().parse().ok());
    let found = || terminal_size().map(|(Width(columns), _)| usize::from(columns));
    set.or_else(found).unwrap_or(WIDEST).max(NARROWEST)
}

/// Wraps a text to the line width, between words, keeping the indentation of each line. Rows of
/// tables already fit, and words are never cut.
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

/// Applies a style to a text if the stream shows one: a terminal, unless `NO_COLOR` is set, or
/// `CLICOLOR_FORCE`.
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

//! A header packed as a library for the Arduino IDE.

use crate::{ExportError, Form, Header, constants::comment_safe, part::kept};

/// A file of the Arduino library, which is a folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// Path in the folder, with `/` between its parts.
    pub path: String,
    /// Content of the file.
    pub text: String,
}

/// Returns the files of a library called `name`: its properties, the header in `src`, an example, and the keywords that
/// the IDE highlights. The example reads pin A0 (for several gauges, A0 and the pins after it) at the calibration's
/// sample rate.
///
/// The file name of the header is `stretch_` followed by the library's name. Therefore several such libraries can be
/// installed at the same time, but a source file can include only one of them. Characters that a name may not have
/// become `_`. Copy the folder into the `libraries` folder of the sketchbook. Source: Arduino library specification,
/// revision 2.2 (format 1.5).
///
/// # Errors
/// [`ExportError::Calibrate`] if the board's converter measures no part of a calibrated range.
///
/// ```
/// use stretch_calibrate::parse_adc;
/// use stretch_export::{Options, arduino_library, header};
/// let options = Options { form: None, adc: parse_adc("12,0,3.3")? };
/// let header = header(&stretch_receptor::example_calibration(), &options)?;
/// let paths: Vec<_> = arduino_library(&header, "Elbow")?.into_iter().map(|file| file.path).collect();
/// assert_eq!(paths, ["library.properties", "keywords.txt", "src/stretch_Elbow.h", "examples/Live/Live.ino"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn arduino_library(header: &Header, name: &str) -> Result<Vec<File>, ExportError> {
    header.converter_notes()?;
    let name = allowed(name);
    let file = |path: &str, text: String| File { path: path.into(), text };
    Ok(vec![
        file("library.properties", properties(header, &name)),
        file("keywords.txt", keywords(header)),
        file(&format!("src/stretch_{name}.h"), header.text.clone()),
        file("examples/Live/Live.ino", live(header, &name)),
    ])
}

/// Changes a name to one that the specification allows: at most 63 letters, digits and `_.-`, with a letter, and a
/// letter or digit first.
fn allowed(name: &str) -> String {
    let is_allowed = |c: char| c.is_ascii_alphanumeric() || "_.-".contains(c);
    let name: String = name.chars().map(|c| if is_allowed(c) { c } else { '_' }).collect();
    let is_name = name.starts_with(|c: char| c.is_ascii_alphanumeric())
        && name.contains(|c: char| c.is_ascii_alphabetic());
    let name = if is_name { name } else { format!("stretch{name}") };
    name.chars().take(63).collect()
}

fn properties(header: &Header, name: &str) -> String {
    named(header, include_str!("arduino/library.properties"))
        .replace("@VERSION@", env!("CARGO_PKG_VERSION"))
        .replace("@MODEL@", &header.model)
        .replace("@FORM@", &header.form.to_string())
        .replace("@NAME@", name)
}

/// Writes the names of the signals and of the reference, which contain their units, into a text.
fn named(header: &Header, text: &str) -> String {
    let names: Vec<String> =
        header.signals.iter().map(|(signal, _)| comment_safe(signal.as_str())).collect();
    let signals = match &names[..] {
        [signal] => format!("the signal {signal}"),
        several => format!("the signals {}", several.join(", ")),
    };
    text.replace("@SIGNALS@", &signals)
        .replace("@REFERENCE@", &comment_safe(header.reference.as_str()))
}

/// Returns the keywords that the IDE highlights and that occur in the header. A tab separates a word from its kind.
fn keywords(header: &Header) -> String {
    let lines = include_str!("arduino/keywords.txt").split_inclusive('\n');
    let is_there = |line: &&str| line.split('\t').next().is_some_and(|w| header.text.contains(w));
    lines.filter(is_there).collect()
}

fn live(header: &Header, name: &str) -> String {
    let form = match (header.array, header.form) {
        (Some(_), _) => "array",
        (None, Form::Fixed) => "fixed",
        (None, Form::Float) => "float",
    };
    let mut has = vec![form];
    has.extend(header.array.is_none().then_some("one"));
    has.extend(header.pressure.then_some("pressure"));
    let pins: Vec<String> = (0..header.array.unwrap_or(0)).map(|k| format!("A{k}")).collect();
    named(header, &kept(include_str!("arduino/Live.ino"), &has))
        .replace("@NAME@", name)
        .replace("@PINS@", &pins.join(", "))
}

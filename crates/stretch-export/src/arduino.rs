//! A header as a library that the Arduino IDE takes.

use crate::{Form, HEADER, Header, part::kept};

/// A file of a library folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// Where it lies in the folder, parts divided by `/`.
    pub path: String,
    /// What it says.
    pub text: String,
}

/// The library: its properties, the header in `src`, an example that reads A0 (of several gauges, A0 and the pins
/// after it) at the calibration's sample rate, and the words that the IDE colours.
///
/// The folder goes into the sketchbook's `libraries`. Source: Arduino library specification,
/// revision 2.2 (format 1.5).
///
/// ```
/// use stretch_calibrate::parse_adc;
/// use stretch_export::{Options, arduino_library, header};
/// let options = Options { form: None, adc: parse_adc("12,0,3.3")? };
/// let header = header(&stretch_receptor::example_calibration(), &options)?;
/// let paths: Vec<_> = arduino_library(&header).into_iter().map(|file| file.path).collect();
/// assert_eq!(paths, ["library.properties", "keywords.txt", "src/stretch.h", "examples/Live/Live.ino"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn arduino_library(header: &Header) -> Vec<File> {
    let file = |path: &str, text: String| File { path: path.into(), text };
    vec![
        file("library.properties", properties(header)),
        file("keywords.txt", keywords(header)),
        file(&format!("src/{HEADER}"), header.text.clone()),
        file("examples/Live/Live.ino", live(header)),
    ]
}

fn properties(header: &Header) -> String {
    let Header { model, form, .. } = header;
    format!(
        "name=StretchReceptor\nversion={}\nauthor=The stretch developers\nmaintainer=The stretch developers\n\
         sentence=Length from a stretch sensor's voltage, by one calibration.\nparagraph=Model {model}, form \
         {form}. Missing samples are bridged, and every reading says whether it is inside the calibrated \
         domain. The same bits as on the computer.\ncategory=Sensors\nurl=\narchitectures=*\nincludes={HEADER}\n",
        env!("CARGO_PKG_VERSION"),
    )
}

fn keywords(header: &Header) -> String {
    let kinds: [(&str, &[&str]); 3] = [
        ("KEYWORD1", &["stretch_state", "stretch_reading"]),
        (
            "KEYWORD2",
            &[
                "stretch_init",
                "stretch_step",
                "stretch_lost",
                "stretch_start_on",
                "stretch_set_pressure",
                "stretch_loss",
                "stretch_readmit",
                "stretch_self_test",
            ],
        ),
        (
            "LITERAL1",
            &[
                "STRETCH_OK",
                "STRETCH_WARMING",
                "STRETCH_MISSING",
                "STRETCH_ALL_LOST",
                "STRETCH_INFLATION",
                "STRETCH_DEFLATION",
                "STRETCH_INSIDE",
                "STRETCH_SIGNAL_CLAMPED",
                "STRETCH_RATE_CLAMPED",
                "STRETCH_CHANNELS",
                "STRETCH_SIGNALS",
                "STRETCH_PERIOD_US",
                "STRETCH_UNIT",
            ],
        ),
    ];
    // the IDE wants a tab between a word and its kind; a word that the header has not is none of the library's
    let lines = |(kind, words): (&str, &[&str])| {
        let there = words.iter().filter(|word| header.text.contains(**word));
        there.map(|word| format!("{word}\t{kind}\n")).collect::<String>()
    };
    kinds.into_iter().map(lines).collect()
}

fn live(header: &Header) -> String {
    let example = include_str!("arduino/Live.ino");
    if let Some(count) = header.array {
        let pins: Vec<String> = (0..count).map(|k| format!("A{k}")).collect();
        return kept(example, &["array"]).replace("@PINS@", &pins.join(", "));
    }
    let pressure = if header.pressure {
        "  float pressure = 0.0f;  // yours, in the unit of the pressure that the calibration saw\n  \
         stretch_set_pressure(&state, pressure);\n"
    } else {
        ""
    };
    let (step, estimate) = match header.form {
        Form::Fixed => (
            "  stretch_reading reading = stretch_step(&state, analogRead(A0));".to_owned(),
            "reading.estimate / 1000.0, 3",
        ),
        Form::Float => (
            format!(
                "{pressure}  float volts = STRETCH_ADC_ZERO + STRETCH_ADC_PER_CODE * (float)analogRead(A0);\n  \
                 stretch_reading reading = stretch_step(&state, volts);"
            ),
            "reading.estimate, 3",
        ),
    };
    kept(example, &["one"]).replace("@STEP@", &step).replace("@ESTIMATE@", estimate)
}

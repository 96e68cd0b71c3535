//! Sketches: operators as code that users can type into their own simulator in C, Python or MATLAB, with explicit
//! state.

use alloc::{borrow::Cow, format, string::String, vec, vec::Vec};
use core::fmt;

/// An input or output of an operator.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// Name in the code.
    pub name: &'static str,
    /// Unit.
    pub unit: Cow<'static, str>,
    /// Meaning.
    pub meaning: Cow<'static, str>,
    /// Whether the quantity is a whole recording with one value a sample.
    pub is_record: bool,
}

impl Quantity {
    /// A quantity with one value a sample.
    pub const fn new(name: &'static str, unit: &'static str, meaning: &'static str) -> Self {
        let (unit, meaning) = (Cow::Borrowed(unit), Cow::Borrowed(meaning));
        Self { name, unit, meaning, is_record: false }
    }

    /// Time since the session began.
    pub const SESSION_TIME: Self = Self::new("t", "s", "time since the session began");

    /// The signal that loads a contact.
    pub const LOAD: Self = Self::new("load", "1", "the signal that loads the contact");

    /// The number of samples of a recording.
    pub const COUNT: Self = Self::new("n", "1", "number of samples of the recording");

    /// Returns the same quantity under another name.
    pub fn named(self, name: &'static str) -> Self {
        Self { name, ..self }
    }

    /// Returns the same quantity as a whole recording.
    pub fn record(self) -> Self {
        Self { is_record: true, ..self }
    }

    /// Returns the output that replaces this input.
    fn behind(&self) -> Self {
        let meaning = format!("the signal with the effect; use it in place of {}", self.name);
        Self { name: "y", unit: self.unit.clone(), meaning: meaning.into(), is_record: false }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &*self.unit {
            "1" => write!(f, "{}: {}", self.name, self.meaning),
            unit => write!(f, "{} ({unit}): {}", self.name, self.meaning),
        }
    }
}

/// A constant of an operator.
#[derive(Debug, Clone, PartialEq)]
pub struct Constant {
    /// Name in the code.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Unit.
    pub unit: String,
}

/// A value that an operator keeps from one sample to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Name in the code.
    pub name: &'static str,
    /// Unit.
    pub unit: Cow<'static, str>,
    /// Initial value: a number, or the name of an input.
    pub begins: &'static str,
}

/// An operator in a notation from which code in three languages is generated.
///
/// A line of `body` is `let n = ...`, `var n = ...`, `n = ...`, `if ...`, `else` or `end`. Functions are those that C,
/// Python and MATLAB share. `s.n` is a state, and `v[i]` is sample i of a recording, counted from 0. The output is
/// called `y`.
///
/// ```
/// use stretch_effects::{Language, Quantity, Sketch};
/// let shown = Quantity::new("x", "mm", "what the scale shows");
/// let scale = Sketch::of(shown, "let y = x + OFFSET").with("OFFSET", 0.5, "mm");
/// let code = scale.code(Language::Python, "zero", &[]);
/// assert!(code.contains("OFFSET = 0.5  # mm") && code.contains("def zero(x):"));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Sketch {
    /// Inputs, the signal first.
    pub inputs: Vec<Quantity>,
    /// Output.
    pub output: Quantity,
    /// Constants.
    pub constants: Vec<Constant>,
    /// State; empty if the operator remembers nothing.
    pub state: Vec<Cell>,
    /// Statements that process one sample.
    pub body: String,
}

impl Sketch {
    /// A sketch that changes a signal, without constants and state.
    pub fn of(signal: Quantity, body: impl Into<String>) -> Self {
        let (output, inputs) = (signal.behind(), vec![signal]);
        Self { inputs, output, constants: Vec::new(), state: Vec::new(), body: body.into() }
    }

    /// Adds an input.
    pub fn beside(mut self, input: Quantity) -> Self {
        self.inputs.push(input);
        self
    }

    /// Replaces the output.
    pub fn giving(self, output: Quantity) -> Self {
        Self { output, ..self }
    }

    /// Adds a constant.
    pub fn with(mut self, name: &'static str, value: f64, unit: &str) -> Self {
        self.constants.push(Constant { name, value, unit: unit.into() });
        self
    }

    /// Adds several constants.
    pub fn with_all(self, all: &[(&'static str, f64, &str)]) -> Self {
        all.iter().fold(self, |sketch, &(name, value, unit)| sketch.with(name, value, unit))
    }

    /// Adds state values in the unit of the signal that begin at the first sample.
    pub fn remembering<const N: usize>(self, names: [&'static str; N]) -> Self {
        let (unit, begins) = (self.inputs[0].unit.clone(), self.inputs[0].name);
        self.cells(names, unit, begins)
    }

    /// Adds state values with the same unit and initial value.
    pub fn cells<const N: usize>(
        mut self,
        names: [&'static str; N],
        unit: impl Into<Cow<'static, str>>,
        begins: &'static str,
    ) -> Self {
        let unit = unit.into();
        self.state.extend(names.map(|name| Cell { name, unit: unit.clone(), begins }));
        self
    }

    /// Replaces the input called `name` by the signal itself.
    pub fn beside_itself(mut self, name: &str) -> Self {
        let signal = self.inputs[0].name;
        self.inputs.retain(|q| q.name != name);
        self.state.iter_mut().filter(|c| c.begins == name).for_each(|c| c.begins = signal);
        self.body = format!("let {name} = {signal}\n{}", self.body);
        self
    }

    /// Appends a line to the body. If the line changes `y`, the body must declare `y` as a `var`.
    pub fn then(mut self, line: &str) -> Self {
        self.body = format!("{}\n{line}", self.body);
        self
    }

    /// Describes the initial state in words; `None` if there is no state.
    ///
    /// ```
    /// use stretch_effects::{Extent, Quantity, Signals, kind_named};
    /// let x = Quantity::new("x", "strain", "gauge strain");
    /// let signals = Signals { beside: x.clone(), x, load: Quantity::LOAD, dt_s: 0.01 };
    /// let play = kind_named("backlash").unwrap().sketch.unwrap();
    /// let sketch = play(&[0.008, 0.3], &Extent::between(0.0, 0.2), &signals);
    /// assert_eq!(sketch.initial_state().unwrap(), "a, b, c (strain) begin at the first x");
    /// ```
    pub fn initial_state(&self) -> Option<String> {
        let mut parts: Vec<String> = Vec::new();
        for cells in self.state.chunk_by(|a, b| (&a.unit, a.begins) == (&b.unit, b.begins)) {
            let names: Vec<&str> = cells.iter().map(|cell| cell.name).collect();
            let unit = match &*cells[0].unit {
                "1" => String::new(),
                unit => format!(" ({unit})"),
            };
            let begin = if names.len() > 1 { "begin" } else { "begins" };
            let is_input = self.inputs.iter().any(|input| input.name == cells[0].begins);
            let at = if is_input { "at the first " } else { "at " };
            parts.push(format!("{}{unit} {begin} {at}{}", names.join(", "), cells[0].begins));
        }
        (!parts.is_empty()).then(|| parts.join("; "))
    }
}

//! An operator as somebody would type it into a simulator of their own: in C, Python or MATLAB, a dozen lines with the state in sight.

mod code;
mod laws;
mod memories;
mod plays;
mod records;
mod shapes;

use std::fmt;

pub use code::Language;
pub(crate) use laws::{droop, growth, leak};
pub(crate) use memories::{drifting, fading, lowpass, swinging, warming};
pub(crate) use plays::{Band, Soft, backlash, dead_band, loops, softening};
pub(crate) use records::{delayed, hum, skewed};
pub(crate) use shapes::{bowed, bowed_gain, crosstalk, knees};

/// What goes into an operator, or comes out of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantity {
    /// Name in the code.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// What it is.
    pub meaning: &'static str,
    /// Whether it is a whole record, one value a sample.
    pub is_record: bool,
}

impl Quantity {
    pub(crate) const fn new(name: &'static str, unit: &'static str, meaning: &'static str) -> Self {
        Self { name, unit, meaning, is_record: false }
    }

    /// What comes out where it went in.
    pub(crate) const fn behind(self) -> Self {
        Self { name: "y", unit: self.unit, meaning: "what goes on in its place", is_record: false }
    }

    pub(crate) const fn record(self) -> Self {
        Self { is_record: true, ..self }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.unit {
            "1" => write!(f, "{}: {}", self.name, self.meaning),
            unit => write!(f, "{} ({unit}): {}", self.name, self.meaning),
        }
    }
}

/// Contraction before the lag of the muscle.
pub(crate) const STILL: Quantity =
    Quantity::new("x", "1", "static contraction k_s, before the lag of the muscle");
/// Contraction behind it.
pub(crate) const MOVING: Quantity =
    Quantity::new("x", "1", "contraction k, behind the lag of the muscle");

/// A number of an operator.
#[derive(Debug, Clone, PartialEq)]
pub struct Constant {
    /// Name in the code.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Unit.
    pub unit: String,
}

/// A number that an operator remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Name in the code.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// What it begins at: a number, or an input.
    pub begins: &'static str,
}

/// An operator, told in the one notation from which its code is written.
///
/// A line of `body` is `let n = ...`, `var n = ...`, `n = ...`, `if ...`, `else` or `end`; functions are those that C, Python and
/// MATLAB share, `s.n` is a state and `v[i]` the sample i, from 0, of a record. The output is called `y`.
#[derive(Debug, Clone, PartialEq)]
pub struct Sketch {
    /// What goes in, the signal first.
    pub inputs: Vec<Quantity>,
    /// What comes out.
    pub output: Quantity,
    /// Its numbers.
    pub constants: Vec<Constant>,
    /// What it remembers; empty where it remembers nothing.
    pub state: Vec<Cell>,
    /// What it does with a sample.
    pub body: String,
}

impl Sketch {
    /// The initial state in words; none where there is no state.
    ///
    /// ```
    /// use stretch_sim::{Grid, RigParams, Surroundings, effect_named};
    /// let (params, grid) = (RigParams::default(), Grid::samples(0.01)?);
    /// let around = Surroundings::of_rig(&params, &grid);
    /// let slip = effect_named("sleeve_slip").unwrap();
    /// let sketch = slip.sketch.unwrap()(&[0.008, 0.3], &around);
    /// assert_eq!(sketch.initial_state().unwrap(), "a, b, c (strain) begin at the first x");
    /// # Ok::<(), stretch_sim::GridError>(())
    /// ```
    pub fn initial_state(&self) -> Option<String> {
        let mut parts: Vec<String> = Vec::new();
        for cells in self.state.chunk_by(|a, b| (a.unit, a.begins) == (b.unit, b.begins)) {
            let names: Vec<&str> = cells.iter().map(|cell| cell.name).collect();
            let unit = match cells[0].unit {
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

    /// Numbers by name; units as given.
    pub(crate) fn constants(all: &[(&'static str, f64, &str)]) -> Vec<Constant> {
        let one = |&(name, value, unit): &(&'static str, f64, &str)| Constant {
            name,
            value,
            unit: unit.to_owned(),
        };
        all.iter().map(one).collect()
    }
}

/// Cells of one unit and one beginning.
pub(crate) fn cells<const N: usize>(
    names: [&'static str; N],
    unit: &'static str,
    begins: &'static str,
) -> Vec<Cell> {
    names.map(|name| Cell { name, unit, begins }).into()
}

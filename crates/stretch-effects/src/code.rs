//! Generation of C, Python and MATLAB code from a sketch.

use alloc::{
    borrow::ToOwned,
    format,
    string::{String, ToString},
    vec::Vec,
};
use core::fmt::Write;

use stretch_core::label::is_hidden;

use crate::sketch::{Cell, Quantity, Sketch};

/// A language in which the code of a sketch is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Language {
    /// C99, with `math.h`.
    C,
    /// Python 3, with nothing but `math`.
    Python,
    /// MATLAB, and Octave.
    Matlab,
}

impl Language {
    /// All languages.
    pub const ALL: [Self; 3] = [Self::C, Self::Python, Self::Matlab];

    /// Returns the name for display.
    pub fn name(self) -> &'static str {
        match self {
            Self::C => "C",
            Self::Python => "Python",
            Self::Matlab => "MATLAB",
        }
    }

    /// Returns the file extension.
    pub fn ending(self) -> &'static str {
        match self {
            Self::C => "c",
            Self::Python => "py",
            Self::Matlab => "m",
        }
    }

    /// Returns a text as a one-line comment. The text may contain column names and units from untrusted files. It can
    /// therefore neither end the comment or the line nor declare a source encoding that Python would apply.
    ///
    /// ```
    /// use stretch_effects::Language;
    /// assert_eq!(Language::C.comment("deg*/ int y; /*"), "/* deg* / int y; / * */");
    /// assert_eq!(Language::Python.comment("mm\nimport os"), "# mm import os");
    /// ```
    pub fn comment(self, text: &str) -> String {
        let text: String = text.chars().map(|c| if is_hidden(c) { ' ' } else { c }).collect();
        match self {
            Self::C => format!("/* {} */", text.replace("*/", "* /").replace("/*", "/ *")),
            Self::Python => {
                format!("# {}", text.replace("coding:", "coding :").replace("coding=", "coding ="))
            }
            Self::Matlab => format!("% {text}"),
        }
    }

    /// Converts a text to the name of a function or a file: ASCII letters, digits and underscores, beginning with a
    /// letter.
    ///
    /// ```
    /// use stretch_effects::Language;
    /// assert_eq!(Language::identifier("output.length_mm.lag"), "output_length_mm_lag");
    /// assert_eq!(Language::identifier("../2x"), "f____2x");
    /// ```
    pub fn identifier(text: &str) -> String {
        let name = text.replace(|c: char| !c.is_ascii_alphanumeric(), "_");
        if name.starts_with(|c: char| c.is_ascii_alphabetic()) { name } else { format!("f_{name}") }
    }

    /// Returns this language's name of a function that all three languages have.
    fn function(self, name: &str) -> String {
        match (self, name) {
            (Self::C, "min" | "max") => format!("f{name}"),
            (Self::C, "abs") => "fabs".to_owned(),
            (Self::Python, "min" | "max" | "abs") => name.to_owned(),
            (Self::Python, _) => format!("math.{name}"),
            _ => name.to_owned(),
        }
    }

    /// Translates an expression.
    fn expression(self, text: &str) -> String {
        let mut out = String::new();
        let mut rest = text;
        while let Some(c) = rest.chars().next() {
            if c.is_ascii_alphabetic() || c == '_' {
                let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
                let end = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
                let (word, behind) = rest.split_at(end);
                let is_called = behind.starts_with('(');
                match (self, word) {
                    (Self::C, "s") if behind.starts_with('.') => {
                        out.push_str("s->");
                        rest = &behind[1..];
                        continue;
                    }
                    (Self::C | Self::Matlab, "or") => out.push_str("||"),
                    (Self::C | Self::Matlab, "and") => out.push_str("&&"),
                    _ if is_called => out.push_str(&self.function(word)),
                    _ => out.push_str(word),
                }
                rest = behind;
                continue;
            }
            match (self, c) {
                (Self::C, '[') => out.push_str("[(long)("),
                (Self::Python, '[') => out.push_str("[int("),
                (Self::Matlab, '[') => out.push('('),
                (Self::C | Self::Python, ']') => out.push_str(")]"),
                // MATLAB indices begin at 1.
                (Self::Matlab, ']') => out.push_str(" + 1)"),
                _ => out.push(c),
            }
            rest = &rest[c.len_utf8()..];
        }
        out
    }

    /// Translates the body, indented by `depth` steps.
    fn body(self, body: &str, depth: usize) -> String {
        let mut out = String::new();
        let mut depth = depth;
        for line in body.lines().map(str::trim).filter(|line| !line.is_empty()) {
            let (first, rest) = line.split_once(' ').unwrap_or((line, ""));
            if matches!(first, "else" | "end") {
                depth -= 1;
            }
            let text = match (self, first) {
                (Self::C, "let") => format!("const double {};", self.expression(rest)),
                (Self::C, "var") => format!("double {};", self.expression(rest)),
                (Self::C, "if") => format!("if ({}) {{", self.expression(rest)),
                (Self::C, "else") => "} else {".to_owned(),
                (Self::C, "end") => "}".to_owned(),
                (Self::C, _) => format!("{};", self.expression(line)),
                (Self::Python, "let" | "var") => self.expression(rest),
                (Self::Python, "if") => format!("if {}:", self.expression(rest)),
                (Self::Python, "else") => "else:".to_owned(),
                (Self::Python, "end") => String::new(),
                (Self::Python, _) => self.expression(line),
                (Self::Matlab, "let" | "var") => format!("{};", self.expression(rest)),
                (Self::Matlab, "if") => format!("if {}", self.expression(rest)),
                (Self::Matlab, "else" | "end") => line.to_owned(),
                (Self::Matlab, _) => format!("{};", self.expression(line)),
            };
            if !text.is_empty() {
                let _ = writeln!(out, "{}{text}", "    ".repeat(depth));
            }
            if matches!(first, "if" | "else") {
                depth += 1;
            }
        }
        out
    }
}

/// Formats a number with all its digits, in a form that all three languages read.
fn literal(x: f64) -> String {
    format!("{x:?}")
}

impl Sketch {
    /// Writes the code of a function `name` that processes one sample per call, below the comments.
    ///
    /// | language | begin | a sample |
    /// | --- | --- | --- |
    /// | C | `name_start(&s, x)` | `y = name(&s, x)` |
    /// | Python | `s = name_start(x)` | `y = name(s, x)` |
    /// | MATLAB | `s = []` | `[y, s] = name(s, x)` |
    ///
    /// Without a state there is no `s` and no start function.
    pub fn code(&self, language: Language, name: &str, comments: &[String]) -> String {
        let mut out = String::new();
        for line in comments {
            let _ = writeln!(out, "{}", language.comment(line));
        }
        for q in self.inputs.iter().chain([&self.output]) {
            let _ = writeln!(out, "{}", language.comment(&q.to_string()));
        }
        out + &match language {
            Language::C => self.c(name),
            Language::Python => self.python(name),
            Language::Matlab => self.matlab(name),
        }
    }

    fn names(&self) -> Vec<&str> {
        self.inputs.iter().map(|input| input.name).collect()
    }

    /// Returns the input at which the state begins, if there is one.
    fn begins_at(&self) -> Option<&'static str> {
        self.state.iter().map(|cell| cell.begins).find(|begins| self.names().contains(begins))
    }

    fn c(&self, name: &str) -> String {
        let mut out = "#include <math.h>\n\n".to_owned();
        for c in &self.constants {
            let _ = writeln!(
                out,
                "static const double {} = {}; {}",
                c.name,
                literal(c.value),
                Language::C.comment(&c.unit)
            );
        }
        let typed = |q: &Quantity| match q.is_record {
            true => format!("const double *{}", q.name),
            false => format!("double {}", q.name),
        };
        let mut inputs: Vec<String> = self.inputs.iter().map(typed).collect();
        if !self.state.is_empty() {
            let cells: Vec<&str> = self.state.iter().map(|cell| cell.name).collect();
            let _ =
                writeln!(out, "\ntypedef struct {{ double {}; }} {name}_state;", cells.join(", "));
            let first = self.begins_at().map_or(String::new(), |x| format!(", double {x}"));
            let _ = writeln!(out, "\nvoid {name}_start({name}_state *s{first}) {{");
            for cell in &self.state {
                let _ = writeln!(out, "    s->{} = {};", cell.name, cell.begins);
            }
            out.push_str("}\n");
            inputs.insert(0, format!("{name}_state *s"));
        }
        let _ = writeln!(out, "\ndouble {name}({}) {{", inputs.join(", "));
        out + &Language::C.body(&self.body, 1) + "    return y;\n}\n"
    }

    fn python(&self, name: &str) -> String {
        let mut out = "import math\n".to_owned();
        if !self.state.is_empty() {
            out.push_str("from types import SimpleNamespace\n");
        }
        let mut inputs = self.names();
        if !self.state.is_empty() {
            let _ = writeln!(out, "\n\ndef {name}_start({}):", self.begins_at().unwrap_or(""));
            let cell = |cell: &Cell| format!("{}={}", cell.name, cell.begins);
            let cells: Vec<String> = self.state.iter().map(cell).collect();
            let _ = writeln!(out, "    return SimpleNamespace({})", cells.join(", "));
            inputs.insert(0, "s");
        }
        let _ = writeln!(out, "\n\ndef {name}({}):", inputs.join(", "));
        // Constants are local, so that the code of several effects can be written into one file.
        for c in &self.constants {
            let unit = Language::Python.comment(&c.unit);
            let _ = writeln!(out, "    {} = {}  {unit}", c.name, literal(c.value));
        }
        out + &Language::Python.body(&self.body, 1) + "    return y\n"
    }

    fn matlab(&self, name: &str) -> String {
        let mut inputs = self.names();
        let has_state = !self.state.is_empty();
        let gives = if has_state { "[y, s]" } else { "y" };
        if has_state {
            inputs.insert(0, "s");
        }
        let mut out = format!("function {gives} = {name}({})\n", inputs.join(", "));
        for c in &self.constants {
            let unit = Language::Matlab.comment(&c.unit);
            let _ = writeln!(out, "    {} = {}; {unit}", c.name, literal(c.value));
        }
        if has_state {
            out.push_str("    if isempty(s)\n");
            for cell in &self.state {
                let _ = writeln!(out, "        s.{} = {};", cell.name, cell.begins);
            }
            out.push_str("    end\n");
        }
        out + &Language::Matlab.body(&self.body, 1) + "end\n"
    }
}

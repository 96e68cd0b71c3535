//! Cost of a sample on a board, as the firmware's gate measures it.

use stretch_core::Degree;

use crate::ModelKind;

/// Figures that `firmware/gate.sh --write` measures and `firmware/gate.sh` checks against a new measurement.
const BUDGET: &str = include_str!("../budget.txt");

/// Instructions a sample on a Cortex-M3, from volts in `f32`, without a floating-point unit; `None` for a model that
/// was not measured.
///
/// The figure holds for the largest shape that a fit of that name may choose, with one relaxation in an observer.
///
/// ```
/// use stretch_calibrate::{ModelKind, m3_instructions, m3_instructions_fixed};
/// let line = m3_instructions(ModelKind::Linear).unwrap();
/// assert!(m3_instructions_fixed(ModelKind::Linear).unwrap() < line);
/// assert_eq!(m3_instructions("poly55".parse()?), None);
/// # Ok::<(), stretch_calibrate::SpellingError>(())
/// ```
pub fn m3_instructions(model: ModelKind) -> Option<f64> {
    match model {
        ModelKind::Linear | ModelKind::Surface(Degree::POLY13) => {
            mean(&format!("{model}-f32-volts"))
        }
        // a curve of three terms or more costs less than a surface
        ModelKind::Curve => None,
        _ => mean(&model.to_string()),
    }
}

/// Instructions a sample on a Cortex-M3, from a converter's codes in fixed point; `None` for a model without a
/// fixed-point form.
pub fn m3_instructions_fixed(model: ModelKind) -> Option<f64> {
    mean(&format!("{model}-fixed"))
}

fn mean(program: &str) -> Option<f64> {
    let value = |line: &'static str, key: &str| {
        line.split_whitespace().find_map(|word| word.strip_prefix(key)?.strip_prefix('='))
    };
    let line = BUDGET
        .lines()
        .find(|line| value(line, "core") == Some("m3") && value(line, "model") == Some(program))?;
    value(line, "mean")?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_candidate_was_measured() {
        for kind in ModelKind::named() {
            let instructions = m3_instructions(kind);
            assert!(instructions.is_some_and(|n| n > 100.0), "{kind}: {instructions:?}");
        }
        for kind in ["linear", "poly13", "observer", "observer+rest"] {
            let kind = kind.parse().unwrap();
            let (float, fixed) = (m3_instructions(kind), m3_instructions_fixed(kind));
            assert!(fixed.unwrap() < 0.2 * float.unwrap(), "{kind}: {fixed:?} {float:?}");
        }
    }
}

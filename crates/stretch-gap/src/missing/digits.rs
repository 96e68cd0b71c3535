//! Numbers in sentences and equations.

/// Three significant digits.
pub(crate) fn number(x: f64) -> String {
    let size = x.abs();
    if size == 0.0 {
        return "0".into();
    }
    let digits = (2 - size.log10().floor() as i32).clamp(0, 12) as usize;
    match size {
        1e-6..1e6 => format!("{x:.digits$}"),
        _ => format!("{x:.2e}"),
    }
}

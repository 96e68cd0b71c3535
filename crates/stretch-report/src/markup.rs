//! Text and numbers as they are written on a page.

use stretch_core::label::is_hidden;

/// Text that is safe between tags and in double quotes, and well-formed in XML.
///
/// ```
/// assert_eq!(stretch_report::kit::escape("a < b"), "a &lt; b");
/// ```
pub fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            '\n' | '\t' => safe.push(c),
            c if c.is_control() => safe.push('\u{fffd}'),
            c if is_hidden(c) => safe.push_str(&format!("\\u{:04x}", u32::from(c))),
            c => safe.push(c),
        }
    }
    safe
}

/// Text in place of a missing number.
pub(crate) const NONE: &str = "\u{2013}";

/// `x` to `digits` significant digits, in plain notation from 0.0001 to a
/// million; a dash when it is not finite.
pub fn number(x: f64, digits: usize) -> String {
    if !x.is_finite() {
        return NONE.to_owned();
    }
    let digits = digits.max(1);
    if x == 0.0 {
        return "0".to_owned();
    }
    let size = x.abs();
    if !(1e-4..1e6).contains(&size) {
        return minus(format!("{x:.*e}", digits - 1));
    }
    let before = size.log10().floor() as i32 + 1;
    let after = usize::try_from(digits as i32 - before).unwrap_or(0);
    fixed(x, after)
}

/// `x` with `decimals` digits behind the point and a true minus sign; a dash
/// when it is not finite.
pub fn fixed(x: f64, decimals: usize) -> String {
    if !x.is_finite() {
        return NONE.to_owned();
    }
    let text = format!("{x:.decimals$}");
    let zero = text.chars().all(|c| matches!(c, '-' | '0' | '.'));
    minus(if zero { text.trim_start_matches('-').to_owned() } else { text })
}

/// A share in whole percent, or with one digit below one percent, rounded once. A share below the whole is never
/// rounded to 100 %.
///
/// ```
/// use stretch_report::percent;
/// assert_eq!([0.004, 0.42, 0.996, 1.0].map(percent), ["0.4\u{a0}%", "42\u{a0}%", ">\u{a0}99\u{a0}%", "100\u{a0}%"]);
/// ```
pub fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if (99.5..100.0 - 1e-9).contains(&percent) {
        return ">\u{a0}99\u{a0}%".to_owned();
    }
    let digits = match percent.abs() < 0.95 {
        true => number((10.0 * percent).round() / 10.0, 1),
        false => fixed(percent, 0),
    };
    format!("{digits}\u{a0}%")
}

/// A number on an axis that spans `span`.
pub(crate) fn tick(x: f64, span: f64) -> String {
    // labels are at least a tenth of the span apart
    let decimals = (1.0 - span.abs().max(1e-300).log10()).ceil().clamp(0.0, 12.0) as usize;
    let text = fixed(x, decimals);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

fn minus(text: String) -> String {
    text.replace('-', "\u{2212}")
}

/// Returns the label of an axis from a name and a unit, which may be empty.
pub(crate) fn labelled(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name}, {unit}") }
}

/// Returns a unit as it is shown: nothing for `1`, the unit of a number without unit.
pub(crate) fn shown_unit(unit: &str) -> &str {
    if unit == "1" { "" } else { unit }
}

/// A quantity with its unit, on one line; the unit may be empty.
pub(crate) fn with_unit(text: &str, unit: &str) -> String {
    if unit.is_empty() { text.to_owned() } else { format!("{text}\u{a0}{unit}") }
}

/// A number with four significant digits, in plain notation.
pub fn plain_number(x: f64) -> String {
    if !x.is_finite() {
        return "-".to_owned();
    }
    let digits = if x == 0.0 { 0 } else { x.abs().log10().floor() as i32 };
    if (-4..7).contains(&digits) {
        format!("{x:.*}", (3 - digits).clamp(0, 6) as usize)
    } else {
        format!("{x:.3e}")
    }
}

/// Root mean square of the residual over that of the noise, `sqrt(1 + excess)`, where the excess is the reduced
/// chi-square minus one.
pub(crate) fn multiple(excess: f64) -> f64 {
    // the excess may be below zero, but the root mean square may not
    if excess.is_finite() { (1.0 + excess).max(0.0).sqrt() } else { f64::NAN }
}

/// The root mean square of a residual with this excess, as a multiple of the noise: `2.0 ×`.
pub fn times(excess: f64) -> String {
    with_unit(&number(multiple(excess), 2), "\u{d7}")
}

/// The root mean square of a residual with this excess, in the unit of the channel and as a multiple of the noise.
pub(crate) fn both(excess: f64, noise: f64, unit: &str) -> String {
    format!("{} ({})", with_unit(&number(multiple(excess) * noise, 3), unit), times(excess))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_of_squares_becomes_a_ratio_of_roots() {
        assert_eq!((multiple(0.0), multiple(8.0), multiple(-2.0)), (1.0, 3.0, 0.0));
        assert_eq!(both(8.0, 0.002, "V"), "0.00600\u{a0}V (3.0\u{a0}\u{d7})");
        assert!(multiple(f64::NAN).is_nan());
    }
}

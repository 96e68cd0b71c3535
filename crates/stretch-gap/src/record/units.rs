//! Pairs of units that explain a factor between the simulator and the recording.

use std::f64::consts::{PI, TAU};

use stretch_data::written_unit;

/// Largest relative deviation of a ratio from the factor of a pair of units.
const WITHIN: f64 = 0.01;

/// Pairs (a, b, factor) of units of the same quantity: one b is `factor` times one a.
const PAIRS: [(&str, &str, f64); 24] = [
    ("rpm", "rad/s", 60.0 / TAU),
    ("deg/s", "rad/s", 180.0 / PI),
    ("deg/s", "rpm", 6.0),
    ("rpm", "Hz", 60.0),
    ("rad/s", "Hz", TAU),
    ("deg", "rad", 180.0 / PI),
    ("deg", "turns", 360.0),
    ("rad", "turns", TAU),
    ("mm", "m", 1e3),
    ("cm", "m", 100.0),
    ("mm", "cm", 10.0),
    ("mm", "in", 25.4),
    ("mm/s", "m/s", 1e3),
    ("km/h", "m/s", 3.6),
    ("mV", "V", 1e3),
    ("mA", "A", 1e3),
    ("ms", "s", 1e3),
    ("%", "1", 100.0),
    ("N", "kgf", 9.806_65),
    ("N", "lbf", 4.448_222),
    ("mN m", "N m", 1e3),
    ("kPa", "bar", 100.0),
    ("kPa", "psi", 6.894_757),
    ("Pa", "kPa", 1e3),
];

/// Returns the two units that explain why the simulator's output is `ratio` times the recording.
/// For example, "rpm for rad/s" means that the simulator uses rpm and the recording rad/s. The
/// recording is in `unit`, and `sd` is the relative standard deviation of the ratio. The ratio must
/// match a pair of units within 1 %; if exactly one pair matches within two standard deviations,
/// that pair is accepted as well. Otherwise returns `None`.
pub(crate) fn units(ratio: f64, sd: f64, unit: &str) -> Option<String> {
    let unit = if unit.is_empty() { "1" } else { written_unit(unit) };
    let all = PAIRS.iter().flat_map(|&(a, b, factor)| [(a, b, factor), (b, a, 1.0 / factor)]);
    let apart = |factor: f64| (ratio / factor).ln().abs();
    let own = all.filter(|(_, of, _)| *of == unit);
    let own: Vec<(&str, &str, f64)> = own.filter(|p| apart(p.2) < WITHIN.max(2.0 * sd)).collect();
    let near = own.iter().find(|pair| apart(pair.2) < WITHIN);
    let (simulated, recorded, _) = near.or(own.first().filter(|_| own.len() == 1))?;
    Some(format!("{simulated} for {recorded}"))
}

/// Returns the units of two columns, if a pair of units explains within 1 % that the second is
/// `factor` times the first. `stated` are the units that the columns state, empty if unknown. If
/// they state a unit, the pair contains it; otherwise the result is the first pair of the list.
///
/// ```
/// use stretch_gap::units_of_factor;
/// assert_eq!(units_of_factor(57.3, ["rad", ""]), Some(["rad", "deg"]));
/// assert_eq!(units_of_factor(1000.0, ["", "mV"]), Some(["V", "mV"]));
/// assert_eq!(units_of_factor(1.7, ["", ""]), None);
/// ```
pub fn units_of_factor(factor: f64, stated: [&str; 2]) -> Option<[&'static str; 2]> {
    let stated = stated.map(written_unit);
    let all = PAIRS.iter().flat_map(|&(a, b, f)| [([b, a], f), ([a, b], 1.0 / f)]);
    let near = all.filter(|(_, f)| (factor.abs() / f).ln().abs() < WITHIN);
    let fits = |units: &[&str; 2]| {
        let known = stated.iter().zip(units).filter(|(stated, _)| !stated.is_empty());
        known.clone().count() == 0 || known.clone().any(|(stated, unit)| stated == unit)
    };
    near.map(|(units, _)| units).find(fits)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_told_as_units() {
        let told = |ratio, unit| units(ratio, 0.0, unit);
        assert_eq!(told(9.549, "rad/s").as_deref(), Some("rpm for rad/s"));
        assert_eq!(told(0.1047, "rpm").as_deref(), Some("rad/s for rpm"));
        assert_eq!(told(57.3, "rad").as_deref(), Some("deg for rad"));
        assert_eq!(told(0.01745, "degrees").as_deref(), Some("rad for deg"));
        assert_eq!(told(1000.0, "m").as_deref(), Some("mm for m"));
        assert_eq!(told(1e-3, "mV").as_deref(), Some("V for mV"));
        assert_eq!(told(100.0, "").as_deref(), Some("% for 1"));
        // The first ratio is not within 1 %, and the second unit belongs to another quantity.
        assert_eq!(told(9.8, "rad/s"), None);
        assert_eq!(told(57.3, "mm"), None);
        // The ratio is known to 5 %, and only one pair is close.
        assert_eq!(units(9.8, 0.05, "rad/s").as_deref(), Some("rpm for rad/s"));
    }
}

//! What the name of a column says of its unit.

/// The unit in a column's name as columns spell it: its last part, after an underscore.
///
/// ```
/// use stretch_data::unit;
/// assert_eq!(unit("length_mm"), Some("mm"));
/// assert_eq!(unit("speed_m_per_s"), Some("m_per_s"));
/// assert_eq!(unit("s2"), None);
/// ```
pub fn unit(column: &str) -> Option<&str> {
    let (_, mut unit) = column.rsplit_once('_')?;
    while let Some(head) = column[..column.len() - unit.len()].strip_suffix("_per_") {
        let Some((name, _)) = head.rsplit_once('_') else { break };
        unit = &column[name.len() + 1..];
    }
    Some(unit).filter(|unit| !unit.is_empty())
}

/// The unit of a column as it is written: `N` for `force_n`, `m/s` for `speed_m_per_s`.
///
/// ```
/// use stretch_data::unit_of;
/// assert_eq!(unit_of("length_mm"), "mm");
/// assert_eq!(unit_of("force_n"), "N");
/// assert_eq!(unit_of("acc_m_per_s2"), "m/s^2");
/// ```
pub fn unit_of(column: &str) -> String {
    let factors: Vec<&str> = unit(column).unwrap_or("").split("_per_").map(written_unit).collect();
    factors.join("/")
}

/// A unit without a stroke as people write it, from how columns spell it; any other as it is.
///
/// ```
/// assert_eq!(stretch_data::written_unit("kpa"), "kPa");
/// ```
pub fn written_unit(spelt: &str) -> &str {
    match spelt {
        "n" => "N",
        "kn" => "kN",
        "mn" => "mN",
        "nm" => "N m",
        "nanom" => "nm",
        "m2" => "m^2",
        "s2" => "s^2",
        "v" => "V",
        "mv" => "mV",
        "uv" => "uV",
        "a" => "A",
        "ma" => "mA",
        "w" => "W",
        "pa" => "Pa",
        "hpa" => "hPa",
        "kpa" => "kPa",
        "mpa" => "MPa",
        "hz" => "Hz",
        "khz" => "kHz",
        "k" => "K",
        "degc" => "\u{b0}C",
        "percent" => "%",
        "ohm" => "Ohm",
        "kohm" => "kOhm",
        "t" => "T",
        "mt" => "mT",
        other => other,
    }
}

//! Units and measured quantities, derived from the names of columns.

use Quantity::{Angle, Current, Force, Length, Other, Pressure, Speed, Time, Torque, Voltage};

/// The physical quantity that a column measures, derived from its unit and its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// A length or a position.
    Length,
    /// An angle.
    Angle,
    /// A length or an angle per time.
    Speed,
    /// A force.
    Force,
    /// A torque.
    Torque,
    /// A voltage.
    Voltage,
    /// A current.
    Current,
    /// A pressure.
    Pressure,
    /// A time.
    Time,
    /// Any other quantity that has a unit. The value is the unit as written in column names.
    Other(&'static str),
}

impl Quantity {
    /// Whether the quantity is a force or a torque.
    pub fn is_force(self) -> bool {
        matches!(self, Force | Torque)
    }

    /// Whether the quantity is a length or an angle.
    pub fn is_position(self) -> bool {
        matches!(self, Length | Angle)
    }

    /// Returns the quantity that a column measures.
    ///
    /// If `stated`, a unit that the user gives, is not empty, it determines the quantity. Otherwise the unit in the
    /// last part of the column's name does. If that part is no unit, or a single letter that could also be the index of
    /// a motor, a word in the name determines the quantity.
    ///
    /// ```
    /// use stretch_data::Quantity;
    /// for torque in ["torque_nm", "torque_Nm", "torque_n_m", "load_N_m", "u_nm", "tau", "torque_a"] {
    ///     assert_eq!(Quantity::of(torque, ""), Some(Quantity::Torque), "{torque}");
    /// }
    /// assert_eq!(Quantity::of("position_nm", ""), Some(Quantity::Length));
    /// assert_eq!(Quantity::of("speed_rad_per_s", ""), Some(Quantity::Speed));
    /// assert_eq!(Quantity::of("u", "N m"), Some(Quantity::Torque));
    /// assert_eq!(Quantity::of("u", ""), None);
    /// ```
    pub fn of(column: &str, stated: &str) -> Option<Self> {
        if !stated.is_empty() {
            return Self::of_unit(resolved(column, stated));
        }
        let unit = unit(column).map(|unit| resolved(column, unit));
        let by_name = || words(column).find_map(|word| named(&word));
        match unit.and_then(Self::of_unit) {
            Some(known) if unit.is_some_and(|unit| unit.len() > 1) => Some(known),
            known => by_name().or(known),
        }
    }

    /// Returns the quantity that a unit measures; `None` for an unknown unit. The unit can have the spelling of column
    /// names or a usual spelling.
    fn of_unit(unit: &str) -> Option<Self> {
        let mut factors = unit.split('/').flat_map(|part| part.split("_per_"));
        let known = |text: &str| {
            let text = text.trim();
            let low = text.to_lowercase();
            let row = UNITS.iter().find(|row| row.0 == text).or_else(|| row_of(text));
            row.or_else(|| UNITS.iter().find(|row| row.0 == low)).map(|row| row.2)
        };
        match (known(factors.next()?)?, factors.next().map(known), factors.next()) {
            (one, None, _) => Some(one),
            (Length | Angle, Some(Some(Time)), None) => Some(Speed),
            _ => None,
        }
    }
}

/// One row of the unit table: the spelling in column names, the display form, the quantity, the usual spellings
/// (case-sensitive), and the names in lower case.
type Unit =
    (&'static str, &'static str, Quantity, &'static [&'static str], &'static [&'static str]);

/// All units. Upper and lower case are distinguished where they change the meaning: MPa is listed,
/// mPa is not.
static UNITS: [Unit; 51] = [
    (
        "s",
        "s",
        Time,
        &["s", "S"],
        &["sec", "secs", "second", "seconds", "sekunden", "segundos", "secondes"],
    ),
    (
        "ms",
        "ms",
        Time,
        &["ms"],
        &["msec", "millis", "millisecond", "milliseconds", "millisekunden"],
    ),
    ("us", "us", Time, &["us", "µs", "μs"], &["usec", "micros", "microsecond", "microseconds"]),
    ("ns", "ns", Time, &["ns"], &["nsec", "nanos", "nanosecond", "nanoseconds"]),
    ("min", "min", Time, &["min"], &["mins", "minute", "minutes", "minuten"]),
    ("h", "h", Time, &[], &["hr", "hrs", "hour", "hours", "stunden"]),
    ("d", "d", Time, &[], &["day", "days", "tage", "datenum"]),
    ("s2", "s^2", Other("s2"), &["s^2", "s²", "s2", "s**2"], &[]),
    ("m", "m", Length, &["m", "M"], &[]),
    ("cm", "cm", Length, &["cm"], &[]),
    (
        "mm",
        "mm",
        Length,
        &["mm"],
        &["mm", "millimeter", "millimeters", "millimetre", "millimetres"],
    ),
    ("um", "um", Length, &["um", "µm", "μm"], &[]),
    ("nanom", "nm", Length, &["nm"], &[]),
    ("in", "in", Length, &["in"], &["inch", "inches"]),
    ("m2", "m^2", Other("m2"), &["m^2", "m²"], &[]),
    ("n", "N", Force, &["N"], &["newton", "newtons"]),
    ("kn", "kN", Force, &["kN"], &[]),
    ("mn", "mN", Force, &["mN"], &[]),
    ("nm", "N m", Torque, &["Nm", "N·m", "N m", "N*m", "N.m", "N_m", "n_m"], &[]),
    ("mnm", "mN m", Torque, &["mNm", "mN·m", "mN m", "mN*m", "mN_m"], &[]),
    ("knm", "kN m", Torque, &["kNm", "kN·m", "kN m", "kN*m", "kN_m"], &[]),
    ("v", "V", Voltage, &["V"], &["volt", "volts"]),
    ("mv", "mV", Voltage, &["mV"], &["millivolt", "millivolts"]),
    ("uv", "uV", Voltage, &["uV", "µV", "μV"], &[]),
    ("a", "A", Current, &["A"], &[]),
    ("ma", "mA", Current, &["mA"], &[]),
    ("w", "W", Other("w"), &["W"], &[]),
    ("pa", "Pa", Pressure, &["Pa"], &[]),
    ("hpa", "hPa", Pressure, &["hPa"], &[]),
    ("kpa", "kPa", Pressure, &["kPa"], &["kpa"]),
    ("mpa", "MPa", Pressure, &["MPa"], &[]),
    ("bar", "bar", Pressure, &[], &["bar"]),
    ("mbar", "mbar", Pressure, &[], &["mbar"]),
    ("psi", "psi", Pressure, &[], &["psi"]),
    ("rad", "rad", Angle, &[], &["rad", "radian", "radians"]),
    ("mrad", "mrad", Angle, &[], &["mrad"]),
    ("deg", "deg", Angle, &["°"], &["deg", "degree", "degrees"]),
    ("rpm", "rpm", Speed, &[], &["rpm"]),
    ("hz", "Hz", Other("hz"), &["Hz"], &["hz", "hertz"]),
    ("khz", "kHz", Other("hz"), &["kHz"], &[]),
    ("k", "K", Other("degc"), &["K"], &[]),
    ("degc", "\u{b0}C", Other("degc"), &["°C", "degC", "C"], &[]),
    ("kg", "kg", Other("kg"), &["kg"], &[]),
    ("g", "g", Other("kg"), &["g"], &[]),
    ("percent", "%", Other("percent"), &["%"], &["percent"]),
    ("ohm", "Ohm", Other("ohm"), &["Ω"], &["ohm", "ohms"]),
    ("kohm", "kOhm", Other("ohm"), &["kOhm", "kΩ"], &[]),
    ("t", "T", Other("t"), &["T"], &[]),
    ("mt", "mT", Other("t"), &["mT"], &[]),
    ("counts", "counts", Other("counts"), &[], &["lsb", "count", "counts"]),
    ("ticks", "ticks", Other("ticks"), &[], &["tick", "ticks"]),
];

/// Words in a column's name that determine the quantity if no unit does.
static NAMED: [(Quantity, &[&str]); 5] = [
    (Torque, &["torque", "torques", "moment", "tau"]),
    (Force, &["force", "forces"]),
    (Speed, &["speed", "velocity", "vel", "omega", "qvel", "dq"]),
    (
        Angle,
        &[
            "angle", "angles", "theta", "phi", "heading", "yaw", "pitch", "roll", "azimuth", "q",
            "qpos",
        ],
    ),
    (
        Length,
        &[
            "position",
            "positions",
            "pos",
            "displacement",
            "length",
            "distance",
            "height",
            "stroke",
            "travel",
            "deflection",
            "thickness",
            "gap",
            "x",
            "y",
            "z",
        ],
    ),
];

fn named(word: &str) -> Option<Quantity> {
    NAMED.iter().find(|(_, words)| words.contains(&word)).map(|(quantity, _)| *quantity)
}

/// Splits a name into its words, in lower case and without numbers: `jointAngle_2` gives `joint`,
/// `angle`.
fn words(column: &str) -> impl Iterator<Item = String> {
    let mut parted = String::new();
    for c in column.chars() {
        if c.is_uppercase() && parted.ends_with(char::is_lowercase) {
            parted.push('_');
        }
        parted.extend(c.to_lowercase());
    }
    let all: Vec<String> = parted.split(|c: char| !c.is_alphabetic()).map(str::to_owned).collect();
    all.into_iter().filter(|word| !word.is_empty())
}

fn is_named(column: &str, is_one: impl Fn(Quantity) -> bool) -> bool {
    words(column).filter_map(|word| named(&word)).any(is_one)
}

/// Returns the unit of a column, with `nm` resolved: it means newton metres, unless the name
/// mentions a length and no force. Then the result is `nanom`.
fn resolved<'a>(column: &str, unit: &'a str) -> &'a str {
    let is_length = || is_named(column, |q| q == Length) && !is_named(column, Quantity::is_force);
    if unit == "nm" && is_length() { "nanom" } else { unit }
}

/// Whether the column can be an angle or a quantity that `is_one` accepts: its name and unit indicate no other
/// quantity.
pub(crate) fn measures_nothing_else(column: &str, is_one: impl Fn(Quantity) -> bool) -> bool {
    let is_unknown = unit(column).and_then(Quantity::of_unit).is_none_or(|unit| unit == Angle);
    Quantity::of(column, "").is_none_or(|q| q == Angle || is_unknown && is_one(q))
}

/// Returns the table row of a simple unit (without `/` or `_per_`) from one of its usual spellings.
fn row_of(text: &str) -> Option<&'static Unit> {
    let low = text.to_lowercase();
    let exact = UNITS.iter().find(|row| row.3.contains(&text));
    exact.or_else(|| UNITS.iter().find(|row| row.4.contains(&&*low)))
}

/// Returns the unit in a column's name, as spelled there: the part after the last underscore. A
/// unit with `_per_`, and newton metres written as `n_m`, include the underscores between their
/// parts.
///
/// ```
/// use stretch_data::unit;
/// assert_eq!(unit("length_mm"), Some("mm"));
/// assert_eq!(unit("speed_m_per_s"), Some("m_per_s"));
/// assert_eq!(unit("torque_n_m"), Some("n_m"));
/// assert_eq!(unit("s2"), None);
/// ```
pub fn unit(column: &str) -> Option<&str> {
    let (base, mut unit) = column.rsplit_once('_')?;
    while let Some(head) = column[..column.len() - unit.len()].strip_suffix("_per_") {
        let Some((name, _)) = head.rsplit_once('_') else { break };
        unit = &column[name.len() + 1..];
    }
    let before = base.rsplit_once('_').filter(|_| unit == "m");
    if let Some((name, newton)) = before
        && (matches!(newton, "N" | "kN" | "mN")
            || newton == "n" && is_named(name, Quantity::is_force))
    {
        return Some(&column[name.len() + 1..]);
    }
    Some(unit).filter(|unit| !unit.is_empty())
}

/// Returns the display form of a column's unit: `N` for `force_n`, `m/s` for `speed_m_per_s`.
///
/// `nm` means newton metres, unless the name mentions a length and no force. `nanom` always means
/// nanometres.
///
/// ```
/// use stretch_data::unit_of;
/// assert_eq!(unit_of("length_mm"), "mm");
/// assert_eq!(unit_of("force_n"), "N");
/// assert_eq!(unit_of("acc_m_per_s2"), "m/s^2");
/// assert_eq!([unit_of("torque_nm"), unit_of("torque_Nm"), unit_of("load_N_m")], ["N m"; 3]);
/// assert_eq!(unit_of("height_nm"), "nm");
/// ```
pub fn unit_of(column: &str) -> String {
    let unit = resolved(column, unit(column).unwrap_or(""));
    let factors: Vec<&str> = unit.split("_per_").map(written_unit).collect();
    factors.join("/")
}

/// Returns the display form of a simple unit (without `/` or `_per_`) from its spelling in column names or a usual
/// spelling. An unknown unit is returned unchanged.
///
/// ```
/// assert_eq!(stretch_data::written_unit("kpa"), "kPa");
/// assert_eq!(stretch_data::written_unit("degrees"), "deg");
/// ```
pub fn written_unit(spelt: &str) -> &str {
    UNITS.iter().find(|row| row.0 == spelt).or_else(|| row_of(spelt)).map_or(spelt, |row| row.1)
}

/// Returns the spelling in column names of a simple unit (without `/` or `_per_`) from one of its usual spellings.
/// Returns `None` if the text is no unit.
///
/// ```
/// use stretch_data::spelt_unit;
/// assert_eq!([spelt_unit("N·m"), spelt_unit("Seconds"), spelt_unit("nm")], [Some("nm"), Some("s"), Some("nanom")]);
/// assert_eq!(spelt_unit("raw"), None);
/// ```
pub fn spelt_unit(text: &str) -> Option<&'static str> {
    row_of(text.trim()).map(|row| row.0)
}

/// Converts a text to lower-case letters, digits and underscores.
///
/// ```
/// assert_eq!(stretch_data::snake_case("Knee Angle (L)"), "knee_angle_l");
/// ```
pub fn snake_case(text: &str) -> String {
    let mut name = String::new();
    for c in text.trim().chars() {
        if c.is_alphanumeric() {
            name.extend(c.to_lowercase());
        } else if !name.is_empty() && !name.ends_with('_') {
            name.push('_');
        }
    }
    name.trim_end_matches('_').to_owned()
}

/// Returns the column that a user means by `wanted`: the column with this name; otherwise the only column whose name
/// differs in upper and lower case or in punctuation; otherwise the only one whose name is `wanted` followed by a unit.
///
/// ```
/// use stretch_data::column_meant;
/// let names = ["time_s", "voltage_v", "knee_angle_deg", "force_n", "force_kn"];
/// assert_eq!(column_meant("Voltage", names), Some("voltage_v"));
/// assert_eq!(column_meant("Knee Angle", names), Some("knee_angle_deg"));
/// assert_eq!(column_meant("FORCE_N", names), Some("force_n"));
/// assert_eq!(column_meant("force", names), None);
/// assert_eq!(column_meant("voltage_mv", names), None);
/// ```
pub fn column_meant<'a>(wanted: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let names: Vec<&str> = names.into_iter().collect();
    let plain = snake_case(wanted);
    let only = |is_one: &dyn Fn(&str) -> bool| {
        let mut found = names.iter().copied().filter(|name| is_one(name));
        found.next().filter(|_| !plain.is_empty() && found.next().is_none())
    };
    let without_unit = |name: &str| {
        let unit = unit(name).filter(|unit| Quantity::of_unit(unit).is_some())?;
        Some(snake_case(&name[..name.len() - unit.len()]))
    };
    let exact = names.iter().copied().find(|name| *name == wanted);
    exact
        .or_else(|| only(&|name| snake_case(name) == plain))
        .or_else(|| only(&|name| without_unit(name).is_some_and(|name| name == plain)))
}

//! Interprets the names of columns: reads units in brackets or in a separate row, and recognises names of the time.

use stretch_data::{snake_case, spelt_unit};

use crate::TimeUnit;

/// Usual names of a time column, the likeliest first.
const TIMES: [&str; 39] = [
    "time_s",
    "time",
    "t",
    "t_s",
    "time_ms",
    "t_ms",
    "time_us",
    "t_us",
    "time_ns",
    "t_ns",
    "timestamp",
    "timestamp_s",
    "timestamp_ms",
    "timestamp_us",
    "timestamp_ns",
    "timestamps",
    "time_stamp",
    "stamp",
    "seconds",
    "sec",
    "secs",
    "elapsed",
    "elapsed_s",
    "elapsed_time",
    "elapsed_time_s",
    "millis",
    "micros",
    "datetime",
    "date_time",
    "utc",
    "zeit",
    "zeit_s",
    "zeit_ms",
    "ms",
    "us",
    "zeitstempel",
    "horodatage",
    "fecha_hora",
    "date",
];

/// Words for time. If only one name contains such a word, it is the time. German `zeit` also counts at the end of a
/// longer word.
const TIME_WORDS: [&str; 12] = [
    "time",
    "timestamp",
    "timestamps",
    "elapsed",
    "zeit",
    "tiempo",
    "temps",
    "tempo",
    "tijd",
    "tid",
    "czas",
    "uptime",
];
/// Endings of the names of two columns that together are a stamp, as in ROS: whole seconds, and the nanoseconds within
/// the second.
const WHOLE_SECONDS: [&str; 3] = ["sec", "secs", "seconds"];
const NANOSECONDS: [&str; 5] = ["nsec", "nsecs", "nanosec", "nanosecs", "nanoseconds"];
/// Name of the time column in tables written by LabVIEW.
const LABVIEW_TIME: &str = "x_value";

/// Returns a unit in the project's notation: `mm`, `n`, `m_per_s2`, `percent`. The result is empty for a pure number
/// and `None` if the text is not a unit.
pub(crate) fn unit(text: &str) -> Option<String> {
    let text = text.trim();
    if matches!(text, "" | "-" | "1" | "--") {
        return Some(String::new());
    }
    let mut parts = text.split('/');
    // Oscilloscopes give sample numbers the unit `sequence`.
    let spell = |part: &str| {
        let is_number = part.trim().eq_ignore_ascii_case("sequence");
        if is_number { Some("") } else { spelt_unit(part) }
    };
    let mut spelt = spell(parts.next()?)?.to_owned();
    for part in parts {
        spelt.push_str("_per_");
        spelt.push_str(spell(part)?);
    }
    Some(spelt)
}

/// Converts a name to lower case with an underscore between its words: `time_us` for `TimeUS`, `t_ms` for `t (ms)`.
pub(crate) fn words(name: &str) -> String {
    let mut parted = String::new();
    for c in name.chars() {
        if c.is_uppercase() && parted.ends_with(char::is_lowercase) {
            parted.push('_');
        }
        parted.push(c);
    }
    snake_case(&parted)
}

/// Converts a column's name to the project's notation: `pos_mm` for `Pos (mm)`, `force_n` for `force[N]`. Other names
/// stay as they are.
///
/// ```
/// use stretch_recording::tidy_column;
/// assert_eq!(tidy_column("Pos (mm)"), "pos_mm");
/// assert_eq!(tidy_column("length_mm"), "length_mm");
/// ```
pub fn tidy_column(name: &str) -> String {
    tidy(name, None).unwrap_or_else(|| name.to_owned())
}

/// Returns a name with its unit as the last part. The unit comes from the name, as in `Pos (mm)`, `force[N]` or `pos,
/// mm`, or from the row below it. Returns `None` if neither contains a unit.
pub(crate) fn tidy(name: &str, below: Option<&str>) -> Option<String> {
    let (base, unit) = match below.filter(|b| !b.is_empty()) {
        Some(below) => (name, unit(unbracketed(below))?),
        None => bracketed(name)?,
    };
    let base = snake_case(base);
    Some(match &unit[..] {
        _ if base.is_empty() => return None,
        "" => base,
        unit if base.rsplit_once('_').is_some_and(|(_, last)| last == unit) => base,
        unit => format!("{base}_{unit}"),
    })
}

/// Splits a name into the part before its unit, and the unit.
fn bracketed(name: &str) -> Option<(&str, String)> {
    let name = name.trim();
    for (open, close) in [('(', ')'), ('[', ']'), ('{', '}')] {
        if let Some((base, rest)) = name.strip_suffix(close).and_then(|n| n.rsplit_once(open)) {
            // The brackets in `q[1]` contain an index.
            let is_index = rest.bytes().all(|byte| byte.is_ascii_digit());
            return Some((base, unit(rest).filter(|_| !is_index || rest.is_empty())?));
        }
    }
    let (base, rest) = name.rsplit_once(", ").or_else(|| name.rsplit_once(" / "))?;
    Some((base, unit(rest)?))
}

fn unbracketed(text: &str) -> &str {
    text.trim().trim_start_matches(['(', '[', '{']).trim_end_matches([')', ']', '}'])
}

/// Returns whether a row contains units: each field is a unit or empty, and at least one is a unit.
pub(crate) fn are_units<'a>(fields: impl Iterator<Item = &'a str>) -> bool {
    let mut any = false;
    for field in fields {
        match unit(unbracketed(field)) {
            None => return false,
            Some(unit) => any |= !unit.is_empty(),
        }
    }
    any
}

/// Returns the rank of a name among the usual names of the time, 0 for the likeliest. Returns `None` if it is not one
/// of them.
pub(crate) fn time_rank(name: &str) -> Option<usize> {
    let name = words(name);
    let known = |name: &str| TIMES.iter().position(|time| *time == name);
    let is_unit = |word: &str| TimeUnit::of(word).is_some();
    let of_unit = || name.rsplit_once('_').filter(|(_, last)| is_unit(last)).map(|(base, _)| base);
    // A long unit such as `milliseconds` is a time. A short one such as `d` may be anything.
    let is_word = || name.len() > 3 && !name.contains('_') && is_unit(&name);
    known(&name)
        .or_else(|| known(of_unit()?).map(|rank| TIMES.len() + rank))
        .or_else(|| (name == LABVIEW_TIME || is_word()).then_some(2 * TIMES.len()))
}

/// Returns whether two columns together are a time stamp, such as `header.stamp.secs` and `header.stamp.nsecs`.
pub(crate) fn are_a_stamp(seconds: &str, nanoseconds: &str) -> bool {
    let of = |name: &str, ends: &[&str]| {
        let name = snake_case(name);
        let (before, last) = name.rsplit_once('_').unwrap_or(("", &name));
        ends.contains(&last).then(|| before.to_owned())
    };
    of(seconds, &WHOLE_SECONDS).is_some_and(|stamp| of(nanoseconds, &NANOSECONDS) == Some(stamp))
}

/// Returns whether a name contains a word for time.
pub(crate) fn may_be_time(name: &str) -> bool {
    words(name).split('_').any(|word| TIME_WORDS.contains(&word) || word.ends_with("zeit"))
}

/// Returns the group of channels that a clock with this name belongs to: `imu` for `imu_t`, `t_imu` or `imu/time_s`,
/// and empty if the name contains no group. Returns `None` if the name is not that of a clock.
pub(crate) fn clock_of(name: &str) -> Option<String> {
    let (group, last) = name.rsplit_once(['/', '.']).unwrap_or(("", name));
    let within = |tag: &str| match (group, tag) {
        (group, "") => group.to_owned(),
        ("", tag) => tag.to_owned(),
        (group, tag) => format!("{group}/{tag}"),
    };
    let last = snake_case(last);
    if time_rank(&last).is_some() {
        return Some(within(""));
    }
    let (mut best, mut tag) = (0, None);
    for time in TIMES {
        let tail = last.strip_suffix(time).and_then(|tag| tag.strip_suffix('_'));
        let head = last.strip_prefix(time).and_then(|tag| tag.strip_prefix('_'));
        // In a longer name, `us` and `ms` are the unit of another quantity.
        let found = tail.or(head).filter(|_| !matches!(time, "us" | "ms"));
        if let Some(found) = found.filter(|f| !f.is_empty() && time.len() > best) {
            (best, tag) = (time.len(), Some(found));
        }
    }
    tag.map(within)
}

#[cfg(test)]
mod tests {
    use super::{are_units, clock_of, may_be_time, tidy, time_rank};

    #[test]
    fn units_come_out_of_brackets_and_rows() {
        for (name, below, tidied) in [
            ("Pos (mm)", None, Some("pos_mm")),
            ("force[N]", None, Some("force_n")),
            ("Knee Angle [°]", None, Some("knee_angle_deg")),
            ("Torque (N·m)", None, Some("torque_nm")),
            ("Torque [Nm]", None, Some("torque_nm")),
            ("Torque (mNm)", None, Some("torque_mnm")),
            ("Height (nm)", None, Some("height_nanom")),
            ("Acc X (m/s^2)", None, Some("acc_x_m_per_s2")),
            ("Weg / mm", None, Some("weg_mm")),
            ("Pos", Some("mm"), Some("pos_mm")),
            ("pos_mm", Some("[mm]"), Some("pos_mm")),
            ("ratio (-)", None, Some("ratio")),
            ("Time (Seconds)", None, Some("time_s")),
            ("Tiempo (segundos)", None, Some("tiempo_s")),
            ("clock [Millis]", None, Some("clock_ms")),
            ("t (S)", None, Some("t_s")),
            ("Stress (MPa)", None, Some("stress_mpa")),
            ("Pressure (mPa)", None, None),
            ("q[1]", None, None),
            ("Trial (2)", None, None),
            ("CH1", Some("Volt"), Some("ch1_v")),
            ("X", Some("Sequence"), Some("x")),
            ("pos (raw)", None, None),
            ("pos_mm", None, None),
            ("s2", Some(""), None),
        ] {
            assert_eq!(tidy(name, below).as_deref(), tidied, "{name}");
        }
    }

    #[test]
    fn a_row_of_units_is_one() {
        assert!(are_units(["s", "mm", "[N]", ""].into_iter()));
        assert!(!are_units(["", "", "-"].into_iter()));
        assert!(!are_units(["s", "oops"].into_iter()));
    }

    #[test]
    fn clocks_say_whose_they_are() {
        for (name, of) in [
            ("t", Some("")),
            ("imu_t", Some("imu")),
            ("t_imu", Some("imu")),
            ("imu/time_s", Some("imu")),
            ("arm.imu_time_s", Some("arm/imu")),
            ("length_mm", None),
            ("status", None),
            ("current_ms", None),
        ] {
            assert_eq!(clock_of(name).as_deref(), of, "{name}");
        }
        assert!(time_rank("Time") < time_rank("Timestamp"));
        for name in ["TimeUS", "elapsedTime", "timestampMs", "time_h", "Days", "t_min"] {
            assert!(time_rank(name).is_some(), "{name}");
        }
        assert!(time_rank("Zeitstempel").is_some() && time_rank("date") > time_rank("time"));
        assert!(time_rank("d").is_none() && time_rank("current_ms").is_none());
        for name in ["time_seconds", "elapsed_ms", "Timestamp (us)", "X_Value", "zeit_sec"] {
            assert!(time_rank(name).is_some(), "{name}");
        }
        for name in ["rel_time", "Prüfzeit (s)", "Time since start (s)", "Unit_A_Timestamp_CAL"] {
            assert!(may_be_time(name), "{name}");
        }
        assert!(!may_be_time("timer_count") && !may_be_time("length_mm"));
    }
}

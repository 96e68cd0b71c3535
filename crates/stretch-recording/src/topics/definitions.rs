//! Definitions of ROS 2 messages, as bags carry them beside the messages (`ros2msg`).

/// What a field holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Bool,
    Signed(usize),
    Unsigned(usize),
    Float(usize),
    Text,
    WideText,
    /// Another definition of the same schema.
    Message(usize),
}

/// How many of it a field holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Count {
    One,
    Fixed(usize),
    /// As many as the message says.
    Any,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Field {
    pub(crate) name: String,
    pub(crate) kind: Kind,
    pub(crate) count: Count,
}

/// Messages of a schema; the first is the schema's own.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Schema {
    pub(crate) messages: Vec<Vec<Field>>,
}

impl Schema {
    /// Parses a schema `name` (`sensor_msgs/msg/JointState`): its fields, then those of the messages within it, each behind
    /// a line of `=` and a line `MSG: package/Name`.
    pub(crate) fn parse(name: &str, text: &str) -> Result<Self, String> {
        let mut parts: Vec<(String, Vec<&str>)> = vec![(short(name), Vec::new())];
        for line in text.lines() {
            let line = line.trim();
            if line.len() > 3 && line.bytes().all(|b| b == b'=') {
                continue;
            }
            if let Some(name) = line.strip_prefix("MSG:") {
                parts.push((short(name.trim()), Vec::new()));
            } else if let Some((_, lines)) = parts.last_mut() {
                lines.push(line);
            }
        }
        for builtin in ["Time", "Duration"] {
            let name = format!("builtin_interfaces/{builtin}");
            if !parts.iter().any(|(part, _)| *part == name) {
                parts.push((name, vec!["int32 sec", "uint32 nanosec"]));
            }
        }
        let names: Vec<&str> = parts.iter().map(|(name, _)| name.as_str()).collect();
        let fields = |(own, lines): &(String, Vec<&str>)| {
            lines.iter().filter_map(|line| field(line, own, &names).transpose()).collect()
        };
        Ok(Self { messages: parts.iter().map(fields).collect::<Result<_, String>>()? })
    }
}

/// `package/Name`, without the folder that ROS 2 puts between.
fn short(name: &str) -> String {
    name.replace("/msg/", "/")
}

/// A line of a definition; none where it holds no field.
fn field(line: &str, own: &str, names: &[&str]) -> Result<Option<Field>, String> {
    let line = line.split('#').next().unwrap_or_default();
    let mut words = line.split_whitespace();
    let (Some(kind), Some(name)) = (words.next(), words.next()) else { return Ok(None) };
    // TYPE NAME=VALUE is a constant.
    if name.contains('=') || words.next().is_some_and(|word| word.starts_with('=')) {
        return Ok(None);
    }
    let (kind, count) = match kind.split_once('[') {
        None => (kind, Count::One),
        Some((kind, bound)) => match bound.trim_end_matches(']') {
            bound if bound.is_empty() || bound.starts_with("<=") => (kind, Count::Any),
            bound => {
                let count =
                    bound.parse().map_err(|_| format!("{bound} is no length of an array"))?;
                (kind, Count::Fixed(count))
            }
        },
    };
    let kind = match kind.split("<=").next().unwrap_or(kind) {
        "bool" => Kind::Bool,
        "byte" | "char" | "uint8" => Kind::Unsigned(1),
        "int8" => Kind::Signed(1),
        "int16" => Kind::Signed(2),
        "uint16" => Kind::Unsigned(2),
        "int32" => Kind::Signed(4),
        "uint32" => Kind::Unsigned(4),
        "int64" => Kind::Signed(8),
        "uint64" => Kind::Unsigned(8),
        "float32" => Kind::Float(4),
        "float64" => Kind::Float(8),
        "string" => Kind::Text,
        "wstring" => Kind::WideText,
        other => Kind::Message(message(other, own, names)?),
    };
    Ok(Some(Field { name: name.to_owned(), kind, count }))
}

/// Which definition a type is: `package/Name`, or `Name` in the package of the message that uses it.
fn message(kind: &str, own: &str, names: &[&str]) -> Result<usize, String> {
    let full = match (short(kind), own.split_once('/')) {
        (kind, Some((package, _))) if !kind.contains('/') => format!("{package}/{kind}"),
        (kind, _) => kind,
    };
    let is_it = |name: &str| name == full || (full == "std_msgs/Header" && name == "Header");
    names
        .iter()
        .position(|name| is_it(name))
        .ok_or_else(|| format!("the schema does not say what {kind} is"))
}

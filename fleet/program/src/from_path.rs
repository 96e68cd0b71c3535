//! Site, rig, sensor and date from the path of a file.

use std::{path::Path, str::FromStr};

/// A pattern of the last parts of a path: `{site}/{rig}/{sensor}/{date}_*.csv`. `*` matches
/// anything within a part.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Pattern(Vec<Vec<Piece>>);

#[derive(Debug, Clone, PartialEq)]
enum Piece {
    /// Literal text.
    Text(String),
    /// Anything.
    Any,
    /// The value of the column of this place in site, rig, sensor, date.
    Column(usize),
}

const COLUMNS: [&str; 4] = ["site", "rig", "sensor", "date"];

impl FromStr for Pattern {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts: Result<Vec<_>, _> = text.split('/').map(pieces).collect();
        let parts = parts?;
        for (i, column) in COLUMNS.iter().enumerate() {
            if parts.iter().flatten().filter(|piece| **piece == Piece::Column(i)).count() > 1 {
                return Err(format!("{{{column}}} stands in it twice"));
            }
        }
        Ok(Self(parts))
    }
}

fn pieces(part: &str) -> Result<Vec<Piece>, String> {
    let (mut found, mut rest) = (Vec::new(), part);
    while let Some(next) = rest.find(['{', '*']) {
        if next > 0 {
            found.push(Piece::Text(rest[..next].to_owned()));
        }
        if rest[next..].starts_with('*') {
            found.push(Piece::Any);
            rest = &rest[next + 1..];
            continue;
        }
        let (name, behind) = rest[next + 1..]
            .split_once('}')
            .ok_or_else(|| format!("a {{ of {part:?} has no }} behind it"))?;
        let column = COLUMNS.iter().position(|column| *column == name);
        let column = column.ok_or_else(|| {
            format!("{{{name}}} is none of {{site}}, {{rig}}, {{sensor}} and {{date}}")
        })?;
        found.push(Piece::Column(column));
        rest = behind;
    }
    if !rest.is_empty() {
        found.push(Piece::Text(rest.to_owned()));
    }
    let open = |piece: &Piece| !matches!(piece, Piece::Text(_));
    if found.windows(2).any(|pair| open(&pair[0]) && open(&pair[1])) {
        return Err(format!(
            "nothing stands between two of the names in {part:?}: where would one end?"
        ));
    }
    Ok(found)
}

impl Pattern {
    /// What a path says of site, rig, sensor and date; `None` if it does not match the pattern.
    pub(crate) fn read(&self, path: &Path) -> Option<[Option<String>; 4]> {
        let parts: Vec<_> = path.components().map(|c| c.as_os_str().to_string_lossy()).collect();
        let last = parts.len().checked_sub(self.0.len()).map(|from| &parts[from..])?;
        let mut found = [const { None }; 4];
        for (pieces, part) in self.0.iter().zip(last) {
            fits(pieces, part, &mut found)?;
        }
        Some(found)
    }
}

/// An open piece ends at the first occurrence of the text behind it; the last one ends with the
/// part.
fn fits(pieces: &[Piece], part: &str, found: &mut [Option<String>; 4]) -> Option<()> {
    let Some((piece, rest)) = pieces.split_first() else {
        return part.is_empty().then_some(());
    };
    if let Piece::Text(text) = piece {
        return fits(rest, part.strip_prefix(text.as_str())?, found);
    }
    let end = match rest.first() {
        Some(Piece::Text(text)) if rest.len() == 1 => {
            part.ends_with(text.as_str()).then(|| part.len() - text.len())?
        }
        Some(Piece::Text(text)) => part.find(text.as_str())?,
        _ => part.len(),
    };
    if let Piece::Column(column) = piece {
        found[*column] = Some(part[..end].to_owned());
    }
    fits(rest, &part[end..], found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(pattern: &str, path: &str) -> Option<[Option<String>; 4]> {
        pattern.parse::<Pattern>().unwrap().read(Path::new(path))
    }

    #[test]
    fn a_path_says_where_a_trial_stands() {
        let found =
            read("{site}/{rig}/{sensor}/{date}_*.csv", "/logs/ulm/r2/0042/20260103_a_b.csv");
        let told = ["ulm", "r2", "0042", "20260103"].map(|x| Some(x.to_owned()));
        assert_eq!(found, Some(told));
        let found = read("sleeve-{sensor}-{date}.csv", "sleeve-a-7-2026-01-03.csv").unwrap();
        // the first occurrence of the text behind a name ends the name
        assert_eq!(found[2].as_deref(), Some("a"));
        assert_eq!(found[3].as_deref(), Some("7-2026-01-03"));
        assert_eq!(read("{site}/{sensor}.csv", "ulm/7.npz"), None);
        assert_eq!(read("{site}/{rig}/{sensor}.csv", "r2/7.csv"), None);
    }

    #[test]
    fn a_pattern_that_cannot_be_read_says_why() {
        let refused = |text: &str| text.parse::<Pattern>().unwrap_err();
        assert!(refused("{sensr}.csv").contains("{sensr} is none of"));
        assert!(refused("{sensor.csv").contains("has no }"));
        assert!(refused("{sensor}{date}.csv").contains("where would one end"));
        assert!(refused("{date}/{date}.csv").contains("twice"));
    }
}

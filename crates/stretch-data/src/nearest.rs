//! The name that somebody may have meant.

/// The candidate nearest to `name` by edit distance, when it is near enough to be meant:
/// at most two edits and less than half of the name, letter case apart.
///
/// ```
/// let names = ["time_s", "length_mm", "bridge_v"];
/// assert_eq!(stretch_data::nearest("lenght_mm", names), Some("length_mm"));
/// assert_eq!(stretch_data::nearest("pressure_kpa", names), None);
/// ```
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    const LONGEST: usize = 64;
    let name: Vec<char> = name.to_lowercase().chars().take(LONGEST).collect();
    candidates
        .into_iter()
        .map(|candidate| {
            let other: Vec<char> = candidate.to_lowercase().chars().take(LONGEST).collect();
            (distance(&name, &other), candidate)
        })
        .filter(|(edits, _)| *edits <= 2 && 2 * edits < name.len().max(1))
        .min_by_key(|(edits, _)| *edits)
        .map(|(_, candidate)| candidate)
}

/// Levenshtein's distance, one row at a time; a swap of neighbours costs two.
fn distance(a: &[char], b: &[char]) -> usize {
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

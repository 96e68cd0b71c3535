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
    // a longer name is nobody's, and the distance takes the product of two lengths
    let short = |text: &str| text.to_lowercase().chars().take(64).collect::<String>();
    let name = short(name);
    let near = candidates.into_iter().map(|one| (strsim::levenshtein(&name, &short(one)), one));
    near.filter(|(edits, _)| *edits <= 2 && 2 * edits < name.chars().count().max(1))
        .min_by_key(|(edits, _)| *edits)
        .map(|(_, one)| one)
}

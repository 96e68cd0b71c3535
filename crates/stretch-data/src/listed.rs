//! Names joined into a phrase.

/// Names joined into a phrase: `a, b and c`, and `nothing` for no name.
///
/// ```
/// assert_eq!(stretch_data::listed(&["a", "b", "c"]), "a, b and c");
/// assert_eq!(stretch_data::listed::<&str>(&[]), "nothing");
/// ```
pub fn listed<S: AsRef<str>>(names: &[S]) -> String {
    let [all @ .., last] = names else { return "nothing".to_owned() };
    let all: Vec<&str> = all.iter().map(AsRef::as_ref).collect();
    match all[..] {
        [] => last.as_ref().to_owned(),
        _ => format!("{} and {}", all.join(", "), last.as_ref()),
    }
}

/// As [`listed`], but a list that is longer than `most + 1` names ends in the number of further names.
///
/// ```
/// assert_eq!(stretch_data::listed_up_to(2, &["a", "b", "c", "d"]), "a, b and 2 more");
/// assert_eq!(stretch_data::listed_up_to(2, &["a", "b", "c"]), "a, b and c");
/// ```
pub fn listed_up_to<S: AsRef<str>>(most: usize, names: &[S]) -> String {
    let mut shown: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
    let more = format!("{} more", names.len().saturating_sub(most));
    if names.len() > most + 1 {
        shown.truncate(most);
        shown.push(&more);
    }
    listed(&shown)
}

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

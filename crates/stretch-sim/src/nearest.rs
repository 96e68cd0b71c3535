//! Suggestions in messages about unknown names.

/// The candidate that was probably meant.
pub(crate) fn nearest<'a>(
    name: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<String> {
    stretch_data::nearest(name, candidates).map(str::to_string)
}

/// The words that offer a suggestion, empty when there is none.
pub(crate) fn suggestion(nearest: &Option<String>) -> String {
    nearest.as_ref().map_or_else(String::new, |n| format!("; did you mean `{n}`?"))
}

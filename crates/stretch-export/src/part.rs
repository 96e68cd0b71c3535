//! What a model gives to a header.

/// A model in C: its record as constants, and its step over them.
#[derive(Debug)]
pub(crate) struct Part {
    /// As `linear`, `observer+rest`.
    pub(crate) model: String,
    /// The record.
    pub(crate) constants: String,
    /// The step, in the order of the file.
    pub(crate) step: Vec<&'static str>,
    /// What of the step there is, where it has parts: the words behind its `@if`.
    pub(crate) has: Vec<&'static str>,
}

/// The lines of a text that there are: between `@if this that` and its `@end` if one of those is in `has`.
pub(crate) fn kept(text: &str, has: &[&str]) -> String {
    // whether each block that is open is there
    let mut open: Vec<bool> = Vec::new();
    let mut out = String::new();
    for line in text.split_inclusive('\n') {
        if let Some(any) = line.strip_prefix("@if ") {
            open.push(any.split_whitespace().any(|word| has.contains(&word)));
        } else if line.trim_end() == "@end" {
            open.pop();
        } else if !open.contains(&false) {
            out.push_str(line);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_is_kept_where_one_of_its_words_is_there() {
        let text = "a\n@if x y\nb\n@if z\nc\n@end\nd\n@end\ne\n";
        assert_eq!(kept(text, &[]), "a\ne\n");
        assert_eq!(kept(text, &["z"]), "a\ne\n");
        assert_eq!(kept(text, &["y"]), "a\nb\nd\ne\n");
        assert_eq!(kept(text, &["x", "z"]), "a\nb\nc\nd\ne\n");
    }
}

//! Keys, numbers and texts as TOML spells them.

use toml::Value;

/// A key as TOML spells it.
pub(crate) fn key_text(key: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !key.is_empty() && key.chars().all(bare) {
        key.to_owned()
    } else {
        Value::String(key.to_owned()).to_string()
    }
}

/// A number as TOML spells it, with the fewest digits that read back to the same bits.
pub(crate) fn number_text(value: f64) -> String {
    Value::Float(value).to_string()
}

/// A text as TOML spells it.
pub(crate) fn string_text(text: &str) -> String {
    Value::String(text.to_owned()).to_string()
}

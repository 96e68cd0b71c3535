//! Serialization to TOML with comments.

use std::{collections::BTreeMap, mem};

use serde::Serialize;
use stretch_core::label::is_hidden;
use toml_edit::{Item, Table};

/// Comments for the entries of a rig file or a problem file.
///
/// ```
/// use stretch_data::{Remarks, RigFile};
/// let rig = RigFile::parse("rig.toml", "[muscle]\ntau_m = { value = 0.03 }")?;
/// let mut remarks = Remarks::default();
/// remarks.head.push("Found on Monday.".into());
/// remarks.parameters.insert(("muscle".into(), "tau_m".into()), "lag, s".into());
/// let text = rig.to_toml_with(&remarks);
/// assert_eq!(text, "# Found on Monday.\n\n[muscle]\ntau_m = { value = 0.03 } # lag, s\n");
/// assert_eq!(RigFile::parse("copy", &text)?, rig);
/// # Ok::<(), stretch_data::DataError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Remarks {
    /// Comment lines at the top of the file.
    pub head: Vec<String>,
    /// Comments after parameters. The key is (stage, name) in a rig file, (`parameter`, name) in a
    /// problem file, and (effect, name) for a parameter of an effect.
    pub parameters: BTreeMap<(String, String), String>,
    /// Comment lines above an effect, by the effect's name.
    pub effects: BTreeMap<String, Vec<String>>,
}

impl Remarks {
    /// Serializes a value to TOML with these comments. Top-level tables have a header each; tables
    /// inside them are written inline. Numbers read back to the same bits.
    ///
    /// # Panics
    /// Never for structs and maps of numbers, strings and lists.
    pub fn write(&self, value: &impl Serialize) -> String {
        let mut document = toml_edit::ser::to_document(value).expect("a table");
        for (key, item) in document.iter_mut() {
            if !item.is_array() {
                *item = mem::take(item).into_table().map_or_else(|value| value, Item::Table);
            }
            with_header(item, &mut |table| self.comment(table, &key));
        }
        let head: String = self.head.iter().map(|line| toml_comment(line)).collect();
        let gap = if head.is_empty() || document.iter().any(|(_, item)| item.is_value()) {
            ""
        } else {
            "\n"
        };
        format!("{head}{gap}{document}")
    }

    /// Adds the comments of a table. `owner` is the key of the table, or the effect whose argument
    /// the table is.
    fn comment(&self, table: &mut Table, owner: &str) {
        let name = table.get("name").and_then(Item::as_str).map(str::to_owned);
        if let Some((mut key, lines)) =
            name.as_ref().and_then(|name| table.key_mut("name").zip(self.effects.get(name)))
        {
            key.leaf_decor_mut()
                .set_prefix(lines.iter().map(|line| toml_comment(line)).collect::<String>());
        }
        let own = name.as_deref().unwrap_or(owner);
        for (key, item) in table.iter_mut() {
            with_header(item, &mut |inner| self.comment(inner, own));
            let owners = [(own, key.get()), (owner, own), (own, own)];
            let places = if key == "value" { &owners[..] } else { &owners[..1] };
            let find = |(owner, name): &(&str, &str)| {
                self.parameters.get(&((*owner).into(), (*name).into()))
            };
            if let (Some(remark), Some(value)) = (places.iter().find_map(find), item.as_value_mut())
            {
                value.decor_mut().set_suffix(format!(" {}", toml_comment(remark).trim_end()));
            }
        }
    }
}

/// Turns a list of tables into tables with headers, and calls `each` with each of them or with a
/// single table.
fn with_header(item: &mut Item, each: &mut dyn FnMut(&mut Table)) {
    *item = mem::take(item).into_array_of_tables().map_or_else(|item| item, Item::ArrayOfTables);
    match item {
        Item::Table(table) => each(table),
        Item::ArrayOfTables(tables) => tables.iter_mut().for_each(each),
        _ => {}
    }
}

/// Returns a text as one comment line. Line breaks and other control characters become spaces.
///
/// ```
/// assert_eq!(stretch_data::toml_comment("deg\nname = 'b'"), "# deg name = 'b'\n");
/// ```
pub fn toml_comment(text: &str) -> String {
    let text: String = text.chars().map(|c| if is_hidden(c) { ' ' } else { c }).collect();
    format!("# {text}\n")
}

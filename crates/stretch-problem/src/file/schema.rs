//! The keys of a problem's file as a reference for people and as a schema for editors.

use std::fmt::Write;

use serde_json::{Map, Value, json};

use super::keys::{ALL, Holds, Keys, TOP};

impl Holds {
    fn words(self) -> String {
        match self {
            Self::Text => "text".into(),
            Self::Texts => "texts".into(),
            Self::Number => "number".into(),
            Self::Count => "whole number".into(),
            Self::Flag => "true or false".into(),
            Self::Range => "two numbers".into(),
            Self::Tolerance => "number, or text with %".into(),
            Self::OneOf(all) => all.join(", "),
            Self::Names => "texts by name".into(),
            Self::Simulator => "texts, or a table".into(),
            Self::Tables(name) => format!("tables `[[{name}]]`"),
        }
    }

    fn schema(self) -> Value {
        let texts = json!({ "type": "array", "items": { "type": "string" } });
        match self {
            Self::Text => json!({ "type": "string" }),
            Self::Texts => json!({ "oneOf": [{ "type": "string" }, texts] }),
            Self::Number => json!({ "type": "number" }),
            Self::Count => json!({ "type": "integer", "minimum": 1 }),
            Self::Flag => json!({ "type": "boolean" }),
            Self::Range => {
                json!({ "type": "array", "items": { "type": "number" }, "minItems": 2, "maxItems": 2 })
            }
            Self::Tolerance => {
                json!({ "oneOf": [{ "type": "number", "minimum": 0 }, { "type": "string", "pattern": "%$" }] })
            }
            Self::OneOf(all) => json!({ "enum": all }),
            Self::Names => {
                json!({ "type": "object", "additionalProperties": { "type": "string" } })
            }
            Self::Simulator => json!({ "oneOf": [texts, { "$ref": "#/$defs/simulator" }] }),
            Self::Tables(name) => {
                json!({ "type": "array", "items": { "$ref": format!("#/$defs/{name}") } })
            }
        }
    }
}

impl Keys {
    fn schema(&self) -> Map<String, Value> {
        let mut properties = Map::new();
        for key in self.keys {
            let mut one = key.holds.schema();
            one["description"] = key.words.into();
            properties.insert(key.name.to_owned(), one);
        }
        let needed: Vec<&str> = self.keys.iter().filter(|k| k.is_needed).map(|k| k.name).collect();
        let mut out = Map::new();
        out.insert("type".into(), "object".into());
        out.insert("description".into(), self.words.into());
        out.insert("properties".into(), properties.into());
        out.insert("required".into(), needed.into());
        let others = if self.is_open { json!({ "type": "number" }) } else { false.into() };
        out.insert("additionalProperties".into(), others);
        out
    }
}

/// The JSON Schema of a problem's file, for editors.
///
/// ```
/// let schema = stretch_problem::problem_schema();
/// assert_eq!(schema["$defs"]["trial"]["required"][0], "file");
/// assert_eq!(schema["properties"]["time_unit"]["enum"][1], "ms");
/// ```
pub fn problem_schema() -> Value {
    let mut out = TOP.schema();
    let tables = ALL.iter().filter(|table| !table.name.is_empty());
    let definitions: Map<String, Value> =
        tables.map(|table| (table.name.to_owned(), table.schema().into())).collect();
    out.insert("$schema".into(), "https://json-schema.org/draft/2020-12/schema".into());
    out.insert("title".into(), "problem.toml of stretch".into());
    out.insert("$defs".into(), definitions.into());
    Value::Object(out)
}

/// The reference of a problem's file as Markdown: every table, and every key in it.
pub fn problem_reference() -> String {
    let mut out = String::new();
    for table in ALL {
        let head = match table.name {
            "" => "At the top".to_owned(),
            "simulator" => "`[simulator]`".to_owned(),
            "argument" => "`[[effect.argument]]`".to_owned(),
            name => format!("`[[{name}]]`"),
        };
        // Writing to a String does not fail.
        let _ = write!(
            out,
            "## {head}\n\n{}\n\n| key | holds | what |\n| --- | --- | --- |\n",
            table.words
        );
        for key in table.keys {
            let holds = key.holds.words();
            let needed = if key.is_needed { " (needed)" } else { "" };
            let _ = writeln!(out, "| `{}` | {holds}{needed} | {} |", key.name, key.words);
        }
        out.push('\n');
    }
    out.trim_end().to_owned() + "\n"
}

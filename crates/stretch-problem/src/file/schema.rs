//! The keys of a problem's file as a schema for editors and as a reference for people, both derived
//! from [`ProblemSpec`].

use std::fmt::Write;

use schemars::{
    Schema,
    generate::SchemaSettings,
    transform::{Transform, transform_subschemas},
};
use serde_json::{Value, json};

use crate::black_box::spec::ProblemSpec;

/// The JSON Schema of a problem's file, for editors.
///
/// ```
/// let schema = stretch_problem::problem_schema();
/// assert_eq!(schema["$defs"]["TrialFile"]["required"][0], "file");
/// assert_eq!(schema["properties"]["budget"]["minimum"], 1);
/// ```
pub fn problem_schema() -> Value {
    let settings = SchemaSettings::draft2020_12().with_transform(AsInToml);
    settings.into_generator().into_root_schema_for::<ProblemSpec>().to_value()
}

/// Adapts a schema to TOML, which has no null, and to our reader, which takes a single text for a list of texts.
#[derive(Debug, Clone)]
struct AsInToml;

impl Transform for AsInToml {
    fn transform(&mut self, schema: &mut Schema) {
        transform_subschemas(self, schema);
        adapt(schema);
    }
}

fn adapt(schema: &mut Schema) {
    let is_null = |value: &Value| value == "null" || value["type"] == "null";
    let texts = json!({ "type": "array", "items": { "type": "string" } });
    let may_be_text =
        ["type", "items", "minItems"].into_iter().all(|key| schema.get(key) == texts.get(key));
    if may_be_text {
        schema.remove("type");
        schema.remove("items");
        schema.insert("oneOf".into(), json!([{ "type": "string" }, texts]));
    }
    let Some(object) = schema.as_object_mut() else { return };
    for key in ["format", "default"] {
        object.remove(key);
    }
    for key in ["type", "enum", "anyOf"] {
        let Some(Value::Array(all)) = object.get_mut(key) else { continue };
        all.retain(|one| !is_null(one));
        match (key, &mut all[..]) {
            ("type", [one]) => object["type"] = one.take(),
            ("anyOf", [Value::Object(one)]) => {
                let one = std::mem::take(one);
                object.remove(key);
                object.extend(one);
            }
            _ => {}
        }
    }
}

/// The reference of a problem's file as Markdown: every table, and every key in it.
pub fn problem_reference() -> String {
    let schema = problem_schema();
    let mut out = String::new();
    table(&mut out, &schema, &schema, "");
    out.trim_end().to_owned() + "\n"
}

/// Writes a table of the file and the tables in it; `path` is its key.
fn table(out: &mut String, root: &Value, schema: &Value, path: &str) {
    let head = match path {
        "" => "At the top".to_owned(),
        "simulator" | "card" | "plan" => format!("`[{path}]`"),
        path => format!("`[[{path}]]`"),
    };
    let text = |value: &Value| value.as_str().unwrap_or_default().replace('\n', " ");
    let words = text(&schema["description"]);
    // Writing to a String does not fail.
    let _ = write!(out, "## {head}\n\n{words}\n\n| key | type | meaning |\n| --- | --- | --- |\n");
    let is_needed = |key: &String| {
        schema["required"].as_array().is_some_and(|all| all.iter().any(|one| one == key))
    };
    let mut keys: Vec<(&String, &Value)> =
        schema["properties"].as_object().into_iter().flatten().collect();
    keys.sort_by_key(|(key, _)| !is_needed(key));
    let mut tables = Vec::new();
    for (key, value) in keys {
        let mut inner = Vec::new();
        let needed = if is_needed(key) { " (needed)" } else { "" };
        let _ = writeln!(
            out,
            "| `{key}` | {}{needed} | {} |",
            holds(root, value, &mut inner),
            text(&value["description"])
        );
        let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        tables.extend(inner.into_iter().map(|schema| (path.clone(), schema)));
    }
    if schema["additionalProperties"].is_object() {
        out.push_str("| any other | number | Value of the parameter of that name. |\n");
    }
    out.push('\n');
    for (path, schema) in tables {
        table(out, root, schema, &path);
    }
}

/// Describes the value of a key in words; adds the schemas of tables in it to `tables`.
fn holds<'a>(root: &'a Value, schema: &'a Value, tables: &mut Vec<&'a Value>) -> String {
    if let Some(name) = schema["$ref"].as_str().and_then(|path| path.strip_prefix('#')) {
        return holds(root, root.pointer(name).unwrap_or(&Value::Null), tables);
    }
    let names = |all: &Value, name: fn(&Value) -> Option<&str>| {
        all.as_array()?.iter().map(name).collect::<Option<Vec<_>>>().map(|all| all.join(", "))
    };
    let names = names(&schema["enum"], Value::as_str)
        .or_else(|| names(&schema["oneOf"], |one| one["const"].as_str()));
    if let Some(names) = names {
        return names;
    }
    match schema["type"].as_str() {
        Some("string") => "text".into(),
        Some("integer") => "whole number".into(),
        Some("boolean") => "true or false".into(),
        Some("array") if schema["maxItems"].is_number() => "two numbers".into(),
        Some("array") => holds(root, &schema["items"], tables) + "s",
        Some("object") => {
            if schema["properties"].is_object() {
                tables.push(schema);
            }
            "table".into()
        }
        Some(other) => other.into(),
        None => {
            let all = schema["oneOf"].as_array().into_iter().flatten();
            all.map(|one| holds(root, one, tables)).collect::<Vec<_>>().join(", or ")
        }
    }
}

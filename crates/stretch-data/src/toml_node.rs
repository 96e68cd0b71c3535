//! A value of a TOML file as serde reads it, and what serde refuses in words for people.

use std::fmt::Display;

use serde::{
    Deserializer,
    de::{
        Error, Expected, IntoDeserializer, Unexpected, Visitor,
        value::{MapDeserializer, SeqDeserializer},
    },
    forward_to_deserialize_any,
};
use toml::de::DeValue;

use crate::nearest::nearest;

/// A value; a single text stands for a list of one text, and every number is finite.
#[derive(Clone, Copy)]
pub(crate) struct Node<'de>(pub(crate) &'de DeValue<'de>);

impl<'de> IntoDeserializer<'de, Refusal> for Node<'de> {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

impl<'de> Deserializer<'de> for Node<'de> {
    type Error = Refusal;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refusal> {
        match self.0 {
            DeValue::String(text) => visitor.visit_borrowed_str(text),
            DeValue::Integer(n) => match i64::from_str_radix(n.as_str(), n.radix()) {
                Ok(n) => visitor.visit_i64(n),
                Err(_) => Err(Refusal::custom(format!("{n} has too many digits"))),
            },
            DeValue::Float(x) => match x.as_str().parse::<f64>() {
                Ok(x) if x.is_finite() => visitor.visit_f64(x),
                _ => Err(Refusal::custom(format!("{x} is not a finite number"))),
            },
            DeValue::Boolean(flag) => visitor.visit_bool(*flag),
            DeValue::Datetime(date) => {
                Err(Refusal::custom(format!("{date} is not {}", words(&visitor))))
            }
            DeValue::Array(items) => visitor
                .visit_seq(SeqDeserializer::new(items.iter().map(|item| Node(item.get_ref())))),
            DeValue::Table(table) => {
                let entries =
                    table.iter().map(|(key, value)| (&**key.get_ref(), Node(value.get_ref())));
                visitor.visit_map(MapDeserializer::new(entries))
            }
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refusal> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        visitor: V,
    ) -> Result<V::Value, Refusal> {
        visitor.visit_newtype_struct(self)
    }

    /// A derived struct would take a list for its fields in order.
    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Refusal> {
        match self.0 {
            DeValue::Array(_) => Err(Refusal::invalid_type(Unexpected::Seq, &visitor)),
            _ => self.deserialize_any(visitor),
        }
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refusal> {
        match self.0 {
            DeValue::String(_) => visitor.visit_seq(SeqDeserializer::new([self].into_iter())),
            DeValue::Table(_) => {
                Err(Refusal::custom("this is one table; write a table in double brackets for each"))
            }
            _ => self.deserialize_any(visitor),
        }
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        names: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Refusal> {
        match self.0 {
            DeValue::String(text) => visitor.visit_enum((&**text).into_deserializer()),
            _ => Err(Refusal::custom(format!("write one of {}", names.join(", ")))),
        }
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit
        unit_struct tuple tuple_struct map identifier ignored_any
    }
}

/// Why serde refuses a value.
#[derive(Debug)]
pub(crate) struct Refusal {
    /// The key that is missing, where that is why.
    pub(crate) missing: Option<&'static str>,
    pub(crate) problem: String,
}

impl Display for Refusal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.problem)
    }
}

impl std::error::Error for Refusal {}

impl Error for Refusal {
    fn custom<T: Display>(problem: T) -> Self {
        Self { missing: None, problem: problem.to_string() }
    }

    fn invalid_type(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        let found = match found {
            Unexpected::Str(text) => format!("{text:?}"),
            Unexpected::Float(x) => format!("{x:?}"),
            Unexpected::Signed(n) => n.to_string(),
            Unexpected::Bool(flag) => flag.to_string(),
            Unexpected::Seq => "a list".to_owned(),
            Unexpected::Map => "a table".to_owned(),
            other => other.to_string(),
        };
        // what is expected may say where the value goes: write { value = ... }
        Self::custom(format!("{found} is not {}", words(expected).replace("...", &found)))
    }

    fn invalid_value(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::invalid_type(found, expected)
    }

    fn missing_field(field: &'static str) -> Self {
        Self { missing: Some(field), problem: "it is missing".to_owned() }
    }

    fn unknown_field(field: &str, known: &'static [&'static str]) -> Self {
        Self::custom(format!(
            "nothing reads it{}; known are {}",
            meant(field, known),
            known.join(", ")
        ))
    }

    fn unknown_variant(variant: &str, known: &'static [&'static str]) -> Self {
        let known_names = known.join(", ");
        Self::custom(format!("{variant:?} is none of {known_names}{}", meant(variant, known)))
    }
}

fn meant(given: &str, known: &[&str]) -> String {
    nearest(given, known.iter().copied())
        .map_or(String::new(), |one| format!(" (did you mean {one}?)"))
}

/// What serde expects, in words for people.
fn words(expected: &dyn Expected) -> String {
    let expected = expected.to_string();
    match expected.as_str() {
        "f64" => "a number",
        "usize" => "a whole number from 0 on",
        "a nonzero usize" => "a whole number from 1 on",
        "a boolean" => "true or false",
        "a string" | "path string" => "a text in quotation marks",
        "a sequence" => "a list in brackets, or tables under headers in double brackets",
        "a map" => "a table",
        table if table.starts_with("struct ") => "a table",
        other => other,
    }
    .to_owned()
}

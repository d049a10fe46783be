//! The schema of settings: keys, types and ranges, all in the JSON schema that follows from Rust types and attributes.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;
use toml::de::{DeTable, DeValue};

use crate::error::nearest;
use crate::recipe::fault::{Fault, KeyPath};

/// Returns the JSON schema of settings, the source of all keys, types and ranges.
pub fn of<T: JsonSchema>() -> Value {
    schemars::schema_for!(T).to_value()
}

/// Finds the first value out of its range in settings of a preset that were built in code instead of read.
pub(crate) fn check<T: JsonSchema + Serialize>(settings: &T, path: &KeyPath) -> Result<(), Fault> {
    let text = toml::to_string(settings).expect("settings can be written as TOML");
    let table = DeTable::parse(&text).expect("what was written is TOML").into_inner();
    let schema = of::<T>();
    SchemaCheck::new("preset", &schema).check(&schema, &DeValue::Table(table), path)
}

/// Finds the first fault in the written text of a recipe: a key that is unknown or missing, or a value of a wrong type
/// or out of its range. `what` is the kind of the recipe, as in `terrane schema`.
pub(crate) fn check_table(what: &str, schema: &Value, table: &DeValue) -> Result<(), Fault> {
    SchemaCheck::new(what, schema).check(schema, table, &KeyPath::default())
}

struct SchemaCheck<'a> {
    root: &'a Value,
    /// Hint for faults without a hint of their own.
    hint: String,
}

impl<'a> SchemaCheck<'a> {
    fn new(what: &str, root: &'a Value) -> SchemaCheck<'a> {
        SchemaCheck { root, hint: format!("keys and their meanings: terrane schema {what}") }
    }

    /// Follows a schema that refers to another one, or that is a union with null, to the schema with the actual form.
    fn resolved(&self, schema: &'a Value) -> &'a Value {
        if let Some(reference) = schema["$ref"].as_str() {
            let name = reference.rsplit('/').next().expect("there is a first part");
            return &self.root["$defs"][name];
        }
        match schema["anyOf"].as_array() {
            Some(any) => self.resolved(any.iter().find(|one| one["type"] != "null").expect("one is not null")),
            None => schema,
        }
    }

    fn check(&self, schema: &'a Value, value: &DeValue, path: &KeyPath) -> Result<(), Fault> {
        let schema = self.resolved(schema);
        if schema["oneOf"].is_array() {
            return self.check_word(schema, value, path);
        }
        let kind = match &schema["type"] {
            Value::Array(kinds) => kinds.iter().find(|kind| *kind != "null").unwrap_or(&Value::Null),
            kind => kind,
        };
        match (kind.as_str(), value) {
            (Some("object"), DeValue::Table(table)) => self.check_keys(schema, table, path),
            (Some("array"), DeValue::Array(values)) => {
                self.check_length(schema, values.len(), path)?;
                let mut values = values.iter().enumerate();
                values.try_for_each(|(index, value)| self.check(&schema["items"], value.get_ref(), &path.index(index)))
            }
            (Some("number"), DeValue::Integer(_) | DeValue::Float(_)) | (Some("integer"), DeValue::Integer(_)) => {
                check_range(schema, value, path)
            }
            (Some("string"), DeValue::String(text)) => check_letters(schema, text, path),
            (Some("boolean"), DeValue::Boolean(_)) => Ok(()),
            (kind, _) => {
                let expected = match kind {
                    Some("object") => "a table",
                    Some("array") => "a list",
                    Some("number") => "a number",
                    Some("integer") => "a whole number",
                    Some("boolean") => "true or false",
                    Some("string") => "a text",
                    _ => "nothing",
                };
                Err(path.fault(format!("expected {expected}"), &*self.hint).found(described(value)))
            }
        }
    }

    fn check_keys(&self, schema: &'a Value, table: &DeTable, path: &KeyPath) -> Result<(), Fault> {
        let known = schema["properties"].as_object().expect("a table has keys");
        let names = || known.keys().map(String::as_str);
        for (key, value) in table {
            let name = key.get_ref().as_ref();
            let Some(schema) = known.get(name) else {
                let message = format!("there is no such key here, but {}", names().collect::<Vec<_>>().join(", "));
                let meant = nearest(name, names()).map(|meant| format!("did you mean {meant}?"));
                return Err(path.key(name).fault(message, meant.unwrap_or_else(|| self.hint.clone())).at_key());
            };
            self.check(schema, value.get_ref(), &path.key(name))?;
        }
        let mut required = schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str);
        match required.find(|key| !table.contains_key(*key)) {
            Some(key) => Err(path.fault(format!("the key {key} is missing"), "add it to this table")),
            None => Ok(()),
        }
    }

    /// Checks a value that must be one of a few words.
    fn check_word(&self, schema: &Value, value: &DeValue, path: &KeyPath) -> Result<(), Fault> {
        let words: Vec<&str> =
            schema["oneOf"].as_array().into_iter().flatten().filter_map(|word| word["const"].as_str()).collect();
        match value {
            DeValue::String(word) if words.contains(&word.as_ref()) => Ok(()),
            _ => {
                let meant = value.as_str().and_then(|word| nearest(word, words.iter().copied()));
                let hint = meant.map_or_else(|| self.hint.clone(), |meant| format!("did you mean {meant}?"));
                let quoted: Vec<String> = words.iter().map(|word| format!("\"{word}\"")).collect();
                Err(path.fault(format!("expected {}", quoted.join(" or ")), hint).found(described(value)))
            }
        }
    }

    fn check_length(&self, schema: &Value, length: usize, path: &KeyPath) -> Result<(), Fault> {
        let bound = |key: &str, without: usize| schema[key].as_u64().map_or(without, |bound| bound as usize);
        let (least, most) = (bound("minItems", 0), bound("maxItems", usize::MAX));
        if (least..=most).contains(&length) {
            return Ok(());
        }
        let expected = match (least, most) {
            (least, most) if least == most => format!("a list of {least}"),
            (0, most) => format!("a list of at most {most}"),
            (least, most) => format!("a list of {least} to {most}"),
        };
        Err(path.fault(format!("expected {expected}"), &*self.hint).found(format!("one of {length}")))
    }
}

fn check_letters(schema: &Value, text: &str, path: &KeyPath) -> Result<(), Fault> {
    let most = schema["maxLength"].as_u64().map_or(usize::MAX, |most| most as usize);
    match text.chars().count() {
        count if count > most => {
            Err(path.fault(format!("expected a text of at most {most} letters"), "").found(format!("one of {count}")))
        }
        _ => Ok(()),
    }
}

fn check_range(schema: &Value, value: &DeValue, path: &KeyPath) -> Result<(), Fault> {
    let (low, high) = (&schema["minimum"], &schema["maximum"]);
    let (number, whole) = match value {
        DeValue::Integer(whole) => {
            // A number that does not fit into 128 bits is out of every range.
            let whole = i128::from_str_radix(whole.as_str(), whole.radix()).unwrap_or(i128::MAX);
            (whole as f64, Some(whole))
        }
        DeValue::Float(number) => (number.as_str().parse().unwrap_or(f64::NAN), None),
        _ => unreachable!("only numbers have ranges"),
    };
    let whole_bound = |bound: &Value| bound.as_i64().map(i128::from).or(bound.as_u64().map(i128::from));
    let inside = if let (Some(whole), Some(low), Some(high)) = (whole, whole_bound(low), whole_bound(high)) {
        (low..=high).contains(&whole)
    } else {
        let bound = |bound: &Value| bound.as_f64().expect("every number has its bounds");
        (bound(low)..=bound(high)).contains(&number)
    };
    if inside {
        return Ok(());
    }
    let shown = |bound: &Value| match (whole_bound(bound), bound.as_f64()) {
        (Some(whole), _) => whole.to_string(),
        (None, number) => number.unwrap_or(f64::NAN).to_string(),
    };
    Err(path.fault(format!("expected {} to {}", shown(low), shown(high)), "").found(described(value)))
}

/// Number of characters that are enough to recognize a text.
const SHOWN: usize = 60;

/// Describes a value as its author wrote it.
fn described(value: &DeValue) -> String {
    match value {
        DeValue::String(text) if text.chars().count() > SHOWN => {
            format!("\"{}...\"", text.chars().take(SHOWN).collect::<String>())
        }
        DeValue::String(text) => format!("\"{text}\""),
        DeValue::Integer(whole) => whole.to_string(),
        DeValue::Float(number) => {
            let text = number.as_str();
            text.parse::<f64>().map_or(text.to_owned(), |number| number.to_string())
        }
        DeValue::Boolean(truth) => truth.to_string(),
        DeValue::Datetime(date) => format!("the date {date}"),
        DeValue::Array(_) => "a list".to_owned(),
        DeValue::Table(_) => "a table".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::preset::Preset;

    /// Collects every number of a preset: its path, its schema and its description.
    fn numbers<'a>(
        check: &SchemaCheck<'a>,
        schema: &'a Value,
        path: &str,
        found: &mut Vec<(String, &'a Value, String)>,
    ) {
        let described = schema["description"].as_str().unwrap_or_default().to_owned();
        collect(check, schema, path, &described, found);
    }

    fn collect<'a>(
        check: &SchemaCheck<'a>,
        schema: &'a Value,
        path: &str,
        about: &str,
        found: &mut Vec<(String, &'a Value, String)>,
    ) {
        let schema = check.resolved(schema);
        for (key, value) in schema["properties"].as_object().into_iter().flatten() {
            numbers(check, value, &format!("{path}.{key}"), found);
        }
        if !schema["items"].is_null() {
            collect(check, &schema["items"], &format!("{path}[]"), about, found);
        }
        let is = |kind: &str| {
            schema["type"] == kind || schema["type"].as_array().is_some_and(|kinds| kinds.iter().any(|one| one == kind))
        };
        if is("number") || is("integer") {
            found.push((path.to_owned(), schema, about.to_owned()));
        }
    }

    /// Formats 1234.5 as 1,234.5, as numbers are written in the documentation. (Four digits stay ungrouped.)
    fn grouped(bound: &Value) -> String {
        let text = bound.as_f64().unwrap().to_string();
        let (whole, rest) = text.split_once('.').map_or((&text[..], String::new()), |(a, b)| (a, format!(".{b}")));
        let digits = whole.trim_start_matches('-');
        let mut grouped = String::new();
        for (index, digit) in digits.chars().enumerate() {
            if index > 0 && digits.len() > 4 && (digits.len() - index) % 3 == 0 {
                grouped.push(',');
            }
            grouped.push(digit);
        }
        format!("{}{grouped}{rest}", if whole.starts_with('-') { "-" } else { "" })
    }

    #[test]
    fn every_number_has_bounds_and_its_documentation_says_them() {
        let schema = of::<Preset>();
        let mut found = Vec::new();
        numbers(&SchemaCheck::new("preset", &schema), &schema, "", &mut found);
        assert!(found.len() > 70, "{} numbers", found.len());
        // The seed may be any number.
        for (path, number, about) in found.into_iter().filter(|(path, ..)| path != ".seed") {
            let (low, high) = (&number["minimum"], &number["maximum"]);
            assert!(low.is_number() && high.is_number(), "{path} has no bounds: {number}");
            let said = format!("{} to {}", grouped(low), grouped(high));
            assert!(about.contains(&said), "{path}: {said:?} is not in {about:?}");
        }
    }
}

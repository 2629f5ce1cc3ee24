//! JSON Schema of scenes, by which editors complete and check them (`PROGRAM schema`).

use schemars::generate::SchemaSettings;
use schemars::{Schema, SchemaGenerator};
use serde_json::{Value, json};

use super::{INPUTS, REPORT, VERSION};
use crate::report::Quantity;

/// Returns the schema (draft 7, which editors of TOML read) of the scenes of a program: one of the types that
/// `alternatives` asks the generator for, with the `version` that every scene begins with. An expectation's
/// `quantity` is one of `quantities`.
///
/// ```
/// #[derive(schemars::JsonSchema)]
/// #[serde(deny_unknown_fields)]
/// struct Scene {
///     /// Distance of particles.
///     spacing: polycore::units::Length,
/// }
/// let schema = harness::scene::schema("example", &[], |generator| vec![generator.subschema_for::<Scene>()]);
/// let spacing = &schema["definitions"]["Scene"]["properties"]["spacing"];
/// assert_eq!(spacing["description"], "Distance of particles.");
/// assert_eq!(schema["definitions"]["Scene"]["required"][0], "version");
/// ```
pub fn schema(
    program: &str,
    quantities: &[&[Quantity]],
    alternatives: impl FnOnce(&mut SchemaGenerator) -> Vec<Schema>,
) -> Value {
    let mut generator = SchemaSettings::draft07().into_generator();
    let alternatives = alternatives(&mut generator);
    let mut definitions = generator.take_definitions(true);
    for alternative in &alternatives {
        let name = alternative.get("$ref").and_then(Value::as_str).and_then(|path| path.rsplit('/').next());
        if let Some(scene) = name.and_then(|name| definitions.get_mut(name)) {
            add_version(scene);
        }
    }
    definitions.values_mut().for_each(drop_null);
    if let Some(expect) = definitions.get_mut("Expect") {
        name_quantities(expect, quantities);
    }
    json!({
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": format!("Scene of `{program}`, version {VERSION}"),
        "anyOf": alternatives,
        "definitions": definitions,
    })
}

/// Lists what a report can have, with units and descriptions; a quotient of two is any text.
fn name_quantities(expect: &mut Value, quantities: &[&[Quantity]]) {
    let one = |quantity: &Quantity| {
        let Quantity { name, unit, about } = quantity;
        let description = if unit.is_empty() { (*about).to_owned() } else { format!("{about} [{unit}]") };
        match name.contains('{') {
            false => json!({ "const": name, "description": description }),
            true => json!({ "pattern": regex(name), "title": name, "description": description }),
        }
    };
    let mut choices: Vec<Value> = quantities.iter().flat_map(|list| *list).map(one).collect();
    let description = "with studies, a name with that of the study; or \"NAME / NAME\"";
    choices.push(json!({ "type": "string", "description": description }));
    if let Some(quantity) = expect.pointer_mut("/properties/quantity").and_then(Value::as_object_mut) {
        quantity.remove("type");
        quantity.insert("anyOf".to_owned(), choices.into());
    }
}

/// Returns a name with places in braces as a regular expression.
fn regex(name: &str) -> String {
    let pieces: Vec<&str> = name.split(['{', '}']).collect();
    let piece = |(index, piece): (usize, &&str)| match index % 2 {
        0 => piece.replace(['.', '[', ']'], "."),
        _ => ".+".to_owned(),
    };
    format!("^{}$", pieces.iter().enumerate().map(piece).collect::<String>())
}

/// The keys that [`super::Source::parse`] checks and removes.
fn add_version(scene: &mut Value) {
    let version = json!({ "const": VERSION, "description": "The version of the scene format." });
    scene["properties"]["version"] = version;
    scene["properties"][INPUTS] = json!({
        "type": "object",
        "additionalProperties": { "type": "string" },
        "description": "Scenes whose results this one reads: NAME = \"PATH of the scene, relative to \
                        this one\".",
    });
    scene["properties"][REPORT] = json!({
        "type": "object",
        "additionalProperties": false,
        "properties": {
            "values": { "type": "array", "items": { "type": "string" } },
            "units": { "type": "array", "items": { "type": "string" } },
        },
        "description": "Values to show first in the terminal and on the page: names, or patterns with `*`; \
                        a name without its variant stands for those of all variants. Units to show them in, \
                        such as N, mm, MPa; by default those that the scene uses most.",
    });
    match scene["required"].as_array_mut() {
        Some(required) => required.insert(0, json!("version")),
        None => scene["required"] = json!(["version"]),
    }
}

/// TOML has no null: what is optional is left out.
fn drop_null(schema: &mut Value) {
    let null = json!({ "type": "null" });
    match schema {
        Value::Array(items) => items.iter_mut().for_each(drop_null),
        Value::Object(keys) => {
            if let Some(Value::Array(types)) = keys.get_mut("type") {
                types.retain(|name| name != "null");
            }
            if let Some(Value::Array(choices)) = keys.get_mut("anyOf") {
                choices.retain(|choice| *choice != null);
            }
            keys.values_mut().for_each(drop_null);
        }
        _ => {}
    }
}

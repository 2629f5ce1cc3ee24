//! JSON Schema of scenes, by which editors complete and check them (`PROGRAM schema`).

use schemars::generate::SchemaSettings;
use schemars::{Schema, SchemaGenerator};
use serde_json::{Value, json};

use super::VERSION;

/// The schema (draft 7, which editors of TOML read) of the scenes of a program: one of the types that `alternatives`
/// asks the generator for, with the `version` that every scene begins with.
///
/// ```
/// #[derive(schemars::JsonSchema)]
/// #[serde(deny_unknown_fields)]
/// struct Scene {
///     /// Distance of particles.
///     spacing: polycore::units::Length,
/// }
/// let schema = polycore::scene::schema("example", |generator| vec![generator.subschema_for::<Scene>()]);
/// let spacing = &schema["definitions"]["Scene"]["properties"]["spacing"];
/// assert_eq!(spacing["description"], "Distance of particles.");
/// assert_eq!(schema["definitions"]["Scene"]["required"][0], "version");
/// ```
pub fn schema(program: &str, alternatives: impl FnOnce(&mut SchemaGenerator) -> Vec<Schema>) -> Value {
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
    json!({
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": format!("Scene of `{program}`, version {VERSION}"),
        "anyOf": alternatives,
        "definitions": definitions,
    })
}

/// The key that [`super::Source::parse`] checks and removes.
fn add_version(scene: &mut Value) {
    let version = json!({ "const": VERSION, "description": "The version of the scene format." });
    scene["properties"]["version"] = version;
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

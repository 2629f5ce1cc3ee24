//! `PROGRAM schema`: it accepts every case, describes keys, and finds mistakes.

use crate::program::{command, finish, workspace};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

const PROGRAMS: [&str; 4] = ["crystfem", "mdsurrogate", "peri", "polycore"];

/// Returns the schema that a program prints.
fn schema(program: &str) -> Value {
    let ended = finish(command(program, "schema", workspace()).spawn().unwrap()).with_code(0);
    serde_json::from_str(&ended.stdout).unwrap()
}

/// Lists the cases of a program.
fn cases(program: &str) -> Vec<(PathBuf, Value)> {
    let folders = |path: PathBuf| fs::read_dir(path).into_iter().flatten().map(|entry| entry.unwrap().path());
    let files = folders(workspace().join("cases")).flat_map(folders).map(|folder| folder.join("case.toml"));
    files
        .filter_map(|file| {
            let text = fs::read_to_string(&file).ok()?;
            let scene = serde_json::to_value(toml::from_str::<toml::Table>(&text).unwrap()).unwrap();
            (scene["program"] == program).then_some((file, scene))
        })
        .collect()
}

/// Checks a value against the part of draft 7 that the schemas use, patterns aside. The schemas were also
/// checked with Python's `jsonschema`.
fn faults(root: &Value, schema: &Value, value: &Value, place: &str, faults: &mut Vec<String>) {
    let known = [
        "$ref",
        "$schema",
        "additionalProperties",
        "allOf",
        "anyOf",
        "const",
        "default",
        "definitions",
        "description",
        "enum",
        "examples",
        "format",
        "items",
        "maxItems",
        "minItems",
        "minimum",
        "maximum",
        "oneOf",
        "pattern",
        "properties",
        "required",
        "title",
        "type",
    ];
    let Some(keys) = schema.as_object() else {
        if *schema == json!(false) {
            faults.push(format!("{place}: nothing is allowed"));
        }
        return;
    };
    let unknown: Vec<&String> = keys.keys().filter(|key| !known.contains(&key.as_str())).collect();
    assert!(unknown.is_empty(), "{place}: this test knows no {unknown:?}");
    let mut say = |text: String| faults.push(format!("{place}: {text}"));
    if let Some(types) = keys.get("type") {
        let names: Vec<&str> = types
            .as_array()
            .map_or_else(|| vec![types], |list| list.iter().collect())
            .iter()
            .filter_map(|t| t.as_str())
            .collect();
        let is = |name: &str| match name {
            "object" => value.is_object(),
            "array" => value.is_array(),
            "string" => value.is_string(),
            "boolean" => value.is_boolean(),
            // TOML has no null: it was NaN or infinite
            "number" => value.is_number() || value.is_null(),
            "integer" => value.is_i64() || value.is_u64(),
            other => panic!("{place}: type {other}"),
        };
        if !names.iter().any(|name| is(name)) {
            say(format!("{value} is no {names:?}"));
        }
    }
    if keys.get("const").is_some_and(|constant| constant != value) {
        say(format!("{value} is not {}", keys["const"]));
    }
    if keys.get("enum").and_then(Value::as_array).is_some_and(|allowed| !allowed.contains(value)) {
        say(format!("{value} is none of {}", keys["enum"]));
    }
    let mut inner = Vec::new();
    if let Some(reference) = keys.get("$ref").and_then(Value::as_str) {
        let target = root.pointer(reference.trim_start_matches('#')).expect(reference);
        self::faults(root, target, value, place, &mut inner);
    }
    for part in keys.get("allOf").and_then(Value::as_array).into_iter().flatten() {
        self::faults(root, part, value, place, &mut inner);
    }
    for choices in ["anyOf", "oneOf"].iter().filter_map(|key| keys.get(*key)?.as_array()) {
        let tried: Vec<Vec<String>> = choices
            .iter()
            .map(|choice| {
                let mut faults = Vec::new();
                self::faults(root, choice, value, place, &mut faults);
                faults
            })
            .collect();
        if tried.iter().all(|faults| !faults.is_empty()) {
            inner.extend(tried.into_iter().min_by_key(Vec::len).unwrap());
        }
    }
    if let Some(object) = value.as_object() {
        let properties = keys.get("properties").and_then(Value::as_object);
        for (key, value) in object {
            let place = format!("{place}.{key}");
            match (properties.and_then(|p| p.get(key)), keys.get("additionalProperties")) {
                (Some(schema), _) | (None, Some(schema)) => {
                    self::faults(root, schema, value, &place, &mut inner)
                }
                (None, None) => {}
            }
        }
        for key in keys.get("required").and_then(Value::as_array).into_iter().flatten() {
            if !object.contains_key(key.as_str().unwrap()) {
                inner.push(format!("{place}: {key} is missing"));
            }
        }
    }
    if let (Some(items), Some(list)) = (keys.get("items").filter(|items| items.is_object()), value.as_array())
    {
        for (index, value) in list.iter().enumerate() {
            self::faults(root, items, value, &format!("{place}[{index}]"), &mut inner);
        }
    }
    faults.extend(inner);
}

fn check(schema: &Value, scene: &Value) -> Vec<String> {
    let mut found = Vec::new();
    faults(schema, schema, scene, "scene", &mut found);
    found
}

#[test]
fn every_case_is_valid() {
    for program in PROGRAMS {
        let schema = schema(program);
        let cases = cases(program);
        assert!(cases.len() >= 3, "{program}");
        for (file, scene) in cases {
            let found = check(&schema, &scene);
            assert!(found.is_empty(), "{}:\n{}", file.display(), found.join("\n"));
        }
    }
}

#[test]
fn slips_are_found() {
    let schema = schema("peri");
    let file = workspace().join("cases/ch2/dent/case.toml");
    let good: toml::Table = toml::from_str(&fs::read_to_string(file).unwrap()).unwrap();
    let good = serde_json::to_value(good).unwrap();
    let mut slips: Vec<(&str, Value)> = vec![("/body/spacing", json!(2)), ("/solver/steps", json!("many"))];
    slips.extend([
        ("/body/space", json!("plain-stress")),
        ("/version", json!(2)),
        ("/boundary/0/side", json!("x")),
    ]);
    for (path, wrong) in slips {
        let mut scene = good.clone();
        *scene.pointer_mut(path).unwrap() = wrong.clone();
        assert!(!check(&schema, &scene).is_empty(), "{path} = {wrong}");
    }
    for (table, key) in [("", "bodi"), ("/body", "spcaing"), ("/boundary/0", "layer")] {
        let mut scene = good.clone();
        scene.pointer_mut(table).unwrap()[key] = json!(1);
        assert!(!check(&schema, &scene).is_empty(), "{table}/{key}");
    }
    let mut scene = good.clone();
    scene.as_object_mut().unwrap().remove("material");
    assert!(check(&schema, &scene).iter().any(|fault| fault.contains("material")));
}

/// Descriptions that editors show beside a key.
#[test]
fn keys_are_documented() {
    for program in PROGRAMS {
        let schema = schema(program);
        let mut missing = Vec::new();
        for (name, definition) in schema["definitions"].as_object().unwrap() {
            for (key, property) in definition["properties"].as_object().into_iter().flatten() {
                if property["description"].as_str().is_none_or(str::is_empty) {
                    missing.push(format!("{name}.{key}"));
                }
            }
        }
        assert!(missing.is_empty(), "{program}: {missing:?}");
        // `polycore` knows no lengths
        let unit = if program == "polycore" { "stress" } else { "length" };
        let lengths = &schema["definitions"][unit];
        assert!(lengths["examples"][0].is_string() && lengths["pattern"].is_string(), "{lengths}");
    }
}

/// Collects keys, choices and names of a schema, choices in quotes.
fn words(schema: &Value, found: &mut BTreeSet<String>) {
    match schema {
        Value::Object(keys) => {
            if let Some(Value::Object(properties)) = keys.get("properties") {
                found.extend(properties.keys().cloned());
            }
            let choices = keys.get("enum").and_then(Value::as_array).into_iter().flatten();
            found.extend(
                choices.chain(keys.get("const")).filter_map(Value::as_str).map(|s| format!("\"{s}\"")),
            );
            keys.values().for_each(|inner| words(inner, found));
        }
        Value::Array(list) => list.iter().for_each(|inner| words(inner, found)),
        _ => {}
    }
}

/// The reference pages of `crystfem` contain every key and every choice, in backticks, alone or in a line of
/// TOML.
#[test]
fn keys_are_in_the_reference() {
    let pages = ["part.md", "material.md"]
        .map(|page| fs::read_to_string(workspace().join("docs/guide/src/reference").join(page)).unwrap());
    let mut named = BTreeSet::new();
    for line in pages.iter().flat_map(|page| page.lines()) {
        for code in line.split('`').skip(1).step_by(2) {
            let word = |letter: char| letter.is_ascii_alphanumeric() || "_-.\"".contains(letter);
            named.extend(code.split(|letter| !word(letter)).map(str::to_owned));
        }
    }
    let mut known = BTreeSet::new();
    let mut schema = schema("crystfem");
    // values of reports have their own page
    schema["definitions"]["Expect"]["properties"]["quantity"].take();
    words(&schema, &mut known);
    assert!(known.len() > 90 && known.contains("\"tr-bdf2\"") && known.contains("growth_rate"), "{known:?}");
    let missing: Vec<&String> = known.difference(&named).collect();
    assert!(missing.is_empty(), "not in the reference: {missing:?}");
}

/// Formats the scalars of reports in a schema as a table: name, unit, description.
fn values(program: &str) -> String {
    let schema = schema(program);
    let choices = schema["definitions"]["Expect"]["properties"]["quantity"]["anyOf"].as_array().unwrap();
    let mut table = format!("## {program}\n\n| value | unit | meaning |\n|---|---|---|\n");
    for choice in choices {
        let Some(name) = choice["const"].as_str().or(choice["title"].as_str()) else { continue };
        let about = choice["description"].as_str().unwrap();
        let (about, unit) = match about.strip_suffix(']').and_then(|rest| rest.rsplit_once(" [")) {
            Some((about, unit)) => (about, unit),
            None => (about, ""),
        };
        table +=
            &format!("| `{name}` | {} | {} |\n", unit.replace('*', "its own"), about.replace('|', "\\|"));
    }
    table
}

/// The page of all values is generated from the programs' declarations: `UPDATE_REFERENCE=1` writes it.
#[test]
fn values_are_in_the_reference() {
    let path = workspace().join("docs/guide/src/reference/values.md");
    let text = fs::read_to_string(&path).unwrap();
    let head = text.split_once("\n## ").unwrap().0;
    let page =
        [head.to_owned() + "\n"].into_iter().chain(PROGRAMS.map(values)).collect::<Vec<_>>().join("\n");
    let page = page.replacen("\n\n\n", "\n\n", 1);
    if std::env::var_os("UPDATE_REFERENCE").is_some() {
        fs::write(&path, &page).unwrap();
    }
    assert!(
        text == page,
        "{} is not what the programs declare: UPDATE_REFERENCE=1 writes it",
        path.display()
    );
}

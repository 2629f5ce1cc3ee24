use std::collections::BTreeMap;

use serde::Deserialize;

use super::*;
use polycore::units::{Length, Ratio};

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(dead_code)]
struct Scene {
    name: Option<String>,
    body: BodySpec,
    #[serde(default)]
    load: Vec<LoadSpec>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
#[allow(dead_code)]
struct BodySpec {
    spacing: Length,
    horizon: f64,
    count: Option<u32>,
    law: Option<LawSpec>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum LawSpec {
    Subtract,
    Shift,
    Chain,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(dead_code)]
struct LoadSpec {
    at: [Length; 2],
    weight: Ratio,
}

#[test]
fn missing_unexpected_and_conflicting_keys() {
    let source = Source::new("scene.toml", GOOD);
    let missing = source.missing("body.count", "needed for a test");
    assert_eq!(missing.message(), "missing `body.count`: needed for a test");
    assert_eq!((missing.key(), missing.line()), (Some("body.count"), Some(5)));
    assert_eq!(source.missing("grip", "needed for a test").line(), Some(16), "the end of the file");
    let unexpected = source.unexpected("body.law", "a test has none");
    assert_eq!(unexpected.message(), "unexpected `body.law`: a test has none");
    assert_eq!(unexpected.line(), Some(8));
    let conflict = source.conflict("load[1].weight", "at", "write one of them");
    assert_eq!(conflict.message(), "`load[1].weight` conflicts with `at`: write one of them");
    assert_eq!(conflict.line(), Some(16));
}

const GOOD: &str = r#"
version = 1
name = "plate"

[body]
spacing = "2 mm"
horizon = 3.015
law = "chain"

[[load]]
at = ["0 mm", "1 mm"]
weight = 0.5

[[load]]
at = ["0 mm", "2 mm"]
weight = "50 %"
"#;

fn fail(text: &str) -> SceneError {
    Source::new("scene.toml", text).parse::<Scene>().unwrap_err()
}

fn rendered(error: &SceneError) -> String {
    let text = error.render();
    assert!(text.contains(error.message().lines().next().unwrap_or_default()), "{text}");
    text
}

#[test]
fn good_scene() {
    let scene: Scene = Source::new("scene.toml", GOOD).parse().unwrap();
    assert_eq!(scene.body.spacing.si(), 0.002);
    assert!(matches!(scene.body.law, Some(LawSpec::Chain)));
    assert_eq!(scene.load[1].weight.si(), 0.5);
}

#[test]
fn every_error_names_place_found_and_allowed() {
    for (from, to, key, line, parts) in [
        (
            "spacing",
            "spacng",
            "body.spacng",
            6,
            &["unknown key `spacng` in `body`", "`horizon`", "did you mean `spacing`?"][..],
        ),
        (
            "spacing",
            "poisson_ratio",
            "body.poisson_ratio",
            6,
            &["unknown key `poisson_ratio`", "(3K − 2G)/(6K + 2G)"],
        ),
        ("chain", "arruda-boyce", "body.law", 8, &["Arruda and Boyce's law is `eight-chain` here"]),
        ("name =", "nam =", "nam", 3, &["unknown key `nam`", "`body`", "did you mean `name`?"]),
        ("weight = 0.5", "wait = 0.5", "load[0].wait", 12, &["unknown key `wait` in `load[0]`", "`weight`"]),
        ("\"2 mm\"", "\"2 kg\"", "body.spacing", 6, &["`2 kg` is a mass; a length is needed, e.g. \"2 mm\""]),
        ("\"1 mm\"", "1", "load[0].at[1]", 11, &["has no unit"]),
        (
            "chain",
            "chian",
            "body.law",
            8,
            &["found `chian`", "allowed: `subtract`, `shift`, `chain`", "did you mean `chain`?"],
        ),
        ("3.015", "\"three\"", "body.horizon", 7, &["found string \"three\"; allowed: a number"]),
        (
            "law = \"chain\"",
            "count = -3",
            "body.count",
            8,
            &["found integer `-3`; allowed: a whole number, not negative"],
        ),
        ("horizon = 3.015\n", "", "body.horizon", 5, &["missing `body.horizon`"]),
        ("[body]", "[bodi]", "bodi", 5, &["unknown key `bodi`", "did you mean `body`?"]),
        ("[\"0 mm\", \"2 mm\"]", "[\"0 mm\"]", "load[1].at", 15, &["found", "array"]),
    ] {
        assert!(GOOD.contains(from), "{from}");
        let error = fail(&GOOD.replacen(from, to, 1));
        let message = error.message();
        assert_eq!((error.key(), error.line()), (Some(key), Some(line)), "{from} → {to}: {message}");
        for part in parts {
            assert!(message.contains(part), "{from} → {to}: {message}");
        }
        let picture = rendered(&error);
        assert!(picture.contains(&format!("scene.toml:{line}:")), "{picture}");
    }
}

/// A scene of another program has other keys, which are no faults.
#[test]
fn program_comes_next() {
    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Ours {
        #[expect(dead_code)]
        program: Program,
    }
    #[derive(Debug, Deserialize)]
    #[serde(rename_all = "lowercase")]
    enum Program {
        Peri,
    }
    let told = |text: &str| Source::new("scene.toml", text).parse::<Ours>().unwrap_err();
    let error = told("version = 1\nbody = 1\nprogram = 'crystfem'\n[surface]\n");
    assert_eq!((error.key(), error.line()), (Some("program"), Some(3)));
    assert!(rendered(&error).contains("this is a scene of `crystfem`: `crystfem run` solves it"));
    let error = told("version = 1\nprogram = 'prei'\n[surface]\n");
    assert!(error.message().contains("did you mean `peri`?"), "{error}");
    let error = told("version = 1\nprogram = 'peri'\n[surface]\n");
    assert_eq!(error.key(), Some("surface"));
    let error = told("version = 1\n[surface]\n");
    assert_eq!(error.key(), Some("surface"));
}

#[test]
fn unknown_names_show_the_nearest() {
    let source = Source::new("scene.toml", GOOD);
    let names: Vec<String> = (0..40).map(|k| format!("value_{k}")).chain(["peak_load".to_owned()]).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let error = source.unknown("load[0].weight", "peek_load", &names);
    assert_eq!((error.key(), error.line()), (Some("load[0].weight"), Some(12)));
    let message = error.message();
    assert!(
        message.starts_with("`load[0].weight`: found `peek_load`; allowed: `peak_load`, `value_"),
        "{message}"
    );
    assert!(message.ends_with("did you mean `peak_load`?") && message.matches("value_").count() == 11);
    assert!(rendered(&error).contains("29 more are allowed"));
}

#[test]
fn version_comes_first() {
    let missing = fail(&GOOD.replace("version = 1", ""));
    assert!(missing.message().contains("missing `version`; allowed: `version = 1`"), "{missing}");
    let other = fail(&GOOD.replace("version = 1", "version = 2").replace("spacing", "anything"));
    assert_eq!(other.message(), "`version`: found 2; allowed: 1");
    assert_eq!(other.line(), Some(2));
    assert!(fail(&GOOD.replace("version = 1", "version = '1'")).message().contains("found '1'; allowed: 1"));
    assert!(
        fail(&GOOD.replace("version = 1", "verson = 1"))
            .message()
            .contains("did you mean `version` by `verson`")
    );
}

#[test]
fn cross_field_errors_find_their_value() {
    let source = Source::new("scene.toml", GOOD);
    for (key, line) in [
        ("body.horizon", 7),
        ("load[1].at[0]", 15),
        ("load[1]", 14),
        ("load[7].at", 10),
        ("body.nothing.there", 5),
        ("nothing", 1),
        ("", 1),
        ("load[x]..", 10),
    ] {
        assert_eq!(source.error(key, "x", "y").line(), Some(line), "{key}");
    }
    let error = source.error("body.horizon", 3.015, "at least 5");
    assert_eq!(error.message(), "`body.horizon`: found 3.015; allowed: at least 5");
    assert_eq!(error.exit_code(), 2);
}

#[test]
fn keys_are_missing_unexpected_or_in_conflict() {
    let source = Source::new("scene.toml", GOOD);
    let missing = source.missing("body.thickness", "a plane body needs it; write a length");
    assert_eq!(missing.message(), "missing `body.thickness`: a plane body needs it; write a length");
    assert!(rendered(&missing).contains("needed here"), "{}", rendered(&missing));
    let unexpected = source.unexpected("load[1].at", "remove it");
    assert_eq!(unexpected.message(), "unexpected `load[1].at`: remove it");
    let conflict = source.conflict("body.horizon", "body.spacing", "keep one of them");
    assert_eq!(conflict.message(), "`body.horizon` conflicts with `body.spacing`: keep one of them");
    assert_eq!([missing, unexpected, conflict].map(|error| error.line()), [Some(5), Some(15), Some(7)]);
}

#[test]
fn a_file_cut_anywhere_is_an_error_or_complete() {
    for end in 0..GOOD.len() {
        let source = Source::new("cut.toml", &GOOD[..end]);
        if let Err(error) = source.parse::<Scene>() {
            assert!(error.line().is_some_and(|line| line <= 1 + GOOD[..end].matches('\n').count()));
            rendered(&error);
        }
    }
    let cut = fail(&GOOD[..GOOD.find("3.015").unwrap()]);
    assert!(cut.message().contains("not valid TOML"), "{cut}");
    assert!(rendered(&cut).contains("is the file complete?"), "{}", rendered(&cut));
    // the caret of an error at the very end
    assert!(rendered(&fail("version = 1\n[body]\nspacing = \"2 mm")).contains("╰── here"));
}

#[test]
fn files_that_are_no_scenes() {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name);
    let message = |name: &str| {
        let error = Source::read(path(name)).unwrap_err();
        assert!(error.line().is_none());
        rendered(&error)
    };
    std::fs::write(path("case.toml"), GOOD).unwrap();
    assert!(Source::read(path("case.toml")).is_ok());
    assert!(message("cas.toml").contains("did you mean"), "{}", message("cas.toml"));
    assert!(message("no/such/case.toml").contains("either"));
    assert!(message(".").contains("is a directory"));
    std::fs::write(path("rubber.CSV"), "stretch,nominal [MPa]\n1.5,0.4\n").unwrap();
    assert!(message("rubber.CSV").contains("is a table, not a scene"), "{}", message("rubber.CSV"));
    std::fs::write(path("latin1.toml"), b"version = 1\nname = \"Stra\xdfe\"").unwrap();
    assert!(
        message("latin1.toml").contains("not UTF-8 text (byte 24, line 2)"),
        "{}",
        message("latin1.toml")
    );
    let huge = std::fs::File::create(path("huge.toml")).unwrap();
    huge.set_len(LARGEST_FILE + 1).unwrap();
    assert!(message("huge.toml").contains("larger than 16 MiB"));
}

#[test]
fn absurd_texts_do_not_panic() {
    for text in [
        "",
        "\0",
        "[[[[[",
        "version = 1\n[body]\n[body]",
        "version = 1\nversion = 1",
        &format!("version = 1\nx = {}", "[".repeat(100_000)),
        &format!("version = 1\nx = {}1{}", "{a=".repeat(10_000), "}".repeat(10_000)),
        "version = 99999999999999999999999999",
        "version = 1\n\"spacing\\u0000\" = 1",
        "\u{feff}version = 1",
    ] {
        let error = fail(text);
        assert!(!error.message().is_empty());
        rendered(&error);
    }
}

const STUDIES: &str = r#"
[[study]]
body = { spacing = "5 mm", horizon = 4 }

[[study]]
set = { "load[1].weight" = 0.25, body = { law = "shift" } }

[[study]]
set = { "load[2].weight" = 0.25 }

[[study]]
set = { "body.horizn" = 2 }

[[study]]
set = { "name.of" = 2 }

[[study]]
set = { "load[0].weight" = "3 kg", "body.count" = 12 }
"#;

#[derive(Debug, Deserialize)]
#[allow(dead_code)]
struct WithStudies {
    #[serde(flatten)]
    _rest: BTreeMap<String, serde::de::IgnoredAny>,
    body: BodySpec,
    load: Vec<LoadSpec>,
}

#[test]
fn parts_stand_in_for_others() {
    let source = Source::new("s.toml", format!("{GOOD}{STUDIES}"));
    let of = |source: Source| source.parse::<WithStudies>();
    // whole: what the study does not name is not there
    let replaced = source.with_replaced("body", "study[0].body");
    let found = of(replaced.clone()).unwrap();
    assert_eq!((found.body.spacing.si(), found.body.horizon), (5e-3, 4.0));
    assert!(found.body.law.is_none());
    assert_eq!(replaced.error("body.spacing", 1, 2).line(), Some(19));
    // merged: the rest stays
    let merged = source.with_merged("study[1].set");
    let found = of(merged.clone()).unwrap();
    assert!(matches!(found.body.law, Some(LawSpec::Shift)) && found.body.spacing.si() == 2e-3);
    assert_eq!(found.load.iter().map(|load| load.weight.si()).collect::<Vec<_>>(), [0.5, 0.25]);
    assert_eq!(merged.error("load[1].weight", 1, 2).line(), Some(22));
    assert_eq!(merged.error("body.law", 1, 2).key(), Some("study[1].set.body.law"));
    assert_eq!(merged.error("load[0].weight", 1, 2).line(), Some(12));
    // of two the first holds; a value that is added later finds its table
    let both = source.with_merged("study[5].set").with_merged("study[1].set");
    let error = of(both.clone()).unwrap_err();
    assert!(
        error.message().contains("a dimensionless number is needed") && error.line() == Some(34),
        "{error}"
    );
    assert_eq!(both.error("body.count", 1, 2).line(), Some(34));
    // what cannot stand there is named where it is written
    for (study, line, words) in [
        (2, 25, "found `load[2]`; allowed: `load` has 2 elements"),
        (3, 28, "unknown key `horizn` in `study[3].set.body`; allowed"),
        (4, 31, "allowed: a table: `name` is none"),
    ] {
        let error = of(source.with_merged(&format!("study[{study}].set"))).unwrap_err();
        assert!(error.message().contains(words), "{error}");
        assert_eq!(error.line(), Some(line), "{error}");
    }
}

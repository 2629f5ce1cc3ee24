use super::*;

fn expectations(text: &str) -> Result<Vec<Expect>, toml::de::Error> {
    #[derive(Deserialize)]
    struct Scene {
        expect: Vec<Expect>,
    }
    toml::from_str::<Scene>(text).map(|scene| scene.expect)
}

fn one(rest: &str) -> Result<Expect, toml::de::Error> {
    expectations(&format!("[[expect]]\nquantity = 'k'\nkind = 'bound'\n{rest}")).map(|mut all| all.remove(0))
}

fn report(value: f64) -> Report {
    let mut report = Report::new("peri", "0.1.0", "version = 1\n");
    report
        .value(Named::new("k", "MPa"), value)
        .work("steps", 12)
        .seconds("solve", 0.5)
        .seconds("solve", 0.25);
    report.curve("profile", &[("x", "m", vec![0.0, 1.0]), ("sigma", "Pa", vec![1.0, 2.0])]);
    report
}

#[test]
fn judgements() {
    for (value, rest, pass) in [
        (2.0, "reference = 2.0\ntolerance = '0 %'", true),
        (2.02, "reference = 2.0\ntolerance = '1.01 %'", true),
        (1.97, "reference = 2.0\ntolerance = '1 %'", false),
        (-1.99, "reference = -2\ntolerance = '1 %'", true),
        (2.009, "reference = 2\ntolerance = '0.01'", true),
        (2.011, "reference = 2\ntolerance = 0.01", false),
        (1e-9, "reference = 0\ntolerance = 1e-8", true),
        (2.0, "at_most = 2", true),
        (2.1, "at_most = 2", false),
        (1.9, "at_least = 2.0", false),
        (2.5, "at_least = 2\nat_most = 3", true),
        (3.5, "at_least = 2\nat_most = 3", false),
        // a bar that is missed as stated; one that is met is no miss any more
        (3.5, "at_most = 3\nmissed = true", true),
        (2.5, "at_most = 3\nmissed = true", false),
        (f64::NAN, "at_least = 2", false),
        (f64::INFINITY, "at_least = 2", false),
        (f64::NAN, "reference = 2\ntolerance = '100 %'", false),
    ] {
        let mut report = report(value);
        report.judge(&[one(&format!("{rest}\nsource = 's'")).unwrap()], false);
        assert_eq!(report.expect[0].pass, pass, "{value} {rest}");
        assert_eq!(report.passed(), pass);
    }
}

#[test]
fn missing_quantities_fail_and_say_so() {
    let mut report = report(1.0);
    let mut expect = one("at_most = 2\nsource = 's'\nquick = false").unwrap();
    expect.quantity = "q".into();
    report.judge(&[expect.clone()], true);
    assert!(report.expect.is_empty() && report.passed());
    report.judge(&[expect.clone()], false);
    assert!(!report.passed());
    assert!(report.table().contains("the report has no value of that name"));
    expect.quantity = "profile".into();
    report.judge(&[expect], false);
    assert!(report.table().contains("not a scalar"));
}

/// The value of a quotient is that of its two scalars; one that is missing, or a zero below, fails.
#[test]
fn quotients() {
    for (quantity, rest, pass) in [
        ("k / m", "reference = 1.5\ntolerance = '1e-12'", true),
        ("m / k", "at_least = 1", false),
        ("k / zero", "at_least = 1", false),
        ("k / q", "at_least = 1", false),
        ("k / m / m", "at_least = 0", false),
        ("k/m", "at_least = 0", false),
    ] {
        let mut report = report(3.0);
        report.value(Named::new("m", "MPa"), 2.0).value(Named::new("zero", ""), 0.0);
        let mut expect = one(&format!("{rest}\nsource = 's'")).unwrap();
        expect.quantity = quantity.to_owned();
        report.judge(&[expect], false);
        assert_eq!(report.expect[0].pass, pass, "{quantity}: {}", report.verdict());
    }
}

#[test]
fn bad_expectations() {
    for (rest, part) in [
        ("source = 's'", "give `reference` and `tolerance`"),
        ("reference = 1\nsource = 's'", "give `reference`"),
        ("reference = 1\ntolerance = 1\nat_most = 2\nsource = 's'", "give `reference`"),
        ("at_least = 3\nat_most = 2\nsource = 's'", "exceeds"),
        ("reference = nan\ntolerance = 1\nsource = 's'", "not finite"),
        ("reference = 1\ntolerance = '-1 %'\nsource = 's'", "negative"),
        ("reference = 1\ntolerance = '1 mm'\nsource = 's'", "is a length"),
        ("at_most = 2\nsource = ' '", "where the figure comes from"),
        ("at_most = 2", "missing field `source`"),
        ("at_mots = 2\nsource = 's'", "unknown field `at_mots`"),
    ] {
        let error = one(rest).unwrap_err();
        assert!(error.message().contains(part), "{rest}: {error}");
    }
    for (kind, part) in [("", "missing field `kind`"), ("kind = 'guessed'", "unknown variant `guessed`")] {
        let text = format!("[[expect]]\nquantity = 'k'\nat_most = 2\nsource = 's'\n{kind}");
        let error = expectations(&text).unwrap_err();
        assert!(error.message().contains(part), "{kind}: {error}");
    }
}

#[test]
fn file_round_trip() {
    let directory = tempfile::tempdir().unwrap();
    let mut report = report(0.1 + 0.2);
    report.threads(3);
    report.judge(&[one("reference = 0.3\ntolerance = '1 %'\nsource = 'sum'").unwrap()], false);
    let path = report.write(directory.path()).unwrap();
    let read = Report::read(&path).unwrap();
    assert_eq!(read.values, report.values);
    assert_eq!(read.expect[0].expect, report.expect[0].expect);
    assert_eq!((read.work["steps"], read.seconds["solve"], read.passed()), (12, 0.75, true));
    assert_eq!((read.provenance.host.threads, read.provenance.scene.as_str()), (3, "version = 1\n"));
    assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 1);
    std::fs::write(&path, "{}").unwrap();
    assert!(Report::read(&path).unwrap_err().to_string().contains("not a valid report"));
}

/// Silence would be the worst outcome: `serde_json` writes NaN as `null`.
#[test]
fn non_finite_values_are_stated_and_fail() {
    let directory = tempfile::tempdir().unwrap();
    let mut report = report(f64::NAN);
    report.value(Named::new("m", ""), f64::NEG_INFINITY);
    report.curve("profile", &[("x", "m", vec![0.0]), ("sigma", "Pa", vec![f64::INFINITY])]);
    assert!(!report.passed());
    let path = report.write(directory.path()).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(!text.contains("null") && text.contains("\"NaN\"") && text.contains("\"-inf\""));
    let read = Report::read(&path).unwrap();
    assert_eq!(read.non_finite, ["k", "m", "profile.sigma"]);
    assert!(read.scalar("k").unwrap().is_nan() && !read.passed());
    assert!(read.table().contains("profile.sigma is not finite"));
    report.value(Named::new("k", ""), 1.0).value(Named::new("m", ""), 1.0).curve("profile", &[]);
    assert!(report.passed());
}

#[test]
fn phases_add_up() {
    let mut phases = Phases::new();
    phases.start("outer");
    assert_eq!(phases.time("inner", || 7), 7);
    phases.time("inner", || ());
    phases.stop();
    phases.add("outer", 10.0);
    let seconds: Vec<_> = phases.seconds().collect();
    assert_eq!(seconds.iter().map(|(phase, _)| *phase).collect::<Vec<_>>(), ["outer", "inner"]);
    assert!(seconds[0].1 >= 10.0 && seconds[1].1 >= 0.0);
    let mut report = report(1.0);
    report.phases(&phases);
    assert!(report.seconds["outer"] >= 10.0);
}

#[test]
fn short_numbers() {
    for (value, text) in [
        (3.0, "3"),
        (2.27, "2.27"),
        (1234567.0, "1.23457e6"),
        (0.000123456789, "1.23457e-4"),
        (-0.5, "-0.5"),
        (0.0, "0"),
    ] {
        assert_eq!(number::short(value), text);
    }
}

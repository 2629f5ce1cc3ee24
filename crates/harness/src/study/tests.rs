use super::*;

crate::study! {
    /// Studies of a plate.
    pub struct PlateStudy;
    replaces { hole: f64 = "plate.hole", plate: Any = "plate", }
    lists { spacing: f64 = "plate.spacing", law: String = "law", }
}

const SCENE: &str = "version = 1\nlaw = 'a'\nplate = { hole = 1, spacing = 8 }\n";

fn plates(studies: &str, quick: bool, naming: Naming) -> Result<Vec<Variant>, SceneError> {
    #[derive(Deserialize)]
    struct Scene {
        study: Vec<PlateStudy>,
    }
    let source = Source::new("plate.toml", format!("{SCENE}{studies}"));
    let studies: Vec<Study> = source.parse::<Scene>()?.study.iter().map(PlateStudy::study).collect();
    variants(&source, &studies, quick, naming, |source, name| {
        let own: serde_json::Value = source.parse()?;
        let values = format!("{} {} {}", own["law"], own["plate"]["spacing"], own["plate"]["hole"]);
        Ok(values.replace('"', "") + name.unwrap_or_default())
    })
}

fn names(variants: &[Variant]) -> Vec<&str> {
    variants.iter().map(|variant| variant.name.as_str()).collect()
}

/// Lists are a grid whose last list runs fastest; they hold over single keys, and these over blocks. What is
/// equal runs once.
#[test]
fn lists_keys_and_blocks() {
    let studies = "[[study]]\nspacing = [4, 2]\nlaw = ['a', 'b']\n[[study]]\nspacing = [2, 1]\n
        [[study]]\nname = ' x'\nspacing = [3]\n
        plate = { hole = 5, spacing = 7 }\nset = { 'plate.hole' = 6, law = 'c' }\n
        [[study]]\nname = ' y'\nquick = false\nexpect_error = 'no hole'\nhole = 0";
    let all = plates(studies, false, Naming::Brackets).unwrap();
    assert_eq!(names(&all), ["a 4 1", "b 4 1", "a 2 1", "b 2 1", "a 1 1", "c 3 6 x", "a 8 0 y"]);
    assert_eq!(all.iter().map(|one| one.study.unwrap()).collect::<Vec<_>>(), [0, 0, 0, 0, 1, 2, 3]);
    assert_eq!(all[6].expect_error.as_deref(), Some("no hole"));
    // errors point at the study
    assert_eq!(all[2].source.error("plate.spacing", 1, 2).key(), Some("study[0].spacing[1]"));
    assert_eq!(all[5].source.error("plate.hole", 1, 2).key(), Some("study[2].set.plate.hole"));
    assert_eq!(all[6].source.error("plate.hole", 1, 2).key(), Some("study[3].hole"));
    assert_eq!(plates(studies, true, Naming::Brackets).unwrap().len(), 6);
    let own = plates("study = []", false, Naming::Brackets).unwrap();
    assert!(names(&own) == ["a 8 1"] && own[0].study.is_none());
}

/// Values of any keys, named as in a sweep; no name is needed.
#[test]
fn any_keys() {
    let studies = "[[study]]\nvary = { 'plate.hole' = [1, 0.5], law = ['b c'] }\n\
                   [[study]]\nname = 'x'\nvary = { 'plate.new' = [3] }";
    let all = plates(studies, false, Naming::Folders).unwrap();
    let expected = ["b c 8 1law-bc_hole-1", "b c 8 0.5law-bc_hole-0_5", "a 8 1x_new-3"];
    assert_eq!(names(&all), expected);
    assert_eq!(all[1].source.error("plate.hole", 1, 2).key(), Some("study[0].vary.plate.hole[1]"));
}

#[test]
fn names_that_are_refused() {
    for (studies, naming, message) in [
        ("[[study]]\nname = 'a/b'", Naming::Brackets, "found `a/b`; allowed: a name without `/`"),
        ("[[study]]\nname = 'a b'", Naming::Folders, "it names files"),
        ("[[study]]\nhole = 2", Naming::Folders, "missing `study[0].name`: the values"),
        ("[[study]]\n[[study]]\nhole = 1", Naming::Brackets, "`study[1]`: found a second variant `a 8 1`"),
        ("[[study]]\nname = 'f'\n[[study]]\nname = 'F'", Naming::Folders, "`a 8 1F` twice"),
        ("[[study]]\nname = 'f'\nquick = false", Naming::Folders, "no variant left in a --quick run"),
        ("[[study]]\nspacings = [1]", Naming::Brackets, "did you mean `spacing`?"),
    ] {
        let error = plates(studies, true, naming).unwrap_err();
        assert!(error.message().contains(message), "{message}: {}", error.message());
    }
}

#[test]
fn names_of_values() {
    for (naming, full) in [(Naming::Brackets, "load[fine]"), (Naming::Folders, "fine.load")] {
        assert_eq!(naming.value("fine", "load"), full);
        assert!(naming.is_of("fine", full) && !naming.is_of("ine", full) && !naming.is_of("fin", full));
    }
}

/// Several at a time, in their order; the error is that of the first that fails.
#[test]
fn solved_side_by_side() {
    use crate::case::{Options, Program, Run};
    use crate::scene::Failure;
    const PROGRAM: Program =
        Program { name: "test", version: "0", about: "", examples: "", magic: b"test-ck1", columns: &[] };
    let folder = tempfile::tempdir().unwrap();
    let source = Source::new("scene.toml", SCENE);
    let variants: Vec<String> = ('a'..='e').map(String::from).collect();
    for resume in [false, true] {
        let options = Options { resume, ..Options::new(folder.path()) };
        let mut run = Run::new(const { &PROGRAM }, &source, options);
        run.begin().unwrap();
        let outcome = solve(&mut run, Naming::Folders, &variants, 2, |index, own| {
            assert_eq!(own.options.output, folder.path().join(&variants[index]));
            // what `c` had reached comes back
            assert_eq!(own.reached::<u64>()?, (resume && index == 2).then_some(7));
            if index == 2 && !resume {
                own.save(&7_u64)?;
                let (what, reason) = ("it".to_owned(), "fails".to_owned());
                return Err(Failure::Run(polycore::Error::Data { what, reason }));
            }
            Ok(index * 10)
        });
        match resume {
            false => assert_eq!(outcome.unwrap_err().to_string(), "it: fails"),
            true => assert_eq!(outcome.unwrap(), [0, 10, 20, 30, 40]),
        }
    }
}

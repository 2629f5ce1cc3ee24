//! Test that the headings of a table name, where neither a column nor the scene does.

use super::columns::{StrainMeasure, TestColumn, suffixed};
use super::data::Mode;
use crate::table::{Error, Table};

/// Components of a shear, of which a heading does not say whether they are γ or ½γ.
const COMPONENTS: [&str; 12] = ["12", "13", "21", "23", "31", "32", "xy", "xz", "yx", "yz", "zx", "zy"];
/// Symbols of components: `S12`, `ε12`.
const SYMBOLS: [&str; 10] = ["s", "e", "p", "ε", "σ", "γ", "τ", "eps", "epsilon", "sigma"];
/// Units behind a number that is no component: `23 °C`.
const UNITS: [&str; 6] = ["c", "k", "mm", "min", "h", "phr"];
const SHEARS: [&str; 4] = ["γ", "gamma", "τ", "tau"];
/// Abbreviations of tests.
const CODES: [(&str, Mode); 11] = [
    ("ps", Mode::PureShear),
    ("pt", Mode::PureShear),
    ("ss", Mode::SimpleShear),
    ("bi", Mode::Equibiaxial),
    ("bt", Mode::Equibiaxial),
    ("eb", Mode::Equibiaxial),
    ("ebt", Mode::Equibiaxial),
    ("et", Mode::Equibiaxial),
    ("uc", Mode::Uniaxial),
    ("ut", Mode::Uniaxial),
    ("st", Mode::Uniaxial),
];

/// Finds the test that the headings of strain and stress name; `None` if they name none.
///
/// # Errors
/// Headings of two tests, of torsion, and of shears or plane states that could be several.
pub(super) fn named_test(
    file: &Table,
    strain: &TestColumn<StrainMeasure>,
    stress: usize,
) -> Result<Option<Mode>, Error> {
    let one = |column: usize| {
        let heading = &file.headings[column];
        test(&suffixed(heading).0).map_err(|allowed| {
            let what = format!("heading of column {}", column + 1);
            file.refuse(file.layout().heading_line, &what, heading.text.clone(), allowed)
        })
    };
    let refused = |found: &str, allowed: &str| {
        Err(file.refuse(file.layout().heading_line, "headings", found.to_owned(), allowed))
    };
    let words = match (one(strain.column)?, one(stress)?) {
        (Some(a), Some(b)) if a != b => {
            let found = format!("a strain of {} and a stress of {} tests", a.name(), b.name());
            return refused(&found, "columns of one test, or its `mode` in the data's entry");
        }
        (None, Some(Mode::SimpleShear)) => {
            return refused(
                "a shear stress with a strain that is not called one",
                "`mode = \"simple-shear\"` (the strain is the amount of shear) or `mode = \
                 \"pure-shear\"` (a wide strip) in the data's entry",
            );
        }
        (Some(Mode::SimpleShear), _) if strain.measure == StrainMeasure::Stretch => {
            return refused(
                "the stretch of a shear",
                "`mode = \"pure-shear\"` (the stretch of a wide strip), or the amount of shear, `shear \
                 strain`, of simple shear",
            );
        }
        (a, b) => a.or(b),
    };
    let [strain, stress] = [strain.column, stress].map(|column| file.headings[column].text.as_str());
    let same = code(strain).filter(|own| code(stress).is_some_and(|other| own.0 == other.0));
    match (words, same.map(|(_, mode)| mode)) {
        (Some(a), Some(b)) if a != b => {
            let found = format!("words of {} and an abbreviation of {} tests", a.name(), b.name());
            refused(&found, "the `mode` of the test in the data's entry")
        }
        (None, None) if is_doubtful(strain, stress) => refused(
            "the abbreviation of a test in one heading alone, or without a `_`",
            "the `mode` of the test in the data's entry, or the abbreviation behind a `_` in both headings",
        ),
        (words, same) => Ok(words.or(same)),
    }
}

fn known_code(word: &str) -> Option<(&'static str, Mode)> {
    CODES.into_iter().find(|(code, _)| *code == word.to_lowercase())
}

/// Abbreviation of a test behind a `_`.
fn code(heading: &str) -> Option<(&'static str, Mode)> {
    let pieces = heading.split('_').skip(1);
    let words = pieces.map(|piece| piece.split(|c: char| !c.is_alphanumeric()).next().unwrap_or_default());
    words.filter_map(known_code).last()
}

/// Returns true for abbreviations of another test than a uniaxial one, behind a `_` in a heading, or the same
/// as words of both.
fn is_doubtful(strain: &str, stress: &str) -> bool {
    let other = |found: &(&str, Mode)| found.1 != Mode::Uniaxial;
    let words = |text: &str| -> Vec<&'static str> {
        let words = text.split(|c: char| !c.is_alphanumeric()).filter_map(known_code);
        words.filter(other).map(|(code, _)| code).collect()
    };
    let both = words(strain).iter().any(|code| words(stress).contains(code));
    both || [strain, stress].into_iter().filter_map(code).any(|found| other(&found))
}

/// Test of a heading in small letters without its unit, from stems in English, German and French; or what is
/// allowed in its place.
fn test(plain: &str) -> Result<Option<Mode>, &'static str> {
    let words: Vec<&str> = plain.split(' ').collect();
    let has = |list: &[&str]| words.iter().any(|word| list.contains(word));
    let begins = |stems: &[&str]| words.iter().any(|word| stems.iter().any(|stem| word.starts_with(stem)));
    let holds = |stems: &[&str]| words.iter().any(|word| stems.iter().any(|stem| word.contains(stem)));
    let shear = holds(&["shear", "scher", "cisaill"]) || begins(&["schub", "schieb"]);
    if begins(&["torsion", "twist", "verdreh"]) {
        return Err(
            "`mode = \"torsion\"` with columns of angle and torque, or `mode = \"simple-shear\"` for the \
                    shear at the surface of a thin tube, in the data's entry",
        );
    }
    let numbered = |word: &str| {
        let symbol = SYMBOLS.iter().find_map(|symbol| word.strip_prefix(symbol));
        COMPONENTS.contains(&word) || symbol.is_some_and(|rest| COMPONENTS.contains(&rest))
    };
    let measured = |i: usize| words.get(i + 1).is_some_and(|next| UNITS.contains(next));
    let is_component = (0..words.len()).any(|i| numbered(words[i]) && !measured(i));
    if (words.len() > 1 && is_component) || has(&SHEARS) {
        return Err(
            "`mode = \"simple-shear\"` in the data's entry, if this is the amount of shear γ (twice the \
                    component of a strain tensor) or its stress; `mode = \"uniaxial\"` or that of another \
                    test, if a number counts specimens",
        );
    }
    if shear && (begins(&["tensor"])) {
        return Err(
            "`mode = \"simple-shear\"` in the data's entry, if this is the amount of shear γ (twice the \
                    component of a strain tensor) or its stress",
        );
    }
    if has(&["plane"]) || begins(&["eben"]) {
        return Err(
            "the `mode` of the test in the data's entry: \"pure-shear\" of a wide strip, \"uniaxial\" of \
                    a bar",
        );
    }
    let compression = begins(&["compress", "druck", "stauch"]);
    if has(&["confined", "oedometric"]) || (compression && has(&["constrained"])) {
        return Err(
            "a test with free sides, or a block `[[volumetric]]`: compression between walls measures the \
                    bulk modulus",
        );
    }
    let pure = shear && (has(&["pure", "pur"]) || begins(&["rein", "pureshear"]));
    let planar = begins(&["planar", "planai"]) || has(&["strip", "constrained"]);
    let biaxial = holds(&["biax", "zweiachsig"]) || has(&["equi", "äqui", "inflation", "bulge"]);
    let one_axis = holds(&["uniax", "einachsig"]);
    let pulled = compression || begins(&["tensile", "tension", "zug", "traction"]);
    let simple = shear && !pure && !planar;
    let two = (one_axis && (biaxial || planar || shear))
        || (shear && biaxial)
        || (simple && (pulled || has(&["free", "frei", "freie"])));
    if two {
        return Err("words of one test, or its `mode` in the data's entry");
    }
    Ok(if biaxial {
        Some(Mode::Equibiaxial)
    } else if planar || pure {
        Some(Mode::PureShear)
    } else if shear {
        Some(Mode::SimpleShear)
    } else if one_axis || pulled {
        Some(Mode::Uniaxial)
    } else {
        None
    })
}

#[cfg(test)]
mod tests {
    use super::super::data::TestData;
    use super::*;

    #[test]
    fn headings_name_their_test() {
        for (headings, mode) in [
            ("shear strain,shear stress [MPa]", Mode::SimpleShear),
            ("Shear Strain [-],Stress [MPa]", Mode::SimpleShear),
            ("simple shear strain [%],nominal shear stress [MPa]", Mode::SimpleShear),
            ("pure shear stretch,pure shear stress [MPa]", Mode::PureShear),
            ("stretch,planar stress [MPa]", Mode::PureShear),
            ("biaxial strain,biaxial stress [MPa]", Mode::Equibiaxial),
            ("stretch_ET,nominal_ET [MPa]", Mode::Equibiaxial),
            ("lambda_bi,P_bi [MPa]", Mode::Equibiaxial),
            ("strain_PS,stress_PS_MPa", Mode::PureShear),
            ("strain_BT,stress_BT [MPa]", Mode::Equibiaxial),
            ("strain et contrainte,stress [MPa]", Mode::Uniaxial),
            ("strain at 23C pt 3,stress [MPa]", Mode::Uniaxial),
            ("strain at 23 °C (tool),stress [MPa]", Mode::Uniaxial),
            ("planar biaxial strain,planar biaxial stress [MPa]", Mode::Equibiaxial),
            ("planar equibiaxial stretch,stress [MPa]", Mode::Equibiaxial),
            ("constrained tension strain,stress [MPa]", Mode::PureShear),
            ("biaxial compression stretch,stress [MPa]", Mode::Equibiaxial),
            ("äquibiaxiale Dehnung [%],Spannung äquibiaxial [MPa]", Mode::Equibiaxial),
            ("Equibiax strain,Biax stress [MPa]", Mode::Equibiaxial),
            ("PureShear strain,PureShear stress [MPa]", Mode::PureShear),
            ("SimpleShear strain,SimpleShear stress [MPa]", Mode::SimpleShear),
            ("Scherung Dehnung,Spannung Scherung [MPa]", Mode::SimpleShear),
            ("Schub Dehnung,Schub Spannung [MPa]", Mode::SimpleShear),
            ("reine Scherung strain,stress [MPa]", Mode::PureShear),
            ("cisaillement strain,cisaillement stress [MPa]", Mode::SimpleShear),
            ("planaire strain,stress [MPa]", Mode::PureShear),
            // of γ there is one measure
            ("shear strain,Cauchy shear stress [MPa]", Mode::SimpleShear),
            ("true shear strain,shear stress [MPa]", Mode::SimpleShear),
            ("tensile strain,tensile stress [MPa]", Mode::Uniaxial),
            ("engineering strain,engineering stress [MPa]", Mode::Uniaxial),
            ("stretch,nominal_MPa", Mode::Uniaxial),
        ] {
            let table = TestData::parse("t.csv", &format!("{headings}\n1.3,0.2\n1.6,0.5\n"));
            let table = table.unwrap_or_else(|error| panic!("{headings}: {error}"));
            assert!(table.states.iter().all(|state| state.mode == mode), "{headings}: {:?}", table.states);
        }
    }

    #[test]
    fn names_of_two_words() {
        use super::super::columns::mode;
        let named = |name: &str| mode(name).map(|found| found.0);
        assert_eq!(named("planar biaxial"), Some(Mode::Equibiaxial));
        assert_eq!(named("planar tension"), Some(Mode::PureShear));
    }

    #[test]
    fn unclear_headings_are_refused() {
        for (headings, part) in [
            ("strain,shear stress [MPa]", "`mode = \"simple-shear\"` (the strain is the amount"),
            (
                "shear strain,biaxial stress [MPa]",
                "a strain of simple-shear and a stress of equibiaxial tests",
            ),
            ("torsional shear strain,shear stress [MPa]", "`mode = \"torsion\"` with columns of angle"),
            ("strain_12,stress_12 [MPa]", "twice the component of a strain tensor"),
            ("Strain 12,Stress 12 [MPa]", "`mode = \"uniaxial\"` or that of another test, if a number"),
            ("12 strain,12 stress [MPa]", "twice the component of a strain tensor"),
            ("strain_xy (DIC),stress_xy (DIC) [MPa]", "twice the component of a strain tensor"),
            ("gamma strain,tau stress [MPa]", "twice the component of a strain tensor"),
            ("stretch,nominal_ET [MPa]", "the abbreviation of a test in one heading alone"),
            ("strain PS 1,stress PS 1 [MPa]", "or without a `_`"),
            ("shear stretch,shear stress [MPa]", "`mode = \"pure-shear\"` (the stretch of a wide strip)"),
            ("confined compression strain,stress [MPa]", "a block `[[volumetric]]`"),
            ("tensile strain at shear bands,stress [MPa]", "words of one test"),
            ("strain (shear-free) strain,stress [MPa]", "words of one test"),
            ("uniaxial strain after biaxial strain,stress [MPa]", "words of one test"),
            ("shear strain_PS,shear stress_PS [MPa]", "an abbreviation of pure-shear tests"),
            ("ebene Dehnung,ebene Spannung [MPa]", "\"pure-shear\" of a wide strip"),
            ("tensor shear strain,shear stress [MPa]", "twice the component of a strain tensor"),
            ("plane strain,stress [MPa]", "\"pure-shear\" of a wide strip"),
            // other quantities than the strain and the stress of the test
            ("volumetric strain,stress [MPa]", "a strain (`stretch`"),
            ("lateral strain,stress [MPa]", "a strain (`stretch`"),
            ("Green strain,stress [MPa]", "a strain (`stretch`"),
            ("plastic strain,true stress [MPa]", "a strain (`stretch`"),
            ("stretch,2nd Piola-Kirchhoff stress [MPa]", "a stress"),
            // the engineering strain is Cauchy's
            ("Cauchy strain,Cauchy stress [MPa]", "`strain = \"engineering\"` or"),
        ] {
            let error = TestData::parse("t.csv", &format!("{headings}\n1.3,0.2\n1.6,0.5\n")).unwrap_err();
            assert!(error.to_string().contains(part), "{headings}: {error}");
        }
        let both =
            TestData::parse("t.csv", "axial strain,lateral strain,stress [MPa]\n0.5,-0.2,1\n").unwrap();
        assert_eq!(both.states[0].stretches[0], 1.5);
        // τ = σ λ⁰ J: Kirchhoff's stress is the true one of an incompressible body
        let kirchhoff = TestData::parse("t.csv", "stretch,Kirchhoff stress [MPa]\n2,1\n").unwrap();
        assert_eq!(kirchhoff.states[0].nominal[0], 0.5e6);
    }
}

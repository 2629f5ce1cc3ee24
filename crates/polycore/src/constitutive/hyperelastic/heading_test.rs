//! Test that the headings of a table name, where neither a column nor the scene does.

use super::columns::suffixed;
use super::data::Mode;
use crate::table::{Error, Table};

/// Components of a shear, of which a heading does not say whether they are γ or ½γ.
const COMPONENTS: [&str; 12] = ["12", "13", "21", "23", "31", "32", "xy", "xz", "yx", "yz", "zx", "zy"];
const PLANAR: [&str; 4] = ["planar", "strip", "ps", "pt"];
const EQUIBIAXIAL: [&str; 8] = ["equibiaxial", "equi", "biaxial", "eb", "ebt", "et", "inflation", "bulge"];
const UNIAXIAL: [&str; 5] = ["uniaxial", "tensile", "tension", "ut", "uc"];

/// Finds the test that the headings of strain and stress name; `None` if they name none.
///
/// # Errors
/// Headings of two tests, of torsion, and of shears or plane states that could be several.
pub(super) fn named_test(file: &Table, strain: usize, stress: usize) -> Result<Option<Mode>, Error> {
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
    match (one(strain)?, one(stress)?) {
        (Some(a), Some(b)) if a != b => {
            let found = format!("a strain of {} and a stress of {} tests", a.name(), b.name());
            refused(&found, "columns of one test, or its `mode` in the data's entry")
        }
        (None, Some(Mode::SimpleShear)) => refused(
            "a shear stress with a strain that is not called one",
            "`mode = \"simple-shear\"` (the strain is the amount of shear) or `mode = \"pure-shear\"` (a \
             wide strip) in the data's entry",
        ),
        (a, b) => Ok(a.or(b)),
    }
}

/// Test of a heading in small letters without its unit; or what is allowed in its place.
fn test(plain: &str) -> Result<Option<Mode>, &'static str> {
    let words: Vec<&str> = plain.split(' ').collect();
    let has = |list: &[&str]| words.iter().any(|word| list.contains(word));
    let begins = |start: &str| words.iter().any(|word| word.starts_with(start));
    let shear = begins("shear");
    if begins("torsion") || begins("twist") {
        return Err(
            "`mode = \"torsion\"` with columns of angle and torque, or `mode = \"simple-shear\"` for the \
                    shear at the surface of a thin tube, in the data's entry",
        );
    }
    let component = words.len() > 1 && words.last().is_some_and(|word| COMPONENTS.contains(word));
    if component || (shear && begins("tensor")) {
        return Err(
            "`mode = \"simple-shear\"` in the data's entry, if this is the amount of shear γ (twice the \
                    component of a strain tensor) or its stress",
        );
    }
    if has(&["plane"]) {
        return Err(
            "the `mode` of the test in the data's entry: \"pure-shear\" of a wide strip, \"uniaxial\" of \
                    a bar",
        );
    }
    Ok(if has(&PLANAR) || (shear && has(&["pure"])) {
        Some(Mode::PureShear)
    } else if shear || has(&["ss"]) {
        Some(Mode::SimpleShear)
    } else if has(&EQUIBIAXIAL) {
        Some(Mode::Equibiaxial)
    } else if has(&UNIAXIAL) || begins("compress") {
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
            ("stretch,nominal_ET [MPa]", Mode::Equibiaxial),
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
    fn unclear_headings_are_refused() {
        for (headings, part) in [
            ("strain,shear stress [MPa]", "`mode = \"simple-shear\"` (the strain is the amount"),
            (
                "shear strain,biaxial stress [MPa]",
                "a strain of simple-shear and a stress of equibiaxial tests",
            ),
            ("torsional shear strain,shear stress [MPa]", "`mode = \"torsion\"` with columns of angle"),
            ("strain_12,stress_12 [MPa]", "twice the component of a strain tensor"),
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

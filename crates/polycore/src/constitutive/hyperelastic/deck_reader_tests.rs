//! Tests of decks as others write them.

use super::*;

#[test]
fn decks_as_others_write_them() {
    let deck = "*Heading\n** rubber\n*Material, name=Seal\n*Density\n1e-9,\n*Hyperelastic, n=2, ogden\n\
                0.4, 1.3,2e-3, 5.\n*Material, name=\"Pad\"\n*Hyperelastic, reduced polynomial, N=3\n\
                0.2, 2e-3, 5e-5, 0.05\n*Hyperfoam\n0.2, 7., 0.25\n*User material, constants=2\n1., 2.\n";
    let MaterialDeck { materials: found, left_out } = parse("deck", deck).unwrap();
    assert!(left_out[0].starts_with("material `PAD`: line 13: found `*User material, constants=2`"));
    assert_eq!(found[0].notes, ["*DENSITY left out: no elasticity"]);
    let shown: Vec<_> = found.iter().map(|one| (one.name.as_str(), one.model.key, one.bulk)).collect();
    let expected = [("SEAL", "ogden-2", None), ("PAD", "yeoh", Some(40.0)), ("PAD", "hyperfoam-1", None)];
    assert_eq!(shown, expected);
    assert_eq!(found[0].parameters, [0.4, 1.3, 2e-3, 5.0]);
    assert_eq!(found[2].parameters, [0.2, 7.0, 0.5]);
    // the same keyword without terms that Biderman's law lacks, and with one
    let third =
        |row: &str| parse("deck", &format!("*HYPERELASTIC, N=3\n{row}\n")).unwrap().materials[0].model.key;
    assert_eq!(third("1, 0.1, 0.01, 0, 0, 1e-4"), "biderman");
    assert_eq!(third("1, 0.1, 0.01, 0, 0, 1e-4, 1e-5"), "polynomial-3");
    // C10, a blank C01, D1
    let blank = parse("deck", "*HYPERELASTIC, MOONEY-RIVLIN\n0.5, , 0.02,\n").unwrap().materials;
    assert_eq!((&blank[0].parameters[..], blank[0].bulk), (&[0.5, 0.0][..], Some(100.0)));
}

#[test]
fn bad_decks_name_the_line() {
    for (deck, part) in [
        ("*HYPERELASTIC, MARLOW\n1\n", "line 1: found `*HYPERELASTIC, MARLOW`; allowed: NEO HOOKE; "),
        ("*HYPERELASTIC, OGDEN, N=4\n1\n", "OGDEN, N=3"),
        ("*HYPERELASTIC, YEOH, TEST DATA INPUT\n", "[[fit.data]]"),
        ("*MATERIAL, NAME=A\n*HYPERELASTIC, YEOH\n1, x\n", "line 3: found `x`; allowed: a finite number"),
        ("*HYPERELASTIC, NEO HOOKE\n1, nan\n", "line 2: found `nan`"),
        ("*HYPERELASTIC, NEO HOOKE\n1, 0, 20\n2, 0, 40\n", "1 to 2 numbers, eight a line"),
        ("*HYPERELASTIC, NEO HOOKE\n0.5\n0.4\n", "1 to 2 numbers, eight a line"),
        ("*HYPERELASTIC, N=3\n1,0,0,1,0,0,0,0,1\n", "line 2: found `1,0,0,1,0,0,0,0,1`; allowed: 8 numbers"),
        ("*MATERIAL, NAME=GENT\n*USER MATERIAL, CONSTANTS=3\n40, 0.3\n75\n", "3 constants; 9 given"),
        ("*HYPERELASTIC, NEO HOOKE\n1, 1e-320\n", "D1 of a finite K = 2/D1"),
        (
            "*HYPERELASTIC, YEOH\n1\n*FOO\n1\n*PLASTIC\n1,0\n",
            "line 3: found `*FOO`; allowed: known properties",
        ),
        ("*HYPERELASTIC, YEOH\n1\n*INCLUDE, INPUT=p.inp\n", "found `*INCLUDE, INPUT=p.inp`; allowed: known"),
        ("*HYPERELASTIC, NEO HOOKE\n", "0 given"),
        ("*HYPERELASTIC, NEO HOOKE\n-1, 0\n", "shear_modulus = -2 is outside"),
        ("*HYPERELASTIC, YEOH\n1,0,0,0,0.1,0\n", "D1 above 0, or all D of 0"),
        ("*HYPERELASTIC, NEO HOOKE, POISSON=0.4\n1\n", "in place of `POISSON=0.4`"),
        ("*HYPERFOAM, N=1, POISSON=0.2\n0.1, 5\n", "in place of `POISSON=0.2`"),
        ("*HYPERELASTIC, YEOH, BETA=1\n1\n", "the options N, MODULI alone, not `BETA=1`"),
        ("*HYPERELASTIC, OGDEN, HYBRID\n1, 2\n", "one kind of law alone, not `HYBRID`, too"),
        ("*HYPERELASTIC, YEOH, MODULI=MEAN\n1\n", "MODULI=INSTANTANEOUS, MODULI=LONG TERM"),
        ("*HYPERELASTIC, YEOH\n1\n*PLASTIC\n1, 0\n", "line 3: found `*PLASTIC`; allowed: a `*HYPERELASTIC`"),
        (
            "*HYPERELASTIC, YEOH\n1\n*VISCOELASTIC, NONLINEAR, SRATIO=0.5\n",
            "line 3: found `*VISCOELASTIC, NON",
        ),
        ("*HYPERELASTIC, YEOH, MODULI=INSTANTANEOUS\n1\n*HYSTERESIS\n1, 1, 4, -1\n", "found `*HYSTERESIS`"),
        (
            "*HYPERELASTIC, YEOH, MODULI=INSTANTANEOUS\n1\n*VISCOELASTIC, TIME=PRONY\n0.6,,1\n0.5,,9\n",
            "line 3: found `*VISCOELASTIC, TIME=PRONY`; allowed: g and k whose sums",
        ),
        (
            "*HYPERFOAM, MODULI=INSTANTANEOUS\n1, 2, 0.1\n*VISCOELASTIC, TIME=PRONY\n0.5, 0, 1\n",
            "the same Prony series for shear and volume of a foam",
        ),
        ("*HYPERELASTIC, N=3\n1,0,0,1,0,0,0,0\n0,0,0,0,0,0\n", "1 to 12 numbers"),
        ("*HYPERELASTIC, REDUCED POLYNOMIAL, N=7\n1\n", "REDUCED POLYNOMIAL, N=6"),
        ("*HYPERFOAM, N=1\n1, 2, 0.5\n", "0.5 given"),
        ("*HYPERFOAM, N=9\n1, 2, 0.5\n", "N=1 to N=3"),
        ("*MATERIAL, NAME=GENT\n*USER MATERIAL, CONSTANTS=1\n1\n", "3 constants; 1 given"),
        ("*ELASTIC\n1, 0.3\n", "no `*HYPERELASTIC`"),
    ] {
        let error = parse("deck", deck).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
}

/// Data lines have eight cells, of which those at the end may be left out (Abaqus Keywords Guide).
#[test]
fn cells_left_out_at_the_end_of_a_line() {
    let one = |deck: &str| parse("deck", deck).unwrap().materials[0].clone();
    let found = one("*HYPERELASTIC, POLYNOMIAL, N=3\n0.3,0.05,0.001,0,0,1e-4\n,0.02\n");
    assert_eq!((found.model.key, found.bulk), ("biderman", Some(100.0)));
    let found = one("*HYPERFOAM, N=3\n0.2,7.,0.1,-2.,0.05,3.\n0.2\n");
    // β = ν/(1 − 2ν)
    assert_eq!(found.parameters, [0.2, 7.0, 0.0, 0.1, -2.0, 0.0, 0.05, 3.0, 0.2 / 0.6]);
    // one temperature, an exponent of Fortran
    let found = one("*HYPERELASTIC, NEO HOOKE\n1.5D-1, 2.d-2, 23.\n");
    assert_eq!((&found.parameters[..], found.bulk), (&[0.3][..], Some(100.0)));
    assert_eq!(found.notes, ["of the temperature 23 alone"]);
}

/// The sums of g and of k, 0.1 + 0.2 and 0.2 + 0.1 + 0, differ in the last digit; test data belong to the
/// keyword before; an unknown keyword outside of a material changes none.
#[test]
fn keywords_of_a_material() {
    let foam = "*HYPERFOAM, N=1, MODULI=INSTANTANEOUS\n0.2,7.,0.1\n*VISCOELASTIC, TIME=PRONY\n0.1,0.3,1\n\
                0.2,0.2,2\n0.3,0.1,10\n";
    assert_eq!(parse("deck", foam).unwrap().materials.len(), 1);
    let tests = "*MATERIAL, NAME=B\n*HYPERELASTIC, NEO HOOKE\n0.15, 0.05\n\
                 *VISCOELASTIC, TIME=RELAXATION TEST DATA\n*SHEAR TEST DATA\n0.9,1\n\
                 *VOLUMETRIC TEST DATA\n1,0.99\n*MULLINS EFFECT, TEST DATA INPUT, BETA=0.1\n\
                 *UNIAXIAL TEST DATA\n1,0.5\n";
    let found = parse("deck", tests).unwrap();
    assert!(found.left_out.is_empty() && found.materials[0].notes.len() == 2, "{found:?}");
    // of the law itself
    let own = "*HYPERELASTIC, NEO HOOKE\n0.15, 0.05\n*VOLUMETRIC TEST DATA\n1,0.99\n";
    assert!(parse("deck", own).is_err());
    let unknown = "*FOO\n1\n*MATERIAL, NAME=B\n*HYPERELASTIC, YEOH\n0.3\n*SHELL SECTION\n1\n*BAR\n1\n";
    assert!(parse("deck", unknown).unwrap().left_out.is_empty());
}

/// Warnings and another law above a material come back; those of the material before do not.
#[test]
fn comments_of_a_card_are_notes() {
    let deck = "** eight-chain fitted to a\n** warning: unstable\n*MATERIAL, NAME=A\n*HYPERELASTIC, \
                ARRUDA-BOYCE\n0.3, 5.\n** yeoh fitted to b\n*MATERIAL, NAME=B\n*HYPERELASTIC, YEOH\n0.3\n";
    let found = parse("deck", deck).unwrap().materials;
    assert_eq!(found[0].notes, ["warning: unstable", "written for `eight-chain`, read as `arruda-boyce`"]);
    assert!(found[1].notes.is_empty());
}

/// A byte-order mark, and Latin-1.
#[test]
fn encodings() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("d.inp");
    for start in [&b"\xef\xbb\xbf"[..], b"** f\xfcr\n"] {
        std::fs::write(&path, [start, b"*MATERIAL, NAME=B\n*HYPERELASTIC, YEOH\n0.15\n"].concat()).unwrap();
        assert_eq!(read(&path).unwrap().materials[0].name, "B");
    }
}

/// Moduli at t → ∞ by G(t) = G₀ (1 − Σ gᵢ (1 − e^(−t/τᵢ))) and the same of K with kᵢ: μ and C by 1 − 0.6, K
/// by 1 − 0.2; exponents stay.
#[test]
fn instantaneous_moduli_become_those_of_long_times() {
    let prony = "*VISCOELASTIC, TIME=PRONY\n0.5, 0.2, 1.0\n0.1, , 30.\n*MULLINS EFFECT\n2.0, 0.1, 0.1\n\
                 *EXPANSION\n1e-4\n";
    let one =
        |law: &str| parse("deck", &format!("*MATERIAL, NAME=A\n{law}{prony}")).unwrap().materials[0].clone();
    for (law, expected, bulk) in [
        ("*HYPERELASTIC, MOONEY-RIVLIN, MODULI=INSTANTANEOUS\n0.3, 0.1, 0.01\n", &[0.12, 0.04][..], 160.0),
        ("*HYPERELASTIC, OGDEN, MODULI=INSTANTANEOUS\n0.5, 3.0, 0.01\n", &[0.2, 3.0], 160.0),
        ("*HYPERELASTIC, MOONEY-RIVLIN\n0.3, 0.1, 0.01\n", &[0.3, 0.1], 200.0),
        ("*HYPERELASTIC, MOONEY-RIVLIN, MODULI=Long  Term\n0.3, 0.1, 0.01\n", &[0.3, 0.1], 200.0),
    ] {
        let found = one(law);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12 * b;
        let all = found.parameters.iter().zip(expected).all(|(a, b)| near(*a, *b));
        assert!(all && near(found.bulk.unwrap(), bulk), "{found:?}");
        let notes = found.notes.join("\n");
        let rate = if law.contains("INST") { "moduli of long times, 0.4" } else { "*VISCOELASTIC left out" };
        assert!(
            [rate, "*MULLINS EFFECT left out", "*EXPANSION left out"].iter().all(|part| notes.contains(part))
        );
    }
    let elastic = "*HYPERELASTIC, YEOH,\nMODULI=INSTANTANEOUS\n0.3, 0.0, 0.0\n";
    let found = parse("deck", elastic).unwrap().materials[0].clone();
    assert!(found.notes[0].contains("without *VISCOELASTIC") && found.parameters[0] == 0.3, "{found:?}");
}

/// Other materials are read beside one without a law here, and the deck beyond its materials is skipped.
#[test]
fn one_material_does_not_refuse_a_deck() {
    let deck = "*MATERIAL, NAME=STEEL\n*ELASTIC\n2e5, 0.3\n*MATERIAL, NAME=MARLOW\n*HYPERELASTIC, MARLOW\n1\n\
                *MATERIAL, NAME=SEAL\n*HYPERELASTIC, YEOH\n0.3\n*STEP\n*STATIC\n*DAMAGE\n*BOUNDARY\nA, 1\n\
                *FIELD\n1\n*INCLUDE, INPUT=more.inp\n";
    let found = parse("deck", deck).unwrap();
    assert_eq!((found.materials.len(), found.materials[0].name.as_str()), (1, "SEAL"));
    assert!(found.materials[0].notes.is_empty());
    assert_eq!(found.left_out[0], "material `STEEL`: line 1: no law of a rubber or foam; it has *ELASTIC");
    assert_eq!(found.left_out[2], "line 17: `*INCLUDE, INPUT=more.inp`: give that file by itself");
    assert!(found.left_out[1].starts_with("material `MARLOW`: line 5: found `*HYPERELASTIC, MARLOW`"));
}

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
        ("*HYPERELASTIC, NEO HOOKE\n1.0,,20\n", "of one temperature; 3 given"),
        ("*HYPERELASTIC, NEO HOOKE\n1, 0, 20\n2, 0, 40\n", "1 to 2 numbers, of one temperature; 6 given"),
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
        ("*HYPERELASTIC, N=3\n1,0,0,1,0,0,0,0\n0,0,0,0,0\n", "1 to 12 numbers"),
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

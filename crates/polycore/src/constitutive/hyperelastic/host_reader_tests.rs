//! Tests of materials of other programs.

use super::*;
use crate::constitutive::hyperelastic::MODELS;

const ALL: [CardProgram; 4] =
    [CardProgram::Ansys, CardProgram::LsDyna, CardProgram::Febio, CardProgram::Moose];

/// Energies at two states and K agree with the law that was written; ten digits are written, twelve decimals
/// of Poisson's ratio for K = 100 μ.
#[test]
fn every_law_returns_from_each_program() {
    let mut worst: f64 = 0.0;
    for host in ALL {
        let (mut text, mut written) = (String::new(), Vec::new());
        for (id, model) in (1..).zip(MODELS) {
            let law = model.law(model.example).unwrap();
            let bulk = 100.0 * law.shear_modulus();
            let Some(card) = host.card(id, model.key, model.key, model.example, &[2.0 / bulk]) else {
                continue;
            };
            text += &host.comment(&format!("{} fitted to bar; K: of no test", model.key));
            text += &card;
            written.push((model.key, law, bulk));
        }
        let deck = host.parse("cards", &text).unwrap();
        assert!(deck.left_out.is_empty() && deck.materials.len() == written.len(), "{deck:?}");
        for (found, (key, law, bulk)) in deck.materials.iter().zip(written) {
            assert!(found.name.contains(key), "{}: {key}", found.name);
            let own = found.model.law(&found.parameters).unwrap();
            for stretches in [[1.8, 0.7, 1.0 / (1.8 * 0.7)], [0.6, 1.2, 1.0 / (0.6 * 1.2)]] {
                let [a, b] = [&own, &law].map(|law| law.energy_at(stretches).unwrap());
                worst = worst.max((a / b - 1.0).abs());
            }
            worst = worst.max((found.bulk.unwrap() / bulk - 1.0).abs());
        }
    }
    evidence::at_most("laws and K that return from cards of other programs, relative", worst, 1e-8);
}

#[test]
fn terms_without_a_place_are_noted() {
    let deck = "TB,HYPER,4,1,3,YEOH\nTBDATA,1,0.2,2e-3,5e-5,0.05,2e-3,1e-4\nTB,DENS,4\nTBDATA,1,1e-9\n";
    let found = CardProgram::Ansys.parse("m.mac", deck).unwrap().materials[0].clone();
    assert_eq!((found.model.key, found.name.as_str(), found.bulk), ("yeoh", "material 4", Some(40.0)));
    assert_eq!(found.notes, ["d2 = 0.002, d3 = 0.0001 left out: K = 2/d1 is that at rest"]);
    // C10, C01, C11
    let three = "TB,HYPER,1,,3,MOONEY\nTBDATA,1,0.2,0.05\nTBDATA,3,0.01\n";
    let found = CardProgram::Ansys.parse("m.mac", three).unwrap().materials[0].clone();
    assert_eq!((&found.parameters[..], found.bulk), (&[0.2, 0.05, 0.0, 0.01, 0.0][..], None));
}

#[test]
fn materials_of_other_forms_are_named() {
    let wide = |cells: &[&str]| cells.iter().map(|cell| format!("{cell:>20}")).collect::<String>();
    let [head, six] = [wide(&["1", "1e-9", "0.49", "0"]), wide(&["1", "0", "0", "0", "0", "0"])];
    let fit = wide(&["1", "1e-9", "0.49", "2"]);
    for (host, text, part) in [
        (CardProgram::Ansys, "MP,EX,1,2e5\n".to_owned(), "no material of Ansys in a form"),
        (CardProgram::Ansys, "TB,HYPER,1,1,2,BLATZ\nTBDATA,1,1\n".to_owned(), "the options NEO, MOONEY"),
        (CardProgram::Ansys, "TB,HYPER,1,1,1,NEO\nTBDATA,1,MU\n".to_owned(), "a finite number, not `MU`"),
        (
            CardProgram::Ansys,
            "TB,HYPER,1,1,1,NEO\nTBDATA,1,1,2,3\n".to_owned(),
            "1 constants and 1 d; 3 given",
        ),
        (CardProgram::Ansys, "TB,HYPER,1,2,1,NEO\nTBTEMP,20\nTBDATA,1,1\n".to_owned(), "without TBTEMP"),
        (
            CardProgram::Ansys,
            "TB,HYPER,1,1,1,NEO\nTBDATA,1,1,2\nTB,PRONY,1,,1,SHEAR\n".to_owned(),
            "material 1: line 1: found `TB,HYPER,1,1,1,NEO`; allowed: a material without TB,PRONY",
        ),
        (CardProgram::LsDyna, format!("*MAT_077_H\n{head}\n{six}\n"), "fields of 20 characters"),
        (CardProgram::LsDyna, format!("*MAT_077_H+\n{fit}\n{six}\n"), "N of 0 and no relaxation"),
        (CardProgram::LsDyna, format!("*MAT_077_H+\n{head}\n{six}\n{six}\n"), "six constants of H"),
        (
            CardProgram::Febio,
            "<material id=\"1\" type=\"Holzapfel\"></material>".to_owned(),
            "the types Mooney",
        ),
        (
            CardProgram::Febio,
            "<material id=\"1\" type=\"Yeoh\"><c1 lc=\"1\">1</c1></material>".to_owned(),
            "without attributes, not <c1 lc",
        ),
        (
            CardProgram::Febio,
            "<material id=\"1\" type=\"Yeoh\"><c1>1</c1><k>9</k><q>1</q></material>".to_owned(),
            "constants of the law and <k> alone",
        ),
        (
            CardProgram::Moose,
            "[a]\ntype = ComputeNeoHookeanStress\nmu = 1\n[]\n".to_owned(),
            "constant `lambda`",
        ),
    ] {
        let error = host.parse("cards", &text).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
    assert_eq!(ALL.map(|host| CardProgram::find(host.extension())), ALL.map(Some));
}

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

/// Commands between, blanks and quotes of others, comments with a material, single quotes, line breaks.
#[test]
fn texts_as_others_write_them() {
    let read = |host: CardProgram, text: &str| host.parse("m", text).unwrap();
    let between = "TB,HYPER,1,1,3,YEOH\nTBDATA,1,0.2\n/COM, next\nMP,EX,1,3\nTBDATA,2,2e-3,5e-5,0.05\n\
                   TB,MOONEY,2\nTBDATA,1,0.2,0.1\nTB,BISO,3\n/EOF\nTB,HYPER,1,1,1,NEO\n";
    let found = read(CardProgram::Ansys, between);
    assert_eq!(
        (&found.materials[0].parameters[..], found.materials[0].bulk),
        (&[0.2, 2e-3, 5e-5][..], Some(40.0))
    );
    assert_eq!(found.left_out[0], "material 2: line 6: found `TB,MOONEY,2`; allowed: TB,HYPER alone");
    assert!(found.left_out.len() == 2 && found.left_out[1].contains("TB,BISO,3"), "{found:?}");
    let one_line = "TB,HYPER,1,1,1,NEO $ TBDATA,1,0.4,0.05 ! rubber $ TBDATA,1,7\n";
    assert_eq!(read(CardProgram::Ansys, one_line).materials[0].parameters, [0.4]);
    let hidden = "<!-- µ <material id=\"1\" name=\"x\" type=\"Yeoh\">\n<c1>1</c1><k>1</k></material> -->\n\
                  <material\n id=\"2\" name='y' type = \"Yeoh\">\n<c1>2</c1><!-- a --><k>10</k></material>";
    let found = read(CardProgram::Febio, hidden);
    assert_eq!((found.materials.len(), found.materials[0].name.as_str()), (1, "material y"));
    assert_eq!((found.materials[0].parameters[0], found.materials[0].bulk), (4.0, Some(10.0)));
    let block = "[a]\ntype = \"ComputeNeoHookeanStress\" # law\nlambda = '10' # λ\nmu = 3\n";
    let found = read(CardProgram::Moose, &format!("{block}[]\n{block}large_kinematics = false\n[]\n"));
    assert_eq!((&found.materials[0].parameters[..], found.materials[0].bulk), (&[3.0][..], Some(12.0)));
    assert!(found.materials.len() == 1 && found.left_out[0].contains("large_kinematics = true"), "{found:?}");
    assert_eq!(["key", "dyn"].map(CardProgram::find), [Some(CardProgram::LsDyna); 2]);
}

/// Warnings of a card come back as notes, in all programs.
#[test]
fn comments_of_a_card_are_notes() {
    for host in ALL {
        let card = |id| host.card(id, "a", "neo-hookean", &[0.4], &[0.05]).unwrap();
        let title = host.comment("neo-hookean fitted to bar");
        let first = format!("{title}{}{}", host.comment("warning: unstable"), card(1));
        let found = host.parse("m", &format!("{first}{title}{}", card(2))).unwrap().materials;
        assert_eq!(found[0].notes, ["warning: unstable"], "{host:?}");
        assert!(found.len() == 2 && found[1].notes.is_empty(), "{host:?}");
    }
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
        (CardProgram::Ansys, "TB,HYPER,1,1,1000000000000,YEOH\nTBDATA,1,1\n".to_owned(), "1 to 9 points"),
        (
            CardProgram::Ansys,
            "TB,HYPER,1,1,1,NEO\nTBDATA,1,1\nTBLIST\nTBMODIF,1,1,2\n".to_owned(),
            "without TBMODIF",
        ),
        (
            CardProgram::Ansys,
            "TB,HYPER,1,1,1,NEO\nTBDATA,1,1\nTB,EXPE\n".to_owned(),
            "a material without TB,EXPE",
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

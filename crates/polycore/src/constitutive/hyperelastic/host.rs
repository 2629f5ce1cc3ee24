//! Fitted laws as materials of Ansys, LS-DYNA, FEBio and MOOSE; those of Abaqus and CalculiX are in
//! [`super::deck`].

use super::any_model;
use super::deck::left_out;

/// Finite-element program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum CardProgram {
    /// Mechanical APDL, `TB,HYPER`.
    Ansys,
    /// `*MAT_077_H`, `*MAT_077_O`, in long format.
    LsDyna,
    /// Uncoupled materials of version 3 and later.
    Febio,
    /// `ComputeNeoHookeanStress` of its Lagrangian kernels.
    Moose,
}

impl CardProgram {
    /// Name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ansys => "Ansys",
            Self::LsDyna => "LS-DYNA",
            Self::Febio => "FEBio",
            Self::Moose => "MOOSE",
        }
    }

    /// Ending of its files.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Ansys => "mac",
            Self::LsDyna => "k",
            Self::Febio => "feb",
            Self::Moose => "i",
        }
    }

    /// Formats a line as a comment.
    pub fn comment(self, text: &str) -> String {
        match self {
            Self::Ansys => format!("! {text}\n"),
            Self::LsDyna => format!("$ {text}\n"),
            Self::Febio => format!("<!-- {} -->\n", text.replace("--", "- -")),
            Self::Moose => format!("# {text}\n"),
        }
    }

    /// Formats a law as material number `id` with a name, stresses in the host's unit, with the Dᵢ of the
    /// volumetric energy Σ (J − 1)²ⁱ/Dᵢ; `None` if the program has no such law. Terms that the card has no
    /// place for are named in a comment.
    pub fn card(
        self,
        id: usize,
        name: &str,
        key: &str,
        parameters: &[f64],
        compliances: &[f64],
    ) -> Option<String> {
        let bulk = compliances.first().map_or(f64::INFINITY, |d| 2.0 / d);
        let (card, held) = match self {
            Self::Ansys => ansys(id, key, parameters, compliances)?,
            Self::LsDyna => (ls_dyna(id, key, parameters, bulk)?, 1),
            Self::Febio => (febio(id, name, key, parameters, bulk)?, 1),
            Self::Moose => (moose(id, key, parameters, bulk)?, 1),
        };
        Some(left_out(compliances, held).map_or_else(String::new, |note| self.comment(&note)) + &card)
    }
}

/// C₁₀, C₀₁, C₂₀, C₁₁, C₀₂, C₃₀ of a polynomial in I₁ − 3 and I₂ − 3.
fn polynomial(key: &str, parameters: &[f64]) -> Option<[f64; 6]> {
    Some(match (key, parameters) {
        ("neo-hookean", &[modulus]) => [0.5 * modulus, 0.0, 0.0, 0.0, 0.0, 0.0],
        ("mooney-rivlin", &[a, b]) => [a, b, 0.0, 0.0, 0.0, 0.0],
        ("reduced-polynomial-2", &[a, b]) => [a, 0.0, b, 0.0, 0.0, 0.0],
        ("yeoh", &[a, b, c]) => [a, 0.0, b, 0.0, 0.0, c],
        ("polynomial-2", &[a, b, c, d, e]) => [a, b, c, d, e, 0.0],
        ("biderman", &[a, b, c, d]) => [a, b, c, 0.0, 0.0, d],
        _ => return None,
    })
}

/// Terms (μ, α) of Ogden's law, Σ 2μ/α² (Σ λ^α − 3).
fn ogden(key: &str, parameters: &[f64]) -> Option<Vec<[f64; 2]>> {
    key.starts_with("ogden-").then(|| parameters.chunks_exact(2).map(|term| [term[0], term[1]]).collect())
}

/// Returns true for polynomials in I₁ − 3 of two terms and more.
fn is_series(key: &str) -> bool {
    key == "yeoh" || key.starts_with("reduced-polynomial-")
}

/// Material, and the number of Dᵢ that it holds. Energies and order of constants are those of the Material
/// Reference, 4.6, and the Structural Analysis Guide, 8.4.1.2 (d = 2/K; Ogden's Σ μᵢ/αᵢ (Σ λ^αᵢ − 3)). Seen
/// elsewhere: NEO (μ = 2C₁₀, d), YEOH (all c, then all d) and the nine terms of the polynomial in Ansys' own
/// converter of Abaqus decks (`src/ansys/meshing/prime/internals/utils.py` of ansys/pyprimemesh), the five of
/// MOONEY in Ansys' example `techdemo-15` (ansys/pymapdl-examples), OGDEN (μ₁, α₁, μ₂, α₂, d₁) in the Guide's
/// listing; BOYCE, GENT and ETUBE in the Reference alone. FOAM, Σ μᵢ/αᵢ (Σ λ^αᵢ − 3 + (J^(−αᵢβᵢ) − 1)/βᵢ),
/// has all μᵢ, αᵢ, then all βᵢ (8.4.1.2.9), and no d.
fn ansys(id: usize, key: &str, p: &[f64], compliances: &[f64]) -> Option<(String, usize)> {
    let (terms, option, mut constants) = match (key, p) {
        ("neo-hookean", _) => (1, "NEO", p.to_vec()),
        ("arruda-boyce", _) => (1, "BOYCE", p.to_vec()),
        ("gent", _) => (1, "GENT", p.to_vec()),
        ("extended-tube", _) => (1, "ETUBE", p.to_vec()),
        (key, _) if is_series(key) => (p.len(), "YEOH", p.to_vec()),
        ("mooney-rivlin", _) => (2, "MOONEY", p.to_vec()),
        ("polynomial-2", _) => (5, "MOONEY", p.to_vec()),
        ("polynomial-3", _) => (9, "MOONEY", p.to_vec()),
        ("biderman", &[a, b, c, d]) => (9, "MOONEY", vec![a, b, c, 0.0, 0.0, d, 0.0, 0.0, 0.0]),
        (key, _) if key.starts_with("hyperfoam-") => {
            let pairs = p.chunks_exact(3).flat_map(|term| [2.0 * term[0] / term[1], term[1]]);
            (p.len() / 3, "FOAM", pairs.chain(p.iter().skip(2).step_by(3).copied()).collect())
        }
        _ => {
            let own = ogden(key, p)?;
            (own.len(), "OGDEN", own.iter().flat_map(|[mu, alpha]| [2.0 * mu / alpha, *alpha]).collect())
        }
    };
    // d₁ to d_N stand after the constants
    let held = match option {
        "YEOH" | "OGDEN" => terms,
        "FOAM" => 0,
        _ => 1,
    };
    let zero_if_soft = |d: &f64| if d.is_finite() { *d } else { 0.0 };
    constants.extend(compliances.iter().take(held).map(zero_if_soft));
    let rows = constants.chunks(6).enumerate().map(|(i, row)| {
        let numbers: String = row.iter().map(|number| format!(",{number:.9e}")).collect();
        format!("TBDATA,{}{numbers}\n", 6 * i + 1)
    });
    Some((format!("TB,HYPER,{id},1,{terms},{option}\n{}", rows.collect::<String>()), held))
}

/// Order of constants by the manual, volume II, and by `mat_077_H.cfg` and `mat_077_O.cfg` of OpenRadioss:
/// C10, C01, C11, C20, C02, C30; a row of μ, a row of α of Σ μᵢ/αᵢ (Σ λ^αᵢ − 3). K from Poisson's ratio.
fn ls_dyna(id: usize, key: &str, p: &[f64], bulk: f64) -> Option<String> {
    let shear = any_model(key).ok()?.law(p).ok()?.shear_modulus();
    let poisson = (3.0 * bulk - 2.0 * shear) / (6.0 * bulk + 2.0 * shear);
    let row = |numbers: &[f64]| numbers.iter().map(|number| format!("{number:>20.9e}")).collect::<String>();
    let (keyword, rows) = match polynomial(key, p) {
        // C10 C01 C11 C20 C02 C30
        Some([a, b, c, d, e, f]) => ("*MAT_077_H+", vec![row(&[a, b, d, c, e, f])]),
        None => {
            let terms = ogden(key, p)?;
            let moduli: Vec<f64> = terms.iter().map(|[mu, alpha]| 2.0 * mu / alpha).collect();
            let exponents: Vec<f64> = terms.iter().map(|[_, alpha]| *alpha).collect();
            ("*MAT_077_O+", vec![row(&moduli), row(&exponents)])
        }
    };
    let density = "&rho";
    Some(format!("{keyword}\n{id:>20}{density:>20}{poisson:>20.12}{:>20}\n{}\n", 0, rows.join("\n")))
}

/// Names and energies of FEBio's sources, in J^(−1/3) F: c₁ (I₁ − 3) + c₂ (I₂ − 3) (`FEMooneyRivlin.cpp`),
/// Σ cᵢ (I₁ − 3)ⁱ (`FEYeoh.cpp`), W₁ = ½ G Jm/(Jm − I₁ + 3) (`FEGentMaterial.cpp`), λ ∂W/∂λ = Σ cᵢ/mᵢ λ^mᵢ
/// (`FEOgdenMaterial.cpp`), and ½k ln²J (`FEUncoupledMaterial.h`). Its Arruda–Boyce differs between versions,
/// and none is written.
fn febio(id: usize, name: &str, key: &str, p: &[f64], bulk: f64) -> Option<String> {
    let tags = |name: &str, values: &[f64]| -> Vec<(String, f64)> {
        (1..).zip(values).map(|(i, value)| (format!("{name}{i}"), *value)).collect()
    };
    let (kind, mut constants) = match (key, p) {
        ("neo-hookean", &[modulus]) => ("Mooney-Rivlin", tags("c", &[0.5 * modulus, 0.0])),
        ("mooney-rivlin", _) => ("Mooney-Rivlin", tags("c", p)),
        (key, _) if is_series(key) => ("Yeoh", tags("c", p)),
        ("gent", &[modulus, limit]) => ("Gent", vec![("G".to_owned(), modulus), ("Jm".to_owned(), limit)]),
        _ => {
            let terms = ogden(key, p)?;
            let moduli: Vec<f64> = terms.iter().map(|[mu, _]| 2.0 * mu).collect();
            let exponents: Vec<f64> = terms.iter().map(|[_, alpha]| *alpha).collect();
            ("Ogden", [tags("c", &moduli), tags("m", &exponents)].concat())
        }
    };
    constants.push(("k".to_owned(), bulk));
    let lines = constants.iter().map(|(tag, value)| format!("  <{tag}>{value:.9e}</{tag}>\n"));
    let lines: String = lines.collect();
    Some(format!("<material id=\"{id}\" name=\"{name}\" type=\"{kind}\">\n{lines}</material>\n"))
}

/// S = (λ ln J − μ) C⁻¹ + μ 1, i.e. W = ½μ(I₁ − 3) − μ ln J + ½λ ln²J, with λ = K − ⅔μ
/// (`ComputeNeoHookeanStress.C` of MOOSE's solid_mechanics): its only law of a rubber.
fn moose(id: usize, key: &str, p: &[f64], bulk: f64) -> Option<String> {
    let ("neo-hookean", &[modulus]) = (key, p) else { return None };
    let lame = bulk - 2.0 / 3.0 * modulus;
    Some(format!(
        "[Materials]\n  [neo_hookean_{id}]\n    type = ComputeNeoHookeanStress\n    lambda = \
         {lame:.9e}\n    mu = {modulus:.9e}\n    large_kinematics = true\n  []\n[]\n"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::hyperelastic::MODELS;

    const STRETCHES: [f64; 3] = [1.8, 0.7, 1.0 / (1.8 * 0.7)];

    /// All numbers of some lines, separated by `,`, blanks or tags.
    fn numbers(text: &str) -> Vec<f64> {
        let cells = text.split(|c: char| c == ',' || c == '<' || c == '>' || c.is_whitespace());
        cells.filter_map(|cell| cell.parse().ok()).collect()
    }

    fn invariants() -> [f64; 2] {
        [2, -2].map(|power| STRETCHES.iter().map(|l| l.powi(power)).sum::<f64>() - 3.0)
    }

    fn powers(exponent: f64) -> f64 {
        STRETCHES.iter().map(|l| l.powf(exponent)).sum::<f64>() - 3.0
    }

    /// Energy of a card by the formula of its program's manual, at constant volume.
    fn energy(host: CardProgram, card: &str) -> f64 {
        let [x, y] = invariants();
        let head = card.lines().next().unwrap();
        let series = |c: &[f64]| (1..).zip(c).map(|(i, c)| c * x.powi(i)).sum::<f64>();
        match host {
            CardProgram::Ansys => {
                // the first number of each line is the place of the next constant
                let c: Vec<f64> = card.lines().skip(1).flat_map(|line| numbers(line)[1..].to_vec()).collect();
                match head.rsplit(',').next().unwrap() {
                    "NEO" => 0.5 * c[0] * x,
                    "YEOH" => series(&c[..c.len() - 1]),
                    "GENT" => -0.5 * c[0] * c[1] * (1.0 - x / c[1]).ln(),
                    "BOYCE" => {
                        let (i, l) = (x + 3.0, c[1]);
                        let term = |(k, a): (i32, f64)| a / l.powi(2 * k - 2) * (i.powi(k) - 3.0_f64.powi(k));
                        let factors = [0.5, 1.0 / 20.0, 11.0 / 1050.0, 19.0 / 7000.0, 519.0 / 673_750.0];
                        c[0] * (1..).zip(factors).map(term).sum::<f64>()
                    }
                    "ETUBE" => {
                        let room = 1.0 - c[1] * c[1] * x;
                        0.5 * c[0] * ((1.0 - c[1] * c[1]) * x / room + room.ln())
                            + 2.0 * c[2] / (c[3] * c[3]) * powers(-c[3])
                    }
                    "OGDEN" => {
                        c[..c.len() - 1].chunks(2).map(|term| term[0] / term[1] * powers(term[1])).sum()
                    }
                    _ => {
                        let terms = [x, y, x * x, x * y, y * y, x.powi(3), x * x * y, x * y * y, y.powi(3)];
                        c[..c.len() - 1].iter().zip(terms).map(|(c, term)| c * term).sum()
                    }
                }
            }
            CardProgram::LsDyna => {
                let rows: Vec<Vec<f64>> = card.lines().skip(2).map(numbers).collect();
                match head {
                    "*MAT_077_H+" => {
                        let terms = [x, y, x * y, x * x, y * y, x.powi(3)];
                        rows[0].iter().zip(terms).map(|(c, term)| c * term).sum()
                    }
                    _ => rows[0].iter().zip(&rows[1]).map(|(mu, alpha)| mu / alpha * powers(*alpha)).sum(),
                }
            }
            // of F with J = 1
            CardProgram::Moose => 0.5 * numbers(card)[1] * x,
            CardProgram::Febio => {
                let c = numbers(&card[head.len()..]);
                match head.split("type=\"").nth(1).unwrap().split('"').next().unwrap() {
                    "Mooney-Rivlin" => c[0] * x + c[1] * y,
                    "Yeoh" => series(&c[..c.len() - 1]),
                    "Gent" => -0.5 * c[0] * c[1] * (1.0 - x / c[1]).ln(),
                    _ => {
                        let (moduli, exponents) = c[..c.len() - 1].split_at((c.len() - 1) / 2);
                        moduli.iter().zip(exponents).map(|(c, m)| c / (m * m) * powers(*m)).sum()
                    }
                }
            }
        }
    }

    /// Energies of all cards, by the manuals' formulas, are those of the laws; seven digits are written.
    #[test]
    fn cards_have_the_energies_of_their_laws() {
        let mut worst: f64 = 0.0;
        for (host, expected) in [
            (CardProgram::Ansys, 16),
            (CardProgram::LsDyna, 9),
            (CardProgram::Febio, 11),
            (CardProgram::Moose, 1),
        ] {
            let mut count = 0;
            for model in MODELS {
                let Some(card) = host.card(3, model.key, model.key, model.example, &[5e-8]) else { continue };
                let law = model.law(model.example).unwrap().energy_at(STRETCHES).unwrap();
                worst = worst.max((energy(host, &card) / law - 1.0).abs());
                count += 1;
            }
            assert_eq!(count, expected, "{}", host.name());
        }
        evidence::at_most("energies of cards by their programs' formulas, relative", worst, 5e-6);
    }

    /// Two terms: μ₁, α₁, μ₂, α₂, β₁, β₂, with twice the moduli over the exponents of Abaqus.
    #[test]
    fn foam_of_ansys() {
        let parameters = [4.1625, 4.5, 0.92, 20.7, -4.5, 0.5];
        let card = CardProgram::Ansys.card(1, "pad", "hyperfoam-2", &parameters, &[]).unwrap();
        let expected = "TB,HYPER,1,1,2,FOAM\nTBDATA,1,1.850000000e0,4.500000000e0,-9.200000000e0,\
                        -4.500000000e0,9.200000000e-1,5.000000000e-1\n";
        assert_eq!(card, expected);
        let found = CardProgram::Ansys.parse("m.mac", &card).unwrap().materials.remove(0);
        assert_eq!((found.model.key, found.bulk), ("hyperfoam-2", None));
        let off = found.parameters.iter().zip(parameters).map(|(a, b)| (a / b - 1.0).abs());
        assert!(off.fold(0.0, f64::max) < 1e-9, "{:?}", found.parameters);
        assert_eq!(CardProgram::LsDyna.card(1, "pad", "hyperfoam-2", &parameters, &[]), None);
    }

    /// K = 40 MPa: d = 2/K; ν, λ = K − ⅔μ from K and μ = 0.4 MPa.
    #[test]
    fn bulk_moduli_in_the_form_of_each_program() {
        let card = |host: CardProgram| host.card(1, "bar", "neo-hookean", &[0.4], &[0.05]).unwrap();
        assert_eq!(card(CardProgram::Ansys), "TB,HYPER,1,1,1,NEO\nTBDATA,1,4.000000000e-1,5.000000000e-2\n");
        let poisson = numbers(card(CardProgram::LsDyna).lines().nth(1).unwrap())[1];
        assert!((poisson - (120.0 - 0.8) / 240.8).abs() < 1e-12, "{poisson}");
        assert!(card(CardProgram::Febio).contains("<k>4.000000000e1</k>"), "{}", card(CardProgram::Febio));
        let [lame, modulus] = numbers(&card(CardProgram::Moose))[..] else { panic!() };
        assert!((lame - (40.0 - 0.8 / 3.0)).abs() < 1e-5 && modulus == 0.4, "{lame} {modulus}");
        for (host, key) in [
            (CardProgram::Moose, "mooney-rivlin"),
            (CardProgram::Febio, "arruda-boyce"),
            (CardProgram::LsDyna, "gent"),
            (CardProgram::Ansys, "van-der-waals"),
        ] {
            let model = any_model(key).unwrap();
            assert_eq!(host.card(1, key, key, model.example, &[2e-9]), None);
        }
        let all = [0.05, 2e-3];
        let yeoh = CardProgram::Ansys.card(1, "bar", "yeoh", &[0.2, 2e-3, 5e-5], &all).unwrap();
        assert!(yeoh.ends_with("5.000000000e-5,5.000000000e-2,2.000000000e-3\n"), "{yeoh}");
        for host in [CardProgram::LsDyna, CardProgram::Febio] {
            let card = host.card(1, "bar", "yeoh", &[0.2, 2e-3, 5e-5], &all).unwrap();
            let note = "left out: D2 = 2.000000000e-3; this material has D1 alone";
            assert!(card.starts_with(&host.comment(note)), "{card}");
        }
    }
}

//! Laws as materials of Abaqus and CalculiX: `*HYPERELASTIC`, `*HYPERFOAM`, and the user materials of crate
//! `umat`; [`super::deck_reader`] reads them.

/// `*HYPERELASTIC` of a law.
pub(super) struct DeckForm {
    pub key: &'static str,
    pub kind: &'static str,
    /// N; 0 for a kind without it.
    pub order: usize,
    /// Number of coefficients on the data lines, before D.
    pub coefficients: usize,
    /// Position of each parameter among the coefficients; the others are 0.
    pub places: &'static [usize],
    /// Coefficient per parameter: ½ of μ in C₁₀.
    pub factor: f64,
}

const fn form(
    key: &'static str,
    kind: &'static str,
    order: usize,
    coefficients: usize,
    places: &'static [usize],
) -> DeckForm {
    DeckForm { key, kind, order, coefficients, places, factor: 1.0 }
}

/// Forms (Abaqus Keywords Guide, `*HYPERELASTIC`); of a law with several the first is written.
pub(super) const FORMS: [DeckForm; 18] = [
    DeckForm { factor: 0.5, ..form("neo-hookean", "NEO HOOKE", 0, 1, &[0]) },
    DeckForm { factor: 0.5, ..form("neo-hookean", "REDUCED POLYNOMIAL", 1, 1, &[0]) },
    form("mooney-rivlin", "MOONEY-RIVLIN", 0, 2, &[0, 1]),
    form("mooney-rivlin", "POLYNOMIAL", 1, 2, &[0, 1]),
    form("yeoh", "YEOH", 0, 3, &[0, 1, 2]),
    form("yeoh", "REDUCED POLYNOMIAL", 3, 3, &[0, 1, 2]),
    form("reduced-polynomial-2", "REDUCED POLYNOMIAL", 2, 2, &[0, 1]),
    form("reduced-polynomial-4", "REDUCED POLYNOMIAL", 4, 4, &[0, 1, 2, 3]),
    form("reduced-polynomial-5", "REDUCED POLYNOMIAL", 5, 5, &[0, 1, 2, 3, 4]),
    form("reduced-polynomial-6", "REDUCED POLYNOMIAL", 6, 6, &[0, 1, 2, 3, 4, 5]),
    form("polynomial-2", "POLYNOMIAL", 2, 5, &[0, 1, 2, 3, 4]),
    form("biderman", "POLYNOMIAL", 3, 9, &[0, 1, 2, 5]),
    form("polynomial-3", "POLYNOMIAL", 3, 9, &[0, 1, 2, 3, 4, 5, 6, 7, 8]),
    form("arruda-boyce", "ARRUDA-BOYCE", 0, 2, &[0, 1]),
    form("van-der-waals", "VAN DER WAALS", 0, 4, &[0, 1, 2, 3]),
    form("ogden-1", "OGDEN", 1, 2, &[0, 1]),
    form("ogden-2", "OGDEN", 2, 4, &[0, 1, 2, 3]),
    form("ogden-3", "OGDEN", 3, 6, &[0, 1, 2, 3, 4, 5]),
];

impl DeckForm {
    /// Returns true if all coefficients that are no parameters are 0.
    pub fn covers(&self, coefficients: &[f64]) -> bool {
        let given = coefficients.iter().take(self.coefficients).enumerate();
        given.filter(|(i, _)| !self.places.contains(i)).all(|(_, coefficient)| *coefficient == 0.0)
    }

    /// Number of Dᵢ.
    pub fn compliances(&self) -> usize {
        if self.key == "yeoh" { 3 } else { self.order.max(1) }
    }
}

/// Formats a law as the material `name`, stresses in the host's unit, with the Dᵢ of the volumetric energy
/// Σ (J − 1)²ⁱ/Dᵢ, D₁ = 2/K: `*HYPERELASTIC` if hosts have the law (of `eight-chain` the five terms of
/// `ARRUDA-BOYCE`, too soft near locking), `*HYPERFOAM` without Dᵢ, otherwise the user material of crate
/// `umat`. Terms that the card has no place for are named in a comment. CalculiX has no `VAN DER WAALS`.
/// `ARRUDA-BOYCE` and `VAN DER WAALS` have (½(J² − 1) − ln J)/D₁, of the same K (Abaqus Theory Guide, 4.6.1).
pub fn card(name: &str, key: &str, parameters: &[f64], compliances: &[f64]) -> String {
    let unlocked: Vec<f64>;
    let (key, parameters) = match (key, parameters) {
        ("eight-chain", &[modulus, links]) => {
            unlocked = vec![modulus, links.sqrt()];
            ("arruda-boyce", &unlocked[..])
        }
        other => other,
    };
    if let Some(form) = FORMS.iter().find(|form| form.key == key) {
        let mut numbers = vec![0.0; form.coefficients + form.compliances()];
        form.places.iter().zip(parameters).for_each(|(&place, value)| numbers[place] = form.factor * value);
        let held = &mut numbers[form.coefficients..];
        let terms = held.iter_mut().zip(compliances);
        // a term without stiffness has D of 0
        terms.for_each(|(place, d)| *place = if d.is_finite() { *d } else { 0.0 });
        let note = match left_out(compliances, held.len()) {
            Some(note) => format!("** {note}\n"),
            None => String::new(),
        };
        let order = if form.order > 0 { format!(", N={}", form.order) } else { String::new() };
        let kind = form.kind;
        return format!("{note}*MATERIAL, NAME={name}\n*HYPERELASTIC, {kind}{order}\n{}", lines(&numbers));
    }
    if key.starts_with("hyperfoam") {
        let terms = parameters.chunks_exact(3);
        let ratios = terms.clone().map(|term| term[2] / (1.0 + 2.0 * term[2]));
        let numbers: Vec<f64> = terms.clone().flat_map(|term| [term[0], term[1]]).chain(ratios).collect();
        return format!("*MATERIAL, NAME={name}\n*HYPERFOAM, N={}\n{}", terms.len(), lines(&numbers));
    }
    let bulk = compliances.first().map_or(f64::INFINITY, |d| 2.0 / d);
    let note = left_out(compliances, 1).map_or_else(String::new, |note| format!("** {note}\n"));
    let numbers: Vec<f64> = std::iter::once(bulk).chain(parameters.iter().copied()).collect();
    let constants = numbers.len();
    format!(
        "{note}** of crate umat; in CalculiX NAME=USER_{name}\n*MATERIAL, NAME={name}\n*USER MATERIAL, \
         CONSTANTS={constants}\n{}",
        lines(&numbers)
    )
}

/// Names the terms of a volumetric energy beyond those that a card holds; `None` if it holds all.
pub(super) fn left_out(compliances: &[f64], held: usize) -> Option<String> {
    let beyond = compliances.iter().enumerate().skip(held).filter(|(_, d)| d.is_finite());
    let terms: Vec<String> = beyond.map(|(i, d)| format!("D{} = {d:.9e}", i + 1)).collect();
    let first = if held == 1 { "D1".to_owned() } else { format!("D1 to D{held}") };
    (!terms.is_empty()).then(|| format!("left out: {}; this material has {first} alone", terms.join(", ")))
}

/// Formats eight numbers per line.
pub(crate) fn lines(numbers: &[f64]) -> String {
    let row = |row: &[f64]| row.iter().map(|x| format!("{x:.9e}")).collect::<Vec<_>>().join(", ") + "\n";
    numbers.chunks(8).map(row).collect()
}

/// Most characters of a material's name, less room for a number (Abaqus: 80).
const LONGEST_NAME: usize = 72;

/// Returns the name of a law fitted to a table, `YEOH_BAR`: a user material begins with its law. The name of
/// the table may be empty.
pub fn material_name(key: &str, table: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' };
    let parts = [key, table].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join("_");
    parts.chars().map(plain).take(LONGEST_NAME).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::hyperelastic::deck_reader::{DeckMaterial, parse};
    use crate::constitutive::hyperelastic::{COMPRESSIBLE_MODELS, MODELS, ModelKind, any_model};

    /// First material of a card, which is the only one.
    fn returned(text: &str) -> DeckMaterial {
        let deck = parse("deck", text).unwrap();
        assert!(deck.materials.len() == 1 && deck.left_out.is_empty(), "{deck:?}");
        deck.materials[0].clone()
    }

    /// Seven digits are written.
    #[test]
    fn every_law_returns_from_its_card() {
        let mut worst: f64 = 0.0;
        for model in MODELS.iter().chain(COMPRESSIBLE_MODELS) {
            let name = material_name(model.key, "bar, 23 °C");
            let text = card(&name, model.key, model.example, &[5e-8]);
            assert!(text.lines().all(|line| line.len() < 256), "{text}");
            let found = returned(&text);
            assert!(found.name.ends_with("_BAR__23__C"), "{text}");
            let expected: Vec<f64> = match model.key {
                "eight-chain" => vec![model.example[0], model.example[1].sqrt()],
                _ => model.example.to_vec(),
            };
            let key = if model.key == "eight-chain" { "arruda-boyce" } else { model.key };
            assert_eq!((found.model.key, found.parameters.len()), (key, expected.len()), "{text}");
            for (found, expected) in found.parameters.iter().zip(expected) {
                worst = worst.max((found - expected).abs() / expected.abs().max(1.0));
            }
            let bulk = (model.kind != ModelKind::Compressible).then_some(4e7);
            assert_eq!(found.bulk.map(f64::round), bulk, "{text}");
        }
        evidence::at_most("parameters that return from a deck, relative", worst, 1e-6);
    }

    /// Dᵢ of a volumetric test stand where a kind has them, and are named where it has not.
    #[test]
    fn terms_of_the_volumetric_energy() {
        let all = [0.05, 2e-3, 1e-4];
        let yeoh = card("Y", "yeoh", &[0.2, 0.002, 5e-5], &all);
        assert!(yeoh.ends_with("5.000000000e-5, 5.000000000e-2, 2.000000000e-3, 1.000000000e-4\n"), "{yeoh}");
        assert!(!yeoh.contains("left out"), "{yeoh}");
        let note = "D2 = 0.002, D3 = 0.0001 left out: K = 2/D1 is that at rest";
        let found = returned(&yeoh);
        assert_eq!((found.bulk.map(f64::round), &found.notes[..]), (Some(40.0), &[note.to_owned()][..]));
        let two = card("O", "ogden-2", &[0.4, 2.0, 0.1, -1.5], &all);
        assert!(
            two.starts_with("** left out: D3 = 1.000000000e-4; this material has D1 to D2 alone\n"),
            "{two}"
        );
        assert!(two.ends_with("5.000000000e-2, 2.000000000e-3\n"), "{two}");
        for key in ["neo-hookean", "gent"] {
            let model = any_model(key).unwrap();
            let one = card(&material_name(key, ""), key, model.example, &all);
            let note = "** left out: D2 = 2.000000000e-3, D3 = 1.000000000e-4; this material has D1 alone\n";
            assert!(one.starts_with(note), "{one}");
            assert_eq!(returned(&one).bulk.map(f64::round), Some(40.0));
        }
        // a term that the test does not have
        assert!(
            card("O", "ogden-2", &[0.4, 2.0, 0.1, -1.5], &[0.05, f64::INFINITY]).ends_with("0.000000000e0\n")
        );
    }
}

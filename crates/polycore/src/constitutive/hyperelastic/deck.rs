//! Laws as materials of Abaqus and CalculiX: `*HYPERELASTIC`, `*HYPERFOAM`, and the user materials of crate
//! `umat`, written and read.

use std::path::Path;

use super::{COMPRESSIBLE_MODELS, Error, MODELS, ModelDescriptor, ModelKind, any_model};

/// Material of a deck, stresses in the deck's unit.
#[derive(Debug, Clone)]
pub struct DeckMaterial {
    /// Name in the deck.
    pub name: String,
    /// Model of the law.
    pub model: &'static ModelDescriptor,
    /// Parameters in the order of the model.
    pub parameters: Vec<f64>,
    /// Bulk modulus, 2/D₁; `None` for D₁ = 0, a law at constant volume, and for foams.
    pub bulk: Option<f64>,
}

/// `*HYPERELASTIC` of a law.
struct DeckForm {
    key: &'static str,
    kind: &'static str,
    /// N; 0 for a kind without it.
    order: usize,
    /// Number of coefficients on the data lines, before D.
    coefficients: usize,
    /// Position of each parameter among the coefficients; the others are 0.
    places: &'static [usize],
    /// Coefficient per parameter: ½ of μ in C₁₀.
    factor: f64,
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
const FORMS: [DeckForm; 18] = [
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
    fn covers(&self, coefficients: &[f64]) -> bool {
        let given = coefficients.iter().take(self.coefficients).enumerate();
        given.filter(|(i, _)| !self.places.contains(i)).all(|(_, coefficient)| *coefficient == 0.0)
    }

    /// Number of Dᵢ.
    fn compliances(&self) -> usize {
        if self.key == "yeoh" { 3 } else { self.order.max(1) }
    }
}

/// Formats a law as a material, stresses in the host's unit, with the Dᵢ of the volumetric energy
/// Σ (J − 1)²ⁱ/Dᵢ, D₁ = 2/K: `*HYPERELASTIC` if hosts have the law (of `eight-chain` the five terms of
/// `ARRUDA-BOYCE`, too soft near locking), `*HYPERFOAM` without Dᵢ, otherwise the user material of crate
/// `umat`. Terms that the card has no place for are named in a comment. CalculiX has no `VAN DER WAALS`.
/// `ARRUDA-BOYCE` and `VAN DER WAALS` have (½(J² − 1) − ln J)/D₁, of the same K (Abaqus Theory Guide, 4.6.1).
pub fn card(key: &str, parameters: &[f64], compliances: &[f64]) -> String {
    let name = key.to_uppercase().replace('-', "_");
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

/// Reads the hyperelastic materials of a deck; see [`parse`].
///
/// # Errors
/// [`crate::Error::Io`]; as [`parse`].
pub fn read(path: impl AsRef<Path>) -> Result<Vec<DeckMaterial>, crate::Error> {
    let path = path.as_ref();
    let text = std::fs::read_to_string(path).map_err(crate::Error::from_io("read", path))?;
    Ok(parse(&path.display().to_string(), &text)?)
}

/// Reads `*HYPERELASTIC` with parameters, `*HYPERFOAM`, and user materials that bear the name of a law; other
/// keywords are skipped. Each law is checked.
///
/// # Errors
/// [`Error::Data`] with the line: a kind or an order without a law in this crate, test data in place of
/// parameters, numbers that are missing, too many or of several temperatures, Dᵢ ≠ 0 for i > 1, no such
/// material; [`Error::Parameter`].
pub fn parse(name: &str, text: &str) -> Result<Vec<DeckMaterial>, Error> {
    let refused = |line: usize, found: &str, allowed: &str| Error::Data {
        what: name.to_owned(),
        reason: format!("line {line}: found `{found}`; allowed: {allowed}"),
    };
    let all: Vec<(usize, &str)> = (1..).zip(text.lines().map(str::trim)).collect();
    let is_data = |line: &str| !line.is_empty() && !line.starts_with("**");
    let (mut materials, mut own_name) = (Vec::new(), String::new());
    for (at, &(line, written)) in all.iter().enumerate() {
        if !written.starts_with('*') || written.starts_with("**") {
            continue;
        }
        let mut parts = written.split(',').map(|part| part.trim().to_uppercase());
        let keyword = parts.next().unwrap_or_default();
        let options: Vec<String> = parts.filter(|part| !part.is_empty()).collect();
        let value = |key: &str| {
            let matching = |option: &String| {
                let (found, value) = option.split_once('=')?;
                (found.trim() == key).then(|| value.trim().to_owned())
            };
            options.iter().find_map(matching)
        };
        if keyword == "*MATERIAL" {
            own_name = value("NAME").unwrap_or_default().trim_matches('"').to_owned();
        }
        if !["*HYPERELASTIC", "*HYPERFOAM", "*USER MATERIAL"].contains(&keyword.as_str()) {
            continue;
        }
        if options.iter().any(|option| option == "TEST DATA INPUT") {
            let allowed = "parameters; `[[fit.data]]` and `[[foam]]` fit laws to tests";
            return Err(refused(line, written, allowed));
        }
        let mut numbers = Vec::new();
        let rows = all[at + 1..].iter().take_while(|(_, row)| !row.starts_with('*') || row.starts_with("**"));
        for &(line, row) in rows.filter(|(_, row)| is_data(row)) {
            // a blank is 0, that after a comma at the end is none
            let row = row.strip_suffix(',').unwrap_or(row);
            for cell in row.split(',').map(str::trim) {
                let number = if cell.is_empty() { Ok(0.0) } else { cell.parse::<f64>() };
                let finite = number.ok().filter(|number| number.is_finite());
                numbers.push(finite.ok_or_else(|| refused(line, cell, "a finite number"))?);
            }
        }
        let order =
            value("N").map_or(Ok(1), |n| n.parse::<usize>().map_err(|_| refused(line, &n, "N=1, 2, 3")))?;
        let found = match keyword.as_str() {
            "*HYPERELASTIC" => rubber(&options, order, &numbers),
            "*HYPERFOAM" => foam(order, &numbers),
            _ => match user(&own_name, &numbers) {
                Some(found) => found,
                None => continue,
            },
        };
        let (model, parameters, bulk) = found.map_err(|allowed| refused(line, written, &allowed))?;
        model.law(&parameters)?;
        materials.push(DeckMaterial { name: own_name.clone(), model, parameters, bulk });
    }
    if materials.is_empty() {
        let reason = "no `*HYPERELASTIC`, `*HYPERFOAM` or user material of a law".to_owned();
        return Err(Error::Data { what: name.to_owned(), reason });
    }
    Ok(materials)
}

/// Model, parameters, and bulk modulus of data lines; or what is allowed.
type DeckLaw = Result<(&'static ModelDescriptor, Vec<f64>, Option<f64>), String>;

/// Checks the number of cells; missing ones at the end are 0, as in Abaqus.
fn cells(numbers: &[f64], count: usize) -> Result<Vec<f64>, String> {
    if numbers.is_empty() || numbers.len() > count {
        return Err(format!("1 to {count} numbers, of one temperature; {} given", numbers.len()));
    }
    Ok(numbers.iter().copied().chain(std::iter::repeat(0.0)).take(count).collect())
}

fn rubber(options: &[String], order: usize, numbers: &[f64]) -> DeckLaw {
    // Abaqus' default
    let other = |option: &&String| !option.contains('=');
    let kind = options.iter().find(other).map_or("POLYNOMIAL", String::as_str);
    let fits = |form: &&DeckForm| form.kind == kind && (form.order == 0 || form.order == order);
    let Some(form) = FORMS.iter().filter(fits).find(|form| form.covers(numbers)) else {
        let named = |form: &DeckForm| match form.order {
            0 => form.kind.to_owned(),
            order => format!("{}, N={order}", form.kind),
        };
        return Err(FORMS.iter().map(named).collect::<Vec<_>>().join("; "));
    };
    let numbers = cells(numbers, form.coefficients + form.compliances())?;
    let (coefficients, compliances) = numbers.split_at(form.coefficients);
    if compliances[0] < 0.0 || compliances[1..].iter().any(|compliance| *compliance != 0.0) {
        return Err("D1 of 0 or above, all other D 0: laws have K = 2/D1 alone".to_owned());
    }
    let parameters = form.places.iter().map(|&place| coefficients[place] / form.factor).collect();
    let bulk = (compliances[0] > 0.0).then(|| 2.0 / compliances[0]);
    Ok((any_model(form.key).map_err(|error| error.to_string())?, parameters, bulk))
}

fn foam(order: usize, numbers: &[f64]) -> DeckLaw {
    let most = COMPRESSIBLE_MODELS.len();
    let Some(model) = order.checked_sub(1).and_then(|index| COMPRESSIBLE_MODELS.get(index)) else {
        return Err(format!("N=1 to N={most}"));
    };
    let numbers = cells(numbers, 3 * order)?;
    let (moments, ratios) = numbers.split_at(2 * order);
    if let Some(ratio) = ratios.iter().find(|ratio| !(-1.0..0.5).contains(*ratio)) {
        return Err(format!("ν in (−1, ½); {ratio} given"));
    }
    // β = ν/(1 − 2ν)
    let term = |(pair, ratio): (&[f64], &f64)| [pair[0], pair[1], ratio / (1.0 - 2.0 * ratio)];
    Ok((model, moments.chunks_exact(2).zip(ratios).flat_map(term).collect(), None))
}

/// Law whose name the material begins with, as crate `umat` selects it; `None` if there is none.
fn user(name: &str, numbers: &[f64]) -> Option<DeckLaw> {
    let lower = name.to_lowercase().replace('_', "-");
    let lower = lower.strip_prefix("user-").unwrap_or(&lower);
    let begins =
        |key: &str| lower.strip_prefix(key).is_some_and(|rest| rest.is_empty() || rest.starts_with('-'));
    let models = MODELS.iter().chain(COMPRESSIBLE_MODELS).filter(|model| begins(model.key));
    let model = models.max_by_key(|model| model.key.len())?;
    let own = usize::from(model.kind != ModelKind::Compressible);
    if numbers.len() != model.parameters.len() + own {
        return Some(Err(format!("{} constants; {} given", model.parameters.len() + own, numbers.len())));
    }
    Some(Ok((model, numbers[own..].to_vec(), (own == 1).then(|| numbers[0]))))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seven digits are written.
    #[test]
    fn every_law_returns_from_its_card() {
        let mut worst: f64 = 0.0;
        for model in MODELS.iter().chain(COMPRESSIBLE_MODELS) {
            let text = card(model.key, model.example, &[5e-8]);
            assert!(text.lines().all(|line| line.len() < 256), "{text}");
            let found = &parse("deck", &text).unwrap()[0];
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
        let yeoh = card("yeoh", &[0.2, 0.002, 5e-5], &all);
        assert!(yeoh.ends_with("5.000000000e-5, 5.000000000e-2, 2.000000000e-3, 1.000000000e-4\n"), "{yeoh}");
        assert!(!yeoh.contains("left out"), "{yeoh}");
        assert!(parse("deck", &yeoh).unwrap_err().to_string().contains("all other D 0"));
        let two = card("ogden-2", &[0.4, 2.0, 0.1, -1.5], &all);
        assert!(
            two.starts_with("** left out: D3 = 1.000000000e-4; this material has D1 to D2 alone\n"),
            "{two}"
        );
        assert!(two.ends_with("5.000000000e-2, 2.000000000e-3\n"), "{two}");
        for key in ["neo-hookean", "gent"] {
            let model = any_model(key).unwrap();
            let one = card(key, model.example, &all);
            let note = "** left out: D2 = 2.000000000e-3, D3 = 1.000000000e-4; this material has D1 alone\n";
            assert!(one.starts_with(note), "{one}");
            assert_eq!(parse("deck", &one).unwrap()[0].bulk.map(f64::round), Some(40.0));
        }
        // a term that the test does not have
        assert!(card("ogden-2", &[0.4, 2.0, 0.1, -1.5], &[0.05, f64::INFINITY]).ends_with("0.000000000e0\n"));
    }

    #[test]
    fn decks_as_others_write_them() {
        let deck = "*Heading\n** rubber\n*Material, name=Seal\n*Density\n1e-9,\n*Hyperelastic, n=2, ogden\n\
                    0.4, 1.3,2e-3, 5.\n*Material, name=\"Pad\"\n*Hyperelastic, reduced polynomial, N=3\n\
                    0.2, 2e-3, 5e-5, 0.05\n*Hyperfoam\n0.2, 7., 0.25\n*User material, constants=2\n1., 2.\n";
        let found = parse("deck", deck).unwrap();
        let shown: Vec<_> = found.iter().map(|one| (one.name.as_str(), one.model.key, one.bulk)).collect();
        let expected = [("SEAL", "ogden-2", None), ("PAD", "yeoh", Some(40.0)), ("PAD", "hyperfoam-1", None)];
        assert_eq!(shown, expected);
        assert_eq!(found[0].parameters, [0.4, 1.3, 2e-3, 5.0]);
        assert_eq!(found[2].parameters, [0.2, 7.0, 0.5]);
        // the same keyword without terms that Biderman's law lacks, and with one
        let third = |row: &str| parse("deck", &format!("*HYPERELASTIC, N=3\n{row}\n")).unwrap()[0].model.key;
        assert_eq!(third("1, 0.1, 0.01, 0, 0, 1e-4"), "biderman");
        assert_eq!(third("1, 0.1, 0.01, 0, 0, 1e-4, 1e-5"), "polynomial-3");
        // C10, a blank C01, D1
        let blank = parse("deck", "*HYPERELASTIC, MOONEY-RIVLIN\n0.5, , 0.02,\n").unwrap();
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
            ("*HYPERELASTIC, YEOH\n1,0,0,0.1,0.1,0\n", "all other D 0"),
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
}

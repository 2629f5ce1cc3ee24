//! Materials of Abaqus and CalculiX decks as laws: `*HYPERELASTIC` with parameters, `*HYPERFOAM`, and user
//! materials of crate `umat`.

use std::path::Path;

use super::deck::{DeckForm, FORMS};
use super::deck_keywords::{DeckKeyword, KeywordClass, card_notes, class, decoded, keywords};
use super::{COMPRESSIBLE_MODELS, Error, MODELS, ModelDescriptor, ModelKind, any_model};

/// Material of a deck, stresses in the deck's unit.
#[derive(Debug, Clone)]
pub struct DeckMaterial {
    /// Name in the deck.
    pub name: String,
    /// Model of the law.
    pub model: &'static ModelDescriptor,
    /// Parameters in the order of the model, of long times.
    pub parameters: Vec<f64>,
    /// Bulk modulus, 2/D₁; `None` for D₁ = 0, a law at constant volume, and for foams.
    pub bulk: Option<f64>,
    /// Properties of the material that the law does not have, and conversions, a line each.
    pub notes: Vec<String>,
}

/// Materials read from a deck.
#[derive(Debug, Clone, Default)]
pub struct MaterialDeck {
    /// Materials with a law.
    pub materials: Vec<DeckMaterial>,
    /// Materials left out, each with its line and the reason.
    pub left_out: Vec<String>,
}

impl MaterialDeck {
    /// Checks that a deck has a material with a law.
    ///
    /// # Errors
    /// [`Error::Data`] with the materials left out, or with `needed` if there are none at all.
    pub(super) fn checked(self, name: &str, needed: &str) -> Result<Self, Error> {
        if !self.materials.is_empty() {
            return Ok(self);
        }
        let reason = if self.left_out.is_empty() { needed.to_owned() } else { self.left_out.join("; ") };
        Err(Error::Data { what: name.to_owned(), reason })
    }
}

/// Reads the hyperelastic materials of a deck; see [`parse`].
///
/// # Errors
/// [`crate::Error::Io`]; as [`parse`].
pub fn read(path: impl AsRef<Path>) -> Result<MaterialDeck, crate::Error> {
    let path = path.as_ref();
    let text = decoded(&std::fs::read(path).map_err(crate::Error::from_io("read", path))?);
    Ok(parse(&path.display().to_string(), &text)?)
}

/// Reads `*HYPERELASTIC` with parameters, `*HYPERFOAM`, and user materials that bear the name of a law; each
/// law is checked. `MODULI=INSTANTANEOUS` with the Prony series of a `*VISCOELASTIC` is converted to the law
/// of long times; D₂ and more, rates, softening and what is no elasticity are noted.
///
/// A material ends at the next `*MATERIAL` or where another block begins. Left out are materials whose
/// law is not in this crate or is changed by another keyword: an unknown keyword or an `*INCLUDE` inside the
/// material, a kind, an order or an option that is unknown, test data in place of parameters, numbers that
/// are missing, too many or of several temperatures, plasticity, creep, other branches; and parameters
/// outside their domain.
///
/// # Errors
/// [`Error::Data`] if no material can be read, with the reasons.
pub fn parse(name: &str, text: &str) -> Result<MaterialDeck, Error> {
    let mut deck = MaterialDeck::default();
    let mut group: Vec<DeckKeyword> = Vec::new();
    // a keyword whose test data follow
    let mut tested = false;
    for keyword in keywords(text) {
        let class = class(&keyword.name);
        if matches!(class, Some(KeywordClass::Material | KeywordClass::Outside)) {
            deck.add(&std::mem::take(&mut group));
        }
        if keyword.name == "*INCLUDE" {
            let (line, written) = (keyword.line, keyword.written);
            deck.left_out.push(format!("line {line}: `{written}`: give that file by itself"));
        }
        if tested && keyword.name.ends_with(" TEST DATA") {
            continue;
        }
        tested = !matches!(class, Some(KeywordClass::Law)) && keyword.has_test_data();
        match class {
            Some(KeywordClass::Outside) => {}
            // outside of materials
            None if group.is_empty() => {}
            _ => group.push(keyword),
        }
    }
    deck.add(&group);
    deck.checked(name, "no `*HYPERELASTIC`, `*HYPERFOAM` or user material of a law")
}

impl MaterialDeck {
    /// Adds the laws of a material, or the reason to leave it out.
    fn add(&mut self, group: &[DeckKeyword]) {
        let head = group.iter().find(|keyword| keyword.name == "*MATERIAL");
        let name = head.and_then(|head| head.value("NAME")).unwrap_or_default();
        let name = name.trim_matches('"').to_owned();
        let laws: Vec<&DeckKeyword> =
            group.iter().filter(|one| class(&one.name) == Some(KeywordClass::Law)).collect();
        for law in &laws {
            match material(&name, law, group) {
                Ok(found) => self.materials.push(found),
                Err(reason) => self.left_out.push(format!("{}{reason}", titled(&name))),
            }
        }
        if let (Some(head), true) = (head, laws.is_empty()) {
            let others: Vec<&str> = group[1..].iter().map(|one| one.name.as_str()).collect();
            let has = if others.is_empty() { "nothing".to_owned() } else { others.join(", ") };
            let reason = format!("line {}: no law of a rubber or foam; it has {has}", head.line);
            self.left_out.push(titled(&name) + &reason);
        }
    }
}

/// Name before a message.
fn titled(name: &str) -> String {
    if name.is_empty() { String::new() } else { format!("material `{name}`: ") }
}

/// Reads a law and what the other keywords of its material do to it.
///
/// # Errors
/// The line, what was found there and what is allowed.
fn material(name: &str, law: &DeckKeyword, group: &[DeckKeyword]) -> Result<DeckMaterial, String> {
    let refused = |keyword: &DeckKeyword, allowed: &str| {
        format!("line {}: found `{}`; allowed: {allowed}", keyword.line, keyword.written)
    };
    if law.options.iter().any(|option| option == "TEST DATA INPUT") {
        return Err(refused(law, "parameters; `[[fit.data]]` and `[[foam]]` fit laws to tests"));
    }
    let numbers = law.numbers()?;
    let order = match law.value("N") {
        Some(n) => n.parse().map_err(|_| refused(law, "N=1, 2, 3"))?,
        None => 1,
    };
    let mut notes = Vec::new();
    let found = match law.name.as_str() {
        "*HYPERELASTIC" => rubber(law, order, &numbers, &mut notes),
        "*HYPERFOAM" => foam(law, order, &numbers, &mut notes),
        _ => user(name, law, &numbers),
    };
    let (model, mut parameters, mut bulk) = found.map_err(|allowed| refused(law, &allowed))?;
    for keyword in group.iter().filter(|keyword| !std::ptr::eq(*keyword, law)) {
        let own = &keyword.name;
        match class(own) {
            Some(KeywordClass::Other) => {
                let why = format!("a `{}` without it: it changes the law", law.name);
                return Err(refused(keyword, &why));
            }
            Some(KeywordClass::Beyond) => {
                notes.push(format!("{own} left out: the law is that of the first loading"))
            }
            Some(KeywordClass::Apart) => notes.push(format!("{own} left out: no elasticity")),
            None => {
                let why = "known properties, as this one may change the law; what belongs to no material \
                           stands before the first `*MATERIAL`";
                return Err(refused(keyword, why));
            }
            _ => {}
        }
    }
    let rate = group.iter().filter(|keyword| class(&keyword.name) == Some(KeywordClass::Rate));
    if let Some([shear, volume]) = relaxed(law, &rate.collect::<Vec<_>>(), &mut notes)? {
        if model.kind == ModelKind::Compressible && (shear - volume).abs() > 1e-9 {
            return Err(refused(law, "the same Prony series for shear and volume of a foam, g = k"));
        }
        let stresses = parameters.iter_mut().zip(model.parameters).filter(|(_, own)| own.unit == "Pa");
        stresses.for_each(|(value, _)| *value *= shear);
        bulk = bulk.map(|bulk| bulk * volume);
    }
    model.law(&parameters).map_err(|error| refused(law, &error.to_string()))?;
    let head = group.first().filter(|head| head.name == "*MATERIAL").unwrap_or(law);
    notes.extend(card_notes(&head.comments, model.key));
    Ok(DeckMaterial { name: name.to_owned(), model, parameters, bulk, notes })
}

/// Shares of the shear and bulk moduli at long times, 1 − Σg and 1 − Σk, of instantaneous moduli with a Prony
/// series (Abaqus Analysis Guide, *Time domain viscoelasticity*); `None` if the moduli are those of long
/// times.
fn relaxed(
    law: &DeckKeyword,
    rate: &[&DeckKeyword],
    notes: &mut Vec<String>,
) -> Result<Option<[f64; 2]>, String> {
    let refused = |keyword: &DeckKeyword, allowed: &str| {
        format!("line {}: found `{}`; allowed: {allowed}", keyword.line, keyword.written)
    };
    if let Some(keyword) = rate.iter().find(|keyword| keyword.options.iter().any(|one| one == "NONLINEAR")) {
        return Err(refused(keyword, "a `*VISCOELASTIC` without `NONLINEAR`, whose branches share the law"));
    }
    if let (Some(keyword), "*USER MATERIAL") = (rate.first(), law.name.as_str()) {
        return Err(refused(keyword, "a user material without it"));
    }
    let instantaneous = match law.value("MODULI").as_deref() {
        Some("INSTANTANEOUS") => true,
        None | Some("LONG TERM" | "LONGTERM") => false,
        Some(_) => return Err(refused(law, "MODULI=INSTANTANEOUS, MODULI=LONG TERM")),
    };
    match (instantaneous, rate) {
        (true, []) => {
            notes.push("MODULI=INSTANTANEOUS without *VISCOELASTIC: the law of all times".to_owned())
        }
        (true, [series]) if series.value("TIME").as_deref() == Some("PRONY") => {
            let mut shares = [1.0; 2];
            for row in series.rows()? {
                (0..2).for_each(|i| shares[i] -= row.get(i).copied().unwrap_or(0.0));
            }
            if shares.iter().any(|share| !(*share > 0.0 && *share <= 1.0 + 1e-12)) {
                return Err(refused(series, "g and k whose sums are from 0 to below 1"));
            }
            let [shear, volume] = shares;
            notes.push(format!(
                "MODULI=INSTANTANEOUS: moduli of long times, {shear:.6} times those of the deck, K \
                 {volume:.6} times; the relaxation is left out"
            ));
            return Ok(Some(shares));
        }
        (true, [keyword, ..]) => {
            return Err(refused(keyword, "`*VISCOELASTIC, TIME=PRONY` alone with MODULI=INSTANTANEOUS"));
        }
        (false, rate) => {
            let left_out =
                |keyword: &&DeckKeyword| format!("{} left out: the law is that at rest", keyword.name);
            notes.extend(rate.iter().map(left_out));
        }
    }
    Ok(None)
}

/// Model, parameters, and bulk modulus of data lines; or what is allowed.
type DeckLaw = Result<(&'static ModelDescriptor, Vec<f64>, Option<f64>), String>;

/// Checks the number of cells; missing ones at the end are 0, as in Abaqus, and one more is the temperature.
fn cells(numbers: &[f64], count: usize, notes: &mut Vec<String>) -> Result<Vec<f64>, String> {
    if numbers.is_empty() || numbers.len() > count + 1 {
        return Err(format!(
            "1 to {count} numbers, eight a line, and a temperature; {} given with the blanks of full lines",
            numbers.len()
        ));
    }
    if let Some(temperature) = numbers.get(count) {
        notes.push(format!("of the temperature {temperature} alone"));
    }
    Ok(numbers.iter().copied().chain(std::iter::repeat(0.0)).take(count).collect())
}

/// Refuses options of a law other than these.
fn check_options(law: &DeckKeyword, allowed: &[&str]) -> Result<(), String> {
    let name = |option: &str| option.split('=').next().unwrap_or_default().trim().to_owned();
    match law.options.iter().find(|option| option.contains('=') && !allowed.contains(&name(option).as_str()))
    {
        Some(option) if name(option) == "POISSON" => {
            Err(format!("numbers of the volume on the data lines in place of `{option}`"))
        }
        Some(option) => Err(format!("the options {} alone, not `{option}`", allowed.join(", "))),
        None => Ok(()),
    }
}

fn rubber(law: &DeckKeyword, order: usize, numbers: &[f64], notes: &mut Vec<String>) -> DeckLaw {
    check_options(law, &["N", "MODULI"])?;
    // Abaqus' default
    let kinds: Vec<&str> = law.options.iter().filter(|one| !one.contains('=')).map(String::as_str).collect();
    let kind = match kinds[..] {
        [] => "POLYNOMIAL",
        [kind] => kind,
        [_, other, ..] => return Err(format!("one kind of law alone, not `{other}`, too")),
    };
    let fits = |form: &&DeckForm| form.kind == kind && (form.order == 0 || form.order == order);
    let Some(form) = FORMS.iter().filter(fits).find(|form| form.covers(numbers)) else {
        let named = |form: &DeckForm| match form.order {
            0 => form.kind.to_owned(),
            order => format!("{}, N={order}", form.kind),
        };
        return Err(FORMS.iter().map(named).collect::<Vec<_>>().join("; "));
    };
    let numbers = cells(numbers, form.coefficients + form.compliances(), notes)?;
    let (coefficients, compliances) = numbers.split_at(form.coefficients);
    let more: Vec<String> = (2..)
        .zip(&compliances[1..])
        .filter(|(_, d)| **d != 0.0)
        .map(|(i, d)| format!("D{i} = {d}"))
        .collect();
    if compliances[0] < 0.0 || (compliances[0] == 0.0 && !more.is_empty()) {
        return Err("D1 above 0, or all D of 0: laws have K = 2/D1".to_owned());
    }
    if !more.is_empty() {
        notes.push(format!("{} left out: K = 2/D1 is that at rest", more.join(", ")));
    }
    let parameters = form.places.iter().map(|&place| coefficients[place] / form.factor).collect();
    let bulk = (compliances[0] > 0.0).then(|| 2.0 / compliances[0]);
    if bulk.is_some_and(f64::is_infinite) {
        return Err(format!("D1 of a finite K = 2/D1, or 0 for constant volume; {:e} given", compliances[0]));
    }
    Ok((any_model(form.key).map_err(|error| error.to_string())?, parameters, bulk))
}

fn foam(law: &DeckKeyword, order: usize, numbers: &[f64], notes: &mut Vec<String>) -> DeckLaw {
    check_options(law, &["N", "MODULI"])?;
    let most = COMPRESSIBLE_MODELS.len();
    let Some(model) = order.checked_sub(1).and_then(|index| COMPRESSIBLE_MODELS.get(index)) else {
        return Err(format!("N=1 to N={most}"));
    };
    let numbers = cells(numbers, 3 * order, notes)?;
    let (moments, ratios) = numbers.split_at(2 * order);
    if let Some(ratio) = ratios.iter().find(|ratio| !(-1.0..0.5).contains(*ratio)) {
        return Err(format!("ν in (−1, ½); {ratio} given"));
    }
    // β = ν/(1 − 2ν)
    let term = |(pair, ratio): (&[f64], &f64)| [pair[0], pair[1], ratio / (1.0 - 2.0 * ratio)];
    Ok((model, moments.chunks_exact(2).zip(ratios).flat_map(term).collect(), None))
}

/// Law whose name the material begins with, as crate `umat` selects it.
fn user(name: &str, law: &DeckKeyword, numbers: &[f64]) -> DeckLaw {
    let lower = name.to_lowercase().replace('_', "-");
    let lower = lower.strip_prefix("user-").unwrap_or(&lower);
    let begins =
        |key: &str| lower.strip_prefix(key).is_some_and(|rest| rest.is_empty() || rest.starts_with('-'));
    let models = MODELS.iter().chain(COMPRESSIBLE_MODELS).filter(|model| begins(model.key));
    let Some(model) = models.max_by_key(|model| model.key.len()) else {
        return Err("a material whose name begins with that of a law, as crate `umat` has it".to_owned());
    };
    if law.value("TYPE").is_some_and(|kind| kind != "MECHANICAL") {
        return Err("TYPE=MECHANICAL".to_owned());
    }
    let own = usize::from(model.kind != ModelKind::Compressible);
    if numbers.len() != model.parameters.len() + own {
        return Err(format!("{} constants; {} given", model.parameters.len() + own, numbers.len()));
    }
    Ok((model, numbers[own..].to_vec(), (own == 1).then(|| numbers[0])))
}

#[cfg(test)]
#[path = "deck_reader_tests.rs"]
mod tests;

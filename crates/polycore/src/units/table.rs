//! Table of unit symbols: those of `uom` that are single words.

use std::collections::HashMap;
use std::sync::LazyLock;

use super::{Exponents, exponents};

type UnitTable = HashMap<&'static str, ([f64; 2], Exponents)>;

/// Longest symbol; longer ones are historical (`libra`, `congius`) and would only spoil the suggestions.
const LONGEST_SYMBOL: usize = 4;

static TABLE: LazyLock<UnitTable> = LazyLock::new(|| {
    let mut table = UnitTable::new();
    macro_rules! add {
        ($($quantity:ident, $type:ident, $exponents:expr;)+) => {$(
            for unit in uom::si::$quantity::units() {
                let symbol = unit.abbreviation();
                let in_word = |c: char| c.is_alphabetic() || "°%‰".contains(c);
                let word = !symbol.is_empty() && symbol.chars().all(in_word);
                if !word || symbol.chars().count() > LONGEST_SYMBOL || affine(symbol).is_some() {
                    continue;
                }
                // uom gives factors only through its types; its parser makes them enumerable
                if let Ok(one) = format!("1 {symbol}").parse::<uom::si::f64::$type>() {
                    table.entry(symbol).or_insert((fraction(one.value), $exponents));
                }
            }
        )+};
    }
    add! {
        ratio, Ratio, exponents!(ratio);
        length, Length, exponents!(length);
        mass, Mass, exponents!(mass);
        time, Time, exponents!(time);
        temperature_interval, TemperatureInterval, exponents!(temperature_interval);
        amount_of_substance, AmountOfSubstance, exponents!(amount_of_substance);
        electric_current, ElectricCurrent, exponents!(electric_current);
        force, Force, exponents!(force);
        pressure, Pressure, exponents!(pressure);
        energy, Energy, exponents!(energy);
        power, Power, exponents!(power);
        frequency, Frequency, exponents!(frequency);
        volume, Volume, exponents!(volume);
        angle, Angle, [0, 0, 0, 0, 0, 0, 0, 1];
    }
    let aliases = [
        ("deg", "°"),
        ("l", "L"),
        ("ml", "mL"),
        ("sec", "s"),
        ("hr", "h"),
        ("Angstrom", "Å"),
        ("angstrom", "Å"),
    ];
    for (alias, symbol) in aliases {
        if let Some(&entry) = table.get(symbol) {
            table.entry(alias).or_insert(entry);
        }
    }
    // a turn a minute
    table.entry("rpm").or_insert(([std::f64::consts::TAU, 60.0], [0, 0, -1, 0, 0, 0, 0, 1]));
    // ab initio programs print pressures in kbar
    if let Some(&([bar, one], exponents)) = table.get("bar") {
        table.entry("kbar").or_insert(([1000.0 * bar, one], exponents));
    }
    table
});

/// Numerator and denominator of a factor. One over a whole number stays exact: 1 g is [1, 1000] kg, so that
/// 1.01 g/cm³ is 1010 kg/m³ to the last bit.
fn fraction(factor: f64) -> [f64; 2] {
    let inverse = (1.0 / factor).round();
    let exact = factor < 1.0 && inverse < 1e22 && (inverse * factor - 1.0).abs() <= 2.0 * f64::EPSILON;
    if exact { [1.0, inverse] } else { [factor, 1.0] }
}

/// Factor to SI (numerator, denominator) and dimension of one symbol; `um`, `μm` (Greek) and `µm` (micro
/// sign) are the same.
pub(super) fn symbol(text: &str) -> Option<([f64; 2], Exponents)> {
    let direct = TABLE.get(text);
    let micro = || text.strip_prefix(['u', 'μ']).and_then(|rest| TABLE.get(format!("µ{rest}").as_str()));
    direct.or_else(micro).copied()
}

/// Factor and zero point of the affine temperature scales: T = (number + zero)·factor.
pub(super) fn affine(unit: &str) -> Option<(f64, f64)> {
    match unit {
        "degC" | "°C" | "℃" => Some((1.0, 273.15)),
        "degF" | "°F" | "℉" => Some((5.0 / 9.0, 459.67)),
        _ => None,
    }
}

/// The nearest known symbol, for "did you mean".
pub(super) fn nearest(text: &str) -> Option<String> {
    const COMMON_UNITS: &str = "m mm cm km nm µm kg g mg t s ms min h d K degC N kN mN MN Pa kPa MPa GPa bar \
                         kbar atm J kJ mJ MJ W mW kW Hz kHz L mL rad deg % mol A cal eV";
    let names = [
        ("celsius", "degC"),
        ("kelvin", "K"),
        ("pascal", "Pa"),
        ("newton", "N"),
        ("meter", "m"),
        ("metre", "m"),
        ("second", "s"),
        ("minute", "min"),
        ("hour", "h"),
        ("gram", "g"),
        ("kilogram", "kg"),
        ("joule", "J"),
        ("watt", "W"),
        ("c", "degC"),
        ("millimeter", "mm"),
        ("millimetre", "mm"),
        ("megapascal", "MPa"),
        ("kilopascal", "kPa"),
        ("gigapascal", "GPa"),
        ("kilonewton", "kN"),
        ("millinewton", "mN"),
        ("kilojoule", "kJ"),
        ("millijoule", "mJ"),
        ("nanometer", "nm"),
        ("nanometre", "nm"),
        ("micrometer", "µm"),
        ("micrometre", "µm"),
        ("micron", "µm"),
        ("centimeter", "cm"),
        ("centimetre", "cm"),
        ("kilometer", "km"),
        ("kilometre", "km"),
        ("angstrom", "Å"),
        ("ångström", "Å"),
        ("ångstrom", "Å"),
        ("angström", "Å"),
        ("millisecond", "ms"),
        ("degree", "deg"),
        ("radian", "rad"),
        ("liter", "L"),
        ("litre", "L"),
        ("fahrenheit", "degF"),
        ("percent", "%"),
        ("hertz", "Hz"),
    ];
    let lower = text.to_lowercase();
    let singular = lower.strip_suffix('s').filter(|s| !s.is_empty()).unwrap_or(&lower);
    if let Some((_, symbol)) = names.iter().find(|(name, _)| *name == lower || *name == singular) {
        return Some((*symbol).to_owned());
    }
    let candidates = COMMON_UNITS.split_whitespace();
    if let Some(same) = candidates.clone().find(|c| c.to_lowercase() == lower) {
        return Some(same.to_owned());
    }
    let scored = candidates.map(|c| (strsim::damerau_levenshtein(c, text), c));
    scored.filter(|(distance, _)| *distance <= 1).min().map(|(_, c)| c.to_owned())
}

#[cfg(test)]
pub(super) fn symbols() -> impl Iterator<Item = &'static str> {
    TABLE.keys().copied()
}

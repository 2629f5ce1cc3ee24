//! Constants in a file, for hosts that do not pass all: CalculiX takes six of a thermal material.

use crate::constants::{COMMON_COUNT, NAMES};
use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;

/// Value of constant `kinetics` that selects the file.
const IN_FILE: f64 = 3.0;

/// Name, constants of the host, and the whole list.
type CachedList = (String, Vec<f64>, Rc<[f64]>);

thread_local! {
    /// Constants of the last call on this thread.
    static LAST: RefCell<Option<CachedList>> = const { RefCell::new(None) };
}

/// Returns true if constants 7 to 15 of a list are in a file.
pub fn is_asked(list: &[f64]) -> bool {
    list.get(3) == Some(&IN_FILE)
}

/// Completes the constants of a material: 7 to 15 from `name.umatht` in a folder, named after the material in
/// lower case, with a line `growth_rate = 37869.0` (TOML) for each.
///
/// # Errors
/// A file that cannot be read, a missing or unknown name, a value that is no number.
pub fn complete(folder: &Path, name: &str, list: &[f64]) -> Result<Rc<[f64]>, String> {
    let name = name.trim().to_lowercase();
    LAST.with_borrow_mut(|last| {
        if let Some((known, given, whole)) = last
            && *known == name
            && given == list
        {
            return Ok(Rc::clone(whole));
        }
        let path = folder.join(format!("{name}.umatht"));
        let text = std::fs::read_to_string(&path).map_err(|error| {
            format!("umatht: {}, asked for by constant `kinetics` 3: {error}", path.display())
        })?;
        let mut whole = list[..list.len().min(COMMON_COUNT)].to_vec();
        whole.resize(COMMON_COUNT, 0.0);
        whole[3] = 0.0;
        whole.extend(parse(&text).map_err(|error| format!("umatht: {}: {error}", path.display()))?);
        let whole = Rc::from(whole);
        *last = Some((name, list.to_vec(), Rc::clone(&whole)));
        Ok(whole)
    })
}

/// Parses constants 7 to 15, in order.
fn parse(text: &str) -> Result<Vec<f64>, String> {
    let table: toml::Table = text.parse().map_err(|error: toml::de::Error| error.to_string())?;
    let names = &NAMES[COMMON_COUNT..];
    if let Some(other) = table.keys().find(|key| !names.contains(&key.as_str())) {
        return Err(format!("found `{other}`; allowed: {}", names.join(", ")));
    }
    let number = |name: &&str| -> Result<f64, String> {
        let value = table.get(*name).ok_or_else(|| format!("`{name}` is missing"))?;
        let number = value.as_float().or(value.as_integer().map(|whole| whole as f64));
        number.ok_or_else(|| format!("{name}: found {value}; allowed: a number, SI"))
    };
    names.iter().map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_the_rest() {
        let text = "growth_rate = 37869\nnucleation = 136235.0\nactivation_energy = \
                    6270.0\nequilibrium_melting = 466.35\n\
                    frozen = 294.15\navrami_exponent = 2.678\nmelting_sharpness = 0.965\n\
                    melting_shape = 8.584 # d\nmelting_peak = 450\n";
        assert_eq!(
            parse(text).unwrap(),
            [37869.0, 136_235.0, 6270.0, 466.35, 294.15, 2.678, 0.965, 8.584, 450.0]
        );
        for (wrong, told) in [
            (text.replace("frozen", "frosen"), "frosen"),
            (text.replace("frozen = 294.15\n", ""), "`frozen` is missing"),
            (text.replace("294.15", "\"21 degC\""), "a number"),
            (text.replace("= 450", "450"), "TOML"),
        ] {
            let found = parse(&wrong).unwrap_err();
            assert!(found.contains(told), "{found}");
        }
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("own_pp.umatht"), text).unwrap();
        let list = [0.2, 1900.0, 0.0, 3.0, 273.15, 1.0];
        let whole = complete(folder.path(), "OWN_PP    ", &list).unwrap();
        assert_eq!(whole[..7], [0.2, 1900.0, 0.0, 0.0, 273.15, 1.0, 37869.0]);
        assert!(is_asked(&list) && !is_asked(&whole) && whole.len() == NAMES.len());
        assert!(complete(folder.path(), "NO_SUCH", &list).unwrap_err().contains("no_such.umatht"));
    }
}

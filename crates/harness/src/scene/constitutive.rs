//! A constitutive law, of Chapter 1 or learnt from data, as a scene names it.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Deserializer};

use super::{SceneError, Source};
use polycore::constitutive::Error;
use polycore::constitutive::hyperelastic::{
    COMPRESSIBLE_MODELS, Compressible, Hyperelastic, MODELS, ModelDescriptor, ModelKind, Volumetric,
    any_model,
};
#[cfg(feature = "surrogate")]
use polycore::constitutive::surrogate::Surrogate;
use polycore::units::Stress;

/// A hyperelastic law with a volumetric energy ¼λ(J² − 1 − 2 ln J) that gives it a bulk modulus, or a law
/// learnt from data.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConstitutiveSpec {
    /// Name of the law.
    pub model: Option<String>,
    /// Parameters by name: stresses with a unit, other numbers without.
    pub parameters: Option<BTreeMap<String, Constant>>,
    /// Bulk modulus at rest; foams have their own.
    pub bulk_modulus: Option<Stress>,
    /// Instead of a model and parameters: file of a law learnt by `mdsurrogate`, relative to the scene.
    pub learnt: Option<PathBuf>,
    /// Name in `[inputs]` of the scene whose results contain the file of `learnt`.
    pub input: Option<String>,
}

/// A parameter in SI units, and whether it has been written as a stress.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Constant {
    /// A number.
    Number(f64),
    /// A stress, Pa.
    Stress(f64),
}

impl schemars::JsonSchema for Constant {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Constant".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let stress = generator.subschema_for::<Stress>();
        schemars::json_schema!({
            "description": "a number or a stress",
            "anyOf": [{ "type": "number" }, stress],
        })
    }
}

impl<'de> Deserialize<'de> for Constant {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl serde::de::Visitor<'_> for Visitor {
            type Value = Constant;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a number, or a stress such as \"0.4 MPa\"")
            }
            fn visit_f64<E>(self, value: f64) -> Result<Constant, E> {
                Ok(Constant::Number(value))
            }
            fn visit_i64<E>(self, value: i64) -> Result<Constant, E> {
                Ok(Constant::Number(value as f64))
            }
            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Constant, E> {
                text.parse::<Stress>().map(|stress| Constant::Stress(stress.si())).map_err(E::custom)
            }
        }
        from.deserialize_any(Visitor)
    }
}

impl ConstitutiveSpec {
    /// Returns the learnt law, where the block names one; `key` is where it stands.
    ///
    /// # Errors
    /// Another key beside it, a file that is missing, larger than the memory, or no law.
    #[cfg(feature = "surrogate")]
    pub fn learnt(&self, source: &Source, key: &str) -> Result<Option<Surrogate>, SceneError> {
        let Some(file) = &self.learnt else {
            return match &self.input {
                Some(name) => {
                    Err(source.error(&format!("{key}.input"), format!("`{name}`"), "only with `learnt`"))
                }
                None => Ok(None),
            };
        };
        for (other, given) in [
            ("model", self.model.is_some()),
            ("parameters", self.parameters.is_some()),
            ("bulk_modulus", self.bulk_modulus.is_some()),
        ] {
            if given {
                let found = format!("`{other}` together with `learnt`");
                return Err(source.error(&format!("{key}.{other}"), found, "one of them"));
            }
        }
        let path = match &self.input {
            Some(name) => source.file(source.input(&format!("{key}.input"), name)?.join(file)),
            None => source.file(file),
        };
        let key = format!("{key}.learnt");
        // the file, its numbers, and these by rows and in panels
        let needed = 4.0 * std::fs::metadata(&path).map_or(0.0, |file| file.len() as f64);
        let available = polycore::memory::available();
        if needed > available {
            let found = format!("{}, which needs {}", path.display(), polycore::memory::gib(needed));
            let allowed = format!("a law that fits into {}", polycore::memory::gib(available));
            return Err(source.error(&key, found, allowed));
        }
        let read = if path.exists() && !path.is_file() {
            // a device may never end
            Err(format!("{}, which is no file", path.display()))
        } else {
            Surrogate::read(&path).map_err(|error| match error {
                polycore::Error::Constitutive(Error::File { found, .. }) => {
                    format!("{}: {found}", path.display())
                }
                other => other.to_string(),
            })
        };
        read.map(Some).map_err(|found| source.error(&key, found, "a law that `mdsurrogate` wrote"))
    }

    /// Returns the law in closed form; `key` is where this block stands.
    ///
    /// # Errors
    /// A [`SceneError`] that names the key, the value found and what is allowed.
    pub fn law(&self, source: &Source, key: &str) -> Result<Compressible<Box<dyn Hyperelastic>>, SceneError> {
        let names: Vec<&str> = MODELS.iter().chain(COMPRESSIBLE_MODELS).map(|model| model.key).collect();
        let missing = |name: &str, why: &str| source.missing(&format!("{key}.{name}"), why);
        let Some(name) = &self.model else {
            return Err(missing("model", &format!("write one of {}, or `learnt`, a file", names.join(", "))));
        };
        let Ok(model) = any_model(name) else {
            return Err(source.unknown(&format!("{key}.model"), name, &names));
        };
        let parameters = self.parameters.clone().unwrap_or_default();
        let values = values(&parameters, source, &format!("{key}.parameters"), model)?;
        let wrong =
            |error: Error| source.error(&format!("{key}.parameters"), error, "values of their domains");
        if model.kind == ModelKind::Compressible {
            if let Some(bulk) = self.bulk_modulus {
                let allowed = format!("none: `{}` has its own", model.key);
                return Err(source.error(
                    &format!("{key}.bulk_modulus"),
                    format!("{} Pa", bulk.si()),
                    allowed,
                ));
            }
            return model
                .law(&values)
                .and_then(|law| Compressible::new(law, Volumetric::None))
                .map_err(wrong);
        }
        let compressible = |lame: f64| Compressible::new(model.law(&values)?, Volumetric::Ciarlet { lame });
        let least = compressible(0.0).and_then(|law| law.bulk_modulus()).map_err(wrong)?;
        let bulk = self
            .bulk_modulus
            .ok_or_else(|| missing("bulk_modulus", "a compressible law needs it; write a stress"))?
            .si();
        if !(bulk >= least && bulk.is_finite()) {
            let allowed =
                format!("at least {least:.6e} Pa, that of `{}` without a volumetric energy", model.key);
            return Err(source.error(&format!("{key}.bulk_modulus"), format!("{bulk} Pa"), allowed));
        }
        compressible(bulk - least).map_err(wrong)
    }
}

/// Returns the parameters in the model's order, SI.
fn values(
    given: &BTreeMap<String, Constant>,
    source: &Source,
    key: &str,
    model: &ModelDescriptor,
) -> Result<Vec<f64>, SceneError> {
    let names: Vec<&str> = model.parameters.iter().map(|parameter| parameter.name).collect();
    if let Some(other) = given.keys().find(|name| !names.contains(&name.as_str())) {
        return Err(source.unknown(&format!("{key}.{other}"), other, &names));
    }
    let each = model.parameters.iter().map(|parameter| {
        let path = format!("{key}.{}", parameter.name);
        match (given.get(parameter.name), parameter.unit) {
            (Some(&Constant::Stress(value)), "Pa") | (Some(&Constant::Number(value)), "1") => Ok(value),
            (Some(_), "Pa") => {
                Err(source.error(&path, "a number without a unit", "a stress such as \"0.4 MPa\""))
            }
            (Some(_), _) => Err(source.error(&path, "a stress", "a number")),
            (None, _) => {
                let allowed = format!("the parameters of `{}`: {}", model.key, names.join(", "));
                Err(source.error(key, format!("no `{}`", parameter.name), allowed))
            }
        }
    });
    each.collect()
}

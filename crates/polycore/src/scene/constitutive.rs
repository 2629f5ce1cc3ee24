//! A constitutive law of Chapter 1, as a scene names it.

use std::collections::BTreeMap;

use serde::{Deserialize, Deserializer};

use super::{SceneError, Source};
use crate::constitutive::Error;
use crate::constitutive::hyperelastic::{Compressible, Hyperelastic, MODELS, ModelDescriptor, Volumetric};
use crate::units::Stress;

/// A hyperelastic law with a volumetric energy ¼λ(J² − 1 − 2 ln J) that gives it a bulk modulus.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConstitutiveSpec {
    /// Name of the law.
    pub model: String,
    /// Its parameters by their names: stresses with a unit, other numbers without.
    pub parameters: BTreeMap<String, Constant>,
    /// Bulk modulus at rest.
    pub bulk_modulus: Stress,
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
        schemars::json_schema!({ "description": "a number or a stress", "anyOf": [{ "type": "number" }, stress] })
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
    /// The law; `key` is where this block stands.
    ///
    /// # Errors
    /// A [`SceneError`] that names the key, the value found and what is allowed.
    pub fn law(&self, source: &Source, key: &str) -> Result<Compressible<Box<dyn Hyperelastic>>, SceneError> {
        let names: Vec<&str> = MODELS.iter().map(|model| model.key).collect();
        let Some(model) = MODELS.iter().find(|model| model.key == self.model) else {
            return Err(source.unknown(&format!("{key}.model"), &self.model, &names));
        };
        let values = self.values(source, &format!("{key}.parameters"), model)?;
        let wrong =
            |error: Error| source.error(&format!("{key}.parameters"), error, "values of their domains");
        let compressible = |lame: f64| Compressible::new(model.law(&values)?, Volumetric::Ciarlet { lame });
        let least = compressible(0.0).and_then(|law| law.bulk_modulus()).map_err(wrong)?;
        let bulk = self.bulk_modulus.si();
        if !(bulk >= least && bulk.is_finite()) {
            let allowed =
                format!("at least {least:.6e} Pa, that of `{}` without a volumetric energy", model.key);
            return Err(source.error(&format!("{key}.bulk_modulus"), format!("{bulk} Pa"), allowed));
        }
        compressible(bulk - least).map_err(wrong)
    }

    /// The parameters in the model's order, SI.
    fn values(&self, source: &Source, key: &str, model: &ModelDescriptor) -> Result<Vec<f64>, SceneError> {
        let names: Vec<&str> = model.parameters.iter().map(|parameter| parameter.name).collect();
        if let Some(other) = self.parameters.keys().find(|name| !names.contains(&name.as_str())) {
            return Err(source.unknown(&format!("{key}.{other}"), other, &names));
        }
        let each = model.parameters.iter().map(|parameter| {
            let path = format!("{key}.{}", parameter.name);
            match (self.parameters.get(parameter.name), parameter.unit) {
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
}

//! Studies of a scene: a `[[study]]` replaces parts of the scene, sets single keys, and lists values of keys;
//! every combination of the values is a variant, a scene of its own.

mod compare;
mod convergence;
mod curve;
mod solve;
mod suite;

pub use compare::Compare;
pub use convergence::Convergence;
pub use curve::ErrorAgainstTime;
pub use solve::{expected, solve};
pub use suite::{SuiteRow, suite};

use crate::report::{Named, Report};
use crate::scene::{SceneError, Source, check_name};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::IgnoredAny;
use serde::{Deserialize, Deserializer};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::marker::PhantomData;

crate::quantities! {
    /// Scalars that compare the variants of a scene, whatever the program.
    pub OF_STUDIES:
    LIMIT = "{convergence}.limit", "*", "value that three studies tend to, after Richardson";
    ORDER = "{convergence}.order", "", "observed order of these studies";
    ERROR_OF = "{curve}.error_of_{study}", "", "rms error of a study in an error-against-time curve, in its \
        unit";
}

/// A `T` of the scene that a study gives: read where it stands in for the scene's own.
#[derive(Clone, Copy, Debug)]
pub struct Instead<T>(PhantomData<T>);

/// A value of any type.
pub use serde_json::Value;

/// A value of any type that a study gives.
pub type Any = Instead<Value>;

impl<'de, T> Deserialize<'de> for Instead<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        IgnoredAny::deserialize(deserializer).map(|_| Self(PhantomData))
    }
}

impl<T: JsonSchema> JsonSchema for Instead<T> {
    fn inline_schema() -> bool {
        T::inline_schema()
    }

    fn schema_name() -> Cow<'static, str> {
        T::schema_name()
    }

    fn schema_id() -> Cow<'static, str> {
        T::schema_id()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        T::json_schema(generator)
    }
}

/// Declares the `[[study]]` of a program: `replaces` are blocks of the scene with their types, `lists` keys
/// whose values may be listed; both name the key of the scene. A key before the one that holds it: the first
/// holds.
#[macro_export]
macro_rules! study {
    ($(#[$about:meta])* pub struct $name:ident;
     replaces { $($block:ident: $replaced:ty = $key:literal,)* }
     lists { $($list:ident: $listed:ty = $path:literal,)* }) => {
        $(#[$about])*
        #[derive(Clone, Debug, Default, serde::Deserialize, schemars::JsonSchema)]
        #[serde(deny_unknown_fields, default)]
        pub struct $name {
            /// Name, a part of the names of values and files.
            pub name: Option<String>,
            /// Expected behaviour, for the table of a suite.
            pub description: Option<String>,
            /// The run must end with an error that contains this.
            pub expect_error: Option<String>,
            /// Part of `--quick` runs; default: true.
            pub quick: Option<bool>,
            /// Values by their paths (`"time.end"`, `"boundary[1].displacement"`), merged into the scene.
            pub set: Option<std::collections::BTreeMap<String, $crate::study::Any>>,
            /// Lists of values by their paths; every combination is a variant, named as the runs of a sweep.
            pub vary: std::collections::BTreeMap<String, Vec<$crate::study::Value>>,
            $(#[doc = concat!("Instead of `", $key, "`.")]
            pub $block: Option<$crate::study::Instead<$replaced>>,)*
            $(#[doc = concat!("Values of `", $path, "`.")]
            pub $list: Vec<$crate::study::Instead<$listed>>,)*
        }

        impl $name {
            /// Returns the study as the harness resolves it.
            pub fn study(&self) -> $crate::study::Study {
                let Self { name, description, expect_error, quick, set, vary, .. } = self.clone();
                let replaced = [$(($key, stringify!($block), self.$block.is_some()),)*];
                let lists: &[(&str, &str, usize)] = &[$(($path, stringify!($list), self.$list.len()),)*];
                $crate::study::Study {
                    name,
                    description,
                    expect_error,
                    quick: quick.unwrap_or(true),
                    sets: set.is_some(),
                    replaced: replaced.into_iter().filter(|own| own.2).map(|own| [own.0, own.1]).collect(),
                    lists: lists.iter().filter(|own| own.2 > 0).copied().collect(),
                    vary,
                }
            }
        }
    };
}

/// A `[[study]]`, whatever the program.
#[derive(Clone, Debug, Default)]
pub struct Study {
    /// Name.
    pub name: Option<String>,
    /// Expected behaviour.
    pub description: Option<String>,
    /// Part of the error with which it must end.
    pub expect_error: Option<String>,
    /// Part of `--quick` runs.
    pub quick: bool,
    /// True if it has a `set`.
    pub sets: bool,
    /// Keys of the scene and the keys of the study that replace them.
    pub replaced: Vec<[&'static str; 2]>,
    /// Keys of the scene, the study's lists of values for them, and their lengths.
    pub lists: Vec<(&'static str, &'static str, usize)>,
    /// Values of other keys of the scene.
    pub vary: BTreeMap<String, Vec<Value>>,
}

/// Names of variants in values and files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Naming {
    /// `VALUE[VARIANT]`; the files of all variants lie in one folder.
    Brackets,
    /// `VARIANT.VALUE`; each variant has a folder of its name.
    Folders,
}

impl Naming {
    /// Name of a value of a variant.
    pub fn value(self, variant: &str, value: &str) -> String {
        match self {
            Self::Brackets => format!("{value}[{variant}]"),
            Self::Folders => format!("{variant}.{value}"),
        }
    }

    /// Returns whether a quantity is a value of a variant.
    pub fn is_of(self, variant: &str, quantity: &str) -> bool {
        match self {
            Self::Brackets => quantity.ends_with(&format!("[{variant}]")),
            Self::Folders => quantity.strip_prefix(variant).is_some_and(|rest| rest.starts_with('.')),
        }
    }

    fn check(self, source: &Source, key: &str, name: Option<&str>) -> Result<(), SceneError> {
        let stops = |c: char| c.is_control() || "/\\[]".contains(c);
        match (self, name) {
            (Self::Folders, None) => {
                Err(source.missing(key, "the values and the folder of a study have its name"))
            }
            (Self::Folders, Some(name)) => check_name(source, key, name),
            (Self::Brackets, Some(name)) if name.contains(stops) => {
                let allowed = "a name without `/`, `\\`, `[`, `]`: it names files and values";
                Err(source.error(key, format!("`{name}`"), allowed))
            }
            (Self::Brackets, _) => Ok(()),
        }
    }
}

/// A variant of a scene.
#[derive(Clone, Debug)]
pub struct Variant {
    /// Name.
    pub name: String,
    /// The index of its study; none of a scene without studies.
    pub study: Option<usize>,
    /// The scene with what its study changes; errors point at the study.
    pub source: Source,
    /// Expected behaviour.
    pub description: Option<String>,
    /// Part of the error with which it must end.
    pub expect_error: Option<String>,
    /// Keys that its study varies, with their values as texts.
    pub varied: Vec<(String, String)>,
}

/// Lists the variants of a scene: the scene itself where it has no studies; `quick` leaves out those of
/// studies with `quick = false`. `name` names a variant by its scene and its study's name; of equal variants
/// the first is taken.
///
/// # Errors
/// Names of studies that cannot be names of files, equal names of different variants, a quick run of nothing,
/// and what `name` finds.
pub fn variants(
    source: &Source,
    studies: &[Study],
    quick: bool,
    naming: Naming,
    name: impl Fn(&Source, Option<&str>) -> Result<String, SceneError>,
) -> Result<Vec<Variant>, SceneError> {
    if studies.is_empty() {
        let (name, source) = (name(source, None)?, source.clone());
        let (description, expect_error, varied) = (None, None, Vec::new());
        return Ok(vec![Variant { name, study: None, source, description, expect_error, varied }]);
    }
    let mut variants: Vec<Variant> = Vec::new();
    for (index, study) in studies.iter().enumerate() {
        if study.name.is_some() || study.vary.is_empty() {
            naming.check(source, &format!("study[{index}].name"), study.name.as_deref())?;
        }
        if quick && !study.quick {
            continue;
        }
        let lists = study.lists.iter().map(|(key, list, length)| (*key, (*list).to_owned(), *length, None));
        let vary = study
            .vary
            .iter()
            .map(|(key, values)| (key.as_str(), format!("vary.{key}"), values.len(), Some(values)));
        let lists: Vec<_> = lists.chain(vary).collect();
        for places in grid(&lists.iter().map(|list| list.2).collect::<Vec<_>>()) {
            // of what concerns a key the first holds: listed values before single keys, and these before
            // blocks
            let (mut own, mut label, mut varied) = (source.clone(), study.name.clone(), Vec::new());
            for ((key, list, _, values), place) in lists.iter().zip(places) {
                own = own.with_replaced(key, &format!("study[{index}].{list}[{place}]"));
                if let Some(value) = values.and_then(|values| values.get(place)) {
                    let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
                    label = Some(label.map_or_else(String::new, |label| label + "_") + &named(key, &text));
                    varied.push(((*key).to_owned(), text));
                }
            }
            if study.sets {
                own = own.with_merged(&format!("study[{index}].set"));
            }
            for [key, by] in &study.replaced {
                own = own.with_replaced(key, &format!("study[{index}].{by}"));
            }
            let name = name(&own, label.as_deref())?;
            // folders of some systems do not tell `A` from `a`
            let same = |other: &Variant| match naming {
                Naming::Brackets => other.name == name,
                Naming::Folders => other.name.eq_ignore_ascii_case(&name),
            };
            if !variants.iter().any(same) {
                let Study { description, expect_error, .. } = study.clone();
                let (study, source) = (Some(index), own);
                variants.push(Variant { name, study, source, description, expect_error, varied });
            } else if naming == Naming::Folders {
                let found = format!("`{name}` twice");
                return Err(source.error(&format!("study[{index}].name"), found, "different names"));
            } else if study.sets || !(study.replaced.is_empty() && study.vary.is_empty()) {
                let allowed = "a `name` for each study that replaces a part of the scene";
                let found = format!("a second variant `{name}`");
                return Err(source.error(&format!("study[{index}]"), found, allowed));
            }
        }
    }
    match variants.is_empty() {
        true => {
            let allowed = "at least one without `quick = false`";
            Err(source.error("study", "no variant left in a --quick run", allowed))
        }
        false => Ok(variants),
    }
}

/// Name of a key's value: `print.layer_time`, `10 s` → `layer_time-10s`.
pub(crate) fn named(key: &str, value: &str) -> String {
    format!("{}-{}", plain(key.rsplit('.').next().unwrap_or(key)), plain(value))
}

/// A text as part of a file name: without blanks, letters, digits and hyphens kept, `_` for the rest.
pub(crate) fn plain(text: &str) -> String {
    let kept = text.chars().filter(|c| !c.is_whitespace());
    kept.map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' }).collect()
}

/// Combinations of values of lists of these lengths, by their places; the last runs fastest.
pub fn grid(lengths: &[usize]) -> impl Iterator<Item = Vec<usize>> {
    (0..lengths.iter().product()).map(move |mut rest: usize| {
        let mut places = vec![0; lengths.len()];
        for (place, length) in places.iter_mut().zip(lengths).rev() {
            (*place, rest) = (rest % length, rest / length);
        }
        places
    })
}

/// A solved variant, as comparisons see it.
pub trait Solved {
    /// Name.
    fn name(&self) -> &str;

    /// Returns a scalar and its unit.
    fn scalar(&self, quantity: &str) -> Option<(f64, &str)>;

    /// Seconds of its solution; none if it has failed.
    fn solve_seconds(&self) -> f64;
}

/// The tables of a scene that compare its variants.
#[derive(Clone, Copy, Debug)]
pub struct Comparisons<'a> {
    /// `[[convergence]]`.
    pub convergence: &'a [Convergence],
    /// `[[error_against_time]]`.
    pub curves: &'a [ErrorAgainstTime],
}

impl Comparisons<'_> {
    /// Checks them against the names of all variants.
    ///
    /// # Errors
    /// Names that are taken or that no variant has, and what each table refuses.
    pub fn check(&self, source: &Source, variants: &[&str]) -> Result<(), SceneError> {
        let mut taken = variants.to_vec();
        let tables = self.convergence.iter().map(|spec| &spec.name).enumerate();
        let curves = self.curves.iter().map(|spec| &spec.name).enumerate();
        let named =
            tables.map(|one| ("convergence", one)).chain(curves.map(|one| ("error_against_time", one)));
        for (table, (index, name)) in named {
            let key = format!("{table}[{index}].name");
            check_name(source, &key, name)?;
            if taken.contains(&name.as_str()) {
                return Err(source.error(&key, format!("`{name}` twice"), "a unique name"));
            }
            taken.push(name);
        }
        self.convergence
            .iter()
            .enumerate()
            .try_for_each(|(index, spec)| spec.check(source, index, variants))?;
        self.curves.iter().enumerate().try_for_each(|(index, spec)| spec.check(source, index, variants))
    }

    /// Returns names of the scalars that they add to a report.
    pub fn names(&self) -> impl Iterator<Item = Named> {
        let tables = self.convergence.iter().flat_map(|spec| [LIMIT, ORDER].map(|q| q.named(&[&spec.name])));
        let curves = self.curves.iter().flat_map(|spec| spec.studies.iter().map(|study| (&spec.name, study)));
        tables.chain(curves.map(|(curve, study)| ERROR_OF.named(&[curve, study])))
    }

    /// Adds their results to a report.
    pub fn add(&self, report: &mut Report, solved: &[impl Solved]) {
        let of = |name: &String| solved.iter().find(|one| one.name() == name);
        self.convergence.iter().for_each(|spec| spec.add(report, of));
        self.curves.iter().for_each(|spec| spec.add(report, of));
    }
}

#[cfg(test)]
mod tests;

//! Scalars that reports can have: declared once, with unit and description, by the program that computes
//! them.

/// A scalar that a report can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quantity {
    /// Name; `{axis}`, `{probe}` and the like are filled in.
    pub name: &'static str,
    /// Unit, empty if dimensionless; `*` if it depends on the words filled in.
    pub unit: &'static str,
    /// Description.
    pub about: &'static str,
}

/// A scalar of a report: name and unit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Named {
    /// Name, with everything filled in.
    pub name: String,
    /// Unit, empty if dimensionless.
    pub unit: String,
}

impl Quantity {
    /// Returns the name with `parts` in place of its words in braces, in this order.
    pub fn named(&self, parts: &[&str]) -> Named {
        debug_assert_eq!(parts.len(), self.name.matches('{').count(), "`{}`", self.name);
        let mut parts = parts.iter();
        let mut name = String::new();
        let mut rest = self.name;
        while let Some((before, (_, after))) =
            rest.split_once('{').and_then(|(before, braced)| Some((before, braced.split_once('}')?)))
        {
            name += before;
            name += parts.next().copied().unwrap_or_default();
            rest = after;
        }
        Named { name: name + rest, unit: self.unit.to_owned() }
    }

    /// Returns the name with `*` for its words in braces.
    pub fn pattern(&self) -> String {
        self.named(&vec!["*"; self.name.matches('{').count()]).name
    }
}

impl Named {
    /// Creates a name that no program declares, such as one of another report.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into() }
    }

    /// Returns names with their units, in a line.
    pub fn list<'a>(all: impl IntoIterator<Item = &'a Self>) -> String {
        let one = |Self { name, unit }: &Self| match unit.as_str() {
            "" => name.clone(),
            unit => format!("{name} ({unit})"),
        };
        all.into_iter().map(one).collect::<Vec<_>>().join(", ")
    }

    /// Returns the same name with a unit that only the result knows.
    pub fn in_unit(self, unit: &str) -> Self {
        Self { unit: unit.to_owned(), ..self }
    }
}

impl From<Quantity> for Named {
    fn from(quantity: Quantity) -> Self {
        quantity.named(&[])
    }
}

/// Declares the quantities of a program or of a part of it, and a list of them:
///
/// ```
/// harness::quantities! {
///     /// What a pulled bar reports.
///     pub ALL:
///     PEAK_LOAD = "peak_load", "N", "greatest load of all steps";
///     REACTION = "reaction_{axis}", "N", "force on what is held";
/// }
/// assert_eq!(REACTION.named(&["x"]).name, "reaction_x");
/// assert_eq!(ALL.len(), 2);
/// ```
#[macro_export]
macro_rules! quantities {
    ($(#[$documented:meta])* $visibility:vis $list:ident:
     $($constant:ident = $name:literal, $unit:literal, $about:literal;)*) => {
        $(
            #[doc = concat!("`", $name, "`: ", $about, ".")]
            $visibility const $constant: $crate::report::Quantity =
                $crate::report::Quantity { name: $name, unit: $unit, about: $about };
        )*
        $(#[$documented])*
        $visibility const $list: &[$crate::report::Quantity] = &[$($constant),*];
    };
}

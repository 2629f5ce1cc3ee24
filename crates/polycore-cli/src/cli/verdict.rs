//! Verdicts on fitted laws: those that are no usable materials, and where the others are not stable.

use polycore::constitutive::hyperelastic::Domain;
use polycore::constitutive::hyperelastic::data::{Mode, TestData};
use polycore::constitutive::hyperelastic::fit::{Fit, FittedParameter, Identifiability};
use polycore::constitutive::hyperelastic::stability;

use super::fits::format_parameter;

/// Verdict on a fit within its table.
pub struct FitVerdict {
    /// Reason for which the law is no usable material, with advice.
    pub unusable: Option<String>,
    /// The same in few words: `C2 absent`.
    pub open: Option<String>,
    /// Number of states of the table, and of those at which the law is not elliptic.
    states: usize,
    lost: usize,
    /// Test and stretch at which the law first becomes unstable (Drucker), within the stretches of the table.
    pub instability: Option<(Mode, f64)>,
}

impl FitVerdict {
    /// Judges a law fitted to a table.
    pub fn new(fit: &Fit, table: &TestData) -> Self {
        let is_open = |own: &&FittedParameter| own.identifiability != Identifiability::Determined;
        let unusable = unusable(fit);
        let open = fit.parameters.iter().find(is_open).map(format_parameter);
        Self {
            open: open.or_else(|| unusable.as_ref().map(|_| "parameters not determined".to_owned())),
            unusable,
            states: table.states.len(),
            lost: stability::count_states_without_ellipticity(&fit.law, table),
            instability: find_instability(fit, table),
        }
    }

    /// Returns true for a law whose parameters the data determine and that is elliptic at all states.
    pub fn is_recommended(&self) -> bool {
        self.unusable.is_none() && self.lost == 0
    }

    /// States at which the law is not elliptic, in words.
    pub fn without_ellipticity(&self) -> Option<String> {
        (self.lost > 0).then(|| format!("not elliptic at {} of {} states", self.lost, self.states))
    }

    /// First instability, in words.
    pub fn without_stability(&self) -> Option<String> {
        let (mode, stretch) = self.instability?;
        Some(format!("unstable in {} tests from the stretch {stretch:.3} on", mode.name()))
    }

    /// Defects of a usable law, a line each, for blocks and cards.
    pub fn warnings(&self) -> Vec<String> {
        let lost = self.without_ellipticity().map(|lost| lost + " of its table: do not use it there");
        let unstable = self.without_stability().map(|unstable| format!("{unstable} (Drucker)"));
        lost.into_iter().chain(unstable).map(|line| format!("warning: {line}")).collect()
    }

    /// Finds a term that is absent, a parameter that the data do not determine, or an instability.
    pub fn obstacle(&self) -> Option<String> {
        self.open.clone().or_else(|| self.without_ellipticity()).or_else(|| self.without_stability())
    }
}

/// Returns the reason for which a fitted law is no usable material, with advice.
fn unusable(fit: &Fit) -> Option<String> {
    let names = |of: &dyn Fn(&FittedParameter) -> bool| -> Vec<&str> {
        fit.parameters.iter().filter(|parameter| of(parameter)).map(|parameter| parameter.name).collect()
    };
    let absent = names(&|own| own.identifiability == Identifiability::Absent);
    let open = names(&|own| own.identifiability == Identifiability::Undetermined);
    let is_open_above = |name: &&str| {
        let own = fit.model.parameters.iter().find(|parameter| parameter.name == *name);
        own.is_some_and(|parameter| matches!(parameter.domain, Domain::Above(_)))
    };
    // with as many stresses as parameters there is no error to know
    let judged = fit.collinear || fit.measurements > fit.parameters.len();
    let free = names(&|own| own.standard_error.is_none() && judged);
    if !absent.is_empty() {
        return Some(format!(
            "without {} it is a law with fewer parameters: use that law",
            absent.join(", ")
        ));
    }
    if !open.is_empty() {
        let advice = match open.iter().all(is_open_above) {
            true => ", which may be infinite: use `neo-hookean`",
            false => ": use a law with fewer parameters, or more kinds of tests",
        };
        return Some(format!("the data do not determine {}{advice}", open.join(", ")));
    }
    (!free.is_empty()).then(|| {
        format!(
            "the data do not determine {}, other values fit as well: use a law with fewer parameters, or \
             more kinds of tests",
            free.join(", ")
        )
    })
}

/// Finds the test and the stretch at which a law first becomes unstable, within the stretches of a table.
fn find_instability(fit: &Fit, table: &TestData) -> Option<(Mode, f64)> {
    let ends = stability::range(table);
    let all = Mode::TESTS.into_iter().flat_map(|mode| ends.map(|end| (mode, end)));
    all.filter(|(_, end)| *end != 1.0)
        .find_map(|(mode, end)| stability::unstable_from(&fit.law, mode, end).map(|stretch| (mode, stretch)))
}

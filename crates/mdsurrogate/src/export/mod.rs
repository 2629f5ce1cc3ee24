//! Export of models to C, Fortran and ONNX.

mod c;
mod fortran;
mod graph;
mod onnx;
mod protobuf;

pub use c::{CSource, c_source};
pub use fortran::fortran_source;
pub use onnx::{OnnxOptions, onnx};

use crate::Error;
use crate::network::{Activation, LANES, Network};
use crate::surrogate::{Coefficients, Header, Surrogate, Symmetry, SymmetryInvariants, derivative};

/// A model and its coefficients.
struct ExportModel<'a> {
    header: &'a Header,
    members: &'a [Network<f64>],
    coefficients: Coefficients<'a, f64>,
}

/// All numbers of a law, in the order of the source code.
struct Description {
    layers: usize,
    members: usize,
    inputs: usize,
    outputs: usize,
    widest: usize,
    parameters: usize,
    energetic: bool,
    invariants: SymmetryInvariants,
    widths: Vec<usize>,
    /// Indices in [`Activation::ALL`].
    activations: Vec<usize>,
    mean: Vec<f64>,
    inverse: Vec<f64>,
    output_mean: Vec<f64>,
    output: Vec<f64>,
    training_box: Vec<f64>,
    /// Rotation of C into the material axes, row by row.
    turn: Vec<f64>,
    /// For each member: −∂W/∂c and W at I, the correction of ∂W/∂x, and x at I.
    rest: Vec<f64>,
    representatives: Vec<f64>,
    representative_weight: Vec<f64>,
    farthest: f64,
    spread_limit: Option<f64>,
    weights: Vec<f64>,
}

/// Target language of formulas.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Language {
    C,
    Fortran,
}

impl<'a> ExportModel<'a> {
    fn new(model: &'a Surrogate) -> Self {
        Self { header: model.header(), members: model.members(), coefficients: model.coefficients() }
    }

    /// Returns the invariants of an energy; the inputs of an `ann` are the components of C.
    fn invariants(&self) -> SymmetryInvariants {
        self.header.kind.invariants().unwrap_or(SymmetryInvariants::new(Symmetry::Triclinic, false, false))
    }

    fn description(&self) -> Description {
        let architecture = &self.header.architecture;
        let code = |activation: &Activation| {
            Activation::ALL.iter().position(|other| other == activation).unwrap_or_default()
        };
        let inputs = self.coefficients.mean.len();
        let identity = |i: usize| f64::from(u8::from(i / 6 == i % 6));
        let rest = |m: usize| {
            let rest = self.coefficients.rest.get(m).copied().unwrap_or_default();
            let mut list = rest.slope.to_vec();
            list.push(rest.value);
            list.extend(&rest.invariants[..inputs.min(LANES)]);
            list.extend(&rest.at[..inputs.min(LANES)]);
            list
        };
        let support = self.header.support.as_ref();
        let layers = self.members.iter().flat_map(Network::layers);
        Description {
            layers: architecture.activations.len(),
            members: self.members.len(),
            inputs,
            outputs: self.coefficients.output.len(),
            widest: architecture.widths.iter().max().copied().unwrap_or(1),
            parameters: architecture.parameters(),
            energetic: self.header.kind.invariants().is_some(),
            invariants: self.invariants(),
            widths: architecture.widths.clone(),
            activations: architecture.activations.iter().map(code).collect(),
            mean: self.coefficients.mean.to_vec(),
            inverse: self.coefficients.inverse.to_vec(),
            output_mean: self.coefficients.output_mean.to_vec(),
            output: self.coefficients.output.to_vec(),
            training_box: self.header.training_box.as_flattened().to_vec(),
            turn: match self.coefficients.turn {
                Some(turn) => turn.as_flattened().to_vec(),
                None => (0..36).map(identity).collect(),
            },
            rest: (0..self.members.len()).flat_map(rest).collect(),
            representatives: support.map_or(vec![0.0; 6], |support| support.points.as_flattened().to_vec()),
            representative_weight: support.map_or(vec![0.0; 6], |support| support.weights.to_vec()),
            farthest: self.coefficients.farthest.unwrap_or(0.0),
            spread_limit: self.header.spread_limit,
            weights: layers.flat_map(|layer| layer.weights.iter().chain(&layer.bias).copied()).collect(),
        }
    }
}

impl Description {
    /// Returns names and values of the sizes.
    fn sizes(&self) -> [(&'static str, usize); 9] {
        let representatives = if self.farthest > 0.0 { self.representatives.len() / 6 } else { 0 };
        [
            ("LAYERS", self.layers),
            ("MEMBERS", self.members),
            ("INPUTS", self.inputs),
            ("OUTPUTS", self.outputs),
            ("WIDEST", self.widest),
            ("PARAMETERS", self.parameters),
            ("ENERGETIC", usize::from(self.energetic)),
            ("RESTS", 7 + 2 * self.inputs),
            ("REPRESENTATIVES", representatives),
        ]
    }

    /// Returns names and numbers of all lists except the weights.
    fn lists(&self) -> [(&'static str, &[f64]); 9] {
        [
            ("mean", &self.mean),
            ("inverse", &self.inverse),
            ("output_mean", &self.output_mean),
            ("output", &self.output),
            ("training_box", &self.training_box),
            ("turn", &self.turn),
            ("rest", &self.rest),
            ("representative", &self.representatives),
            ("representative_weight", &self.representative_weight),
        ]
    }

    /// Returns the statements that compute x, d = ∂x/∂c and dd = ∂²x/∂c∂c.
    fn inputs_with_derivatives(&self, language: Language) -> Vec<String> {
        let mut lines = Vec::new();
        let place = |indices: &[usize]| language.place(indices);
        for k in 0..self.invariants.count() {
            let (terms, root) = self.invariants.polynomial(k);
            let sum = |by: &[usize]| language.sum(&derivative(terms, by));
            lines.push(format!("x{} = {}", place(&[k]), sum(&[])));
            for a in 0..6 {
                lines.push(format!("d{} = {}", place(&[k, a]), sum(&[a])));
                for b in 0..6 {
                    lines.push(format!("dd{} = {}", place(&[k, a, b]), sum(&[a, b])));
                }
            }
            if root {
                let x = format!("x{}", place(&[k]));
                lines.push(format!("{x} = sqrt({x})"));
                for a in 0..6 {
                    let d = format!("d{}", place(&[k, a]));
                    lines.push(format!("{d} = {} * {d} / {x}", language.number(0.5)));
                }
                for (a, b) in (0..36).map(|i| (i / 6, i % 6)) {
                    let dd = format!("dd{}", place(&[k, a, b]));
                    let (da, db) = (place(&[k, a]), place(&[k, b]));
                    let half = language.number(0.5);
                    lines.push(format!("{dd} = ({half} * {dd} - d{da} * d{db}) / {x}"));
                }
            }
        }
        lines
    }
}

impl Language {
    fn number(self, value: f64) -> String {
        match self {
            // shortest text that parses to the same bits
            Self::C => format!("{value:e}"),
            Self::Fortran => format!("{value:e}").replace('e', "d"),
        }
    }

    fn place(self, indices: &[usize]) -> String {
        match self {
            Self::C => indices.iter().map(|i| format!("[{i}]")).collect(),
            Self::Fortran => {
                let list: Vec<String> = indices.iter().map(|i| (i + 1).to_string()).collect();
                format!("({})", list.join(", "))
            }
        }
    }

    fn sum(self, terms: &[(f64, Vec<usize>)]) -> String {
        if terms.is_empty() {
            return self.number(0.0);
        }
        let term = |(coefficient, factors): &(f64, Vec<usize>)| {
            let product: String = factors.iter().map(|&a| format!(" * c{}", self.place(&[a]))).collect();
            format!("({}){product}", self.number(*coefficient))
        };
        terms.iter().map(term).collect::<Vec<_>>().join(" + ")
    }
}

/// Keywords of C99 (ISO/IEC 9899:1999, 6.4.1), and `main`.
const KEYWORDS: [&str; 35] = [
    "auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else", "enum",
    "extern", "float", "for", "goto", "if", "inline", "int", "long", "main", "register", "restrict",
    "return", "short", "signed", "sizeof", "static", "struct", "switch", "typedef", "union", "unsigned",
    "void", "volatile", "while",
];

/// Checks the name of an exported function.
///
/// # Errors
/// Returns [`Error::Parameter`] for a name that is not an identifier in C and Fortran.
fn check_name(name: &str) -> Result<(), Error> {
    let first = name.chars().next().is_some_and(|c| c.is_ascii_alphabetic());
    let letters = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    // Fortran has no reserved words
    if first && letters && name.len() <= 50 && !KEYWORDS.contains(&name) {
        return Ok(());
    }
    let allowed = "a letter, then letters, digits and `_`, at most 50, no keyword of C";
    Err(Error::parameter("name of the function", format!("`{name}`"), allowed))
}

/// Refuses laws whose stress depends on the history.
///
/// # Errors
/// Returns [`Error::Parameter`] for a law with softening.
fn refuse_history(model: &Surrogate) -> Result<(), Error> {
    if model.header().softening.is_none() {
        return Ok(());
    }
    let found = "a law with softening, whose stress depends on its history";
    Err(Error::parameter("export", found, "`--form fortran`, whose routines have state variables"))
}

/// Formats numbers for C source: the shortest texts that parse to the same bits.
fn numbers(values: &[f64]) -> String {
    values.iter().map(|value| format!("{value:e}")).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod history_tests;
#[cfg(test)]
mod tests;

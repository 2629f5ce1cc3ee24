//! Export of a law as C99 source that needs only `math.h`, without allocation and mutable global state.

use super::{Description, ExportModel, Language, check_name, numbers, refuse_history};
use crate::Error;
use crate::surrogate::{CONSTANT_TOLERANCE, Surrogate};
use std::fmt::Write;

/// Largest working memory of an exported law on the stack, bytes.
const MOST_STACK: usize = 1 << 20;

/// Files of a law exported as C.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CSource {
    /// Text of `NAME.h`.
    pub header: String,
    /// Text of `NAME.c`.
    pub source: String,
}

/// Exports a model as C: `int NAME(const double c[6], double s[6], double tangent[36], double *energy, double
/// *spread, unsigned *flags)`, with the conventions of [`Prediction`](crate::surrogate::Prediction); agrees
/// with it to rounding (tested to 1e-12).
///
/// # Errors
/// Returns [`Error::Parameter`] for a name that is not an identifier of 1 to 50 characters, and for networks
/// that need more than 1 MiB of stack.
pub fn c_source(model: &Surrogate, name: &str) -> Result<CSource, Error> {
    check_name(name)?;
    refuse_history(model)?;
    let description = ExportModel::new(model).description();
    let Description { layers, widest, inputs, .. } = description;
    let stack = 8 * layers * widest * (2 * inputs + 3);
    if stack > MOST_STACK {
        return Err(Error::parameter("network", format!("{stack} bytes of stack"), "up to 1 MiB"));
    }
    let header = format!(
        "/* {name}: a constitutive law C -> S, written by mdsurrogate. Voigt order 11 22 33 12 13 23, C_12 \
         not doubled.
 * s: second Piola-Kirchhoff stress, Pa. tangent (36, row by row, or NULL): 2 dS/dC, Pa, no factors.
 * energy (or NULL): W, J/m3, 0 if the law has none. spread (or NULL): disagreement of the ensemble, Pa.
 * flags (or NULL): bit a: component a of C is outside the training data; bit 6 + a: it never changed there;
 * bit 12: the ensemble disagrees; bit 13: farther from the training strains than any of them was from the \
 others.
 * Returns 0; 1: C is not positive definite or not finite; 2: the result is not finite. */
#ifndef {upper}_H
#define {upper}_H
#ifdef __cplusplus
extern \"C\" {{
#endif
int {name}(const double c[6], double s[6], double tangent[36], double *energy, double *spread, unsigned \
*flags);
#ifdef __cplusplus
}}
#endif
#endif
",
        upper = name.to_uppercase()
    );
    let mut source = format!("#include \"{name}.h\"\n#include <math.h>\n#include <stddef.h>\n\n");
    write_data(&mut source, &description);
    source.push_str("static void inputs(const double *c, double *x, double (*d)[6], double (*dd)[6][6]) {\n");
    for line in description.inputs_with_derivatives(Language::C) {
        let _ = writeln!(source, "    {line};");
    }
    source.push_str("}\n\n");
    source.push_str(&BODY.replace("NAME", name));
    Ok(CSource { header, source })
}

fn write_data(text: &mut String, law: &Description) {
    for (name, value) in law.sizes() {
        let _ = writeln!(text, "#define {name} {value}");
    }
    let limit = law.spread_limit.map_or("HUGE_VAL".to_owned(), |limit| format!("{limit:e}"));
    let _ = writeln!(
        text,
        "#define SPREAD_LIMIT {limit}\n#define UNSEEN {CONSTANT_TOLERANCE:e}\n#define FARTHEST {:e}",
        law.farthest
    );
    for (name, values) in [("width", &law.widths), ("activation", &law.activations)] {
        let list: Vec<String> = values.iter().map(usize::to_string).collect();
        let _ = writeln!(text, "static const int {name}[] = {{{}}};", list.join(", "));
    }
    for (name, values) in law.lists() {
        let _ = writeln!(text, "static const double {name}[] = {{{}}};", numbers(values));
    }
    text.push_str("/* of each member and layer: weights row by row, then biases */\n");
    text.push_str("static const double weight[] = {\n");
    for chunk in law.weights.chunks(64) {
        let _ = writeln!(text, "{},", numbers(chunk));
    }
    text.push_str("};\n\n");
}

/// Code shared by all laws.
const BODY: &str = include_str!("body.c");

//! A law as C99 source: no library but `math.h`, no allocation, no global state that changes.

use super::{Kind, Surrogate, Symmetry, UNSEEN, symmetry};
use crate::Error;
use crate::network::Activation;
use std::fmt::Write;

/// Bytes of working memory on the stack that an exported law may need.
const MOST_STACK: usize = 1 << 20;

/// The two files of an exported law.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CSource {
    /// `NAME.h`.
    pub header: String,
    /// `NAME.c`.
    pub source: String,
}

impl Surrogate<f64> {
    /// The law as C: `int NAME(const double c[6], double s[6], double tangent[36], double *energy, double *spread,
    /// unsigned *flags)`, in the conventions of [`super::Answer`]; agrees with it to rounding (tested to 1e-12).
    ///
    /// # Errors
    /// [`Error::Parameter`] for a name that is no C identifier of 1 to 60 characters, or networks so wide that they would
    /// need more than 1 MiB of stack.
    pub fn c_source(&self, name: &str) -> Result<CSource, Error> {
        let first = name.chars().next().is_some_and(|c| c.is_ascii_alphabetic());
        if !first || name.len() > 60 || !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
            return Err(Error::parameter("name", name, "a letter, then letters, digits and `_`, up to 60"));
        }
        let architecture = &self.header.architecture;
        let widest = architecture.widths.iter().max().copied().unwrap_or(1);
        let stack = 8 * architecture.activations.len() * widest * (2 * self.mean.len() + 3);
        if stack > MOST_STACK {
            return Err(Error::parameter("network", format!("{stack} bytes of stack"), "up to 1 MiB"));
        }
        let header = format!(
            "/* {name}: a constitutive law C -> S, written by mdsurrogate. Voigt order 11 22 33 12 13 23, C_12 counted once.
 * s: second Piola-Kirchhoff stress, Pa. tangent (36, row by row, or NULL): 2 dS/dC, Pa, no factors.
 * energy (or NULL): W, J/m3, 0 if the law has none. spread (or NULL): disagreement of the ensemble, Pa.
 * flags (or NULL): bit a: component a of C is outside the training data; bit 6 + a: it never changed there;
 * bit 12: the ensemble disagrees. Returns 0; 1: C is not positive definite or not finite; 2: the result is not finite. */
#ifndef {upper}_H
#define {upper}_H
#ifdef __cplusplus
extern \"C\" {{
#endif
int {name}(const double c[6], double s[6], double tangent[36], double *energy, double *spread, unsigned *flags);
#ifdef __cplusplus
}}
#endif
#endif
",
            upper = name.to_uppercase()
        );
        let mut source = format!("#include \"{name}.h\"\n#include <math.h>\n#include <stddef.h>\n\n");
        self.data(&mut source, widest);
        self.inputs(&mut source);
        source.push_str(BODY.replace("NAME", name).trim_start());
        Ok(CSource { header, source })
    }

    fn data(&self, text: &mut String, widest: usize) {
        let architecture = &self.header.architecture;
        let energetic = matches!(self.header.kind, Kind::Energy { .. });
        let code = |activation: &Activation| {
            Activation::ALL.iter().position(|other| other == activation).unwrap_or_default().to_string()
        };
        let codes: Vec<String> = architecture.activations.iter().map(code).collect();
        let widths: Vec<String> = architecture.widths.iter().map(usize::to_string).collect();
        for (name, value) in [
            ("LAYERS", codes.len()),
            ("MEMBERS", self.members.len()),
            ("INPUTS", self.mean.len()),
            ("OUTPUTS", self.output.len()),
            ("WIDEST", widest),
            ("PARAMETERS", architecture.parameters()),
            ("ENERGETIC", usize::from(energetic)),
        ] {
            let _ = writeln!(text, "#define {name} {value}");
        }
        let limit = self.header.spread_limit.map_or("HUGE_VAL".to_owned(), |limit| format!("{limit:e}"));
        let _ = writeln!(text, "#define SPREAD_LIMIT {limit}\n#define UNSEEN {UNSEEN:e}");
        let _ = writeln!(text, "static const int width[] = {{{}}};", widths.join(", "));
        let _ = writeln!(text, "static const int activation[] = {{{}}};", codes.join(", "));
        for (name, values) in [
            ("mean", &self.mean),
            ("inverse", &self.inverse),
            ("output_mean", &self.output_mean),
            ("output", &self.output),
        ] {
            let _ = writeln!(text, "static const double {name}[] = {{{}}};", numbers(values.iter()));
        }
        let _ = writeln!(
            text,
            "static const double training_box[12] = {{{}}};",
            numbers(self.header.training_box.as_flattened().iter())
        );
        let rest: Vec<f64> = match energetic {
            true => {
                self.at_identity.iter().flat_map(|(first, at)| first.iter().chain([at]).copied()).collect()
            }
            false => vec![0.0; 7 * self.members.len()],
        };
        let _ = writeln!(
            text,
            "/* dN/dC and N at C = 1 */\nstatic const double rest[] = {{{}}};",
            numbers(rest.iter())
        );
        text.push_str("/* of each member and layer: weights row by row, then biases */\n");
        text.push_str("static const double weight[] = {\n");
        for layer in self.members.iter().flat_map(|member| member.layers()) {
            let _ = writeln!(text, "{},", numbers(layer.weights.iter().chain(&layer.bias)));
        }
        text.push_str("};\n\n");
    }

    /// The function from C to the inputs of the networks with its derivatives, polynomials written out.
    fn inputs(&self, text: &mut String) {
        let symmetry = match self.header.kind {
            Kind::Energy { symmetry, .. } => symmetry,
            Kind::Ann => Symmetry::Triclinic,
        };
        let unit = |a: usize, b: usize| f64::from(u8::from(a == b));
        let turn: Vec<f64> = (0..36)
            .map(|i| self.turn.as_ref().map_or(unit(i / 6, i % 6), |turn| turn[i / 6][i % 6]))
            .collect();
        let _ = writeln!(
            text,
            "/* C into material axes */\nstatic const double turn[36] = {{{}}};\n",
            numbers(turn.iter())
        );
        text.push_str(
            "static void inputs(const double *c, double *x, double (*d)[6], double (*dd)[6][6]) {\n",
        );
        for (k, invariant) in symmetry.invariants().iter().enumerate() {
            let sum =
                |terms: Vec<String>| if terms.is_empty() { "0.0".to_owned() } else { terms.join(" + ") };
            let _ = writeln!(text, "    x[{k}] = {};", sum(symmetry::terms(invariant, &[])));
            for a in 0..6 {
                let _ = writeln!(text, "    d[{k}][{a}] = {};", sum(symmetry::terms(invariant, &[a])));
                for b in 0..6 {
                    let _ = writeln!(
                        text,
                        "    dd[{k}][{a}][{b}] = {};",
                        sum(symmetry::terms(invariant, &[a, b]))
                    );
                }
            }
        }
        text.push_str("}\n\n");
    }
}

fn numbers<'a>(values: impl Iterator<Item = &'a f64>) -> String {
    // the shortest text that reads back to the same bits
    values.map(|value| format!("{value:e}")).collect::<Vec<_>>().join(", ")
}

/// What is the same for all laws.
const BODY: &str = r"
static void neuron(int kind, double x, double *y, double *d, double *dd) {
    double small = exp(-fabs(x));
    double s = x < 0 ? small / (1 + small) : 1 / (1 + small), slope = s * (1 - s);
    switch (kind) {
    case 1: *y = x <= 0 ? 0 : x; *d = x <= 0 ? 0 : 1; *dd = 0; break;
    case 2: *y = (x < 0 ? 0 : x) + log1p(small); *d = s; *dd = slope; break;
    case 3: *y = tanh(x); *d = 1 - *y * *y; *dd = -2 * *y * *d; break;
    case 4: *y = s; *d = slope; *dd = slope * (1 - 2 * s); break;
    case 5: *y = x * s; *d = s + x * slope; *dd = slope * (2 + x * (1 - 2 * s)); break;
    case 6: *y = x > 0 ? x : exp(x) - 1; *d = x > 0 ? 1 : exp(x); *dd = x > 0 ? 0 : exp(x); break;
    default: *y = x; *d = 1; *dd = 0; break;
    }
}

/* first: S of a map, dN/dC of an energy; second: its derivative by C */
static double member(int m, const double *c, double first[6], double second[6][6]) {
    double x[INPUTS], d[INPUTS][6], dd[INPUTS][6][6], local[6];
    double y[LAYERS][WIDEST], dy[LAYERS][WIDEST], ddy[LAYERS][WIDEST];
    double sum[LAYERS][WIDEST][INPUTS], slope[LAYERS][WIDEST][INPUTS];
    double f[6] = {0}, h[6][6] = {{0}}, half[6][6] = {{0}}, value = 0;
    const double *w = weight + (size_t)m * PARAMETERS, *start[LAYERS];
    int l, k, i, j, a, b;
    for (a = 0; a < 6; a++)
        for (local[a] = 0, b = 0; b < 6; b++) local[a] += turn[6 * a + b] * c[b];
    inputs(local, x, d, dd);
    for (i = 0; i < INPUTS; i++) x[i] = (x[i] - mean[i]) * inverse[i];
    for (l = 0; l < LAYERS; l++) {
        const double *before = l ? y[l - 1] : x, *bias = w + (size_t)width[l] * width[l + 1];
        start[l] = w;
        for (k = 0; k < width[l + 1]; k++) {
            double z = bias[k];
            for (i = 0; i < INPUTS; i++) sum[l][k][i] = 0;
            for (j = 0; j < width[l]; j++) {
                double v = w[(size_t)k * width[l] + j];
                z += v * before[j];
                if (l) for (i = 0; i < INPUTS; i++) sum[l][k][i] += v * slope[l - 1][j][i];
                else sum[l][k][j] = v;
            }
            neuron(activation[l], z, &y[l][k], &dy[l][k], &ddy[l][k]);
            for (i = 0; i < INPUTS; i++) slope[l][k][i] = dy[l][k] * sum[l][k][i];
        }
        w = bias + width[l + 1];
    }
    if (!ENERGETIC) {
        for (a = 0; a < OUTPUTS; a++) {
            first[a] = output_mean[a] + output[a] * y[LAYERS - 1][a];
            for (b = 0; b < 6; b++) second[a][b] = output[a] * slope[LAYERS - 1][a][b % INPUTS] * inverse[b % INPUTS];
        }
        return 0;
    }
    {
        double g[WIDEST] = {0}, gb[WIDEST], hessian[INPUTS][INPUTS] = {{0}};
        g[0] = 1;
        for (l = LAYERS - 1; l >= 0; l--) {
            for (j = 0; j < width[l]; j++) gb[j] = 0;
            for (k = 0; k < width[l + 1]; k++) {
                for (i = 0; i < INPUTS; i++)
                    for (j = 0; j < INPUTS; j++) hessian[i][j] += g[k] * ddy[l][k] * sum[l][k][i] * sum[l][k][j];
                for (j = 0; j < width[l]; j++) gb[j] += g[k] * dy[l][k] * start[l][(size_t)k * width[l] + j];
            }
            for (j = 0; j < width[l]; j++) g[j] = gb[j];
        }
        for (i = 0; i < INPUTS; i++) {
            double weight_i = output[0] * g[i] * inverse[i];
            for (a = 0; a < 6; a++) {
                f[a] += weight_i * d[i][a];
                for (b = 0; b < 6; b++) {
                    h[a][b] += weight_i * dd[i][a][b];
                    for (j = 0; j < INPUTS; j++)
                        h[a][b] += output[0] * hessian[i][j] * inverse[i] * inverse[j] * d[i][a] * d[j][b];
                }
            }
        }
        value = output[0] * y[LAYERS - 1][0];
    }
    for (k = 0; k < 6; k++)
        for (a = 0; a < 6; a++)
            for (b = 0; b < 6; b++) half[k][a] += h[k][b] * turn[6 * b + a];
    for (a = 0; a < 6; a++) {
        for (first[a] = 0, k = 0; k < 6; k++) first[a] += turn[6 * k + a] * f[k];
        for (b = 0; b < 6; b++)
            for (second[a][b] = 0, k = 0; k < 6; k++) second[a][b] += turn[6 * k + a] * half[k][b];
    }
    return value;
}

int NAME(const double c[6], double s[6], double tangent[36], double *energy, double *spread, unsigned *flags) {
    double all[MEMBERS][6], second[6][6], slope[36] = {0}, mean_stress[6] = {0}, w = 0, square = 0;
    double minor = c[0] * c[1] - c[3] * c[3];
    double det = c[0] * (c[1] * c[2] - c[5] * c[5]) - c[3] * (c[3] * c[2] - c[5] * c[4])
               + c[4] * (c[3] * c[5] - c[1] * c[4]);
    unsigned doubts = 0;
    int a, b, m;
    for (a = 0; a < 6; a++)
        if (!isfinite(c[a])) return 1;
    if (!(c[0] > 0 && minor > 0 && det > 0)) return 1;
    for (m = 0; m < MEMBERS; m++) {
        double value = member(m, c, all[m], second), linear = 0;
        for (a = 0; a < 6; a++) {
            double two = ENERGETIC && a < 3 ? 2 : 1;
            linear += rest[7 * m + a] * (c[a] - (a < 3));
            all[m][a] = two * (all[m][a] - rest[7 * m + a]);
            mean_stress[a] += all[m][a] / MEMBERS;
            for (b = 0; b < 6; b++) slope[6 * a + b] += two * second[a][b] * (b < 3 ? 2 : 1) / MEMBERS;
        }
        if (ENERGETIC) w += (value - rest[7 * m + 6] - linear) / MEMBERS;
    }
    for (m = 0; m < MEMBERS; m++)
        for (a = 0; a < 6; a++) square += (all[m][a] - mean_stress[a]) * (all[m][a] - mean_stress[a]);
    square = sqrt(square / MEMBERS);
    for (a = 0; a < 6; a++) {
        double low = training_box[2 * a], high = training_box[2 * a + 1], slack = low == high ? UNSEEN : 0;
        if (!(c[a] >= low - slack && c[a] <= high + slack)) doubts |= (1u << a) | (low == high ? 64u << a : 0);
        if (!isfinite(mean_stress[a])) return 2;
        for (b = 0; tangent && b < 6; b++)
            if (!isfinite(slope[6 * a + b])) return 2;
    }
    if (square > SPREAD_LIMIT) doubts |= 1u << 12;
    for (a = 0; a < 6; a++) s[a] = mean_stress[a];
    for (a = 0; tangent && a < 36; a++) tangent[a] = slope[a];
    if (energy) *energy = w;
    if (spread) *spread = square;
    if (flags) *flags = doubts;
    return 0;
}
";

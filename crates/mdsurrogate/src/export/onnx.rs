//! Export of a law as ONNX: operator set 17, with explicit derivatives of W.

use super::graph::{BOOLEAN, Builder, refs};
use super::protobuf::{
    OnnxDimension, OnnxGraph, OnnxModel, OnnxShape, OperatorSet, TensorType, Type, ValueInfo,
};
use super::{ExportModel, refuse_history};
use crate::Error;
use crate::surrogate::{CONSTANT_TOLERANCE, Kind, Surrogate, derivative};
use prost::Message;

/// Operator set, and the format version released with it.
const OPERATORS: i64 = 17;
const FORMAT: i64 = 8;

/// Options of an ONNX model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OnnxOptions {
    /// Numbers of 32 bits instead of 64.
    pub single: bool,
    /// Adds the output `tangent`.
    pub tangent: bool,
}

/// Exports a model as an ONNX file (operator set 17, double precision by default).
///
/// Input `C` (points, 6), C_12 not doubled. Outputs: `S` (points, 6) in Pa; `W` (points, 1) in J/m³ for an
/// energy; `spread` (points, 1) in Pa; `tangent` (points, 6, 6), ℂ = 2 ∂S/∂C in Pa, if requested; `outside`
/// (points, 6), components outside the training box; `far` (points, 1) for a model with a
/// [`Support`](crate::surrogate::Support). C is not checked: results at a C that is not positive definite are
/// meaningless.
///
/// # Errors
/// Returns [`Error::Parameter`] for a law with softening.
pub fn onnx(model: &Surrogate, options: OnnxOptions) -> Result<Vec<u8>, Error> {
    refuse_history(model)?;
    Ok(ExportModel::new(model).onnx(options))
}

/// Invariants, and the parts of their derivatives.
struct Invariant {
    /// Invariants x, (points, inputs).
    x: String,
    /// Derivatives of the polynomials by each component, (points, inputs).
    slopes: Vec<String>,
    /// ∂x/∂p for invariants that are roots of polynomials p, (points, inputs).
    root: Option<String>,
    /// All monomials, (points, monomials), and their factors.
    powers: String,
    monomials: Vec<Vec<usize>>,
}

/// S, W and ℂ of each member.
#[derive(Default)]
struct Members {
    stresses: Vec<String>,
    energies: Vec<String>,
    tangents: Vec<String>,
}

impl ExportModel<'_> {
    fn onnx(&self, options: OnnxOptions) -> Vec<u8> {
        let mut graph = Builder::new(options.single);
        let element = graph.element;
        let mut outputs = vec![("S", element, vec![6])];
        let Members { stresses, energies, tangents } = match self.header.kind {
            Kind::Ann => self.mapped_stresses(&mut graph, options.tangent),
            Kind::Energy { .. } => self.energetic_stresses(&mut graph, options.tangent),
        };
        for (list, name, shape) in [(&energies, "W", vec![1]), (&tangents, "tangent", vec![6, 6])] {
            if !list.is_empty() {
                let all = graph.node("Sum", &refs(list));
                let count = graph.scalar(1.0 / list.len() as f64);
                graph.named("Mul", &[&all, &count], name);
                outputs.push((name, element, shape));
            }
        }
        let count = graph.scalar(1.0 / stresses.len() as f64);
        let all = graph.node("Sum", &refs(&stresses));
        graph.named("Mul", &[&all, &count], "S");
        let squares: Vec<String> = stresses
            .iter()
            .map(|stress| {
                let distance = graph.node("Sub", &[stress, "S"]);
                graph.node("Mul", &[&distance, &distance])
            })
            .collect();
        let all = graph.node("Sum", &refs(&squares));
        let norm = graph.sum_of_columns(&all);
        let mean = graph.node("Mul", &[&norm, &count]);
        graph.named("Sqrt", &[&mean], "spread");
        outputs.push(("spread", element, vec![1]));
        self.box_flags(&mut graph);
        outputs.push(("outside", BOOLEAN, vec![6]));
        if self.distance_flag(&mut graph) {
            outputs.push(("far", BOOLEAN, vec![1]));
        }
        let value = |(name, element, widths): &(&str, i32, Vec<i64>)| ValueInfo {
            name: (*name).into(),
            r#type: Some(Type {
                tensor_type: Some(TensorType {
                    elem_type: *element,
                    shape: Some(OnnxShape {
                        dim: std::iter::once(OnnxDimension {
                            dim_value: None,
                            dim_param: Some("points".into()),
                        })
                        .chain(
                            widths
                                .iter()
                                .map(|width| OnnxDimension { dim_value: Some(*width), dim_param: None }),
                        )
                        .collect(),
                    }),
                }),
            }),
            doc_string: String::new(),
        };
        let model = OnnxModel {
            ir_version: FORMAT,
            producer_name: "mdsurrogate".into(),
            producer_version: env!("CARGO_PKG_VERSION").into(),
            doc_string: "C (11 22 33 12 13 23, C_12 not doubled) -> second Piola-Kirchhoff stress, Pa".into(),
            graph: Some(OnnxGraph {
                node: graph.nodes,
                name: "law".into(),
                initializer: graph.constants,
                input: vec![value(&("C", element, vec![6]))],
                output: outputs.iter().map(value).collect(),
            }),
            opset_import: vec![OperatorSet { domain: String::new(), version: OPERATORS }],
        };
        model.encode_to_vec()
    }

    fn mapped_stresses(&self, graph: &mut Builder, tangent: bool) -> Members {
        let input = self.standardised(graph, "C");
        let (scale, shift) = (graph.row(self.coefficients.output), graph.row(self.coefficients.output_mean));
        let mut found = Members::default();
        for member in self.members {
            let mut y = input.clone();
            // ∂y/∂c: initially a constant matrix
            let start: Vec<f64> = (0..36)
                .map(|i| if i / 6 == i % 6 { self.coefficients.inverse[i / 6] } else { 0.0 })
                .collect();
            let mut change = graph.matrix(&start, 6);
            for layer in member.layers() {
                let (value, slope, _) = graph.layer(layer, &y, u8::from(tangent));
                y = value;
                if tangent {
                    change = graph.chain_rule(layer, &change, slope.as_deref());
                }
            }
            let scaled = graph.node("Mul", &[&y, &scale]);
            found.stresses.push(graph.node("Add", &[&scaled, &shift]));
            if tangent {
                // 2 ∂S/∂C of normal components, ∂S/∂C of shears, which count once
                let factors: Vec<f64> = (0..36)
                    .map(|i| self.coefficients.output[i / 6] * if i % 6 < 3 { 2.0 } else { 1.0 })
                    .collect();
                let factors = graph.matrix(&factors, 6);
                found.tangents.push(graph.scaled_per_point(&change, &factors));
            }
        }
        found
    }

    /// Computes S, W and ℂ of each member.
    fn energetic_stresses(&self, graph: &mut Builder, tangent: bool) -> Members {
        let turn = self.coefficients.turn.map(|turn| {
            let flat = turn.as_flattened();
            let transposed: Vec<f64> = (0..36).map(|i| flat[6 * (i % 6) + i / 6]).collect();
            (graph.matrix(flat, 6), graph.matrix(&transposed, 6))
        });
        let local = match &turn {
            Some((_, transposed)) => graph.node("MatMul", &["C", transposed]),
            None => "C".to_owned(),
        };
        let invariants = self.polynomials(graph, &local);
        let Invariant { x, slopes, root, .. } = &invariants;
        let curvature = tangent.then(|| self.curvatures(graph, &invariants));
        let input = self.standardised(graph, x);
        let identity = graph.row(&[1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        let strain = graph.node("Sub", &["C", &identity]);
        let twice = [2.0, 2.0, 2.0, 1.0, 1.0, 1.0];
        let two = graph.row(&twice);
        let mut found = Members::default();
        for (member, rest) in self.members.iter().zip(self.coefficients.rest) {
            let inputs = self.coefficients.mean.len();
            let (mut y, mut slopes_of_layers) = (input.clone(), Vec::new());
            // ∂z/∂x̂ of each layer, and σ″
            let mut changes = Vec::new();
            let start: Vec<f64> =
                (0..inputs * inputs).map(|i| f64::from(u8::from(i / inputs == i % inputs))).collect();
            let mut change = if tangent { graph.matrix(&start, inputs) } else { String::new() };
            for layer in member.layers() {
                let (value, slope, bend) = graph.layer(layer, &y, if tangent { 2 } else { 1 });
                if tangent {
                    changes.push((graph.chain_rule(layer, &change, None), bend));
                    change = graph.chain_rule(layer, &change, slope.as_deref());
                }
                y = value;
                slopes_of_layers.push(slope);
            }
            // reverse mode: δ = g σ′, and g of the previous layer = δ W
            let mut g = graph.matrix(&[1.0], 1);
            let mut bent: Vec<String> = Vec::new();
            for (number, (layer, slope)) in member.layers().iter().zip(&slopes_of_layers).enumerate().rev() {
                if let Some((change, Some(bend))) = changes.get(number) {
                    let factor = graph.node("Mul", &[&g, bend]);
                    bent.push(graph.quadratic(change, &factor));
                }
                if let Some(slope) = slope {
                    g = graph.node("Mul", &[&g, slope]);
                }
                let weights = graph.matrix(&layer.weights, layer.weights.len() / layer.bias.len());
                g = graph.node("MatMul", &[&g, &weights]);
            }
            let scale: Vec<f64> = self
                .coefficients
                .inverse
                .iter()
                .map(|inverse| self.coefficients.output[0] * inverse)
                .collect();
            let (scale, added) = (graph.row(&scale), graph.row(&rest.invariants[..inputs]));
            let scaled = graph.node("Mul", &[&g, &scale]);
            let by_invariant = graph.node("Add", &[&scaled, &added]);
            let mut weights = by_invariant.clone();
            if let Some(half) = root {
                weights = graph.node("Mul", &[&weights, half]);
            }
            let columns: Vec<String> = slopes
                .iter()
                .map(|slope| {
                    let product = graph.node("Mul", &[&weights, slope]);
                    graph.sum_of_columns(&product)
                })
                .collect();
            let mut first = graph.concatenated(&columns);
            if let Some((turn, _)) = &turn {
                first = graph.node("MatMul", &[&first, turn]);
            }
            let at_rest = graph.row(&rest.slope);
            let difference = graph.node("Sub", &[&first, &at_rest]);
            found.stresses.push(graph.node("Mul", &[&difference, &two]));
            if let Some((gradient, seconds)) = &curvature {
                // Σₖ ∂W/∂xₖ ∂²xₖ/∂c∂c
                let columns: Vec<String> = seconds
                    .iter()
                    .map(|second| {
                        let product = graph.node("Mul", &[&weights, second]);
                        graph.sum_of_columns(&product)
                    })
                    .collect();
                let all: Vec<String> = (0..36).map(|i| columns[pair(i / 6, i % 6)].clone()).collect();
                let flat = graph.concatenated(&all);
                let shape = graph.integers(&[-1, 6, 6]);
                let mut hessian = graph.node("Reshape", &[&flat, &shape]);
                if root.is_some() {
                    // ∂²√p = ½ ∂²p/√p − ∂√p ∂√p/√p, for the roots only
                    let is_root: Vec<f64> =
                        (0..inputs).map(|k| f64::from(u8::from(self.invariants().polynomial(k).1))).collect();
                    let is_root = graph.row(&is_root);
                    let of_roots = graph.node("Mul", &[&by_invariant, &is_root]);
                    let factor = graph.node("Div", &[&of_roots, x]);
                    let less = graph.quadratic(gradient, &factor);
                    hessian = graph.node("Sub", &[&hessian, &less]);
                }
                if !bent.is_empty() {
                    // (∂x/∂c)ᵀ ∂²W/∂x∂x ∂x/∂c
                    let sum = graph.node("Sum", &refs(&bent));
                    let scales: Vec<f64> = (0..inputs * inputs)
                        .map(|i| {
                            self.coefficients.output[0]
                                * self.coefficients.inverse[i / inputs]
                                * self.coefficients.inverse[i % inputs]
                        })
                        .collect();
                    let scales = graph.matrix(&scales, inputs);
                    let of_network = graph.node("Mul", &[&sum, &scales]);
                    let transposed = graph.transposed(gradient);
                    let half = graph.node("MatMul", &[&transposed, &of_network]);
                    let whole = graph.node("MatMul", &[&half, gradient]);
                    hessian = graph.node("Add", &[&hessian, &whole]);
                }
                if let Some((turn, transposed)) = &turn {
                    let half = graph.node("MatMul", &[transposed, &hessian]);
                    hessian = graph.node("MatMul", &[&half, turn]);
                }
                let factors: Vec<f64> = (0..36).map(|i| twice[i / 6] * twice[i % 6]).collect();
                let factors = graph.matrix(&factors, 6);
                found.tangents.push(graph.node("Mul", &[&hessian, &factors]));
            }
            let (unit, value) = (graph.scalar(self.coefficients.output[0]), graph.scalar(rest.value));
            let energy = graph.node("Mul", &[&y, &unit]);
            let at = graph.row(&rest.at[..inputs]);
            let from_rest = graph.node("Sub", &[x, &at]);
            let column = graph.matrix(&rest.invariants[..inputs], 1);
            let correction = graph.node("MatMul", &[&from_rest, &column]);
            let energy = graph.node("Add", &[&energy, &correction]);
            let column = graph.matrix(&rest.slope, 1);
            let linear = graph.node("MatMul", &[&strain, &column]);
            let energy = graph.node("Sub", &[&energy, &linear]);
            found.energies.push(graph.node("Sub", &[&energy, &value]));
        }
        found
    }

    /// Computes ∂x/∂c, (points, inputs, 6), and second derivatives of the polynomials by each pair of
    /// components, (points, inputs).
    fn curvatures(&self, graph: &mut Builder, invariants: &Invariant) -> (String, Vec<String>) {
        let axis = graph.integers(&[2]);
        let columns: Vec<String> = invariants
            .slopes
            .iter()
            .map(|slope| {
                let slope = match &invariants.root {
                    Some(root) => graph.node("Mul", &[slope, root]),
                    None => slope.clone(),
                };
                graph.node("Unsqueeze", &[&slope, &axis])
            })
            .collect();
        let gradient = graph.joined(&columns, 2);
        let pairs = (0..6).flat_map(|b| (0..=b).map(move |a| [a, b]));
        let seconds = pairs
            .map(|pair| self.polynomial_derivatives(graph, &invariants.powers, &invariants.monomials, &pair))
            .collect();
        (gradient, seconds)
    }

    /// Computes derivatives of all polynomials by some components, (points, inputs).
    fn polynomial_derivatives(
        &self,
        graph: &mut Builder,
        powers: &str,
        monomials: &[Vec<usize>],
        by: &[usize],
    ) -> String {
        let invariants = self.invariants();
        let count = invariants.count();
        let (mut matrix, mut constant) = (vec![0.0; monomials.len() * count], vec![0.0; count]);
        for k in 0..count {
            for (coefficient, mut factors) in derivative(invariants.polynomial(k).0, by) {
                factors.sort_unstable();
                match monomials.iter().position(|other| *other == factors) {
                    Some(row) => matrix[row * count + k] += coefficient,
                    None => constant[k] += coefficient,
                }
            }
        }
        let (matrix, constant) = (graph.matrix(&matrix, count), graph.row(&constant));
        let product = graph.node("MatMul", &[powers, &matrix]);
        graph.node("Add", &[&product, &constant])
    }

    /// Computes invariants and slopes: all polynomials as products of one list of monomials with constant
    /// matrices.
    fn polynomials(&self, graph: &mut Builder, c: &str) -> Invariant {
        let invariants = self.invariants();
        let count = invariants.count();
        let mut monomials: Vec<Vec<usize>> = (0..6).map(|a| vec![a]).collect();
        for (k, a) in (0..count).flat_map(|k| (0..7).map(move |a| (k, a))) {
            let by = if a == 6 { &[] } else { std::slice::from_ref(&a) };
            for (_, mut factors) in derivative(invariants.polynomial(k).0, by) {
                factors.sort_unstable();
                if !factors.is_empty() && !monomials.contains(&factors) {
                    monomials.push(factors);
                }
            }
        }
        let components: Vec<String> = (0..6).map(|a| graph.column(c, a)).collect();
        let mut columns = Vec::new();
        for factors in &monomials {
            let mut product = components[factors[0]].clone();
            for &a in &factors[1..] {
                product = graph.node("Mul", &[&product, &components[a]]);
            }
            columns.push(product);
        }
        let powers = graph.concatenated(&columns);
        let x = self.polynomial_derivatives(graph, &powers, &monomials, &[]);
        let slopes: Vec<String> =
            (0..6).map(|a| self.polynomial_derivatives(graph, &powers, &monomials, &[a])).collect();
        let is_root = |k: usize| invariants.polynomial(k).1;
        if !(0..count).any(is_root) {
            return Invariant { x, slopes, root: None, powers, monomials };
        }
        // √p instead of p, and ½/√p as factor of its slopes
        let half = graph.scalar(0.5);
        let (mut all, mut factors) = (Vec::new(), Vec::new());
        for k in 0..count {
            let plain = graph.column(&x, k);
            let value = if is_root(k) { graph.node("Sqrt", &[&plain]) } else { plain };
            let over = if is_root(k) { &half } else { &value };
            factors.push(graph.node("Div", &[over, &value]));
            all.push(value);
        }
        let (x, root) = (graph.concatenated(&all), Some(graph.concatenated(&factors)));
        Invariant { x, slopes, root, powers, monomials }
    }

    fn standardised(&self, graph: &mut Builder, x: &str) -> String {
        let (mean, inverse) = (graph.row(self.coefficients.mean), graph.row(self.coefficients.inverse));
        let difference = graph.node("Sub", &[x, &mean]);
        graph.node("Mul", &[&difference, &inverse])
    }

    fn box_flags(&self, graph: &mut Builder) {
        let slack = |[low, high]: &[f64; 2]| if low == high { CONSTANT_TOLERANCE } else { 0.0 };
        let limits = &self.header.training_box;
        let low: Vec<f64> = limits.iter().map(|limit| limit[0] - slack(limit)).collect();
        let high: Vec<f64> = limits.iter().map(|limit| limit[1] + slack(limit)).collect();
        let (low, high) = (graph.limit(&low, f32::next_down), graph.limit(&high, f32::next_up));
        let below = graph.node("Less", &["C", &low]);
        let above = graph.node("Greater", &["C", &high]);
        graph.named("Or", &[&below, &above], "outside");
    }

    /// Adds the output `far`; returns false if the model has no support.
    fn distance_flag(&self, graph: &mut Builder) -> bool {
        let (Some(support), Some(farthest)) = (&self.header.support, self.coefficients.farthest) else {
            return false;
        };
        let points = graph.matrix(support.points.as_flattened(), 6);
        let (weights, axis) = (graph.row(&support.weights), graph.integers(&[1]));
        let apart = graph.node("Unsqueeze", &["C", &axis]);
        let difference = graph.node("Sub", &[&apart, &points]);
        let weighted = graph.node("Mul", &[&difference, &weights]);
        let square = graph.node("Mul", &[&weighted, &weighted]);
        let axis = graph.integers(&[2]);
        let sum = graph.node_with("ReduceSum", &[&square, &axis], vec![super::graph::integer("keepdims", 0)]);
        let axes = super::graph::integers("axes", &[1]);
        let least = graph.node_with("ReduceMin", &[&sum], vec![axes, super::graph::integer("keepdims", 1)]);
        let distance = graph.node("Sqrt", &[&least]);
        let limit = graph.scalar(farthest);
        graph.named("Greater", &[&distance, &limit], "far");
        true
    }
}

/// Returns the index of a pair of components in the upper triangle, column by column.
fn pair(a: usize, b: usize) -> usize {
    let (a, b) = (a.min(b), a.max(b));
    b * (b + 1) / 2 + a
}

//! A law as ONNX: operators of set 17 in double precision, W's derivatives written out.

use super::protobuf::{
    Attribute, Dimension, Graph, Model as File, Node, OperatorSet, Shape, Tensor, TensorType, Type, ValueInfo,
};
use super::{Model, refuse_history};
use crate::Error;
use crate::network::{Activation, Layer};
use crate::surrogate::{Kind, Surrogate, UNSEEN, derivative};
use prost::Message;

/// The operator set, and the version of the format that came with it.
const OPERATORS: i64 = 17;
const FORMAT: i64 = 8;
const DOUBLE: i32 = 11;
const INTEGER: i32 = 7;
const BOOLEAN: i32 = 9;

/// A model as the bytes of an ONNX model (operator set 17, doubles).
///
/// Input `C` (points, 6), C_12 not doubled. Outputs: `S` (points, 6) in Pa; `W` (points, 1) in J/m³ of an energy;
/// `spread` (points, 1) in Pa; `outside` (points, 6), whether a component leaves the training box; `far` (points, 1) of
/// a model with a [`Support`](crate::surrogate::Support). C is not checked: the result at a C that is not positive definite
/// means nothing.
///
/// # Errors
/// [`Error::Parameter`] for a law with softening.
pub fn onnx(model: &Surrogate) -> Result<Vec<u8>, Error> {
    refuse_history(model)?;
    Ok(Model::new(model).onnx())
}

impl Model<'_> {
    fn onnx(&self) -> Vec<u8> {
        let mut graph = Builder::default();
        let mut outputs = vec![("S", DOUBLE, 6)];
        let stresses = match self.header.kind {
            Kind::Ann => self.mapped_stresses(&mut graph),
            Kind::Energy { .. } => {
                let (stresses, energies) = self.energetic_stresses(&mut graph);
                let all = graph.node("Sum", &refs(&energies));
                let count = graph.scalar(1.0 / energies.len() as f64);
                graph.named("Mul", &[&all, &count], "W");
                outputs.push(("W", DOUBLE, 1));
                stresses
            }
        };
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
        outputs.push(("spread", DOUBLE, 1));
        self.box_flags(&mut graph);
        outputs.push(("outside", BOOLEAN, 6));
        if self.distance_flag(&mut graph) {
            outputs.push(("far", BOOLEAN, 1));
        }
        let value = |&(name, element, width): &(&str, i32, i64)| ValueInfo {
            name: name.into(),
            r#type: Some(Type {
                tensor_type: Some(TensorType {
                    elem_type: element,
                    shape: Some(Shape {
                        dim: vec![
                            Dimension { dim_value: None, dim_param: Some("points".into()) },
                            Dimension { dim_value: Some(width), dim_param: None },
                        ],
                    }),
                }),
            }),
            doc_string: String::new(),
        };
        let model = File {
            ir_version: FORMAT,
            producer_name: "mdsurrogate".into(),
            producer_version: env!("CARGO_PKG_VERSION").into(),
            doc_string: "C (11 22 33 12 13 23, C_12 not doubled) -> second Piola-Kirchhoff stress, Pa".into(),
            graph: Some(Graph {
                node: graph.nodes,
                name: "law".into(),
                initializer: graph.constants,
                input: vec![value(&("C", DOUBLE, 6))],
                output: outputs.iter().map(value).collect(),
            }),
            opset_import: vec![OperatorSet { domain: String::new(), version: OPERATORS }],
        };
        model.encode_to_vec()
    }

    fn mapped_stresses(&self, graph: &mut Builder) -> Vec<String> {
        let input = self.standardised(graph, "C");
        let (scale, shift) = (graph.row(self.of.output), graph.row(self.of.output_mean));
        let stress = |member: &crate::network::Network<f64>| {
            let mut y = input.clone();
            for layer in member.layers() {
                y = graph.layer(layer, &y, false).0;
            }
            let scaled = graph.node("Mul", &[&y, &scale]);
            graph.node("Add", &[&scaled, &shift])
        };
        self.members.iter().map(stress).collect()
    }

    /// S and W of each member.
    fn energetic_stresses(&self, graph: &mut Builder) -> (Vec<String>, Vec<String>) {
        let turn = self.of.turn.map(|turn| {
            let flat = turn.as_flattened();
            let transposed: Vec<f64> = (0..36).map(|i| flat[6 * (i % 6) + i / 6]).collect();
            (graph.matrix(flat, 6), graph.matrix(&transposed, 6))
        });
        let local = match &turn {
            Some((_, transposed)) => graph.node("MatMul", &["C", transposed]),
            None => "C".to_owned(),
        };
        let (x, slopes, root) = self.polynomials(graph, &local);
        let input = self.standardised(graph, &x);
        let identity = graph.row(&[1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        let strain = graph.node("Sub", &["C", &identity]);
        let two = graph.row(&[2.0, 2.0, 2.0, 1.0, 1.0, 1.0]);
        let (mut stresses, mut energies) = (Vec::new(), Vec::new());
        for (member, rest) in self.members.iter().zip(self.of.rest) {
            let inputs = self.of.mean.len();
            let (mut y, mut slopes_of_layers) = (input.clone(), Vec::new());
            for layer in member.layers() {
                let (value, slope) = graph.layer(layer, &y, true);
                y = value;
                slopes_of_layers.push(slope);
            }
            // reverse mode: δ = g σ′, g of the layer before = δ W
            let mut g = graph.matrix(&[1.0], 1);
            for (layer, slope) in member.layers().iter().zip(&slopes_of_layers).rev() {
                if let Some(slope) = slope {
                    g = graph.node("Mul", &[&g, slope]);
                }
                let weights = graph.matrix(&layer.weights, layer.weights.len() / layer.bias.len());
                g = graph.node("MatMul", &[&g, &weights]);
            }
            let scale: Vec<f64> = self.of.inverse.iter().map(|inverse| self.of.output[0] * inverse).collect();
            let (scale, added) = (graph.row(&scale), graph.row(&rest.invariants[..inputs]));
            let scaled = graph.node("Mul", &[&g, &scale]);
            let mut weights = graph.node("Add", &[&scaled, &added]);
            if let Some(half) = &root {
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
            stresses.push(graph.node("Mul", &[&difference, &two]));
            let (unit, value) = (graph.scalar(self.of.output[0]), graph.scalar(rest.value));
            let energy = graph.node("Mul", &[&y, &unit]);
            let at = graph.row(&rest.at[..inputs]);
            let from_rest = graph.node("Sub", &[&x, &at]);
            let column = graph.matrix(&rest.invariants[..inputs], 1);
            let correction = graph.node("MatMul", &[&from_rest, &column]);
            let energy = graph.node("Add", &[&energy, &correction]);
            let column = graph.matrix(&rest.slope, 1);
            let linear = graph.node("MatMul", &[&strain, &column]);
            let energy = graph.node("Sub", &[&energy, &linear]);
            energies.push(graph.node("Sub", &[&energy, &value]));
        }
        (stresses, energies)
    }

    /// The invariants (points, inputs), their derivatives by each component, and a factor on ∂W/∂x where some are roots:
    /// all polynomials as products of one list of monomials with constant matrices.
    fn polynomials(&self, graph: &mut Builder, c: &str) -> (String, Vec<String>, Option<String>) {
        let invariants = self.invariants();
        let count = invariants.count();
        let list = |k: usize, by: &[usize]| derivative(invariants.polynomial(k).0, by);
        let mut monomials: Vec<Vec<usize>> = (0..6).map(|a| vec![a]).collect();
        for (k, a) in (0..count).flat_map(|k| (0..7).map(move |a| (k, a))) {
            for (_, mut factors) in list(k, if a == 6 { &[] } else { std::slice::from_ref(&a) }) {
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
        let mut polynomial = |by: &[usize]| {
            let (mut matrix, mut constant) = (vec![0.0; monomials.len() * count], vec![0.0; count]);
            for k in 0..count {
                for (coefficient, mut factors) in list(k, by) {
                    factors.sort_unstable();
                    match monomials.iter().position(|other| *other == factors) {
                        Some(row) => matrix[row * count + k] += coefficient,
                        None => constant[k] += coefficient,
                    }
                }
            }
            let (matrix, constant) = (graph.matrix(&matrix, count), graph.row(&constant));
            let product = graph.node("MatMul", &[&powers, &matrix]);
            graph.node("Add", &[&product, &constant])
        };
        let x = polynomial(&[]);
        let slopes: Vec<String> = (0..6).map(|a| polynomial(&[a])).collect();
        let is_root = |k: usize| invariants.polynomial(k).1;
        if !(0..count).any(is_root) {
            return (x, slopes, None);
        }
        // √p instead of p, and ½/√p before its slopes
        let half = graph.scalar(0.5);
        let (mut all, mut factors) = (Vec::new(), Vec::new());
        for k in 0..count {
            let plain = graph.column(&x, k);
            let value = if is_root(k) { graph.node("Sqrt", &[&plain]) } else { plain };
            let over = if is_root(k) { &half } else { &value };
            factors.push(graph.node("Div", &[over, &value]));
            all.push(value);
        }
        let (x, factors) = (graph.concatenated(&all), graph.concatenated(&factors));
        (x, slopes, Some(factors))
    }

    fn standardised(&self, graph: &mut Builder, x: &str) -> String {
        let (mean, inverse) = (graph.row(self.of.mean), graph.row(self.of.inverse));
        let difference = graph.node("Sub", &[x, &mean]);
        graph.node("Mul", &[&difference, &inverse])
    }

    fn box_flags(&self, graph: &mut Builder) {
        let slack = |[low, high]: &[f64; 2]| if low == high { UNSEEN } else { 0.0 };
        let limits = &self.header.training_box;
        let low: Vec<f64> = limits.iter().map(|limit| limit[0] - slack(limit)).collect();
        let high: Vec<f64> = limits.iter().map(|limit| limit[1] + slack(limit)).collect();
        let (low, high) = (graph.row(&low), graph.row(&high));
        let below = graph.node("Less", &["C", &low]);
        let above = graph.node("Greater", &["C", &high]);
        graph.named("Or", &[&below, &above], "outside");
    }

    /// Whether there is one.
    fn distance_flag(&self, graph: &mut Builder) -> bool {
        let (Some(support), Some(farthest)) = (&self.header.support, self.of.farthest) else { return false };
        let points = graph.matrix(support.points.as_flattened(), 6);
        let (weights, axis) = (graph.row(&support.weights), graph.integers(&[1]));
        let apart = graph.node("Unsqueeze", &["C", &axis]);
        let difference = graph.node("Sub", &[&apart, &points]);
        let weighted = graph.node("Mul", &[&difference, &weights]);
        let square = graph.node("Mul", &[&weighted, &weighted]);
        let axis = graph.integers(&[2]);
        let sum = graph.with("ReduceSum", &[&square, &axis], vec![integer("keepdims", 0)]);
        let axes = Attribute { name: "axes".into(), i: 0, ints: vec![1], r#type: 7 };
        let least = graph.with("ReduceMin", &[&sum], vec![axes, integer("keepdims", 1)]);
        let distance = graph.node("Sqrt", &[&least]);
        let limit = graph.scalar(farthest);
        graph.named("Greater", &[&distance, &limit], "far");
        true
    }
}

/// A graph as it grows.
#[derive(Default)]
struct Builder {
    nodes: Vec<Node>,
    constants: Vec<Tensor>,
}

impl Builder {
    fn with(&mut self, operator: &str, inputs: &[&str], attribute: Vec<Attribute>) -> String {
        let name = format!("n{}", self.nodes.len());
        self.named(operator, inputs, &name);
        if let Some(node) = self.nodes.last_mut() {
            node.attribute = attribute;
        }
        name
    }

    fn node(&mut self, operator: &str, inputs: &[&str]) -> String {
        self.with(operator, inputs, Vec::new())
    }

    fn named(&mut self, operator: &str, inputs: &[&str], output: &str) {
        self.nodes.push(Node {
            input: inputs.iter().map(|&input| input.to_owned()).collect(),
            output: vec![output.to_owned()],
            op_type: operator.to_owned(),
            attribute: Vec::new(),
        });
    }

    fn constant(&mut self, dims: Vec<i64>, data_type: i32, raw_data: Vec<u8>) -> String {
        let name = format!("c{}", self.constants.len());
        self.constants.push(Tensor { dims, data_type, name: name.clone(), raw_data });
        name
    }

    /// (rows, columns), row by row.
    fn matrix(&mut self, values: &[f64], columns: usize) -> String {
        let bytes = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.constant(vec![(values.len() / columns) as i64, columns as i64], DOUBLE, bytes)
    }

    fn row(&mut self, values: &[f64]) -> String {
        self.matrix(values, values.len())
    }

    fn scalar(&mut self, value: f64) -> String {
        self.constant(Vec::new(), DOUBLE, value.to_le_bytes().to_vec())
    }

    fn integers(&mut self, values: &[i64]) -> String {
        let bytes = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.constant(vec![values.len() as i64], INTEGER, bytes)
    }

    fn column(&mut self, x: &str, index: usize) -> String {
        let index = self.integers(&[index as i64]);
        self.with("Gather", &[x, &index], vec![integer("axis", 1)])
    }

    fn concatenated(&mut self, columns: &[String]) -> String {
        self.with("Concat", &refs(columns), vec![integer("axis", 1)])
    }

    fn sum_of_columns(&mut self, x: &str) -> String {
        let axis = self.integers(&[1]);
        self.node("ReduceSum", &[x, &axis])
    }

    /// σ(W x + b), and σ′ if it is wanted and not 1.
    fn layer(&mut self, layer: &Layer<f64>, x: &str, slope: bool) -> (String, Option<String>) {
        let (weights, bias) =
            (self.matrix(&layer.weights, layer.weights.len() / layer.bias.len()), self.row(&layer.bias));
        let z = self.with("Gemm", &[x, &weights, &bias], vec![integer("transB", 1)]);
        let unit = self.scalar(1.0);
        let value = match layer.activation {
            Activation::Linear => return (z, None),
            Activation::Relu => self.node("Relu", &[&z]),
            Activation::Softplus => {
                // max(z, 0) + ln(1 + e^−|z|)
                let (positive, size) = (self.node("Relu", &[&z]), self.node("Abs", &[&z]));
                let negative = self.node("Neg", &[&size]);
                let small = self.node("Exp", &[&negative]);
                let sum = self.node("Add", &[&small, &unit]);
                let logarithm = self.node("Log", &[&sum]);
                self.node("Add", &[&positive, &logarithm])
            }
            Activation::Tanh => self.node("Tanh", &[&z]),
            Activation::Sigmoid => self.node("Sigmoid", &[&z]),
            Activation::Silu => {
                let s = self.node("Sigmoid", &[&z]);
                self.node("Mul", &[&z, &s])
            }
            Activation::Elu => {
                let (positive, small) = (self.node("Relu", &[&z]), self.exp_of_negative_part(&z));
                let below = self.node("Sub", &[&small, &unit]);
                self.node("Add", &[&positive, &below])
            }
        };
        if !slope {
            return (value, None);
        }
        let slope = match layer.activation {
            Activation::Linear => return (value, None),
            Activation::Relu => {
                let zero = self.scalar(0.0);
                let on = self.node("Greater", &[&z, &zero]);
                self.with("Cast", &[&on], vec![integer("to", DOUBLE.into())])
            }
            Activation::Softplus => self.node("Sigmoid", &[&z]),
            Activation::Tanh => {
                let square = self.node("Mul", &[&value, &value]);
                self.node("Sub", &[&unit, &square])
            }
            Activation::Sigmoid => {
                let rest = self.node("Sub", &[&unit, &value]);
                self.node("Mul", &[&value, &rest])
            }
            Activation::Silu => {
                // s + z s (1 − s)
                let s = self.node("Sigmoid", &[&z]);
                let rest = self.node("Sub", &[&unit, &s]);
                let bent = self.node("Mul", &[&value, &rest]);
                self.node("Add", &[&s, &bent])
            }
            Activation::Elu => self.exp_of_negative_part(&z),
        };
        (value, Some(slope))
    }

    /// e^min(z, 0).
    fn exp_of_negative_part(&mut self, z: &str) -> String {
        let turned = self.node("Neg", &[z]);
        let below = self.node("Relu", &[&turned]);
        let back = self.node("Neg", &[&below]);
        self.node("Exp", &[&back])
    }
}

fn integer(name: &str, value: i64) -> Attribute {
    Attribute { name: name.into(), i: value, ints: Vec::new(), r#type: 2 }
}

fn refs(list: &[String]) -> Vec<&str> {
    list.iter().map(String::as_str).collect()
}

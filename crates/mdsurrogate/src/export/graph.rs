//! ONNX graphs: nodes, constants, layers of networks and their derivatives.

use super::protobuf::{OnnxAttribute, OnnxNode, OnnxTensor};
use crate::network::{Activation, Layer};

/// Element types of ONNX.
const SINGLE: i32 = 1;
const DOUBLE: i32 = 11;
const INTEGER: i32 = 7;
pub(super) const BOOLEAN: i32 = 9;

/// An ONNX graph under construction.
pub(super) struct Builder {
    pub nodes: Vec<OnnxNode>,
    pub constants: Vec<OnnxTensor>,
    /// Element type of the numbers.
    pub element: i32,
}

impl Builder {
    /// Creates a graph in single or double precision.
    pub fn new(single: bool) -> Self {
        Self { nodes: Vec::new(), constants: Vec::new(), element: if single { SINGLE } else { DOUBLE } }
    }

    /// Returns the bytes of numbers in the element type.
    fn bytes(&self, values: &[f64]) -> Vec<u8> {
        if self.element == SINGLE {
            return values.iter().flat_map(|value| (*value as f32).to_le_bytes()).collect();
        }
        values.iter().flat_map(|value| value.to_le_bytes()).collect()
    }

    /// Adds a row of limits, rounded outwards in single precision.
    pub fn limit(&mut self, values: &[f64], outwards: fn(f32) -> f32) -> String {
        let rounded =
            |value: &f64| if self.element == SINGLE { f64::from(outwards(*value as f32)) } else { *value };
        let values: Vec<f64> = values.iter().map(rounded).collect();
        self.row(&values)
    }

    pub fn node_with(&mut self, operator: &str, inputs: &[&str], attribute: Vec<OnnxAttribute>) -> String {
        let name = format!("n{}", self.nodes.len());
        self.named(operator, inputs, &name);
        if let Some(node) = self.nodes.last_mut() {
            node.attribute = attribute;
        }
        name
    }

    pub fn node(&mut self, operator: &str, inputs: &[&str]) -> String {
        self.node_with(operator, inputs, Vec::new())
    }

    pub fn named(&mut self, operator: &str, inputs: &[&str], output: &str) {
        self.nodes.push(OnnxNode {
            input: inputs.iter().map(|&input| input.to_owned()).collect(),
            output: vec![output.to_owned()],
            op_type: operator.to_owned(),
            attribute: Vec::new(),
        });
    }

    fn constant(&mut self, dims: Vec<i64>, data_type: i32, raw_data: Vec<u8>) -> String {
        let name = format!("c{}", self.constants.len());
        self.constants.push(OnnxTensor { dims, data_type, name: name.clone(), raw_data });
        name
    }

    /// Adds a constant matrix, row by row.
    pub fn matrix(&mut self, values: &[f64], columns: usize) -> String {
        let bytes = self.bytes(values);
        self.constant(vec![(values.len() / columns) as i64, columns as i64], self.element, bytes)
    }

    pub fn row(&mut self, values: &[f64]) -> String {
        self.matrix(values, values.len())
    }

    pub fn scalar(&mut self, value: f64) -> String {
        let bytes = self.bytes(&[value]);
        self.constant(Vec::new(), self.element, bytes)
    }

    pub fn integers(&mut self, values: &[i64]) -> String {
        let bytes = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.constant(vec![values.len() as i64], INTEGER, bytes)
    }

    pub fn column(&mut self, x: &str, index: usize) -> String {
        let index = self.integers(&[index as i64]);
        self.node_with("Gather", &[x, &index], vec![integer("axis", 1)])
    }

    pub fn concatenated(&mut self, columns: &[String]) -> String {
        self.joined(columns, 1)
    }

    pub fn joined(&mut self, parts: &[String], axis: i64) -> String {
        self.node_with("Concat", &refs(parts), vec![integer("axis", axis)])
    }

    /// Transposes the rows and columns of (points, rows, columns).
    pub fn transposed(&mut self, x: &str) -> String {
        self.node_with("Transpose", &[x], vec![integers("perm", &[0, 2, 1])])
    }

    /// Computes Jᵀ diag(f) J for J (points, rows, columns) or (rows, columns), and f (points, rows).
    pub fn quadratic(&mut self, change: &str, factor: &str) -> String {
        let axis = self.integers(&[2]);
        let factor = self.node("Unsqueeze", &[factor, &axis]);
        // expand a J that is common to all points
        let zero = self.node("Sub", &[&factor, &factor]);
        let change = self.node("Add", &[change, &zero]);
        let weighted = self.node("Mul", &[&change, &factor]);
        let transposed = self.transposed(&change);
        self.node("MatMul", &[&transposed, &weighted])
    }

    /// Computes W J, times σ′ if it is not 1.
    pub fn chain_rule(&mut self, layer: &Layer<f64>, change: &str, slope: Option<&str>) -> String {
        let weights = self.matrix(&layer.weights, layer.weights.len() / layer.bias.len());
        let product = self.node("MatMul", &[&weights, change]);
        let Some(slope) = slope else { return product };
        let axis = self.integers(&[2]);
        let slope = self.node("Unsqueeze", &[slope, &axis]);
        self.node("Mul", &[&slope, &product])
    }

    /// Multiplies by a constant for each point of C, also if `x` is common to all points.
    pub fn scaled_per_point(&mut self, x: &str, factors: &str) -> String {
        let product = self.node("Mul", &[x, factors]);
        let zero = self.scalar(0.0);
        let none = self.node("Mul", &["C", &zero]);
        let axis = self.integers(&[2]);
        let none = self.node("Unsqueeze", &[&none, &axis]);
        self.node("Add", &[&product, &none])
    }

    pub fn sum_of_columns(&mut self, x: &str) -> String {
        let axis = self.integers(&[1]);
        self.node("ReduceSum", &[x, &axis])
    }

    /// Computes σ(W x + b), and σ′ and σ″ as far as requested, if they are not 1 and 0.
    pub fn layer(
        &mut self,
        layer: &Layer<f64>,
        x: &str,
        derivatives: u8,
    ) -> (String, Option<String>, Option<String>) {
        let (weights, bias) =
            (self.matrix(&layer.weights, layer.weights.len() / layer.bias.len()), self.row(&layer.bias));
        let z = self.node_with("Gemm", &[x, &weights, &bias], vec![integer("transB", 1)]);
        let unit = self.scalar(1.0);
        let value = match layer.activation {
            Activation::Linear => return (z, None, None),
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
        if derivatives == 0 {
            return (value, None, None);
        }
        let slope = match layer.activation {
            Activation::Linear => return (value, None, None),
            Activation::Relu => {
                let zero = self.scalar(0.0);
                let on = self.node("Greater", &[&z, &zero]);
                self.node_with("Cast", &[&on], vec![integer("to", self.element.into())])
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
        let bend = if derivatives > 1 { self.bend(layer.activation, &z, &value, &slope) } else { None };
        (value, Some(slope), bend)
    }

    /// Computes σ″ from z, σ and σ′; `None` if it is 0.
    fn bend(&mut self, activation: Activation, z: &str, value: &str, slope: &str) -> Option<String> {
        let (unit, two) = (self.scalar(1.0), self.scalar(2.0));
        Some(match activation {
            Activation::Linear | Activation::Relu => return None,
            // s (1 − s), s = σ′
            Activation::Softplus => {
                let rest = self.node("Sub", &[&unit, slope]);
                self.node("Mul", &[slope, &rest])
            }
            Activation::Tanh => {
                let product = self.node("Mul", &[value, slope]);
                let twice = self.node("Mul", &[&product, &two]);
                self.node("Neg", &[&twice])
            }
            Activation::Sigmoid => {
                let twice = self.node("Mul", &[value, &two]);
                let rest = self.node("Sub", &[&unit, &twice]);
                self.node("Mul", &[slope, &rest])
            }
            // s (1 − s) (2 + z (1 − 2 s))
            Activation::Silu => {
                let s = self.node("Sigmoid", &[z]);
                let rest = self.node("Sub", &[&unit, &s]);
                let fall = self.node("Mul", &[&s, &rest]);
                let left = self.node("Sub", &[&rest, &s]);
                let part = self.node("Mul", &[z, &left]);
                let sum = self.node("Add", &[&part, &two]);
                self.node("Mul", &[&fall, &sum])
            }
            // e^z for z < 0
            Activation::Elu => {
                let zero = self.scalar(0.0);
                let below = self.node("Less", &[z, &zero]);
                let below = self.node_with("Cast", &[&below], vec![integer("to", self.element.into())]);
                self.node("Mul", &[slope, &below])
            }
        })
    }

    /// Computes e^min(z, 0).
    fn exp_of_negative_part(&mut self, z: &str) -> String {
        let turned = self.node("Neg", &[z]);
        let below = self.node("Relu", &[&turned]);
        let back = self.node("Neg", &[&below]);
        self.node("Exp", &[&back])
    }
}

/// Creates an integer attribute.
pub(super) fn integer(name: &str, value: i64) -> OnnxAttribute {
    OnnxAttribute { name: name.into(), i: value, ints: Vec::new(), r#type: 2 }
}

/// Creates a list attribute.
pub(super) fn integers(name: &str, values: &[i64]) -> OnnxAttribute {
    OnnxAttribute { name: name.into(), i: 0, ints: values.to_vec(), r#type: 7 }
}

/// Returns the names as string slices.
pub(super) fn refs(list: &[String]) -> Vec<&str> {
    list.iter().map(String::as_str).collect()
}

//! Evaluation of a network: forward with slopes, backward for gradients.

use super::packed::{MOST_COLUMNS, padded};
use super::real::Real;
use super::{Activation, Layer, Network};
use pulp::{Arch, Simd, WithSimd};

/// Number of values whose zeros are marked in one word of bits.
const GROUP: usize = 64;

/// Number of points of a batch.
pub(in crate::constitutive) const BATCH: usize = 8;

/// Memory for evaluations, reused between them: nothing is allocated while the widths stay the same.
#[derive(Debug, Clone, Default)]
pub struct Tape<T> {
    widths: Vec<usize>,
    /// Inputs, one column a point.
    input: Vec<T>,
    layers: Vec<LayerRecord<T>>,
    /// 0, 1, 2, …
    all: Vec<u32>,
    active: Vec<u32>,
    /// Columns of g = ∂out/∂y and of g σ′ of the layer at hand.
    adjoint: Vec<T>,
    delta: Vec<T>,
}

/// Results of a layer: columns, each padded to whole panels.
#[derive(Debug, Clone, Default)]
struct LayerRecord<T> {
    outputs: usize,
    stride: usize,
    sums: Vec<T>,
    values: Vec<T>,
    first: Vec<T>,
    second: Vec<T>,
}

/// Derivatives that a pass computes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PassOutput {
    /// Outputs at 1 or more points; with gradients of the first output, or without.
    Points { count: usize, gradients: bool },
    /// Outputs and their slopes at one point.
    Slopes,
    /// Outputs, slopes, gradient and second derivatives of the first output at one point.
    Curvature,
}

impl<T: Real> Tape<T> {
    pub(super) fn fit(&mut self, network: &Network<T>) {
        let widths = &network.architecture.widths;
        if self.widths == *widths {
            return;
        }
        self.widths.clone_from(widths);
        let list = |stride: usize| vec![T::ZERO; MOST_COLUMNS * stride];
        let record = |&outputs: &usize| {
            let stride = padded::<T>(outputs);
            let [sums, values, first, second] = [stride; 4].map(list);
            LayerRecord { outputs, stride, sums, values, first, second }
        };
        self.layers = widths[1..].iter().map(record).collect();
        self.input = list(widths[0]);
        let widest = widths.iter().map(|&width| padded::<T>(width)).max().unwrap_or(0);
        self.all = (0..widest as u32).collect();
        self.active = vec![0; widest];
        (self.adjoint, self.delta) = (list(widest), list(widest));
    }

    /// Sets one column of inputs; surplus inputs are not read, missing ones count as 0.
    pub(super) fn set_input(&mut self, column: usize, input: &[T]) {
        let width = self.widths[0];
        let column = &mut self.input[column * width..(column + 1) * width];
        for (j, value) in column.iter_mut().enumerate() {
            *value = input.get(j).copied().unwrap_or(T::ZERO);
        }
    }

    /// Outputs (c = 0), or their derivatives with respect to input c − 1; in a batch, the outputs at point c.
    pub(super) fn output(&self, c: usize) -> &[T] {
        self.layers.last().map_or(&[], |last| &last.values[c * last.stride..c * last.stride + last.outputs])
    }

    /// The gradient of the first output at a point.
    pub(super) fn gradient(&self, point: usize) -> &[T] {
        let stride = padded::<T>(self.widths[0]);
        &self.adjoint[point * stride..point * stride + self.widths[0]]
    }
}

/// Runs a pass with the widest instructions of this machine; returns the second derivatives, or zero if not
/// requested.
pub(super) fn run<T: Real>(network: &Network<T>, want: PassOutput, tape: &mut Tape<T>) -> Curvature<T> {
    Arch::new().dispatch(NetworkPass { network, want, tape })
}

/// Second derivatives with respect to up to eight inputs.
pub(super) type Curvature<T> = [[T; MOST_COLUMNS - 1]; MOST_COLUMNS - 1];

struct NetworkPass<'a, T> {
    network: &'a Network<T>,
    want: PassOutput,
    tape: &'a mut Tape<T>,
}

impl<T: Real> WithSimd for NetworkPass<'_, T> {
    type Output = Curvature<T>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Curvature<T> {
        let Self { network, want, tape } = self;
        // one lane: no vector unit that pulp knows of, and maybe no fused product
        if S::F64_LANES > 1 {
            forward::<T, S, true>(simd, network, want, tape);
        } else {
            forward::<T, S, false>(simd, network, want, tape);
        }
        let mut curvature = Curvature::<T>::default();
        if matches!(want, PassOutput::Curvature | PassOutput::Points { gradients: true, .. }) {
            backward(simd, network, want, tape, &mut curvature);
        }
        curvature
    }
}

#[inline(always)]
fn forward<T: Real, S: Simd, const FUSED: bool>(
    simd: S,
    network: &Network<T>,
    want: PassOutput,
    tape: &mut Tape<T>,
) {
    let inputs = tape.widths[0];
    let (columns, points) = match want {
        PassOutput::Points { count, .. } => (count, count),
        PassOutput::Slopes | PassOutput::Curvature => (1 + inputs, 1),
    };
    for (index, (layer, packed)) in network.layers.iter().zip(&network.packed).enumerate() {
        let (before, after) = tape.layers.split_at_mut(index);
        let (x, stride, width, sparse) = match before.last() {
            Some(record) => {
                let relu = network.layers[index - 1].activation == Activation::Relu;
                (&record.values[..], record.stride, record.outputs, relu && points == 1)
            }
            None => (&tape.input[..], inputs, inputs, false),
        };
        // the slopes of a `relu` are 0 where its value is
        let active = find_active(&x[..width], sparse, &tape.all, &mut tape.active);
        let record = &mut after[0];
        if index == 0 {
            packed.product(simd, active, (x, stride), (points, points), &mut record.sums);
            // slopes by the inputs themselves
            for c in points..columns {
                let out = &mut record.sums[c * record.stride..(c + 1) * record.stride];
                packed.column::<S>(c - points, out);
            }
        } else {
            packed.product(simd, active, (x, stride), (columns, points), &mut record.sums);
        }
        activate::<T, FUSED>(layer, want, points, columns, record);
    }
}

/// Inputs of a product that are not 0: after a `relu` at one point the active ones, else all.
#[inline(always)]
fn find_active<'a, T: Real>(values: &[T], sparse: bool, all: &'a [u32], active: &'a mut [u32]) -> &'a [u32] {
    let width = values.len();
    if !sparse {
        return &all[..width];
    }
    let mut count = 0;
    for (start, part) in (0..).step_by(GROUP).zip(values.chunks(GROUP)) {
        let mut bits = 0_u64;
        for (lane, value) in part.iter().enumerate() {
            // NaN is not 0
            bits |= u64::from(*value != T::ZERO) << lane;
        }
        while bits != 0 {
            active[count] = start + bits.trailing_zeros();
            count += 1;
            bits &= bits - 1;
        }
    }
    &active[..count]
}

#[inline(always)]
fn activate<T: Real, const FUSED: bool>(
    layer: &Layer<T>,
    want: PassOutput,
    points: usize,
    columns: usize,
    record: &mut LayerRecord<T>,
) {
    let stride = record.stride;
    let all = points * stride;
    let (first, second) = match want {
        PassOutput::Points { gradients: false, .. } => (0, 0),
        PassOutput::Points { gradients: true, .. } | PassOutput::Slopes => (all, 0),
        PassOutput::Curvature => (all, all),
    };
    layer.activation.fill::<T, FUSED>(
        &record.sums[..all],
        &mut record.values[..all],
        &mut record.first[..first],
        &mut record.second[..second],
    );
    for c in points..columns {
        let first = &record.first[..stride];
        let sums = &record.sums[c * stride..(c + 1) * stride];
        let slopes = &mut record.values[c * stride..(c + 1) * stride];
        for k in 0..stride {
            slopes[k] = first[k] * sums[k];
        }
    }
}

/// Computes the gradient by reverse mode, from the sums a of each layer and the adjoints g = ∂out/∂y of its
/// activations y = σ(a), and H = Σ g σ″(a) (∂a/∂x)(∂a/∂x)ᵀ over all neurons.
#[inline(always)]
fn backward<T: Real, S: Simd>(
    simd: S,
    network: &Network<T>,
    want: PassOutput,
    tape: &mut Tape<T>,
    curvature: &mut Curvature<T>,
) {
    let points = if let PassOutput::Points { count, .. } = want { count } else { 1 };
    let inputs = tape.widths[0];
    let last = tape.layers.last().map_or(0, |record| record.stride);
    for point in 0..points {
        tape.adjoint[point * last..(point + 1) * last].fill(T::ZERO);
        tape.adjoint[point * last] = T::ONE;
    }
    let layers = network.layers.iter().zip(&network.transposed);
    for (record, (layer, transposed)) in tape.layers.iter_mut().zip(layers).rev() {
        let stride = record.stride;
        let all = points * stride;
        let (adjoint, first) = (&tape.adjoint[..all], &record.first[..all]);
        let delta = &mut tape.delta[..all];
        for k in 0..all {
            delta[k] = adjoint[k] * first[k];
        }
        let sparse = layer.activation == Activation::Relu && points == 1;
        let active = find_active(&delta[..record.outputs], sparse, &tape.all, &mut tape.active);
        if want == PassOutput::Curvature {
            add_curvature::<T, S>(simd, record, adjoint, inputs, curvature);
        }
        let x = (&tape.delta[..], stride);
        transposed.product(simd, active, x, (points, 0), &mut tape.adjoint);
    }
}

/// Adds g σ″ (∂a/∂x)(∂a/∂x)ᵀ of one layer.
#[inline(always)]
fn add_curvature<T: Real, S: Simd>(
    simd: S,
    record: &mut LayerRecord<T>,
    adjoint: &[T],
    inputs: usize,
    curvature: &mut Curvature<T>,
) {
    let (stride, outputs) = (record.stride, record.outputs);
    let mut bent = false;
    // the padding's adjoint is 0
    for k in 0..stride {
        record.second[k] = record.second[k] * adjoint[k];
        bent |= record.second[k] != T::ZERO;
    }
    debug_assert!(record.second[outputs..stride].iter().all(|value| *value == T::ZERO));
    if !bent {
        return;
    }
    let sums = T::vectors::<S>(&record.sums);
    let weights = &T::vectors::<S>(&record.second)[..stride / lanes::<T, S>()];
    let count = weights.len();
    let zero = T::splat(simd, T::ZERO);
    for i in 0..inputs {
        let own = &sums[(i + 1) * count..(i + 2) * count];
        for j in 0..=i {
            let other = &sums[(j + 1) * count..(j + 2) * count];
            let mut total = zero;
            for k in 0..count {
                let weighted = T::mul_add(simd, weights[k], own[k], zero);
                total = T::mul_add(simd, weighted, other[k], total);
            }
            let total = T::sum(simd, total);
            curvature[i][j] += total;
            if i != j {
                curvature[j][i] += total;
            }
        }
    }
}

#[inline(always)]
fn lanes<T: Real, S: Simd>() -> usize {
    size_of::<T::Vector<S>>() / size_of::<T>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::network::Architecture;

    /// Machines without vectors, or with narrower ones, give the same numbers up to rounding.
    #[test]
    fn every_instruction_set_agrees() {
        let hidden = [(40, Activation::Relu), (33, Activation::Softplus), (20, Activation::Tanh)];
        let network = Network::<f64>::random(Architecture::new(7, &hidden, 1), 2).unwrap();
        for want in [
            PassOutput::Points { count: 1, gradients: false },
            PassOutput::Points { count: BATCH, gradients: true },
            PassOutput::Slopes,
            PassOutput::Curvature,
        ] {
            let mut results = Vec::new();
            let points = if let PassOutput::Points { count, .. } = want { count } else { 1 };
            for set in 0..3 {
                let mut tape = Tape::default();
                tape.fit(&network);
                for point in 0..points {
                    tape.set_input(point, &[0.3, -0.2, 0.5, 0.1, -0.7, 0.9, 0.1 * point as f64]);
                }
                let pass = NetworkPass { network: &network, want, tape: &mut tape };
                let curvature = match set {
                    0 => Arch::new().dispatch(pass),
                    1 => pass.with_simd(pulp::Scalar::new()),
                    #[cfg(target_arch = "x86_64")]
                    _ => match pulp::x86::V3::try_new() {
                        Some(simd) => Simd::vectorize(simd, pass),
                        None => continue,
                    },
                    #[cfg(not(target_arch = "x86_64"))]
                    _ => continue,
                };
                let mut all = curvature.as_flattened().to_vec();
                for point in 0..points {
                    all.extend_from_slice(tape.output(point));
                    if matches!(want, PassOutput::Curvature | PassOutput::Points { gradients: true, .. }) {
                        all.extend_from_slice(tape.gradient(point));
                    }
                }
                results.push(all);
            }
            for other in &results[1..] {
                for (a, b) in results[0].iter().zip(other) {
                    assert!((a - b).abs() < 1e-14, "{want:?}: {a} {b}");
                }
            }
        }
    }
}

//! Determinant, adjugate and principal decomposition of a 3×3 matrix, each accurate where the textbook form
//! cancels.

use super::Tensor;

/// Principal stretches λ₁ ≥ λ₂ ≥ λ₃ > 0 of F = Σ λᵢ nᵢ ⊗ Nᵢ with their directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrincipalFrame {
    /// λ₁ ≥ λ₂ ≥ λ₃.
    pub stretches: [f64; 3],
    /// Columns Nᵢ: eigenvectors of C = FᵀF.
    pub referential: Tensor,
    /// Columns nᵢ: eigenvectors of B = FFᵀ.
    pub spatial: Tensor,
}

impl PrincipalFrame {
    /// Σ vᵢ Nᵢ ⊗ Nᵢ.
    pub fn referential_tensor(&self, values: [f64; 3]) -> Tensor {
        assemble(&self.referential, values)
    }

    /// Σ vᵢ nᵢ ⊗ nᵢ.
    pub fn spatial_tensor(&self, values: [f64; 3]) -> Tensor {
        assemble(&self.spatial, values)
    }

    /// Σ vᵢ nᵢ ⊗ Nᵢ.
    pub fn two_point_tensor(&self, values: [f64; 3]) -> Tensor {
        self.spatial * Tensor::from_diagonal(&values.into()) * self.referential.transpose()
    }
}

/// det A, its six triple products formed and summed in doubled precision (error ≲ 2⁻¹⁰⁰ Σ|products|).
pub(super) fn determinant(a: &Tensor) -> f64 {
    let mut sum = (0.0, 0.0);
    for (columns, sign) in [
        ([0, 1, 2], 1.0),
        ([1, 2, 0], 1.0),
        ([2, 0, 1], 1.0),
        ([0, 2, 1], -1.0),
        ([1, 0, 2], -1.0),
        ([2, 1, 0], -1.0),
    ] {
        let (x, y, z) = (sign * a[(0, columns[0])], a[(1, columns[1])], a[(2, columns[2])]);
        let (p, e) = two_product(x, y);
        let (q, f) = two_product(p, z);
        sum = add_doubled(sum, (q, e.mul_add(z, f)));
    }
    sum.0 + sum.1
}

/// adj A = (cof A)ᵀ, each entry within 2 ulp.
pub(super) fn adjugate(a: &Tensor) -> Tensor {
    Tensor::from_fn(|i, j| {
        // entry ij is the cofactor ji
        let (r, s) = ((j + 1) % 3, (j + 2) % 3);
        let (c, d) = ((i + 1) % 3, (i + 2) % 3);
        difference_of_products(a[(r, c)], a[(s, d)], a[(r, d)], a[(s, c)])
    })
}

/// Pivoted QR decomposition of a matrix whose rows are sorted by decreasing size; `rows` and `columns` are
/// their places in the matrix.
struct SortedFactors {
    rows: [usize; 3],
    columns: [usize; 3],
    q: Tensor,
    r: Tensor,
}

impl SortedFactors {
    fn new(f: &Tensor) -> Self {
        let mut rows = [0, 1, 2];
        rows.sort_by(|&i, &j| f.row(j).amax().total_cmp(&f.row(i).amax()));
        let qr = Tensor::from_fn(|i, j| f[(rows[i], j)]).col_piv_qr();
        let mut columns = nalgebra::Vector3::new(0, 1, 2);
        qr.p().permute_rows(&mut columns);
        Self { rows, columns: columns.into(), q: qr.q(), r: qr.r() }
    }

    /// Factors of a matrix that keeps the plane and its normal.
    fn plane(f: &Tensor) -> Self {
        let row = |i: usize| f[(i, 0)].abs().max(f[(i, 1)].abs());
        let column = |j: usize| f[(0, j)].hypot(f[(1, j)]);
        let sorted = |swap: bool| if swap { [1, 0, 2] } else { [0, 1, 2] };
        let (rows, columns) = (sorted(row(1) > row(0)), sorted(column(1) > column(0)));
        let m = |i: usize, j: usize| f[(rows[i], columns[j])];
        let first = m(0, 0).hypot(m(1, 0));
        let [cosine, sine] = [m(0, 0) / first, m(1, 0) / first];
        let off = cosine * m(0, 1) + sine * m(1, 1);
        let last = difference_of_products(m(0, 0), m(1, 1), m(1, 0), m(0, 1)) / first;
        Self {
            rows,
            columns,
            q: Tensor::new(cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0),
            r: Tensor::new(first, off, 0.0, 0.0, last, 0.0, 0.0, 0.0, f[(2, 2)]),
        }
    }
}

/// F = Σ λᵢ nᵢ ⊗ Nᵢ by one-sided Jacobi rotations of the triangular factor of a pivoted QR decomposition
/// (Drmač & Veselić, doi:10.1137/050639193): errors scale with the condition of F after scaling of its rows
/// and columns, so strongly graded F (diag(1e8, 1, 1e-8)) keep every digit.
pub(super) fn principal_frame(f: &Tensor) -> PrincipalFrame {
    let is_plane = [f[(0, 2)], f[(1, 2)], f[(2, 0)], f[(2, 1)]] == [0.0; 4];
    // F = Q R Πᵀ with sorted rows, and Rᵀ W = V Σ, hence F = (Q W) Σ (Π V)ᵀ
    let SortedFactors { rows, columns: places, q, r } =
        if is_plane { SortedFactors::plane(f) } else { SortedFactors::new(f) };
    let mut columns = r.transpose();
    let mut rotation = Tensor::identity();
    let pairs: &[(usize, usize)] = if is_plane { &[(0, 1)] } else { &[(0, 1), (0, 2), (1, 2)] };
    for _ in 0..MAX_SWEEPS {
        let mut turned = false;
        for &(i, j) in pairs {
            turned |= orthogonalise(&mut columns, &mut rotation, i, j);
        }
        if !turned {
            break;
        }
    }
    let norms = [0, 1, 2].map(|i| columns.column(i).norm());
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| norms[j].total_cmp(&norms[i]));

    let left_sorted = q * Tensor::from_fn(|i, j| rotation[(i, order[j])]);
    let [mut left, mut right] = [Tensor::zeros(); 2];
    for i in 0..3 {
        left.set_row(rows[i], &left_sorted.row(i));
        for j in 0..3 {
            right[(places[i], j)] = columns[(i, order[j])] / norms[order[j]];
        }
    }
    PrincipalFrame { stretches: order.map(|i| norms[i]), referential: right, spatial: left }
}

/// Three columns need about five sweeps; convergence is quadratic.
const MAX_SWEEPS: usize = 30;

/// Applies one Jacobi rotation of columns i and j; returns false if they were orthogonal to working
/// precision.
fn orthogonalise(columns: &mut Tensor, rotation: &mut Tensor, i: usize, j: usize) -> bool {
    let (x, y) = (columns.column(i).into_owned(), columns.column(j).into_owned());
    let (a, b, c) = (x.norm(), y.norm(), x.dot(&y));
    if c.abs() <= f64::EPSILON * a * b {
        return false;
    }
    // (b² − a²)/2c, written so that neither the squares overflow nor their difference cancels
    let zeta = (b - a) * ((b + a) / (2.0 * c));
    let tangent = zeta.signum() / (zeta.abs() + zeta.hypot(1.0));
    let cosine = 1.0 / tangent.hypot(1.0);
    let sine = tangent * cosine;
    for matrix in [columns, rotation] {
        for row in 0..3 {
            let (p, q) = (matrix[(row, i)], matrix[(row, j)]);
            matrix[(row, i)] = cosine * p - sine * q;
            matrix[(row, j)] = sine * p + cosine * q;
        }
    }
    true
}

fn assemble(directions: &Tensor, values: [f64; 3]) -> Tensor {
    // component by component, so that the result is symmetric to the last bit
    Tensor::from_fn(|i, j| (0..3).map(|k| values[k] * (directions[(i, k)] * directions[(j, k)])).sum::<f64>())
}

fn two_product(x: f64, y: f64) -> (f64, f64) {
    let p = x * y;
    (p, x.mul_add(y, -p))
}

fn add_doubled(x: (f64, f64), y: (f64, f64)) -> (f64, f64) {
    let s = x.0 + y.0;
    let v = s - x.0;
    let e = (x.0 - (s - v)) + (y.0 - v) + x.1 + y.1;
    let high = s + e;
    (high, e - (high - s))
}

/// ab − cd within 1.5 ulp (Kahan's algorithm; Jeannerod, Louvet & Muller,
/// doi:10.1090/S0025-5718-2013-02679-8).
fn difference_of_products(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let p = c * d;
    let error = (-c).mul_add(d, p);
    a.mul_add(b, -p) + error
}

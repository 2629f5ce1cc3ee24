//! Inputs of an energy's networks as functions of C, with their derivatives.

use super::Symmetry;
use super::symmetry::Monomial;
use crate::constitutive::network::Real;

/// The invariants of a symmetry, plain or polyconvex.
#[derive(Debug, Clone, Copy)]
pub struct SymmetryInvariants {
    list: &'static [&'static [Monomial<'static>]],
    names: &'static [&'static str],
    /// Index of the first invariant that is the root of its polynomial: J = √det C is the last of the
    /// polyconvex ones.
    first_root: usize,
}

impl SymmetryInvariants {
    /// Creates the invariants of a symmetry, or its polyconvex ones (empty if it has none). With `norms` the
    /// roots of I₁ and I₂ replace them in a polyconvex isotropic energy.
    pub fn new(symmetry: Symmetry, polyconvex: bool, norms: bool) -> Self {
        let (list, names) = match polyconvex {
            true => (symmetry.polyconvex_invariants().unwrap_or_default(), symmetry.names(true)),
            false => (symmetry.invariants(), symmetry.names(false)),
        };
        match (polyconvex, norms) {
            (true, true) => Self { list, names: &["√I1", "√I2", "J"], first_root: 0 },
            (true, false) => Self { list, names, first_root: list.len().saturating_sub(1) },
            (false, _) => Self { list, names, first_root: list.len() },
        }
    }

    /// Number of invariants.
    pub fn count(self) -> usize {
        self.list.len()
    }

    /// Name of invariant k.
    pub fn name(self, k: usize) -> &'static str {
        self.names[k]
    }

    /// Polynomial k, and whether its root is the input.
    pub fn polynomial(self, k: usize) -> (&'static [Monomial<'static>], bool) {
        (self.list[k], k >= self.first_root)
    }

    /// Values of the invariants at c.
    pub fn values<T: Real>(self, c: &[T; 6], out: &mut [T]) {
        for (k, value) in out.iter_mut().enumerate().take(self.count()) {
            let (terms, root) = self.polynomial(k);
            *value = sum(terms, c);
            if root {
                *value = value.root();
            }
        }
    }

    /// ∂x_k/∂c_a, c₁₂ counted once.
    pub fn gradient<T: Real>(self, c: &[T; 6], k: usize) -> [T; 6] {
        let (terms, root) = self.polynomial(k);
        let mut gradient = [T::ZERO; 6];
        for (coefficient, factors) in terms {
            for (place, &a) in factors.iter().enumerate() {
                gradient[a] += T::from_f64(*coefficient) * product(factors, c, place, usize::MAX);
            }
        }
        if root {
            // (√p)′ = p′/(2√p)
            let half = T::from_f64(0.5) / sum(terms, c).root();
            gradient = gradient.map(|slope| slope * half);
        }
        gradient
    }

    /// Adds weight · ∂²x_k/∂c_a∂c_b.
    pub fn add_curvature<T: Real>(self, c: &[T; 6], k: usize, weight: T, to: &mut [[T; 6]; 6]) {
        let (terms, root) = self.polynomial(k);
        let mut weight = weight;
        if root {
            // (√p)″ = p″/(2√p) − (√p)′(√p)′ᵀ/√p
            let inverse = T::ONE / sum(terms, c).root();
            let gradient = self.gradient(c, k);
            for a in 0..6 {
                for b in 0..6 {
                    to[a][b] += -(weight * inverse * gradient[a] * gradient[b]);
                }
            }
            weight = weight * T::from_f64(0.5) * inverse;
        }
        for (coefficient, factors) in terms {
            for (first, &a) in factors.iter().enumerate() {
                for (second, &b) in factors.iter().enumerate() {
                    if first != second {
                        to[a][b] += weight * T::from_f64(*coefficient) * product(factors, c, first, second);
                    }
                }
            }
        }
    }
}

fn sum<T: Real>(monomials: &[Monomial<'_>], c: &[T; 6]) -> T {
    let mut sum = T::ZERO;
    for (coefficient, factors) in monomials {
        sum += T::from_f64(*coefficient) * product(factors, c, usize::MAX, usize::MAX);
    }
    sum
}

/// Product of a monomial's components without those at two places.
fn product<T: Real>(factors: &[usize], c: &[T; 6], without: usize, and: usize) -> T {
    let mut product = T::ONE;
    for (place, &a) in factors.iter().enumerate() {
        if place != without && place != and {
            product = product * c[a];
        }
    }
    product
}

/// Monomials of the derivative of a polynomial with respect to the components `by`.
pub fn derivative(monomials: &[Monomial<'_>], by: &[usize]) -> Vec<(f64, Vec<usize>)> {
    let Some((&a, rest)) = by.split_first() else {
        return monomials.iter().map(|(coefficient, factors)| (*coefficient, factors.to_vec())).collect();
    };
    let mut all = Vec::new();
    for (coefficient, factors) in monomials {
        for place in (0..factors.len()).filter(|&place| factors[place] == a) {
            let mut left = factors.to_vec();
            left.remove(place);
            all.extend(derivative(&[(*coefficient, &left)], rest));
        }
    }
    all
}

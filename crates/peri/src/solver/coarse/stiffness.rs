//! Stiffness of the body in the space of the coarse functions, with its particles as quadrature points of Σ_I
//! V_I ∇φ_a : C_I : ∇φ_b, C_I = Σ_J kθ w V_J/|ξ| T ⊗ ξ ⊗ ξ, with T = t′ m⊗m + (t/λ)(1 − m⊗m) the tangent of a
//! bond of direction m: the Hessian of the bonds' energy for functions linear within a horizon.

use super::space::{CORNERS, CoarseElement, CoarseSpace};
use crate::bonds::{BodyGeometry, Bonds};
use crate::field::Field;
use crate::parallel;
use crate::potential::BondPotential;
use crate::solver::load::Loads;

/// Pairs i ≤ j in three dimensions, and pairs of corners a ≤ b.
const SYMMETRIC: usize = 6;
const PAIRS: usize = CORNERS * (CORNERS + 1) / 2;
/// Nodes of the table of tangents.
const NODES: usize = 1024;
/// Least tangent of a bond, over that at rest: a matrix of soft bonds must stay positive definite.
const LEAST: f64 = 0.05;
/// Stiffness of the empty part of a cell over that of its particles (the finite cell method of Parvizian,
/// Düster & Rank 2007, doi:10.1007/s00466-007-0173-y): a few particles in a cell do not hold all its
/// functions.
const FICTITIOUS: f64 = 0.1;
/// Particles of an element from which the C of all complete families is computed.
const SAMPLES: usize = 4;
/// Relative rotation and stretch below which bonds count as undeformed.
const SMALL: f64 = 0.1;

/// C_I/kθ: pairs of components (i, j) by pairs of derivatives (k, l), off-diagonal pairs once.
type Tangent = [[f64; SYMMETRIC]; SYMMETRIC];

/// Σ V ∂φ_a ∂φ_b for each pair of corners a ≤ b, mixed pairs of derivatives both ways.
type GradientProducts = [[f64; SYMMETRIC]; PAIRS];

/// Element stiffness: for each pair of corners a ≤ b, the matrix of components (i of a, j of b) at iD + j.
pub type ElementMatrix = [[f64; 9]; PAIRS];

/// Counts of all bonds before anything is built.
pub struct BondCounts {
    /// Number of bonds of each site.
    pub bonded: Vec<u32>,
    /// The most bonds of any particle.
    pub most: u32,
    /// Largest |η|/|ξ| of a lattice's bonds of one spacing: the rotation or stretch of bonds.
    pub moved: f64,
}

impl BondCounts {
    /// Counts the bonds of every particle, and measures those of a lattice to the nearest particles.
    pub fn new<const D: usize>(bonds: &dyn Bonds<D>, displacement: &Field<D>) -> Self {
        let lattice = bonds.as_lattice();
        let is_unit = |offset: &[i32; D]| offset.iter().map(|o| o.abs()).sum::<i32>() == 1;
        let nearest: Vec<(usize, isize)> = lattice.map_or(Vec::new(), |lattice| {
            let units = lattice.stencil().offsets.iter().enumerate().filter(|(_, offset)| is_unit(offset));
            units.map(|(k, &offset)| (k, lattice.shift(offset))).collect()
        });
        let of = |&site: &u32| {
            let (site, mut most) = (site as usize, 0.0_f64);
            let own = displacement.get(site);
            let intact = |k: usize| lattice.is_some_and(|lattice| lattice.is_intact(site, k));
            for (_, shift) in nearest.iter().filter(|(k, _)| intact(*k)) {
                let other = displacement.get(site.wrapping_add_signed(*shift));
                most = most.max((0..D).map(|d| (other[d] - own[d]).powi(2)).sum());
            }
            (bonds.bonded(site), most)
        };
        let each: Vec<(u32, f64)> = parallel::map_each(bonds.particles(), of);
        let mut bonded = vec![0; bonds.sites()];
        let (mut most, mut moved) = (0, 0.0_f64);
        for (&site, (count, square)) in bonds.particles().iter().zip(each) {
            bonded[site as usize] = count;
            most = most.max(count);
            moved = moved.max(square);
        }
        Self { bonded, most, moved: moved.sqrt() / bonds.spacing() }
    }
}

/// t′ and t/λ over e = λ² − 1, both kept positive.
struct Tangents {
    low: f64,
    step: f64,
    nodes: Vec<[f64; 2]>,
}

impl Tangents {
    fn new(law: &dyn BondPotential, stretches: [f64; 2]) -> Self {
        let [low, high] = stretches.map(|l| l * l - 1.0);
        let step = (high - low).max(1e-9) / (NODES - 1) as f64;
        let least = LEAST * law.tangent().abs();
        let node = |k: usize| {
            let stretch = (1.0 + low + step * k as f64).max(1e-12).sqrt();
            [law.tension_derivative(stretch).max(least), (law.tension(stretch) / stretch).max(0.0)]
        };
        Self { low, step, nodes: (0..NODES).map(node).collect() }
    }

    fn value_at(&self, e: f64) -> [f64; 2] {
        self.nodes[(((e - self.low) / self.step).max(0.0).round() as usize).min(NODES - 1)]
    }
}

/// Data of the element matrices.
pub struct Assembly<'a, const D: usize> {
    bonds: &'a dyn BodyGeometry<D>,
    loads: &'a Loads<D>,
    displacement: &'a Field<D>,
    survey: &'a BondCounts,
    tangents: Tangents,
    modulus: f64,
    /// Stiffness density M_I at constrained components, N/m⁵.
    springs: &'a [f64],
    /// True if the body is a lattice.
    lattice: bool,
    /// C of particles with complete families, if bonds are undeformed.
    interior: Option<Tangent>,
    /// Volume of a cell (2D: times the thickness), m³, and Σ V ∂φ_a ∂φ_b over all of it.
    cell: f64,
    full: GradientProducts,
    /// λ of the volume in excess of that of bonds, Pa.
    volumetric: f64,
}

impl<'a, const D: usize> Assembly<'a, D> {
    /// Prepares the assembly; `law` comes with kθ and the excess λ of the volume, and the fitted stretches.
    pub fn new(
        bonds: &'a dyn BodyGeometry<D>,
        loads: &'a Loads<D>,
        displacement: &'a Field<D>,
        survey: &'a BondCounts,
        law: (&dyn BondPotential, [f64; 2], [f64; 2]),
        springs: &'a [f64],
        edge: [f64; D],
    ) -> Self {
        let (law, [modulus, volumetric], stretches) = law;
        let tangents = Tangents::new(law, stretches);
        let volumes: f64 = bonds.particles().iter().map(|&site| bonds.volume(site as usize)).sum();
        let thickness = volumes / bonds.particles().len().max(1) as f64 / bonds.spacing().powi(D as i32);
        let cell = thickness * edge.iter().product::<f64>();
        // Gauss' two points along each axis are exact
        let mut full: GradientProducts = [[0.0; SYMMETRIC]; PAIRS];
        for point in 0..1 << D {
            let local = std::array::from_fn(|d| 0.5 + [-0.5, 0.5][point >> d & 1] / 3.0_f64.sqrt());
            let (_, slopes) = hats::<D>(local, edge);
            add_products(&mut full, cell / f64::from(1 << D), &slopes);
        }
        let interior = None;
        let mut assembly = Self {
            bonds,
            loads,
            displacement,
            survey,
            tangents,
            modulus,
            springs,
            lattice: bonds.whole_family().is_some(),
            interior,
            cell,
            full,
            volumetric,
        };
        if assembly.lattice && survey.moved < SMALL {
            let whole = |&&site: &&u32| survey.bonded[site as usize] == survey.most;
            let site = bonds.particles().iter().find(whole);
            assembly.interior = site.map(|&site| assembly.tangent(site as usize));
        }
        assembly
    }

    /// Computes C_I.
    fn tangent(&self, site: usize) -> Tangent {
        let own = self.displacement.get(site);
        let mut result = [[0.0; SYMMETRIC]; SYMMETRIC];
        self.bonds.neighbours(site, &mut |bond| {
            let other = self.displacement.get(bond.site);
            let mut zeta = [0.0; D];
            let (mut square, mut e) = (0.0, 0.0);
            for d in 0..D {
                let eta = other[d] - own[d];
                zeta[d] = bond.bond[d] + eta;
                square += zeta[d] * zeta[d];
                e += eta * (2.0 * bond.bond[d] + eta);
            }
            let [along, across] = self.tangents.value_at(e / (bond.length * bond.length));
            let factor = self.modulus * bond.weight / bond.length;
            let difference = (along - across) / square.max(f64::MIN_POSITIVE);
            let mut pair = 0;
            for i in 0..D {
                for j in i..D {
                    let own = if i == j { across } else { 0.0 };
                    let t = factor * (own + difference * zeta[i] * zeta[j]);
                    let mut other = 0;
                    for k in 0..D {
                        for l in k..D {
                            result[pair][other] += t * bond.bond[k] * bond.bond[l];
                            other += 1;
                        }
                    }
                    pair += 1;
                }
            }
        });
        result
    }

    /// Returns true if the particle in a site has every bond of its lattice: its C equals that of others
    /// beside it.
    fn is_full(&self, site: usize) -> bool {
        self.lattice && self.survey.bonded[site] == self.survey.most
    }

    /// C for the particles of an element with complete families: that at rest, or the mean of a few.
    fn shared(&self, members: &[u32]) -> Option<Tangent> {
        if self.interior.is_some() {
            return self.interior;
        }
        let full: Vec<usize> = members.iter().map(|&s| s as usize).filter(|&s| self.is_full(s)).collect();
        let samples = full.len().min(SAMPLES);
        let mut mean = [[0.0; SYMMETRIC]; SYMMETRIC];
        for k in 0..samples {
            // in the middle of each part
            let site = full[(2 * k + 1) * full.len() / (2 * samples)];
            add_tangent(&mut mean, &self.tangent(site), 1.0 / samples as f64);
        }
        (samples > 0).then_some(mean)
    }

    /// Computes the stiffness of an element, and for each corner Σ V φ over its particles.
    pub fn element(
        &self,
        space: &CoarseSpace<D>,
        element: &CoarseElement,
    ) -> (ElementMatrix, [f64; CORNERS]) {
        let corners = 1 << D;
        let mut matrix = [[0.0; 9]; PAIRS];
        let mut measure = [0.0; CORNERS];
        let members = &space.members[element.members[0]..element.members[1]];
        let shared = self.shared(members);
        // Σ V ∂φ_a ∂φ_b of the particles that share a C, and Σ V C
        let mut products = [[0.0; SYMMETRIC]; PAIRS];
        let mut sum = [[0.0; SYMMETRIC]; SYMMETRIC];
        let (mut filled, mut common) = (0.0, 0.0);
        for &site in members {
            let site = site as usize;
            let volume = self.bonds.volume(site);
            let (values, slopes) = hats::<D>(space.local.get(site), space.edge);
            filled += volume;
            for a in 0..corners {
                measure[a] += volume * values[a];
            }
            if self.volumetric > 0.0 {
                add_volumetric(&mut matrix, self.volumetric * volume, &slopes);
            }
            if self.is_full(site) {
                add_products(&mut products, volume, &slopes);
                common += volume;
            } else {
                let tangent = self.tangent(site);
                let mut own = [[0.0; SYMMETRIC]; PAIRS];
                add_products(&mut own, volume, &slopes);
                contract::<D>(&mut matrix, &tangent, &own);
                add_tangent(&mut sum, &tangent, volume);
            }
            self.add_springs(&mut matrix, site, volume, &values);
        }
        if let Some(shared) = &shared {
            contract::<D>(&mut matrix, shared, &products);
            add_tangent(&mut sum, shared, common);
        }
        let empty = (1.0 - filled / self.cell).max(0.0);
        if empty > 0.0 && filled > 0.0 {
            let mean = sum.map(|row| row.map(|x| FICTITIOUS * empty * x / filled));
            contract::<D>(&mut matrix, &mean, &self.full);
        }
        (matrix, measure)
    }

    /// Adds the springs that hold constrained components.
    fn add_springs(&self, matrix: &mut ElementMatrix, site: usize, volume: f64, values: &[f64; CORNERS]) {
        let constrained = self.loads.constrained(site);
        if constrained == 0 {
            return;
        }
        let mut at = 0;
        for a in 0..1 << D {
            for b in a..1 << D {
                let spring = volume * self.springs[site] * values[a] * values[b];
                for i in (0..D).filter(|i| constrained >> i & 1 == 1) {
                    matrix[at][i * D + i] += spring;
                }
                at += 1;
            }
        }
    }

    /// Mean stiffness of the body, about Σ_I V_I C_1111 / Σ_I V_I.
    pub fn stiffness(&self) -> f64 {
        let particles = self.bonds.particles();
        let site = particles.iter().max_by_key(|&&s| (self.survey.bonded[s as usize], u32::MAX - s));
        site.map_or(0.0, |&site| {
            let tangent = self.tangent(site as usize);
            tangent[0][0]
        })
    }
}

/// matrix += C : products, corner pair by corner pair.
fn contract<const D: usize>(matrix: &mut ElementMatrix, tangent: &Tangent, products: &GradientProducts) {
    let pairs = D * (D + 1) / 2;
    let corners = 1 << D;
    for (result, products) in matrix.iter_mut().zip(products).take(corners * (corners + 1) / 2) {
        let mut pair = 0;
        for i in 0..D {
            for j in i..D {
                let mut sum = 0.0;
                for other in 0..pairs {
                    sum += tangent[pair][other] * products[other];
                }
                result[i * D + j] += sum;
                if i != j {
                    result[j * D + i] += sum;
                }
                pair += 1;
            }
        }
    }
}

/// matrix += λV ∂_iφ_a ∂_jφ_b, fully integrated: a coarse level softer than the body, as with one point a
/// cell, makes solutions slower than none (K/μ = 1000: 809 iterations instead of 263; fully integrated 189).
fn add_volumetric<const D: usize>(matrix: &mut ElementMatrix, stiffness: f64, slopes: &[[f64; D]; CORNERS]) {
    let mut at = 0;
    for a in 0..1 << D {
        for b in a..1 << D {
            for i in 0..D {
                for j in 0..D {
                    matrix[at][i * D + j] += stiffness * slopes[a][i] * slopes[b][j];
                }
            }
            at += 1;
        }
    }
}

/// sum += volume·C.
fn add_tangent(sum: &mut Tangent, tangent: &Tangent, volume: f64) {
    for (sum, row) in sum.iter_mut().zip(tangent) {
        sum.iter_mut().zip(row).for_each(|(sum, x)| *sum += volume * x);
    }
}

/// products += V ∂φ_a ∂φ_b for each pair of corners a ≤ b; mixed pairs of derivatives both ways.
fn add_products<const D: usize>(products: &mut GradientProducts, volume: f64, slopes: &[[f64; D]; CORNERS]) {
    let mut at = 0;
    for a in 0..1 << D {
        for b in a..1 << D {
            let mut other = 0;
            for k in 0..D {
                products[at][other] += volume * slopes[a][k] * slopes[b][k];
                other += 1;
                for l in k + 1..D {
                    let both = slopes[a][k] * slopes[b][l] + slopes[a][l] * slopes[b][k];
                    products[at][other] += volume * both;
                    other += 1;
                }
            }
            at += 1;
        }
    }
}

/// The hats of a cell's corners and their derivatives.
pub fn hats<const D: usize>(local: [f64; D], edge: [f64; D]) -> ([f64; CORNERS], [[f64; D]; CORNERS]) {
    let mut values = [0.0; CORNERS];
    let mut slopes = [[0.0; D]; CORNERS];
    for corner in 0..1 << D {
        let mut value = 1.0;
        let mut slope = [1.0; D];
        for d in 0..D {
            let upper = corner >> d & 1 == 1;
            let (hat, derivative) =
                if upper { (local[d], 1.0 / edge[d]) } else { (1.0 - local[d], -1.0 / edge[d]) };
            value *= hat;
            for (e, slope) in slope.iter_mut().enumerate() {
                *slope *= if e == d { derivative } else { hat };
            }
        }
        (values[corner], slopes[corner]) = (value, slope);
    }
    (values, slopes)
}

//! Test bodies on a lattice and as a cloud, random displacements, and reference sums of Eqs (2.6) and (2.47).

use peri::bonds::{BodyGeometry, BondForces, Bonds, CloudBonds, LatticeBonds, VolumeCorrection, force};
use peri::correction::surface_factors;
use peri::field::Field;
use peri::geometry::{Cut, Operation, Shape, lattice};
use peri::material::BondMaterial;
use peri::potential::{BondPotential, KernelFit, Law};
use peri::solver::{DynamicRelaxation, Loads, Method, State, System};

/// kθ of all bodies; the value is arbitrary.
pub const MODULUS: f64 = 1.7;

/// Cut of zero width in the plane y = `at` over `from` ≤ x ≤ `to` (and all z).
#[derive(Clone, Copy)]
pub struct Slit {
    pub at: f64,
    pub from: f64,
    pub to: f64,
}

/// Specification of a body.
#[derive(Clone)]
pub struct Body<const D: usize> {
    pub operations: Vec<Operation<D>>,
    pub spacing: f64,
    pub ratio: f64,
    pub volume_correction: VolumeCorrection,
    pub slits: Vec<Slit>,
    /// C₁₁₁₁ of the energy surface correction, if any.
    pub surface: Option<f64>,
}

/// Body on a lattice and as a cloud, with the site of each particle in input order.
pub struct Built<const D: usize> {
    pub lattice: LatticeBonds<D>,
    pub cloud: CloudBonds<D>,
    pub points: Vec<[f64; D]>,
    pub on_lattice: Vec<usize>,
    pub in_cloud: Vec<usize>,
}

impl<const D: usize> Body<D> {
    /// Creates a box of cells with its lower corner at the origin, without hole and crack.
    pub fn solid(cells: [usize; D], spacing: f64, ratio: f64) -> Self {
        let max = cells.map(|c| c as f64 * spacing);
        Self {
            operations: vec![Operation::Add(Shape::Box { min: [0.0; D], max })],
            spacing,
            ratio,
            volume_correction: VolumeCorrection::None,
            slits: Vec::new(),
            surface: None,
        }
    }

    /// Creates a box with an eccentric hole, two cracks and all corrections.
    pub fn damaged(cells: [usize; D], spacing: f64, ratio: f64) -> Self {
        let mut body = Self::solid(cells, spacing, ratio);
        let length = cells.map(|c| c as f64 * spacing);
        let hole = Shape::Ball { centre: length.map(|l| 0.6 * l), radius: 0.13 * length[0] };
        body.operations.push(Operation::Cut(hole));
        body.slits = vec![
            Slit { at: 0.31 * length[1], from: -1.0, to: 0.413 * length[0] },
            Slit { at: 0.77 * length[1], from: 0.222 * length[0], to: 0.587 * length[0] },
        ];
        body.volume_correction = VolumeCorrection::Linear;
        body.surface = Some(9.0 / 8.0);
        body
    }

    pub fn horizon(&self) -> f64 {
        self.ratio * self.spacing
    }

    fn cuts(&self) -> Vec<Cut<D>> {
        let far = 1e3 * self.spacing;
        let cut = |slit: &Slit| {
            let mut cut = Cut { corner: [-far; D], edges: [[0.0; D]; D] };
            (cut.corner[0], cut.corner[1]) = (slit.from, slit.at);
            cut.edges[0][0] = slit.to - slit.from;
            if D == 3 {
                cut.edges[1][2] = 2.0 * far;
            }
            cut
        };
        self.slits.iter().map(cut).collect()
    }

    pub fn build(&self) -> Built<D> {
        let cells = lattice(&self.operations, self.spacing, 1.0).unwrap();
        let volume = cells.volume;
        let mut lattice = LatticeBonds::new(cells, self.ratio, self.volume_correction, &self.cuts()).unwrap();
        let on_lattice: Vec<usize> = lattice.particles().iter().map(|&s| s as usize).collect();
        let points: Vec<[f64; D]> = on_lattice.iter().map(|&s| lattice.position(s)).collect();
        let volumes = vec![volume; points.len()];
        let correction = self.volume_correction;
        let mut cloud =
            CloudBonds::new(&points, &volumes, 1.0, self.horizon(), correction, &self.cuts()).unwrap();
        let mut in_cloud = vec![0; points.len()];
        for (site, &particle) in cloud.input_order().iter().enumerate() {
            in_cloud[particle as usize] = site;
        }
        if let Some(stiffness) = self.surface {
            let factors = surface_factors(&lattice, MODULUS, stiffness);
            lattice.set_factors(factors);
            let factors = surface_factors(&cloud, MODULUS, stiffness);
            cloud.set_factors(factors);
        }
        Built { lattice, cloud, points, on_lattice, in_cloud }
    }

    /// Returns pairs (I, J), I < J, with reference bond and weight (volume × surface correction), by
    /// comparing all particles.
    pub fn pairs(&self, points: &[[f64; D]]) -> Vec<BondPair<D>> {
        // the smallest gap between lattice distances near the horizons used here is far above this rounding
        // margin
        let square = self.horizon().powi(2) * (1.0 + 1e-12);
        let mut pairs = Vec::new();
        for i in 0..points.len() {
            for j in i + 1..points.len() {
                let bond: [f64; D] = std::array::from_fn(|d| points[j][d] - points[i][d]);
                let length = norm(bond);
                if length * length <= square && !self.slits.iter().any(|s| s.parts(points[i], points[j])) {
                    let part = (self.horizon() + 0.5 * self.spacing - length) / self.spacing;
                    let linear = self.volume_correction == VolumeCorrection::Linear;
                    let weight = if linear { part.clamp(0.0, 1.0) } else { 1.0 };
                    pairs.push(BondPair { i, j, bond, length, weight });
                }
            }
        }
        if let Some(stiffness) = self.surface {
            self.correct(&mut pairs, points.len(), stiffness);
        }
        pairs
    }

    /// Returns the surface correction of Madenci & Oterkus (2014), §4.2, as in `s12_mosurf.py`.
    fn correct(&self, pairs: &mut [BondPair<D>], count: usize, stiffness: f64) {
        let volume = self.spacing.powi(D as i32);
        let mut energy = vec![[0.0; D]; count];
        for pair in pairs.iter() {
            for d in 0..D {
                let strain = (pair.bond[d] / pair.length).powi(2);
                let stored = 0.25 * 6.0 * MODULUS * strain * strain * pair.length * volume * pair.weight;
                energy[pair.i][d] += stored;
                energy[pair.j][d] += stored;
            }
        }
        let factor = |w: f64| if w > 0.0 { 0.5 * stiffness / w } else { 1.0 };
        for pair in pairs {
            let sum: f64 = (0..D)
                .map(|d| {
                    let mean = 0.5 * (factor(energy[pair.i][d]) + factor(energy[pair.j][d]));
                    (pair.bond[d] / pair.length / mean).powi(2)
                })
                .sum();
            pair.weight /= sum.sqrt();
        }
    }

    /// Returns force densities f_I = Σ_J 2kθ t(λ) w V_J ζ/|ζ|, and the sum of the magnitudes in each.
    pub fn plain_forces(
        &self,
        pairs: &[BondPair<D>],
        law: &dyn BondPotential,
        displacement: &[[f64; D]],
    ) -> (Vec<[f64; D]>, Vec<f64>) {
        let volume = self.spacing.powi(D as i32);
        let mut forces = vec![[0.0; D]; displacement.len()];
        let mut sizes = vec![0.0; displacement.len()];
        for pair in pairs {
            let (zeta, stretch) = pair.deformed(displacement);
            let force = 2.0 * MODULUS * law.tension(stretch) * pair.weight * volume;
            for d in 0..D {
                let part = force * zeta[d] / norm(zeta);
                forces[pair.i][d] += part;
                forces[pair.j][d] -= part;
            }
            sizes[pair.i] += force.abs();
            sizes[pair.j] += force.abs();
        }
        (forces, sizes)
    }
}

impl Slit {
    fn parts<const D: usize>(&self, a: [f64; D], b: [f64; D]) -> bool {
        let (above, below) = (a[1] - self.at, b[1] - self.at);
        let x = a[0] + above / (above - below) * (b[0] - a[0]);
        above * below < 0.0 && self.from < x && x < self.to
    }
}

/// Bond between two particles.
#[derive(Clone, Copy)]
pub struct BondPair<const D: usize> {
    pub i: usize,
    pub j: usize,
    pub bond: [f64; D],
    pub length: f64,
    pub weight: f64,
}

impl<const D: usize> BondPair<D> {
    /// Returns ζ and the stretch λ.
    pub fn deformed(&self, displacement: &[[f64; D]]) -> ([f64; D], f64) {
        let zeta = std::array::from_fn(|d| self.bond[d] + displacement[self.j][d] - displacement[self.i][d]);
        (zeta, norm(zeta) / self.length)
    }
}

/// Returns the smallest and largest stretch of all pairs, slightly widened.
pub fn stretch_range<const D: usize>(pairs: &[BondPair<D>], displacement: &[[f64; D]]) -> [f64; 2] {
    let range = pairs
        .iter()
        .map(|pair| pair.deformed(displacement).1)
        .fold([0.99_f64, 1.01_f64], |[low, high], l| [low.min(l), high.max(l)]);
    [range[0] - 1e-3, range[1] + 1e-3]
}

/// Returns the forces of all particles in input order; `sites` has the site of each.
pub fn forces<const D: usize>(
    bonds: &dyn Bonds<D>,
    sites: &[usize],
    displacement: &[[f64; D]],
) -> Vec<[f64; D]> {
    let field = scatter(bonds.sites(), sites, displacement);
    let mut result = Field::zeros(bonds.sites());
    force(bonds, &field, &mut result);
    sites.iter().map(|&site| result.get(site)).collect()
}

/// Scatters values of particles to their sites.
pub fn scatter<const D: usize>(count: usize, sites: &[usize], values: &[[f64; D]]) -> Field<D> {
    let mut field = Field::zeros(count);
    for (&site, &value) in sites.iter().zip(values) {
        field.set(site, value);
    }
    field
}

/// Returns the five laws with the DENT parameters of the thesis, unscaled.
pub fn laws() -> impl Iterator<Item = (Law, Box<dyn BondPotential>)> {
    Law::ALL.into_iter().map(|law| (law, law.build(720.0, 1200.0, false).unwrap()))
}

/// Relaxes `state` under `loads`.
pub fn relax<const D: usize>(
    solver: &DynamicRelaxation,
    bonds: &mut dyn Bonds<D>,
    law: (&dyn BondPotential, f64),
    loads: &Loads<D>,
    factors: &[f64],
    state: &mut State<D>,
) -> Result<(), peri::Error> {
    let (law, modulus) = law;
    let mut system = System::new(bonds, BondMaterial::new(law, modulus), loads, factors);
    solver.solve(&mut system, state, &mut |_, _| Ok(()), &mut |_, _| Ok(()))
}

/// Prescribes the components `constrained` (bits) of the particles that `choose` picks at the displacements
/// it gives.
pub fn hold<const D: usize>(
    bonds: &dyn Bonds<D>,
    choose: impl Fn([f64; D]) -> Option<(u8, [f64; D])>,
) -> Loads<D> {
    let mut displacement = Field::zeros(bonds.sites());
    let mut constrained = vec![0; bonds.sites()];
    for &site in bonds.particles() {
        if let Some((bits, value)) = choose(bonds.position(site as usize)) {
            constrained[site as usize] = bits;
            displacement.set(site as usize, value);
        }
    }
    Loads { displacement: Some(displacement), constrained, ..Loads::default() }
}

/// Returns a fit with the default bound of scenes.
pub fn fit(law: &dyn BondPotential, range: [f64; 2]) -> KernelFit {
    KernelFit::new(law, range, 1e-9).unwrap()
}

/// Linear congruential generator of Knuth, 64 bits: equal displacements on every machine.
pub struct Random(pub u64);

impl Random {
    /// Returns a uniform number in [−1, 1).
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// Returns a vector per particle with components within ±`size`.
    pub fn vectors<const D: usize>(&mut self, count: usize, size: f64) -> Vec<[f64; D]> {
        (0..count).map(|_| std::array::from_fn(|_| size * self.next())).collect()
    }
}

pub fn norm<const D: usize>(vector: [f64; D]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Returns the root mean square length of vectors.
pub fn rms<const D: usize>(vectors: &[[f64; D]]) -> f64 {
    let sum: f64 = vectors.iter().flatten().map(|x| x * x).sum();
    (sum / vectors.len() as f64).sqrt()
}

/// Returns the largest distance between two lists of vectors.
pub fn distance<const D: usize>(a: &[[f64; D]], b: &[[f64; D]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| norm(std::array::from_fn::<f64, D, _>(|d| a[d] - b[d]))).fold(0.0, f64::max)
}

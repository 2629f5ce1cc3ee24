//! Solids with any Poisson ratio: checks of all materials, the state of every particle by an independent
//! program (`docs/reference/correspondence`; `solid_*.csv`, 13 digits), and closed forms.

use crate::bodies::{Body, Random, scatter};
use crate::materials::battery;
use evidence::{at_most, near};
use peri::bonds::{BodyGeometry, BondDamage, Bonds, LatticeBonds, Overstretched, VolumeCorrection};
use peri::calibrate::Space;
use peri::field::Field;
use peri::geometry::{Operation, Shape, lattice};
use peri::material::{
    BodyTensor, Correspondence, Deformation, EightChainSolid, Family, Material, NonlocalSolid, PointLaw,
    Pointwise, SolverMaterial,
};
use polycore::constitutive::hyperelastic::{Compressible, NeoHookean, Volumetric};

/// Returns W = ½μ(I₁ − 3 − 2 ln J) + ¼κ(J² − 1 − 2 ln J), μ = 1, of a bulk modulus K.
pub fn neo_hooke<const D: usize>(
    space: Space,
    bulk: f64,
) -> NonlocalSolid<Correspondence<Compressible<NeoHookean>, D>> {
    let volumetric = Volumetric::Ciarlet { lame: bulk - 2.0 / 3.0 };
    let law = Compressible::new(NeoHookean::new(1.0).unwrap(), volumetric).unwrap();
    NonlocalSolid::new(Correspondence::new(law, space).unwrap())
}

pub fn rubber<const D: usize>(space: Space, bulk: f64) -> NonlocalSolid<EightChainSolid<D>> {
    NonlocalSolid::new(EightChainSolid::new(space, 1.0, 25.0, bulk).unwrap())
}

#[test]
fn solids_pass_the_battery() {
    let planes = [
        (Space::PlaneStrain, 5.0 / 3.0),
        (Space::PlaneStrain, 100.0),
        (Space::PlaneStress, f64::INFINITY),
        (Space::PlaneStress, 10.0),
    ];
    let mut greatest = 0.0_f64;
    for (space, bulk) in planes {
        let name = format!("eight-chain, {space:?}, K/μ = {bulk}");
        greatest = greatest.max(battery::<2>(&name, [8, 7], &|bonds| rubber(space, bulk).respond(bonds)));
        if bulk.is_finite() {
            let name = format!("neo-Hooke, {space:?}, K/μ = {bulk}");
            greatest =
                greatest.max(battery::<2>(&name, [8, 7], &|bonds| neo_hooke(space, bulk).respond(bonds)));
        }
    }
    for bulk in [5.0 / 3.0, 100.0] {
        let name = format!("eight-chain, K/μ = {bulk}");
        let solid = battery::<3>(&name, [4, 4, 3], &|bonds| rubber(Space::Solid, bulk).respond(bonds));
        let name = format!("neo-Hooke, K/μ = {bulk}");
        let other = battery::<3>(&name, [4, 4, 3], &|bonds| neo_hooke(Space::Solid, bulk).respond(bonds));
        greatest = greatest.max(solid).max(other);
    }
    println!("λmax(K)/s V of all solids: {greatest:.3}; the bound is 2");
}

/// Block of the independent program: cells of edge 1, the first at the origin.
struct Block<const D: usize> {
    bonds: LatticeBonds<D>,
    /// Sites in the order of the program, whose last axis varies fastest.
    order: Vec<usize>,
    displacement: Field<D>,
    rows: Vec<Vec<f64>>,
}

impl<const D: usize> Block<D> {
    fn read(cells: [usize; D], file: &str) -> Self {
        let body = [Operation::Add(Shape::Box { min: [0.0; D], max: cells.map(|c| c as f64) })];
        let bonds = LatticeBonds::new(lattice(&body, 1.0, 1.0).unwrap(), 3.015, VolumeCorrection::None, &[]);
        let bonds = bonds.unwrap();
        let number = |text: &str| text.trim().parse::<f64>().unwrap();
        let rows = file.lines().skip(1).map(|line| line.split(',').map(number).collect());
        let rows: Vec<Vec<f64>> = rows.collect();
        let find = |row: &Vec<f64>| {
            let at = |&&site: &&u32| {
                let x = bonds.position(site as usize);
                (0..D).all(|d| (x[d] - row[1 + d]).abs() < 1e-9)
            };
            *bonds.particles().iter().find(at).unwrap() as usize
        };
        let order: Vec<usize> = rows.iter().map(find).collect();
        let placed: Vec<[f64; D]> = order.iter().map(|&site| displaced(bonds.position(site))).collect();
        let displacement = scatter(bonds.sites(), &order, &placed);
        Self { bonds, order, displacement, rows }
    }

    /// Severs the bonds across x = `at` below y = `below`.
    fn sever(&mut self, at: f64, below: f64) {
        let mut list = Vec::new();
        for &site in &self.order {
            let p = self.bonds.position(site);
            self.bonds.neighbours(site, &mut |bond| {
                let q = self.bonds.position(bond.site);
                let crossing = p[1] + (at - p[0]) / (q[0] - p[0]) * (q[1] - p[1]);
                if (p[0] - at) * (q[0] - at) < 0.0 && crossing < below - 1e-9 {
                    let (site, index) = (site as u32, bond.index);
                    list.push(Overstretched { site, index, elongation: 0.0, length: 1.0, weight: 1.0 });
                }
            });
        }
        self.bonds.break_bonds(&list);
    }

    /// Returns the largest differences of f, F, W and I from the program, over the largest of each, and ΣE
    /// over all particles.
    fn compare<L: PointLaw<D> + Clone>(
        &mut self,
        solid: &NonlocalSolid<L>,
        cut: Option<(f64, f64)>,
    ) -> ([f64; 4], f64) {
        let mut material = Pointwise::new(solid.clone(), &self.bonds);
        if let Some((at, below)) = cut {
            self.sever(at, below);
        }
        material.prepare(&self.bonds, &self.displacement);
        let mut force = Field::zeros(self.bonds.sites());
        for (chunk, mut part) in force.chunks_mut().into_iter().enumerate() {
            material.force(&self.bonds, &self.displacement, chunk * peri::field::CHUNK, &mut part, None);
        }
        let (mut off, mut most) = ([0.0_f64; 4], [1e-300_f64; 4]);
        let mut note = |k: usize, found: f64, truth: f64| {
            off[k] = off[k].max((found - truth).abs());
            most[k] = most[k].max(truth.abs());
        };
        let mut energy = 0.0;
        for (row, &site) in self.rows.iter().zip(&self.order) {
            let point = &material.points()[site];
            let gradient = point.deformation().unwrap().gradient();
            for d in 0..D {
                note(0, force.get(site)[d], row[1 + D + d]);
                for e in 0..D {
                    note(1, gradient[(d, e)], row[1 + 2 * D + D * d + e]);
                }
            }
            let rest = &row[1 + 2 * D + D * D..];
            // the program's column E is I W with the stabilisation
            note(2, solid.energy(&Family::new(&self.bonds, &self.displacement, site), point), rest[1]);
            note(3, point.integrity(), rest[2]);
            energy += solid.energy(&Family::new(&self.bonds, &self.displacement, site), point);
        }
        (std::array::from_fn(|k| off[k] / most[k]), energy)
    }
}

/// Returns the displacement of the blocks of the independent program.
pub fn displaced<const D: usize>(position: [f64; D]) -> [f64; D] {
    let [x, y] = [position[0], position[1]];
    let z = if D == 3 { position[2] } else { 0.0 };
    let all = [
        0.08 * x + 0.05 * y + 0.02 * (1.3 * x + 0.7 * y - 0.4 * z).sin(),
        -0.03 * x - 0.04 * y + 0.03 * z + 0.02 * (0.9 * x - 1.1 * y + 0.6 * z).cos(),
        0.02 * y - 0.02 * z + 0.015 * (0.5 * x + 0.8 * y + 1.2 * z).sin(),
    ];
    std::array::from_fn(|d| all[d])
}

/// Energies, forces, gradients and integrities of every particle agree with the 13 digits of corr.py.
#[test]
fn every_particle_agrees_with_an_independent_program() {
    let third = 5.0 / 3.0;
    let mut found = Vec::new();
    let mut plane = |name: &'static str, file, space, cut, energy| {
        let (off, sum) = Block::<2>::read([6, 5], file).compare(&neo_hooke(space, third), cut);
        found.push((name, off, sum, energy));
    };
    plane("strain", include_str!("solid_strain.csv"), Space::PlaneStrain, None, 0.279100734405);
    plane("stress", include_str!("solid_stress.csv"), Space::PlaneStress, None, 0.270493332237);
    let cut = Some((3.0, 2.5));
    plane("cut", include_str!("solid_strain_damaged.csv"), Space::PlaneStrain, cut, 0.246181061988);
    let mut space = |name: &'static str, file, bulk, cut, energy| {
        let (off, sum) = Block::<3>::read([5, 4, 3], file).compare(&neo_hooke(Space::Solid, bulk), cut);
        found.push((name, off, sum, energy));
    };
    space("3d_k_100", include_str!("solid_3d_incompressible.csv"), 100.0, None, 2.64338717538);
    space("3d_cut", include_str!("solid_3d_damaged.csv"), third, Some((2.5, 2.0)), 0.556714687138);
    for (name, off, sum, energy) in found {
        for (what, off) in ["force", "gradient", "energy", "integrity"].iter().zip(off) {
            at_most(&format!("solid_{name}_{what}"), off, 2e-12);
        }
        // the program prints 12 digits of the sum
        near(&format!("solid_{name}_total_energy"), sum, energy, 5e-12 * energy);
    }
}

/// A neo-Hookean network equals its correspondence solid: W_S = ½μ is the constant stabilisation. With n → ∞
/// the chains have μ(I₁) = μ₀ up to 1/n.
#[test]
fn long_chains_are_neo_hookean() {
    let body = Body::<2>::damaged([9, 8], 1.0, 3.015);
    let built = body.build();
    let moved = Random(3).vectors(built.points.len(), 0.05);
    let displacement = scatter(built.lattice.sites(), &built.on_lattice, &moved);
    let forces = |material: &mut dyn SolverMaterial<2>| {
        material.prepare(&built.lattice, &displacement);
        let mut force = Field::<2>::zeros(built.lattice.sites());
        for (chunk, mut part) in force.chunks_mut().into_iter().enumerate() {
            material.force(&built.lattice, &displacement, chunk * peri::field::CHUNK, &mut part, None);
        }
        force
    };
    let chains = NonlocalSolid::new(EightChainSolid::new(Space::PlaneStrain, 1.0, 1e9, 10.0).unwrap());
    let a = forces(&mut Pointwise::new(chains, &built.lattice));
    let b = forces(&mut Pointwise::new(neo_hooke(Space::PlaneStrain, 10.0), &built.lattice));
    let largest =
        |f: &Field<2>| f.components().iter().flat_map(|c| c.iter()).fold(0.0_f64, |m, x| m.max(x.abs()));
    let apart = (0..2).flat_map(|d| a.components()[d].iter().zip(b.components()[d]));
    let apart = apart.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / largest(&b);
    at_most("solid_long_chains_neo_hooke", apart, 1e-7);
}

/// Returns F of a homogeneous deformation.
fn homogeneous<const D: usize>(stretches: [f64; D]) -> Deformation<D> {
    let gradient = BodyTensor::<D>::from_fn(|a, b| if a == b { stretches[a] - 1.0 } else { 0.0 });
    Deformation::homogeneous(gradient)
}

/// Nominal stresses of incompressible eight-chain rubber, by mpmath in the formulation.
#[test]
fn nominal_stresses_of_the_network() {
    let table = [
        (25.0_f64, 2.0_f64, [1.7803184, 1.9116696, 2.0588673]),
        (25.0, 3.0, [3.0671409, 3.1592624, 3.4714333]),
        (8.0, 1.5, [1.0743818, 1.2293979, 1.4433431]),
        (100.0, 3.0, [2.9287563, 3.006642, 3.0916001]),
    ];
    for (links, stretch, truth) in table {
        let law = EightChainSolid::new(Space::PlaneStress, 1.0, links, f64::INFINITY).unwrap();
        let states = [[stretch, stretch.powf(-0.5)], [stretch, 1.0], [stretch, stretch]];
        for (state, truth) in states.into_iter().zip(truth) {
            let found = PointLaw::<2>::respond(&law, &homogeneous(state)).piola[(0, 0)];
            near(&format!("eight_chain_{links}_{stretch}_{:.3}", state[1]), found, truth, 1e-7);
        }
    }
    for (links, truth) in [(8.0, 99.2738375096), (25.0, 99.3164676363)] {
        let law = EightChainSolid::<3>::new(Space::Solid, 1.0, links, 100.0).unwrap();
        near(&format!("eight_chain_kappa_{links}"), law.volumetric(), truth, 1e-9);
    }
}

/// P/μ₀ at l = 2 with free sides: 3D, plane strain, plane stress with a finite K.
#[test]
fn free_sides_follow_the_bulk_modulus() {
    fn pulled<const D: usize>(law: &EightChainSolid<D>) -> f64 {
        // P₂₂ = 0 by bisection in the stretch of the sides
        let respond = |side: f64| {
            let mut stretches = [side; D];
            stretches[0] = 2.0;
            PointLaw::<D>::respond(law, &homogeneous(stretches)).piola
        };
        let (mut low, mut high) = (0.3, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if respond(middle)[(1, 1)] > 0.0 { high = middle } else { low = middle }
        }
        respond(low)[(0, 0)]
    }
    let bulk = [1.5, 10.0, 100.0, 1000.0];
    let tables = [
        (Space::Solid, [1.70017, 1.76865, 1.77915, 1.78020]),
        (Space::PlaneStrain, [1.77310, 1.89298, 1.90983, 1.91149]),
    ];
    for (space, truth) in tables {
        for (bulk, truth) in bulk.into_iter().zip(truth) {
            let found = if space == Space::Solid {
                pulled::<3>(&EightChainSolid::new(space, 1.0, 25.0, bulk).unwrap())
            } else {
                pulled::<2>(&EightChainSolid::new(space, 1.0, 25.0, bulk).unwrap())
            };
            near(&format!("eight_chain_pulled_{space:?}_{bulk}"), found, truth, 2e-5);
        }
    }
    // a sheet of a finite K is a solid whose two sides are free
    for bulk in bulk {
        let sheet = pulled::<2>(&EightChainSolid::new(Space::PlaneStress, 1.0, 25.0, bulk).unwrap());
        let solid = pulled::<3>(&EightChainSolid::new(Space::Solid, 1.0, 25.0, bulk).unwrap());
        near(&format!("eight_chain_sheet_{bulk}"), sheet, solid, 1e-12);
    }
}

/// The thickness of a sheet balances P₃₃ of the solid with this third stretch, to rounding, also of chains
/// that are locked or nearly incompressible; the other stresses are the same.
#[test]
fn thickness_balances_to_rounding() {
    let (mut worst, mut unbalanced) = (0.0_f64, 0.0_f64);
    for (links, bulk) in [1.5, 25.0, 400.0].into_iter().flat_map(|n| [3.0, 100.0, 1e6].map(|k| (n, k))) {
        let sheet = EightChainSolid::<2>::new(Space::PlaneStress, 1.0, links, bulk).unwrap();
        let solid = EightChainSolid::<3>::new(Space::Solid, 1.0, links, bulk).unwrap();
        for place in 0..400 {
            let [a, b] = [place % 20, place / 20].map(|k| 0.3 + 0.16 * f64::from(k));
            let plane = homogeneous([a, b]);
            let whole = homogeneous([a, b, sheet.thickness_stretch(&plane)]);
            let (flat, full) = (sheet.respond(&plane).piola, solid.respond(&whole).piola);
            let size = solid.stiffness(&whole);
            unbalanced = unbalanced.max(full[(2, 2)].abs() / size);
            worst = worst.max((0..2).map(|d| (flat[(d, d)] - full[(d, d)]).abs() / size).fold(0.0, f64::max));
        }
    }
    // a dozen roundings
    at_most("eight_chain_thickness_balance", unbalanced, 1e-14);
    at_most("eight_chain_sheet_and_solid", worst, 1e-14);
}

/// F and S are exact in every particle of a homogeneous deformation, edges, holes and cracks included, and
/// rest has no force.
#[test]
fn a_homogeneous_deformation_is_exact_everywhere() {
    let body = Body::<2>::damaged([14, 13], 0.1, 3.015);
    let built = body.build();
    let gradient = [[1.31, 0.22], [-0.17, 0.84]];
    for (path, bonds, sites) in [
        ("lattice", &built.lattice as &dyn Bonds<2>, &built.on_lattice),
        ("cloud", &built.cloud, &built.in_cloud),
    ] {
        let moved: Vec<[f64; 2]> = (built.points.iter())
            .map(|x| std::array::from_fn(|a| (0..2).map(|b| gradient[a][b] * x[b]).sum::<f64>() - x[a]))
            .collect();
        let displacement = scatter(bonds.sites(), sites, &moved);
        let mut material = Pointwise::new(rubber(Space::PlaneStrain, 100.0), bonds);
        material.prepare(bonds, &displacement);
        let (mut off, mut rough) = (0.0_f64, 0.0_f64);
        for &site in sites {
            let found = material.points()[site].deformation().unwrap();
            for a in 0..2 {
                for b in 0..2 {
                    off = off.max((found.gradient()[(a, b)] - gradient[a][b]).abs());
                }
            }
            rough = rough.max(found.residual.abs());
        }
        at_most(&format!("solid_homogeneous_{path}_gradient"), off, 1e-13);
        at_most(&format!("solid_homogeneous_{path}_residual"), rough, 1e-13);
        let rest = Field::zeros(bonds.sites());
        material.prepare(bonds, &rest);
        let mut force = Field::<2>::zeros(bonds.sites());
        for (chunk, mut part) in force.chunks_mut().into_iter().enumerate() {
            material.force(bonds, &rest, chunk, &mut part, None);
        }
        let most = force.components().iter().flat_map(|c| c.iter()).fold(0.0_f64, |m, x| m.max(x.abs()));
        // K = 100 over a spacing of 0.1
        at_most(&format!("solid_rest_force_{path}"), most / 1e3, 1e-12);
    }
}

/// A strip bonded to plates, w/h = 4, pressed by 1 %: finite elements (`docs/reference/eight_chain/strip.py`)
/// have 2.913μ at K/μ = 5/3 and 16.49μ at 100, where all of the stiffness comes from the volume. Plates of
/// particles are compliant over a horizon, so that errors are of first order: 12.6 % and 6.9 % at 16
/// particles over the height.
#[test]
fn a_bonded_strip_is_stiff_because_it_keeps_its_volume() {
    let (height, shear) = (8e-3, 0.4e6);
    let modulus = |spacing, bulk| {
        crate::rubber_bearing::apparent_modulus(4.0 * height, height, spacing, bulk * shear).unwrap() / shear
    };
    let [coarse, fine] = [1e-3, 0.5e-3].map(|spacing| modulus(spacing, 5.0 / 3.0));
    near("bonded_strip_k_5_3_extrapolated", 2.0 * fine - coarse, 2.913, 0.04 * 2.913);
    near("bonded_strip_k_100", modulus(0.5e-3, 100.0), 16.49, 0.08 * 16.49);
}

/// W of simple shear is ½μγ²(1 + O(γ²)) down to strains at which I₁ − 3 has lost all digits of a difference.
#[test]
fn energies_of_small_strains_keep_their_digits() {
    fn worst<const D: usize>(law: &impl PointLaw<D>) -> f64 {
        let mut worst = 0.0_f64;
        for shear in [1e-3, 1e-5, 1e-7] {
            let mut displacement_gradient = BodyTensor::<D>::zeros();
            displacement_gradient[(0, 1)] = shear;
            let found = law.energy(&Deformation::homogeneous(displacement_gradient));
            worst = worst.max((found / (0.5 * shear * shear) - 1.0).abs());
        }
        worst
    }
    let chains = |space, bulk| EightChainSolid::<2>::new(space, 1.0, 25.0, bulk).unwrap();
    let planes = [chains(Space::PlaneStress, f64::INFINITY), chains(Space::PlaneStress, 10.0)];
    let worst_plane = planes.iter().map(worst).fold(worst(&chains(Space::PlaneStrain, 100.0)), f64::max);
    let solid = worst(&EightChainSolid::<3>::new(Space::Solid, 1.0, 25.0, 100.0).unwrap());
    at_most("eight_chain_energy_small_strain", worst_plane.max(solid), 2e-6);
}

/// The force of a crushed sheet is the slope of its energy.
#[test]
fn crushed_sheets_have_the_energy_of_their_force() {
    let law = EightChainSolid::<2>::new(Space::PlaneStress, 1.0, 400.0, 10.0).unwrap();
    let at = |x: f64| homogeneous([x, 0.8]);
    for stretch in [0.03, 0.05, 0.075, 0.3] {
        let step = 1e-6;
        let slope = (law.energy(&at(stretch + step)) - law.energy(&at(stretch - step))) / (2.0 * step);
        let piola = law.respond(&at(stretch)).piola[(0, 0)];
        assert!((slope / piola - 1.0).abs() < 1e-6, "{stretch}: {slope} and {piola}");
    }
}

#[test]
fn laws_of_another_dimension_are_refused() {
    assert!(EightChainSolid::<2>::new(Space::Solid, 1.0, 25.0, 100.0).is_err());
    assert!(EightChainSolid::<3>::new(Space::PlaneStress, 1.0, 25.0, 100.0).is_err());
    let law = Compressible::new(NeoHookean::new(1.0).unwrap(), Volumetric::Ciarlet { lame: 1.0 }).unwrap();
    assert!(Correspondence::<_, 2>::new(law, Space::Solid).is_err());
}

/// Iterations grow as the root of the bulk modulus, which the coarse level includes.
#[test]
fn iterations_at_large_bulk_moduli() {
    let iterations = |bulk: f64| {
        let strip = Shape::rectangle([0.0, -3e-3], [32e-3, 11e-3]);
        let body = peri::model::Body::lattice(strip, 0.5e-3).plane_strain(1e-3);
        let rubber =
            NonlocalSolid::new(EightChainSolid::new(Space::PlaneStrain, 0.4e6, 25.0, bulk * 0.4e6).unwrap());
        let model = peri::model::Model::new(body, rubber)
            .clamp(|[_, y]| y < 0.0)
            .displace(|[_, y]| y > 8e-3, [0.0, -0.08e-3]);
        let mut simulation = model.build().unwrap();
        let method = peri::solver::Lbfgs { tolerance: 1e-4, ..Default::default() };
        simulation.solve(method).unwrap();
        simulation.state.counts.total_iterations as f64
    };
    let found = [10.0, 100.0, 1000.0].map(iterations);
    // without the volume in the coarse level: 23, 205, 2470
    for (found, most) in found.into_iter().zip([25.0, 75.0, 280.0]) {
        at_most("iterations_at_large_bulk_moduli", found, most);
    }
}

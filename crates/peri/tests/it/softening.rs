//! Bonds of solids with a strength and a toughness: forces of softened bonds, strength, energies, resumed
//! runs.

use crate::bodies::{Body, Random, Slit, hold, scatter};
use crate::solid_kernels::PlainLoops;
use crate::solids::{displaced, neo_hooke, rubber};
use evidence::{at_most, near};
use peri::bonds::{BodyGeometry, Bonds, CloudBonds, Softened, StretchRange};
use peri::calibrate::Space;
use peri::critical::bilinear;
use peri::field::Field;
use peri::material::{EightChainSolid, Material, NonlocalSolid, SolverMaterial, energy_at_strength};
use peri::solver::{Bilinear, Breaking, Lbfgs, Method, Policy, State, Status, System, VelocityVerlet};

/// Opening a bond completely takes Y_c at any strength: ∫Y(−dd) by the trapezoidal rule over κ.
#[test]
fn a_bond_takes_its_toughness() {
    for ductility in [1.2, 2.0, 4.0, 8.0] {
        let law = Bilinear { onset: 3.0, limit: 3.0 * ductility };
        let (steps, most) = (100_000, 3.0 * ductility * ductility);
        let at = |k: usize| 3.0 + (most - 3.0) * k as f64 / steps as f64;
        let part = |k: usize| 0.5 * (at(k) + at(k + 1)) * (law.integrity(at(k)) - law.integrity(at(k + 1)));
        let took: f64 = (0..steps).map(part).sum();
        near("bilinear_bond_toughness", took / law.limit, 1.0, 1e-6);
    }
    let brittle = Bilinear { onset: 3.0, limit: 3.0 };
    assert_eq!([2.9, 3.1].map(|energy| brittle.integrity(energy)), [1.0, 0.0]);
}

/// Softens a third of the bonds at random, each from both ends.
fn soften<const D: usize>(bonds: &mut dyn Bonds<D>) {
    let mut random = Random(11);
    let mut list: Vec<Softened> = Vec::new();
    for &site in bonds.particles() {
        bonds.neighbours(site as usize, &mut |bond| {
            let (greatest, integrity) = (1.0, 0.5 + 0.49 * random.next());
            if (site as usize) < bond.site && random.next() < -0.3 {
                list.push(Softened { site, index: bond.index, greatest, integrity });
                bonds.neighbours(bond.site, &mut |back| {
                    if back.site == site as usize {
                        list.push(Softened {
                            site: bond.site as u32,
                            index: back.index,
                            greatest,
                            integrity,
                        });
                    }
                });
            }
        });
    }
    bonds.soften(list);
}

fn forces<const D: usize>(
    material: &mut dyn SolverMaterial<D>,
    bonds: &dyn Bonds<D>,
    displacement: &Field<D>,
) -> Field<D> {
    material.prepare(bonds, displacement);
    let mut force = Field::<D>::zeros(bonds.sites());
    for (chunk, mut part) in force.chunks_mut().into_iter().enumerate() {
        material.force(bonds, displacement, chunk, &mut part, None);
    }
    force
}

/// Way to compute forces: name, bonds, material and displacement.
type Path<'a, const D: usize> = (&'a str, &'a dyn Bonds<D>, Box<dyn SolverMaterial<D>>, Field<D>);

/// Forces at constant integrities are slopes of the energy and sum to zero, on lattices by kernels and by
/// plain loops, and in clouds.
fn slopes<const D: usize>(space: Space, cells: [usize; D]) {
    let body = Body::damaged(cells, 1.0, 3.015);
    let mut built = body.build();
    let moved: Vec<[f64; D]> = built.points.iter().map(|&x| displaced(x)).collect();
    let in_lattice = scatter(built.lattice.sites(), &built.on_lattice, &moved);
    let in_cloud = scatter(built.cloud.sites(), &built.in_cloud, &moved);
    let solid = || neo_hooke::<D>(space, 3.0);
    soften(&mut built.lattice);
    soften(&mut built.cloud);
    let (lattice, cloud): (&dyn Bonds<D>, &CloudBonds<D>) = (&built.lattice, &built.cloud);
    let cases: [Path<D>; 3] = [
        ("kernels", lattice, solid().respond(lattice), in_lattice.clone()),
        ("loops", lattice, PlainLoops(solid()).respond(lattice), in_lattice),
        ("cloud", cloud, solid().respond(cloud), in_cloud),
    ];
    let mut found = Vec::new();
    for (path, bonds, mut material, displacement) in cases {
        let force = forces(&mut *material, bonds, &displacement);
        let sites = || bonds.particles().iter().map(|&site| site as usize);
        let scale = sites().flat_map(|site| force.get(site)).fold(0.0_f64, |m, f| m.max(f.abs()));
        for d in 0..D {
            let sum: f64 = sites().map(|site| force.get(site)[d] * bonds.volume(site)).sum();
            at_most("softened_forces_sum", (sum / scale).abs(), 1e-12);
        }
        let (mut worst, step) = (0.0_f64, 1e-5);
        for site in sites().step_by(5) {
            for d in 0..D {
                let mut at = |sign: f64| {
                    let (mut moved, mut value) = (displacement.clone(), displacement.get(site));
                    value[d] += sign * step;
                    moved.set(site, value);
                    material.energy(bonds, &moved, StretchRange::REST)
                };
                let slope = (at(1.0) - at(-1.0)) / (2.0 * step * bonds.volume(site));
                worst = worst.max((slope + force.get(site)[d]).abs() / scale);
            }
        }
        at_most(&format!("softened_forces_{D}d_{path}"), worst, 1e-7);
        found.push((force, scale));
    }
    for &site in lattice.particles() {
        let [a, b] = [0, 1].map(|k: usize| found[k].0.get(site as usize));
        assert!((0..D).all(|d| (a[d] - b[d]).abs() < 1e-12 * found[0].1), "{site}: {a:?} {b:?}");
    }
}

#[test]
fn forces_of_softened_bonds_are_slopes() {
    slopes::<2>(Space::PlaneStrain, [9, 8]);
    slopes::<3>(Space::Solid, [5, 5, 4]);
}

/// W at the strength is σ²/(2E) at small strains, (1 − ν²)σ²/(2E) in plane strain, and ½μ(λ² + 2/λ − 3) of an
/// incompressible neo-Hookean sheet with nominal stress μ(λ − λ⁻²).
#[test]
fn energies_at_a_strength() {
    let (bulk, small) = (5.0 / 3.0, 1e-4);
    let youngs = 9.0 * bulk / (3.0 * bulk + 1.0);
    let poisson = 0.5 * youngs - 1.0;
    let solid = energy_at_strength(neo_hooke::<3>(Space::Solid, bulk).law(), small).unwrap();
    near("energy_at_strength_3d", solid * 2.0 * youngs / (small * small), 1.0, 2e-4);
    let plane = energy_at_strength(neo_hooke::<2>(Space::PlaneStrain, bulk).law(), small).unwrap();
    let exact = 0.5 * (1.0 - poisson * poisson) * small * small / youngs;
    near("energy_at_strength_plane_strain", plane / exact, 1.0, 2e-4);
    let long = EightChainSolid::<2>::new(Space::PlaneStress, 1.0, 1e9, f64::INFINITY).unwrap();
    let stretch: f64 = 1.8;
    let sheet = energy_at_strength(&long, stretch - stretch.powi(-2)).unwrap();
    near("energy_at_strength_sheet", sheet, 0.5 * (stretch.powi(2) + 2.0 / stretch - 3.0), 1e-6);
    assert!(energy_at_strength(&long, 1e9).is_none());
}

/// Pulls a strip at small strains and returns the peak of the mean stress over the strength. Bonds that end
/// in the middle row have the integrity `weak` at the start.
fn strip(rows: usize, ductility: f64, weak: f64) -> f64 {
    let spacing = 1.0 / rows as f64;
    let body = Body::<2>::solid([3 * rows, rows], spacing, 3.015);
    let mut built = body.build();
    let bonds = &mut built.lattice;
    let (solid, strength) = (neo_hooke::<2>(Space::PlaneStrain, 5.0 / 3.0), 1e-3);
    let onset = energy_at_strength(solid.law(), strength).unwrap();
    let law = Bilinear { onset, limit: ductility * onset };
    let grip = 6.0 * spacing;
    // the uniform state has (1 − ν²)σ/E = 3.75e-4 at the strength
    let loads = hold(bonds, |[x, _]| match x {
        x if x < grip => Some((1, [0.0; 2])),
        x if x > 3.0 - grip => Some((1, [4.4e-4 * (3.0 - 2.0 * grip), 0.0])),
        _ => None,
    });
    let mut state = State::new(bonds.sites());
    if weak < 1.0 {
        // (e_f − e)/[e(e_f − 1)] = d
        let e = ductility / (1.0 + weak * (ductility - 1.0));
        let row = |site: usize| (bonds.position(site)[0] - 1.5 - 0.5 * spacing).abs() < 0.1 * spacing;
        for &site in bonds.particles() {
            bonds.neighbours(site as usize, &mut |bond| {
                if row(site as usize) || row(bond.site) {
                    let (greatest, integrity) = (e * e * onset, weak);
                    state.fracture.softened.push(Softened { site, index: bond.index, greatest, integrity });
                }
            });
        }
    }
    let factors: Vec<f64> = (0..60).map(|k| 0.7 + 0.005 * f64::from(k)).collect();
    let mut system = System::new(bonds, solid, &loads, &factors);
    system.breaking = Some(Breaking { criterion: law.into(), policy: Policy::AtEquilibrium });
    system.stop_below = 0.7;
    let method = Lbfgs { tolerance: 1e-5, ..Default::default() };
    method.solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(())).unwrap();
    for record in &state.history {
        assert!(record.stored + record.released <= 1.01 * record.work, "{record:?}");
    }
    let peak = state.history.iter().fold(0.0_f64, |most, record| most.max(record.load.abs()));
    eprintln!(
        "{rows} rows, e_f {ductility}, weak {weak}: peak/strength {:.4}, {} steps, {} equilibria, {} broken",
        peak / strength,
        state.history.len(),
        state.history.iter().map(|record| record.rounds).sum::<u64>(),
        state.fracture.broken
    );
    assert!(state.fracture.broken > 0);
    peak / strength
}

/// The strength of a strip is that of the uniform state, on two lattices.
#[test]
fn a_strip_has_its_strength() {
    for rows in [10, 20] {
        for (ductility, weak) in [(1.0, 1.0), (4.0, 1.0), (4.0, 0.99)] {
            near("softening_strip_strength", strip(rows, ductility, weak), 0.985, 0.016);
        }
    }
}

/// Tears a notched strip of rubber at finite strains by explicit dynamics or in equilibria.
fn tear(moving: bool, start: Option<&State<2>>, saved: &mut Vec<State<2>>) -> State<2> {
    let mut body = Body::<2>::solid([30, 24], 0.1, 3.015);
    body.slits = vec![Slit { at: 1.2, from: -1.0, to: 1.2 }];
    let mut built = body.build();
    let bonds = &mut built.lattice;
    let solid: NonlocalSolid<EightChainSolid<2>> = rubber(Space::PlaneStrain, 5.0);
    let onset = energy_at_strength(solid.law(), 1.0).unwrap();
    let law = bilinear(bonds, 0.1, onset).unwrap();
    assert!(law.ductility() > 1.5 && law.ductility() < 5.0, "{law:?}");
    let loads = hold(bonds, |[_, y]| match y {
        y if y < 0.3 => Some((3, [0.0; 2])),
        y if y > 2.1 => Some((3, [0.0, 0.6])),
        _ => None,
    });
    let mut state = start.cloned().unwrap_or_else(|| State::new(bonds.sites()));
    let factors: Vec<f64> = (1..=20).map(|k| 0.05 * f64::from(k)).collect();
    let mut system = System::new(bonds, solid, &loads, &factors);
    system.breaking = Some(Breaking { criterion: law.into(), policy: Policy::AtEquilibrium });
    system.stop_below = 0.1;
    let mut seen = 0;
    let mut watch = |status: &Status, state: &State<2>| {
        seen += 1;
        if status.restartable && !state.fracture.softened.is_empty() && (!moving || seen % 50 == 0) {
            saved.push(state.clone());
        }
        Ok(())
    };
    let finished = &mut |_: &dyn Bonds<2>, _: &_| Ok(());
    let solved = if moving {
        let method =
            VelocityVerlet { records: 20, ramp: 10.0, safety: 0.45, ..VelocityVerlet::new(1.0, 10.0) };
        method.solve(&mut system, &mut state, &mut watch, finished)
    } else {
        let method = Lbfgs { tolerance: 1e-5, ..Default::default() };
        method.solve(&mut system, &mut state, &mut watch, finished)
    };
    solved.unwrap();
    state
}

/// Energies balance while a strip softens and tears, and a run resumed from any saved state has equal bits.
#[test]
fn a_softening_strip_tears() {
    for moving in [true, false] {
        let mut saved = Vec::new();
        let whole = tear(moving, None, &mut saved);
        let last = whole.history.last().unwrap();
        let soft: u64 = saved.iter().map(|state| state.fracture.softened.len() as u64).max().unwrap();
        eprintln!(
            "moving {moving}: {} broken, up to {soft} softened, {} evaluations, {} states; work {:.4}, \
             stored {:.4}, released {:.4}, kinetic {:.4}",
            last.broken,
            whole.counts.evaluations,
            saved.len(),
            last.work,
            last.stored,
            last.released,
            last.kinetic
        );
        assert!(last.broken > 0 && soft > 0 && !whole.history.is_empty());
        for record in &whole.history {
            let held = record.stored + record.released + record.kinetic;
            if moving {
                at_most("softening_energy_balance", (held / record.work - 1.0).abs(), 0.01);
            } else {
                assert!(held <= 1.01 * record.work, "{record:?}");
            }
        }
        for state in saved.iter().step_by(saved.len().div_ceil(3)) {
            let again = tear(moving, Some(state), &mut Vec::new());
            assert!(again == whole, "{moving}: from step {}, round {}", state.step, state.control.round);
        }
    }
}

/// Every bond releases Y = W in a uniform state, so that the strength surface of softening bonds under
/// several stresses is W = Y₀. Small strains at ν = 0.4995: an equibiaxial strength of σ_ts/√(2(1 − ν)), and
/// a hydrostatic one of σ_ts/√(3(1 − 2ν)) = 18.3 σ_ts.
#[test]
fn the_strength_surface_is_one_of_equal_energy() {
    let poisson = 0.4995_f64;
    let bulk = 2.0 * (1.0 + poisson) / (3.0 * (1.0 - 2.0 * poisson));
    let solid = neo_hooke::<3>(Space::Solid, bulk);
    let bonds = Body::<3>::solid([7, 7, 4], 1.0, 3.015).build().lattice;
    // strains, the greatest principal stress over E
    let young = 2.0 * (1.0 + poisson);
    let lateral = -2.0 * poisson / (1.0 - poisson);
    let states = [
        ("uniaxial", [1.0, -poisson, -poisson], 1.0),
        ("equibiaxial", [1.0, 1.0, lateral], 1.0 / (1.0 - poisson)),
        ("hydrostatic", [1.0; 3], 1.0 / (1.0 - 2.0 * poisson)),
    ];
    let mut strengths = Vec::new();
    for (name, strains, stress) in states {
        let size = 1e-6 / stress;
        let mut displacement = Field::zeros(bonds.sites());
        for &site in bonds.particles() {
            let place = bonds.position(site as usize);
            displacement.set(site as usize, std::array::from_fn(|d| size * strains[d] * place[d]));
        }
        let mut material = peri::material::Pointwise::new(solid.clone(), &bonds);
        material.prepare(&bonds, &displacement);
        let mut spread = [f64::INFINITY, 0.0];
        for &site in bonds.particles() {
            let family = peri::material::Family::new(&bonds, &displacement, site as usize);
            let point = &material.points()[site as usize];
            let energy = solid.energy(&family, point);
            family.each(|bond| {
                let released = solid.released_energy(&bond, point, energy).unwrap();
                spread = [spread[0].min(released), spread[1].max(released)];
            });
        }
        at_most(&format!("strength_surface_{name}_spread"), spread[1] / spread[0] - 1.0, 1e-5);
        // the principal stress 1e-6 E at W; the strength where W = Y₀ goes with the root
        strengths.push(1e-6 * young / spread[1].sqrt());
    }
    near(
        "strength_equibiaxial_over_uniaxial",
        strengths[1] / strengths[0],
        1.0 / (2.0 * (1.0 - poisson)).sqrt(),
        1e-4,
    );
    near("strength_hydrostatic_over_uniaxial", strengths[2] / strengths[0], 18.257, 1e-3);
}

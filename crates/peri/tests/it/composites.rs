//! Bodies whose parts have bond laws of their own.

use crate::bodies::{Body, MODULUS, Random, hold, rms, scatter};
use crate::dynamics::DENSITY;
use crate::materials::battery;
use evidence::{at_most, near};
use peri::Error;
use peri::bonds::{BodyGeometry, BondDamage, Bonds, LawShares, Property, covered_stretches, stretch_range};
use peri::contact::RigidSurface;
use peri::correction::{bond_factors, surface_factors};
use peri::critical::Convention;
use peri::field::{CHUNK, Field};
use peri::geometry::Shape;
use peri::material::{BondMaterial, LawCover, Material, PartLaw, Pointwise, SolverMaterial, virial};
use peri::model::{self, CompositeRubber, Model, Rubber};
use peri::potential::{BondPotential, Law, LinearBond};
use peri::solver::{Breaking, Lbfgs, Method, Policy, State, StepRecord, System, VelocityVerlet};
use peri::stress::{BallVolume, BondFits, StressInput, StressMethod, SurfaceCompensation, piola};
use std::sync::Arc;

/// Gives the particles of a body the laws in turn, with several stiffnesses.
fn composite<const D: usize>(bonds: &dyn Bonds<D>, laws: &[Arc<dyn BondPotential>]) -> BondMaterial<'static> {
    let of = |site: usize, _| (site % laws.len(), 1.0 + 0.5 * (site % 5) as f64);
    let shares = LawShares::new(bonds, laws.len(), of).unwrap();
    BondMaterial::new(laws[0].clone(), MODULUS)
        .with_parts(laws[1..].iter().map(part).collect(), Arc::new(shares))
        .unwrap()
}

fn part(law: &Arc<dyn BondPotential>) -> PartLaw<'static> {
    PartLaw { part: "part".to_owned(), law: law.clone() }
}

fn chain(links: f64) -> Arc<dyn BondPotential> {
    Arc::from(Law::ChainOffset.build(links, 1200.0, false).unwrap())
}

/// Returns the forces of a material in a displacement, N/m³, and its energy, J.
fn response<const D: usize>(
    material: &mut dyn SolverMaterial<D>,
    bonds: &mut dyn Bonds<D>,
    displacement: &Field<D>,
) -> (Vec<[f64; D]>, f64) {
    let stretches = covered_stretches(bonds, displacement);
    let cover = LawCover { stretches, bound: 1e-9, clamped: false, known: None };
    material.cover(bonds, displacement, &cover).unwrap();
    bonds.prepare(displacement);
    material.prepare(bonds, displacement);
    let mut forces = Field::zeros(bonds.sites());
    for (chunk, mut out) in forces.chunks_mut().into_iter().enumerate() {
        material.force(bonds, displacement, chunk * CHUNK, &mut out, None);
    }
    let observed = stretch_range(bonds, displacement);
    let energy = material.energy(bonds, displacement, observed);
    (bonds.particles().iter().map(|&site| forces.get(site as usize)).collect(), energy)
}

/// Three laws, of particles in turn, pass the checks of all materials, also past the greatest force of the
/// short chains.
#[test]
fn several_laws_pass() {
    let all: [Arc<dyn BondPotential>; 3] = [chain(720.0), Arc::new(LinearBond), chain(9.0)];
    battery::<2>("three laws", [8, 7], &|bonds| composite(bonds, &all).respond(bonds));
    battery::<3>("three laws", [4, 4, 3], &|bonds| composite(bonds, &all).respond(bonds));
    battery::<2>("three laws by loops", [8, 7], &|bonds| {
        Box::new(Pointwise::new(composite(bonds, &all), bonds))
    });
}

/// Compares forces and energies of two materials.
fn compare(
    name: &str,
    bonds: &mut dyn Bonds<2>,
    displacement: &Field<2>,
    [one, other]: [&mut dyn SolverMaterial<2>; 2],
    bound: f64,
) {
    let (found, energy) = response(one, bonds, displacement);
    let (expected, stored) = response(other, bonds, displacement);
    let difference = |(a, b): (&[f64; 2], &[f64; 2])| [a[0] - b[0], a[1] - b[1]];
    let differences: Vec<[f64; 2]> = found.iter().zip(&expected).map(difference).collect();
    let error = rms(&differences) / rms(&expected);
    assert!(error < bound, "{name}: forces {error:e}");
    assert!((energy / stored - 1.0).abs() < bound, "{name}: {energy} {stored}");
}

/// Forces and energy of the kernels are those of plain loops with the laws themselves, to the bound of the
/// fit. Parts of one law have those of a body of one law, to rounding.
#[test]
fn kernels_and_loops_agree() {
    let mut built = Body::<2>::damaged([12, 9], 0.1, 3.015).build();
    let moved = Random(11).vectors::<2>(built.points.len(), 0.02);
    let cases = [
        ("lattice", &mut built.lattice as &mut dyn Bonds<2>, &built.on_lattice),
        ("cloud", &mut built.cloud, &built.in_cloud),
    ];
    for (name, bonds, sites) in cases {
        let displacement = scatter(bonds.sites(), sites, &moved);
        let several = composite(bonds, &[chain(720.0), Arc::new(LinearBond), chain(9.0)]);
        let mut kernels = Material::<2>::respond(several.clone(), bonds);
        let mut loops = Pointwise::new(several, bonds);
        compare(name, bonds, &displacement, [&mut *kernels, &mut loops], 1e-8);
        let alike = composite(bonds, &[chain(25.0), chain(25.0)]);
        let mut kernels = Material::<2>::respond(alike, bonds);
        let mut one = Material::<2>::respond(BondMaterial::new(chain(25.0), MODULUS), bonds);
        compare(name, bonds, &displacement, [&mut *kernels, &mut *one], 1e-12);
    }
}

/// Forces and energy of the kernels are those of plain loops with factors of bonds: stiffness alone, for
/// which passes take the mean of both ends, surface corrections, and both.
#[test]
fn kernels_and_loops_agree_with_factors() {
    let moved = Random(12).vectors::<2>(108, 0.02);
    for (name, corrected, stiffer) in
        [("stiffness", false, true), ("surface", true, false), ("surface and stiffness", true, true)]
    {
        let mut built = Body::<2>::damaged([12, 9], 0.1, 3.015).build();
        let cases = [
            ("lattice", &mut built.lattice as &mut dyn Bonds<2>, &built.on_lattice),
            ("cloud", &mut built.cloud, &built.in_cloud),
        ];
        for (kind, bonds, sites) in cases {
            let of = |x: [f64; 2]| if stiffer && x[0] > 0.5 { 3.0 } else { 1.0 };
            let micromodulus = Property::new(bonds, |_, x| of(x));
            let surface = corrected.then(|| surface_factors(bonds, MODULUS, 1.0));
            if let Some(factors) = bond_factors(bonds, surface, &micromodulus) {
                bonds.set_factors(factors);
            }
            let laws = [chain(720.0), Arc::new(LinearBond), chain(9.0)];
            let number = |x: [f64; 2]| (5.0 * x[0]) as usize % 3;
            let shares = LawShares::new(bonds, 3, |_, x| (number(x), of(x))).unwrap();
            let parts = laws[1..].iter().map(part).collect();
            let several = BondMaterial::new(laws[0].clone(), MODULUS).with_parts(parts, Arc::new(shares));
            let several = several.unwrap();
            let displacement = scatter(bonds.sites(), sites, &moved);
            let mut loops = Pointwise::new(several.clone(), bonds);
            let mut kernels = Material::<2>::respond(several, bonds);
            compare(&format!("{kind}, {name}"), bonds, &displacement, [&mut *kernels, &mut loops], 1e-8);
        }
    }
}

/// Σ V P over the particles is the virial of the laws, by all measures that share bonds out.
#[test]
fn stresses_sum_to_the_virial() {
    let built = Body::<2>::solid([11, 9], 0.1, 3.015).build();
    let moved = Random(5).vectors::<2>(built.points.len(), 0.01);
    let cases = [
        (&built.lattice as &dyn Bonds<2>, &built.on_lattice, vec![StressMethod::OnePoint]),
        (&built.cloud, &built.in_cloud, vec![StressMethod::OnePoint, StressMethod::Hardy]),
    ];
    for (bonds, sites, measures) in cases {
        let displacement = scatter(bonds.sites(), sites, &moved);
        let material = composite(bonds, &[chain(720.0), Arc::new(LinearBond), chain(9.0)]);
        let fits = material.fits(covered_stretches(bonds, &displacement), 1e-9).unwrap();
        let (fit, missing) =
            (BondFits::new(&fits, material.shares(), bonds.sites()).unwrap(), SurfaceCompensation::Bonds);
        let state = StressInput { displacement: &displacement, fit, modulus: MODULUS, missing };
        let expected = virial(&material, &vec![(); bonds.sites()], bonds, &displacement);
        for measure in measures {
            let found = piola(bonds, &state, measure, BallVolume::Particles);
            for (a, b) in [(0, 0), (0, 1), (1, 1)] {
                let each = bonds.particles().iter().zip(&found);
                let sum: f64 = each.map(|(&site, p)| bonds.volume(site as usize) * p[a][b]).sum();
                let scale = expected[0][0].abs().max(expected[1][1].abs());
                let error = (sum - expected[a][b]).abs() / scale;
                assert!(error < 1e-7, "{measure:?} {a}{b}: {sum} {}", expected[a][b]);
            }
        }
    }
}

/// Two rubbers, side by side between grips: with the same law those of one; with shorter chains stiffer, by
/// less than a body of short chains alone.
#[test]
fn models_of_two_rubbers() {
    let body = || model::Body::lattice(Shape::rectangle([0.0; 2], [20e-3, 10e-3]), 1e-3).plane_stress(1e-3);
    let pulled = |part: Rubber, everywhere: bool| {
        let rest = Rubber::new(Law::ChainOffset, 1e6).chains(50.0, 1000.0);
        let rubber = CompositeRubber::new(rest).add_part(move |[x, _]| everywhere || x > 10e-3, part);
        let model = Model::new(body(), rubber).clamp(|[x, _]| x < 3e-3);
        let mut model = model.displace(|[x, _]| x > 17e-3, [10e-3, 0.0]).build().unwrap();
        model.solve(Lbfgs { tolerance: 1e-8, ..Lbfgs::default() }).unwrap();
        model.history()[0].load
    };
    let long = || Rubber::new(Law::ChainOffset, 1e6).chains(50.0, 1000.0);
    let short = || Rubber::new(Law::ChainOffset, 1e6).chains(6.0, 1000.0);
    let one = {
        let model = Model::new(body(), long()).clamp(|[x, _]| x < 3e-3);
        let mut model = model.displace(|[x, _]| x > 17e-3, [10e-3, 0.0]).build().unwrap();
        model.solve(Lbfgs { tolerance: 1e-8, ..Lbfgs::default() }).unwrap();
        model.history()[0].load
    };
    near("composite_of_one_rubber", pulled(long(), false) / one, 1.0, 1e-6);
    let [half, whole] = [false, true].map(|everywhere| pulled(short(), everywhere));
    assert!(1.01 * one < half && half < 0.99 * whole, "{one} {half} {whole}");
}

/// Laws that no particle has, particles with laws that do not exist, and limits of single parts are refused.
#[test]
fn composites_that_cannot_be() {
    let built = Body::<2>::solid([6, 6], 0.1, 3.015).build();
    let shares = LawShares::new(&built.lattice, 2, |_, _| (0, 1.0)).unwrap();
    let one = BondMaterial::new(LinearBond, MODULUS);
    assert!(matches!(one.with_parts(Vec::new(), Arc::new(shares)), Err(Error::Parameter { .. })));
    for wrong in [(2, 1.0), (0, 0.0), (1, f64::NAN)] {
        assert!(LawShares::new(&built.lattice, 2, |_, _| wrong).is_err(), "{wrong:?}");
    }
    let body = model::Body::lattice(Shape::rectangle([0.0; 2], [8e-3, 8e-3]), 1e-3);
    let rubber = || Rubber::new(Law::Linear, 1e6);
    let build = |composite: CompositeRubber<2>| Model::new(body.clone(), composite).build().map(drop);
    let outside = build(CompositeRubber::new(rubber()).add_part(|[x, _]| x > 1.0, rubber()));
    assert!(outside.unwrap_err().to_string().contains("part 1 of the rubber has no particle"));
    let limited = CompositeRubber::new(rubber()).add_part(|[x, _]| x > 4e-3, rubber().critical_stretch(2.0));
    assert!(build(limited).unwrap_err().to_string().contains("critical stretch of part 1"));
    let softening = rubber().fracture_energy_by(Convention::Softening, 100.0);
    let softening = CompositeRubber::new(softening).add_part(|[x, _]| x > 4e-3, rubber());
    assert!(build(softening).unwrap_err().to_string().contains("bonds that soften"));
}

/// Shares of another body are refused, and a law that no fit holds is named by its part.
#[test]
fn errors_of_laws_name_them() {
    let mut built = Body::<2>::solid([12, 9], 0.1, 3.015).build();
    let small = Body::<2>::solid([6, 6], 0.1, 3.015).build();
    let displacement = Field::zeros(built.lattice.sites());
    let material = composite(&small.lattice, &[chain(25.0), chain(9.0)]);
    let cover = LawCover { stretches: [0.9, 1.1], bound: 1e-9, clamped: false, known: None };
    let found = Material::<2>::respond(material.clone(), &built.lattice)
        .cover(&mut built.lattice, &displacement, &cover)
        .unwrap_err();
    assert!(found.to_string().contains("those of another body"), "{found}");
    let fits = material.fits([0.9, 1.1], 1e-9).unwrap();
    assert!(BondFits::new(&fits, material.shares(), built.lattice.sites()).is_err());
    // the force of a chain falls to nothing far beyond its length
    let found = composite(&built.lattice, &[chain(720.0), chain(2.0)]).fits([0.5, f64::NAN], 1e-9);
    let found = found.map(drop).unwrap_err().to_string();
    assert!(found.contains("bond law of the rest of the body: "), "{found}");
}

/// A plane pushes a body of one law as hard as the same body that has this law as a part.
#[test]
fn contact_has_the_stiffness_of_each_law() {
    let pushed = |rubber: CompositeRubber<2>| {
        let body = model::Body::lattice(Shape::rectangle([0.0; 2], [8e-3, 8e-3]), 1e-3);
        let mut plane = RigidSurface::plane([0.0; 2], [0.0, 1.0]);
        plane.displacement = [0.0, 0.4e-3];
        let mut model =
            Model::new(body, rubber).clamp(|[_, y]| y > 7e-3).rigid_surface(plane).build().unwrap();
        model.solve(Lbfgs { tolerance: 1e-9, ..Lbfgs::default() }).unwrap();
        model.history()[0].resting[0].force[1]
    };
    let [soft, hard] = [1e6, 1e8].map(|modulus| Rubber::new(Law::Linear, modulus));
    let whole = pushed(CompositeRubber::new(hard.clone()));
    let part = pushed(CompositeRubber::new(soft).add_part(|_| true, hard));
    near("contact_of_a_part_of_the_whole_body", part / whole, 1.0, 1e-6);
}

/// Strips of two parts with equal laws tear at the same bonds as a strip of this law, and their ledgers
/// close: stored, kinetic and released energy are the work done, also if the parts have different laws.
#[test]
fn parts_break_and_their_ledger_closes() {
    let torn = |other: Option<f64>, end: f64| {
        let mut built = Body::<2>::damaged([24, 20], 0.1, 3.015).build();
        let bonds = &mut built.lattice;
        let loads = hold(bonds, |x| {
            (x[0] < 0.3 || x[0] > 2.1).then(|| (3, if x[0] < 0.3 { [0.0; 2] } else { [0.25, 0.05] }))
        });
        let mut material = BondMaterial::new(chain(100.0), MODULUS);
        if let Some(links) = other {
            let shares = LawShares::new(bonds, 2, |_, x| (usize::from(x[0] > 1.2), 1.0)).unwrap();
            material = material.with_parts(vec![part(&chain(links))], Arc::new(shares)).unwrap();
        }
        let mut state = State::new(bonds.sites());
        let solver = VelocityVerlet { ramp: 0.5 * end, records: 50, ..VelocityVerlet::new(DENSITY, end) };
        let mut system = System::new(bonds, material, &loads, &[]);
        system.breaking = Some(Breaking { criterion: 1.2.into(), policy: Policy::EachIteration });
        solver.solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(())).unwrap();
        let scale = state.history.iter().map(|row| row.work.abs()).fold(0.0, f64::max);
        let off = |row: &StepRecord| (row.kinetic + row.stored + row.released - row.work).abs() / scale;
        let worst = state.history.iter().map(off).fold(0.0, f64::max);
        drop(system);
        (bonds.intact(), state, worst)
    };
    let end = 200.0 * torn(None, 1e-9).1.motion.limits.critical_step;
    let (one, state, _) = torn(None, end);
    let (alike, _, worst) = torn(Some(100.0), end);
    let broken = state.fracture.broken;
    assert!(one == alike && broken > 50, "{broken} broken");
    // as of one law at 0.9 of the critical step, see `energies_balance`
    at_most("ledger_of_equal_parts", worst, 0.03);
    let (_, state, worst) = torn(Some(9.0), end);
    assert!(state.fracture.broken > 0);
    at_most("ledger_of_parts", worst, 0.03);
}

//! Lattices on a device, compared with the kernel of the host.

#[path = "it/bodies.rs"]
#[allow(dead_code)] // shared by all tests
mod bodies;

use bodies::{Body, MODULUS, Random, Slit, fit, hold, laws, norm};
use peri::Error;
use peri::bonds::{
    BodyGeometry, BondDamage, BondForces, Bonds, Lattice, LatticeBonds, VolumeCorrection, force,
    overstretched, stretch_range,
};
use peri::field::Field;
use peri::gpu::{Device, DeviceBody, Precision};
use peri::material::BondMaterial;
use peri::potential::{KernelFit, Law};
use peri::solver::{Breaking, Loads, Method, Policy, State, Status, System, VelocityVerlet};
use peri::stress::{BallVolume, StressInput, StressMethod, SurfaceCompensation};

const DENSITY: f64 = 2.3;

/// Returns every precision of this machine's device; reports a skipped test without a device.
#[track_caller]
fn devices() -> Vec<Device> {
    let open = |precision| Device::portable()?.with_precision(precision);
    let found: Vec<Device> = [Precision::Single, Precision::Double].map(open).into_iter().flatten().collect();
    if found.is_empty() {
        evidence::skipped(
            "a device behind Vulkan, Metal or DirectX 12 (a program that stands for one: \
             mesa-vulkan-drivers)",
        );
    }
    found
}

fn random<const D: usize>(bonds: &LatticeBonds<D>, size: f64) -> Field<D> {
    let mut field = Field::zeros(bonds.sites());
    let mut numbers = Random(11);
    for &site in bonds.particles() {
        field.set(site as usize, std::array::from_fn(|_| size * bonds.spacing() * numbers.next()));
    }
    field
}

/// A body with two slits and a hole, without corrections.
fn damaged<const D: usize>(cells: [usize; D]) -> LatticeBonds<D> {
    Body { surface: None, ..Body::damaged(cells, 1e-3, 3.015) }.build().lattice
}

/// What rounding of displacements, of the law and of sums may make of a particle's force: with c = 2kθ w
/// V/|ξ| and the rounding ε|ξ + η|(|u_I| + |u_J|) of E, of which q is a function, Σ_J c (|q| + |q′| |δE|/ε +
/// |q|)|ζ|.
fn sizes<const D: usize>(bonds: &LatticeBonds<D>, law: &KernelFit, u: &Field<D>) -> Vec<f64> {
    let of = |site: u32| {
        let mut size = 0.0;
        bonds.neighbours(site as usize, &mut |bond| {
            let (own, other) = (u.get(site as usize), u.get(bond.site));
            let zeta: [f64; D] = std::array::from_fn(|d| bond.bond[d] + other[d] - own[d]);
            let square = bond.length * bond.length;
            let e = zeta.iter().map(|x| x * x).sum::<f64>() / square - 1.0;
            let mut rounded = (norm(own) + norm(other)) * (norm(zeta) + bond.length) / square;
            let mut slope = (law.value(e + 1e-5) - law.value(e - 1e-5)).abs() / 2e-5;
            let end = e.clamp(law.clamp[0], law.clamp[1]);
            if end != e {
                // q at the end of the law: e there, its strain and the node are rounded
                rounded = 3.0 * end.abs();
                slope = (law.value(end) - law.value(end - 1e-5 * (e - end).signum())).abs() / 1e-5;
            }
            let c = 2.0 * MODULUS * bond.weight / bond.length;
            size += c * norm(zeta) * (law.value(e).abs() + slope * rounded);
        });
        size
    };
    bonds.particles().iter().map(|&site| of(site)).collect()
}

fn compare_forces<const D: usize>(device: &Device, what: &str, mut bonds: LatticeBonds<D>) {
    let u = random(&bonds, 0.05);
    let all = bonds.directed_bonds();
    bonds.break_bonds(&overstretched(&bonds, &u, &1.05.into(), &peri::bonds::StretchScan::default()));
    assert!(bonds.directed_bonds() < all);
    let range = stretch_range(&bonds, &u);
    let range = [range.low, range.high].map(|e| (1.0 + e).sqrt()).map(|l| l + 1e-3 * (l - 1.0).signum());
    for (law, potential) in laws() {
        let name = format!("{D}D {what}, {} forces", law.name());
        compare_law(device, &name, &mut bonds, (&fit(&*potential, range), &u));
    }
}

fn compare_law<const D: usize>(
    device: &Device,
    name: &str,
    bonds: &mut LatticeBonds<D>,
    (fit, u): (&KernelFit, &Field<D>),
) {
    bonds.set_law(fit, MODULUS);
    let mut expected = Field::zeros(bonds.sites());
    force(bonds, u, &mut expected);
    let found = DeviceBody::new(device, bonds, fit, MODULUS).unwrap().force(bonds, u).unwrap();
    let sizes = sizes(bonds, fit, u);
    let mut worst = 0.0_f64;
    for (&site, size) in bonds.particles().iter().zip(sizes) {
        let (found, expected) = (found.get(site as usize), expected.get(site as usize));
        let apart = norm::<D>(std::array::from_fn(|d| found[d] - expected[d]));
        // a particle without bonds has neither
        worst = worst.max(if apart == 0.0 { 0.0 } else { apart / (size * device.precision().epsilon()) });
    }
    // a bond's force is rounded in ten to fifty operations, each by up to ½ε, in directions that have nothing
    // in common
    let name = format!("{name} of {} in {:?}", device.name(), device.precision());
    eprintln!("{name}: {worst:.2} ε Σ|f|");
    evidence::at_most(&name, worst, 4.0);
}

/// A law across the knee of the chain force, which only a table represents, up to the knee and beyond the
/// table's ends.
#[test]
fn gpu_forces_of_a_table_are_those_of_the_host() {
    fn compare<const D: usize>(device: &Device, cells: [usize; D]) {
        let law = Law::ChainOffset.build(720.0, 1200.0, false).unwrap();
        for (stretch, range) in [(1.0, [0.3, 33.0]), (25.0, [0.3, 33.0]), (40.0, [0.9, 33.0])] {
            let fit = KernelFit::new(&*law, range, 1e-9).unwrap();
            assert!(!fit.nodes().is_empty(), "{}", fit.kind());
            for (what, mut bonds) in bodies(cells) {
                let mut u = random(&bonds, 0.05 * stretch);
                for site in bonds.particles().to_vec() {
                    let (x, random) = (bonds.position(site as usize), u.get(site as usize));
                    let moved = std::array::from_fn(|d| (stretch - 1.0) * x[d] + random[d]);
                    u.set(site as usize, moved);
                }
                for fit in [fit.clone(), fit.clone().clamped()] {
                    let name = format!("{D}D {what}, table at {stretch}");
                    compare_law(device, &name, &mut bonds, (&fit, &u));
                }
            }
        }
    }
    for device in devices() {
        compare::<2>(&device, [31, 26]);
        compare::<3>(&device, [13, 12, 9]);
    }
}

/// Bodies whose bonds have the stencil's weights, and factors of their ends: along each axis, or one.
fn bodies<const D: usize>(cells: [usize; D]) -> [(&'static str, LatticeBonds<D>); 3] {
    let corrected = Body::damaged(cells, 1e-3, 3.015).build().lattice;
    let mut filled = damaged(cells);
    let mut factors = Field::zeros(filled.sites());
    for &site in filled.particles() {
        let inside = filled.position(site as usize)[0] < 7e-3;
        factors.set(site as usize, [if inside { 3.0 } else { 1.0 }; D]);
    }
    filled.set_factors(factors);
    [("plain", damaged(cells)), ("surface correction", corrected), ("inclusion", filled)]
}

#[test]
fn gpu_forces_are_those_of_the_host() {
    for device in devices() {
        for (what, bonds) in bodies([31, 26]) {
            compare_forces::<2>(&device, what, bonds);
        }
        for (what, bonds) in bodies([13, 12, 9]) {
            compare_forces::<3>(&device, what, bonds);
        }
    }
}

/// Stresses by every measure, of damaged bodies under surface compensation of both kinds.
#[test]
fn gpu_stresses_are_those_of_the_host() {
    fn compare<const D: usize>(device: &Device, cells: [usize; D], measures: &[StressMethod]) {
        for (what, mut bonds) in bodies(cells) {
            let u = random(&bonds, 0.05);
            let scan = peri::bonds::StretchScan::default();
            bonds.break_bonds(&overstretched(&bonds, &u, &1.05.into(), &scan));
            let law = fit(&*Law::ChainOffset.build(720.0, 1200.0, false).unwrap(), [0.7, 1.3]);
            let marked: Vec<bool> = (0..bonds.sites()).map(|site| site % 3 == 0).collect();
            let state = StressInput {
                displacement: &u,
                fit: (&law).into(),
                modulus: MODULUS,
                missing: SurfaceCompensation::WindowAt(&marked),
            };
            let host = peri::stress::piolas(&bonds, &state, measures, BallVolume::Cells);
            let found = peri::gpu::piolas(device, &bonds, &state, measures, BallVolume::Cells).unwrap();
            for ((measure, host), found) in measures.iter().zip(host).zip(found) {
                let pairs = host.piola.iter().flatten().flatten().zip(found.piola.iter().flatten().flatten());
                let (mut apart, mut most) = (0.0_f64, 0.0_f64);
                for (host, found) in pairs {
                    (apart, most) = (apart.max((host - found).abs()), most.max(host.abs()));
                }
                let name = format!("{D}D {what}, {} of {}", measure.name(), device.name());
                eprintln!("{name} in {:?}: {:.1e} of the largest", device.precision(), apart / most);
                // sums over some thousand taps
                let bound = 20.0 * device.precision().epsilon();
                evidence::at_most(&name, apart / most, bound);
                assert!(most > 0.0 && found.piola.len() == bonds.particles().len());
            }
        }
    }
    for device in devices() {
        compare::<2>(&device, [31, 26], &StressMethod::ALL);
        compare::<3>(&device, [13, 12, 9], &[StressMethod::Hardy, StressMethod::OnePoint]);
    }
}

/// A run of a system, by the host or on a device: the state at the end, and the bonds intact and broken after
/// each row of history.
struct Ran<const D: usize> {
    state: State<D>,
    rows: Vec<(Vec<u64>, u64)>,
}

/// Loads, what breaks, and settings of a run.
struct Case<const D: usize> {
    loads: Loads<D>,
    velocity: Field<D>,
    critical: Option<f64>,
    solver: VelocityVerlet,
    law: Law,
}

impl<const D: usize> Case<D> {
    fn run(&self, bonds: &mut LatticeBonds<D>, device: Option<&Device>) -> Result<Ran<D>, Error> {
        let law = self.law.build(720.0, 1200.0, false).unwrap();
        let mut state = State::new(bonds.sites());
        state.velocity = self.velocity.clone();
        let mut rows = Vec::new();
        let mut system = System::new(bonds, BondMaterial::new(&*law, MODULUS), &self.loads, &[]);
        system.breaking =
            self.critical.map(|stretch| Breaking { criterion: stretch.into(), policy: Policy::default() });
        let mut finished = |bonds: &dyn Bonds<D>, state: &State<D>| {
            rows.push((bonds.intact(), state.fracture.broken));
            Ok(())
        };
        let watch = &mut |_: &Status, _: &State<D>| Ok(());
        match device {
            Some(device) => self.solver.solve_on(device, &mut system, &mut state, watch, &mut finished)?,
            None => self.solver.solve(&mut system, &mut state, watch, &mut finished)?,
        }
        Ok(Ran { state, rows })
    }

    /// Compares a run on a device with the host's: the same bonds break in the same row of history, and in
    /// double precision in the same step; energies and displacements agree to `allowed` times the host's
    /// greatest.
    fn compare(&self, name: &str, device: &Device, build: &dyn Fn() -> LatticeBonds<D>, allowed: f64) {
        let host = self.run(&mut build(), None).unwrap();
        let found = self.run(&mut build(), Some(device)).unwrap();
        assert_eq!(found.state.counts.total_iterations, host.state.counts.total_iterations, "steps");
        let same = found.rows == host.rows && found.state.fracture.events == host.state.fracture.events;
        let name = format!("{name} on {} in {:?}", device.name(), device.precision());
        if !same {
            let events = found.state.fracture.events.iter().zip(&host.state.fracture.events);
            let first = events.enumerate().find(|(_, (a, b))| a != b);
            eprintln!(
                "{name}: {} and {} bonds, first difference {first:?}",
                found.state.fracture.broken, host.state.fracture.broken
            );
        }
        assert!(same || device.precision() == Precision::Single, "{name}: other bonds broke");
        if !same {
            return;
        }
        let fields = [
            ("displacement", &found.state.displacement, &host.state.displacement),
            ("velocity", &found.state.velocity, &host.state.velocity),
            ("force", &found.state.force, &host.state.force),
        ];
        for (what, found, host) in fields {
            let components = || host.components().into_iter().flatten();
            let greatest = components().fold(0.0_f64, |most, x| most.max(x.abs()));
            let pairs = found.components().into_iter().flatten().zip(components());
            let apart = pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
            eprintln!("{name}, {what}: {:.1e} of the greatest", apart / greatest);
            evidence::at_most(&format!("{name}, {what}"), apart / greatest, allowed);
        }
        for (found, host) in found.state.history.iter().zip(&host.state.history) {
            let turned = host.work.abs().max(host.stored).max(host.kinetic).max(f64::MIN_POSITIVE);
            for (what, a, b) in [
                ("work", found.work, host.work),
                ("kinetic", found.kinetic, host.kinetic),
                ("stored", found.stored, host.stored),
                ("released", found.released, host.released),
                ("damped", found.damped, host.damped),
            ] {
                let apart = (a - b).abs() / turned;
                assert!(apart <= allowed, "{name}, {what} at {} s: {a:e} {b:e}", host.time);
            }
        }
        eprintln!(
            "{name}: {} steps, {} bonds broke",
            host.state.counts.total_iterations, host.state.fracture.broken
        );
    }
}

/// Precision of results, over that of numbers: rounding of steps that follow each other, and of sums.
const ROUNDINGS: f64 = 3000.0;

/// A slit sheet or block, torn by ends that move apart: bonds break beside slits and hole.
fn compare_tearing<const D: usize>(device: &Device, cells: [usize; D], critical: f64) {
    let build = || damaged(cells);
    let bonds = build();
    let length = cells[1] as f64 * 1e-3;
    let held = |x: [f64; D]| x[1] < 3e-3 || x[1] > length - 3e-3;
    let end = |x: [f64; D]| {
        let mut full = [0.0; D];
        full[1] = 0.06 * (x[1] - 0.5 * length);
        full
    };
    let loads = hold(&bonds, |x| held(x).then(|| ((1 << D) - 1, end(x))));
    let law = Law::ChainOffset.build(720.0, 1200.0, false).unwrap();
    // ρ at which the ends part in some hundred steps
    let stiffness = bonds.particles().iter().map(|&site| {
        let mut sum = 0.0;
        bonds.neighbours(site as usize, &mut |bond| {
            sum += 2.0 * MODULUS * law.tangent() * bond.weight / bond.length;
        });
        sum
    });
    let step = (DENSITY / (2.0 * stiffness.fold(0.0, f64::max))).sqrt();
    let end_time = 150.0 * step;
    let plain = VelocityVerlet::new(DENSITY, end_time);
    let solver = VelocityVerlet { ramp: end_time, records: 6, damping: 0.02 / step, ..plain };
    let velocity = Field::zeros(bonds.sites());
    let case = Case { loads, velocity, critical: Some(critical), solver, law: Law::ChainOffset };
    let host = case.run(&mut build(), None).unwrap();
    assert!(host.state.fracture.broken > 10, "{} bonds broke", host.state.fracture.broken);
    case.compare(&format!("{D}D tearing"), device, &build, ROUNDINGS * device.precision().epsilon());
}

#[test]
fn gpu_breaks_the_same_bonds() {
    for device in devices() {
        compare_tearing::<2>(&device, [24, 30], 1.045);
        compare_tearing::<3>(&device, [9, 14, 8], 1.052);
    }
}

/// A small plate of Kalthoff and Winkler's: two notches, hit between them.
#[test]
fn gpu_kalthoff_winkler() {
    for device in devices() {
        let spacing = 1e-3;
        let body = Body::<2> {
            slits: vec![
                Slit { at: 10.0 * spacing, from: -spacing, to: 10.0 * spacing },
                Slit { at: 30.0 * spacing, from: -spacing, to: 10.0 * spacing },
            ],
            ..Body::solid([20, 40], spacing, 3.015)
        };
        let build = || body.build().lattice;
        let bonds = build();
        let hit = |x: [f64; 2]| x[0] < 2.0 * spacing && x[1] > 10.0 * spacing && x[1] < 30.0 * spacing;
        let reach = 3.0 * spacing;
        let loads = hold(&bonds, |x| hit(x).then_some((1, [reach, 0.0])));
        let law = Law::Linear.build(1.0, 1.0, false).unwrap();
        let mut stiffest = 0.0_f64;
        for &site in bonds.particles() {
            let mut sum = 0.0;
            bonds.neighbours(site as usize, &mut |bond| {
                sum += 2.0 * MODULUS * law.tangent() * bond.weight / bond.length;
            });
            stiffest = stiffest.max(sum);
        }
        let step = (DENSITY / (2.0 * stiffest)).sqrt();
        let end_time = 200.0 * step;
        let solver = VelocityVerlet { ramp: end_time, records: 8, ..VelocityVerlet::new(DENSITY, end_time) };
        let velocity = Field::zeros(bonds.sites());
        let case = Case { loads, velocity, critical: Some(1.02), solver, law: Law::Linear };
        let host = case.run(&mut build(), None).unwrap();
        assert!(host.state.fracture.broken > 10, "{} bonds broke", host.state.fracture.broken);
        let allowed = ROUNDINGS * device.precision().epsilon();
        case.compare("Kalthoff-Winkler", &device, &build, allowed);
    }
}

/// An elastic sheet under a body force and from a first velocity: steps are taken together.
#[test]
fn gpu_swings_as_the_host() {
    for device in devices() {
        let build = || Body::<2>::solid([12, 9], 1e-3, 3.015).build().lattice;
        let bonds = build();
        let mut loads = hold(&bonds, |x| (x[0] < 2e-3).then_some((3, [0.0; 2])));
        let mut body = Field::zeros(bonds.sites());
        let mut velocity = Field::zeros(bonds.sites());
        let (scale, mut numbers) = (1e-9, Random(5));
        for &site in bonds.particles() {
            body.set(site as usize, [0.0, scale]);
            velocity.set(site as usize, [1e-6 * numbers.next(), 1e-6 * numbers.next()]);
        }
        loads.body_force = Some(body);
        let solver = VelocityVerlet { records: 3, ..VelocityVerlet::new(DENSITY, 5000.0) };
        let case = Case { loads, velocity, critical: None, solver, law: Law::Linear };
        case.compare("swing", &device, &build, ROUNDINGS * device.precision().epsilon());
    }
}

/// One particle moves in a straight line.
#[test]
fn gpu_one_particle() {
    for device in devices() {
        let mut one = Body::<3>::solid([2, 1, 1], 0.1, 3.015).build().lattice;
        let site = one.particles()[0] as usize;
        let mut velocity = Field::zeros(one.sites());
        for &site in one.particles() {
            velocity.set(site as usize, [0.4, 0.0, -0.8]);
        }
        let solver = VelocityVerlet { records: 2, ..VelocityVerlet::new(1.0, 2.0) };
        let loads = Loads::default();
        let case = Case { loads, velocity, critical: None, solver, law: Law::Linear };
        let found = case.run(&mut one, Some(&device)).unwrap();
        for (found, exact) in found.state.displacement.get(site).into_iter().zip([0.8, 0.0, -1.6]) {
            assert!((found - exact).abs() <= 100.0 * device.precision().epsilon(), "{found} {exact}");
        }
    }
}

/// What kernels cannot do is refused by name, and so is a state that is not finite.
#[test]
fn gpu_refusals() {
    let Some(device) = devices().pop() else { return };
    let law = Law::Linear.build(1.0, 1.0, false).unwrap();
    let fit = fit(&*law, [0.9, 1.1]);
    let refused = |bonds: &LatticeBonds<2>, fit: &KernelFit, modulus: f64| {
        let error = DeviceBody::new(&device, bonds, fit, modulus).err().map(|error| error.to_string());
        error.unwrap_or_default()
    };
    assert!(Device::cuda(0).err().is_none_or(|error| error.to_string().contains("Cuda")));
    let bonds = damaged([8, 9]);
    assert!(refused(&bonds, &fit, f64::NAN).contains("law of the bonds"));

    let body = DeviceBody::new(&device, &bonds, &fit, MODULUS).unwrap();
    let mut wrong = Field::zeros(bonds.sites());
    wrong.set(bonds.particles()[20] as usize, [0.0, f64::NAN]);
    assert!(body.force(&bonds, &Field::zeros(7)).unwrap_err().to_string().contains("a body of"));
    let error = body.force(&bonds, &wrong).unwrap_err();
    assert!(matches!(error, Error::NotFinite { quantity: "force", .. }), "{error}");
}

/// A body that does not fit is refused by the name of the field that is too large.
#[test]
fn gpu_bodies_beyond_the_memory() {
    let Some(device) = devices().pop() else { return };
    let most = device.largest_buffer() / 16;
    if most > 1 << 25 {
        return evidence::skipped("a device with small buffers");
    }
    // three sites a cell, with the empty ones on either side of the row: within the limit in single
    // precision, beyond it in double
    let cells = [most as usize / 2, 1];
    let row = Lattice { spacing: 1.0, origin: [0.5; 2], cells, occupied: vec![true; cells[0]], volume: 1.0 };
    let bonds = LatticeBonds::new(row, 1.0, VolumeCorrection::None, &[]).unwrap();
    let law = fit(&*Law::Linear.build(1.0, 1.0, false).unwrap(), [0.9, 1.1]);
    let device = device.with_precision(Precision::Single).unwrap();
    assert!(DeviceBody::new(&device, &bonds, &law, MODULUS).is_ok());
    let Ok(device) = device.with_precision(Precision::Double) else { return };
    let error = DeviceBody::new(&device, &bonds, &law, MODULUS).err().map(|error| error.to_string());
    let error = error.unwrap_or_default();
    assert!(error.contains("displacement: found") && error.contains(device.name()), "{error}");
}

//! Lattices on a device, compared with the kernel of the host.

#[path = "it/bodies.rs"]
#[allow(dead_code)] // shared by all tests
mod bodies;

use bodies::{Body, MODULUS, Random, fit, hold, laws, norm};
use peri::Error;
use peri::bonds::{
    BodyGeometry, BondDamage, BondForces, Bonds, Lattice, LatticeBonds, VolumeCorrection, force,
    overstretched, stretch_range,
};
use peri::field::Field;
use peri::gpu::{Device, DeviceBody, Precision, Start};
use peri::material::BondMaterial;
use peri::potential::{KernelFit, Law};
use peri::solver::{Breaking, Method, Policy, State, System, VelocityVerlet};

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

/// Bound of the rounding error of a particle's force, from displacements, law and sums: Σ_J c (|q| + |q′|
/// |δE|/ε + |q|)|ζ| with c = 2kθ w V/|ξ| and the rounding ε|ξ + η|(|u_I| + |u_J|) of E, on which q depends.
fn sizes<const D: usize>(bonds: &LatticeBonds<D>, law: &KernelFit, u: &Field<D>) -> Vec<f64> {
    let of = |site: u32| {
        let mut size = 0.0;
        bonds.neighbours(site as usize, &mut |bond| {
            let (own, other) = (u.get(site as usize), u.get(bond.site));
            let zeta: [f64; D] = std::array::from_fn(|d| bond.bond[d] + other[d] - own[d]);
            let square = bond.length * bond.length;
            let e = zeta.iter().map(|x| x * x).sum::<f64>() / square - 1.0;
            let rounded = (norm(own) + norm(other)) * (norm(zeta) + bond.length) / square;
            let slope = (law.value(e + 1e-5) - law.value(e - 1e-5)).abs() / 2e-5;
            let c = 2.0 * MODULUS * bond.weight / bond.length;
            size += c * norm(zeta) * (law.value(e).abs() + slope * rounded);
        });
        size
    };
    bonds.particles().iter().map(|&site| of(site)).collect()
}

fn compare_forces<const D: usize>(device: &Device, cells: [usize; D]) {
    let mut bonds = damaged(cells);
    let u = random(&bonds, 0.05);
    let all = bonds.directed_bonds();
    bonds.break_bonds(&overstretched(&bonds, &u, &1.05.into(), &peri::bonds::StretchScan::default()));
    assert!(bonds.directed_bonds() < all);
    let range = stretch_range(&bonds, &u);
    let range = [range.low, range.high].map(|e| (1.0 + e).sqrt()).map(|l| l + 1e-3 * (l - 1.0).signum());
    for (law, potential) in laws() {
        let fit = fit(&*potential, range);
        bonds.set_law(&fit, MODULUS);
        let mut expected = Field::zeros(bonds.sites());
        force(&bonds, &u, &mut expected);
        let found = DeviceBody::new(device, &bonds, &fit, MODULUS, None).unwrap().force(&u).unwrap();
        let sizes = sizes(&bonds, &fit, &u);
        let mut worst = 0.0_f64;
        for (&site, size) in bonds.particles().iter().zip(sizes) {
            let (found, expected) = (found.get(site as usize), expected.get(site as usize));
            let apart = norm::<D>(std::array::from_fn(|d| found[d] - expected[d]));
            // a particle without bonds has neither
            worst = worst.max(if apart == 0.0 { 0.0 } else { apart / (size * device.precision().epsilon()) });
        }
        // a bond's force is rounded in ten to fifty operations, each by up to ½ε, in directions that have
        // nothing in common
        let name =
            format!("{D}D {} forces of {} in {:?}, in ε Σ|f|", law.name(), device.name(), device.precision());
        eprintln!("{name}: {worst:.2}");
        evidence::at_most(&name, worst, 4.0);
    }
}

#[test]
fn gpu_forces_are_those_of_the_host() {
    for device in devices() {
        compare_forces::<2>(&device, [31, 26]);
        compare_forces::<3>(&device, [13, 12, 9]);
    }
}

/// A slit sheet or block with initially uniform stretch and moving ends: device and host break the same
/// bonds.
fn compare_motion<const D: usize>(device: &Device, cells: [usize; D], critical: f64) {
    const STEPS: u64 = 60;
    let law = Law::ChainOffset.build(720.0, 1200.0, false).unwrap();
    let whole = damaged(cells);
    let mut bonds = damaged(cells);
    // twice the stiffest particle's stiffness bounds ρω²; steps of half the critical one that follows
    let stiffness = whole.particles().iter().map(|&site| {
        let mut sum = 0.0;
        let tangent = 2.0 * MODULUS * law.tangent();
        whole.neighbours(site as usize, &mut |bond| sum += tangent * bond.weight / bond.length);
        sum
    });
    let time_step = (DENSITY / (2.0 * stiffness.fold(0.0, f64::max))).sqrt();
    let end_time = STEPS as f64 * time_step;
    let (length, reach) = (cells[1] as f64 * 1e-3, 0.02 * cells[1] as f64 * 1e-3);
    let end = |x: [f64; D]| {
        let mut full = [0.0; D];
        full[1] = reach * (2.0 * x[1] / length - 1.0);
        full
    };
    let held = |x: [f64; D]| x[1] < 3e-3 || x[1] > length - 3e-3;
    let loads = hold(&bonds, |x| held(x).then(|| ((1 << D) - 1, end(x))));
    let mut velocity = Field::zeros(whole.sites());
    for &site in whole.particles() {
        velocity.set(site as usize, end(whole.position(site as usize)).map(|d| d / end_time));
    }

    let mut state = State::new(bonds.sites());
    state.velocity = velocity.clone();
    // distance of any bond from the critical stretch, on either side of it
    let (mut margin, mut alive) = (f64::INFINITY, whole.intact());
    let mut system = System::new(&mut bonds, BondMaterial::new(&*law, MODULUS), &loads, &[]);
    system.breaking = Some(Breaking { criterion: critical.into(), policy: Policy::default() });
    let (time_step, records) = (Some(time_step), STEPS as usize);
    let solver =
        VelocityVerlet { time_step, ramp: end_time, records, ..VelocityVerlet::new(DENSITY, end_time) };
    let mut finished = |after: &dyn Bonds<D>, state: &State<D>| {
        for &site in whole.particles() {
            let own = state.displacement.get(site as usize);
            whole.neighbours(site as usize, &mut |bond| {
                let word = bond.index as usize / 64 * whole.sites() + site as usize;
                if alive[word] >> (bond.index % 64) & 1 == 1 {
                    let other = state.displacement.get(bond.site);
                    let zeta: [f64; D] = std::array::from_fn(|d| bond.bond[d] + other[d] - own[d]);
                    margin = f64::min(margin, (norm(zeta) / bond.length - critical).abs());
                }
            });
        }
        alive = after.intact();
        Ok(())
    };
    solver.solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut finished).unwrap();
    assert_eq!(state.counts.total_iterations, STEPS);

    let fit = KernelFit::new(&*law, [0.7, 1.25 * critical - 0.25], 1e-9).unwrap().clamped();
    let mut body = DeviceBody::new(device, &whole, &fit, MODULUS, Some(critical)).unwrap();
    let (displacement, held) = (Field::zeros(whole.sites()), loads.constrained.clone());
    let time_step = end_time / STEPS as f64;
    body.start(&Start { displacement, velocity, held, density: DENSITY, time_step }).unwrap();
    body.advance(STEPS / 3).unwrap();
    body.advance(STEPS - STEPS / 3).unwrap();
    let motion = body.state().unwrap();
    let mut apart = 0.0_f64;
    for &site in whole.particles() {
        let (a, b) = (motion.displacement.get(site as usize), state.displacement.get(site as usize));
        apart = apart.max(norm::<D>(std::array::from_fn(|d| a[d] - b[d])));
    }
    // every step rounds u and vΔt by ½ε of them, at random: ½ε√n of u each; four times that. The law on each
    // side is within 1e-9 of the true one
    let allowed = 4.0 * (STEPS as f64).sqrt() * device.precision().epsilon().max(1e-9) * reach;
    let name = format!("{D}D motion on {} in {:?}, m", device.name(), device.precision());
    let broken = state.fracture.broken;
    eprintln!("{name}: {apart:.1e} of {allowed:.1e}; {broken} bonds broke, {margin:.1e} clear of doubt");
    assert!(
        broken > 10 && margin > 2.0 * allowed / whole.spacing(),
        "{broken} bonds broke, margin {margin:.1e}"
    );
    assert!(body.intact().unwrap() == alive, "other bonds broke");
    evidence::at_most(&name, apart, allowed);
}

#[test]
fn gpu_motion_breaks_the_same_bonds() {
    for device in devices() {
        compare_motion::<2>(&device, [24, 30], 1.045);
        compare_motion::<3>(&device, [9, 14, 8], 1.052);
    }
}

/// A single particle moves in a straight line; a body without particles is refused.
#[test]
fn gpu_smallest_bodies() {
    devices().iter().for_each(smallest_bodies);
}

fn smallest_bodies(device: &Device) {
    let law = Law::Linear.build(1.0, 1.0, false).unwrap();
    let one = Body::<3>::solid([1, 1, 1], 0.1, 3.015).build().lattice;
    let site = one.particles()[0] as usize;
    let mut body = DeviceBody::new(device, &one, &fit(&*law, [0.9, 1.1]), MODULUS, Some(1.1)).unwrap();
    assert_eq!(body.force(&Field::zeros(one.sites())).unwrap().get(site), [0.0; 3]);
    let mut velocity = Field::zeros(one.sites());
    velocity.set(site, [0.4, 0.0, -0.8]);
    let start = Start {
        displacement: Field::zeros(one.sites()),
        velocity,
        held: Vec::new(),
        density: 1.0,
        time_step: 0.125,
    };
    body.start(&start).unwrap();
    body.advance(0).unwrap();
    body.advance(16).unwrap();
    let motion = body.state().unwrap();
    for (found, exact) in motion.displacement.get(site).into_iter().zip([0.8, 0.0, -1.6]) {
        assert!((found - exact).abs() <= 16.0 * device.precision().epsilon(), "{found} {exact}");
    }
    assert_eq!(body.intact().unwrap(), one.intact());
    let empty =
        Lattice { spacing: 1.0, origin: [0.0; 3], cells: [2, 1, 1], occupied: vec![false; 2], volume: 1.0 };
    assert!(LatticeBonds::new(empty, 3.015, VolumeCorrection::None, &[]).is_err());
}

/// Unsupported bodies and values that are not finite are refused by name.
#[test]
fn gpu_refusals() {
    let Some(device) = devices().pop() else { return };
    let law = Law::Linear.build(1.0, 1.0, false).unwrap();
    let fit = fit(&*law, [0.9, 1.1]);
    let refused = |bonds: &LatticeBonds<2>, fit: &KernelFit, modulus: f64, critical: Option<f64>| {
        DeviceBody::new(&device, bonds, fit, modulus, critical)
            .err()
            .map(|error| error.to_string())
            .unwrap_or_default()
    };
    assert!(Device::cuda(0).err().is_none_or(|error| error.to_string().contains("Cuda")));
    let bonds = damaged([8, 9]);
    let corrected = Body::<2>::damaged([8, 9], 1e-3, 3.015).build().lattice;
    assert!(refused(&corrected, &fit, MODULUS, None).contains("surface factors"));
    assert!(refused(&bonds, &fit, f64::NAN, None).contains("modulus NaN"));
    assert!(refused(&bonds, &fit, MODULUS, Some(-1.0)).contains("critical stretch: found -1"));
    let knee = Law::ChainOffset.build(720.0, 1200.0, false).unwrap();
    let table = KernelFit::new(&*knee, [0.3, 1.25 * 720.0_f64.sqrt()], 1e-9).unwrap();
    assert!(refused(&bonds, &table, MODULUS, None).contains("found a table"));

    let mut body = DeviceBody::new(&device, &bonds, &fit, MODULUS, None).unwrap();
    assert!(body.advance(1).unwrap_err().to_string().contains("time step: found 0"));
    let mut wrong = Field::zeros(bonds.sites());
    wrong.set(bonds.particles()[20] as usize, [0.0, f64::NAN]);
    assert!(body.force(&Field::zeros(7)).unwrap_err().to_string().contains("a body of"));
    let error = body.force(&wrong).unwrap_err();
    assert!(matches!(error, Error::NotFinite { quantity: "force", .. }), "{error}");
    let zero = Field::zeros(bonds.sites());
    let mut start = Start {
        displacement: zero.clone(),
        velocity: wrong,
        held: Vec::new(),
        density: 1.0,
        time_step: 1e-3,
    };
    body.start(&start).unwrap();
    body.advance(3).unwrap();
    assert!(matches!(body.state().unwrap_err(), Error::NotFinite { iteration: 3, .. }));
    start.held = vec![0; 3];
    assert!(body.start(&start).unwrap_err().to_string().contains("a body of"));
    start.time_step = 0.0;
    assert!(body.start(&start).unwrap_err().to_string().contains("time step: found 0"));
}

/// A body larger than the memory of the device is refused.
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
    assert!(DeviceBody::new(&device, &bonds, &law, MODULUS, None).is_ok());
    let Ok(device) = device.with_precision(Precision::Double) else { return };
    let error = DeviceBody::new(&device, &bonds, &law, MODULUS, None).err().map(|error| error.to_string());
    let error = error.unwrap_or_default();
    assert!(error.contains("displacement: found") && error.contains(device.name()), "{error}");
}

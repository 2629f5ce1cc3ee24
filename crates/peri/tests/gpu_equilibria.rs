//! Equilibria of lattices on a device, compared with those of the host.

#[path = "it/bodies.rs"]
#[allow(dead_code)] // shared by all tests
mod bodies;

use bodies::{Body, MODULUS, hold};
use peri::Error;
use peri::bonds::{BodyGeometry, Bonds, LatticeBonds};
use peri::contact::{Contact, SHORT_RANGE};
use peri::field::Field;
use peri::gpu::{Device, Precision};
use peri::material::BondMaterial;
use peri::potential::Law;
use peri::solver::{
    Breaking, Criterion, DynamicRelaxation, Equilibrium, Lbfgs, Loads, Policy, QuasiStatic, State, Status,
    System, load_stepping,
};

/// Every precision of this machine's device; reports a skipped test without a device.
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

/// The device in double precision; `None` where it has single precision only.
fn double_device() -> Option<Device> {
    devices().pop().filter(|device| device.precision() == Precision::Double)
}

/// A body with two slits and a hole, without corrections.
fn damaged<const D: usize>(cells: [usize; D]) -> LatticeBonds<D> {
    Body { surface: None, ..Body::damaged(cells, 1e-3, 3.015) }.build().lattice
}

/// Loads, law, and what breaks.
struct Case<const D: usize> {
    loads: Loads<D>,
    law: Law,
    steps: u32,
    breaking: Option<(Criterion, Policy)>,
    /// Parts of a step; above 1, the load also falls after bonds broke.
    refine: usize,
    /// True if particles without a bond repel each other.
    touches: bool,
}

/// A state, and bonds intact after each finished step.
struct Ran<const D: usize> {
    state: State<D>,
    rows: Vec<(Vec<u64>, u64)>,
}

/// A body whose ends are moved apart by a strain and that is pushed aside, its held ends the most: that is no
/// measure of the balance.
fn pulled<const D: usize>(bonds: &LatticeBonds<D>, strain: f64, push: f64) -> Loads<D> {
    let positions = || bonds.particles().iter().map(|&site| bonds.position(site as usize)[1]);
    let length = positions().fold(0.0_f64, f64::max) + 0.5 * bonds.spacing();
    let end = |x: [f64; D]| {
        let mut full = [0.0; D];
        full[1] = strain * (x[1] - 0.5 * length);
        full
    };
    let held = |x: [f64; D]| x[1] < 3e-3 || x[1] > length - 3e-3;
    let mut loads = hold(bonds, |x| held(x).then(|| ((1 << D) - 1, end(x))));
    if push > 0.0 {
        let mut body = Field::zeros(bonds.sites());
        for &site in bonds.particles() {
            let mut force = [0.0; D];
            force[0] = if held(bonds.position(site as usize)) { 1e6 * push } else { push };
            body.set(site as usize, force);
        }
        loads.body_force = Some(body);
    }
    loads
}

impl<const D: usize> Case<D> {
    /// Bonds that do not break, without contact.
    fn new(loads: Loads<D>, law: Law, steps: u32) -> Self {
        Self { loads, law, steps, breaking: None, refine: 1, touches: false }
    }

    /// Continues from `state`; the run stops with an error where a state may be kept for the `stop`th time.
    fn run_from(
        &self,
        bonds: &mut LatticeBonds<D>,
        solver: &mut dyn Equilibrium<D>,
        state: State<D>,
        stop: Option<usize>,
    ) -> (Result<(), Error>, Ran<D>) {
        let law = self.law.build(720.0, 1200.0, false).unwrap();
        let factors: Vec<f64> = (1..=self.steps).map(|k| f64::from(k) / f64::from(self.steps)).collect();
        let (mut state, mut rows, mut kept, mut count) = (state, Vec::new(), None, 0);
        let contact = self.touches.then(|| Contact::short_range(bonds, MODULUS, SHORT_RANGE).unwrap());
        let mut system = System::new(bonds, BondMaterial::new(&*law, MODULUS), &self.loads, &factors);
        let breaking = self.breaking.clone();
        system.breaking = breaking.map(|(criterion, policy)| Breaking { criterion, policy });
        system.contact = contact;
        (system.refine, system.snap_back) = (self.refine, self.refine > 1);
        let mut finished = |bonds: &dyn Bonds<D>, state: &State<D>| {
            rows.push((bonds.intact(), state.fracture.broken));
            Ok(())
        };
        let mut watch = |status: &Status, state: &State<D>| {
            count += usize::from(status.restartable);
            if status.restartable && Some(count) == stop {
                kept = Some(state.clone());
                return Err(Error::Device("stopped".to_owned()));
            }
            Ok(())
        };
        let result = load_stepping(solver, &mut system, &mut state, &mut watch, &mut finished);
        (result, Ran { state: kept.unwrap_or(state), rows })
    }

    fn run(&self, bonds: &mut LatticeBonds<D>, solver: &mut dyn Equilibrium<D>) -> Ran<D> {
        let state = State::new(bonds.sites());
        let (result, ran) = self.run_from(bonds, solver, state, None);
        result.unwrap();
        ran
    }

    /// Compares equilibria on a device with the host's: iterations within `apart` a step, the same bonds
    /// broken after each, displacements to `allowed` of the greatest.
    fn compare(
        &self,
        name: &str,
        (found, host): (&Ran<D>, &Ran<D>),
        device: &Device,
        (apart, allowed): (u64, f64),
    ) {
        let name = format!("{name} on {} in {:?}", device.name(), device.precision());
        let counts = [found, host].map(|ran| ran.state.counts);
        let events = |ran: &Ran<D>| {
            let events = ran.state.fracture.events.iter();
            events.map(|event| (event.step, event.bonds, event.fingerprint)).collect::<Vec<_>>()
        };
        let same = found.rows == host.rows && events(found) == events(host);
        let largest = largest_apart(&found.state.displacement, &host.state.displacement);
        eprintln!(
            "{name}: {} and {} iterations, {} and {} bonds broke, displacement {largest:.1e} of the greatest",
            counts[0].total_iterations,
            counts[1].total_iterations,
            found.state.fracture.broken,
            host.state.fracture.broken,
        );
        evidence::at_most(&format!("{name}, displacement"), largest, allowed);
        if device.precision() == Precision::Single {
            return;
        }
        assert!(same, "{name}: other bonds broke");
        for (found, host) in found.state.history.iter().zip(&host.state.history) {
            let rounds = apart * host.rounds;
            assert!(found.iterations.abs_diff(host.iterations) <= rounds, "{name}: {found:?} {host:?}");
            for (what, a, b) in [
                ("work", found.work, host.work),
                ("stored", found.stored, host.stored),
                ("load", found.load, host.load),
            ] {
                let bound = allowed.max(1e-12) * b.abs();
                assert!((a - b).abs() <= 10.0 * bound, "{name}, {what} at {}: {a:e} {b:e}", host.factor);
            }
        }
        // of L-BFGS the iterates are others, and so are the evaluations of its line searches
        if apart == 1 && counts[0].total_iterations == counts[1].total_iterations {
            assert_eq!(counts[0], counts[1], "{name}: work");
        }
    }
}

fn largest_apart<const D: usize>(found: &Field<D>, host: &Field<D>) -> f64 {
    let components = || host.components().into_iter().flatten();
    let greatest = components().fold(0.0_f64, |most, x| most.max(x.abs()));
    let pairs = found.components().into_iter().flatten().zip(components());
    pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs())) / greatest
}

/// Relaxation, which takes the same iterations but for rounding.
fn compare_relaxation<const D: usize>(
    device: &Device,
    name: &str,
    cells: [usize; D],
    case: &Case<D>,
) -> Ran<D> {
    let method = DynamicRelaxation { tolerance: 1e-4, ..DynamicRelaxation::default() };
    let host = case.run(&mut damaged(cells), &mut method.solver());
    let found = case.run(&mut damaged(cells), &mut method.device_solver(device));
    // an iteration more or less moves what is left of the search; single precision stops at its rounding
    let allowed = if device.precision() == Precision::Double { 1e-10 } else { 2e-3 };
    case.compare(&format!("{D}D {name}"), (&found, &host), device, (1, allowed));
    host
}

#[test]
fn gpu_relaxes_as_the_host() {
    for device in devices() {
        let sheet = damaged([24, 30]);
        for (name, law, strain, push) in [
            ("linear bonds", Law::Linear, 0.01, 0.0),
            ("pushed bonds", Law::Linear, 0.01, 1e-9),
            ("chains that stiffen", Law::ChainOffset, 0.8, 0.0),
        ] {
            let case = Case::new(pulled(&sheet, strain, push), law, 3);
            compare_relaxation(&device, name, [24, 30], &case);
        }
        let block = damaged([9, 14, 8]);
        let case = Case::new(pulled(&block, 0.03, 1e-12), Law::ChainOffset, 2);
        compare_relaxation(&device, "chains", [9, 14, 8], &case);
    }
}

/// Pairs in contact after the last step.
fn pairs_of<const D: usize>(ran: &Ran<D>) -> u64 {
    ran.state.history.last().and_then(|row| row.contact).map_or(0, |contact| contact.pairs)
}

/// Bodies pressed together until the flanks of their slits touch.
#[test]
fn gpu_equilibria_in_contact() {
    for device in devices() {
        let sheet = damaged([24, 30]);
        for (name, law, strain) in
            [("slits", Law::Linear, -0.1), ("slits of chains", Law::ChainOffset, -0.12)]
        {
            let case = Case { touches: true, ..Case::new(pulled(&sheet, strain, 0.0), law, 4) };
            let host = compare_relaxation(&device, name, [24, 30], &case);
            assert!(pairs_of(&host) > 5, "{} pairs", pairs_of(&host));
            compare_lbfgs(&device, name, [24, 30], &case);
        }
        let block = damaged([9, 14, 8]);
        let case = Case { touches: true, ..Case::new(pulled(&block, -0.1, 0.0), Law::Linear, 2) };
        let host = compare_relaxation(&device, "slits", [9, 14, 8], &case);
        assert!(pairs_of(&host) > 5, "{} pairs", pairs_of(&host));
    }
}

/// Bonds that are weighted by factors of their ends.
#[test]
fn gpu_relaxes_bodies_with_surface_correction() {
    for device in devices() {
        let build = || Body::<2>::damaged([24, 30], 1e-3, 3.015).build().lattice;
        let loads = pulled(&build(), 0.8, 0.0);
        let case = Case::new(loads, Law::ChainOffset, 3);
        let method = DynamicRelaxation { tolerance: 1e-4, ..DynamicRelaxation::default() };
        let host = case.run(&mut build(), &mut method.solver());
        let found = case.run(&mut build(), &mut method.device_solver(&device));
        let allowed = if device.precision() == Precision::Double { 1e-10 } else { 2e-3 };
        case.compare("surface correction", (&found, &host), &device, (1, allowed));
    }
}

/// As on the device, no coarse level.
const NO_COARSE: f64 = f64::INFINITY;

/// L-BFGS, to whose direction both add pairs in single precision: as many iterations but for a tenth, and
/// displacements to a multiple of the tolerance, as the last iterates are others.
fn compare_lbfgs<const D: usize>(device: &Device, name: &str, cells: [usize; D], case: &Case<D>) -> Ran<D> {
    // single precision cannot balance forces as well
    let tolerance = if device.precision() == Precision::Double { 1e-6 } else { 1e-4 };
    let method = Lbfgs { tolerance, coarsening: NO_COARSE, ..Lbfgs::default() };
    let host = case.run(&mut damaged(cells), &mut method.solver());
    let found = case.run(&mut damaged(cells), &mut method.device_solver(device));
    let both = Lbfgs { coarsening: Lbfgs::default().coarsening, ..method };
    let both = case.run(&mut damaged(cells), &mut both.solver()).state.counts.total_iterations;
    let most = host.state.history.iter().map(|row| row.iterations).max().unwrap_or(0);
    case.compare(
        &format!("{D}D {name} by L-BFGS"),
        (&found, &host),
        device,
        (most / 10 + 2, 20.0 * tolerance),
    );
    eprintln!("  {both} iterations with the coarse level");
    host
}

#[test]
fn gpu_lbfgs_as_the_host() {
    for device in devices() {
        let sheet = damaged([24, 30]);
        for (name, law, strain, push) in [
            ("linear bonds", Law::Linear, 0.01, 0.0),
            ("pushed bonds", Law::Linear, 0.01, 1e-9),
            ("chains that stiffen", Law::ChainOffset, 0.8, 0.0),
        ] {
            let case = Case::new(pulled(&sheet, strain, push), law, 3);
            compare_lbfgs(&device, name, [24, 30], &case);
        }
        let block = damaged([9, 14, 8]);
        let case = Case::new(pulled(&block, 0.03, 1e-12), Law::ChainOffset, 2);
        compare_lbfgs(&device, "chains", [9, 14, 8], &case);
    }
}

/// Bonds break between equilibria of L-BFGS.
#[test]
fn gpu_lbfgs_breaks_the_same_bonds() {
    for device in devices() {
        let sheet = damaged([14, 18]);
        for policy in [Policy::AtEquilibrium, Policy::EachIteration] {
            let breaking = Some((1.03.into(), policy));
            let case = Case { breaking, ..Case::new(pulled(&sheet, 0.02, 0.0), Law::Linear, 8) };
            let method = Lbfgs { tolerance: 1e-5, coarsening: NO_COARSE, ..Lbfgs::default() };
            let host = case.run(&mut damaged([14, 18]), &mut method.solver());
            let found = case.run(&mut damaged([14, 18]), &mut method.device_solver(&device));
            let broken = [&found, &host].map(|ran| ran.state.fracture.broken);
            assert!(broken[1] > 10, "{broken:?} bonds broke");
            if device.precision() == Precision::Single || policy == Policy::EachIteration {
                // on the way, a bond breaks in an iteration or in the next
                eprintln!("{policy:?} by L-BFGS in {:?}: {broken:?} bonds", device.precision());
                assert!(broken[0].abs_diff(broken[1]) <= broken[1] / 10, "{broken:?} bonds");
                continue;
            }
            let most = host.state.history.iter().map(|row| row.iterations).max().unwrap_or(0);
            case.compare("breaking by L-BFGS", (&found, &host), &device, (most / 10 + 2, 1e-4));
        }
    }
}

/// Bonds break between equilibria, and in the iterations towards them.
#[test]
fn gpu_equilibria_break_the_same_bonds() {
    for device in devices() {
        let (between, on_the_way) = (Policy::AtEquilibrium, Policy::EachIteration);
        let cells = [24, 30];
        for (policy, cells, refine, touches) in [
            (between, cells, 1, false),
            (between, [14, 18], 8, false),
            (on_the_way, cells, 1, false),
            (between, [14, 18], 1, true),
            (on_the_way, [14, 18], 1, true),
        ] {
            // single precision is compared in contact without breaking
            if touches && device.precision() == Precision::Single {
                continue;
            }
            let sheet = damaged(cells);
            let breaking = Some((1.03.into(), policy));
            let steps = if refine > 1 { 2 } else { 8 };
            let strain = if touches { -0.08 } else { 0.02 };
            let loads = pulled(&sheet, strain, 0.0);
            let case = Case { loads, law: Law::Linear, steps, breaking, refine, touches };
            let host = case.run(&mut damaged(cells), &mut DynamicRelaxation::default().solver());
            assert!(host.state.fracture.broken > 10, "{} bonds broke", host.state.fracture.broken);
            let found =
                case.run(&mut damaged(cells), &mut DynamicRelaxation::default().device_solver(&device));
            if device.precision() == Precision::Single && found.rows != host.rows {
                eprintln!(
                    "{policy:?}: {} and {} bonds",
                    found.state.fracture.broken, host.state.fracture.broken
                );
                continue;
            }
            let allowed = if device.precision() == Precision::Double { 1e-9 } else { 1e-4 };
            case.compare(
                &format!("{policy:?}, {refine} parts of a step"),
                (&found, &host),
                &device,
                (1, allowed),
            );
        }
    }
}

/// A run repeats its bits, and so does one that is stopped and continued, also within a search.
#[test]
fn gpu_equilibria_continue_with_the_same_bits() {
    let Some(device) = double_device() else { return };
    continue_with_the_same_bits(&device, [8, 60], 0.01, false);
    continue_with_the_same_bits(&device, [8, 40], -0.01, true);
}

fn continue_with_the_same_bits(device: &Device, cells: [usize; 2], strain: f64, touches: bool) {
    let sheet = damaged(cells);
    let case =
        Case { touches, ..Case::new(pulled(&sheet, strain, 0.0), Law::Linear, if touches { 1 } else { 2 }) };
    let relaxation = DynamicRelaxation { tolerance: 1e-9, ..DynamicRelaxation::default() };
    let lbfgs = Lbfgs { tolerance: 1e-9, ..Lbfgs::default() };
    for (by_lbfgs, interval) in [(false, 500), (true, 200)] {
        let solver = || -> Box<dyn Equilibrium<2> + '_> {
            if by_lbfgs {
                Box::new(lbfgs.device_solver(device))
            } else {
                Box::new(relaxation.device_solver(device))
            }
        };
        let whole = case.run(&mut damaged(cells), &mut *solver());
        let first = whole.state.history[0].iterations;
        eprintln!("by L-BFGS {by_lbfgs}, touching {touches}: {first} iterations");
        assert!(first > interval, "{first} iterations");
        let again = case.run(&mut damaged(cells), &mut *solver());
        assert!(whole.state == again.state, "another run");
        assert_eq!(touches, pairs_of(&whole) > 0, "{} pairs", pairs_of(&whole));
        // in contact, within the only search
        for stop in if touches { 2..=2 } else { 1..=3 } {
            let state = State::new(sheet.sites());
            let (stopped, kept) = case.run_from(&mut damaged(cells), &mut *solver(), state, Some(stop));
            assert!(stopped.is_err());
            let (result, rest) = case.run_from(&mut damaged(cells), &mut *solver(), kept.state, None);
            result.unwrap();
            assert!(whole.state == rest.state, "stopped at state {stop}");
        }
    }
}

/// A search that does not end is an error with the state that it has reached.
#[test]
fn gpu_equilibria_that_are_not_found() {
    let Some(device) = double_device() else { return };
    let sheet = damaged([24, 30]);
    let case = Case::new(pulled(&sheet, 0.01, 0.0), Law::Linear, 1);
    let method = DynamicRelaxation { max_iterations: 7, ..DynamicRelaxation::default() };
    let state = State::new(sheet.sites());
    let (result, found) =
        case.run_from(&mut damaged([24, 30]), &mut method.device_solver(&device), state.clone(), None);
    let (host, expected) = case.run_from(&mut damaged([24, 30]), &mut method.solver(), state, None);
    let [found_error, expected_error] = [result, host].map(|result| result.unwrap_err());
    assert!(matches!(found_error, Error::NotConverged { iterations: 7, .. }), "{found_error}");
    assert_eq!(found_error.to_string(), expected_error.to_string());
    assert!(largest_apart(&found.state.displacement, &expected.state.displacement) <= 1e-12);
}

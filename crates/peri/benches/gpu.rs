//! An elastic block in motion, on a device and by the host's kernel: bonds, steps, seconds, directed bonds a
//! second, and how far forces are apart; then a block stretched to its equilibrium by either method.
//! `cargo bench -p peri --no-default-features --features gpu --bench gpu -- 60 100 30`: 60³ particles, 100
//! steps, equilibria of 30³ particles.

use peri::bonds::{BodyGeometry, BondDamage, BondForces, LatticeBonds, force};
use peri::calibrate::{Space, modulus};
use peri::field::Field;
use peri::geometry::Shape;
use peri::gpu::{Device, DeviceBody, DeviceStep, MOST_STEPS, Precision, StepSums};
use peri::material::BondMaterial;
use peri::model::Body;
use peri::potential::{KernelFit, Law};
use peri::solver::{
    DynamicRelaxation, Equilibrium, Lbfgs, Loads, QuasiStatic, State, Support, System, load_stepping,
};
use std::time::Instant;

/// Young's modulus, Pa, and mass density, kg/m³.
const STIFFNESS: f64 = 1e6;
const DENSITY: f64 = 1000.0;
const SPACING: f64 = 1e-3;

fn measure<const D: usize>(cells: u32, steps: u64) -> Result<(), Box<dyn std::error::Error>> {
    let shape = Shape::Box { min: [0.0; D], max: [f64::from(cells) * SPACING; D] };
    let mut bonds: LatticeBonds<D> = Body::lattice(shape, SPACING).build()?;
    let space = if D == 2 { Space::PlaneStress } else { Space::Solid };
    let law = Law::ChainOffset.build(720.0, 1200.0, false)?;
    let (fit, modulus) =
        (KernelFit::new(&*law, [0.9, 1.1], 1e-9)?, modulus(space, STIFFNESS, bonds.horizon(), 1.0));
    bonds.set_law(&fit, modulus);
    let mut displacement = Field::zeros(bonds.sites());
    for &site in bonds.particles() {
        let position = bonds.position(site as usize);
        displacement.set(site as usize, position.map(|x| 0.03 * SPACING * (x / SPACING).sin()));
    }
    let count = bonds.directed_bonds();
    println!("{D}D, {} particles, {count} directed bonds, law {}", bonds.particles().len(), fit.kind());

    let mut expected = Field::zeros(bonds.sites());
    force(&bonds, &displacement, &mut expected);
    let evaluations = steps.min(20);
    let begin = Instant::now();
    (0..evaluations).for_each(|_| force(&bonds, &displacement, &mut expected));
    let (seconds, threads) = (begin.elapsed().as_secs_f64(), std::thread::available_parallelism()?);
    let rate = (count * evaluations) as f64 / seconds;
    println!(
        "  host, {threads} threads, Double: {count} bonds, {evaluations} forces, {seconds:.3} s, {rate:.3e} \
         directed bonds/s"
    );

    for precision in [Precision::Single, Precision::Double] {
        let device = match Device::portable()?.with_precision(precision) {
            Ok(device) => device,
            Err(error) => {
                println!("  skipped: {error}");
                continue;
            }
        };
        // well below 2/ω_max
        let time_step = 0.1 * SPACING / (STIFFNESS / DENSITY).sqrt();
        let step = DeviceStep {
            time_step,
            density: DENSITY,
            damping: 0.0,
            factors: [1.0; 2],
            loading: [1.0; 2],
            rate: 0.0,
        };
        let zero = Field::zeros(bonds.sites());
        let mut body = DeviceBody::new(&device, &bonds, &fit, modulus)?;
        let found = body.force(&bonds, &displacement)?;
        body.set_state(&bonds, [&displacement, &zero, &found], time_step)?;
        let (name, error) = (device.name().to_owned(), largest_apart(&found, &expected));
        println!("  {name}, {precision:?}: forces off by {error:.1e} of the largest");
        for (what, pulls, looks) in
            [("forces", true, false), ("forces that look", true, true), ("steps", false, false)]
        {
            let take = |body: &mut DeviceBody<D>, steps: usize| -> Result<StepSums, peri::Error> {
                let mut last = StepSums::default();
                for taken in 0..steps {
                    let slot = taken % MOST_STEPS;
                    if !pulls {
                        body.half_kick_and_drift(&step);
                    }
                    body.pull(1.0, looks);
                    if !pulls {
                        body.kick(&step);
                        body.keep_sums(slot);
                    }
                    if slot + 1 == MOST_STEPS || taken + 1 == steps {
                        last = body.sums(&vec![step; slot + 1])?[slot];
                    }
                }
                Ok(last)
            };
            // the first ones compile the kernels
            take(&mut body, 3)?;
            let begin = Instant::now();
            let last = take(&mut body, steps as usize)?;
            let seconds = begin.elapsed().as_secs_f64();
            let rate = (count * steps) as f64 / seconds;
            println!(
                "    {what}: {count} bonds, {steps} of them, {seconds:.4} s, {rate:.3e} directed bonds/s, \
                 {:.3} ms each; kinetic \
                 energy {:.3e} J",
                1e3 * seconds / steps as f64,
                last.kinetic
            );
        }
    }
    Ok(())
}

/// Stretches a cube of `cells`³ particles by 1 % in one step, by a solver; prints its work and the time
/// of the whole step; returns the displacement.
fn stretch(
    cells: u32,
    name: &str,
    solver: &mut dyn Equilibrium<3>,
) -> Result<Field<3>, Box<dyn std::error::Error>> {
    let length = f64::from(cells) * SPACING;
    let mut bonds = Body::lattice(Shape::Box { min: [0.0; 3], max: [length; 3] }, SPACING).build()?;
    let law = Law::ChainOffset.build(720.0, 1200.0, false)?;
    let modulus = modulus(Space::Solid, STIFFNESS, bonds.horizon(), 1.0);
    let end = |upper: bool| {
        let is_member = |x: f64| if upper { x > length - 3.0 * SPACING } else { x < 3.0 * SPACING };
        let sites = bonds.particles().iter().copied();
        let members = sites.filter(|&site| is_member(bonds.position(site as usize)[0])).collect();
        let moved = if upper { 0.01 * length } else { 0.0 };
        let support = Support { displacement: [Some(moved), Some(0.0), Some(0.0)], body_force: [0.0; 3] };
        (members, support)
    };
    let loads = Loads::new(bonds.sites(), &[end(false), end(true)]);
    let mut state = State::new(bonds.sites());
    let mut system = System::new(&mut bonds, BondMaterial::new(&*law, modulus), &loads, &[1.0]);
    let begin = Instant::now();
    load_stepping(solver, &mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(()))?;
    let (seconds, counts) = (begin.elapsed().as_secs_f64(), state.counts);
    println!(
        "  {name}: {} iterations, {} forces, {seconds:.3} s, {:.3e} directed bonds/s",
        counts.total_iterations,
        counts.evaluations,
        counts.bond_evaluations as f64 / seconds
    );
    Ok(state.displacement)
}

/// Equilibria of the host and of a device, in both precisions.
fn equilibria(cells: u32) -> Result<(), Box<dyn std::error::Error>> {
    println!("equilibrium of {cells}³ particles, stretched by 1 %");
    let (relaxation, lbfgs) = (DynamicRelaxation::default(), Lbfgs::default());
    let expected = [
        stretch(cells, "host, relaxation", &mut relaxation.solver())?,
        stretch(cells, "host, L-BFGS with its coarse level", &mut lbfgs.solver())?,
    ];
    for precision in [Precision::Single, Precision::Double] {
        let device = match Device::portable()?.with_precision(precision) {
            Ok(device) => device,
            Err(error) => {
                println!("  skipped: {error}");
                continue;
            }
        };
        let name = |method: &str| format!("{}, {precision:?}, {method}", device.name());
        let found = [
            stretch(cells, &name("relaxation"), &mut relaxation.device_solver(&device))?,
            stretch(cells, &name("L-BFGS"), &mut lbfgs.device_solver(&device))?,
        ];
        let apart = [0, 1].map(|k| largest_apart(&found[k], &expected[k]));
        println!("    displacements off by {:.1e} and {:.1e} of the largest", apart[0], apart[1]);
    }
    Ok(())
}

/// Largest difference of two fields over the largest of the second.
fn largest_apart<const D: usize>(found: &Field<D>, expected: &Field<D>) -> f64 {
    let pairs = || found.components().into_iter().flatten().zip(expected.components().into_iter().flatten());
    let apart = pairs().fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
    apart / pairs().fold(0.0_f64, |most, (_, b)| most.max(b.abs()))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // cargo adds a flag
    let words = std::env::args().skip(1).filter(|word| !word.starts_with("--"));
    let mut numbers = words.map(|text| text.parse::<u32>());
    let cells = numbers.next().transpose()?.unwrap_or(40);
    let steps = numbers.next().transpose()?.unwrap_or(50).into();
    // as many particles in the plane
    measure::<2>(f64::from(cells).powf(1.5) as u32, steps)?;
    measure::<3>(cells, steps)?;
    equilibria(numbers.next().transpose()?.unwrap_or(20))
}

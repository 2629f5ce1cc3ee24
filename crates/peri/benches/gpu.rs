//! Elastic block in motion, on a device and by the kernel of the host: bonds, steps, seconds, directed bonds
//! per second, and the difference of forces. `cargo bench -p peri --no-default-features --features gpu
//! --bench gpu -- 60 100`: 60³ particles, 100 steps.

use peri::bonds::{BodyGeometry, BondDamage, BondForces, LatticeBonds, force};
use peri::calibrate::{Space, modulus};
use peri::field::Field;
use peri::geometry::Shape;
use peri::gpu::{Device, DeviceBody, Precision, Start};
use peri::model::Body;
use peri::potential::{KernelFit, Law};
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

    let largest = |field: &Field<D>| {
        field.components().into_iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()))
    };
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
        let (displacement, velocity) = (displacement.clone(), Field::zeros(bonds.sites()));
        let start = Start { displacement, velocity, held: Vec::new(), density: DENSITY, time_step };
        // ANCHOR: device
        // bonds break beyond a stretch of 1.5: they are looked at in every step, and none does
        let mut body = DeviceBody::new(&device, &bonds, &fit, modulus, Some(1.5))?;
        let found = body.force(&start.displacement)?;
        body.start(&start)?;
        // the first step compiles the kernels
        body.advance(1)?;
        let begin = Instant::now();
        body.advance(steps)?;
        let seconds = begin.elapsed().as_secs_f64();
        let motion = body.state()?;
        // ANCHOR_END: device
        let pairs = found.components().into_iter().flatten().zip(expected.components().into_iter().flatten());
        let apart = pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        let (name, rate) = (device.name(), (count * steps) as f64 / seconds);
        let [error, moved] = [apart / largest(&expected), largest(&motion.displacement) / SPACING];
        println!(
            "  {name}, {precision:?}: {count} bonds, {steps} steps, {seconds:.3} s, {rate:.3e} directed \
             bonds/s, forces off by \
             {error:.1e} of the largest; displacements up to {moved:.3} spacings"
        );
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // cargo adds a flag
    let words = std::env::args().skip(1).filter(|word| !word.starts_with("--"));
    let mut numbers = words.map(|text| text.parse::<u32>());
    let cells = numbers.next().transpose()?.unwrap_or(40);
    let steps = numbers.next().transpose()?.unwrap_or(50).into();
    // as many particles in the plane
    measure::<2>(f64::from(cells).powf(1.5) as u32, steps)?;
    measure::<3>(cells, steps)
}

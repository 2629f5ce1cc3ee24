//! Elastic block in motion: the problem on which other peridynamics codes are timed (`cargo xtask bench
//! peri-peers`).
//!
//! A cube of the prototype microelastic material (18K/(πδ⁴) times the strain of a bond, Silling & Askari
//! 2005, doi:10.1016/j.compstruc.2004.11.026), free on all sides, released at rest from a smooth
//! displacement. The constants are those of LAMMPS' example `peri`, Parks et al. 2008,
//! doi:10.1016/j.cpc.2008.06.011.

use crate::Failure;
use crate::kernel::RATIO;
use evidence::measurement::Measurement;
use harness::output::csv::{self, Column};
use peri::Error;
use peri::bonds::{BodyGeometry, BondDamage, BondForces, Lattice, LatticeBonds, VolumeCorrection, force};
use peri::calibrate::{Space, modulus, poisson_ratio};
use peri::field::{Field, chunk_range};
use peri::potential::{KernelFit, Law};
use rayon::prelude::*;
use std::f64::consts::PI;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Distance of particles, m.
const SPACING: f64 = 5e-4;
/// Bulk modulus, Pa.
const BULK_MODULUS: f64 = 14.9e9;
/// Mass density, kg/m³.
const DENSITY: f64 = 2200.0;
/// Time step, s.
const TIME_STEP: f64 = 2e-8;
/// A of the displacement.
const AFFINE: [[f64; 3]; 3] = [[0.5, 0.2, 0.0], [0.0, -0.3, 0.1], [0.1, 0.0, 0.4]];

/// Size and settings of the block.
#[derive(clap::Args)]
#[command(next_help_heading = "Elastic block")]
pub struct Options {
    /// Time this instead: a free block of CELLS³ particles in motion, velocity Verlet.
    #[arg(long, value_name = "CELLS", value_parser = clap::value_parser!(u16).range(4..=215))]
    pub block: Option<u16>,
    /// Time steps; with 0, forces of the initial displacement.
    #[arg(long, requires = "block", default_value_t = 20)]
    steps: u32,
    /// Gradient of the initial displacement, 1e-6 to 0.24.
    #[arg(long, requires = "block", default_value_t = 0.01, value_parser = strain)]
    strain: f64,
    /// Partial volumes of particles that the horizon cuts.
    #[arg(long, requires = "block")]
    partial_volumes: bool,
    /// Largest relative error of the fitted law, 1e-15 to 1e-3.
    #[arg(long, requires = "block", default_value_t = 1e-9, value_parser = fit_bound)]
    fit_bound: f64,
    /// Bonds in single precision, the sums of their forces in double precision.
    #[arg(long, requires = "block")]
    mixed: bool,
    /// Write positions, displacements and force densities at the end (CSV).
    #[arg(long, requires = "block", value_name = "FILE")]
    state: Option<PathBuf>,
}

fn strain(text: &str) -> Result<f64, String> {
    // bonds are fitted over 1 ± 4 strains
    within(text, 1e-6, 0.24)
}

fn fit_bound(text: &str) -> Result<f64, String> {
    within(text, 1e-15, 1e-3)
}

pub fn within(text: &str, least: f64, most: f64) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| format!("`{text}` is not a number"))?;
    if (least..=most).contains(&value) {
        Ok(value)
    } else {
        Err(format!("{value} is not within {least:?} to {most:?}"))
    }
}

/// Builds the block, moves it, and returns its rates.
///
/// # Errors
/// A momentum of the free body other than zero; errors of the kernel and of files.
pub fn measure(cells: u16, options: &Options) -> Result<Vec<Measurement>, Failure> {
    let mut block = Block::new(cells.into(), options)?;
    let start = Instant::now();
    for _ in 0..options.steps {
        block.step();
    }
    let seconds = start.elapsed().as_secs_f64();
    block.check_momentum()?;
    if let Some(path) = &options.state {
        block.write(path)?;
    }
    let (particles, bonds) = (block.bonds.particles().len(), block.bonds.directed_bonds());
    let row = |what: &str, value: f64, unit: &str| {
        Measurement::new(format!("block: {what}"), particles, rayon::current_num_threads(), value, unit)
    };
    let mut rows = vec![row("bonds", bonds as f64, "directed bonds")];
    if options.steps > 0 {
        let rate = f64::from(options.steps) / seconds;
        rows.push(row("forces", rate * bonds as f64, "directed bonds/s"));
        rows.push(row("steps", rate * particles as f64, "particle·steps/s"));
    }
    if let Some(error) = block.bonds.mixed_error(&block.displacement) {
        rows.push(row("error of forces in mixed precision", error, "of their root mean square"));
    }
    Ok(rows)
}

struct Block {
    bonds: LatticeBonds<3>,
    displacement: Field<3>,
    velocity: Field<3>,
    force: Field<3>,
}

impl Block {
    fn new(cells: usize, options: &Options) -> Result<Self, Error> {
        let lattice = Lattice {
            spacing: SPACING,
            origin: [0.5 * SPACING; 3],
            cells: [cells; 3],
            occupied: vec![true; cells.pow(3)],
            volume: SPACING.powi(3),
        };
        let volumes = if options.partial_volumes { VolumeCorrection::Linear } else { VolumeCorrection::None };
        let mut bonds = LatticeBonds::new(lattice, RATIO, volumes, &[])?;
        if options.mixed {
            bonds.set_mixed();
        }
        let law = Law::Linear.build(1.0, 1.0, false)?;
        let range = [1.0 - 4.0 * options.strain, 1.0 + 4.0 * options.strain];
        let fit = KernelFit::new(&*law, range, options.fit_bound)?;
        let youngs_modulus = 3.0 * BULK_MODULUS * (1.0 - 2.0 * poisson_ratio(Space::Solid));
        bonds.set_law(&fit, modulus(Space::Solid, youngs_modulus, bonds.horizon(), 1.0));
        let zero = Field::zeros(bonds.sites());
        let mut displacement = zero.clone();
        for &site in bonds.particles() {
            let position = bonds.position(site as usize);
            displacement
                .set(site as usize, initial_displacement(position, options.strain, cells as f64 * SPACING));
        }
        let mut block = Self { bonds, displacement, velocity: zero.clone(), force: zero };
        block.bonds.prepare(&block.displacement);
        force(&block.bonds, &block.displacement, &mut block.force);
        Ok(block)
    }

    /// Advances by velocity Verlet: v ← v + ½Δt f/ρ, u ← u + Δt v, new f, v ← v + ½Δt f/ρ.
    fn step(&mut self) {
        let (sites, kick) = (self.bonds.sites(), 0.5 * TIME_STEP / DENSITY);
        let forces = self.force.components();
        let (u, v) = (self.displacement.chunks_mut(), self.velocity.chunks_mut());
        u.into_par_iter().zip(v).enumerate().for_each(|(chunk, (u, v))| {
            for ((u, v), f) in u.into_iter().zip(v).zip(forces) {
                for ((u, v), f) in u.iter_mut().zip(v).zip(&f[chunk_range(chunk, sites)]) {
                    *v += kick * f;
                    *u += TIME_STEP * *v;
                }
            }
        });
        self.bonds.prepare(&self.displacement);
        force(&self.bonds, &self.displacement, &mut self.force);
        let forces = self.force.components();
        self.velocity.chunks_mut().into_par_iter().enumerate().for_each(|(chunk, v)| {
            for (v, f) in v.into_iter().zip(forces) {
                for (v, f) in v.iter_mut().zip(&f[chunk_range(chunk, sites)]) {
                    *v += kick * f;
                }
            }
        });
    }

    /// Checks that the momentum of a free body stays zero up to rounding.
    fn check_momentum(&self) -> Result<(), Failure> {
        let particles = self.bonds.particles();
        for v in self.velocity.components() {
            let sum: f64 = particles.iter().map(|&site| v[site as usize]).sum();
            let largest = v.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
            if sum.abs() > 1e-14 * particles.len() as f64 * largest {
                return Err(format!("velocities up to {largest} m/s add up to {sum} m/s").into());
            }
        }
        Ok(())
    }

    fn write(&self, path: &Path) -> Result<(), Failure> {
        let values = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
            self.bonds.particles().iter().map(|&site| of(site as usize)).collect()
        };
        let mut data = Vec::new();
        for (d, name) in ["x", "y", "z"].into_iter().enumerate() {
            data.push((name, "m", values(&|site| self.bonds.position(site)[d])));
        }
        for (d, name) in ["ux", "uy", "uz"].into_iter().enumerate() {
            data.push((name, "m", values(&|site| self.displacement.get(site)[d])));
        }
        for (d, name) in ["fx", "fy", "fz"].into_iter().enumerate() {
            data.push((name, "N/m3", values(&|site| self.force.get(site)[d])));
        }
        let columns: Vec<Column> =
            data.iter().map(|(name, unit, data)| (*name, *unit, data.as_slice())).collect();
        Ok(csv::write(path, &columns)?)
    }
}

/// Returns u_i = ε(A_ij X_j + L/4π sin(2π (X_i + X_{i+1})/L)).
fn initial_displacement(position: [f64; 3], strain: f64, side: f64) -> [f64; 3] {
    let mut displacement = [0.0; 3];
    for (i, u) in displacement.iter_mut().enumerate() {
        let affine: f64 = AFFINE[i].iter().zip(position).map(|(a, x)| a * x).sum();
        let wave = side / (4.0 * PI) * (2.0 * PI * (position[i] + position[(i + 1) % 3]) / side).sin();
        *u = strain * (affine + wave);
    }
    displacement
}

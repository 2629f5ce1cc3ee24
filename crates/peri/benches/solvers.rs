//! Quasi-static methods compared on one problem: error against work and run time (`cargo xtask bench
//! peri-solvers`).
//!
//! The plate with a hole of `cases/ch2/plate-with-hole`, from rest to equilibrium in one load step. Error:
//! the largest difference of displacements from the equilibrium of the lattice at a residual of 1e-11, over
//! the root mean square.

use crate::RATIO;
use evidence::measurement::Measurement;
use peri::Error;
use peri::bonds::{BodyGeometry, LatticeBonds, VolumeCorrection};
use peri::calibrate::{Space, modulus};
use peri::geometry::{Operation, Shape, lattice};
use peri::material::BondMaterial;
use peri::potential::{BondPotential, Law};
use peri::solver::{
    DynamicRelaxation, Equilibrium, Lbfgs, LbfgsSolver, Loads, RelaxationSolver, State, Support, System,
    load_stepping,
};
use std::time::Instant;

/// Half a side of the plate, its thickness, and the radius of the hole, m.
const HALF: f64 = 0.5;
const THICKNESS: f64 = 10e-3;
const RADIUS: f64 = 60e-3;
/// Requested residuals.
const TOLERANCES: [f64; 5] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6];
/// Residual of the reference solution.
const REFERENCE: f64 = 1e-11;
const METHODS: [&str; 2] = ["adr", "lbfgs"];

/// Settings of the comparison.
#[derive(clap::Args)]
#[command(next_help_heading = "Quasi-static methods")]
pub struct Options {
    /// Time every method on the plate with a hole instead, at a spacing of MM mm.
    #[arg(long, value_name = "MM", value_delimiter = ',', conflicts_with = "block", value_parser = spacing)]
    pub solvers: Vec<f64>,
}

fn spacing(text: &str) -> Result<f64, String> {
    crate::block::within(text, 0.5, 20.0)
}

/// Runs every method at every tolerance.
pub fn measure(spacings: &[f64]) -> Result<Vec<Measurement>, Error> {
    let mut rows = Vec::new();
    for spacing in spacings {
        let mut plate = Plate::new(1e-3 * spacing)?;
        let exact = plate.solve("lbfgs", REFERENCE)?;
        for method in METHODS {
            for tolerance in TOLERANCES {
                let start = Instant::now();
                let state = plate.solve(method, tolerance)?;
                let seconds = start.elapsed().as_secs_f64();
                let mut row = |what: &str, value: f64, unit: &'static str| {
                    let (what, size) =
                        (format!("{method} {tolerance:e}: {what}"), plate.bonds.particles().len());
                    rows.push(Measurement::new(what, size, rayon::current_num_threads(), value, unit));
                };
                row("error", plate.apart(&state, &exact), "");
                row("force evaluations", state.counts.evaluations as f64, "");
                row("bond evaluations", state.counts.bond_evaluations as f64, "");
                row("time", seconds, "s");
            }
        }
    }
    Ok(rows)
}

struct Plate {
    bonds: LatticeBonds<2>,
    loads: Loads<2>,
    law: Box<dyn BondPotential>,
    modulus: f64,
}

impl Plate {
    fn new(spacing: f64) -> Result<Self, Error> {
        let body = [
            Operation::Add(Shape::Box { min: [-HALF; 2], max: [HALF; 2] }),
            Operation::Cut(Shape::Ball { centre: [0.0; 2], radius: RADIUS }),
        ];
        let cells = lattice(&body, spacing, THICKNESS)?;
        let bonds = LatticeBonds::new(cells, RATIO, VolumeCorrection::None, &[])?;
        let depth = RATIO.floor() * spacing;
        let side = |sign: f64| -> (Vec<u32>, Support<2>) {
            let inside = |&site: &u32| sign * bonds.position(site as usize)[0] > HALF - depth;
            let sites = bonds.particles().iter().copied().filter(inside).collect();
            (sites, Support { displacement: [None; 2], body_force: [sign * 1e3 / depth, 0.0] })
        };
        let loads = Loads::new(bonds.sites(), &[side(1.0), side(-1.0)]);
        let law = Law::ChainOffset.build(720.0, 1200.0, Law::ChainOffset.rescales())?;
        let modulus = modulus(Space::PlaneStress, 1e6, RATIO * spacing, THICKNESS);
        Ok(Self { bonds, loads, law, modulus })
    }

    fn solve(&mut self, method: &str, tolerance: f64) -> Result<State<2>, Error> {
        let mut method: Box<dyn Equilibrium<2>> = if method == "adr" {
            Box::new(RelaxationSolver::new(DynamicRelaxation { tolerance, ..Default::default() }))
        } else {
            Box::new(LbfgsSolver::new(Lbfgs { tolerance, ..Default::default() }))
        };
        let mut state = State::new(self.bonds.sites());
        let mut system =
            System::new(&mut self.bonds, BondMaterial::new(&*self.law, self.modulus), &self.loads, &[1.0]);
        load_stepping(&mut *method, &mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(()))?;
        Ok(state)
    }

    /// Returns the largest difference of two displacements over the root mean square of the second.
    fn apart(&self, state: &State<2>, exact: &State<2>) -> f64 {
        let (mut largest, mut sum) = (0.0_f64, 0.0);
        let particles = self.bonds.particles();
        for &site in particles {
            let (a, b) = (state.displacement.get(site as usize), exact.displacement.get(site as usize));
            for d in 0..2 {
                largest = largest.max((a[d] - b[d]).abs());
                sum += b[d] * b[d];
            }
        }
        largest / (sum / particles.len() as f64).sqrt()
    }
}

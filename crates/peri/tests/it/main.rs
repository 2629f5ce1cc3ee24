//! Tests of the public interface against plain sums, closed forms and the independent tables of
//! `formulation.md` (chapter 2), whose scripts wrote `stress_patch.csv` and `stress_surface.csv`.

mod affine;
mod answers;
#[cfg(target_arch = "x86_64")]
mod assembly;
mod balance;
mod bodies;
mod clouds;
mod cohesive;
mod composites;
mod contact;
mod cracks;
mod curves;
mod dynamics;
mod enclosures;
mod equilibria;
mod examples;
mod fields;
mod filter;
mod forces;
mod friction;
mod friction_equilibria;
mod hardy;
mod homogeneous;
mod impact;
mod indenters;
mod lammps;
mod lbfgs;
mod learnt;
mod limits;
#[path = "../../examples/linear_solid.rs"]
mod linear_solid;
mod load_steps;
mod loads;
mod looks;
mod materials;
mod model;
mod pace;
mod part_solids;
mod parts;
mod periodic;
mod pictures;
mod pressed;
mod pressures;
mod prestrain;
mod relaxation;
mod relaxing;
mod rigid;
mod rotations;
#[path = "../../examples/rubber_bearing.rs"]
mod rubber_bearing;
mod sliding;
mod softening;
mod solid_kernels;
mod solids;
mod spectra;
mod steps_in_contact;
mod stress;
mod surface;
mod tearing;
mod time_step;
mod tractions;
mod turning_steps;
mod waves;
mod work;

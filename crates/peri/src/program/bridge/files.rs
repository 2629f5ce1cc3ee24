//! Writes the files of an export, in mm and N: thresholds of LAMMPS assume numbers near 1.

use super::{BondType, LammpsModel};
use crate::Error;
use crate::potential::BondPotential;
use crate::program::scene::{Scene, region_names};
use crate::solver::Loads;
use polycore::file::{atomic_write, prepare_directory};
use std::io::Write;
use std::path::Path;

/// Smallest number of points of a table: 16,000 over l = 0 to 80 keep forces to 1e-12.
const LEAST_POINTS: usize = 16_000;
/// Points per unit of stretch of longer tables.
const POINT_DENSITY: f64 = 200.0;
/// Smallest stretch of tables: bonds beside a running crack are crushed nearly to zero.
const LEAST_STRETCH: f64 = 1e-6;
const MM: f64 = 1e3;

/// Writes all files.
pub(super) fn write<const D: usize>(
    model: &LammpsModel<D>,
    scene: &Scene,
    loads: &Loads<D>,
    [text_of_scene, variant]: [&str; 2],
    output: &Path,
) -> Result<(), Error> {
    prepare_directory(output)?;
    let points = model.points();
    let (text, names) = (model.input(points), region_names(scene));
    let mut json = model.json(scene, &names[..loads.held_regions.len().min(names.len())]);
    json["variant"] = variant.into();
    atomic_write(output.join("scene.toml"), |file| file.write_all(text_of_scene.as_bytes()))?;
    atomic_write(output.join("peri.data"), |file| model.write_data(file))?;
    atomic_write(output.join("peri.table"), |file| model.write_tables(points, file))?;
    atomic_write(output.join("in.peri"), |file| file.write_all(text.as_bytes()))?;
    atomic_write(output.join("check.csv"), |file| model.write_check(file))?;
    atomic_write(output.join("drive.py"), |file| file.write_all(include_bytes!("drive.py")))?;
    atomic_write(output.join("README.md"), |file| file.write_all(include_bytes!("README.md")))?;
    atomic_write(output.join("model.json"), |file| {
        serde_json::to_writer_pretty(&mut *file, &json)?;
        file.write_all(b"\n")
    })?;
    Ok(())
}

/// Law of the tables: beyond `switch` it continues linearly without falling, because LAMMPS aborts outside a
/// table.
struct ContinuedLaw<'a> {
    law: &'a dyn BondPotential,
    switch: f64,
}

impl ContinuedLaw<'_> {
    fn slope(&self) -> f64 {
        self.law.tension_derivative(self.switch).max(0.0)
    }

    fn tension(&self, l: f64) -> f64 {
        let beyond = (l - self.switch).max(0.0);
        let slope = if beyond > 0.0 { self.slope() * beyond } else { 0.0 };
        self.law.tension(l.min(self.switch)) + slope
    }

    fn energy(&self, l: f64) -> f64 {
        let beyond = (l - self.switch).max(0.0);
        let linear = if beyond > 0.0 {
            beyond * (self.law.tension(self.switch) + 0.5 * self.slope() * beyond)
        } else {
            0.0
        };
        self.law.energy(l.min(self.switch)) + linear
    }
}

impl<const D: usize> LammpsModel<'_, D> {
    /// Returns the largest stretch of the tables: the shortest bond across the widest gap; without breaking,
    /// several times the mean stretch.
    pub(super) fn largest_stretch(&self) -> f64 {
        match self.critical {
            Some(critical) => (2.0 * critical).max(2.0 + 1.1 * self.reach / self.spacing),
            None => {
                let size = (0..D).map(|d| {
                    let ends = |(low, high): (f64, f64), x: &[f64; D]| (low.min(x[d]), high.max(x[d]));
                    let (low, high) = self.positions.iter().fold((f64::MAX, f64::MIN), ends);
                    high - low + self.spacing
                });
                3.0 + 4.0 * self.reach / size.fold(f64::MAX, f64::min)
            }
        }
    }

    pub(super) fn points(&self) -> usize {
        LEAST_POINTS.max((POINT_DENSITY * self.largest_stretch()).ceil() as usize)
    }

    fn law(&self) -> ContinuedLaw<'_> {
        // slightly beyond the criterion, so that the kink of the spline affects no intact bond
        let switch = self.critical.map_or(f64::INFINITY, |critical| 1.02 * critical + 0.02);
        ContinuedLaw { law: self.law, switch }
    }

    /// Writes the data file with `atom_style bond`: bond type = reference length, molecule = clamp.
    pub(super) fn write_data(&self, file: &mut impl Write) -> std::io::Result<()> {
        let (atoms, bonds, types) = (self.positions.len(), self.bonds.len(), self.types.len());
        writeln!(
            file,
            "peri export; mm, N\n\n{atoms} atoms\n{bonds} bonds\n1 atom types\n{types} bond types\n"
        )?;
        let margin = 1.5 * self.farthest + 4.0 * self.horizon;
        for (d, axis) in ["x", "y", "z"].iter().enumerate() {
            let ends = |(low, high): (f64, f64), x: &[f64; D]| (low.min(x[d]), high.max(x[d]));
            let (low, high) = match d < D {
                true => self.positions.iter().fold((f64::MAX, f64::MIN), ends),
                false => (0.0, 0.0),
            };
            let margin = if d < D { margin * MM } else { 0.5 };
            writeln!(file, "{} {} {axis}lo {axis}hi", low * MM - margin, high * MM + margin)?;
        }
        writeln!(file, "\nMasses\n\n1 {}\n\nAtoms # bond\n", self.mass())?;
        for (index, (x, label)) in self.positions.iter().zip(&self.labels).enumerate() {
            writeln!(file, "{} {label} 1 {}", index + 1, format_position(x))?;
        }
        writeln!(file, "\nBonds\n")?;
        for (index, &(kind, a, b)) in self.bonds.iter().enumerate() {
            writeln!(file, "{} {} {} {}", index + 1, kind + 1, a + 1, b + 1)?;
        }
        Ok(())
    }

    /// Writes tables of force −2 kθ t w V_I V_J, N, and energy, N mm, over the length, mm, for each reference
    /// length.
    pub(super) fn write_tables(&self, points: usize, file: &mut impl Write) -> std::io::Result<()> {
        let (law, longest) = (self.law(), self.largest_stretch());
        let slope = |l: f64| if l > law.switch { law.slope() } else { self.law.tension_derivative(l) };
        let rows: Vec<[f64; 3]> = (0..points)
            .map(|k| {
                let l = LEAST_STRETCH + (longest - LEAST_STRETCH) * k as f64 / (points - 1) as f64;
                [l, law.energy(l), law.tension(l)]
            })
            .collect();
        for (kind, &BondType { length, scale }) in self.types.iter().enumerate() {
            let length = length * MM;
            let ends = [LEAST_STRETCH, longest].map(|l| -scale * slope(l) / length);
            writeln!(file, "\nB{}\nN {points} FP {:e} {:e} EQ {length}\n", kind + 1, ends[0], ends[1])?;
            for (index, [l, energy, tension]) in rows.iter().enumerate() {
                let (energy, force) = (scale * length * energy, -scale * tension);
                writeln!(file, "{} {:e} {energy:e} {force:e}", index + 1, l * length)?;
            }
        }
        Ok(())
    }

    /// Returns the mass of particles with which FIRE's time step of 0.05 grows (at most ten-fold) to 0.8 of
    /// the critical step 2/ω of small strains: ω² ≤ 2 Σ|stiffness|/m.
    fn mass(&self) -> f64 {
        let mut sums = vec![0.0; self.positions.len()];
        for &(kind, a, b) in &self.bonds {
            let BondType { length, scale } = self.types[kind];
            let stiffness = scale * self.law.tangent().abs() / (length * MM);
            sums[a] += stiffness;
            sums[b] += stiffness;
        }
        let critical: f64 = 10.0 * 0.05 / 0.8;
        0.5 * critical.powi(2) * sums.iter().fold(f64::MIN_POSITIVE, |most: f64, &sum| most.max(sum))
    }

    /// Returns the input script that `drive.py` loads first.
    pub(super) fn input(&self, points: usize) -> String {
        let mut text = format!(
            "# written by `peri export lammps`; lengths in mm, forces in N\n\
             variable cutoff index {cutoff}\nunits lj\ndimension {D}\nboundary {boundary}\n\
             newton on\natom_style bond\n\
             atom_modify map array\ncomm_modify cutoff ${{cutoff}}\nspecial_bonds lj 0 1 1 coul 0 1 1\n\
             bond_style table spline {points}\nfix broken all property/atom i_broken\nread_data peri.data\n",
            cutoff = self.cutoff(),
            boundary = if D == 2 { "f f p" } else { "f f f" },
        );
        for kind in 1..=self.types.len() {
            text += &format!("bond_coeff {kind} peri.table B{kind}\n");
        }
        text += &format!("neighbor {} bin\nneigh_modify delay 0 every 1 check yes\n", self.spacing * MM);
        if D == 2 {
            text += "fix plane all enforce2d\n";
        }
        for (index, clamp) in self.clamps.iter().enumerate() {
            let held = [0, 1, 2].map(|d| if clamp.mask >> d & 1 == 1 { "0" } else { "NULL" });
            let number = index + 1;
            text += &format!("group clamp{number} molecule {number}\n");
            text += &format!("fix clamp{number} clamp{number} setforce {}\n", held.join(" "));
        }
        text +=
            "variable marks atom i_broken\ncompute cut all reduce sum v_marks\nvariable cut equal c_cut\n";
        text += "thermo_style custom step bonds ebond fnorm v_cut\nthermo_modify norm no lost error\n\
                 thermo 100000\n";
        text += &format!("min_style fire\nmin_modify dmax {}\ntimestep 0.05\n", 0.5 * self.spacing * MM);
        text
    }

    /// Returns the communication cutoff of ranks, mm: the longest intact bond.
    fn cutoff(&self) -> f64 {
        2.0 * MM * self.horizon * self.critical.unwrap_or(self.largest_stretch().min(4.0))
    }

    pub(super) fn json(&self, scene: &Scene, regions: &[String]) -> serde_json::Value {
        let clamps: Vec<serde_json::Value> = self
            .clamps
            .iter()
            .map(|clamp| {
                serde_json::json!({
                    "mask": clamp.mask, "displacement_mm": clamp.displacement.map(|u| u * MM).to_vec(),
                    "regions": clamp.regions,
                })
            })
            .collect();
        let factors = scene.load_steps().0;
        serde_json::json!({
            "format": "peri-lammps 1", "dimension": D, "clamps": clamps, "regions": regions,
            "lengths_mm": self.types.iter().map(|kind| kind.length * MM).collect::<Vec<f64>>(),
            "critical_stretch": self.critical, "factors": factors, "reach_mm": self.reach * MM,
            "tolerance": scene.tolerance(),
            "stop_below": scene.solver.stop_below.map_or(0.0, |part| part.si()),
            "every": scene.output.every.unwrap_or(factors.len()).max(1), "cutoff_mm": self.cutoff(),
            "predictor": self.predictor.iter().map(|row| row.to_vec()).collect::<Vec<_>>(),
        })
    }

    /// Writes positions, mm, and forces, N, of the self-check state.
    pub(super) fn write_check(&self, file: &mut impl Write) -> std::io::Result<()> {
        let places_now = self.check_state();
        writeln!(file, "id,x [mm],y [mm],z [mm],fx [N],fy [N],fz [N]")?;
        for (index, (x, force)) in places_now.iter().zip(self.forces(&places_now)).enumerate() {
            let force = force.map(|f| f / MM);
            writeln!(
                file,
                "{},{},{}",
                index + 1,
                format_position(x).replace(' ', ","),
                format_position(&force).replace(' ', ",")
            )?;
        }
        Ok(())
    }
}

/// Formats three numbers, m as mm, so that reading restores the same bits.
fn format_position<const D: usize>(x: &[f64; D]) -> String {
    let place = |d: usize| x.get(d).map_or(0.0, |x| x * MM);
    format!("{} {} {}", place(0), place(1), place(2))
}

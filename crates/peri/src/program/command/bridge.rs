//! `peri export`, `peri import` and `peri compare`: exchange with other engines.

use crate::program::bridge::{self, BOUND};
use crate::program::run::PeriFailure;
use clap::Subcommand;
use harness::case::terminal::default_output;
use harness::scene::Source;
use std::path::PathBuf;

/// Engine to export to.
#[derive(Subcommand)]
pub enum ExportCommand {
    /// Write data, bond tables, input, driver and self-check state of a bond law on a lattice.
    Lammps {
        /// The scene (TOML).
        scene: PathBuf,
        /// Folder for the files; default: out/NAME-lammps.
        #[arg(long, short)]
        output: Option<PathBuf>,
        /// Variant of a scene with several.
        #[arg(long, value_name = "NAME")]
        variant: Option<String>,
    },
}

impl ExportCommand {
    /// Writes the files.
    pub fn print(self) -> Result<bool, PeriFailure> {
        let Self::Lammps { scene, output, variant } = self;
        let source = Source::read(&scene)?;
        let output = output.unwrap_or_else(|| {
            let mut folder = default_output(&scene).into_os_string();
            folder.push("-lammps");
            folder.into()
        });
        let written = bridge::export(&source, variant.as_deref(), &output)?;
        harness::say!(
            "{} particles, {} bonds, {} tables in {}\nrun it there: mpiexec -n N python drive.py",
            written.particles,
            written.bonds,
            written.types,
            output.display()
        );
        Ok(true)
    }
}

/// Engine to import from.
#[derive(Subcommand)]
pub enum ImportCommand {
    /// Read the results of `drive.py`: report, history, curve, fields; judge the expectations of the scene.
    Lammps {
        /// Folder of `peri export lammps` in which `drive.py` has run.
        folder: PathBuf,
        /// Folder for the results; default: FOLDER/results.
        #[arg(long, short)]
        output: Option<PathBuf>,
    },
}

impl ImportCommand {
    /// Reads and judges the results.
    pub fn print(self) -> Result<bool, PeriFailure> {
        let Self::Lammps { folder, output } = self;
        let output = output.unwrap_or_else(|| folder.join("results"));
        let report = bridge::import(&folder, &output)?;
        harness::say!("{}{}results in {}", report.table(), report.verdict(), output.display());
        Ok(report.passed)
    }
}

/// Engine to compare with.
#[derive(Subcommand)]
pub enum CompareCommand {
    /// Run the self-check state of an export in LAMMPS; exit code 1 if forces differ.
    Lammps {
        /// Folder of `peri export lammps`.
        folder: PathBuf,
        /// Python with the modules `lammps` and `numpy`; default: $PERI_LAMMPS_PYTHON, else `python3`.
        #[arg(long)]
        python: Option<PathBuf>,
    },
}

impl CompareCommand {
    /// Runs the comparison and judges it.
    pub fn print(self) -> Result<bool, PeriFailure> {
        let Self::Lammps { folder, python } = self;
        let python = python.or_else(|| std::env::var_os("PERI_LAMMPS_PYTHON").map(PathBuf::from));
        let python = python.unwrap_or_else(|| "python3".into());
        let mut good = true;
        for found in bridge::compare(&folder, &python)? {
            harness::say!(
                "{} rank(s): largest difference of forces over rms {:.2e} (at most {BOUND:.0e})",
                found.ranks,
                found.largest
            );
            good &= found.largest <= BOUND;
        }
        Ok(good)
    }
}

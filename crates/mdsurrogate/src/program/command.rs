//! Command line of `mdsurrogate`.

// harness::say! does not panic when the reader of a pipe has gone
#![deny(clippy::print_stdout, clippy::print_stderr)]

use crate::Error;
use crate::dataset::{BoxReference, LammpsUnits, PressureConvention, ReadOptions, SampledColumns, read};
use crate::export::{CSource, OnnxOptions, c_source, fortran_source, onnx};
use crate::program::run::{Mdsurrogate, describe};
use crate::surrogate::Surrogate;
use harness::report::Report;
use harness::scene::Failure;
use polycore::file::atomic_write;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

mod eval;
mod md;
mod predict;

#[derive(clap::Subcommand)]
enum Command {
    /// Evaluate laws on the data of a scene: errors, physics, held-out runs, error against time.
    Eval(eval::Eval),
    /// Describe a table (CSV, CSV.GZ, HDF5): runs, ranges, noise.
    Info {
        /// Table (CSV, CSV.GZ, HDF5, LAMMPS output).
        file: PathBuf,
        /// Read instantaneous instead of averaged columns.
        #[arg(long)]
        instantaneous: bool,
        /// Units of LAMMPS output that does not state them: real, metal, si, cgs, electron, micro, nano.
        #[arg(long)]
        units: Option<String>,
        /// Undeformed row: the first row of each run (run) or of the file (file).
        #[arg(long)]
        reference: Option<String>,
        /// Read columns pxx … as pressures of LAMMPS, σ = −p.
        #[arg(long)]
        pressure: bool,
    },
    /// Run molecular dynamics with LAMMPS: write, prepare, run (also to continue), collect.
    #[command(subcommand)]
    Md(md::Md),
    /// Export a law (safetensors) as source code or ONNX.
    Export {
        /// Law to export.
        law: PathBuf,
        /// Output files, named after the function: out/pa12 gives out/pa12.c and out/pa12.h, out/pa12.f90 or
        /// out/pa12.onnx.
        output: PathBuf,
        /// Format of the export.
        #[arg(long, value_enum, default_value_t = ExportFormat::C)]
        form: ExportFormat,
        /// Write ONNX with numbers of 32 bits instead of 64.
        #[arg(long)]
        single: bool,
        /// Write ONNX with the tangent; C and Fortran always have it.
        #[arg(long)]
        tangent: bool,
    },
    /// Predict stress, tangent and uncertainty at the strains of a table.
    Predict(predict::Predict),
}

/// Runs the command line of this process.
pub fn main() -> ExitCode {
    harness::case::main::<Mdsurrogate, _>(|command| match command {
        Command::Eval(eval) => eval.run(),
        Command::Info { file, instantaneous, units, reference, pressure } => {
            let options = read_options(instantaneous, units.as_deref(), reference.as_deref(), pressure);
            options.and_then(|options| info(&file, &options)).map_err(Failure::from)
        }
        Command::Md(md) => md.run().map_err(Failure::from),
        Command::Export { law, output, form, single, tangent } => {
            export(&law, &output, form, OnnxOptions { single, tangent }).map_err(Failure::from)
        }
        Command::Predict(predict) => predict.print().map_err(Failure::from),
    })
}

/// Returns options for reading a table, as in `[data]` of a scene.
fn read_options(
    instantaneous: bool,
    units: Option<&str>,
    reference: Option<&str>,
    pressure: bool,
) -> Result<ReadOptions, Error> {
    let wrong = |name, found: &str, allowed: &str| Error::Parameter {
        name,
        found: format!("`{found}`"),
        allowed: allowed.to_owned(),
    };
    let units = units.map(|name| {
        let known = LammpsUnits::ALL.iter().find(|(known, _)| *known == name);
        let names = LammpsUnits::ALL.map(|(name, _)| name).join(", ");
        known.map(|(_, units)| *units).ok_or_else(|| wrong("units", name, &names))
    });
    let origin = reference.map(|name| match name {
        "run" => Ok(BoxReference::Run),
        "file" => Ok(BoxReference::File),
        other => Err(wrong("reference", other, "run, file")),
    });
    Ok(ReadOptions {
        columns: if instantaneous { SampledColumns::Instantaneous } else { SampledColumns::Averaged },
        units: units.transpose()?,
        origin: origin.transpose()?,
        pressure: pressure.then_some(PressureConvention::Pressure),
        ..ReadOptions::default()
    })
}

fn info(file: &Path, options: &ReadOptions) -> Result<bool, Error> {
    let set = read(file, options)?;
    let mut report = Report::new("mdsurrogate", env!("CARGO_PKG_VERSION"), "");
    describe(&mut report, "", &set);
    harness::case::terminal::print(report.table());
    harness::say!("constant components: {}", set.constant_components().join(", "));
    for line in &set.provenance {
        harness::say!("{line}");
    }
    Ok(true)
}

fn export(law: &Path, output: &Path, form: ExportFormat, options: OnnxOptions) -> Result<bool, Error> {
    if options != OnnxOptions::default() && form != ExportFormat::Onnx {
        let found = if options.single { "--single" } else { "--tangent" }.to_owned();
        let allowed = "`--form onnx` (C and Fortran have double precision and the tangent)".to_owned();
        return Err(Error::Parameter { name: "option of export", found, allowed });
    }
    // `out/` names a folder but no function
    let folder = output.as_os_str().as_encoded_bytes().ends_with(b"/");
    let name = output.file_name().filter(|_| !folder).unwrap_or_default().to_string_lossy().into_owned();
    let law = Surrogate::read(law)?;
    let files = match form {
        ExportFormat::C => {
            let CSource { header, source } = c_source(&law, &name)?;
            vec![("h", header.into_bytes()), ("c", source.into_bytes())]
        }
        ExportFormat::Fortran => vec![("f90", fortran_source(&law, &name)?.into_bytes())],
        ExportFormat::Onnx => vec![("onnx", onnx(&law, options)?)],
    };
    if let Some(folder) = output.parent() {
        std::fs::create_dir_all(folder).map_err(Error::from_io("create", folder))?;
    }
    for (end, bytes) in files {
        let path = output.with_file_name(format!("{name}.{end}"));
        atomic_write(&path, |file| file.write_all(&bytes))?;
        harness::say!("{}", path.display());
    }
    Ok(true)
}

/// Format of an exported law.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum ExportFormat {
    /// C99: source and header.
    C,
    /// Fortran 2008: a subroutine and a UMAT.
    Fortran,
    /// ONNX, operator set 17.
    Onnx,
}

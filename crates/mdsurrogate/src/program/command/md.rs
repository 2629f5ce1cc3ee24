//! `mdsurrogate md`: molecular dynamics with LAMMPS.

use crate::Error;
use crate::dataset::{ReadOptions, hdf5, read};
use crate::md::{Engine, Folder, MdPlan, MdRun, Protocol, RateGrid, Stepwise};
use std::path::{Path, PathBuf};

#[derive(clap::Subcommand)]
pub enum Md {
    /// Write cell, inputs, plan and a SLURM job array into a folder.
    Write(Box<WriteArguments>),
    /// Relax the box at 0 K, equilibrate, and write the start configurations.
    Prepare(FolderArguments),
    /// Run all unfinished runs, after preparation if needed; repeat after an interruption.
    Run {
        #[command(flatten)]
        place: FolderArguments,
        /// Number of parallel runs, one core each.
        #[arg(long, default_value_t = 1)]
        jobs: usize,
        /// Run only this run of the plan; for job arrays, which do not join tables.
        #[arg(long)]
        index: Option<usize>,
    },
    /// Join the tables of all finished runs into runs.csv and runs.h5.
    Collect {
        /// Folder of the runs.
        folder: PathBuf,
    },
}

#[derive(clap::Args)]
pub struct FolderArguments {
    /// Folder written by `md write`.
    folder: PathBuf,
    /// LAMMPS: an executable, or a Python interpreter that can import `lammps`; default: searched in PATH.
    #[arg(long)]
    lammps: Option<PathBuf>,
    /// ReaxFF force field; default: ffield.reax.mattsson of LAMMPS.
    #[arg(long)]
    force_field: Option<PathBuf>,
}

#[derive(clap::Args)]
pub struct WriteArguments {
    /// Folder of the runs.
    folder: PathBuf,
    /// Cells along x, y, z.
    #[arg(long, num_args = 3, default_values_t = [8, 4, 2])]
    cells: Vec<usize>,
    /// Levels of rate per direction: n uniaxial runs per direction, n² biaxial runs per pair; 0 for paths
    /// only.
    #[arg(long, default_value_t = 15)]
    levels: usize,
    /// Engineering strains in x, y, z at the end of a run with the largest rate.
    #[arg(long, num_args = 3, default_values_t = [0.5, 0.6, 0.15])]
    ultimate_strains: Vec<f64>,
    /// Factor on all rates of the grid.
    #[arg(long, default_value_t = 1.0)]
    rate_scale: f64,
    /// General path, rates in 1/fs: x=1e-5,xy=2e-5; unload=0.6 reverses it after that fraction; may be
    /// repeated.
    #[arg(long)]
    path: Vec<String>,
    /// Number of runs per path, with different start configurations and velocities.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=100))]
    replicas: u16,
    /// Time step, fs.
    #[arg(long, default_value_t = 0.5)]
    time_step: f64,
    /// Number of steps per run.
    #[arg(long, default_value_t = 10_000)]
    steps: u64,
    /// Steps between samples.
    #[arg(long, default_value_t = 100)]
    every: u64,
    /// Load stepwise, as for Fig. 3.5: in each interval between samples PULL steps apply the strain, RELAX
    /// steps of NVT follow, and the rest is averaged.
    #[arg(long, num_args = 2, value_names = ["PULL", "RELAX"])]
    stepwise: Option<Vec<u64>>,
    /// Temperature, K.
    #[arg(long, default_value_t = 300.0)]
    temperature: f64,
    /// Steps of box relaxation at 0 K.
    #[arg(long, default_value_t = 200)]
    relaxation: u64,
    /// Steps of NVT after the initial velocities.
    #[arg(long, default_value_t = 400)]
    warm_up: u64,
    /// Steps of NPT at 1 atm.
    #[arg(long, default_value_t = 100_000)]
    equilibration: u64,
    /// Steps of NVT before the first start configuration.
    #[arg(long, default_value_t = 1200)]
    settling: u64,
    /// Number of start configurations.
    #[arg(long, default_value_t = 6)]
    snapshots: usize,
    /// Steps between start configurations.
    #[arg(long, default_value_t = 300)]
    gap: u64,
    /// Seed of the initial velocities.
    #[arg(long, default_value_t = 1201)]
    seed: u32,
}

impl Md {
    pub fn run(self) -> Result<bool, Error> {
        match self {
            Self::Write(write) => write.run(),
            Self::Prepare(place) => {
                let (folder, engine) = place.open()?;
                let _lock = harness::case::lock_run(&place.folder)?;
                folder.prepare(&engine)?;
                harness::say!("reference lengths {:?} Å", folder.reference_lengths()?);
                Ok(true)
            }
            Self::Run { place, jobs, index } => {
                let (folder, engine) = place.open()?;
                if let Some(index) = index {
                    folder.run_index(&engine, index)?;
                    return Ok(true);
                }
                // in a job array each process has its own run
                let _lock = harness::case::lock_run(&place.folder)?;
                folder.prepare(&engine)?;
                let (all, open) = (folder.plan().runs.len(), folder.open_runs().len());
                harness::say!("{} of {all} runs are finished", all - open);
                folder.run(&engine, jobs, &|run, result| match result {
                    Ok(()) => harness::say!("{} finished", run.id),
                    Err(error) => harness::case::terminal::complain(format_args!("{}: {error}\n", run.id)),
                })?;
                join(&place.folder)
            }
            Self::Collect { folder } => join(&folder),
        }
    }
}

/// Writes runs.csv, and runs.h5 with the averaged columns.
fn join(folder: &Path) -> Result<bool, Error> {
    let count = Folder::open(folder)?.collect()?;
    let table = folder.join("runs.csv");
    hdf5::write(folder.join("runs.h5"), &read(&table, &ReadOptions::default())?, None)?;
    harness::say!("{count} runs in {} and runs.h5", table.display());
    Ok(true)
}

impl FolderArguments {
    fn open(&self) -> Result<(Folder, Engine), Error> {
        let folder = Folder::open(&self.folder)?;
        let engine = Engine::find(self.lammps.as_deref())?;
        folder.force_field(self.force_field.as_deref(), &engine)?;
        Ok((folder, engine))
    }
}

impl WriteArguments {
    fn run(self) -> Result<bool, Error> {
        let three = |values: &[f64]| [values[0], values[1], values[2]];
        let protocol = Protocol {
            cells: [self.cells[0], self.cells[1], self.cells[2]],
            time_step: self.time_step,
            steps: self.steps,
            every: self.every,
            temperature: self.temperature,
            relaxation: self.relaxation,
            warm_up: self.warm_up,
            equilibration: self.equilibration,
            settling: self.settling,
            snapshots: self.snapshots,
            gap: self.gap,
            seed: self.seed,
            stepwise: self.stepwise.as_deref().and_then(|steps| match steps {
                [pull, relax] => Some(Stepwise { pull: *pull, relax: *relax }),
                _ => None,
            }),
        };
        protocol.check()?;
        let grid = RateGrid {
            levels: self.levels,
            ultimate_strains: three(&self.ultimate_strains),
            rate_scale: self.rate_scale,
        };
        let mut runs = grid.runs(&protocol)?;
        for (index, text) in self.path.iter().enumerate() {
            runs.push(MdRun::parse(text, format!("p{index}"), runs.len() % protocol.snapshots)?);
        }
        let runs: Vec<MdRun> =
            runs.into_iter().flat_map(|run| run.replicas(usize::from(self.replicas), &protocol)).collect();
        let atoms = 148 * protocol.cells.iter().product::<usize>();
        let atom_steps = runs.len() as f64 * protocol.steps as f64 * atoms as f64;
        harness::say!(
            "{} runs of {} steps with {atoms} atoms: {atom_steps:.2e} atom-steps, {:.0} core-hours at \
             15,000 per second",
            runs.len(),
            protocol.steps,
            atom_steps / 15e3 / 3600.0
        );
        Folder::create(&self.folder, MdPlan { protocol, runs })?;
        harness::say!("written to {}", self.folder.display());
        Ok(true)
    }
}

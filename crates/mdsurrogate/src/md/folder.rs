//! Folder of a set of runs: preparation, runs, resumption and collection.

use super::{Engine, MdPlan, MdRun, input, results};
use crate::Error;
use crate::cell::{Crystal, LATTICE, Packing};
use polycore::file::atomic_write;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A set of runs on disk.
#[derive(Debug, Clone)]
pub struct Folder {
    path: PathBuf,
    plan: MdPlan,
}

impl Folder {
    /// Writes plan, cell, inputs and job scripts into a folder.
    ///
    /// # Errors
    /// Returns [`Error::Parameter`] for an invalid plan, repeated run names, or a folder with another plan;
    /// I/O errors.
    pub fn create(path: impl Into<PathBuf>, plan: MdPlan) -> Result<Self, Error> {
        let path = path.into();
        plan.protocol.check()?;
        if plan.runs.is_empty() {
            return Err(Error::parameter("runs", 0, "at least one run (levels or paths)"));
        }
        if plan.protocol.stepwise.is_some() && plan.runs.iter().any(|run| run.unload.is_some()) {
            return Err(Error::parameter("runs", "`unload` together with steps", "one of them"));
        }
        let mut names: Vec<&str> = plan.runs.iter().map(|run| run.id.as_str()).collect();
        names.sort_unstable();
        if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(Error::parameter(
                "runs",
                format!("`{}` twice", twice[0]),
                "different names of all runs",
            ));
        }
        if path.join("plan.json").exists() && Self::open(&path)?.plan != plan {
            let found = format!("{} with another plan", path.display());
            return Err(Error::parameter("folder", found, "an empty folder, or one with the same plan"));
        }
        for folder in ["", "in", "prepared", "runs", "work"] {
            fs::create_dir_all(path.join(folder)).map_err(Error::from_io("create", path.join(folder)))?;
        }
        let folder = Self { path, plan };
        folder.write_inputs()?;
        Ok(folder)
    }

    /// Opens a folder written by [`Folder::create`].
    ///
    /// # Errors
    /// Returns [`Error::File`] for a damaged plan, and I/O errors.
    pub fn open(path: impl Into<PathBuf>) -> Result<Self, Error> {
        let path = path.into();
        let file = path.join("plan.json");
        let text = fs::read_to_string(&file).map_err(Error::from_io("read", &file))?;
        let plan: MdPlan = serde_json::from_str(&text)
            .map_err(|error| Error::file(&file, error, "a plan written by `mdsurrogate md write`"))?;
        plan.protocol.check()?;
        Ok(Self { path, plan })
    }

    /// Returns the plan.
    pub fn plan(&self) -> &MdPlan {
        &self.plan
    }

    /// Returns the indices of unfinished runs.
    pub fn open_runs(&self) -> Vec<usize> {
        (0..self.plan.runs.len()).filter(|&index| !self.run_table(index).is_file()).collect()
    }

    /// Copies the force field into the folder: the named file, or `ffield.reax.mattsson` of the engine.
    ///
    /// # Errors
    /// Returns [`Error::Parameter`] with the searched places; I/O errors.
    pub fn force_field(&self, named: Option<&Path>, engine: &Engine) -> Result<(), Error> {
        let target = self.path.join(input::FORCE_FIELD);
        let source = match named {
            Some(path) => path.to_path_buf(),
            None if target.is_file() => return Ok(()),
            None => {
                let places: Vec<PathBuf> =
                    engine.potentials().into_iter().map(|place| place.join("ffield.reax.mattsson")).collect();
                let found = places.iter().find(|place| place.is_file());
                found.cloned().ok_or_else(|| {
                    let looked: Vec<String> =
                        places.iter().map(|place| place.display().to_string()).collect();
                    let found = format!("no file at {}", looked.join(", "));
                    Error::parameter("force field", found, "one of them, or `--force-field FILE`")
                })?
            }
        };
        let bytes = fs::read(&source).map_err(Error::from_io("read", &source))?;
        Ok(atomic_write(target, |file| file.write_all(&bytes))?)
    }

    /// Relaxes the box at 0 K, equilibrates, and writes the start configurations; existing results are kept.
    ///
    /// # Errors
    /// Returns the errors of the engine.
    pub fn prepare(&self, engine: &Engine) -> Result<(), Error> {
        let protocol = &self.plan.protocol;
        let (small, copies) = relaxed_cells(protocol.cells);
        let prepared = |name: &str| self.path.join("prepared").join(name);
        self.write("in/cell.data", &crystal(small)?.lammps_data("gamma-PA12, orthogonal"))?;
        if !prepared("relaxed.data").is_file() {
            let text = input::relax(protocol, "in/cell.data", "work/relaxed.data");
            self.stage(engine, "relax", &text)?;
            self.keep("work/relaxed.data", "prepared/relaxed.data")?;
        }
        if !prepared("equilibrated.data").is_file() {
            let text = input::equilibrate(
                protocol,
                copies,
                "prepared/relaxed.data",
                "work/equilibrated.data",
                "work/lengths.txt",
            );
            self.stage(engine, "equilibrate", &text)?;
            self.keep("work/lengths.txt", "prepared/lengths.txt")?;
            self.keep("work/equilibrated.data", "prepared/equilibrated.data")?;
        }
        if !prepared(&format!("start_{}.data", protocol.snapshots)).is_file() {
            let lengths = self.reference_lengths()?;
            let text = input::snapshots(protocol, lengths, "prepared/equilibrated.data", "work/start");
            self.stage(engine, "snapshots", &text)?;
            // the last one marks completion
            for k in 1..=protocol.snapshots {
                self.keep(&format!("work/start_{k}.data"), &format!("prepared/start_{k}.data"))?;
            }
        }
        Ok(())
    }

    /// Returns the mean lengths of the equilibrated box, Å, rounded to six decimals: the reference of all
    /// runs.
    ///
    /// # Errors
    /// Returns [`Error::File`] for a file without three positive numbers; I/O errors (not prepared yet).
    pub fn reference_lengths(&self) -> Result<[f64; 3], Error> {
        let path = self.path.join("prepared/lengths.txt");
        let text = fs::read_to_string(&path).map_err(Error::from_io("read (prepare first)", &path))?;
        let line = text.lines().rfind(|line| !line.starts_with('#') && !line.trim().is_empty());
        let numbers: Vec<f64> =
            line.unwrap_or_default().split_whitespace().skip(1).map_while(|word| word.parse().ok()).collect();
        match numbers[..] {
            [x, y, z] if [x, y, z].iter().all(|l| l.is_finite() && *l > 0.0) => {
                Ok([x, y, z].map(|length| (length * 1e6).round() / 1e6))
            }
            _ => {
                Err(Error::file(&path, format!("`{}`", line.unwrap_or_default()), "a step and three lengths"))
            }
        }
    }

    /// Runs one run of the plan, unless it is finished, and writes its table.
    ///
    /// # Errors
    /// Returns [`Error::Parameter`] for an invalid index, and the errors of the engine and
    /// [`results::read_run`].
    pub fn run_index(&self, engine: &Engine, index: usize) -> Result<(), Error> {
        let Some(run) = self.plan.runs.get(index) else {
            let allowed = format!("0 to {}", self.plan.runs.len() - 1);
            return Err(Error::parameter("run", index, allowed));
        };
        if self.run_table(index).is_file() {
            return Ok(());
        }
        let reference = self.reference_lengths()?;
        let id = &run.id;
        engine.run(&self.path, &format!("runs/{id}.in"), &format!("work/{id}.log"))?;
        let file = |end: &str| self.path.join(format!("work/{id}.{end}"));
        let (inst, mean) = (file("inst"), file("mean"));
        let (samples, means) = results::read_run(&inst, &mean, &self.plan.protocol)?;
        let rows = results::table(&self.plan.protocol, run, reference, &samples, &means);
        self.write(&format!("runs/{id}.csv"), &(results::heading() + &rows))?;
        for file in [inst, mean, file("log")] {
            let _ = fs::remove_file(file);
        }
        Ok(())
    }

    /// Runs all unfinished runs, `jobs` at a time; joins the tables and calls `report` after each.
    ///
    /// A failed run does not stop the others.
    ///
    /// # Errors
    /// Returns the first error, after all runs have been tried.
    pub fn run(
        &self,
        engine: &Engine,
        jobs: usize,
        report: &(dyn Fn(&MdRun, &Result<(), Error>) + Sync),
    ) -> Result<(), Error> {
        let open = self.open_runs();
        let next = AtomicUsize::new(0);
        let failure: Mutex<Option<Error>> = Mutex::new(None);
        let keep = |result: Result<(), Error>| {
            // the lock is poisoned if another worker panicked; its data are still valid
            let mut first = failure.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            let joined = result.and_then(|()| self.collect().map(|_| ()));
            if let Err(error) = joined
                && first.is_none()
            {
                *first = Some(error);
            }
        };
        std::thread::scope(|scope| {
            for _ in 0..jobs.clamp(1, 1024).min(open.len().max(1)) {
                scope.spawn(|| {
                    while let Some(&index) = open.get(next.fetch_add(1, Ordering::Relaxed)) {
                        let result = self.run_index(engine, index);
                        report(&self.plan.runs[index], &result);
                        keep(result);
                    }
                });
            }
        });
        match failure.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner) {
            Some(error) => Err(error),
            None => Ok(()),
        }
    }

    /// Joins the tables of finished runs into `runs.csv`, in the order of the plan; returns their number.
    ///
    /// # Errors
    /// Returns I/O errors.
    pub fn collect(&self) -> Result<usize, Error> {
        let mut text = results::heading();
        let mut count = 0;
        for index in 0..self.plan.runs.len() {
            let path = self.run_table(index);
            if path.is_file() {
                let table = fs::read_to_string(&path).map_err(Error::from_io("read", &path))?;
                text.push_str(table.split_once('\n').map_or("", |(_, rows)| rows));
                count += 1;
            }
        }
        self.write("runs.csv", &text)?;
        Ok(count)
    }

    fn run_table(&self, index: usize) -> PathBuf {
        self.path.join(format!("runs/{}.csv", self.plan.runs[index].id))
    }

    fn write(&self, name: &str, text: &str) -> Result<(), Error> {
        Ok(atomic_write(self.path.join(name), |file| file.write_all(text.as_bytes()))?)
    }

    fn keep(&self, from: &str, to: &str) -> Result<(), Error> {
        let (from, to) = (self.path.join(from), self.path.join(to));
        fs::rename(&from, &to).map_err(Error::from_io("rename", from))
    }

    fn stage(&self, engine: &Engine, name: &str, text: &str) -> Result<(), Error> {
        self.write(&format!("in/{name}.in"), text)?;
        engine.run(&self.path, &format!("in/{name}.in"), &format!("work/{name}.log"))
    }

    fn write_inputs(&self) -> Result<(), Error> {
        let protocol = &self.plan.protocol;
        let plan = serde_json::to_string_pretty(&self.plan)
            .map_err(|error| Error::file(&self.path, error, "a plan of finite numbers"))?;
        self.write("in/control.reax", input::CONTROL)?;
        self.write("in/driver.py", input::DRIVER)?;
        self.write(
            "in/cell.data",
            &crystal(relaxed_cells(protocol.cells).0)?.lammps_data("gamma-PA12, orthogonal"),
        )?;
        for run in &self.plan.runs {
            let start = format!("prepared/start_{}.data", run.snapshot % protocol.snapshots + 1);
            let text = input::deform(protocol, run, &start, &format!("work/{}", run.id));
            self.write(&format!("runs/{}.in", run.id), &text)?;
        }
        self.write("job.sh", &job_script(self.plan.runs.len()))?;
        // the plan is written last: it marks a complete folder
        self.write("plan.json", &(plan + "\n"))
    }
}

/// Returns the cell that is relaxed at 0 K, and its repetitions for the equilibration: the relaxed crystal is
/// periodic in one cell; two cells along x limit the number of images inside ReaxFF's cut-offs.
fn relaxed_cells(cells: [usize; 3]) -> ([usize; 3], [usize; 3]) {
    if cells[0].is_multiple_of(2) {
        ([2, 1, 1], [cells[0] / 2, cells[1], cells[2]])
    } else {
        ([1, 1, 1], cells)
    }
}

fn crystal(cells: [usize; 3]) -> Result<Crystal, Error> {
    Crystal::unit_cell(&LATTICE, Packing::default())?.replicate(cells)
}

/// Returns a SLURM job array with one run per core.
fn job_script(runs: usize) -> String {
    format!(
        "#!/bin/sh
# One run per core. First, once: mdsurrogate md prepare . --lammps lmp
# then: sbatch job.sh; at the end: mdsurrogate md collect .
#SBATCH --job-name=mdsurrogate
#SBATCH --array=0-{}
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=1
#SBATCH --time=12:00:00
#SBATCH --output=work/slurm-%A_%a.txt
exec mdsurrogate md run . --lammps \"${{LAMMPS:-lmp}}\" --index \"$SLURM_ARRAY_TASK_ID\"
",
        runs - 1
    )
}

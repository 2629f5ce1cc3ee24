//! `peri` compared with LAMMPS' `peri/pmb`: the same elastic block, particles, horizon and steps, alternating
//! runs in one session; and the forces of both, particle by particle.

use std::path::{Path, PathBuf};

use miette::{IntoDiagnostic, Result, WrapErr, miette};

use super::forces::{ForceDifference, Snapshot, compare, contact};
use super::lammps::{Lammps, read_forces, write_particles};
use super::{Row, external};
use crate::table::TextTable;
use crate::workspace::Repository;

/// Spacing of particles (m), horizon over it, bulk modulus (Pa): those of `crates/peri/benches/block.rs`.
const SPACING: f64 = 5e-4;
const RATIO: f64 = 3.015;
const BULK_MODULUS: f64 = 14.9e9;

/// Particles along an edge, and steps of a run that takes LAMMPS seconds.
const SIZES: [(u16, u32); 2] = [(22, 100), (46, 20)];
const THREADS: [usize; 2] = [1, 2];
/// Number of alternating pairs of runs, whose medians count.
const ROUNDS: usize = 5;

/// Gradients of the displacement: bonds within 2 %, and a compression in which particles touch.
const SMALL: f64 = 0.01;
const LARGE: f64 = 0.2;

/// Difference of forces that counts as agreement, in units of their root mean square: bonds are fitted to
/// 1e-9 of their force (the solver's bound), and their sum is about ten times as large as the net force.
const SAME_FORCES: f64 = 1e-8;

/// Returns rows, tables, and whether both programs solved the same problem.
pub fn run(workspace: &Repository, folder: &Path) -> Result<(Vec<Row>, String, bool)> {
    let mut peers = Peers {
        lammps: Lammps::find(workspace)?,
        peri: workspace.bench("peri")?,
        folder: folder.join("peri-peers"),
        rows: Vec::new(),
        same: true,
        forces: TextTable::new(["forces", "particles", "max |Δf|/rms f", "at cell", "differing", "why"]),
        rates: TextTable::new([
            "particles",
            "threads",
            "steps",
            "LAMMPS bonds/s",
            "peri bonds/s",
            "LAMMPS particle·steps/s",
            "peri particle·steps/s",
            "peri/LAMMPS (least–most)",
        ]),
    };
    std::fs::create_dir_all(&peers.folder)
        .into_diagnostic()
        .wrap_err_with(|| format!("cannot create {}", peers.folder.display()))?;
    let before = load();
    peers.one_step(SIZES[0].0)?;
    let mut version = String::new();
    for (cells, steps) in SIZES {
        peers.start(cells, SMALL)?;
        for threads in THREADS {
            version = peers.alternate(cells, steps, threads)?;
        }
        peers.after_steps(cells, steps)?;
    }
    let after = load();
    let shown = |load: Option<f64>| load.map_or_else(|| "?".to_owned(), |load| load.to_string());
    let text = format!(
        "LAMMPS ({version}) peri/pmb, 1 MPI process a thread; medians of {ROUNDS} alternating runs; bonds \
         are directed\n\
         load average of the machine: {} before, {} after\n\n{}\n{}",
        shown(before),
        shown(after),
        peers.rates.text(),
        peers.forces.text()
    );
    for (what, value) in [("machine: load before", before), ("machine: load after", after)] {
        peers.push(what, 0, 0, value, "");
    }
    Ok((peers.rows, text, peers.same))
}

struct Peers {
    lammps: Lammps,
    peri: PathBuf,
    folder: PathBuf,
    rows: Vec<Row>,
    same: bool,
    forces: TextTable<6>,
    rates: TextTable<8>,
}

/// Expected relation of two sets of forces.
enum Expectation {
    /// Equal up to rounding and the fitted law.
    Same,
    /// Different, for this reason.
    Differ(&'static str),
}

impl Peers {
    /// Compares forces of one displacement in both programs, and explains their differences.
    fn one_step(&mut self, cells: u16) -> Result<()> {
        let run = |peers: &Self| -> Result<Vec<[f64; 3]>> {
            peers.lammps.run(&peers.folder, SPACING, 0, 1)?;
            read_forces(&peers.folder)
        };
        let partial = self.start(cells, SMALL)?;
        let lammps = run(self)?;
        self.judge("partial volumes", &partial, &lammps, Expectation::Same)?;
        let flags = format!("{cells} --steps 0 --strain {SMALL}");
        let sharp = self.snapshot(&format!("{flags} --partial-volumes --fit-bound 1e-13"))?;
        self.judge("partial volumes, law fitted to 1e-13", &sharp, &lammps, Expectation::Same)?;
        let full = self.snapshot(&flags)?;
        let why = "LAMMPS always scales volumes within Δx/2 of the horizon: 0.69 V at 2√2 Δx, 0.52 V at 3 Δx";
        self.judge("full volumes (our default)", &full, &lammps, Expectation::Differ(why))?;
        let mut touching = self.start(cells, LARGE)?;
        let lammps = run(self)?;
        let why = "LAMMPS' contact force, never off: pairs nearer than min(0.9 |ξ|, 1.35 Δx)";
        self.judge("partial volumes, strain 0.2", &touching, &lammps, Expectation::Differ(why))?;
        let push = contact(&touching, SPACING, RATIO * SPACING, BULK_MODULUS);
        for (force, push) in touching.forces.iter_mut().zip(push) {
            *force = [force[0] + push[0], force[1] + push[1], force[2] + push[2]];
        }
        self.judge("the same plus contact forces", &touching, &lammps, Expectation::Same)
    }

    /// Alternates runs; returns LAMMPS' version and keeps its last forces for [`Self::after_steps`].
    fn alternate(&mut self, cells: u16, steps: u32, threads: usize) -> Result<String> {
        let (count, words) = (u64::from(cells).pow(3), [cells.to_string(), steps.to_string()]);
        let number = threads.to_string();
        let arguments =
            ["--threads", &number, "--block", &words[0], "--steps", &words[1], "--partial-volumes"];
        let work = count as f64 * f64::from(steps);
        let (mut theirs, mut ours, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
        let (mut bonds, mut version) = (0.0, String::new());
        for _ in 0..ROUNDS {
            let run = self.lammps.run(&self.folder, SPACING, steps, threads)?;
            let rows = external(&self.peri, &arguments.map(str::to_owned))?;
            let of = |unit: &str| rows.iter().find(|row| row.unit == unit).and_then(|row| row.value);
            let (Some(found), Some(rate)) = (of("directed bonds"), of("particle·steps/s")) else {
                return Err(miette!("--block printed no rates"));
            };
            bonds = found;
            if run.bonds as f64 != bonds {
                return Err(miette!("not the same bonds: {} in LAMMPS, {bonds} in peri", run.bonds));
            }
            theirs.push(work / run.seconds);
            ours.push(rate);
            ratios.push(rate * run.seconds / work);
            version = run.version;
        }
        let per_particle = bonds / count as f64;
        let (theirs, ours, ratio) = (median(&mut theirs), median(&mut ours), median(&mut ratios));
        for (name, rate) in [("LAMMPS peri/pmb", theirs), ("peri", ours)] {
            self.push(name, count, threads, Some(rate * per_particle), "directed bonds/s");
            self.push(name, count, threads, Some(rate), "particle·steps/s");
        }
        self.push("peri/LAMMPS", count, threads, Some(ratio), "");
        self.rates.push([
            count.to_string(),
            number,
            steps.to_string(),
            format!("{:.3e}", theirs * per_particle),
            format!("{:.3e}", ours * per_particle),
            format!("{theirs:.3e}"),
            format!("{ours:.3e}"),
            // sorted by now
            format!("{ratio:.1} ({:.1}–{:.1})", ratios[0], ratios[ROUNDS - 1]),
        ]);
        Ok(version)
    }

    /// Compares forces at the end of the timed runs.
    fn after_steps(&mut self, cells: u16, steps: u32) -> Result<()> {
        let ours = self.snapshot(&format!("{cells} --steps {steps} --strain {SMALL} --partial-volumes"))?;
        let lammps = read_forces(&self.folder)?;
        self.judge(&format!("partial volumes, after {steps} steps"), &ours, &lammps, Expectation::Same)
    }

    /// Computes the initial displacement with its forces, also as input of LAMMPS.
    fn start(&self, cells: u16, strain: f64) -> Result<Snapshot> {
        let start = self.snapshot(&format!("{cells} --steps 0 --strain {strain} --partial-volumes"))?;
        write_particles(&self.folder, &start, SPACING)?;
        Ok(start)
    }

    /// Reads the snapshot that `measure --block` writes last; `flags` begin with the cells.
    fn snapshot(&self, flags: &str) -> Result<Snapshot> {
        let path = self.folder.join("state.csv");
        let words = format!("--block {flags}");
        let mut arguments: Vec<String> = words.split(' ').map(str::to_owned).collect();
        arguments.extend(["--state".to_owned(), path.display().to_string()]);
        external(&self.peri, &arguments)?;
        Snapshot::read(&path)
    }

    /// Compares the forces of `state` with LAMMPS'; adds a row to their table.
    fn judge(&mut self, what: &str, state: &Snapshot, lammps: &[[f64; 3]], claim: Expectation) -> Result<()> {
        let Some(ForceDifference { largest, at, differing }) = compare(&state.forces, lammps) else {
            return Err(miette!("{what}: {} and {} forces, or all zero", state.forces.len(), lammps.len()));
        };
        let same = largest <= SAME_FORCES;
        let why = match claim {
            Expectation::Same if same => "rounding and the fitted law".to_owned(),
            Expectation::Same => format!("UNKNOWN: at most {SAME_FORCES:e} was expected"),
            Expectation::Differ(why) => why.to_owned(),
        };
        self.same &= same || matches!(claim, Expectation::Differ(_));
        let count = lammps.len();
        self.forces.push([
            what.to_owned(),
            count.to_string(),
            format!("{largest:.2e}"),
            state.positions[at].map(|x| (x / SPACING).floor().to_string()).join(","),
            differing.to_string(),
            why,
        ]);
        self.push(&format!("forces, {what}: max |Δf|/rms f"), count as u64, 1, Some(largest), "");
        Ok(())
    }

    fn push(&mut self, what: &str, size: u64, threads: usize, value: Option<f64>, unit: &str) {
        self.rows.push(Row { what: what.to_owned(), size, threads, value, unit: unit.to_owned() });
    }
}

/// Median of an odd number of values; sorts them.
fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Load average of the last minute, if the system provides it.
fn load() -> Option<f64> {
    std::fs::read_to_string("/proc/loadavg").ok()?.split_whitespace().next()?.parse().ok()
}

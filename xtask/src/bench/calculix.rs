//! CalculiX as a separate program: its input and output.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use miette::{IntoDiagnostic, Result, WrapErr, miette};

/// Environment variable with another program than `ccx`.
const VARIABLE: &str = "CCX";

/// Installation of CalculiX.
pub struct Calculix {
    program: PathBuf,
}

/// Mesh in a file that the input includes.
pub struct CalculixMesh {
    file: String,
    nodes: u64,
    /// Element and side, from 1, of all sides but the bottom.
    sides: Vec<(u64, u8)>,
}

/// Result of a run.
pub struct CalculixRun {
    /// Wall time of the program, s.
    pub seconds: f64,
    /// Temperatures of all nodes after the last step, K.
    pub temperatures: Vec<f64>,
}

impl CalculixMesh {
    /// Creates the input from a file as `crates/crystfem/benches/brick.rs` writes it.
    pub fn new(file: &str, text: &str, nodes: u64) -> Self {
        let (mut sides, mut inside) = (Vec::new(), false);
        for line in text.lines() {
            if line.starts_with('*') {
                inside = line.starts_with("*SURFACE") && !line.contains("NAME=bottom");
            } else if inside
                && let Some((element, side)) = line.split_once(",S")
                && let (Ok(element), Ok(side)) = (element.parse(), side.parse())
            {
                sides.push((element, side));
            }
        }
        Self { file: file.to_owned(), nodes, sides }
    }

    /// Formats the input: temperatures of all nodes are printed after the last step.
    fn deck(&self, steps: u32, solver: &str) -> String {
        let each = |line: &dyn Fn(u64, u8) -> String| -> String {
            self.sides.iter().map(|&(element, side)| line(element, side) + "\n").collect()
        };
        let film = each(&|element, side| format!("{element},F{side},353.15,15"));
        let radiation = each(&|element, side| format!("{element},R{side},353.15,0.9"));
        let mut deck =
            format!("*INCLUDE,INPUT={}\n*NSET,NSET=NALL,GENERATE\n1,{},1\n", self.file, self.nodes);
        deck += "*MATERIAL,NAME=PA12\n*CONDUCTIVITY\n0.25\n*DENSITY\n1010\n*SPECIFIC HEAT\n2200\n\
                 *PHYSICAL CONSTANTS,ABSOLUTE ZERO=0,STEFAN BOLTZMANN=5.670374419e-8\n\
                 *SOLID SECTION,ELSET=brick,MATERIAL=PA12\n*INITIAL CONDITIONS,TYPE=TEMPERATURE\n\
                 NALL,493.15\n";
        let _ = write!(
            deck,
            "*STEP,INC=100000\n*HEAT \
             TRANSFER,DIRECT,SOLVER={solver}\n0.5,{}\n*BOUNDARY\nbottom,11,11,353.15\n\
             *FILM\n{film}*RADIATE\n{radiation}*NODE PRINT,NSET=NALL,FREQUENCY={steps}\nNT\n*END STEP\n",
            0.5 * f64::from(steps)
        );
        deck
    }
}

impl Calculix {
    /// Finds the program; the error says how to install it.
    pub fn find() -> Result<Self, String> {
        let program = std::env::var_os(VARIABLE).map_or_else(|| PathBuf::from("ccx"), PathBuf::from);
        match Command::new(&program).arg("-v").stdin(Stdio::null()).output() {
            Ok(output) if String::from_utf8_lossy(&output.stdout).contains("Version") => Ok(Self { program }),
            _ => Err(format!(
                "no program `{}` (Debian: apt install calculix-ccx; {VARIABLE} names another)",
                program.display()
            )),
        }
    }

    /// Runs an input in `folder`, which contains the mesh, on one thread.
    pub fn run(&self, folder: &Path, mesh: &CalculixMesh, steps: u32, solver: &str) -> Result<CalculixRun> {
        std::fs::write(folder.join("calculix.inp"), mesh.deck(steps, solver)).into_diagnostic()?;
        let since = Instant::now();
        let output = Command::new(&self.program)
            .args(["-i", "calculix"])
            .current_dir(folder)
            .env("OMP_NUM_THREADS", "1")
            .stdin(Stdio::null())
            .output()
            .into_diagnostic()
            .wrap_err("cannot start CalculiX")?;
        let seconds = since.elapsed().as_secs_f64();
        let text = String::from_utf8_lossy(&output.stdout);
        if !output.status.success() || !text.contains("Job finished") {
            let wrong = text.lines().skip_while(|line| !line.contains("*ERROR")).take(4);
            let wrong: Vec<&str> = wrong.collect();
            return Err(miette!("CalculiX: {}\n{}", output.status, wrong.join("\n")));
        }
        let path = folder.join("calculix.dat");
        let printed = std::fs::read_to_string(&path).into_diagnostic()?;
        let temperatures = temperatures(&printed);
        if temperatures.len() as u64 != mesh.nodes {
            return Err(miette!(
                "{}: {} temperatures of {} nodes",
                path.display(),
                temperatures.len(),
                mesh.nodes
            ));
        }
        Ok(CalculixRun { seconds, temperatures })
    }
}

/// Parses lines `NODE VALUE` of one table, in the order of nodes.
fn temperatures(printed: &str) -> Vec<f64> {
    let pair = |line: &str| {
        let mut words = line.split_whitespace();
        let (node, value) = (words.next()?.parse::<u64>().ok()?, words.next()?.parse::<f64>().ok()?);
        words.next().is_none().then_some((node, value))
    };
    let mut pairs: Vec<(u64, f64)> = printed.lines().filter_map(pair).collect();
    pairs.sort_by_key(|pair| pair.0);
    pairs.into_iter().map(|pair| pair.1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decks_and_tables() {
        let text = "*NODE\n1,0,0,0\n*SURFACE,NAME=bottom,TYPE=ELEMENT\n1,S1\n\
                    *SURFACE,NAME=top,TYPE=ELEMENT\n1,S2\n7,S2\n";
        let mesh = CalculixMesh::new("brick.inp", text, 8);
        let deck = mesh.deck(20, "SPOOLES");
        assert!(
            deck.contains("*FILM\n1,F2,353.15,15\n7,F2,353.15,15\n*RADIATE\n1,R2,353.15,0.9\n"),
            "{deck}"
        );
        assert!(deck.contains("SOLVER=SPOOLES\n0.5,10\n") && !deck.contains("F1"), "{deck}");
        let printed =
            "\n temperatures for set NALL and time  0.1000000E+02\n\n   2  3.5E+02\n   1  4.931500E+02\n";
        assert_eq!(temperatures(printed), [493.15, 350.0]);
    }
}

//! Results of a run: instantaneous samples and interval means, converted to rows of the data table.

use super::{AXES, MdRun, Protocol};
use crate::Error;
use crate::kinematics::cauchy_from_pressure;
use polycore::tensor::Voigt;
use std::fmt::Write;
use std::path::Path;

/// Number of columns in the files of LAMMPS, after the step.
const COLUMNS: usize = 14;

/// Line of `fix ave/time`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MdSample {
    /// Time step.
    pub step: u64,
    /// Temperature, K.
    pub temperature: f64,
    /// Potential energy, kcal/mol.
    pub energy: f64,
    /// Box lx, ly, lz, xy, xz, yz, Å.
    pub box_shape: [f64; 6],
    /// Cauchy stress σ, Pa, positive in tension.
    pub cauchy: Voigt,
}

/// Reads the two files of a run: samples at steps 0, every, 2·every, …, and means over the intervals between
/// them.
///
/// # Errors
/// Returns [`Error::Cell`] for invalid numbers, [`Error::File`] for missing lines (a truncated run) or
/// columns.
pub fn read_run(
    inst: &Path,
    mean: &Path,
    protocol: &Protocol,
) -> Result<(Vec<MdSample>, Vec<MdSample>), Error> {
    let intervals = protocol.steps / protocol.every;
    let samples = read(inst, 0..=intervals, protocol.every)?;
    Ok((samples, read(mean, 1..=intervals, protocol.every)?))
}

fn read(path: &Path, numbers: std::ops::RangeInclusive<u64>, every: u64) -> Result<Vec<MdSample>, Error> {
    let text = std::fs::read_to_string(path).map_err(Error::from_io("read", path))?;
    let mut samples = Vec::new();
    for (index, line) in text.lines().enumerate().filter(|(_, line)| !line.trim_start().starts_with('#')) {
        let cells: Vec<&str> = line.split_whitespace().collect();
        if cells.len() != COLUMNS + 1 {
            let found = format!("{} columns in line {}", cells.len(), index + 1);
            return Err(Error::file(path, found, format!("{} columns", COLUMNS + 1)));
        }
        let mut values = [0.0; COLUMNS];
        for (column, (value, cell)) in values.iter_mut().zip(&cells[1..]).enumerate() {
            let number = cell.parse::<f64>().ok().filter(|number| number.is_finite());
            *value = number.ok_or_else(|| Error::Cell {
                path: path.to_path_buf(),
                line: index as u64 + 1,
                column: (column + 2).to_string(),
                found: format!("`{cell}`"),
                allowed: "a finite number".into(),
            })?;
        }
        let step = cells[0].parse().unwrap_or(u64::MAX);
        let expected = (numbers.start() + samples.len() as u64) * every;
        if step != expected {
            let found = format!("step {} in line {}", cells[0], index + 1);
            return Err(Error::file(path, found, format!("step {expected}")));
        }
        let mut box_shape = [0.0; 6];
        box_shape.copy_from_slice(&values[2..8]);
        let cauchy = cauchy_from_pressure(&Voigt::from_row_slice(&values[8..14]));
        samples.push(MdSample { step, temperature: values[0], energy: values[1], box_shape, cauchy });
    }
    let needed = numbers.count();
    if samples.len() != needed {
        let found = format!("{} lines of a truncated run", samples.len());
        return Err(Error::file(path, found, format!("{needed} lines")));
    }
    Ok(samples)
}

/// Returns the headings of the data table.
pub fn heading() -> String {
    let mut text = String::from("run_id,kind");
    for axis in AXES {
        let _ = write!(text, ",rate_{axis}");
    }
    text.push_str(",sample,time_fs,lx,ly,lz,xy,xz,yz,F11,F22,F33,sxx,syy,szz,sxy,sxz,syz,temp,pe");
    for name in ["lx", "ly", "lz", "xy", "xz", "yz", "sxx", "syy", "szz", "sxy", "sxz", "syz", "temp"] {
        let _ = write!(text, ",avg_{name}");
    }
    text.push('\n');
    text
}

/// Returns the rows of one run in the data table: stress in MPa, F_ii = l_i/L_i; `reference` contains the
/// lengths L, Å.
pub fn table(
    protocol: &Protocol,
    run: &MdRun,
    reference: [f64; 3],
    samples: &[MdSample],
    means: &[MdSample],
) -> String {
    let mut text = String::new();
    for (index, sample) in samples.iter().enumerate() {
        let _ = write!(text, "{},{}", run.id, run.kind);
        for rate in run.rates {
            let _ = write!(text, ",{}", rate.map_or(String::new(), |rate| format!("{rate:e}")));
        }
        let _ = write!(text, ",{index},{}", sample.step as f64 * protocol.time_step);
        for length in sample.box_shape {
            let _ = write!(text, ",{length:?}");
        }
        for (length, reference) in sample.box_shape.iter().zip(reference) {
            let _ = write!(text, ",{:?}", length / reference);
        }
        for stress in &sample.cauchy {
            let _ = write!(text, ",{:.4}", stress / 1e6);
        }
        let _ = write!(text, ",{},{}", sample.temperature, sample.energy);
        match index.checked_sub(1).and_then(|interval| means.get(interval)) {
            Some(mean) => {
                for length in mean.box_shape {
                    let _ = write!(text, ",{length:?}");
                }
                for stress in &mean.cauchy {
                    let _ = write!(text, ",{:.4}", stress / 1e6);
                }
                let _ = writeln!(text, ",{}", mean.temperature);
            }
            None => {
                let _ = writeln!(text, "{}", ",".repeat(13));
            }
        }
    }
    text
}

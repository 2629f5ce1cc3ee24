//! Laws at many points: flat arrays in, flat arrays out, on all threads and without the interpreter's lock.

use crate::watch::stoppable;
use numpy::{IntoPyArray, PyArrayMethods, PyReadonlyArray2};
use polycore::constitutive::{Error, Law, Prediction, Workspace};
use polycore::tensor::Voigt;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// Number of points that a thread computes at once.
const CHUNK: usize = 256;

/// Indices of the six components among the nine of a tensor, row by row.
const UPPER: [usize; 6] = [0, 4, 8, 1, 2, 5];

/// Indices of their mirror images.
const LOWER: [usize; 6] = [0, 4, 8, 3, 6, 7];

/// Options of a prediction at rows of `width` numbers.
#[derive(Clone, Copy)]
struct PredictOptions {
    width: usize,
    tangent: bool,
    uncertainty: bool,
    /// Allowed asymmetry of C, relative to its largest entry.
    rounding: f64,
}

/// Predictions at N points.
#[derive(Default)]
struct Predicted {
    stress: Vec<f64>,
    tangent: Vec<f64>,
    energy: Vec<f64>,
    spread: Vec<f64>,
    deviation: Vec<f64>,
    /// Eight flags per point: six components outside, far, spread.
    flags: Vec<bool>,
    unseen: Vec<bool>,
}

/// Share of the output that a thread fills.
struct OutputChunk<'a> {
    c: &'a [f64],
    stress: &'a mut [f64],
    tangent: Option<&'a mut [f64]>,
    energy: &'a mut [f64],
    uncertainty: Option<UncertaintyChunk<'a>>,
}

struct UncertaintyChunk<'a> {
    spread: &'a mut [f64],
    deviation: &'a mut [f64],
    flags: &'a mut [bool],
    unseen: &'a mut [bool],
}

/// Predicts `stress` (N, 6) in Pa, `tangent` (N, 6, 6) in Pa if requested, `energy` (N) in J/m³ (NaN for a
/// law without), and for a learnt law `spread` (N), `deviation` (N, 6), `outside` and `unseen` (N, 6), `far`,
/// `disagree` (N), at the rows of C, (N, 6) or (N, 9). A C of nine components counts as symmetric within
/// `rounding` of its largest entry.
pub fn predict<'py>(
    py: Python<'py>,
    law: &dyn Law,
    c: &PyReadonlyArray2<'py, f64>,
    tangent: bool,
    uncertainty: bool,
    rounding: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let shape = c.as_array().dim();
    if ![6, 9].contains(&shape.1) {
        return Err(PyValueError::new_err(format!("C: found {} columns; allowed: 6 or 9", shape.1)));
    }
    let rows =
        c.as_slice().map_err(|_| PyValueError::new_err("C: found strides; allowed: contiguous rows"))?;
    let (count, width) = shape;
    let how = PredictOptions { width, tangent, uncertainty, rounding };
    let found = match count <= CHUNK {
        true => py.detach(|| evaluate(law, rows, how, &AtomicBool::new(false))),
        false => stoppable(py, |stop| evaluate(law, rows, how, stop))?,
    };
    let found = found.map_err(crate::error::value)?;
    let answer = PyDict::new(py);
    answer.set_item("stress", found.stress.into_pyarray(py).reshape([count, 6])?)?;
    answer.set_item("energy", found.energy.into_pyarray(py))?;
    if tangent {
        answer.set_item("tangent", found.tangent.into_pyarray(py).reshape([count, 6, 6])?)?;
    }
    if uncertainty {
        answer.set_item("spread", found.spread.into_pyarray(py))?;
        answer.set_item("deviation", found.deviation.into_pyarray(py).reshape([count, 6])?)?;
        answer.set_item("flags", found.flags.into_pyarray(py).reshape([count, 8])?)?;
        answer.set_item("unseen", found.unseen.into_pyarray(py).reshape([count, 6])?)?;
    }
    Ok(answer)
}

fn evaluate(
    law: &dyn Law,
    rows: &[f64],
    PredictOptions { width, tangent, uncertainty, rounding }: PredictOptions,
    stop: &AtomicBool,
) -> Result<Predicted, String> {
    let count = rows.len() / width;
    let mut found =
        Predicted { stress: vec![0.0; 6 * count], energy: vec![0.0; count], ..Predicted::default() };
    if tangent {
        found.tangent = vec![0.0; 36 * count];
    }
    if uncertainty {
        found.spread = vec![0.0; count];
        found.deviation = vec![0.0; 6 * count];
        found.flags = vec![false; 8 * count];
        found.unseen = vec![false; 6 * count];
    }
    let mut parts: Vec<OutputChunk<'_>> = Vec::with_capacity(count.div_ceil(CHUNK));
    let mut tangents = found.tangent.chunks_mut(36 * CHUNK);
    let mut spreads = found.spread.chunks_mut(CHUNK);
    let mut deviations = found.deviation.chunks_mut(6 * CHUNK);
    let mut flags = found.flags.chunks_mut(8 * CHUNK);
    let mut unseen = found.unseen.chunks_mut(6 * CHUNK);
    let whole = rows.chunks(width * CHUNK).zip(found.stress.chunks_mut(6 * CHUNK));
    for ((c, stress), energy) in whole.zip(found.energy.chunks_mut(CHUNK)) {
        let uncertainty = match (spreads.next(), deviations.next(), flags.next(), unseen.next()) {
            (Some(spread), Some(deviation), Some(flags), Some(unseen)) => {
                Some(UncertaintyChunk { spread, deviation, flags, unseen })
            }
            _ => None,
        };
        parts.push(OutputChunk { c, stress, tangent: tangents.next(), energy, uncertainty });
    }
    let fill = |memory: &mut (Workspace, Vec<Voigt>, Vec<Prediction>),
                (number, part): (usize, &mut OutputChunk<'_>)| {
        if stop.load(Ordering::Relaxed) {
            return Err((number * CHUNK, "stopped".to_owned()));
        }
        part.fill(law, width, rounding, memory).map_err(|(point, told)| (number * CHUNK + point, told))
    };
    let filled: Result<(), (usize, String)> = match &mut parts[..] {
        // no threads for few points
        [one] => fill(&mut Default::default(), (0, one)),
        parts => parts
            .par_iter_mut()
            .enumerate()
            .map_init(Default::default, |memory, part| fill(memory, part))
            .collect(),
    };
    match filled {
        Ok(()) => Ok(found),
        Err((point, told)) => Err(format!("point {point}: {told}")),
    }
}

impl OutputChunk<'_> {
    /// Evaluates the points; returns the first error and its point.
    fn fill(
        &mut self,
        law: &dyn Law,
        width: usize,
        rounding: f64,
        (memory, points, predictions): &mut (Workspace, Vec<Voigt>, Vec<Prediction>),
    ) -> Result<(), (usize, String)> {
        points.clear();
        for (point, row) in self.c.chunks_exact(width).enumerate() {
            points.push(match width {
                9 => {
                    let size = row.iter().fold(0.0, |size: f64, entry| size.max(entry.abs()));
                    let unlike = |&(i, j): &(usize, usize)| (row[i] - row[j]).abs() > rounding * size;
                    if let Some((i, j)) = [(1, 3), (2, 6), (5, 7)].into_iter().find(unlike) {
                        return Err((
                            point,
                            format!("C: found {} and {}; allowed: a symmetric tensor", row[i], row[j]),
                        ));
                    }
                    Voigt::from_fn(|a, _| 0.5 * (row[UPPER[a]] + row[LOWER[a]]))
                }
                _ => Voigt::from_fn(|a, _| row[a]),
            });
        }
        predictions.clear();
        predictions.resize(points.len(), Prediction::default());
        let told = |point: usize, error: Error| (point, error.to_string());
        if self.tangent.is_some() {
            for (point, (c, prediction)) in points.iter().zip(predictions.iter_mut()).enumerate() {
                *prediction = law.tangent(c, memory).map_err(|error| told(point, error))?;
            }
        } else if law.stresses(points, memory, predictions).is_err() {
            // one by one, to find the point of the error
            for (point, (c, prediction)) in points.iter().zip(predictions.iter_mut()).enumerate() {
                *prediction = law.stress(c, memory).map_err(|error| told(point, error))?;
            }
        }
        for (k, found) in predictions.iter().enumerate() {
            self.stress[6 * k..6 * k + 6].copy_from_slice(found.stress.as_slice());
            self.energy[k] = found.energy.unwrap_or(f64::NAN);
            if let (Some(tangent), Some(matrix)) = (&mut self.tangent, &found.tangent) {
                // nalgebra's columns are numpy's rows of the transposed
                for a in 0..6 {
                    for b in 0..6 {
                        tangent[36 * k + 6 * a + b] = matrix[(a, b)];
                    }
                }
            }
            if let Some(uncertainty) = &mut self.uncertainty {
                uncertainty.spread[k] = found.spread;
                uncertainty.deviation[6 * k..6 * k + 6].copy_from_slice(found.deviation.as_slice());
                let flags = &mut uncertainty.flags[8 * k..8 * k + 8];
                flags[..6].copy_from_slice(&found.flags.outside);
                (flags[6], flags[7]) = (found.flags.far, found.flags.spread);
                uncertainty.unseen[6 * k..6 * k + 6].copy_from_slice(&found.flags.unseen);
            }
        }
        Ok(())
    }
}

//! Coverage of the training data: representatives of their strains, and the distance of a C from them.
//!
//! A box says nothing about the gaps in it: paths are lines through six dimensions. Representatives are
//! training rows chosen one after the other, each the row farthest from those before it (Gonzalez 1985,
//! <https://doi.org/10.1016/0304-3975(85)90224-5>), so that no row is farther from them than
//! [`Support::radius`].

use crate::constitutive::Error;
use crate::constitutive::network::Real;
use crate::tensor::Voigt;
use crate::tensor::voigt::NAMES;
use pulp::{Arch, Simd, WithSimd};
use serde::{Deserialize, Serialize};

/// Largest number of representatives of a law.
pub const MOST_REPRESENTATIVES: usize = 4096;

/// Number of representatives compared at once.
const BLOCK: usize = 16;

/// Representatives of the training strains.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Support {
    /// C of each representative.
    pub points: Vec<[f64; 6]>,
    /// Inverse standard deviation of each component of C in the training data; 0 where it never changed.
    pub weights: [f64; 6],
    /// Greatest distance of a training row from its nearest representative, in standard deviations. For few
    /// rows, most of which are representatives, it is the greatest distance of a row from its nearest
    /// neighbour.
    pub radius: f64,
}

impl Support {
    /// Selects up to `most` representatives from the strains of training rows.
    ///
    /// # Errors
    /// [`Error::Invalid`] for no rows, rows that are not finite, or `most` outside of 1 to 4096.
    pub fn from_rows(rows: &[Voigt], most: usize) -> Result<Self, Error> {
        if !(1..=MOST_REPRESENTATIVES).contains(&most) {
            return Err(Error::invalid("representatives", most, format!("1 to {MOST_REPRESENTATIVES}")));
        }
        if let Some(row) = rows.iter().find(|row| !row.iter().all(|c| c.is_finite())) {
            return Err(Error::invalid("C", format!("{:?}", row.as_slice()), "finite components"));
        }
        let Some(first) = rows.first() else {
            return Err(Error::invalid("rows", 0, "at least one"));
        };
        let count = rows.len() as f64;
        let mean = rows.iter().sum::<Voigt>() / count;
        let mut weights = [0.0; 6];
        for (a, weight) in weights.iter_mut().enumerate() {
            let variance = rows.iter().map(|row| (row[a] - mean[a]).powi(2)).sum::<f64>() / count;
            // variance of a constant is rounding
            if variance.sqrt() > super::CONSTANT_TOLERANCE {
                *weight = 1.0 / variance.sqrt();
            }
        }
        let square =
            |a: &Voigt, b: &Voigt| -> f64 { (0..6).map(|k| ((a[k] - b[k]) * weights[k]).powi(2)).sum() };
        let mut points = vec![*first];
        let mut nearest: Vec<f64> = rows.iter().map(|row| square(row, first)).collect();
        let mut radius;
        loop {
            let (farthest, distance) = nearest
                .iter()
                .enumerate()
                .fold((0, 0.0), |best, (i, d)| if *d > best.1 { (i, *d) } else { best });
            radius = distance;
            if points.len() == most || distance == 0.0 {
                break;
            }
            points.push(rows[farthest]);
            for (distance, row) in nearest.iter_mut().zip(rows) {
                *distance = distance.min(square(row, &rows[farthest]));
            }
        }
        // if most rows are representatives, that distance is that of the closest rows, or 0, and every new
        // strain would be far: then the limit is the greatest distance of a row from its neighbour
        if 2 * points.len() > rows.len() {
            let others = |k: usize| rows.iter().enumerate().filter(move |(j, _)| *j != k).map(|(_, row)| row);
            let neighbour =
                |k: usize| others(k).map(|row| square(row, &rows[k])).fold(f64::INFINITY, f64::min);
            let greatest = (0..rows.len()).map(neighbour).filter(|d| d.is_finite()).fold(0.0, f64::max);
            radius = radius.max(greatest);
        }
        Ok(Self { points: points.into_iter().map(Into::into).collect(), weights, radius: radius.sqrt() })
    }

    /// Checks the representatives.
    ///
    /// # Errors
    /// [`Error::Invalid`] for no or too many representatives, or numbers that are not finite.
    pub fn check(&self) -> Result<(), Error> {
        if !(1..=MOST_REPRESENTATIVES).contains(&self.points.len()) {
            return Err(Error::invalid(
                "representatives",
                self.points.len(),
                format!("1 to {MOST_REPRESENTATIVES}"),
            ));
        }
        let numbers = self.points.as_flattened().iter().chain(&self.weights).chain([&self.radius]);
        if let Some(bad) = numbers.clone().find(|value| !value.is_finite()) {
            return Err(Error::invalid("representatives", bad, "finite numbers"));
        }
        if let Some(a) = (0..6).find(|&a| self.weights[a] < 0.0) {
            return Err(Error::invalid(
                "weight",
                format!("{} of C{}", self.weights[a], NAMES[a]),
                "0 or more",
            ));
        }
        if self.radius < 0.0 {
            return Err(Error::invalid("radius", self.radius, "0 or more"));
        }
        Ok(())
    }
}

/// [`Support`] in the order in which distances are computed.
#[derive(Debug, Clone)]
pub(super) struct Nearest<T> {
    /// Weighted components of [`BLOCK`] representatives each.
    blocks: Vec<[[T; BLOCK]; 6]>,
    weights: [T; 6],
    /// Slightly more than the radius: rounding moves no training row out.
    pub limit: f64,
}

impl<T: Real> Nearest<T> {
    pub fn new(support: &Support) -> Self {
        let chunks = support.points.chunks(BLOCK).map(|chunk| {
            let mut block = [[T::ZERO; BLOCK]; 6];
            for lane in 0..BLOCK {
                // the last one fills up the block
                let point = chunk[lane.min(chunk.len() - 1)];
                for a in 0..6 {
                    block[a][lane] = T::from_f64(point[a] * support.weights[a]);
                }
            }
            block
        });
        Self {
            blocks: chunks.collect(),
            weights: support.weights.map(T::from_f64),
            limit: support.radius * (1.0 + 1e-6) + 1e-5,
        }
    }

    /// Distance of the nearest representative, in standard deviations.
    pub fn distance(&self, c: &[T; 6]) -> f64 {
        Arch::new().dispatch(NearestSearch { nearest: self, c }).to_f64().sqrt()
    }
}

struct NearestSearch<'a, T> {
    nearest: &'a Nearest<T>,
    c: &'a [T; 6],
}

impl<T: Real> WithSimd for NearestSearch<'_, T> {
    type Output = T;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> T {
        let mut at = [T::ZERO; 6];
        for a in 0..6 {
            at[a] = self.c[a] * self.nearest.weights[a];
        }
        let mut least = [T::from_f64(f64::INFINITY); BLOCK];
        for block in &self.nearest.blocks {
            let mut square = [T::ZERO; BLOCK];
            for a in 0..6 {
                for lane in 0..BLOCK {
                    let difference = block[a][lane] - at[a];
                    square[lane] += difference * difference;
                }
            }
            for lane in 0..BLOCK {
                least[lane] = if square[lane] < least[lane] { square[lane] } else { least[lane] };
            }
        }
        let mut nearest = least[0];
        for lane in 1..BLOCK {
            nearest = if least[lane] < nearest { least[lane] } else { nearest };
        }
        nearest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn representatives_cover_the_rows() {
        // two paths, 0 … 1 along C11 and along C22; C33 constant
        let row = |k: usize| {
            let t = (k % 101) as f64 / 100.0;
            Voigt::new(
                if k < 101 { 1.0 + t } else { 1.0 },
                if k < 101 { 1.0 } else { 1.0 + t },
                1.0,
                0.0,
                0.0,
                0.0,
            )
        };
        let rows: Vec<Voigt> = (0..202).map(row).collect();
        let support = Support::from_rows(&rows, 40).unwrap();
        assert_eq!((support.points.len(), support.weights[2]), (40, 0.0));
        let nearest = Nearest::<f64>::new(&support);
        let brute = |c: &Voigt| {
            let square =
                |p: &[f64; 6]| (0..6).map(|a| ((p[a] - c[a]) * support.weights[a]).powi(2)).sum::<f64>();
            support.points.iter().map(square).fold(f64::INFINITY, f64::min).sqrt()
        };
        for c in &rows {
            assert!((nearest.distance(&(*c).into()) - brute(c)).abs() < 1e-12);
            assert!(brute(c) <= nearest.limit);
        }
        // inside the box of both paths, but on neither
        let gap = Voigt::new(1.9, 1.9, 1.0, 0.0, 0.0, 0.0);
        assert!(nearest.distance(&gap.into()) > 5.0 * support.radius);
        // more representatives than rows: rows 0.01 apart, in deviations of √2/100
        let few = Support::from_rows(&rows[..5], 100).unwrap();
        assert!(few.points.len() == 5 && (few.radius - 0.5f64.sqrt()).abs() < 1e-9);
        assert_eq!(Support::from_rows(&rows[..1], 100).unwrap().radius, 0.0);
        assert!(Support::from_rows(&[], 3).is_err() && Support::from_rows(&rows, 0).is_err());
        assert!(Support::from_rows(&[Voigt::repeat(f64::NAN)], 3).is_err());
        for bad in [
            Support { points: vec![], ..support.clone() },
            Support { radius: f64::NAN, ..support.clone() },
            Support { radius: -1.0, ..support.clone() },
            Support { weights: [-1.0; 6], ..support.clone() },
        ] {
            assert!(bad.check().is_err());
        }
    }
}

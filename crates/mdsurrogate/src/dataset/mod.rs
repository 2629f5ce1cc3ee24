//! Data sets of (C, S) by path: reading, checks, standardisation, splits, noise and leaks.

mod boxes;
#[cfg(feature = "hdf5")]
pub mod hdf5;
mod lammps;
mod options;
mod read;
mod split;
mod standardise;
pub(crate) mod statistics;
mod strains;
mod stress;
mod table;

pub use options::{BoxReference, LammpsUnits, PROPERTIES, PressureConvention, ReadOptions, SampledColumns};
pub use read::read;
pub use split::{DataSplit, Fractions, SplitMethod, split};
pub use standardise::Standardisation;
pub use statistics::{Leak, Noise, leak, noise};
pub use strains::read_strains;

use crate::Error;
use crate::kinematics::{NAMES, cauchy_from_material, material_pair, stretch_from_c};
use ndarray::{Array2, ArrayView2};
use polycore::constitutive::arrays::rows;
use polycore::tensor::{DeformationGradient, Tensor, Voigt};
use std::collections::{BTreeMap, HashMap, HashSet};

/// Plausible principal stretches; others suggest a wrong unit.
pub const STRETCHES: [f64; 2] = [0.1, 10.0];

/// Plausible root mean squares of the stress of a solid, Pa; others suggest a wrong unit.
pub const STRESSES: [f64; 2] = [1e2, 1e12];

/// Smallest outlier: a stress so many times the 90th percentile.
pub const OUTLIER: f64 = 1e3;

/// Sample: a deformation and its stress.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DataRow {
    /// Number of the sample in its run, as in the file.
    pub sample: u64,
    /// Time, s; NaN if the file has none.
    pub time: f64,
    /// F, or U = √C if the file contains only C.
    pub deformation: DeformationGradient,
    /// Cauchy stress σ, Pa, positive in tension.
    pub cauchy: Voigt,
    /// Right Cauchy–Green tensor C (3.2).
    pub c: Voigt,
    /// Second Piola–Kirchhoff stress S (3.3), Pa.
    pub s: Voigt,
    /// Nominal stresses P₁, P₂, Pa, if these were measured on an incompressible body with a free third face
    /// instead of the full stress; exactly 0: not measured. σ and S then contain their values, and 0
    /// elsewhere.
    pub nominal: Option<[f64; 2]>,
}

impl DataRow {
    /// Creates a row from F and σ; C and S follow from (3.5), (3.6).
    pub fn new(sample: u64, time: f64, deformation: DeformationGradient, cauchy: Voigt) -> Self {
        let (c, s) = material_pair(&deformation, &cauchy);
        Self { sample, time, deformation, cauchy, c, s, nominal: None }
    }

    /// Creates a row of an incompressible body with a free third face from λ₁, λ₂ (λ₃ = 1/(λ₁λ₂)) and P₁, P₂
    /// in Pa, 0 for a stress that was not measured.
    ///
    /// # Errors
    /// Returns an error for stretches that are not positive and finite.
    pub fn from_nominal(sample: u64, [a, b]: [f64; 2], nominal: [f64; 2]) -> Result<Self, Error> {
        let f = DeformationGradient::new(Tensor::from_diagonal(&[a, b, 1.0 / (a * b)].into()))?;
        // σᵢ = λᵢ Pᵢ for J = 1
        let cauchy = Voigt::new(nominal[0] * a, nominal[1] * b, 0.0, 0.0, 0.0, 0.0);
        Ok(Self { nominal: Some(nominal), ..Self::new(sample, f64::NAN, f, cauchy) })
    }

    /// Returns the map from a law's S to the measured nominal stresses: Pᵢ = (λᵢ² Sᵢᵢ − λ₃² S₃₃)/λᵢ, with the
    /// pressure eliminated by P₃ = 0; zero for stresses that were not measured. `None` for a full stress.
    pub fn elimination(&self) -> Option<[[f64; 6]; 6]> {
        let nominal = self.nominal?;
        let mut map = [[0.0; 6]; 6];
        for i in (0..2).filter(|&i| nominal[i] != 0.0) {
            let stretch = self.c[i].sqrt();
            (map[i][i], map[i][2]) = (stretch, -self.c[2] / stretch);
        }
        Some(map)
    }

    /// Returns measured and predicted stress, Pa: S, or the nominal stresses of [`DataRow::elimination`].
    pub fn compared(&self, predicted: &Voigt) -> [Voigt; 2] {
        let (Some(map), Some([first, second])) = (self.elimination(), self.nominal) else {
            return [self.s, *predicted];
        };
        let sum = |a: usize| map[a].iter().zip(predicted).map(|(weight, stress)| weight * stress).sum();
        [Voigt::new(first, second, 0.0, 0.0, 0.0, 0.0), Voigt::from_fn(|a, _| sum(a))]
    }
}

/// Run: rows along a deformation path, correlated with each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// Name, unique in a set.
    pub id: String,
    /// Kind of path: `ux`, `bxy`, …; `unknown` if the file has none.
    pub kind: String,
    /// Engineering rates along x, y, z, 1/s; NaN for an axis that is not pulled.
    pub rates: [f64; 3],
    /// Rows, in the order of their samples.
    pub rows: Vec<DataRow>,
}

/// Runs and their provenance.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Dataset {
    /// Runs, in order of appearance.
    pub paths: Vec<Path>,
    /// Files, a line each: name, bytes, checksum, columns.
    pub provenance: Vec<String>,
    /// Number of rows without averaged values (the state before a run).
    pub skipped: usize,
}

impl Dataset {
    /// Creates one run from C, (N, 6), and S, (N, 6) in Pa, in the order 11, 22, 33, 12, 13, 23; F is taken
    /// as √C.
    /// # Errors
    /// Returns [`Error::Parameter`] for other shapes, and for a C that is not positive definite.
    pub fn from_arrays(id: &str, c: ArrayView2<'_, f64>, s: ArrayView2<'_, f64>) -> Result<Self, Error> {
        if c.nrows() != s.nrows() {
            return Err(Error::parameter("rows of S", s.nrows(), format!("{}, the rows of C", c.nrows())));
        }
        let pairs = rows(c, "C")?.into_iter().zip(rows(s, "S")?);
        let row = |(sample, (c, s)): (usize, (Voigt, Voigt))| -> Result<DataRow, Error> {
            let deformation = stretch_from_c(&c)?;
            let cauchy = cauchy_from_material(&deformation, &s);
            Ok(DataRow { sample: sample as u64, time: f64::NAN, deformation, cauchy, c, s, nominal: None })
        };
        let rows = pairs.enumerate().map(row).collect::<Result<_, _>>()?;
        let path = Path { id: id.into(), kind: "unknown".into(), rates: [f64::NAN; 3], rows };
        Ok(Self { paths: vec![path], ..Self::default() })
    }

    /// Returns C and S of all rows, (N, 6) each; S in Pa.
    pub fn to_arrays(&self) -> [Array2<f64>; 2] {
        let rows: Vec<&DataRow> = self.rows().collect();
        let array =
            |pick: fn(&DataRow) -> &Voigt| Array2::from_shape_fn((rows.len(), 6), |(k, a)| pick(rows[k])[a]);
        [array(|row| &row.c), array(|row| &row.s)]
    }

    /// Returns the number of rows.
    pub fn len(&self) -> usize {
        self.paths.iter().map(|path| path.rows.len()).sum()
    }

    /// Tells if there are no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Iterates over all rows, path by path; [`DataSplit`] uses this numbering.
    pub fn rows(&self) -> impl Iterator<Item = &DataRow> + Clone {
        self.paths.iter().flat_map(|path| &path.rows)
    }

    /// Returns the path index of each row.
    pub fn path_of_rows(&self) -> Vec<usize> {
        let indices = |(index, path): (usize, &Path)| std::iter::repeat_n(index, path.rows.len());
        self.paths.iter().enumerate().flat_map(indices).collect()
    }

    /// Returns the number of runs of each kind.
    pub fn kinds(&self) -> BTreeMap<&str, usize> {
        let mut kinds = BTreeMap::new();
        for path in &self.paths {
            *kinds.entry(path.kind.as_str()).or_default() += 1;
        }
        kinds
    }

    /// Tells if any row has nominal stresses instead of the full stress ([`DataRow::nominal`]).
    pub fn is_nominal(&self) -> bool {
        self.rows().any(|row| row.nominal.is_some())
    }

    /// Appends the runs of another set.
    ///
    /// # Errors
    /// Returns [`Error::Data`] for a run with an existing name.
    pub fn append(&mut self, other: Self) -> Result<(), Error> {
        let names: HashSet<&str> = self.paths.iter().map(|path| path.id.as_str()).collect();
        if let Some(twice) = other.paths.iter().find(|path| names.contains(path.id.as_str())) {
            return Err(Error::Data {
                what: "joined data sets",
                found: format!("the run `{}` twice", twice.id),
                allowed: "different names of all runs".into(),
            });
        }
        self.paths.extend(other.paths);
        self.provenance.extend(other.provenance);
        self.skipped += other.skipped;
        Ok(())
    }

    /// Tells if a run of another set has the name of a run here.
    pub fn shares_a_name(&self, other: &Self) -> bool {
        let names: HashSet<&str> = self.paths.iter().map(|path| path.id.as_str()).collect();
        other.paths.iter().any(|path| names.contains(path.id.as_str()))
    }

    /// Prefixes runs that are named after their file by its folder (`shear/log.lammps`: `shear-log.lammps`).
    #[must_use]
    pub fn with_folder_prefix(mut self, file: &std::path::Path) -> Self {
        let [name, folder] = [file.file_name(), file.parent().and_then(std::path::Path::file_name)]
            .map(|name| name.unwrap_or_default().to_string_lossy());
        for path in &mut self.paths {
            if path.id.starts_with(&*name) && !folder.is_empty() {
                path.id = format!("{folder}-{}", path.id);
            }
        }
        self
    }

    /// Returns the smallest and the largest value of each component of C; (+∞, −∞) for an empty set.
    pub fn strain_box(&self) -> [[f64; 2]; 6] {
        let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 6];
        for row in self.rows() {
            for (range, &value) in range.iter_mut().zip(&row.c) {
                *range = [range[0].min(value), range[1].max(value)];
            }
        }
        range
    }

    /// Returns the names of components of C and S that are equal in all rows.
    pub fn constant_components(&self) -> Vec<String> {
        let mut names = Vec::new();
        let Some(first) = self.rows().next() else { return names };
        for (a, name) in NAMES.iter().enumerate() {
            if self.rows().all(|row| row.c[a] == first.c[a]) {
                names.push(format!("C{name}"));
            }
        }
        for (a, name) in NAMES.iter().enumerate() {
            if self.rows().all(|row| row.s[a] == first.s[a]) {
                names.push(format!("S{name}"));
            }
        }
        names
    }

    /// Counts rows whose (C, S) repeats that of an earlier row bit by bit.
    pub fn duplicate_rows(&self) -> usize {
        let mut seen = HashSet::new();
        self.rows().filter(|row| !seen.insert(bits(row))).count()
    }

    /// Checks that the numbers are plausible deformations and stresses of a solid, in the units used for
    /// reading.
    ///
    /// # Errors
    /// Returns [`Error::Data`] for an empty set or a repeated run; [`Error::Implausible`] for a stress beyond
    /// [`OUTLIER`], stretches beyond [`STRETCHES`], or a root mean square of the stress beyond [`STRESSES`]
    /// (zero stress passes: it is reported as constant).
    pub fn check(&self) -> Result<(), Error> {
        if self.is_empty() {
            return Err(Error::Data {
                what: "data set",
                found: "no row".into(),
                allowed: "at least one row".into(),
            });
        }
        let mut seen: HashMap<Vec<[u64; 12]>, &str> = HashMap::new();
        for path in &self.paths {
            for row in &path.rows {
                let mut stretches = row.deformation.principal_stretches();
                if row.nominal.is_some() {
                    // incompressibility determines the thickness
                    stretches = [row.c[0].sqrt(), row.c[1].sqrt(), 1.0];
                }
                let far = stretches.iter().find(|l| !(STRETCHES[0]..=STRETCHES[1]).contains(*l));
                if let Some(stretch) = far {
                    return Err(Error::Implausible {
                        place: format!("run `{}`, sample {}", path.id, row.sample),
                        quantity: "principal stretch".into(),
                        found: format!("{stretch:.4e}"),
                        allowed: "plausible stretches lie between 0.1 and 10",
                    });
                }
            }
            // single rows coincide if runs start from the same state; whole runs do not
            if path.rows.len() > 1
                && let Some(first) = seen.insert(path.rows.iter().map(bits).collect(), &path.id)
            {
                return Err(Error::Data {
                    what: "data set",
                    found: format!("the same rows in the runs `{first}` and `{}`", path.id),
                    allowed: "different runs (a copy leaks across a split)".into(),
                });
            }
        }
        self.refuse_outliers()?;
        let squares: f64 = self.rows().map(|row| row.cauchy.norm_squared()).sum();
        let root = (squares / (6 * self.len()) as f64).sqrt();
        if root != 0.0 && !(STRESSES[0]..=STRESSES[1]).contains(&root) {
            return Err(Error::Implausible {
                place: "all rows".into(),
                quantity: "root mean square of the stress".into(),
                found: format!("{root:.4e} Pa"),
                allowed: "plausible stresses of a solid lie between 100 Pa and 1 TPa",
            });
        }
        Ok(())
    }
}

impl Dataset {
    /// Refuses stresses that are a thousand times the 90th percentile: they would dominate the training.
    fn refuse_outliers(&self) -> Result<(), Error> {
        let mut sizes: Vec<f64> = self.rows().map(|row| row.cauchy.norm()).collect();
        sizes.sort_by(f64::total_cmp);
        let usual = sizes[(9 * sizes.len() / 10).min(sizes.len() - 1)];
        for path in &self.paths {
            let far = |row: &&DataRow| row.cauchy.norm() > OUTLIER * usual;
            if let Some(row) = path.rows.iter().find(far).filter(|_| usual > 0.0) {
                return Err(Error::Implausible {
                    place: format!("run `{}`, sample {}", path.id, row.sample),
                    quantity: "norm of the stress".into(),
                    found: format!("{:.4e} Pa (90th percentile {usual:.4e} Pa)", row.cauchy.norm()),
                    allowed: "an outlier above a thousand times the 90th percentile would dominate the \
                        training",
                });
            }
        }
        Ok(())
    }
}

fn bits(row: &DataRow) -> [u64; 12] {
    let mut bits = [0; 12];
    for (bit, value) in bits.iter_mut().zip(row.c.iter().chain(row.s.iter())) {
        // −0 and 0 are equal
        *bit = (value + 0.0).to_bits();
    }
    bits
}

#[cfg(test)]
mod lammps_tests;
#[cfg(test)]
mod md_tests;
#[cfg(test)]
pub(crate) mod tests;

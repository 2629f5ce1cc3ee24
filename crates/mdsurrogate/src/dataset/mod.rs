//! Data sets of (C, S) by path: read, checked, standardised, split, and measured for noise and leaks.

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

pub use options::{Columns, LammpsUnits, Measure, Origin, PROPERTIES, ReadOptions};
pub use read::read;
pub use split::{Fractions, Method, Split, split};
pub use standardise::Standardisation;
pub use statistics::{Leak, Noise, leak, noise};
pub use strains::read_strains;

use crate::Error;
use crate::kinematics::{NAMES, cauchy_from_material, material_pair, stretch_of};
use ndarray::{Array2, ArrayView2};
use polycore::constitutive::arrays::rows;
use polycore::tensor::{DeformationGradient, Tensor, Voigt};
use std::collections::{BTreeMap, HashMap, HashSet};

/// Stretches between which data are taken for deformations: beyond, a unit is wrong.
pub const STRETCHES: [f64; 2] = [0.1, 10.0];

/// Root mean squares of the stress, Pa, that are taken for stresses of a solid: beyond, a unit is wrong.
pub const STRESSES: [f64; 2] = [1e2, 1e12];

/// So many times what nine of ten rows stay below, a stress is an outlier.
pub const OUTLIER: f64 = 1e3;

/// One sample: a state of deformation and its stress.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Number of the sample within its run, as the file counts it.
    pub sample: u64,
    /// Time, s; NaN where the file has none.
    pub time: f64,
    /// F; U = √C where the file gives C only.
    pub deformation: DeformationGradient,
    /// σ, Pa, tension positive.
    pub cauchy: Voigt,
    /// C (3.2).
    pub c: Voigt,
    /// S (3.3), Pa.
    pub s: Voigt,
    /// P₁, P₂, Pa, where nominal stresses of an incompressible body with a free third face were measured and no whole
    /// stress; exactly 0: not measured. σ and S then have what these say, and 0 elsewhere.
    pub nominal: Option<[f64; 2]>,
}

impl Row {
    /// A row from F and σ, with C and S after (3.5), (3.6).
    pub fn new(sample: u64, time: f64, deformation: DeformationGradient, cauchy: Voigt) -> Self {
        let (c, s) = material_pair(&deformation, &cauchy);
        Self { sample, time, deformation, cauchy, c, s, nominal: None }
    }

    /// A row of an incompressible body with a free third face: λ₁, λ₂ (λ₃ = 1/(λ₁λ₂)), and P₁, P₂ in Pa, 0 where it was
    /// not measured.
    ///
    /// # Errors
    /// Stretches that are not positive and finite.
    pub fn of_nominal(sample: u64, [a, b]: [f64; 2], nominal: [f64; 2]) -> Result<Self, Error> {
        let f = DeformationGradient::new(Tensor::from_diagonal(&[a, b, 1.0 / (a * b)].into()))?;
        // σᵢ = λᵢ Pᵢ where J = 1
        let cauchy = Voigt::new(nominal[0] * a, nominal[1] * b, 0.0, 0.0, 0.0, 0.0);
        Ok(Self { nominal: Some(nominal), ..Self::new(sample, f64::NAN, f, cauchy) })
    }

    /// What takes a law's S to what was measured, where that is no whole stress: Pᵢ = (λᵢ² Sᵢᵢ − λ₃² S₃₃)/λᵢ, the pressure
    /// being eliminated by P₃ = 0; zero for what was not measured.
    pub fn elimination(&self) -> Option<[[f64; 6]; 6]> {
        let nominal = self.nominal?;
        let mut map = [[0.0; 6]; 6];
        for i in (0..2).filter(|&i| nominal[i] != 0.0) {
            let stretch = self.c[i].sqrt();
            (map[i][i], map[i][2]) = (stretch, -self.c[2] / stretch);
        }
        Some(map)
    }

    /// What was measured, and what a law's S says of it, Pa: S, or the nominal stresses of [`Row::elimination`].
    pub fn compared(&self, predicted: &Voigt) -> [Voigt; 2] {
        let (Some(map), Some([first, second])) = (self.elimination(), self.nominal) else {
            return [self.s, *predicted];
        };
        let sum = |a: usize| map[a].iter().zip(predicted).map(|(weight, stress)| weight * stress).sum();
        [Voigt::new(first, second, 0.0, 0.0, 0.0, 0.0), Voigt::from_fn(|a, _| sum(a))]
    }
}

/// One run: rows along a path of deformation, correlated with each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// Its name, unique within a set.
    pub id: String,
    /// What kind of path: `ux`, `bxy`, …; `unknown` where the file says nothing.
    pub kind: String,
    /// Engineering rates along x, y, z, 1/s; NaN for an axis that is not pulled.
    pub rates: [f64; 3],
    /// The rows in order of their samples.
    pub rows: Vec<Row>,
}

/// Runs, and where they came from.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Dataset {
    /// The runs in order of appearance.
    pub paths: Vec<Path>,
    /// One line a file: name, bytes, checksum, columns.
    pub provenance: Vec<String>,
    /// Rows of files that had no averaged values (the state before a run).
    pub skipped: usize,
}

impl Dataset {
    /// One run of rows with C, (N, 6), and S, (N, 6) in Pa, in the order 11, 22, 33, 12, 13, 23; F is taken as √C.
    ///
    /// # Errors
    /// [`Error::Parameter`] for arrays of other shapes, and a C that is not positive definite.
    pub fn from_arrays(id: &str, c: ArrayView2<'_, f64>, s: ArrayView2<'_, f64>) -> Result<Self, Error> {
        if c.nrows() != s.nrows() {
            return Err(Error::parameter("rows of S", s.nrows(), format!("{}, as of C", c.nrows())));
        }
        let pairs = rows(c, "C")?.into_iter().zip(rows(s, "S")?);
        let row = |(sample, (c, s)): (usize, (Voigt, Voigt))| -> Result<Row, Error> {
            let deformation = stretch_of(&c)?;
            let cauchy = cauchy_from_material(&deformation, &s);
            Ok(Row { sample: sample as u64, time: f64::NAN, deformation, cauchy, c, s, nominal: None })
        };
        let rows = pairs.enumerate().map(row).collect::<Result<_, _>>()?;
        let path = Path { id: id.into(), kind: "unknown".into(), rates: [f64::NAN; 3], rows };
        Ok(Self { paths: vec![path], ..Self::default() })
    }

    /// C and S of all rows, (N, 6) each; S in Pa.
    pub fn to_arrays(&self) -> [Array2<f64>; 2] {
        let rows: Vec<&Row> = self.rows().collect();
        let array = |of: fn(&Row) -> &Voigt| Array2::from_shape_fn((rows.len(), 6), |(k, a)| of(rows[k])[a]);
        [array(|row| &row.c), array(|row| &row.s)]
    }

    /// The number of rows.
    pub fn len(&self) -> usize {
        self.paths.iter().map(|path| path.rows.len()).sum()
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All rows, path by path: the numbering that [`Split`] uses.
    pub fn rows(&self) -> impl Iterator<Item = &Row> + Clone {
        self.paths.iter().flat_map(|path| &path.rows)
    }

    /// The path of each row.
    pub fn path_of_rows(&self) -> Vec<usize> {
        let of = |(index, path): (usize, &Path)| std::iter::repeat_n(index, path.rows.len());
        self.paths.iter().enumerate().flat_map(of).collect()
    }

    /// Runs of each kind.
    pub fn kinds(&self) -> BTreeMap<&str, usize> {
        let mut kinds = BTreeMap::new();
        for path in &self.paths {
            *kinds.entry(path.kind.as_str()).or_default() += 1;
        }
        kinds
    }

    /// Whether any row has nominal stresses instead of a whole stress ([`Row::nominal`]).
    pub fn is_nominal(&self) -> bool {
        self.rows().any(|row| row.nominal.is_some())
    }

    /// Appends the runs of another set.
    ///
    /// # Errors
    /// [`Error::Data`] for a run whose name is taken.
    pub fn append(&mut self, other: Self) -> Result<(), Error> {
        let names: HashSet<&str> = self.paths.iter().map(|path| path.id.as_str()).collect();
        if let Some(twice) = other.paths.iter().find(|path| names.contains(path.id.as_str())) {
            return Err(Error::Data {
                what: "joining data sets",
                found: format!("the run `{}` twice", twice.id),
                allowed: "each run once".into(),
            });
        }
        self.paths.extend(other.paths);
        self.provenance.extend(other.provenance);
        self.skipped += other.skipped;
        Ok(())
    }

    /// Whether a run of another set has the name of one here.
    pub fn shares_a_name(&self, other: &Self) -> bool {
        let names: HashSet<&str> = self.paths.iter().map(|path| path.id.as_str()).collect();
        other.paths.iter().any(|path| names.contains(path.id.as_str()))
    }

    /// The runs of a file with its folder before their names where they are named after the file (`shear/log.lammps`:
    /// `shear-log.lammps`).
    #[must_use]
    pub fn of_folder(mut self, file: &std::path::Path) -> Self {
        let [name, folder] = [file.file_name(), file.parent().and_then(std::path::Path::file_name)]
            .map(|name| name.unwrap_or_default().to_string_lossy());
        for path in &mut self.paths {
            if path.id.starts_with(&*name) && !folder.is_empty() {
                path.id = format!("{folder}-{}", path.id);
            }
        }
        self
    }

    /// Smallest and largest C of each component; (+∞, −∞) of an empty set.
    pub fn box_of_c(&self) -> [[f64; 2]; 6] {
        let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 6];
        for row in self.rows() {
            for (range, &value) in range.iter_mut().zip(&row.c) {
                *range = [range[0].min(value), range[1].max(value)];
            }
        }
        range
    }

    /// Components of C and S that are the same in all rows, by name.
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

    /// Rows that repeat an earlier row's (C, S) to the bit.
    pub fn duplicate_rows(&self) -> usize {
        let mut seen = HashSet::new();
        self.rows().filter(|row| !seen.insert(bits(row))).count()
    }

    /// Whether the numbers can be deformations and stresses of a solid in the units they were read in.
    ///
    /// # Errors
    /// [`Error::Data`] for no row at all or a run that repeats another; [`Error::Implausible`] for a stress beyond [`OUTLIER`], for stretches beyond [`STRETCHES`] or a root mean square of
    /// the stress beyond [`STRESSES`] (a stress of exactly zero passes: it is reported as constant).
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
                    // the thickness is what incompressibility makes of the others
                    stretches = [row.c[0].sqrt(), row.c[1].sqrt(), 1.0];
                }
                let far = stretches.iter().find(|l| !(STRETCHES[0]..=STRETCHES[1]).contains(*l));
                if let Some(stretch) = far {
                    return Err(Error::Implausible {
                        place: format!("run `{}`, sample {}", path.id, row.sample),
                        quantity: "principal stretch".into(),
                        found: format!("{stretch:.4e}"),
                        allowed: "the stretches of data lie between 0.1 and 10",
                    });
                }
            }
            // single rows coincide where runs start from one snapshot; whole runs do not
            if path.rows.len() > 1
                && let Some(first) = seen.insert(path.rows.iter().map(bits).collect(), &path.id)
            {
                return Err(Error::Data {
                    what: "data set",
                    found: format!("the runs `{first}` and `{}` with the same rows", path.id),
                    allowed: "each run once (a copy would leak across a split)".into(),
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
                allowed: "that of a solid lies between 100 Pa and 1 TPa",
            });
        }
        Ok(())
    }
}

impl Dataset {
    /// A stress a thousand times that which nine of ten rows stay below is no measurement, and would be all that is
    /// learnt.
    fn refuse_outliers(&self) -> Result<(), Error> {
        let mut sizes: Vec<f64> = self.rows().map(|row| row.cauchy.norm()).collect();
        sizes.sort_by(f64::total_cmp);
        let usual = sizes[(9 * sizes.len() / 10).min(sizes.len() - 1)];
        for path in &self.paths {
            let far = |row: &&Row| row.cauchy.norm() > OUTLIER * usual;
            if let Some(row) = path.rows.iter().find(far).filter(|_| usual > 0.0) {
                return Err(Error::Implausible {
                    place: format!("run `{}`, sample {}", path.id, row.sample),
                    quantity: "norm of the stress".into(),
                    found: format!(
                        "{:.4e} Pa, where nine of ten rows have at most {usual:.4e} Pa",
                        row.cauchy.norm()
                    ),
                    allowed: "at most a thousand times that: such an outlier would dominate the training",
                });
            }
        }
        Ok(())
    }
}

fn bits(row: &Row) -> [u64; 12] {
    let mut bits = [0; 12];
    for (bit, value) in bits.iter_mut().zip(row.c.iter().chain(row.s.iter())) {
        // −0 and 0 are the same number
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

//! Training, validation and test rows: by path, or at random as in the thesis.

use super::Dataset;
use crate::Error;
use crate::random::SplitMix64;
use serde::{Deserialize, Serialize};

/// Method of a split.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum SplitMethod {
    /// Whole runs: no row has neighbours in time in another set; each kind of run is split in proportion.
    #[default]
    Path,
    /// Single rows, as in the thesis (§3.3); leaks along the paths.
    Random,
}

/// Fractions of the three sets, with the sum 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Fractions {
    /// Fraction for training.
    pub train: f64,
    /// Fraction for the choice of hyperparameters and early stopping.
    pub validation: f64,
    /// Fraction for the final judgement.
    pub test: f64,
}

impl Default for Fractions {
    /// Returns the fractions of the thesis: 80 % – 20 %, and 20 % of the 80 % for validation (§3.3).
    fn default() -> Self {
        Self { train: 0.64, validation: 0.16, test: 0.2 }
    }
}

/// Row numbers of the three sets, as in [`Dataset::rows`], ascending.
#[derive(Debug, Clone, PartialEq)]
pub struct DataSplit {
    /// Method of the split.
    pub method: SplitMethod,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Training rows.
    pub train: Vec<usize>,
    /// Validation rows.
    pub validation: Vec<usize>,
    /// Test rows.
    pub test: Vec<usize>,
}

impl DataSplit {
    /// Returns the label of each row: 0 for training, 1 for validation, 2 for test.
    pub fn labels(&self) -> Vec<u8> {
        let rows = self.train.len() + self.validation.len() + self.test.len();
        let mut labels = vec![0; rows];
        for (label, set) in [(1, &self.validation), (2, &self.test)] {
            for &row in set {
                labels[row] = label;
            }
        }
        labels
    }
}

/// Splits the rows of a set; the same seed gives the same split on each machine and version.
///
/// # Errors
/// Returns [`Error::Parameter`] for negative fractions or a sum other than 1; [`Error::Data`] for fewer paths
/// (or rows) than nonempty sets.
pub fn split(
    set: &Dataset,
    method: SplitMethod,
    fractions: Fractions,
    seed: u64,
) -> Result<DataSplit, Error> {
    let shares = [fractions.train, fractions.validation, fractions.test];
    let sum: f64 = shares.iter().sum();
    // scenes give two decimals, so the sum is not exact
    if !(shares.iter().all(|share| *share >= 0.0) && (sum - 1.0).abs() < 1e-9 && shares[0] > 0.0) {
        let allowed = "fractions of train (above 0), validation and test that add up to 1";
        return Err(Error::parameter("split", format!("{shares:?}"), allowed));
    }
    let mut random = SplitMix64::new(seed);
    let labels = match method {
        SplitMethod::Path => {
            // kinds in order, their runs shuffled: dealing then splits each kind in proportion
            let mut order = Vec::with_capacity(set.paths.len());
            for kind in set.kinds().keys() {
                let start = order.len();
                order.extend((0..set.paths.len()).filter(|&path| set.paths[path].kind == *kind));
                random.shuffle(&mut order[start..]);
            }
            let dealt = deal(&order, shares, "path")?;
            set.path_of_rows().into_iter().map(|path| dealt[path]).collect()
        }
        SplitMethod::Random => {
            let mut order: Vec<usize> = (0..set.len()).collect();
            random.shuffle(&mut order);
            deal(&order, shares, "row")?
        }
    };
    let rows = |label| (0..labels.len()).filter(|&row| labels[row] == label).collect();
    Ok(DataSplit { method, seed, train: rows(0), validation: rows(1), test: rows(2) })
}

/// Returns the labels of items dealt in this order, each to the set furthest below its share; no set with a
/// share stays empty.
fn deal(order: &[usize], shares: [f64; 3], item: &str) -> Result<Vec<u8>, Error> {
    let wanted = shares.iter().filter(|share| **share > 0.0).count();
    if order.len() < wanted {
        return Err(Error::Data {
            what: "split",
            found: format!("{} {item}{}", order.len(), if order.len() == 1 { "" } else { "s" }),
            allowed: format!(
                "at least {wanted} {item}s, one for each set (or `by = \"random\"`, or fewer sets); a table \
                 without the column `run_id` is one path"
            ),
        });
    }
    let mut counts = [0usize; 3];
    let mut labels = vec![0u8; order.len()];
    for (done, &index) in order.iter().enumerate() {
        let behind = |set: usize| shares[set] * (done + 1) as f64 - counts[set] as f64;
        let left = order.len() - done;
        let empty = |set: usize| shares[set] > 0.0 && counts[set] == 0;
        let must = (0..3).filter(|&set| empty(set)).count() == left;
        let candidates = (0..3).filter(|&set| if must { empty(set) } else { shares[set] > 0.0 });
        let set = candidates.fold(None, |best: Option<usize>, set| match best {
            Some(best) if behind(best) >= behind(set) => Some(best),
            _ => Some(set),
        });
        let set = set.unwrap_or(0);
        counts[set] += 1;
        labels[index] = set as u8;
    }
    Ok(labels)
}

//! Training, validation and test rows: by path, or at random as in the thesis.

use super::Dataset;
use crate::Error;
use crate::random::SplitMix64;
use serde::{Deserialize, Serialize};

/// How rows are divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Whole runs, so that no row has its neighbours in time on the other side; each kind of run in proportion.
    #[default]
    Path,
    /// Single rows, as in the thesis (§3.3): leaks along the paths.
    Random,
}

/// Shares of the three sets; they add up to 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Fractions {
    /// To learn from.
    pub train: f64,
    /// To choose hyperparameters and to stop by.
    pub validation: f64,
    /// To judge.
    pub test: f64,
}

impl Default for Fractions {
    /// The thesis': 80 % – 20 %, and of the 80 % again 20 % for validation (§3.3).
    fn default() -> Self {
        Self { train: 0.64, validation: 0.16, test: 0.2 }
    }
}

/// Rows of the three sets by their number in [`Dataset::rows`], ascending.
#[derive(Debug, Clone, PartialEq)]
pub struct Split {
    /// How.
    pub method: Method,
    /// The seed.
    pub seed: u64,
    /// Rows to learn from.
    pub train: Vec<usize>,
    /// Rows to choose by.
    pub validation: Vec<usize>,
    /// Rows to judge by.
    pub test: Vec<usize>,
}

impl Split {
    /// 0 for training, 1 for validation, 2 for test; one number a row.
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

/// Divides the rows of a set; the same seed gives the same split, on every machine and version.
///
/// # Errors
/// [`Error::Parameter`] for fractions that are negative or do not add up to 1; [`Error::Data`] for fewer paths (or
/// rows) than sets that should not be empty.
pub fn split(set: &Dataset, method: Method, fractions: Fractions, seed: u64) -> Result<Split, Error> {
    let shares = [fractions.train, fractions.validation, fractions.test];
    let sum: f64 = shares.iter().sum();
    // written with two decimals in a scene, so not to the last bit
    if !(shares.iter().all(|share| *share >= 0.0) && (sum - 1.0).abs() < 1e-9 && shares[0] > 0.0) {
        let allowed = "shares of train (more than 0), validation and test that add up to 1";
        return Err(Error::parameter("split", format!("{shares:?}"), allowed));
    }
    let mut random = SplitMix64::new(seed);
    let labels = match method {
        Method::Path => {
            // kinds in order, their runs shuffled: dealing then takes each kind in proportion
            let mut order = Vec::with_capacity(set.paths.len());
            for kind in set.kinds().keys() {
                let start = order.len();
                order.extend((0..set.paths.len()).filter(|&path| set.paths[path].kind == *kind));
                random.shuffle(&mut order[start..]);
            }
            let dealt = deal(&order, shares, "path")?;
            set.path_of_rows().into_iter().map(|path| dealt[path]).collect()
        }
        Method::Random => {
            let mut order: Vec<usize> = (0..set.len()).collect();
            random.shuffle(&mut order);
            deal(&order, shares, "row")?
        }
    };
    let rows = |label| (0..labels.len()).filter(|&row| labels[row] == label).collect();
    Ok(Split { method, seed, train: rows(0), validation: rows(1), test: rows(2) })
}

/// Labels of items dealt in this order, each to the set furthest behind its share; no set with a share stays empty.
fn deal(order: &[usize], shares: [f64; 3], item: &str) -> Result<Vec<u8>, Error> {
    let wanted = shares.iter().filter(|share| **share > 0.0).count();
    if order.len() < wanted {
        return Err(Error::Data {
            what: "split",
            found: format!("{} {item}{}", order.len(), if order.len() == 1 { "" } else { "s" }),
            allowed: format!(
                "at least {wanted} {item}s, one for each set (or `by = \"random\"`, or fewer sets); a table without the \
                 column `run_id` is one path"
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

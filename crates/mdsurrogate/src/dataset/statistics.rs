//! Noise of the data, and separation of the sets of a split.

use super::{DataRow, DataSplit, Dataset, Standardisation};
use polycore::tensor::Voigt;

/// Rows of the moving fit whose residual gives the correlation of the noise.
const WINDOW: usize = 11;

/// Noise of a stress along the paths.
#[derive(Debug, Clone, PartialEq)]
pub struct Noise {
    /// Standard deviation of each component, Pa: √(mean of squared second differences / 6), exact for white
    /// noise on a path that is straight over three samples (var of a − 2b + c is 6σ²).
    pub deviation: Voigt,
    /// Sum of the six variances, Pa²: lower bound of the loss (3.12) of any law on single rows.
    pub floor: f64,
    /// Correlation of neighbouring residuals of a moving quadratic fit over eleven rows, all components;
    /// `None` if all paths are shorter.
    pub lag_1: Option<f64>,
    /// This correlation for white noise (the fit itself correlates residuals). A larger `lag_1` means that
    /// the noise is correlated along the path and that a random split leaks.
    pub lag_1_of_white_noise: f64,
    /// Number of averaged second differences per component.
    pub differences: usize,
}

/// Estimates the noise of a stress from second differences along the paths. Returns `None` if no path has
/// three rows, and for nominal stresses ([`DataRow::nominal`]), whose tables are too coarse and uneven.
///
/// `stress` selects σ or S of a row.
pub fn noise(set: &Dataset, stress: fn(&DataRow) -> Voigt) -> Option<Noise> {
    if set.is_nominal() {
        return None;
    }
    let filter = residual_filter();
    let (mut squares, mut differences) = (Voigt::zeros(), 0);
    let (mut products, mut powers) = (0.0, 0.0);
    // each component is divided by its own noise, known after the first pass, so that all count alike
    for path in &set.paths {
        for rows in path.rows.windows(3) {
            let second = stress(&rows[0]) - 2.0 * stress(&rows[1]) + stress(&rows[2]);
            squares += second.component_mul(&second);
            differences += 1;
        }
    }
    if differences == 0 {
        return None;
    }
    let variance = squares / (6 * differences) as f64;
    let scale = variance.map(|v| if v > 0.0 { 1.0 / v } else { 0.0 });
    for path in &set.paths {
        let mut last: Option<Voigt> = None;
        for rows in path.rows.windows(WINDOW) {
            let mut residual = Voigt::zeros();
            for (row, weight) in rows.iter().zip(&filter) {
                residual += *weight * stress(row);
            }
            let scaled = residual.component_mul(&scale);
            powers += scaled.dot(&residual);
            if let Some(last) = last {
                products += scaled.dot(&last);
            }
            last = Some(residual);
        }
    }
    let autocorrelation = |lag: usize| filter.iter().zip(&filter[lag..]).map(|(a, b)| a * b).sum::<f64>();
    Some(Noise {
        deviation: variance.map(f64::sqrt),
        floor: variance.sum(),
        lag_1: (powers > 0.0).then(|| products / powers),
        lag_1_of_white_noise: autocorrelation(1) / autocorrelation(0),
        differences,
    })
}

/// Returns the weights of (value − quadratic least-squares fit) at the middle of eleven points (Savitzky &
/// Golay 1964, <https://doi.org/10.1021/ac60214a047>). For 2m + 1 points the weights of the fit are 3[(3m² +
/// 3m − 1) − 5i²]/[(2m + 3)(2m + 1)(2m − 1)].
fn residual_filter() -> [f64; WINDOW] {
    let m = (WINDOW / 2) as f64;
    let mut weights = [0.0; WINDOW];
    for (index, weight) in weights.iter_mut().enumerate() {
        let i = index as f64 - m;
        let fit = 3.0 * ((3.0 * m * m + 3.0 * m - 1.0) - 5.0 * i * i)
            / ((2.0 * m + 3.0) * (2.0 * m + 1.0) * (2.0 * m - 1.0));
        *weight = if index == WINDOW / 2 { 1.0 - fit } else { -fit };
    }
    weights
}

/// Distances of test rows to training rows, in standardised C.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leak {
    /// Median distance from a test row to the nearest training row.
    pub across: f64,
    /// Median distance from a training row to the nearest other training row.
    pub within: f64,
    /// Ratio across/within: about 1 for test rows between training rows (a leak if noise is correlated along
    /// paths), larger for separate sets. `None` if `within` is 0 (duplicates).
    pub ratio: Option<f64>,
    /// Fraction of test rows whose nearest training row belongs to the same run: 0 for a split by path.
    pub same_path: f64,
    /// Number of computed distances.
    pub distances: u64,
}

/// Compares nearest neighbours across a split with those inside its training set, in standardised C. Returns
/// `None` for an empty test set or fewer than two training rows.
pub fn leak(set: &Dataset, split: &DataSplit, standardisation: &Standardisation) -> Option<Leak> {
    if split.test.is_empty() || split.train.len() < 2 {
        return None;
    }
    let points: Vec<Voigt> = set.rows().map(|row| standardisation.apply(&row.c)).collect();
    let paths = set.path_of_rows();
    let mut distances = 0;
    // sorted along the first component: the search ends when that component alone is farther than the best
    let mut sorted = split.train.clone();
    sorted.sort_by(|&a, &b| points[a][0].total_cmp(&points[b][0]).then(a.cmp(&b)));
    let mut nearest = |row: usize| {
        let point = points[row];
        let start = sorted.partition_point(|&other| points[other][0] < point[0]);
        let mut best = (f64::INFINITY, row);
        let (mut down, mut up) = (start, start);
        loop {
            let below = (down > 0).then(|| point[0] - points[sorted[down - 1]][0]);
            let above = sorted.get(up).map(|&other| points[other][0] - point[0]);
            let candidate = match (below, above) {
                (Some(b), Some(a)) if b < a => Err(b),
                (_, Some(a)) => Ok(a),
                (Some(b), None) => Err(b),
                (None, None) => break,
            };
            let (gap, other) = match candidate {
                Ok(gap) => {
                    up += 1;
                    (gap, sorted[up - 1])
                }
                Err(gap) => {
                    down -= 1;
                    (gap, sorted[down])
                }
            };
            if gap >= best.0 {
                break;
            }
            if other != row {
                distances += 1;
                let distance = (points[other] - point).norm();
                if distance < best.0 {
                    best = (distance, other);
                }
            }
        }
        best
    };
    let across: Vec<(f64, usize)> = split.test.iter().map(|&row| nearest(row)).collect();
    let within: Vec<f64> = split.train.iter().map(|&row| nearest(row).0).collect();
    let same =
        across.iter().zip(&split.test).filter(|((_, other), row)| paths[*other] == paths[**row]).count();
    let same_path = same as f64 / across.len() as f64;
    let across = median(across.into_iter().map(|(distance, _)| distance).collect());
    let within = median(within);
    let ratio = (within > 0.0).then(|| across / within);
    Some(Leak { across, within, ratio, same_path, distances })
}

/// Returns the median; NaN for an empty list.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => values[middle],
        _ => 0.5 * (values[middle - 1] + values[middle]),
    }
}

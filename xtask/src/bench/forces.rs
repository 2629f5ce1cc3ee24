//! Comparison of the forces of two programs on the same particles, one by one.

use std::path::Path;

use harness::output::csv;
use miette::{IntoDiagnostic, Result, miette};

/// Particles as `--block --state` of `crates/peri/benches/measure.rs` writes them.
pub struct Snapshot {
    /// Reference positions, m.
    pub positions: Vec<[f64; 3]>,
    /// Displacements, m.
    pub displacements: Vec<[f64; 3]>,
    /// Force densities, N/m³.
    pub forces: Vec<[f64; 3]>,
}

impl Snapshot {
    /// Reads the CSV file.
    pub fn read(path: &Path) -> Result<Self> {
        let columns = csv::read(path).into_diagnostic()?;
        let vector = |names: [&str; 3]| -> Result<Vec<[f64; 3]>> {
            let mut of = Vec::new();
            for name in names {
                let named = |heading: &str| heading.split_whitespace().next() == Some(name);
                let column = columns.iter().find(|(heading, _)| named(heading));
                of.push(
                    column.map(|(_, data)| data).ok_or_else(|| miette!("{}: no {name}", path.display()))?,
                );
            }
            Ok((0..of[0].len()).map(|k| [of[0][k], of[1][k], of[2][k]]).collect())
        };
        Ok(Self {
            positions: vector(["x", "y", "z"])?,
            displacements: vector(["ux", "uy", "uz"])?,
            forces: vector(["fx", "fy", "fz"])?,
        })
    }

    /// Current places of the particles: position + displacement, m.
    pub fn places(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        let pairs = self.positions.iter().zip(&self.displacements);
        pairs.map(|(x, u)| [x[0] + u[0], x[1] + u[1], x[2] + u[2]])
    }
}

/// Difference between two sets of forces.
#[derive(Debug, PartialEq)]
pub struct ForceDifference {
    /// Largest |Δf| over the root mean square of |f|.
    pub largest: f64,
    /// Particle with the largest difference.
    pub at: usize,
    /// Number of particles whose |Δf| is at least 1e-6 of the root mean square.
    pub differing: usize,
}

/// Compares `found` with `reference`; `None` if their lengths differ or all are zero.
pub fn compare(found: &[[f64; 3]], reference: &[[f64; 3]]) -> Option<ForceDifference> {
    let square = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>();
    let mean = reference.iter().map(|&f| square(f)).sum::<f64>() / reference.len() as f64;
    if found.len() != reference.len() || mean.is_nan() || mean <= 0.0 {
        return None;
    }
    let apart =
        |(a, b): (&[f64; 3], &[f64; 3])| (square([a[0] - b[0], a[1] - b[1], a[2] - b[2]]) / mean).sqrt();
    let all: Vec<f64> = found.iter().zip(reference).map(apart).collect();
    let (at, &largest) = all.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1))?;
    Some(ForceDifference { largest, at, differing: all.iter().filter(|&&x| x >= 1e-6).count() })
}

/// Computes LAMMPS' contact force density, N/m³: pairs closer than d = min(0.9 |ξ|, 1.35 Δx) push each other
/// with 15 c V (d − r)/δ, c = 18K/(πδ⁴); Parks et al. 2008, doi:10.1016/j.cpc.2008.06.011 (short-range
/// forces). All pairs are looked at.
pub fn contact(state: &Snapshot, spacing: f64, horizon: f64, bulk_modulus: f64) -> Vec<[f64; 3]> {
    let places: Vec<[f64; 3]> = state.places().collect();
    let stiffness = 15.0 * 18.0 * bulk_modulus / (std::f64::consts::PI * horizon.powi(4)) * spacing.powi(3);
    let distance = |a: [f64; 3], b: [f64; 3]| {
        let apart = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
        (apart, apart.iter().map(|x| x * x).sum::<f64>().sqrt())
    };
    let mut forces = vec![[0.0; 3]; places.len()];
    for (i, force) in forces.iter_mut().enumerate() {
        for (j, &place) in places.iter().enumerate() {
            let (apart, r) = distance(places[i], place);
            if i == j || r >= 1.35 * spacing {
                continue;
            }
            let (_, reference) = distance(state.positions[i], state.positions[j]);
            let least = (0.9 * reference).min(1.35 * spacing);
            if r < least && r > 0.0 {
                let push = stiffness * (least - r) / horizon / r;
                for d in 0..3 {
                    force[d] += push * apart[d];
                }
            }
        }
    }
    forces
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair(distance: f64) -> Snapshot {
        Snapshot {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0]],
            displacements: vec![[0.0; 3], [distance - 1.0, 0.0, 0.0]],
            forces: vec![[0.0; 3]; 2],
        }
    }

    #[test]
    fn largest_difference_and_where() {
        let reference = [[3.0, 4.0, 0.0], [0.0; 3], [0.0, 5.0, 0.0], [0.0; 3]];
        let mut found = reference;
        found[2][1] = 5.1;
        let difference = compare(&found, &reference).expect("comparable");
        // rms = √(50/4)
        assert!((difference.largest - 0.1 / 12.5_f64.sqrt()).abs() < 1e-15, "{difference:?}");
        assert_eq!((difference.at, difference.differing), (2, 1));
        assert_eq!(compare(&found[..3], &reference), None);
        assert_eq!(compare(&[[0.0; 3]], &[[0.0; 3]]), None);
    }

    #[test]
    fn pairs_touch_below_nine_tenths() {
        assert_eq!(contact(&pair(0.91), 1.0, 3.0, 1.0), [[0.0; 3]; 2]);
        let force = contact(&pair(0.8), 1.0, 3.0, 1.0);
        // 15·18/(81π)·0.1/3, apart
        let expected = 15.0 * 18.0 / (81.0 * std::f64::consts::PI) * 0.1 / 3.0;
        assert!((force[1][0] - expected).abs() < 1e-15 && force[0][0] == -force[1][0], "{force:?}");
    }

    #[test]
    fn states_are_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("state.csv");
        std::fs::write(&path, "x [m],y [m],z [m],ux,uy,uz,fx,fy,fz\n1,2,3,0.5,0,0,7,8,9\n").expect("written");
        let state = Snapshot::read(&path).expect("a state");
        assert_eq!(state.places().collect::<Vec<_>>(), [[1.5, 2.0, 3.0]]);
        assert_eq!(state.forces, [[7.0, 8.0, 9.0]]);
        std::fs::write(&path, "x,y\n1,2\n").expect("written");
        assert!(Snapshot::read(&path).is_err());
    }
}

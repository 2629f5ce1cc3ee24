//! Region of strain that test data cover, outside which a fitted law extrapolates.

use super::Error;
use super::data::TestData;

/// Convex hull of the strains of a table and of rest, in the plane (ln λ₁ − ln λ₂, ln λ₂ − ln λ₃) of sorted
/// stretches. There uniaxial tension is the first axis, equibiaxial tension and uniaxial compression the
/// second, pure shear the bisector: a table of one test covers a line.
#[derive(Debug, Clone, PartialEq)]
pub struct Coverage {
    /// Corners, counter-clockwise.
    hull: Vec<[f64; 2]>,
    margin: f64,
}

/// Distance from the hull that still counts as covered, relative to its farthest corner.
const MARGIN: f64 = 0.02;

impl Coverage {
    /// Finds the region of a table.
    ///
    /// # Errors
    /// A stretch that is not positive and finite.
    pub fn new(table: &TestData) -> Result<Self, Error> {
        let mut points = vec![[0.0; 2]];
        for state in &table.states {
            points.extend(state.bounding_stretches()?.into_iter().map(place));
        }
        let margin = MARGIN * points.iter().map(|[u, v]| u.hypot(*v)).fold(0.0, f64::max);
        points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        points.dedup();
        // Andrew's monotone chain (doi:10.1016/0020-0190(79)90072-3): the lower side, then the upper one
        let side = |points: &mut dyn Iterator<Item = [f64; 2]>| {
            let mut kept: Vec<[f64; 2]> = Vec::new();
            for point in points {
                while kept.len() > 1 && turn(kept[kept.len() - 2], kept[kept.len() - 1], point) <= 0.0 {
                    kept.pop();
                }
                kept.push(point);
            }
            kept.pop();
            kept
        };
        let mut hull = side(&mut points.iter().copied());
        hull.extend(side(&mut points.iter().rev().copied()));
        Ok(Self { hull, margin })
    }

    /// Returns true if principal stretches lie in the region, or within 2 % of its extent beside it.
    pub fn contains(&self, stretches: [f64; 3]) -> bool {
        let at = place(stretches);
        let edges = || self.hull.iter().zip(self.hull.iter().cycle().skip(1));
        edges().count() > 2 && edges().all(|(a, b)| turn(*a, *b, at) >= 0.0)
            || edges().any(|(a, b)| distance(*a, *b, at) <= self.margin)
    }
}

/// Coordinates of stretches in the plane of the hull.
fn place(stretches: [f64; 3]) -> [f64; 2] {
    let mut logs = stretches.map(f64::ln);
    logs.sort_by(|a, b| b.total_cmp(a));
    [logs[0] - logs[1], logs[1] - logs[2]]
}

/// Twice the area of the triangle abc, positive if it is counter-clockwise.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Distance of a point from the segment ab.
fn distance(a: [f64; 2], b: [f64; 2], at: [f64; 2]) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let square = along[0] * along[0] + along[1] * along[1];
    let part = ((at[0] - a[0]) * along[0] + (at[1] - a[1]) * along[1]) / square;
    let part = if square > 0.0 { part.clamp(0.0, 1.0) } else { 0.0 };
    (at[0] - a[0] - part * along[0]).hypot(at[1] - a[1] - part * along[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::hyperelastic::data::{Mode, TestState};
    use crate::constitutive::hyperelastic::homogeneous::incompressible;

    fn coverage(tests: &[(Mode, f64)]) -> Coverage {
        let state = |&(mode, l): &(Mode, f64)| {
            let stretches = [l, mode.second_stretch(l)];
            TestState::new(mode, stretches, [1.0, 0.0])
        };
        Coverage::new(&TestData::new(String::new(), tests.iter().map(state).collect())).unwrap()
    }

    #[test]
    fn tests_cover_their_own_states() {
        let holds = |coverage: &Coverage, mode: Mode, l: f64| {
            coverage.contains(incompressible(l, mode.second_stretch(l)).unwrap())
        };
        let bar = coverage(&[(Mode::Uniaxial, 1.5), (Mode::Uniaxial, 3.0)]);
        assert!(holds(&bar, Mode::Uniaxial, 1.2) && holds(&bar, Mode::Uniaxial, 3.0));
        assert!(holds(&bar, Mode::Equibiaxial, 1.0), "rest");
        for (mode, l) in [(Mode::Uniaxial, 3.2), (Mode::PureShear, 1.5), (Mode::Equibiaxial, 1.3)] {
            assert!(!holds(&bar, mode, l), "{mode:?} {l}");
        }
        assert!(!holds(&bar, Mode::Uniaxial, 0.7), "compression is another mode");
        // compression to 1/4 is equibiaxial tension to 2, and with tension it encloses pure shear
        let both = coverage(&[(Mode::Uniaxial, 3.0), (Mode::Uniaxial, 0.25)]);
        assert!(holds(&both, Mode::Equibiaxial, 2.0) && !holds(&both, Mode::Equibiaxial, 2.1));
        assert!(holds(&both, Mode::PureShear, 1.5) && !holds(&both, Mode::PureShear, 3.0));
    }
}

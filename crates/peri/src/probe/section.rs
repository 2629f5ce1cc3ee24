//! Forces across sections of a body: the sum of the bond forces that cross a plane, as the areal force
//! density of Silling (2000), doi:10.1016/S0022-5096(99)00029-0, over the whole plane.

use super::StressEvaluator;
use crate::bonds::Bonds;
use crate::error::Error;
use crate::solver::State;

/// Distance from a plane, over the spacing, up to which a particle counts as behind it.
const ON_PLANE: f64 = 1e-9;

/// A plane through the body at rest (a line in a plane body), with the particles behind it that have bonds to
/// the front.
pub struct Section<const D: usize> {
    point: [f64; D],
    normal: [f64; D],
    /// Sites behind the plane with bonds to the front in the reference state.
    behind: Vec<u32>,
    /// Distance up to which a particle counts as behind, m.
    on: f64,
}

impl<const D: usize> Section<D> {
    /// Finds the bonds that cross the plane through `point`, m, with a unit `normal`.
    ///
    /// # Errors
    /// [`Error::Geometry`] if no bond crosses it.
    pub fn new(bonds: &dyn Bonds<D>, point: [f64; D], normal: [f64; D]) -> Result<Self, Error> {
        let mut section = Self { point, normal, behind: Vec::new(), on: ON_PLANE * bonds.spacing() };
        let crosses = |site: usize| {
            let mut crosses = false;
            bonds.neighbours(site, &mut |bond| crosses |= section.is_in_front(bonds.position(bond.site)));
            crosses
        };
        let reach = bonds.horizon() * (1.0 + ON_PLANE);
        let near = |site: usize| (-reach..=section.on).contains(&section.height(bonds.position(site)));
        let all = bonds.particles().iter().copied();
        let behind: Vec<u32> = all.filter(|&site| near(site as usize) && crosses(site as usize)).collect();
        if behind.is_empty() {
            return Err(Error::geometry("a plane that no bond crosses".to_owned()));
        }
        section.behind = behind;
        Ok(section)
    }

    fn height(&self, place: [f64; D]) -> f64 {
        (0..D).map(|d| (place[d] - self.point[d]) * self.normal[d]).sum::<f64>()
    }

    fn is_in_front(&self, place: [f64; D]) -> bool {
        self.height(place) > self.on
    }

    /// Computes the force, N, by which the part in front of the plane pulls the part behind, and its moment
    /// about the point, N m: F = Σ f_IJ V_I V_J over the intact bonds from behind to front, and the moments
    /// of these forces in deformed positions; for solids with the couples of their bonds
    /// ([`StressEvaluator::couple`]).
    pub fn force(
        &self,
        evaluator: &StressEvaluator<D>,
        bonds: &dyn Bonds<D>,
        state: &State<D>,
    ) -> ([f64; D], [f64; 3]) {
        let (mut force, mut moment) = ([0.0; D], [0.0; 3]);
        let in_front = |site: usize| self.is_in_front(bonds.position(site));
        evaluator.forces(bonds, state, &self.behind, &in_front, &mut |site, sum| {
            let (rest, own) = (bonds.position(site), state.displacement.get(site));
            let arm: [f64; D] = std::array::from_fn(|d| rest[d] + own[d] - self.point[d]);
            let at = |of: [f64; D], d: usize| of.get(d).copied().unwrap_or(0.0);
            for d in 0..3 {
                let (a, b) = ((d + 1) % 3, (d + 2) % 3);
                moment[d] += at(arm, a) * at(sum, b) - at(arm, b) * at(sum, a);
            }
            for d in 0..D {
                force[d] += sum[d];
            }
        });
        let couple = evaluator.couple(bonds, state, &self.behind, &in_front);
        (0..3).for_each(|d| moment[d] += couple[d]);
        (force, moment)
    }
}

//! The two passes of a solid on a cloud, by the kernels of [`crate::bonds`].

use super::family::Bond;
use super::nonlocal_solid::NonlocalSolid;
use super::point::SolidPoint;
use super::point_law::PointLaw;
use super::pointwise::Passes;
use super::solid_passes::Families;
use super::tensor::BodyTensor;
use crate::bonds::{
    BodyGeometry, BondDamage, BondKind, Bonds, CloudBonds, CloudPlaces, MomentColumns, Softened,
    StretchRange, among,
};
use crate::field::{CHUNK, Field, chunk_range};
use crate::parallel;

/// Data of every particle that both passes read.
pub struct CloudPasses<const D: usize> {
    places: CloudPlaces<D>,
    /// A and S, and if there is θ also P, over Σ_K V_K.
    terms: Vec<MomentColumns<D>>,
    families: Families,
}

impl<const D: usize> CloudPasses<D> {
    pub fn new(cloud: &CloudBonds<D>) -> Self {
        let places = cloud.places();
        let terms = vec![[[0.0; 4]; D]; places.stride() * cloud.sites()];
        Self { places, terms, families: Families::new(cloud.sites()) }
    }
}

/// Returns a softened bond and its loss of V/|ξ|², as a negative number.
fn lack<const D: usize>(cloud: &CloudBonds<D>, soft: &Softened, displacement: &Field<D>) -> (f64, Bond<D>) {
    let site = soft.site as usize;
    let bond = Bond::new(site, &cloud.whole_bond(site, soft.index), displacement);
    ((soft.integrity - 1.0) * bond.volume / (bond.length * bond.length), bond)
}

impl<L: PointLaw<D>, const D: usize> Passes<NonlocalSolid<L>, D> for CloudPasses<D> {
    fn prepare(
        &mut self,
        solid: &NonlocalSolid<L>,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        points: &mut [SolidPoint<D>],
    ) {
        let BondKind::Cloud(cloud) = bonds.kind() else { return };
        let changes = self.families.changes(bonds);
        let softening = cloud.softening();
        self.places.load(displacement);
        let (places, stride) = (&self.places, self.places.stride());
        let items = self.terms.chunks_mut(stride * CHUNK).zip(self.families.bonded.chunks_mut(CHUNK));
        let items = items.zip(points.chunks_mut(CHUNK)).collect();
        let springs = parallel::map_items(items, |chunk, ((terms, bonded), points)| {
            let (mut springs, first) = (false, chunk * CHUNK);
            let soft = softening.among(chunk_range(chunk, cloud.sites()));
            changes.reshape(solid, (bonds, displacement), (first, soft), bonded, points);
            cloud.moments(places, chunk, &mut |site, moments| {
                let (at, point) = (site - first, &mut points[site - first]);
                if point.has_gradient() {
                    let mut square = moments.square;
                    let mut moment = BodyTensor::<D>::from_fn(|a, b| moments.first[b][a]);
                    let mut shifted = BodyTensor::<D>::from_fn(|a, b| moments.shifted[b][a]);
                    // the kernel treats every bond as intact
                    for soft in among(soft, site..site + 1) {
                        let (lack, bond) = lack(cloud, soft, displacement);
                        square += bond.change.iter().map(|x| lack * x * x).sum::<f64>();
                        moment += BodyTensor::from_fn(|a, b| lack * bond.change[a] * bond.reference[b]);
                        shifted += BodyTensor::from_fn(|a, b| lack * bond.change[a] * bond.relief[b]);
                    }
                    point.deform(moment, shifted, square);
                    point.answer(solid.law_of(point));
                } else {
                    point.spring(solid.law_of(point));
                    springs |= bonded[at] > 0;
                }
                let terms = &mut terms[stride * at..stride * (at + 1)];
                point.fill(terms);
            });
            springs
        });
        self.families.mark(bonds, points, springs.contains(&true));
    }

    fn force(
        &self,
        _solid: &NonlocalSolid<L>,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        points: &[SolidPoint<D>],
        chunk: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    ) {
        let BondKind::Cloud(cloud) = bonds.kind() else { return };
        cloud.linear_force(&self.places, &self.terms, chunk, force, track);
        let first = chunk * CHUNK;
        for soft in cloud.softening().among(first..first + force[0].len()) {
            let (lack, bond) = lack(cloud, soft, displacement);
            let linear = points[bond.from].linear(&points[bond.to], &bond);
            for d in 0..D {
                force[d][bond.from - first] += lack * linear[d];
            }
        }
        self.families.pull(bonds, displacement, points, first, force);
    }
}

//! The two passes of a solid on a lattice, by the kernels of [`crate::bonds`], and parts shared with clouds.

use super::DeformedBody;
use super::family::Family;
use super::filter::Filter;
use super::nonlocal_solid::NonlocalSolid;
use super::point::SolidPoint;
use super::point_law::PointLaw;
use super::pointwise::{Passes, copy_to_images};
use super::tensor::BodyTensor;
use crate::bonds::{BodyGeometry, BondDamage, Bonds, LinearRow, Softened, StretchRange, among};
use crate::field::{CHUNK, Field, chunk_range};
use crate::parallel;

/// Data of the second pass, N = 1 + D²: A and S of every site.
pub struct SolidPasses<const D: usize, const N: usize> {
    rows: Vec<LinearRow<D>>,
    terms: Field<N>,
    families: Families,
    filter: Filter,
}

/// Tracks changes of families.
pub(super) struct Families {
    /// Intact bonds of each site when its shape tensor was last computed.
    pub(super) bonded: Vec<u32>,
    /// Intact directed bonds of the body then; `None` before the first pass.
    known: Option<u64>,
    /// Revision of its softened bonds then.
    revision: u64,
    /// Particles with springs in place of the law, and their neighbours; empty if there are none.
    sprung: Vec<bool>,
}

impl Families {
    pub(super) fn new(sites: usize) -> Self {
        Self { bonded: vec![0; sites], known: None, revision: 0, sprung: Vec::new() }
    }

    /// Detects changes since the last pass.
    pub(super) fn changes<const D: usize>(&mut self, bonds: &dyn Bonds<D>) -> FamilyChanges {
        let revision = bonds.softening().revision();
        let softer = self.revision != revision;
        let any = softer || self.known != Some(bonds.directed_bonds());
        (self.known, self.revision) = (Some(bonds.directed_bonds()), revision);
        FamilyChanges { any, softer }
    }

    /// Finds the particles with springs and their neighbours, if there are `springs`.
    pub(super) fn mark<const D: usize>(
        &mut self,
        bonds: &dyn Bonds<D>,
        points: &[SolidPoint<D>],
        springs: bool,
    ) {
        self.sprung.clear();
        if springs {
            self.sprung.resize(bonds.sites(), false);
            for site in bonds.particles().iter().map(|&site| site as usize) {
                if !points[site].has_gradient() {
                    self.sprung[site] = true;
                    bonds.neighbours(site, &mut |bond| self.sprung[bond.site] = true);
                }
            }
        }
    }

    /// Adds the forces of springs from site `first` on.
    pub(super) fn pull<const D: usize>(
        &self,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        points: &[SolidPoint<D>],
        first: usize,
        force: &mut [&mut [f64]; D],
    ) {
        let here = self.sprung.iter().enumerate().skip(first).take(force[0].len());
        for (site, _) in here.filter(|(_, sprung)| **sprung) {
            Family::new(bonds, displacement, site).each(|bond| {
                let pull = points[site].pull(&points[bond.to], &bond);
                for d in 0..D {
                    force[d][site - first] += bond.volume * pull[d];
                }
            });
        }
    }
}

/// Changes of bonds, and of the softened ones among them, since the last pass.
#[derive(Clone, Copy)]
pub(super) struct FamilyChanges {
    any: bool,
    softer: bool,
}

impl FamilyChanges {
    /// Reshapes the particles from the site `first` on whose bonds have changed; `soft` are their softened
    /// bonds.
    pub(super) fn reshape<const D: usize>(
        self,
        solid: &NonlocalSolid<impl PointLaw<D>>,
        (bonds, displacement): DeformedBody<D>,
        (first, soft): (usize, &[Softened]),
        bonded: &mut [u32],
        points: &mut [SolidPoint<D>],
    ) {
        if !self.any {
            return;
        }
        for (at, (bonded, point)) in bonded.iter_mut().zip(points).enumerate() {
            let (site, now) = (first + at, bonds.bonded(first + at));
            if *bonded != now || self.softer && !among(soft, site..site + 1).is_empty() {
                *bonded = now;
                point.reshape(&Family::new(bonds, displacement, site));
                if now == 0 {
                    point.spring(solid.law_of(point));
                }
            }
        }
    }
}

impl<const D: usize, const N: usize> SolidPasses<D, N> {
    /// Creates the passes on a lattice; `None` for clouds.
    pub fn new(bonds: &dyn Bonds<D>) -> Option<Self> {
        let rows = bonds.as_lattice()?.linear_rows();
        let families = Families::new(bonds.sites());
        Some(Self { rows, terms: Field::zeros(bonds.sites()), families, filter: Filter::default() })
    }
}

/// Loss of V/|ξ|² of a softened bond, as a negative number, with its other end, η and ξ.
fn lack<const D: usize>(
    rows: &[LinearRow<D>],
    bond: &Softened,
    displacement: &Field<D>,
) -> (f64, usize, [f64; D], [f64; D]) {
    let (row, site) = (&rows[bond.index as usize], bond.site as usize);
    let there = site.wrapping_add_signed(row.shift);
    let (own, other) = (displacement.get(site), displacement.get(there));
    let lack = (bond.integrity - 1.0) * row.share;
    (lack, there, std::array::from_fn(|d| other[d] - own[d]), row.bond)
}

impl<L: PointLaw<D>, const D: usize, const N: usize> Passes<NonlocalSolid<L>, D> for SolidPasses<D, N> {
    fn prepare(
        &mut self,
        solid: &NonlocalSolid<L>,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        points: &mut [SolidPoint<D>],
    ) {
        let Some(lattice) = bonds.as_lattice() else { return };
        let softening = lattice.softening();
        let changes = self.families.changes(bonds);
        let rows = &self.rows;
        let filters = solid.laws().iter().any(|law| law.filtered(0.0).is_some());
        let items = self.terms.chunks_mut().into_iter().zip(self.families.bonded.chunks_mut(CHUNK));
        let items = items.zip(points.chunks_mut(CHUNK)).collect();
        let springs = parallel::map_items(items, |chunk, ((mut terms, bonded), points)| {
            let mut springs = false;
            let first = chunk * CHUNK;
            let soft = softening.among(chunk_range(chunk, lattice.sites()));
            changes.reshape(solid, (bonds, displacement), (first, soft), bonded, points);
            lattice.moments::<N>(rows, displacement, chunk, &mut |base, moments| {
                for lane in 0..moments[0].len() {
                    let at = base + lane - first;
                    let point = &mut points[at];
                    if point.has_gradient() {
                        let mut moment = BodyTensor::<D>::from_fn(|a, b| moments[1 + a * D + b][lane]);
                        let mut square = moments[0][lane];
                        // the kernel treats every bond as intact
                        for bond in among(soft, base + lane..base + lane + 1) {
                            let (lack, _, change, reference) = lack(rows, bond, displacement);
                            square += change.iter().map(|x| lack * x * x).sum::<f64>();
                            moment += BodyTensor::from_fn(|a, b| lack * change[a] * reference[b]);
                        }
                        point.deform(moment, BodyTensor::zeros(), square);
                        if filters {
                            continue;
                        }
                        point.answer(solid.law_of(point));
                    } else if bonded[at] > 0 {
                        point.spring(solid.law_of(point));
                        springs = true;
                    }
                    for (n, value) in point.terms().enumerate() {
                        terms[n][at] = value;
                    }
                }
            });
            springs
        });
        let springs = springs.contains(&true);
        if filters {
            copy_to_images(bonds, points);
            if changes.any {
                self.filter.link(bonds, points, lattice.spacing());
            }
            self.filter.apply(solid, bonds, points);
            let items = self.terms.chunks_mut().into_iter().zip(points.chunks_mut(CHUNK)).collect();
            parallel::for_items(items, |_, (mut terms, points): (_, &mut [SolidPoint<D>])| {
                for (at, point) in points.iter_mut().enumerate().filter(|(_, point)| point.has_gradient()) {
                    point.answer(solid.law_of(point));
                    point.terms().enumerate().for_each(|(n, value)| terms[n][at] = value);
                }
            });
        }
        copy_to_images(bonds, points);
        for terms in self.terms.components_mut() {
            copy_to_images(bonds, terms);
        }
        self.families.mark(bonds, points, springs);
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
        let Some(lattice) = bonds.as_lattice() else { return };
        lattice.linear_force::<N>(&self.rows, displacement, &self.terms, chunk, force, track);
        let first = chunk * CHUNK;
        let terms = self.terms.components();
        for bond in lattice.softening().among(first..first + force[0].len()) {
            let (lack, there, change, reference) = lack(&self.rows, bond, displacement);
            let at = |n: usize| terms[n][bond.site as usize] + terms[n][there];
            for a in 0..D {
                let stress: f64 = (0..D).map(|b| at(1 + a * D + b) * reference[b]).sum();
                force[a][bond.site as usize - first] += lack * (at(0) * change[a] + stress);
            }
        }
        self.families.pull(bonds, displacement, points, first, force);
    }
}

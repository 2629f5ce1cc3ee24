//! A cloud of particles of any position and volume: neighbour lists in compressed rows, sorted for locality.

use super::cells::CellGrid;
use super::cloud_kernel::{CloudData, ParticleRows};
use super::cloud_laws::CloudLaw;
use super::cloud_lists::{NeighbourLists, NeighbourRows};
use super::rows::{CloudKernel, cloud_kernel};
use super::softening::{Softened, SoftenedBonds, integrity};
use super::{
    BodyGeometry, BondDamage, BondForces, BondKind, Bonds, LawShares, Neighbour, Overstretched,
    VolumeCorrection, plain_force, refuse_one_sided, surface_weight,
};
use crate::error::Error;
use crate::field::{Field, chunk_range};
use crate::geometry::{Cut, Gaps};
use crate::potential::{KernelFit, StretchRange};
use std::ops::Range;

/// The bonds of a cloud.
pub struct CloudBonds<const D: usize> {
    position: Field<D>,
    volumes: Vec<f64>,
    /// Index of each site's particle in the input.
    input_order: Vec<u32>,
    particles: Vec<u32>,
    horizon: f64,
    spacing: f64,
    thickness: f64,
    volume_correction: VolumeCorrection,
    lists: NeighbourLists,
    pub(super) law: CloudBondLaw<D>,
    factors: Option<Field<D>>,
    softening: SoftenedBonds,
    /// θ of [`BodyGeometry::relief`].
    relief: Option<Field<D>>,
}

/// The law of the bonds of a cloud.
#[derive(Default)]
pub(super) struct CloudBondLaw<const D: usize> {
    /// w V_J of each bond, where bonds differ in it.
    weights: Vec<f64>,
    /// 2kθ, times the common w V_J.
    stiffness: f64,
    /// Displacement of all particles last given to [`BondForces::prepare`]; empty before.
    rows: ParticleRows,
    kernel: Option<Box<dyn CloudKernel<D>>>,
    /// A law that only a table represents, and kθ.
    table: Option<(KernelFit, f64)>,
    /// Passes of several laws, instead of the one law.
    pub passes: Vec<CloudLaw<D>>,
}

/// Validates points, volumes and horizon.
fn check<const D: usize>(points: &[[f64; D]], volumes: &[f64], horizon: f64) -> Result<(), Error> {
    let what = if points.is_empty() {
        "the body contains no particle".to_owned()
    } else if points.len() != volumes.len() {
        format!("{} points with {} volumes", points.len(), volumes.len())
    } else if let Some(bad) = points.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
        format!("point {bad}: found {:?} m; allowed: finite", points[bad])
    } else if !(horizon > 0.0 && horizon.is_finite()) {
        format!("horizon: found {horizon} m; allowed: above 0, finite")
    } else if let Some(bad) = volumes.iter().position(|&v| !(v > 0.0 && v.is_finite())) {
        format!("volume of point {bad}: found {}; allowed: above 0", volumes[bad])
    } else {
        return Ok(());
    };
    Err(Error::geometry(what))
}

impl<const D: usize> CloudBonds<D> {
    /// Bonds all pairs within `horizon`, except those that cross a cut.
    ///
    /// # Errors
    /// [`Error::Geometry`] for an empty cloud, positions that are not finite, volumes too few, too many or
    /// not positive, two particles in one place, or a horizon that is not positive.
    pub fn new(
        points: &[[f64; D]],
        volumes: &[f64],
        thickness: f64,
        horizon: f64,
        volume_correction: VolumeCorrection,
        cuts: &[Cut<D>],
    ) -> Result<Self, Error> {
        Self::with_gaps(points, volumes, thickness, horizon, volume_correction, cuts, None)
    }

    /// Builds bonds as [`Self::new`] does, except those that cross a gap.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_gaps(
        points: &[[f64; D]],
        volumes: &[f64],
        thickness: f64,
        horizon: f64,
        volume_correction: VolumeCorrection,
        cuts: &[Cut<D>],
        gaps: Option<&Gaps<D>>,
    ) -> Result<Self, Error> {
        check(points, volumes, horizon)?;
        let input_order = CellGrid::new(points, horizon).order().to_vec();
        let sorted: Vec<[f64; D]> = input_order.iter().map(|&i| points[i as usize]).collect();
        let lists = NeighbourLists::new(&sorted, &input_order, horizon, cuts, gaps)?;
        let mut position = Field::zeros(sorted.len());
        for (site, &point) in sorted.iter().enumerate() {
            position.set(site, point);
        }
        let volumes: Vec<f64> = input_order.iter().map(|&i| volumes[i as usize]).collect();
        let mean = volumes.iter().sum::<f64>() / volumes.len() as f64 / thickness;
        let bonds = Self {
            particles: (0..sorted.len() as u32).collect(),
            position,
            volumes,
            input_order,
            horizon,
            spacing: mean.powf(1.0 / D as f64),
            thickness,
            volume_correction,
            lists,
            law: CloudBondLaw::default(),
            factors: None,
            softening: SoftenedBonds::default(),
            relief: None,
        };
        refuse_one_sided(&bonds)?;
        Ok(bonds)
    }

    /// Thickness of the body (1 in 3D), m.
    pub fn thickness(&self) -> f64 {
        self.thickness
    }

    /// Index in the input of the particle in each site.
    pub fn input_order(&self) -> &[u32] {
        &self.input_order
    }

    /// Sites whose family a cut has divided, ascending.
    pub fn parted(&self) -> &[u32] {
        &self.lists.parted
    }

    pub(super) fn positions(&self) -> &Field<D> {
        &self.position
    }

    pub(super) fn volumes(&self) -> &[f64] {
        &self.volumes
    }

    pub(super) fn lists(&self) -> NeighbourRows<'_> {
        let partial =
            (self.volume_correction == VolumeCorrection::Linear).then_some([self.horizon, self.spacing]);
        let NeighbourLists { starts, neighbours, inverse_length, .. } = &self.lists;
        NeighbourRows { starts, neighbours, inverse_length, partial }
    }

    /// Returns a bond of a site by its [`Neighbour::index`], ignoring softening.
    pub fn whole_bond(&self, site: usize, index: u32) -> Neighbour<D> {
        self.whole(site, self.lists.starts[site] + index as usize)
    }

    /// Computes e = λ² − 1 of the bonds of a site; 0 for broken ones.
    fn excesses<'a>(&'a self, displacement: &'a Field<D>, site: usize) -> impl Iterator<Item = f64> + 'a {
        let (position, moved) = (self.position.components(), displacement.components());
        let (here, own) = (self.position.get(site), displacement.get(site));
        let row = self.lists.row(site);
        let bonds = self.lists.neighbours[row.clone()].iter().zip(&self.lists.inverse_length[row]);
        bonds.map(move |(&other, inverse)| {
            let mut e = 0.0;
            for d in 0..D {
                let bond = position[d][other as usize] - here[d];
                let eta = moved[d][other as usize] - own[d];
                e += eta * (2.0 * bond + eta);
            }
            e * inverse * inverse
        })
    }

    /// Returns the range of sites that bonds of `sites` reach.
    fn reached_by(&self, sites: Range<usize>) -> Range<usize> {
        let met = &self.lists.neighbours[self.lists.starts[sites.start]..self.lists.starts[sites.end]];
        let first = met.iter().min().map_or(sites.start, |&first| sites.start.min(first as usize));
        let last = met.iter().max().map_or(sites.end, |&last| sites.end.max(last as usize + 1));
        first..last
    }

    fn whole(&self, site: usize, k: usize) -> Neighbour<D> {
        let other = self.lists.neighbours[k] as usize;
        let (here, there) = (self.position.get(site), self.position.get(other));
        let bond: [f64; D] = std::array::from_fn(|d| there[d] - here[d]);
        let length = bond.iter().map(|x| x * x).sum::<f64>().sqrt();
        let volume = self.volumes[other] * self.volume_correction.factor(length, self.horizon, self.spacing);
        let surface =
            self.factors.as_ref().map_or(1.0, |g| surface_weight(bond, length, g.get(site), g.get(other)));
        let index = (k - self.lists.starts[site]) as u32;
        let relief = self.relief.as_ref().map_or([0.0; D], |theta| {
            let (here, there) = (theta.get(site), theta.get(other));
            std::array::from_fn(|d| there[d] - here[d])
        });
        Neighbour { site: other, index, bond, length, volume, weight: volume * surface, relief }
    }
}

/// Applies softening to an intact bond.
fn with_softening<const D: usize>(bond: Neighbour<D>, soft: &[Softened]) -> Neighbour<D> {
    let part = integrity(soft, bond.index);
    Neighbour { volume: part * bond.volume, weight: part * bond.weight, ..bond }
}

impl<const D: usize> BodyGeometry<D> for CloudBonds<D> {
    fn sites(&self) -> usize {
        self.volumes.len()
    }

    fn particles(&self) -> &[u32] {
        &self.particles
    }

    fn position(&self, site: usize) -> [f64; D] {
        self.position.get(site)
    }

    fn volume(&self, site: usize) -> f64 {
        self.volumes[site]
    }

    fn horizon(&self) -> f64 {
        self.horizon
    }

    fn spacing(&self) -> f64 {
        self.spacing
    }

    fn neighbours(&self, site: usize, visit: &mut dyn FnMut(Neighbour<D>)) {
        let soft = self.softening.among(site..site + 1);
        for k in self.lists.row(site) {
            if self.lists.neighbours[k] as usize != site {
                visit(with_softening(self.whole(site, k), soft));
            }
        }
    }

    fn bond(&self, site: usize, index: u32) -> Neighbour<D> {
        with_softening(self.whole_bond(site, index), self.softening.among(site..site + 1))
    }

    fn bonded(&self, site: usize) -> u32 {
        let row = &self.lists.inverse_length[self.lists.row(site)];
        row.iter().map(|&inverse| u32::from(inverse > 0.0)).sum()
    }

    fn is_bonded(&self, site: usize, other: usize) -> bool {
        site != other && self.lists.neighbours[self.lists.row(site)].contains(&(other as u32))
    }

    fn relief(&self) -> Option<&Field<D>> {
        self.relief.as_ref()
    }
}

impl<const D: usize> BondForces<D> for CloudBonds<D> {
    fn set_law(&mut self, fit: &KernelFit, modulus: f64) {
        let common = self.volumes[0];
        let alike = self.factors.is_none()
            && self.volume_correction == VolumeCorrection::None
            && self.volumes.iter().all(|&v| v == common);
        self.law.stiffness = 2.0 * modulus * if alike { common } else { 1.0 };
        self.law.weights = Vec::new();
        if !alike {
            let weight = |site: usize, k: usize| {
                if self.lists.neighbours[k] as usize == site { 0.0 } else { self.whole(site, k).weight }
            };
            let of_site = |site: usize| (self.lists.row(site)).map(move |k| (site, k));
            self.law.weights =
                (0..self.volumes.len()).flat_map(of_site).map(|(site, k)| weight(site, k)).collect();
        }
        self.law.kernel = cloud_kernel(fit);
        self.law.table = self.law.kernel.is_none().then(|| (fit.clone(), modulus));
        self.law.passes = Vec::new();
    }

    fn set_laws(&mut self, fits: &[&KernelFit], modulus: f64, shares: &LawShares) -> bool {
        let pass = |(law, fit): (usize, &&KernelFit)| CloudLaw::new(self, fit, modulus, (shares, law));
        let passes: Option<Vec<_>> = fits.iter().enumerate().map(pass).collect();
        self.law.passes = passes.unwrap_or_default();
        !self.law.passes.is_empty()
    }

    fn set_factors(&mut self, factors: Field<D>) {
        self.factors = Some(factors);
    }

    fn prepare(&mut self, displacement: &Field<D>) {
        match self.law.kernel {
            Some(_) if self.law.rows.is_empty() => {
                self.law.rows = ParticleRows::new(&self.position, displacement, 0..self.volumes.len());
            }
            Some(_) => self.law.rows.load(displacement),
            None => {}
        }
    }

    fn force(
        &self,
        displacement: &Field<D>,
        start: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    ) {
        if let Some(kernel) = &self.law.kernel {
            let own;
            let rows = if self.law.rows.is_empty() {
                own = ParticleRows::new(
                    &self.position,
                    displacement,
                    self.reached_by(start..start + force[0].len()),
                );
                &own
            } else {
                assert!(self.law.rows.has_particles::<D>(self.volumes.len()));
                debug_assert!(
                    self.law.rows.matches(displacement, start..start + force[0].len()),
                    "of another displacement"
                );
                &self.law.rows
            };
            let data = CloudData {
                rows,
                starts: &self.lists.starts,
                neighbours: &self.lists.neighbours,
                inverse_length: &self.lists.inverse_length,
                weights: &self.law.weights,
                stiffness: self.law.stiffness,
            };
            if self.law.passes.is_empty() {
                kernel.run(&data, start, force, track);
            } else {
                self.force_of_laws(&data, start, force, track);
            }
        } else if let Some((fit, modulus)) = &self.law.table {
            plain_force(self, fit, *modulus, displacement, start, force, track);
        }
    }

    fn stretches(&self, displacement: &Field<D>, chunk: usize) -> StretchRange {
        let sites = chunk_range(chunk, self.volumes.len());
        let bonds = sites.flat_map(|site| self.excesses(displacement, site));
        bonds.fold(StretchRange::REST, |range, e| range.join(StretchRange { low: e, high: e }))
    }

    fn suspects(&self, displacement: &Field<D>, sites: Range<usize>, least: f64) -> Vec<[u32; 2]> {
        let mut found = Vec::new();
        for site in sites {
            for (k, e) in self.excesses(displacement, site).enumerate() {
                // below no stretch, broken bonds have 0
                if e > least && self.lists.inverse_length[self.lists.starts[site] + k] > 0.0 {
                    found.push([site as u32, k as u32]);
                }
            }
        }
        found
    }

    fn set_relief(&mut self, relief: Field<D>) {
        self.relief = Some(relief);
    }
}

impl<const D: usize> BondDamage<D> for CloudBonds<D> {
    fn break_bonds(&mut self, bonds: &[Overstretched]) {
        for bond in bonds {
            self.lists.break_bond(bond.site, self.lists.starts[bond.site as usize] + bond.index as usize);
        }
    }

    fn softening(&self) -> &SoftenedBonds {
        &self.softening
    }

    fn soften(&mut self, bonds: Vec<Softened>) {
        self.softening.replace(bonds);
    }

    fn intact(&self) -> Vec<u64> {
        let bits = |part: &[f64]| {
            part.iter().enumerate().fold(0, |word, (k, inverse)| word | u64::from(*inverse > 0.0) << k)
        };
        self.lists.inverse_length.chunks(64).map(bits).collect()
    }

    fn bit(&self, site: usize, index: u32) -> (usize, u64) {
        let k = self.lists.starts[site] + index as usize;
        (k / 64, 1 << (k % 64))
    }

    fn restore(&mut self, words: &[u64]) -> bool {
        if words.len() != self.lists.inverse_length.len().div_ceil(64) {
            return false;
        }
        for site in 0..self.volumes.len() {
            for k in self.lists.row(site) {
                if self.lists.inverse_length[k] > 0.0 && words[k / 64] >> (k % 64) & 1 == 0 {
                    self.lists.break_bond(site as u32, k);
                }
            }
        }
        true
    }

    fn directed_bonds(&self) -> u64 {
        self.lists.directed_bonds
    }
}

impl<const D: usize> Bonds<D> for CloudBonds<D> {
    fn bytes(&self) -> usize {
        let bonds = self.lists.neighbours.len() * (4 + 8) + self.law.weights.len() * 8;
        bonds
            + self.volumes.len() * (8 * D + 8 + 4 + 4 + 8)
            + self.lists.parted.len() * 4
            + self.law.rows.bytes()
            + self.law.passes.iter().map(CloudLaw::bytes).sum::<usize>()
            + [&self.factors, &self.relief].into_iter().flatten().map(|f| 8 * D * f.sites()).sum::<usize>()
    }

    fn kind(&self) -> BondKind<'_, D> {
        BondKind::Cloud(self)
    }
}

//! A cloud of particles of any position and volume: neighbour lists in compressed rows, sorted for locality.

use super::cells::CellGrid;
use super::cloud_kernel::{CloudData, GROUP, Rows};
use super::cloud_linear::CloudPlaces;
use super::rows::{CloudKernel, cloud_kernel};
use super::softening::{Softened, Softening, integrity};
use super::{
    Bonds, Kind, Neighbour, Overstretched, VolumeCorrection, plain_force, refuse_one_sided, surface_weight,
};
use crate::error::Error;
use crate::field::{Field, chunk_range};
use crate::geometry::{Cut, Gaps, cuts_within, severed};
use crate::potential::{KernelFit, StretchRange};
use rayon::prelude::*;
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
    starts: Vec<usize>,
    neighbours: Vec<u32>,
    /// 1/|ξ| of each bond; 0 for the padding.
    inverse_length: Vec<f64>,
    /// w V_J of each bond, where bonds differ in it.
    weights: Vec<f64>,
    /// 2kθ, times the common w V_J.
    stiffness: f64,
    /// All particles in the displacement last given to [`Bonds::round`]; none before.
    rows: Rows,
    factors: Option<Field<D>>,
    kernel: Option<Box<dyn CloudKernel<D>>>,
    /// A law that only a table represents, and kθ.
    table: Option<(KernelFit, f64)>,
    directed_bonds: u64,
    softening: Softening,
    /// Sites whose family a cut has parted, ascending.
    parted: Vec<u32>,
    /// θ of [`Bonds::relief`].
    relief: Option<Field<D>>,
}

/// The compressed rows, and what makes a weight of a volume.
pub(super) struct Lists<'a> {
    pub(super) starts: &'a [usize],
    pub(super) neighbours: &'a [u32],
    /// 1/|ξ|; 0 where broken.
    pub(super) inverse_length: &'a [f64],
    /// δ and Δx of the linear volume correction.
    partial: Option<[f64; 2]>,
}

impl Lists<'_> {
    /// V_J/|ξ|², V_J with its correction.
    #[inline(always)]
    pub(super) fn share(&self, inverse: f64, volume: f64) -> f64 {
        let share = inverse * inverse * volume;
        match self.partial {
            None => share,
            // without a call, which would not inherit the instruction set
            Some([horizon, spacing]) => {
                let part = (horizon + 0.5 * spacing - 1.0 / inverse) / spacing;
                share * part.clamp(0.0, 1.0)
            }
        }
    }
}

impl<const D: usize> CloudBonds<D> {
    /// Bonds of all pairs within `horizon`, less those that cross a cut.
    ///
    /// # Errors
    /// [`Error::Geometry`] for an empty cloud, positions that are not finite, volumes too few, too many or not positive,
    /// two particles in one place, or a horizon that is not positive.
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

    /// As [`Self::new`], without the bonds that cross a gap.
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
        if points.is_empty() {
            return Err(Error::geometry("the body contains no particle".to_owned()));
        }
        if points.len() != volumes.len() {
            return Err(Error::geometry(format!("{} points with {} volumes", points.len(), volumes.len())));
        }
        if let Some(bad) = points.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
            return Err(Error::geometry(format!("point {bad}: found {:?} m; allowed: finite", points[bad])));
        }
        if !(horizon > 0.0 && horizon.is_finite()) {
            return Err(Error::geometry(format!("horizon: found {horizon} m; allowed: above 0, finite")));
        }
        if let Some(bad) = volumes.iter().position(|&v| !(v > 0.0 && v.is_finite())) {
            return Err(Error::geometry(format!(
                "volume of point {bad}: found {}; allowed: above 0",
                volumes[bad]
            )));
        }
        // bonds as long as the horizon are bonds, whatever the rounding of positions
        let reach = horizon * (1.0 + 1e-9);
        let order = CellGrid::new(points, horizon).order().to_vec();
        let sorted: Vec<[f64; D]> = order.iter().map(|&i| points[i as usize]).collect();
        let grid = CellGrid::new(&sorted, reach);
        let lists: Vec<Result<(Vec<u32>, bool), Error>> = sorted
            .par_iter()
            .enumerate()
            .map(|(own, &here)| {
                let mut list = Vec::new();
                let cuts = cuts_within(cuts, here, reach);
                let gaps = gaps.and_then(|gaps| gaps.within(here, reach));
                let (mut twin, mut parted) = (None, false);
                grid.near(here, reach, |other| {
                    let square: f64 = (0..D).map(|d| (sorted[other][d] - here[d]).powi(2)).sum();
                    if other != own && square == 0.0 {
                        twin = Some(other);
                    }
                    if other != own && square <= reach * reach {
                        if severed(&cuts, here, sorted[other]) {
                            parted = true;
                        } else if !gaps.as_ref().is_some_and(|gaps| gaps.severs(here, sorted[other])) {
                            list.push(other as u32);
                        }
                    }
                });
                if let Some(twin) = twin {
                    let (a, b) = (order[own].min(order[twin]), order[own].max(order[twin]));
                    return Err(Error::geometry(format!("points {a} and {b} are both at {here:?} m")));
                }
                list.sort_unstable();
                Ok((list, parted))
            })
            .collect();
        let mut starts = vec![0];
        let mut neighbours = Vec::new();
        let (mut directed_bonds, mut parted) = (0, Vec::new());
        for (own, list) in lists.into_iter().enumerate() {
            let (list, is_parted) = list?;
            parted.extend(is_parted.then_some(own as u32));
            directed_bonds += list.len() as u64;
            let padded = list.len().next_multiple_of(GROUP) - list.len();
            neighbours.extend(list);
            neighbours.extend(std::iter::repeat_n(own as u32, padded));
            starts.push(neighbours.len());
        }
        let mut position = Field::zeros(sorted.len());
        for (site, &point) in sorted.iter().enumerate() {
            position.set(site, point);
        }
        let mut inverse_length = Vec::with_capacity(neighbours.len());
        for own in 0..sorted.len() {
            for &other in &neighbours[starts[own]..starts[own + 1]] {
                let square: f64 = (0..D).map(|d| (sorted[other as usize][d] - sorted[own][d]).powi(2)).sum();
                inverse_length.push(if square > 0.0 { 1.0 / square.sqrt() } else { 0.0 });
            }
        }
        let volumes: Vec<f64> = order.iter().map(|&i| volumes[i as usize]).collect();
        let mean = volumes.iter().sum::<f64>() / volumes.len() as f64 / thickness;
        let bonds = Self {
            particles: (0..sorted.len() as u32).collect(),
            position,
            volumes,
            input_order: order,
            horizon,
            spacing: mean.powf(1.0 / D as f64),
            thickness,
            volume_correction,
            starts,
            neighbours,
            inverse_length,
            weights: Vec::new(),
            stiffness: 0.0,
            rows: Rows::default(),
            factors: None,
            kernel: None,
            table: None,
            directed_bonds,
            softening: Softening::default(),
            parted,
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

    /// Sites whose family a cut has parted, ascending.
    pub fn parted(&self) -> &[u32] {
        &self.parted
    }

    pub(super) fn lists(&self) -> Lists<'_> {
        let partial =
            (self.volume_correction == VolumeCorrection::Linear).then_some([self.horizon, self.spacing]);
        let Self { starts, neighbours, inverse_length, .. } = self;
        Lists { starts, neighbours, inverse_length, partial }
    }

    /// The particles for both passes, without θ.
    pub fn bare_places(&self) -> CloudPlaces<D> {
        CloudPlaces::new(&self.position, &self.volumes)
    }

    /// A bond of a site by its [`Neighbour::index`], as if it were not softened.
    pub fn whole_bond(&self, site: usize, index: u32) -> Neighbour<D> {
        self.whole(site, self.starts[site] + index as usize)
    }

    /// The bonds of a site, and what its list is padded with.
    fn row(&self, site: usize) -> Range<usize> {
        self.starts[site]..self.starts[site + 1]
    }

    /// e = λ² − 1 of the bonds of a site; 0 of those that are broken.
    fn excesses<'a>(&'a self, displacement: &'a Field<D>, site: usize) -> impl Iterator<Item = f64> + 'a {
        let (position, moved) = (self.position.components(), displacement.components());
        let (here, own) = (self.position.get(site), displacement.get(site));
        let row = self.row(site);
        let bonds = self.neighbours[row.clone()].iter().zip(&self.inverse_length[row]);
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

    /// All sites from the first to the last that bonds of these have as ends.
    fn met_by(&self, sites: Range<usize>) -> Range<usize> {
        let met = &self.neighbours[self.starts[sites.start]..self.starts[sites.end]];
        let first = met.iter().min().map_or(sites.start, |&first| sites.start.min(first as usize));
        let last = met.iter().max().map_or(sites.end, |&last| sites.end.max(last as usize + 1));
        first..last
    }

    fn whole(&self, site: usize, k: usize) -> Neighbour<D> {
        let other = self.neighbours[k] as usize;
        let (here, there) = (self.position.get(site), self.position.get(other));
        let bond: [f64; D] = std::array::from_fn(|d| there[d] - here[d]);
        let length = bond.iter().map(|x| x * x).sum::<f64>().sqrt();
        let volume = self.volumes[other] * self.volume_correction.factor(length, self.horizon, self.spacing);
        let surface =
            self.factors.as_ref().map_or(1.0, |g| surface_weight(bond, length, g.get(site), g.get(other)));
        let index = (k - self.starts[site]) as u32;
        let relief = self.relief.as_ref().map_or([0.0; D], |theta| {
            let (here, there) = (theta.get(site), theta.get(other));
            std::array::from_fn(|d| there[d] - here[d])
        });
        Neighbour { site: other, index, bond, length, volume, weight: volume * surface, relief }
    }
}

/// A whole bond, as it is among the softened ones of its site.
fn weakened<const D: usize>(bond: Neighbour<D>, soft: &[Softened]) -> Neighbour<D> {
    let part = integrity(soft, bond.index);
    Neighbour { volume: part * bond.volume, weight: part * bond.weight, ..bond }
}

impl<const D: usize> Bonds<D> for CloudBonds<D> {
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
        for k in self.row(site) {
            if self.neighbours[k] as usize != site {
                visit(weakened(self.whole(site, k), soft));
            }
        }
    }

    fn bond(&self, site: usize, index: u32) -> Neighbour<D> {
        weakened(self.whole_bond(site, index), self.softening.among(site..site + 1))
    }

    fn bonded(&self, site: usize) -> u32 {
        let row = &self.inverse_length[self.starts[site]..self.starts[site + 1]];
        row.iter().map(|&inverse| u32::from(inverse > 0.0)).sum()
    }

    fn is_bonded(&self, site: usize, other: usize) -> bool {
        site != other && self.neighbours[self.starts[site]..self.starts[site + 1]].contains(&(other as u32))
    }

    fn set_law(&mut self, fit: &KernelFit, modulus: f64) {
        let common = self.volumes[0];
        let alike = self.factors.is_none()
            && self.volume_correction == VolumeCorrection::None
            && self.volumes.iter().all(|&v| v == common);
        self.stiffness = 2.0 * modulus * if alike { common } else { 1.0 };
        self.weights = Vec::new();
        if !alike {
            let weight = |site: usize, k: usize| {
                if self.neighbours[k] as usize == site { 0.0 } else { self.whole(site, k).weight }
            };
            let of_site = |site: usize| (self.starts[site]..self.starts[site + 1]).map(move |k| (site, k));
            self.weights =
                (0..self.volumes.len()).flat_map(of_site).map(|(site, k)| weight(site, k)).collect();
        }
        self.kernel = cloud_kernel(fit);
        self.table = self.kernel.is_none().then(|| (fit.clone(), modulus));
    }

    fn set_factors(&mut self, factors: Field<D>) {
        self.factors = Some(factors);
    }

    fn round(&mut self, displacement: &Field<D>) {
        match self.kernel {
            Some(_) if self.rows.is_empty() => {
                self.rows = Rows::new(&self.position, displacement, 0..self.volumes.len());
            }
            Some(_) => self.rows.load(displacement),
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
        if let Some(kernel) = &self.kernel {
            let own;
            let rows = if self.rows.is_empty() {
                own = Rows::new(&self.position, displacement, self.met_by(start..start + force[0].len()));
                &own
            } else {
                assert!(self.rows.are_of::<D>(self.volumes.len()));
                debug_assert!(
                    self.rows.holds(displacement, start..start + force[0].len()),
                    "of another displacement"
                );
                &self.rows
            };
            let data = CloudData {
                rows,
                starts: &self.starts,
                neighbours: &self.neighbours,
                inverse_length: &self.inverse_length,
                weights: &self.weights,
                stiffness: self.stiffness,
            };
            kernel.run(&data, start, force, track);
        } else if let Some((fit, modulus)) = &self.table {
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
                if e > least && self.inverse_length[self.starts[site] + k] > 0.0 {
                    found.push([site as u32, k as u32]);
                }
            }
        }
        found
    }

    fn sever(&mut self, bonds: &[Overstretched]) {
        for bond in bonds {
            // as the padding of the lists: a bond of no stiffness to itself
            let k = self.starts[bond.site as usize] + bond.index as usize;
            self.neighbours[k] = bond.site;
            self.inverse_length[k] = 0.0;
        }
        self.directed_bonds -= bonds.len() as u64;
    }

    fn set_relief(&mut self, relief: Field<D>) {
        self.relief = Some(relief);
    }

    fn relief(&self) -> Option<&Field<D>> {
        self.relief.as_ref()
    }

    fn softening(&self) -> &Softening {
        &self.softening
    }

    fn soften(&mut self, bonds: Vec<Softened>) {
        self.softening.replace(bonds);
    }

    fn intact(&self) -> Vec<u64> {
        let bits = |part: &[f64]| {
            part.iter().enumerate().fold(0, |word, (k, inverse)| word | u64::from(*inverse > 0.0) << k)
        };
        self.inverse_length.chunks(64).map(bits).collect()
    }

    fn bit(&self, site: usize, index: u32) -> (usize, u64) {
        let k = self.starts[site] + index as usize;
        (k / 64, 1 << (k % 64))
    }

    fn restore(&mut self, words: &[u64]) -> bool {
        if words.len() != self.inverse_length.len().div_ceil(64) {
            return false;
        }
        for site in 0..self.volumes.len() {
            for k in self.starts[site]..self.starts[site + 1] {
                if self.inverse_length[k] > 0.0 && words[k / 64] >> (k % 64) & 1 == 0 {
                    self.neighbours[k] = site as u32;
                    self.inverse_length[k] = 0.0;
                    self.directed_bonds -= 1;
                }
            }
        }
        true
    }

    fn directed_bonds(&self) -> u64 {
        self.directed_bonds
    }

    fn bytes(&self) -> usize {
        let bonds = self.neighbours.len() * (4 + 8) + self.weights.len() * 8;
        bonds
            + self.volumes.len() * (8 * D + 8 + 4 + 4 + 8)
            + self.parted.len() * 4
            + self.rows.bytes()
            + [&self.factors, &self.relief].into_iter().flatten().map(|f| 8 * D * f.sites()).sum::<usize>()
    }

    fn kind(&self) -> Kind<'_, D> {
        Kind::Cloud(self)
    }
}

//! A regular lattice: one stencil of offsets, a bit mask of intact bonds per particle, no neighbour list.

mod connect;
mod damage;
#[cfg(feature = "gpu")]
mod device;
mod laws;
mod mixed;
mod periodic;

use super::lattice_factors::Factors;
use super::lattice_kernel::{TILE, TileClass, Tiles};
use super::lattice_sums::{GradientSums, Span, Spans, Weights};
use super::rows::{LatticeKernel, StencilBond, lattice_kernel};
use super::softening::{Softened, SoftenedBonds, integrity};
use super::stencil::{Stencil, fullest, layout, storage};
use super::{
    BodyGeometry, BondForces, BondKind, Bonds, LawShares, Neighbour, VolumeCorrection, plain_force,
    refuse_one_sided, surface_weight,
};
use crate::error::Error;
use crate::field::{Field, chunk_range};
use crate::geometry::{Cut, Gaps, Lattice, refuse_too_large};
use crate::potential::{EnergyTable, KernelFit, StretchRange, TangentTable};
use laws::LawPass;
use mixed::Mixed;
pub use periodic::PeriodicImage;
use periodic::repeated;
use rayon::prelude::*;
use std::ops::Range;

/// The bonds of a lattice.
pub struct LatticeBonds<const D: usize> {
    lattice: Lattice<D>,
    stencil: Stencil<D>,
    spans: Vec<Span<D>>,
    ratio: f64,
    volume_correction: VolumeCorrection,
    /// Axes, in the order in which neighbours are adjacent in storage.
    order: [usize; D],
    /// Steps in sites along each axis.
    strides: [usize; D],
    guard: usize,
    sites: usize,
    particles: Vec<u32>,
    intact: Vec<Vec<u64>>,
    classes: Vec<TileClass>,
    factors: Option<Field<D>>,
    /// True if the factors are equal along all axes.
    even: bool,
    /// Interior value of the factors, part of each bond's weight; stored factors are relative to it.
    interior_factor: f64,
    kernel: Option<Box<dyn LatticeKernel<D>>>,
    /// The fitted law, and kθ.
    law: Option<(KernelFit, f64)>,
    /// Passes of several laws, instead of the one law.
    passes: Vec<LawPass<D>>,
    directed_bonds: u64,
    softening: SoftenedBonds,
    mixed: Option<Mixed<D>>,
    /// Images beyond periodic sides, by their sites, and the edges of the cell along periodic axes, m.
    images: Vec<PeriodicImage<D>>,
    period: [f64; D],
}

impl<const D: usize> LatticeBonds<D> {
    /// Bonds all occupied cells within `ratio` spacings, except pairs that cross a cut.
    ///
    /// # Errors
    /// [`Error::Geometry`] if no cell is occupied, the list of cells does not fit the box, the spacing is not
    /// positive, the horizon is not finite or reaches no neighbour, or memory does not suffice.
    pub fn new(
        lattice: Lattice<D>,
        ratio: f64,
        volume_correction: VolumeCorrection,
        cuts: &[Cut<D>],
    ) -> Result<Self, Error> {
        Self::with_gaps(lattice, ratio, volume_correction, cuts, None)
    }

    /// Builds bonds as [`Self::new`] does, except those that cross a gap.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_gaps(
        lattice: Lattice<D>,
        ratio: f64,
        volume_correction: VolumeCorrection,
        cuts: &[Cut<D>],
        gaps: Option<&Gaps<D>>,
    ) -> Result<Self, Error> {
        Self::with_periodic_sides(lattice, ratio, volume_correction, (cuts, gaps), [false; D])
    }

    /// Builds bonds as [`Self::with_gaps`] does, and across the sides of the box along `periodic` axes: there
    /// bonds of particles near one side reach those near the opposite one. Cuts repeat themselves, too.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_periodic_sides(
        lattice: Lattice<D>,
        ratio: f64,
        volume_correction: VolumeCorrection,
        (cuts, gaps): (&[Cut<D>], Option<&Gaps<D>>),
        periodic: [bool; D],
    ) -> Result<Self, Error> {
        let (listed, cells) = (lattice.occupied.len(), lattice.cells);
        if listed == 0
            || cells.iter().try_fold(1, |product: usize, &n| product.checked_mul(n)) != Some(listed)
        {
            return Err(Error::geometry(format!("a box of {cells:?} cells with {listed} listed")));
        }
        for (name, value) in
            [("spacing, m", lattice.spacing), ("volume, m³", lattice.volume), ("horizon", ratio)]
        {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Error::geometry(format!("{name}: found {value}; allowed: above 0, finite")));
            }
        }
        let layers = periodic.map(|periodic| if periodic { ratio.floor() as usize } else { 0 });
        let period =
            std::array::from_fn(|d| if periodic[d] { lattice.spacing * cells[d] as f64 } else { 0.0 });
        let cells: [f64; D] = std::array::from_fn(|d| cells[d] as f64 + 2.0 * layers[d] as f64);
        let (sites, offsets) = (storage(cells, ratio), (2.0 * ratio.floor() + 1.0).powi(D as i32));
        let bytes = 8.0 * (offsets / 64.0).ceil() * sites + (4 * D) as f64 * offsets;
        refuse_too_large(lattice.spacing, [sites, f64::from(u32::MAX)], bytes)?;
        let mut stencil = Stencil::<D>::new(ratio);
        if stencil.offsets.is_empty() {
            return Err(Error::geometry(format!("a horizon of {ratio} spacings reaches no neighbour")));
        }
        let (lattice, copies) = lattice.widened(layers);
        let order = fullest(lattice.cells, &lattice.occupied, ratio);
        let (strides, guard, sites) = layout(lattice.cells, ratio, order);
        // bond k and bond (n − 1 − k) stay opposite, and a bond is found by its distance in sites
        stencil.offsets.sort_by_key(|&offset| shift(strides, offset));
        let mut bonds = Self {
            stencil,
            spans: Vec::new(),
            ratio,
            volume_correction,
            order,
            strides,
            guard,
            sites,
            particles: Vec::new(),
            intact: Vec::new(),
            classes: vec![TileClass::Empty; sites / TILE],
            factors: None,
            even: true,
            interior_factor: 1.0,
            kernel: None,
            law: None,
            passes: Vec::new(),
            directed_bonds: 0,
            softening: SoftenedBonds::default(),
            mixed: None,
            images: Vec::new(),
            period,
            lattice,
        };
        bonds.spans = bonds.measure();
        bonds.particles = bonds.occupied_sites();
        if bonds.particles.is_empty() {
            return Err(Error::geometry("the body contains no particle".to_owned()));
        }
        bonds.images = bonds.images_in(&copies);
        bonds.connect(&repeated(cuts, period, bonds.horizon()), gaps);
        bonds.classify();
        refuse_one_sided(&bonds)?;
        Ok(bonds)
    }

    /// The lattice.
    pub fn lattice(&self) -> &Lattice<D> {
        &self.lattice
    }

    /// The stencil.
    pub fn stencil(&self) -> &Stencil<D> {
        &self.stencil
    }

    /// Horizon over spacing.
    pub fn ratio(&self) -> f64 {
        self.ratio
    }

    /// The volume correction.
    pub fn volume_correction(&self) -> VolumeCorrection {
        self.volume_correction
    }

    /// Distance in sites of an offset in cells.
    pub fn shift(&self, offset: [i32; D]) -> isize {
        shift(self.strides, offset)
    }

    /// Returns true if bond `k` of the particle in `site` is intact.
    pub fn is_intact(&self, site: usize, k: usize) -> bool {
        self.intact[k / 64][site] >> (k % 64) & 1 == 1
    }

    /// Weight of bond `k` of the particle in `site`: volume correction × surface correction.
    pub fn weight(&self, site: usize, k: usize) -> f64 {
        let Span { shift, bond, length, share, .. } = self.spans[k];
        let Some(factors) = &self.factors else { return share };
        let other = site.wrapping_add_signed(shift);
        share * self.interior_factor * surface_weight(bond, length, factors.get(site), factors.get(other))
    }

    /// Data of [`Self::weight`] and [`Self::is_intact`] for bond `k`.
    pub(crate) fn weights(&self, k: usize) -> Weights<'_, D> {
        let factors = self.factors.as_ref().map(Field::components);
        let share = self.spans[k].share * self.interior_factor;
        Weights { share, factors, words: &self.intact[k / 64], bit: 1 << (k % 64) }
    }

    /// Returns a bond of a site, given the softened bonds of that site.
    fn bond_among(&self, soft: &[Softened], site: usize, index: u32) -> Neighbour<D> {
        let Span { shift, bond, length, share, .. } = self.spans[index as usize];
        let whole = integrity(soft, index) * self.lattice.volume;
        Neighbour {
            index,
            site: site.wrapping_add_signed(shift),
            bond,
            length,
            volume: whole * share,
            weight: whole * self.weight(site, index as usize),
            relief: [0.0; D],
        }
    }

    /// Computes length, direction and share of each bond of the stencil.
    fn measure(&self) -> Vec<Span<D>> {
        let spacing = self.lattice.spacing;
        let span = |(k, &offset): (usize, &[i32; D])| {
            let length = self.stencil.length(k) * spacing;
            let bond = offset.map(|o| f64::from(o) * spacing);
            let share = self.volume_correction.factor(length, self.horizon(), spacing);
            let inverse_square = 1.0 / bond.iter().map(|x| x * x).sum::<f64>();
            Span { shift: self.shift(offset), bond, length, share, inverse_square }
        };
        self.stencil.offsets.iter().enumerate().map(span).collect()
    }

    /// Input of sums over half of the stencil: every bond of the body once.
    pub(super) fn spans<'a>(&'a self, displacement: &'a Field<D>) -> Spans<'a, D> {
        Spans { spans: &self.spans, tiles: self.tiles(displacement) }
    }

    /// Returns the bonds of the stencil with their stiffness 2kθ w V/|ξ|, for a modulus kθ.
    pub(crate) fn stencil_bonds(&self, modulus: f64) -> Vec<StencilBond<D>> {
        let scaled = |span: &Span<D>| {
            let stiffness =
                2.0 * modulus * (self.interior_factor * span.share) * self.lattice.volume / span.length;
            StencilBond { shift: span.shift, bond: span.bond, stiffness }
        };
        self.spans.iter().map(scaled).collect()
    }

    /// Returns true if no bond has its own weight from integrity or surface factors.
    pub(crate) fn is_uniform(&self) -> bool {
        self.factors.is_none() && self.softening.bonds().is_empty()
    }

    /// Input of lattice kernels for a displacement.
    pub(super) fn tiles<'a>(&'a self, displacement: &'a Field<D>) -> Tiles<'a, D> {
        Tiles {
            displacement: displacement.components(),
            intact: &self.intact,
            classes: &self.classes,
            factors: self.factors.as_ref().map(|factors| Factors::new(factors.components(), self.even)),
            guard: self.guard,
        }
    }

    /// [`BondForces::force`] in double precision.
    fn double_force(
        &self,
        displacement: &Field<D>,
        start: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    ) {
        if let Some(kernel) = &self.kernel {
            kernel.run(&self.tiles(displacement), start, force, track);
        } else if let Some((fit, modulus)) = &self.law {
            plain_force(self, fit, *modulus, displacement, start, force, track);
        }
    }
}

fn shift<const D: usize>(strides: [usize; D], offset: [i32; D]) -> isize {
    (0..D).map(|d| strides[d] as isize * offset[d] as isize).sum()
}

impl<const D: usize> BodyGeometry<D> for LatticeBonds<D> {
    fn sites(&self) -> usize {
        self.sites
    }

    fn particles(&self) -> &[u32] {
        &self.particles
    }

    fn position(&self, site: usize) -> [f64; D] {
        let mut rest = site - self.guard;
        let mut position = self.lattice.origin;
        for &d in self.order.iter().rev() {
            position[d] += self.lattice.spacing * (rest / self.strides[d]) as f64;
            rest %= self.strides[d];
        }
        position
    }

    fn volume(&self, _site: usize) -> f64 {
        self.lattice.volume
    }

    fn horizon(&self) -> f64 {
        self.ratio * self.lattice.spacing
    }

    fn spacing(&self) -> f64 {
        self.lattice.spacing
    }

    fn neighbours(&self, site: usize, visit: &mut dyn FnMut(Neighbour<D>)) {
        let soft = self.softening.among(site..site + 1);
        for (word, words) in self.intact.iter().enumerate() {
            let mut present = words[site];
            while present != 0 {
                visit(self.bond_among(soft, site, 64 * word as u32 + present.trailing_zeros()));
                present &= present - 1;
            }
        }
    }

    fn bond(&self, site: usize, index: u32) -> Neighbour<D> {
        self.bond_among(self.softening.among(site..site + 1), site, index)
    }

    fn is_bonded(&self, site: usize, other: usize) -> bool {
        // offsets ascend by their distance in sites
        let shift = other as isize - site as isize;
        self.spans.binary_search_by_key(&shift, |span| span.shift).is_ok_and(|k| self.is_intact(site, k))
    }

    fn bonded(&self, site: usize) -> u32 {
        self.intact.iter().map(|word| word[site].count_ones()).sum()
    }

    fn one_sided(&self) -> Option<[usize; 2]> {
        let opposite = self.stencil.offsets.len() - 1;
        let shifts: Vec<isize> = self.stencil.offsets.iter().map(|&o| self.shift(o)).collect();
        self.particles.par_iter().find_map_first(|&site| {
            let site = site as usize;
            let there = |k: usize| self.origin(site.wrapping_add_signed(shifts[k]));
            let lone = |k: &usize| self.is_intact(site, *k) && !self.is_intact(there(*k), opposite - k);
            let lone = (0..=opposite).find(lone)?;
            Some([site, there(lone)])
        })
    }

    fn images(&self) -> &[PeriodicImage<D>] {
        &self.images
    }

    fn period(&self) -> [f64; D] {
        self.period
    }

    fn whole_family(&self) -> Option<u32> {
        Some(self.stencil.offsets.len() as u32)
    }

    fn has_whole_family(&self, site: usize) -> bool {
        self.is_uniform() && self.bonded(site) as usize == self.stencil.offsets.len()
    }
}

impl<const D: usize> BondForces<D> for LatticeBonds<D> {
    fn set_law(&mut self, fit: &KernelFit, modulus: f64) {
        let stencil = self.stencil_bonds(modulus);
        if let Some(mixed) = &mut self.mixed {
            mixed.set_law(fit, &stencil, self.lattice.spacing);
        }
        self.kernel = lattice_kernel(fit, &stencil);
        self.law = Some((fit.clone(), modulus));
        self.passes = Vec::new();
    }

    fn set_laws(&mut self, fits: &[&KernelFit], modulus: f64, shares: &LawShares) -> bool {
        self.passes = self.passes_of(fits, modulus, shares).unwrap_or_default();
        !self.passes.is_empty()
    }

    fn set_factors(&mut self, mut factors: Field<D>) {
        for image in &self.images {
            factors.set(image.site as usize, factors.get(image.origin as usize));
        }
        // the factor of a particle with the whole stencil, if there is one
        let interior = self
            .particles
            .iter()
            .map(|&s| s as usize)
            .find(|&site| (0..self.stencil.offsets.len()).all(|k| self.is_intact(site, k)));
        self.interior_factor = interior.map_or(1.0, |site| factors.get(site)[0]);
        for site in 0..self.sites {
            let relative = factors.get(site).map(|g| {
                let g = g / self.interior_factor;
                // the same up to rounding of the sums: exactly the interior value
                if g == 0.0 || (g - 1.0).abs() < 1e-12 { 1.0 } else { g }
            });
            factors.set(site, relative);
        }
        self.even = (0..self.sites).all(|site| factors.get(site) == [factors.get(site)[0]; D]);
        if let Some(mixed) = &mut self.mixed {
            mixed.set_factors(&factors);
        }
        self.factors = Some(factors);
        self.passes = Vec::new();
        self.classify();
    }

    fn piece(&self) -> usize {
        TILE
    }

    fn prepare(&mut self, displacement: &Field<D>) {
        if let Some(mixed) = &mut self.mixed {
            mixed.set_displacement(displacement, self.lattice.spacing);
        }
    }

    fn force(
        &self,
        displacement: &Field<D>,
        start: usize,
        force: &mut [&mut [f64]; D],
        mut track: Option<&mut StretchRange>,
    ) {
        if !self.passes.is_empty() {
            self.force_of_laws(displacement, start, force, track);
        } else if !self.mixed_force(start, force, track.as_deref_mut()) {
            self.double_force(displacement, start, force, track);
        }
    }

    fn stretches(&self, displacement: &Field<D>, chunk: usize) -> StretchRange {
        self.spans(displacement).range(chunk_range(chunk, self.sites))
    }

    fn suspects(&self, displacement: &Field<D>, sites: Range<usize>, least: f64) -> Vec<[u32; 2]> {
        self.spans(displacement).beyond(sites, least)
    }

    fn energy_sum(&self, displacement: &Field<D>, table: &EnergyTable) -> Option<f64> {
        self.energy(displacement, |e| table.value(e))
    }

    fn stiffness_sums(
        &self,
        displacement: &Field<D>,
        chunk: usize,
        table: &TangentTable,
        least: f64,
    ) -> Option<Vec<f64>> {
        let (sites, volume) = (chunk_range(chunk, self.sites), self.lattice.volume);
        self.is_uniform().then(|| self.spans(displacement).stiffness(sites, volume, table, least))
    }

    /// Ignores softened bonds.
    fn gradient_sums(&self, displacement: &Field<D>, chunk: usize) -> Option<Vec<GradientSums<D>>> {
        let sites = chunk_range(chunk, self.sites);
        self.softening.bonds().is_empty().then(|| self.spans(displacement).gradient_sums(sites))
    }
}

impl<const D: usize> Bonds<D> for LatticeBonds<D> {
    fn bytes(&self) -> usize {
        let factors = self.factors.as_ref().map_or(0, |_| D * self.sites * 8);
        let mixed = self.mixed.as_ref().map_or(0, Mixed::bytes);
        let passes = self.passes.iter().map(LawPass::bytes).sum::<usize>();
        let bits = self.sites * 8 * self.intact.len();
        bits + self.classes.len() + self.particles.len() * 4 + factors + mixed + passes
    }

    fn kind(&self) -> BondKind<'_, D> {
        BondKind::Lattice(self)
    }
}

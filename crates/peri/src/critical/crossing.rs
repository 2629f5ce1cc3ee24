//! Bonds across a cut through a body, and the energy of a crack that breaks them.

use crate::bonds::{BodyGeometry, surface_weight};
use crate::field::Field;
use crate::parallel;
use serde::Deserialize;

/// Energy that the fracture energy G of a bond law refers to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Convention {
    /// Tearing energy, at which a crack in equilibrium runs, as tests measure it: that of the lattice's bonds
    /// across a unit of crack at λ_c, plus the losses when they snap and at the lattice's barriers.
    #[default]
    Tearing,
    /// Continuum energy of the bonds across a unit of crack at λ_c, G₀ of Silling & Askari, Comput. Struct.
    /// 83 (2005) 1526: for comparison with published values of G₀ and s₀ and with other programs.
    Bonds,
    /// Tearing energy of bonds that soften to zero load before they break: there are no other losses, and a
    /// crack runs at the energy of the lattice's bonds across it at every horizon ratio.
    Softening,
}

impl Convention {
    /// Name in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tearing => "tearing",
            Self::Bonds => "bonds",
            Self::Softening => "softening",
        }
    }
}

/// s of κ = 1 + sD/N in the plane and in space, from strips in pure shear at N = 12 to 196 and 32 to 256
/// (formulation-tearing.md, 1, 2).
const SNAP: [f64; 2] = [6.2, 8.0];
/// Greatest length of short bonds, in spacings: along edges and diagonals of a lattice's cells.
pub(super) const SHORT: f64 = 1.8;
/// Distance of the bonds' centroid from a particle, over the horizon, above which the particle is at a
/// surface: 0.33 in the outermost layer of a plane body, 0.24 to 0.28 in space, 0 inside; jitter of 0.3
/// spacings moves it by 0.07.
const SURFACE_OFFSET: f64 = 0.2;

/// Bonds of a particle inside a body, across planes through it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Σ_J w V_J |ξ_e||ξ|, m⁵, with the axis e of the largest sum: kθΦ times it is the energy of the bonds
    /// across a unit area.
    pub reach: f64,
    /// Σ_J w V_J |ξ_e|/|ξ| over bonds up to `SHORT` spacings, m³, along the same axis: short bonds across a
    /// unit area, see [`super::CrackArea`].
    pub short: f64,
    /// Number N of the particle's bonds.
    pub bonds: f64,
    /// κ = 1 + sD/N: energy at which a crack runs over that of the bonds across it.
    pub loss: f64,
    /// True for a particle with a whole family; else the largest family of the body is used.
    pub whole: bool,
}

/// Sums of one family.
#[derive(Clone, Copy)]
struct FamilySums<const D: usize> {
    /// Σ w V |ξ_d||ξ|.
    reach: [f64; D],
    /// Σ w V |ξ_d|/|ξ| over short bonds.
    short: [f64; D],
    bonds: f64,
}

impl<const D: usize> FamilySums<D> {
    /// Sums over the family of the particle in a site; its neighbours are assumed to have its surface
    /// factors.
    fn new(bonds: &dyn BodyGeometry<D>, surface: Option<&Field<D>>, site: usize) -> Self {
        let mut sums = Self { reach: [0.0; D], short: [0.0; D], bonds: 0.0 };
        let short = SHORT * bonds.spacing();
        let factors = surface.map(|field| field.get(site));
        bonds.neighbours(site, &mut |bond| {
            let factor = factors.map_or(1.0, |own| surface_weight(bond.bond, bond.length, own, own));
            for d in 0..D {
                let across = bond.volume * bond.bond[d].abs();
                sums.reach[d] += factor * across * bond.length;
                sums.short[d] += if bond.length <= short { across / bond.length } else { 0.0 };
            }
            sums.bonds += 1.0;
        });
        sums
    }
}

impl Crossing {
    /// Evaluates one particle with a whole family on a lattice, or the mean over such particles in a cloud,
    /// before the bonds have factors of their own; `surface` are those of the surface correction.
    pub fn new<const D: usize>(bonds: &dyn BodyGeometry<D>, surface: Option<&Field<D>>) -> Self {
        let inner = match bonds.whole_family() {
            Some(all) => {
                let whole = |&site: &u32| bonds.bonded(site as usize) == all;
                bonds.particles().iter().copied().find(whole).into_iter().collect()
            }
            None => inside(bonds),
        };
        let whole = !inner.is_empty();
        let of = |sites: &[u32]| -> Vec<FamilySums<D>> {
            parallel::map_each(sites, |&site| FamilySums::new(bonds, surface, site as usize))
        };
        let each = if whole {
            of(&inner)
        } else {
            let largest = bonds
                .particles()
                .iter()
                .copied()
                .reduce(|a, b| if bonds.bonded(b as usize) > bonds.bonded(a as usize) { b } else { a });
            of(largest.as_slice())
        };
        let mean = |get: &dyn Fn(&FamilySums<D>) -> f64| {
            each.iter().map(get).sum::<f64>() / each.len().max(1) as f64
        };
        let reaches: Vec<f64> = (0..D).map(|d| mean(&|sums| sums.reach[d])).collect();
        let axis = (0..D).fold(0, |most, d| if reaches[d] > reaches[most] { d } else { most });
        let count = mean(&|sums| sums.bonds);
        Self {
            reach: reaches[axis],
            short: mean(&|sums| sums.short[axis]),
            bonds: count,
            loss: 1.0 + SNAP[usize::from(D == 3)] * D as f64 / count,
            whole,
        }
    }
}

/// Particles of a cloud with whole families: neither they nor their neighbours are at a surface.
fn inside<const D: usize>(bonds: &dyn BodyGeometry<D>) -> Vec<u32> {
    let off = |&site: &u32| {
        let (mut sum, mut first) = (0.0, [0.0; D]);
        bonds.neighbours(site as usize, &mut |bond| {
            sum += bond.volume;
            (0..D).for_each(|d| first[d] += bond.volume * bond.bond[d]);
        });
        first.iter().map(|x| x * x).sum::<f64>().sqrt() > SURFACE_OFFSET * bonds.horizon() * sum || sum == 0.0
    };
    let mut at_surface = vec![false; bonds.sites()];
    let flags: Vec<bool> = parallel::map_each(bonds.particles(), off);
    bonds.particles().iter().zip(flags).for_each(|(&site, flag)| at_surface[site as usize] = flag);
    let whole = |&&site: &&u32| {
        let mut clear = !at_surface[site as usize];
        bonds.neighbours(site as usize, &mut |bond| clear &= !at_surface[bond.site]);
        clear
    };
    bonds.particles().iter().filter(whole).copied().collect()
}

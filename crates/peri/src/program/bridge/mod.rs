//! Exchange with LAMMPS. On a lattice a bond law has few reference lengths and forces that depend on the
//! current length only, so that one `bond_style table` per length represents the model exactly.

mod compare;
mod files;
mod import;
mod refuse;
#[cfg(test)]
mod tests;

pub use compare::{BOUND, Comparison, compare};
pub use import::import;

use crate::bonds::Bonds;
use crate::calibrate::Space;
use crate::potential::BondPotential;
use crate::program::observe::{self, Physics, SceneMaterial};
use crate::program::run::PeriFailure;
use crate::program::scene::{self, Scene, SceneVariant};
use crate::solver::{Criterion, Loads};
use harness::scene::Source;
use std::path::Path;

/// Writes a variant of a scene for LAMMPS into `output`: body, tables, input, driver, self-check state,
/// README. `variant` may be `None` for a scene with one variant.
///
/// # Errors
/// A [`harness::scene::SceneError`] for a scene that tables cannot represent; files that cannot be written.
pub fn export(source: &Source, variant: Option<&str>, output: &Path) -> Result<Summary, PeriFailure> {
    let scene: Scene = source.parse()?;
    let variants = observe::check(source, &scene, false)?;
    let names: Vec<String> = variants.iter().map(SceneVariant::name).collect();
    let index = match variant {
        None if variants.len() == 1 => 0,
        None => {
            let found = format!("{} variants", variants.len());
            let allowed = format!("one of them by `--variant`: `{}`", names.join("`, `"));
            return Err(source.error("study", found, allowed).into());
        }
        Some(name) => match names.iter().position(|own| own == name) {
            Some(index) => index,
            None => {
                let found = format!("no variant `{name}`");
                return Err(source.error("study", found, format!("`{}`", names.join("`, `"))).into());
            }
        },
    };
    let variant = &variants[index];
    // names of values contain that of the variant only if there are several
    let texts = [&*source.text, if names.len() > 1 { &*names[index] } else { "" }];
    let (source, scene) = variant.resolved();
    scene::check_variant(source, scene)?;
    refuse::refuse(source, scene, variant)?;
    match scene.body.space {
        Space::Solid => write::<3>(source, scene, variant, texts, output),
        _ => write::<2>(source, scene, variant, texts, output),
    }
}

/// Numbers of exported objects.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Summary {
    /// Particles.
    pub particles: usize,
    /// Bonds, each once.
    pub bonds: usize,
    /// Tables.
    pub types: usize,
}

/// Largest number of clamps: LAMMPS has 32 groups, of which the driver uses four.
const MOST_CLAMPS: usize = 28;

fn write<const D: usize>(
    source: &Source,
    scene: &Scene,
    variant: &SceneVariant,
    texts: [&str; 2],
    output: &Path,
) -> Result<Summary, PeriFailure> {
    let (body, physics) = Physics::<D>::new(source, scene, variant)?;
    let SceneMaterial::Bonds(material) = &physics.body.material else {
        // `refuse` leaves no other material
        return Err(source.error("material", "another material", "a bond law").into());
    };
    let critical = match &physics.body.criterion {
        Some(Criterion::Stretch(stretch)) => Some(stretch.least()),
        _ => None,
    };
    let model = LammpsModel::new(&*body.bonds, material.law(), material.modulus(), critical, &physics.loads);
    if model.clamps.len() > MOST_CLAMPS {
        let found = format!("{} kinds of clamps, overlaps counted", model.clamps.len());
        return Err(source
            .error("boundary", found, format!("at most {MOST_CLAMPS}: the groups of LAMMPS"))
            .into());
    }
    if model.reach == 0.0 {
        let allowed = "clamps that move against each other: the load is the force that does work on them";
        return Err(source.error("boundary", "no displacement", allowed).into());
    }
    files::write(&model, scene, &physics.loads, texts, output)?;
    Ok(Summary { particles: model.labels.len(), bonds: model.bonds.len(), types: model.types.len() })
}

/// Bonds of one reference length.
pub(crate) struct BondType {
    /// Reference length, m.
    length: f64,
    /// 2 kθ w_J V_I, N: force of a bond over t/kθ.
    scale: f64,
}

/// Particles with equal supports in the same regions.
pub(crate) struct Clamp<const D: usize> {
    /// Bit d: component d is prescribed.
    mask: u8,
    /// Displacement at load factor 1, m.
    displacement: [f64; D],
    regions: Vec<usize>,
}

/// Body for LAMMPS.
pub(crate) struct LammpsModel<'a, const D: usize> {
    law: &'a dyn BondPotential,
    critical: Option<f64>,
    positions: Vec<[f64; D]>,
    /// Number of the clamp of each particle from 1 on, or 0.
    labels: Vec<usize>,
    clamps: Vec<Clamp<D>>,
    types: Vec<BondType>,
    /// Type and both ends of each bond, from 0.
    bonds: Vec<(usize, usize, usize)>,
    horizon: f64,
    spacing: f64,
    /// Relative displacement of the clamps at load factor 1, m.
    reach: f64,
    /// Largest prescribed displacement at any factor 0 to 1, m.
    farthest: f64,
    predictor: [[f64; 4]; D],
}

impl<'a, const D: usize> LammpsModel<'a, D> {
    pub(crate) fn new(
        bonds: &dyn Bonds<D>,
        law: &'a dyn BondPotential,
        modulus: f64,
        critical: Option<f64>,
        loads: &Loads<D>,
    ) -> Self {
        let particles = bonds.particles();
        let mut number = vec![usize::MAX; bonds.sites()];
        for (index, &site) in particles.iter().enumerate() {
            number[site as usize] = index;
        }
        let (mut types, mut of_square): (Vec<BondType>, Vec<(i64, usize)>) = Default::default();
        let mut list = Vec::with_capacity(bonds.directed_bonds() as usize / 2);
        for &site in particles {
            let (own, volume) = (number[site as usize], bonds.volume(site as usize));
            bonds.neighbours(site as usize, &mut |bond| {
                let other = number[bond.site];
                if own < other {
                    // squares of lengths on a lattice are integers, in spacings
                    let square = (bond.length / bonds.spacing()).powi(2).round() as i64;
                    let known = of_square.iter().find(|known| known.0 == square).map(|known| known.1);
                    let kind = known.unwrap_or_else(|| {
                        types.push(BondType {
                            length: (square as f64).sqrt() * bonds.spacing(),
                            scale: 2.0 * modulus * bond.weight * volume,
                        });
                        of_square.push((square, types.len() - 1));
                        types.len() - 1
                    });
                    list.push((kind, own, other));
                }
            });
        }
        let mut member = vec![Vec::new(); bonds.sites()];
        for (region, sites) in loads.held_regions.iter().enumerate() {
            sites.iter().for_each(|&site| member[site as usize].push(region));
        }
        let mut clamps: Vec<Clamp<D>> = Vec::new();
        let label = |&site: &u32| {
            let site = site as usize;
            let (mask, regions) = (loads.constrained(site), &member[site]);
            if mask == 0 {
                return 0;
            }
            let displacement = loads.displacement.as_ref().map_or([0.0; D], |field| field.get(site));
            let same =
                |c: &Clamp<D>| c.mask == mask && c.regions == *regions && c.displacement == displacement;
            clamps.iter().position(same).unwrap_or_else(|| {
                clamps.push(Clamp { mask, displacement, regions: regions.clone() });
                clamps.len() - 1
            }) + 1
        };
        let labels = particles.iter().map(label).collect();
        let farthest =
            clamps.iter().flat_map(|clamp| clamp.displacement).fold(0.0, |most: f64, u| most.max(u.abs()));
        Self {
            law,
            critical,
            positions: particles.iter().map(|&site| bonds.position(site as usize)).collect(),
            labels,
            clamps,
            types,
            bonds: list,
            horizon: bonds.horizon(),
            spacing: bonds.spacing(),
            reach: loads.reach(bonds, &[]),
            farthest,
            predictor: loads.affine_predictor(bonds, modulus * law.tangent()),
        }
    }

    /// Computes forces, N, by a plain loop over the law.
    pub(crate) fn forces(&self, positions: &[[f64; D]]) -> Vec<[f64; D]> {
        let mut forces = vec![[0.0; D]; positions.len()];
        for &(kind, a, b) in &self.bonds {
            let BondType { length, scale } = self.types[kind];
            let bond: [f64; D] = std::array::from_fn(|d| positions[b][d] - positions[a][d]);
            let now = bond.iter().map(|x| x * x).sum::<f64>().sqrt();
            let pull = scale * self.law.tension(now / length) / now;
            for d in 0..D {
                forces[a][d] += pull * bond[d];
                forces[b][d] -= pull * bond[d];
            }
        }
        forces
    }

    /// Returns the self-check state: pseudo-random displacements below a tenth of the spacing that break no
    /// bond.
    pub(crate) fn check_state(&self) -> Vec<[f64; D]> {
        let room = self.critical.map_or(1.0, |critical| critical - 1.0);
        let amplitude = self.spacing * (0.2 * room).min(0.1);
        let mut seed = 0x9e37_79b9_7f4a_7c15_u64;
        let mut random = || {
            // splitmix64, Steele, Lea & Flood, OOPSLA 2014
            seed = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = seed;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            2.0 * ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64 - 1.0
        };
        self.positions.iter().map(|x| x.map(|x| x + amplitude * random())).collect()
    }
}

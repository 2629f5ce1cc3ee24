//! Areas of the faces of a body, shared out among the particles below them.
//!
//! h_I of a particle below two opposite faces is that of both sides together: the nearer face takes it. Where
//! these regions overlap, in thin walls, both sides gain the same area G_I at each particle, which leaves
//! uniform stresses balanced where their normals are opposite, such that the first moment of a side lies on
//! its face, Σ_I (ψ_f h_I·N_f + ψ_f G_I) d_I = 0 with the depths d_I, G_I being the mean of both sides'
//! values. A bar has such areas along each axis across which it is thin.

use crate::bonds::{BodyGeometry, CellGrid};
use crate::field::Field;
use crate::parallel;
use crate::surface::BodySurface;

/// Half-width of the hat functions, and depth of the particles below a face, in spacings and horizons.
const HAT: f64 = 1.0;
pub(crate) const DEPTH: f64 = 2.16;
/// Faces with less than this fraction of a particle's area join a neighbour within this distance in spacings.
pub(super) const SMALL: f64 = 0.5;
const JOINED: f64 = 2.1;
/// Particles of a work item.
const BATCH: usize = 1024;

/// A particle below a face.
#[derive(Clone, Copy)]
pub(super) struct FaceParticle {
    pub face: u32,
    pub site: u32,
    /// ψ_f(I), and the depth, m.
    pub hat: f64,
    pub depth: f64,
    /// Nearer to this face than to an opposite one.
    own: bool,
    /// Below an opposite face as well.
    thin: bool,
}

/// Particles below all faces, by face, with their areas.
pub(super) struct FaceAreas {
    pub below: Vec<FaceParticle>,
    /// ψ_f h_I·N_f + ψ_f G_I, m².
    pub shares: Vec<f64>,
    /// Side area of a particle, m².
    pub typical: f64,
}

impl FaceAreas {
    /// Shares out the areas; small faces join larger ones. `load` is h_I/V_I
    /// ([`crate::material::surface_load`] of the stress 1).
    pub fn new<const D: usize>(
        bonds: &dyn BodyGeometry<D>,
        surface: &BodySurface<D>,
        load: &Field<D>,
    ) -> Self {
        let typical = typical_area(bonds);
        let mut below = below(bonds, surface);
        let own = |below: &FaceParticle| {
            if !below.own {
                return 0.0;
            }
            let (site, normal) = (below.site as usize, surface.faces()[below.face as usize].normal);
            let load = load.get(site);
            below.hat * bonds.volume(site) * (0..D).map(|d| load[d] * normal[d]).sum::<f64>()
        };
        let count = surface.faces().len();
        let areas = sum(count, &below, own);
        join_small(surface, &areas, &mut below, typical, bonds.spacing());
        below.sort_by_key(|below| (below.face, below.site));
        let common = common_areas(surface, &below, own);
        let shares = below.iter().zip(common).map(|(below, common)| own(below) + common).collect();
        Self { below, shares, typical }
    }
}

/// Depth below a side from which a face parallel to it is no part of the side, in spacings.
#[cfg(feature = "case")]
const STEP: f64 = 0.5;

/// Areas of a side, m²: of the particles whose area vector is not that of the side alone, ascending; and of
/// the whole side where slots and steps lie below it.
#[cfg(feature = "case")]
pub struct SideAreas {
    pub shared: Vec<(u32, f64)>,
    pub whole: Option<f64>,
}

/// Computes the areas of the side that points along an axis (`sign` 1) or against it (−1). In walls that are
/// thin along it particles have the share of the faces above them, slanted and curved ones by their
/// projection. The floors of slots and steps, flat faces below the outermost flat one, are no part of a side,
/// unless faces are those of cells (`smooth` false): these are steps everywhere. `load` as in
/// [`FaceAreas::new`].
#[cfg(feature = "case")]
pub fn side_areas<const D: usize>(
    bonds: &dyn BodyGeometry<D>,
    surface: &BodySurface<D>,
    load: &Field<D>,
    (axis, sign): (usize, f64),
    smooth: bool,
) -> SideAreas {
    let FaceAreas { below, shares, typical } = FaceAreas::new(bonds, surface, load);
    let along = |face: u32| sign * surface.faces()[face as usize].normal[axis];
    let height = |face: u32| sign * surface.faces()[face as usize].place[axis];
    let upwards = || (0..surface.faces().len() as u32).filter(|&face| along(face) > 0.5);
    let flat = || upwards().filter(|&face| along(face) > 0.999);
    let top = flat().map(height).fold(f64::NEG_INFINITY, f64::max);
    let is_floor = |face: u32| smooth && along(face) > 0.999 && height(face) < top - STEP * bonds.spacing();
    let mut entries: Vec<(&FaceParticle, f64)> = below.iter().zip(shares).collect();
    entries.sort_by_key(|(below, _)| below.site);
    let mut shared = Vec::new();
    for same in entries.chunk_by(|a, b| a.0.site == b.0.site) {
        let above = same.iter().filter(|(below, _)| along(below.face) > 0.5);
        let nearest = above.min_by(|a, b| a.0.depth.total_cmp(&b.0.depth));
        if nearest.is_some_and(|(below, _)| is_floor(below.face)) {
            shared.push((same[0].0.site, 0.0));
        } else if same.iter().any(|(below, _)| below.thin && along(below.face).abs() > 0.5) {
            let own = same.iter().filter(|(below, _)| !is_floor(below.face));
            let area = own.map(|(below, share)| share * along(below.face).max(0.0)).sum();
            shared.push((same[0].0.site, area));
        }
    }
    // one flat face above each column of the lattice
    let count = flat().filter(|&face| !is_floor(face)).count();
    let has_floors = flat().any(is_floor) && upwards().count() == flat().count();
    SideAreas { shared, whole: has_floors.then_some(count as f64 * typical) }
}

/// Computes the side area of a particle, m²: its volume over the spacing.
fn typical_area<const D: usize>(bonds: &dyn BodyGeometry<D>) -> f64 {
    let volumes: f64 = bonds.particles().iter().map(|&site| bonds.volume(site as usize)).sum();
    volumes / bonds.particles().len().max(1) as f64 / bonds.spacing()
}

/// Sums a value of particles by face.
fn sum(faces: usize, below: &[FaceParticle], value: impl Fn(&FaceParticle) -> f64) -> Vec<f64> {
    let mut sums = vec![0.0; faces];
    below.iter().for_each(|below| sums[below.face as usize] += value(below));
    sums
}

/// Computes ψ_f G_I of each entry, m²: G_I for the faces of a wall, which are parallel.
fn common_areas<const D: usize>(
    surface: &BodySurface<D>,
    below: &[FaceParticle],
    own: impl Fn(&FaceParticle) -> f64,
) -> Vec<f64> {
    let (faces, mut common) = (surface.faces(), vec![0.0; below.len()]);
    let moments = sum(faces.len(), below, |below| own(below) * below.depth);
    let depths = sum(faces.len(), below, |below| if below.thin { below.hat * below.depth } else { 0.0 });
    let mut thin: Vec<usize> = (0..below.len()).filter(|&entry| below[entry].thin).collect();
    thin.sort_by_key(|&entry| below[entry].site);
    for same in thin.chunk_by(|&a, &b| below[a].site == below[b].site) {
        for &entry in same {
            let normal = faces[below[entry].face as usize].normal;
            let is_parallel = |&&other: &&usize| {
                let there = faces[below[other].face as usize].normal;
                (0..D).map(|d| normal[d] * there[d]).sum::<f64>().abs() > 0.5
            };
            let (mut area, mut hats) = (0.0, 0.0);
            for &other in same.iter().filter(is_parallel) {
                let FaceParticle { face, hat, .. } = below[other];
                area -= hat * moments[face as usize] / depths[face as usize];
                hats += hat;
            }
            common[entry] = below[entry].hat * area / hats;
        }
    }
    common
}

/// Lists all particles below faces, by particle; hats sum to 1 over the faces of a patch.
fn below<const D: usize>(bonds: &dyn BodyGeometry<D>, surface: &BodySurface<D>) -> Vec<FaceParticle> {
    let (faces, spacing) = (surface.faces(), bonds.spacing());
    if faces.is_empty() {
        return Vec::new();
    }
    let (depth, width) = (DEPTH * bonds.horizon(), HAT * spacing);
    let places: Vec<[f64; D]> = faces.iter().map(|face| face.place).collect();
    let grid = CellGrid::new(&places, depth);
    let of = |site: u32, all: &mut Vec<FaceParticle>| {
        let here = bonds.position(site as usize);
        let mut near: Vec<FaceParticle> = Vec::new();
        grid.near(here, depth.hypot(width), |number| {
            let (aside, down) = surface.reach(&faces[number], here);
            if aside < width && down > 0.0 && down < depth {
                let hat = 1.0 - aside / width;
                near.push(FaceParticle {
                    face: number as u32,
                    site,
                    hat,
                    depth: down,
                    own: true,
                    thin: false,
                });
            }
        });
        near.sort_unstable_by_key(|below| (faces[below.face as usize].patch, below.face));
        for patch in near.chunk_by(|a, b| faces[a.face as usize].patch == faces[b.face as usize].patch) {
            // the nearest step of a staircase
            let nearest = patch.iter().map(|below| below.depth).fold(f64::INFINITY, f64::min);
            let kept = |below: &&FaceParticle| below.depth < nearest + 0.75 * spacing;
            let sum: f64 = patch.iter().filter(kept).map(|below| below.hat).sum();
            for below in patch.iter().filter(kept).filter(|below| !surface.is_bound(below.face as usize)) {
                let normal = faces[below.face as usize].normal;
                let opposite = |other: &&FaceParticle| {
                    let there = faces[other.face as usize].normal;
                    (0..D).map(|d| normal[d] * there[d]).sum::<f64>() < -0.5
                };
                let own =
                    near.iter().filter(opposite).all(|other| other.depth >= below.depth + 1e-6 * spacing);
                let across = near.iter().find(opposite);
                let thin = across.is_some_and(|other| !surface.is_bound(other.face as usize));
                if own || thin {
                    all.push(FaceParticle { hat: below.hat / sum, own, thin, ..*below });
                }
            }
        }
    };
    let batch = |sites: &[u32]| {
        let mut all = Vec::new();
        sites.iter().for_each(|&site| of(site, &mut all));
        all
    };
    let parts: Vec<Vec<FaceParticle>> = parallel::map_chunks(bonds.particles(), BATCH, batch);
    parts.concat()
}

/// Moves the particles of small faces to the nearest larger face of the same patch.
fn join_small<const D: usize>(
    surface: &BodySurface<D>,
    areas: &[f64],
    below: &mut [FaceParticle],
    area: f64,
    spacing: f64,
) {
    let faces = surface.faces();
    let is_small = |&face: &usize| !surface.is_bound(face) && areas[face] < SMALL * area;
    let small: Vec<usize> = (0..faces.len()).filter(is_small).collect();
    if small.is_empty() {
        return;
    }
    let places: Vec<[f64; D]> = faces.iter().map(|face| face.place).collect();
    let grid = CellGrid::new(&places, JOINED * spacing);
    let mut target: Vec<u32> = (0..faces.len() as u32).collect();
    for face in small {
        let mut best: Option<(f64, usize)> = None;
        grid.near(places[face], JOINED * spacing, |other| {
            let distance: f64 = (0..D).map(|d| (places[other][d] - places[face][d]).powi(2)).sum();
            let fits = faces[other].patch == faces[face].patch && areas[other] >= SMALL * area;
            let nearer = best.is_none_or(|(least, at)| (distance, other) < (least, at));
            if fits && distance < (JOINED * spacing).powi(2) && nearer {
                best = Some((distance, other));
            }
        });
        if let Some((_, other)) = best {
            target[face] = other as u32;
        }
    }
    below.iter_mut().for_each(|below| below.face = target[below.face as usize]);
}

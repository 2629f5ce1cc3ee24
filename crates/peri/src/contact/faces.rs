//! Faces of a body: points of its true surface that distribute a force over the particles below them.
//!
//! A face f at X_f with the outward normal N_f has the area A_f = Σ_I ψ_f(I) h_I·N_f and the weights
//! w_fI = ψ_f(I) h_I·N_f/A_f, with the area vectors h_I of [`crate::material::surface_load`] and hat
//! functions ψ_f of the distance along the surface, Σ_f ψ_f = 1. A uniform pressure on all faces then
//! balances a uniform stress.
//!
//! A face touches a plane as a sphere of the radius r_f about Σ_I w_fI x_I, with r_f = N_f·(X_f − Σ_I w_fI
//! X_I); on a flat face of a lattice r_f = 0. On a staircase, where Σ_I w_fI X_I lies beside X_f as well, the
//! weights gain a term, linear across N_f, that shifts it below X_f. No position depends on a rotation, so
//! forces have an energy and conserve momentum and angular momentum.

use crate::bonds::{BodyGeometry, Bonds, CellGrid};
use crate::field::Field;
use crate::material::{BodyTensor, surface_load};
use crate::parallel;
use crate::surface::{BodySurface, SurfaceFace};
use nalgebra::{SMatrix, SVector};

/// Half-width of the hat functions, and depth of the particles below a face, in spacings and horizons.
const HAT: f64 = 1.0;
const DEPTH: f64 = 2.16;
/// Faces with less than this fraction of a particle's area join a neighbour within this distance in spacings.
const SMALL: f64 = 0.5;
const JOINED: f64 = 2.1;
/// Least variance of the particles along a direction, in squared spacings, for which weights gain a linear
/// term.
const FLAT: f64 = 1e-3;
/// Particles of a work item.
const BATCH: usize = 1024;

/// Faces with their weights, face by face and particle by particle.
pub struct Faces<const D: usize> {
    /// X_f, m.
    pub places: Vec<[f64; D]>,
    /// Numbers of the faces among those of the surface.
    pub sources: Vec<u32>,
    /// N_f.
    pub normals: Vec<[f64; D]>,
    /// r_f, m.
    pub radii: Vec<f64>,
    /// A_f, m².
    pub areas: Vec<f64>,
    /// Sites and weights of face f: entries `starts[f]..starts[f + 1]`.
    starts: Vec<u32>,
    sites: Vec<u32>,
    weights: Vec<f64>,
    /// Sites with faces, ascending; ends of their entries; entries of face and weight.
    pub particles: Vec<u32>,
    ends: Vec<u32>,
    shares: Vec<(u32, f64)>,
}

/// A particle below a face.
#[derive(Clone, Copy)]
struct FaceParticle {
    face: u32,
    site: u32,
    /// ψ_f(I), and the depth, m.
    hat: f64,
    depth: f64,
}

impl<const D: usize> Faces<D> {
    /// Builds the faces of a body; none if the surface has none. Skips faces whose area belongs to bonds of a
    /// crack or of another side.
    ///
    /// `tied` faces have r_f = 0: the weights gain a term along the normal as well, so that faces rotate with
    /// the body.
    pub fn new(bonds: &dyn Bonds<D>, surface: &BodySurface<D>, tied: bool) -> Self {
        let area = typical_area(bonds);
        let load = surface_load(bonds, BodyTensor::<D>::identity());
        let mut below = below(bonds, surface);
        let share = |below: &FaceParticle| {
            let (site, normal) = (below.site as usize, surface.faces()[below.face as usize].normal);
            let load = load.get(site);
            below.hat * bonds.volume(site) * (0..D).map(|d| load[d] * normal[d]).sum::<f64>()
        };
        let sum = |below: &[FaceParticle]| {
            let mut areas = vec![0.0; surface.faces().len()];
            below.iter().for_each(|below| areas[below.face as usize] += share(below));
            areas
        };
        let areas = sum(&below);
        join_small(surface, &areas, &mut below, area, bonds.spacing());
        below.sort_by_key(|below| (below.face, below.site));
        let areas = sum(&below);
        let mut faces = Self {
            places: Vec::new(),
            sources: Vec::new(),
            normals: Vec::new(),
            radii: Vec::new(),
            areas: Vec::new(),
            starts: vec![0],
            sites: Vec::new(),
            weights: Vec::new(),
            particles: Vec::new(),
            ends: Vec::new(),
            shares: Vec::new(),
        };
        for group in below.chunk_by(|a, b| a.face == b.face) {
            let face = group[0].face as usize;
            // area lost to bonds of a crack or of the other side
            if areas[face] < SMALL * area {
                continue;
            }
            let place = surface.faces()[face].place;
            let mut weights: Vec<f64> = group.iter().map(|below| share(below) / areas[face]).collect();
            faces.radii.push(centre(bonds, &surface.faces()[face], group, &mut weights, tied));
            faces.sources.push(face as u32);
            faces.places.push(place);
            faces.normals.push(surface.faces()[face].normal);
            faces.areas.push(areas[face]);
            for (below, weight) in group.iter().zip(weights) {
                faces.sites.push(below.site);
                faces.weights.push(weight);
            }
            faces.starts.push(faces.sites.len() as u32);
        }
        faces.transpose();
        faces
    }

    /// Number of faces.
    pub fn len(&self) -> usize {
        self.areas.len()
    }

    /// Iterates over the sites below a face with their weights.
    pub fn below(&self, face: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.starts[face] as usize..self.starts[face + 1] as usize;
        self.sites[range.clone()].iter().map(|&site| site as usize).zip(self.weights[range].iter().copied())
    }

    /// Adds entries to every face for its ties.
    pub fn tie(&mut self, others: impl Fn(usize) -> Vec<(u32, f64)>) {
        let (mut starts, mut sites, mut weights) = (vec![0], Vec::new(), Vec::new());
        for face in 0..self.len() {
            let own = self.below(face).map(|(site, weight)| (site as u32, weight));
            let all: Vec<(u32, f64)> = own.chain(others(face)).collect();
            sites.extend(all.iter().map(|entry| entry.0));
            weights.extend(all.iter().map(|entry| entry.1));
            starts.push(sites.len() as u32);
        }
        (self.starts, self.sites, self.weights) = (starts, sites, weights);
        (self.particles, self.ends, self.shares) = (Vec::new(), Vec::new(), Vec::new());
        self.transpose();
    }

    /// Adds forces on faces, N, to force densities, N/m³, of the sites from `start` on.
    pub fn spread(&self, pushes: &[[f64; D]], volumes: &[f64], start: usize, force: &mut [&mut [f64]; D]) {
        let at = |end: usize| self.particles.partition_point(|&site| (site as usize) < end);
        for particle in at(start)..at(start + force[0].len()) {
            let site = self.particles[particle] as usize;
            let sum = self.sum(particle, pushes);
            if sum != [0.0; D] {
                (0..D).for_each(|d| force[d][site - start] += sum[d] / volumes[site]);
            }
        }
    }

    /// Sums forces on faces, N, to the force on a particle, by its number in [`Self::particles`].
    pub fn sum(&self, particle: usize, pushes: &[[f64; D]]) -> [f64; D] {
        let mut sum = [0.0; D];
        for &(face, weight) in self.above(particle) {
            (0..D).for_each(|d| sum[d] += weight * pushes[face as usize][d]);
        }
        sum
    }

    /// Returns the faces above a particle with their weights, by its number in [`Self::particles`].
    pub fn above(&self, particle: usize) -> &[(u32, f64)] {
        let start = particle.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.shares[start as usize..self.ends[particle] as usize]
    }

    /// Computes Σ_I w_fI u_I of a face.
    pub fn mean(&self, face: usize, field: &Field<D>) -> [f64; D] {
        let mut sum = [0.0; D];
        for (site, weight) in self.below(face) {
            let value = field.get(site);
            (0..D).for_each(|d| sum[d] += weight * value[d]);
        }
        sum
    }

    /// Returns the particle with the greatest weight in a face.
    pub fn head(&self, face: usize) -> usize {
        let greatest = self.below(face).max_by(|a, b| a.1.total_cmp(&b.1));
        greatest.map_or(0, |(site, _)| site)
    }

    /// Computes max_f Σ_g √(A_f A_g)|Σ_I w_fI w_gI/V_I|, m⁻¹. Times the stiffness of a plane over its area,
    /// Pa/m, it bounds the greatest eigenvalue that faces in contact add to the stiffness over volumes, N/m⁴
    /// (Gershgorin over faces).
    pub fn greatest(&self, bonds: &dyn BodyGeometry<D>) -> f64 {
        let row = |face: usize| {
            let mut products: Vec<(u32, f64)> = Vec::new();
            for (site, weight) in self.below(face) {
                let Ok(particle) = self.particles.binary_search(&(site as u32)) else { continue };
                let volume = bonds.volume(site);
                products.extend(self.above(particle).iter().map(|&(g, other)| (g, weight * other / volume)));
            }
            products.sort_by_key(|product| product.0);
            let sums = products.chunk_by(|a, b| a.0 == b.0);
            let terms = sums.map(|same| {
                let area = (self.areas[face] * self.areas[same[0].0 as usize]).sqrt();
                area * same.iter().map(|product| product.1).sum::<f64>().abs()
            });
            terms.sum::<f64>()
        };
        parallel::map(self.len(), row).into_iter().fold(0.0, f64::max)
    }

    fn transpose(&mut self) {
        let mut entries: Vec<(u32, u32, f64)> = Vec::with_capacity(self.sites.len());
        for face in 0..self.len() {
            entries.extend(self.below(face).map(|(site, weight)| (site as u32, face as u32, weight)));
        }
        entries.sort_unstable_by_key(|&(site, face, _)| (site, face));
        for (site, face, weight) in entries {
            if self.particles.last() != Some(&site) {
                self.particles.push(site);
                self.ends.push(self.shares.len() as u32);
            }
            self.shares.push((face, weight));
            if let Some(end) = self.ends.last_mut() {
                *end = self.shares.len() as u32;
            }
        }
    }
}

/// Computes the side area of a particle, m²: its volume over the spacing.
pub fn typical_area<const D: usize>(bonds: &dyn BodyGeometry<D>) -> f64 {
    let volumes: f64 = bonds.particles().iter().map(|&site| bonds.volume(site as usize)).sum();
    volumes / bonds.particles().len().max(1) as f64 / bonds.spacing()
}

/// Lists all particles below faces, each nearer to its face than to an opposite one; hats sum to 1 over the
/// faces of a patch.
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
                near.push(FaceParticle { face: number as u32, site, hat: 1.0 - aside / width, depth: down });
            }
        });
        near.sort_unstable_by_key(|below| (faces[below.face as usize].patch, below.face));
        let opposed = |own: &FaceParticle| {
            let normal = faces[own.face as usize].normal;
            near.iter().any(|other| {
                let there = faces[other.face as usize].normal;
                let turn: f64 = (0..D).map(|d| normal[d] * there[d]).sum();
                turn < -0.5 && other.depth < own.depth + 1e-6 * spacing
            })
        };
        for patch in near.chunk_by(|a, b| faces[a.face as usize].patch == faces[b.face as usize].patch) {
            // the nearest step of a staircase
            let nearest = patch.iter().map(|below| below.depth).fold(f64::INFINITY, f64::min);
            let kept = |below: &&FaceParticle| below.depth < nearest + 0.75 * spacing;
            let sum: f64 = patch.iter().filter(kept).map(|below| below.hat).sum();
            let own = |below: &&FaceParticle| !surface.is_bound(below.face as usize) && !opposed(below);
            for below in patch.iter().filter(kept).filter(own) {
                all.push(FaceParticle { hat: below.hat / sum, ..*below });
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

/// Adds the term, linear across the normal of the face, that brings Σ w X below the face; returns its depth,
/// m.
fn centre<const D: usize>(
    bonds: &dyn BodyGeometry<D>,
    face: &SurfaceFace<D>,
    group: &[FaceParticle],
    weights: &mut [f64],
    tied: bool,
) -> f64 {
    let (spacing, normal) = (bonds.spacing(), SVector::<f64, D>::from(face.normal));
    // mostly near the surface
    let measure: Vec<f64> = group.iter().map(|below| below.hat * (-below.depth / spacing).exp()).collect();
    let total: f64 = measure.iter().sum();
    let from = |below: &FaceParticle| {
        let here = bonds.position(below.site as usize);
        SVector::<f64, D>::from_fn(|d, _| (here[d] - face.place[d]) / spacing)
    };
    let aside = |below: &FaceParticle| {
        let from = from(below);
        if tied { from } else { from - normal * normal.dot(&from) }
    };
    let (mut off, mut middle) = (SVector::<f64, D>::zeros(), SVector::<f64, D>::zeros());
    for ((below, weight), measure) in group.iter().zip(&*weights).zip(&measure) {
        off -= aside(below) * *weight;
        middle += aside(below) * (measure / total);
    }
    let mut moment = SMatrix::<f64, D, D>::zeros();
    for (below, measure) in group.iter().zip(&measure) {
        let from = aside(below) - middle;
        moment += from * from.transpose() * (measure / total);
    }
    let embedded = nalgebra::DMatrix::from_fn(D, D, |a, b| moment[(a, b)]);
    if let Ok(inverse) = embedded.pseudo_inverse(FLAT) {
        let slope = SVector::<f64, D>::from_fn(|a, _| (0..D).map(|b| inverse[(a, b)] * off[b]).sum());
        for ((below, weight), measure) in group.iter().zip(&mut *weights).zip(&measure) {
            *weight += measure / total * slope.dot(&(aside(below) - middle));
        }
    }
    let below: f64 =
        group.iter().zip(&*weights).map(|(below, weight)| weight * normal.dot(&from(below))).sum();
    -spacing * below
}

//! Centres of faces: terms of the weights that move Σ_I w_fI X_I.
//!
//! A term Δw_I = m_I s·(X_I − X̄), with the measures m_I and their mean X̄, leaves the sum of the weights as
//! it is and moves the centre by M s, M = Σ m_I (X_I − X̄) ⊗ (X_I − X̄). On a staircase it brings the centre
//! below its face; beside an edge it keeps the sphere of the face inside the body.
//!
//! Within a horizon of an edge the area vectors h_I put the centres of the outermost faces above the surface,
//! and those of the faces next to them below it. There the former gain a term along N_f and the latter the
//! opposite one, which leaves Σ_f A_f w_fI as it is at every particle.

use super::face_areas::{FaceAreas, FaceParticle, SMALL};
use crate::bonds::{BodyGeometry, CellGrid};
use crate::surface::{BodySurface, SurfaceFace};
use nalgebra::{SMatrix, SVector};

/// Least variance of the particles along a direction, in squared spacings, for which weights gain a linear
/// term.
const FLAT: f64 = 1e-3;
/// Least radius of a sphere that may reach beyond another side, and distance of that side's faces from its
/// centre, in spacings.
const ROUND: f64 = 1e-3;
const BESIDE: f64 = 2.0;
/// Height over the spacing, and 1 − cosine, of two sides that meet in an edge or are one.
const EDGE: f64 = 1e-9;
/// Height of a centre above the surface, in spacings, from which it is lowered; cosines between the normals
/// of two sides of a wall, which meet in no edge, and of two faces that exchange a term; rounds of the
/// exchange.
const ABOVE: f64 = 0.05;
const OPPOSITE: f64 = -0.9;
const ALIKE: f64 = 0.95;
const ROUNDS: usize = 6;

/// A face with its particles.
pub(super) struct CentredFace<'a> {
    pub face: u32,
    /// A_f, m², and r_f, m.
    pub area: f64,
    pub radius: f64,
    below: &'a [FaceParticle],
    weights: Vec<f64>,
    /// Entries below other faces.
    beside: Vec<(u32, f64)>,
}

impl CentredFace<'_> {
    /// Sites and weights, each site once.
    pub fn entries(&self) -> Vec<(u32, f64)> {
        let own = self.below.iter().zip(&self.weights).map(|(below, weight)| (below.site, *weight));
        let mut all: Vec<(u32, f64)> = own.chain(self.beside.iter().copied()).collect();
        if !self.beside.is_empty() {
            all.sort_by_key(|entry| entry.0);
            all.dedup_by(|next, kept| {
                let same = next.0 == kept.0;
                kept.1 += if same { next.1 } else { 0.0 };
                same
            });
        }
        all
    }
}

/// Faces of a body with their centres.
pub(super) struct FaceCentres<'a, const D: usize> {
    bonds: &'a dyn BodyGeometry<D>,
    surface: &'a BodySurface<D>,
    faces: Vec<CentredFace<'a>>,
}

impl<'a, const D: usize> FaceCentres<'a, D> {
    /// Centres the faces that have kept half of a particle's area. `tied` faces have r_f = 0: their weights
    /// gain a term along the normal as well.
    pub fn new(
        bonds: &'a dyn BodyGeometry<D>,
        surface: &'a BodySurface<D>,
        areas: &'a FaceAreas,
        tied: bool,
    ) -> Self {
        let (mut faces, mut start) = (Vec::new(), 0);
        for below in areas.below.chunk_by(|a, b| a.face == b.face) {
            let shares = &areas.shares[start..start + below.len()];
            start += below.len();
            let area: f64 = shares.iter().sum();
            // area lost to bonds of a crack or of the other side
            if area >= SMALL * areas.typical {
                let weights = shares.iter().map(|share| share / area).collect();
                let (face, beside) = (below[0].face, Vec::new());
                faces.push(CentredFace { face, area, radius: 0.0, below, weights, beside });
            }
        }
        let mut all = Self { bonds, surface, faces };
        for number in 0..all.faces.len() {
            all.bring_below(number, tied);
        }
        if !tied {
            all.lower();
            all.keep_inside();
        }
        all
    }

    /// The faces.
    pub fn faces(&self) -> &[CentredFace<'a>] {
        &self.faces
    }

    fn own(&self, number: usize) -> &'a SurfaceFace<D> {
        &self.surface.faces()[self.faces[number].face as usize]
    }

    fn normal(&self, number: usize) -> SVector<f64, D> {
        SVector::from(self.own(number).normal)
    }

    /// Offset of a particle from a face, in spacings.
    fn offset(&self, number: usize, site: u32) -> SVector<f64, D> {
        let (here, face) = (self.bonds.position(site as usize), self.own(number));
        SVector::from_fn(|d, _| (here[d] - face.place[d]) / self.bonds.spacing())
    }

    /// Offset of the centre of a face, in spacings.
    fn centre(&self, number: usize) -> SVector<f64, D> {
        let entries = self.faces[number].entries();
        entries.into_iter().map(|(site, weight)| self.offset(number, site) * weight).sum()
    }

    fn set_radius(&mut self, number: usize) {
        self.faces[number].radius = -self.bonds.spacing() * self.normal(number).dot(&self.centre(number));
    }

    /// Computes the term that moves a centre by `way`, in spacings, by means of the offsets of the particles
    /// in a subspace; along directions in which they do not differ it moves nothing.
    fn term(
        &self,
        number: usize,
        subspace: impl Fn(SVector<f64, D>) -> SVector<f64, D>,
        way: SVector<f64, D>,
    ) -> Vec<f64> {
        let (below, spacing) = (self.faces[number].below, self.bonds.spacing());
        // mostly near the surface
        let measure = |below: &FaceParticle| below.hat * (-below.depth / spacing).exp();
        let total: f64 = below.iter().map(measure).sum();
        let particles: Vec<(SVector<f64, D>, f64)> =
            below.iter().map(|b| (subspace(self.offset(number, b.site)), measure(b) / total)).collect();
        let middle: SVector<f64, D> = particles.iter().map(|(from, measure)| from * *measure).sum();
        let moment: SMatrix<f64, D, D> = particles
            .iter()
            .map(|(from, measure)| (from - middle) * (from - middle).transpose() * *measure)
            .sum();
        let embedded = nalgebra::DMatrix::from_fn(D, D, |a, b| moment[(a, b)]);
        let inverse = embedded.pseudo_inverse(FLAT).unwrap_or_else(|_| nalgebra::DMatrix::zeros(D, D));
        let slope = SVector::<f64, D>::from_fn(|a, _| (0..D).map(|b| inverse[(a, b)] * way[b]).sum());
        particles.iter().map(|(from, measure)| measure * slope.dot(&(from - middle))).collect()
    }

    fn add(&mut self, number: usize, term: &[f64], factor: f64) {
        self.faces[number].weights.iter_mut().zip(term).for_each(|(weight, term)| *weight += factor * term);
    }

    /// Brings the centre of a face below it, or into it if it is tied.
    fn bring_below(&mut self, number: usize, tied: bool) {
        let normal = self.normal(number);
        let aside = |from: SVector<f64, D>| if tied { from } else { from - normal * normal.dot(&from) };
        let term = self.term(number, aside, -aside(self.centre(number)));
        self.add(number, &term, 1.0);
        self.set_radius(number);
    }

    /// Lowers centres above the surface beside an edge; faces of the same patch within a horizon whose
    /// centres are below it gain the opposite terms, in proportion to their moments A_f r_f.
    fn lower(&mut self) {
        let high = self.above_edges();
        if high.is_empty() {
            return;
        }
        let near = self.lenders(&high);
        let lent = self.lent(&high, &near);
        for ((&number, near), lent) in high.iter().zip(&near).zip(&lent) {
            let inwards = -self.normal(number) / self.bonds.spacing();
            let term = self.term(number, |from| from, inwards);
            let area = self.faces[number].area;
            self.add(number, &term, lent.iter().sum::<f64>() / area);
            for (&other, lent) in near.iter().zip(lent) {
                let below = self.faces[number].below;
                let lender = &mut self.faces[other];
                let factor = -lent / lender.area;
                let entries = below.iter().zip(&term).map(|(below, term)| (below.site, factor * term));
                lender.beside.extend(entries);
            }
        }
        high.iter().chain(near.iter().flatten()).for_each(|&number| self.set_radius(number));
        // where those beside it had not enough to give
        for number in high {
            let radius = self.faces[number].radius;
            if radius < -ABOVE * self.bonds.spacing() {
                self.move_along(number, radius);
            }
        }
    }

    /// Lists faces within a horizon of an edge whose centres lie above the surface.
    fn above_edges(&self) -> Vec<usize> {
        let (above, reach) = (-ABOVE * self.bonds.spacing(), self.bonds.horizon());
        let mut high: Vec<usize> =
            (0..self.faces.len()).filter(|&number| self.faces[number].radius < above).collect();
        if high.is_empty() {
            return high;
        }
        let all = self.surface.faces();
        let grid = CellGrid::new(&all.iter().map(|face| face.place).collect::<Vec<_>>(), reach);
        high.retain(|&number| {
            let (own, mut found) = (self.own(number), false);
            grid.near(own.place, reach, |other| {
                let other = &all[other];
                let meets = other.patch != own.patch && cosine(other.normal, own.normal) > OPPOSITE;
                found |= meets && distance(other.place, own.place) < reach;
            });
            found
        });
        high
    }

    /// Lists the faces within a horizon of each of `high`, on the same side, whose centres lie below it.
    fn lenders(&self, high: &[usize]) -> Vec<Vec<usize>> {
        let reach = self.bonds.horizon();
        let places: Vec<[f64; D]> = (0..self.faces.len()).map(|number| self.own(number).place).collect();
        let grid = CellGrid::new(&places, reach);
        let beside = |&number: &usize| {
            let (own, mut near) = (self.own(number), Vec::new());
            grid.near(own.place, reach, |number| {
                let other = self.own(number);
                let alike = other.patch == own.patch && cosine(other.normal, own.normal) > ALIKE;
                if alike && self.faces[number].radius > 0.0 && distance(other.place, own.place) < reach {
                    near.push(number);
                }
            });
            near.sort_unstable();
            near
        };
        high.iter().map(beside).collect()
    }

    /// Computes the moments, m³, that faces above the surface take of those near each: all that they lack,
    /// as far as these have it.
    fn lent(&self, high: &[usize], near: &[Vec<usize>]) -> Vec<Vec<f64>> {
        let mut moments: Vec<f64> = self.faces.iter().map(|face| face.area * face.radius).collect();
        let mut lent: Vec<Vec<f64>> = near.iter().map(|near| vec![0.0; near.len()]).collect();
        for _ in 0..ROUNDS {
            let mut asked = vec![0.0; self.faces.len()];
            let mut shares = Vec::with_capacity(high.len());
            for (&number, near) in high.iter().zip(near) {
                let sum: f64 = near.iter().map(|&other| moments[other]).sum();
                let share = if sum > 0.0 { -moments[number] / sum } else { 0.0 };
                near.iter().for_each(|&other| asked[other] += share * moments[other]);
                shares.push(share);
            }
            let before = moments.clone();
            for (((&number, near), lent), share) in high.iter().zip(near).zip(&mut lent).zip(shares) {
                for (&other, lent) in near.iter().zip(lent).filter(|(other, _)| asked[**other] > 0.0) {
                    let moment = share * before[other] * (before[other] / asked[other]).min(1.0);
                    *lent += moment;
                    moments[number] += moment;
                    moments[other] -= moment;
                }
            }
        }
        lent
    }

    /// Raises centres from which a sphere up to the face would reach beyond another side.
    fn keep_inside(&mut self) {
        let spacing = self.bonds.spacing();
        let places: Vec<[f64; D]> = self.surface.faces().iter().map(|face| face.place).collect();
        let grid = CellGrid::new(&places, BESIDE * spacing);
        for number in 0..self.faces.len() {
            let radius = self.faces[number].radius;
            if radius > ROUND * spacing {
                let room = room(self.surface, &grid, self.own(number), radius, spacing);
                if room < radius {
                    self.move_along(number, radius - room);
                }
            }
        }
    }

    /// Moves a centre outwards along the normal, m.
    fn move_along(&mut self, number: usize, way: f64) {
        let normal = self.normal(number);
        let along = |from: SVector<f64, D>| normal * normal.dot(&from);
        let term = self.term(number, along, normal * (way / self.bonds.spacing()));
        self.add(number, &term, 1.0);
        self.set_radius(number);
    }
}

/// Returns the depth of the lowest centre, m, from which a sphere up to a face reaches beyond no other side
/// of the body; `radius` if that does. Below a side whose normal has the cosine c with that of the face, and
/// h above the place of the face, a sphere of the radius d fits for d ≤ h/(1 − c).
fn room<const D: usize>(
    surface: &BodySurface<D>,
    grid: &CellGrid<D>,
    face: &SurfaceFace<D>,
    radius: f64,
    spacing: f64,
) -> f64 {
    let mut room = radius;
    // a shorter one may come below other faces
    for _ in 0..4 {
        let centre = std::array::from_fn(|d| face.place[d] - room * face.normal[d]);
        let before = room;
        grid.near(centre, BESIDE * spacing, |other| {
            let other = &surface.faces()[other];
            let (aside, _) = surface.reach(other, centre);
            let (_, height) = surface.reach(other, face.place);
            let cosine = cosine(other.normal, face.normal);
            // at a concave edge the face lies before the other side
            if other.patch != face.patch && aside < spacing && height > -EDGE * spacing && cosine < 1.0 - EDGE
            {
                room = room.min(height.max(0.0) / (1.0 - cosine));
            }
        });
        if room == before {
            break;
        }
    }
    room
}

fn cosine<const D: usize>(one: [f64; D], other: [f64; D]) -> f64 {
    SVector::from(one).dot(&SVector::from(other))
}

fn distance<const D: usize>(one: [f64; D], other: [f64; D]) -> f64 {
    (SVector::from(one) - SVector::from(other)).norm()
}

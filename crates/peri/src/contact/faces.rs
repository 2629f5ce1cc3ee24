//! Faces of a body: points of its true surface that distribute a force over the particles below them.
//!
//! A face f at X_f with the outward normal N_f has the area A_f = Σ_I ψ_f(I) h_I·N_f and the weights
//! w_fI = ψ_f(I) h_I·N_f/A_f, with the area vectors h_I of [`crate::material::surface_load`] and hat
//! functions ψ_f of the distance along the surface, Σ_f ψ_f = 1. A uniform pressure on all faces then
//! balances a uniform stress.
//!
//! A face touches a plane as a sphere of the radius r_f about Σ_I w_fI x_I, with r_f = N_f·(X_f − Σ_I w_fI
//! X_I); on a flat face of a lattice r_f = 0, on a staircase and beside edges further terms of the weights
//! ([`super::face_centres`]) bring the centre below X_f. No position depends on a rotation, so forces have an
//! energy and conserve momentum and angular momentum.

use super::face_areas::FaceAreas;
use super::face_centres::FaceCentres;
use crate::bonds::{BodyGeometry, Bonds};
use crate::field::Field;
use crate::material::{BodyTensor, surface_load};
use crate::parallel;
use crate::surface::BodySurface;

/// Faces with their weights, face by face and particle by particle.
#[derive(Clone)]
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

impl<const D: usize> Faces<D> {
    /// Builds the faces of a body; none if the surface has none. Skips faces whose area belongs to bonds of a
    /// crack or of another side.
    ///
    /// `tied` faces have r_f = 0: the weights gain a term along the normal as well, so that faces rotate with
    /// the body.
    pub fn new(bonds: &dyn Bonds<D>, surface: &BodySurface<D>, tied: bool) -> Self {
        let load = surface_load(bonds, BodyTensor::<D>::identity());
        let areas = FaceAreas::new(bonds, surface, &load);
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
        for centred in FaceCentres::new(bonds, surface, &areas, tied).faces() {
            let own = &surface.faces()[centred.face as usize];
            faces.radii.push(centred.radius);
            faces.sources.push(centred.face);
            faces.places.push(own.place);
            faces.normals.push(own.normal);
            faces.areas.push(centred.area);
            for (site, weight) in centred.entries() {
                faces.sites.push(site);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Shape;
    use crate::model::Body;

    /// Two horizons from the rim of a plate of `layers` particles: areas and depths of the faces of its broad
    /// sides, and the balance of a uniform pressure on all faces in every particle.
    fn check<const D: usize>(layers: usize, across: f64) {
        let size: [f64; D] = std::array::from_fn(|d| if d == 1 { layers as f64 } else { across });
        let plate = Body::lattice(Shape::Box { min: [0.0; D], max: size }, 1.0);
        let bonds = plate.build().unwrap();
        let faces = Faces::new(&bonds, &plate.surface(), false);
        let inside = |at: [f64; D]| (0..D).all(|d| d == 1 || at[d] > 7.0 && at[d] < across - 7.0);
        let (mut pushed, mut seen) = (vec![[0.0; D]; bonds.sites()], 0);
        for face in 0..faces.len() {
            let (place, normal, area) = (faces.places[face], faces.normals[face], faces.areas[face]);
            for (site, weight) in faces.below(face) {
                (0..D).for_each(|d| pushed[site][d] += area * weight * normal[d]);
            }
            if normal[1].abs() == 1.0 && inside(place) {
                seen += 1;
                assert!((area - 1.0).abs() < 2e-4, "{layers} layers: area {area}");
                assert!(faces.radii[face].abs() < 2e-3, "{layers} layers: depth {}", faces.radii[face]);
            }
        }
        assert_eq!(seen, 2 * (across as usize - 14).pow(D as u32 - 1));
        let load = surface_load(&bonds, BodyTensor::<D>::identity());
        for site in bonds.particles().iter().map(|&site| site as usize) {
            if !inside(bonds.position(site)) {
                continue;
            }
            let (found, expected) = (pushed[site], load.get(site).map(|h| h * bonds.volume(site)));
            assert!((0..D).all(|d| (found[d] - expected[d]).abs() < 1e-10), "{found:?} {expected:?}");
        }
    }

    /// Sides of slender bars and of small blocks have their areas, along each axis.
    #[test]
    fn sides_of_slender_bars_have_their_areas() {
        fn check<const D: usize>(size: [f64; D]) {
            let bar = Body::lattice(Shape::Box { min: [0.0; D], max: size }, 1.0);
            let bonds = bar.build().unwrap();
            let faces = Faces::new(&bonds, &bar.surface(), false);
            for axis in 0..D {
                let sum = |sign: f64| {
                    let own = (0..faces.len()).filter(|&face| faces.normals[face][axis] == sign);
                    own.map(|face| faces.areas[face]).sum::<f64>()
                };
                let across: f64 = (0..D).filter(|&d| d != axis).map(|d| size[d]).product();
                let found = [sum(1.0), sum(-1.0)];
                assert!(
                    found.iter().all(|x| (x / across - 1.0).abs() < 0.02),
                    "{size:?}: {found:?} {across}"
                );
            }
        }
        let bars = [[4.0, 2.0], [6.0, 2.0], [8.0, 4.0], [10.0, 6.0], [12.0, 4.0], [30.0, 3.0], [16.0, 15.0]];
        bars.into_iter().for_each(check::<2>);
        let blocks = [[6.0, 2.0, 6.0], [12.0, 4.0, 12.0], [24.0, 2.0, 4.0], [5.0, 6.0, 7.0]];
        blocks.into_iter().for_each(check::<3>);
    }

    /// Centres of faces beside edges lie on flat sides and below curved ones, and a uniform pressure on all
    /// sides balances a uniform stress in every particle there, but at corners.
    #[test]
    fn centres_lie_on_flat_sides() {
        fn check<const D: usize>(name: &str, shape: Shape<D>, edges: Option<[f64; D]>) {
            let body = Body::lattice(shape, 1.0);
            let bonds = body.build().unwrap();
            let faces = Faces::new(&bonds, &body.surface(), false);
            let is_flat = |&face: &usize| faces.normals[face].iter().any(|n| n.abs() == 1.0);
            let worst = (0..faces.len())
                .filter(is_flat)
                .map(|face| {
                    let mut centre = faces.places[face];
                    for (site, weight) in faces.below(face) {
                        let here = bonds.position(site);
                        (0..D).for_each(|d| centre[d] -= weight * here[d]);
                    }
                    centre.iter().map(|x| x * x).sum::<f64>().sqrt()
                })
                .fold(0.0, f64::max);
            // those of a cylinder beside its ends at 0 and 12
            let is_beside = |&face: &usize| edges.is_some() || (faces.places[face][D - 1] - 6.0).abs() > 4.0;
            let least = (0..faces.len()).filter(is_beside).map(|face| faces.radii[face]).fold(0.0, f64::min);
            eprintln!("{name}: centres {worst:.1e} from flat faces, radii from {least:.2}");
            assert!(worst < 0.06 && least > -0.06, "{name}: {worst} from flat faces, radius {least}");
            let mut pushed = vec![[0.0; D]; bonds.sites()];
            for face in 0..faces.len() {
                let (normal, area) = (faces.normals[face], faces.areas[face]);
                for (site, weight) in faces.below(face) {
                    (0..D).for_each(|d| pushed[site][d] += area * weight * normal[d]);
                }
            }
            let load = surface_load(&bonds, BodyTensor::<D>::identity());
            let Some(edges) = edges else { return };
            // small faces at corners in space join others, whose weights gain terms of their own
            let beside_corner = |&site: &usize| {
                let here = bonds.position(site);
                D == 3 && (0..D).all(|d| here[d] < 7.0 || here[d] > edges[d] - 7.0)
            };
            let sites = bonds.particles().iter().map(|&site| site as usize);
            for site in sites.filter(|site| !beside_corner(site)) {
                let (found, expected) = (pushed[site], load.get(site).map(|h| h * bonds.volume(site)));
                assert!((0..D).all(|d| (found[d] - expected[d]).abs() < 1e-9), "{found:?} {expected:?}");
            }
        }
        check("square", Shape::rectangle([0.0; 2], [16.0, 15.0]), Some([16.0, 15.0]));
        let edges = [14.0, 15.0, 16.0];
        check("box", Shape::Box { min: [0.0; 3], max: edges }, Some(edges));
        for radius in [6.0, 7.5, 11.3, 15.0] {
            let shape = Shape::Cylinder { centre: [0.0, 0.0, 6.0], axis: 2, length: 12.0, radius };
            check(&format!("cylinder {radius}"), shape, None);
        }
    }

    #[test]
    fn thin_walls_have_faces_of_full_area() {
        (2..16).for_each(|layers| check::<2>(layers, 24.0));
        [2, 3, 5, 8].into_iter().for_each(|layers| check::<3>(layers, 17.0));
    }

    /// Spheres of faces reach beyond no other side: a plane along one side touches no face of another, at
    /// edges of any angle.
    #[test]
    fn spheres_stay_inside_the_body() {
        fn check<const D: usize>(name: &str, body: &Body<D>, [allowed, least]: [f64; 2]) {
            let bonds = body.build().unwrap();
            let (surface, faces) = (body.surface(), Faces::new(&bonds, &body.surface(), false));
            let (mut round, mut worst) = (0, 0.0_f64);
            for face in 0..faces.len() {
                let mut centre = [0.0; D];
                for (site, weight) in faces.below(face) {
                    let here = bonds.position(site);
                    (0..D).for_each(|d| centre[d] += weight * here[d]);
                }
                let own = &surface.faces()[faces.sources[face] as usize];
                let size = faces.radii[face];
                let depth: f64 = (0..D).map(|d| (own.place[d] - centre[d]) * own.normal[d]).sum();
                assert!(
                    (depth - size).abs() < 1e-9,
                    "{name}, {own:?}: centre {depth} below it, radius {size}"
                );
                round += usize::from(size > least);
                let centre = std::array::from_fn(|d| own.place[d] - size * own.normal[d]);
                for other in surface.faces().iter().filter(|other| other.patch != own.patch && size > 0.0) {
                    let (aside, down) = surface.reach(other, centre);
                    let (_, height) = surface.reach(other, own.place);
                    if aside < 1.0 && height >= 0.0 {
                        worst = worst.max(size - down);
                    }
                }
            }
            eprintln!("{name}: {round} spheres, {worst:.1e} beyond a side");
            assert!(round > 1 && worst < allowed, "{name}: {round} spheres, {worst} beyond a side");
        }
        // exactly below flat sides; below curved ones by tangents at their faces, 8.3e-3 found. Spheres of
        // shallow notches, 0.2 spacings at most, have lent their depth to the faces at the edges
        let (flat, curved) = ([1e-9, 0.3], 0.02);
        for (radius, length) in [(2.5, 6.0), (3.4, 6.0), (4.45, 6.0), (7.5, 12.0), (8.7, 9.3), (11.3, 9.0)] {
            let centre = [0.0, 0.0, 0.5 * length];
            let cylinder = Shape::Cylinder { centre, axis: 2, length, radius };
            check(&format!("cylinder {radius}"), &Body::lattice(cylinder.clone(), 1.0), flat);
            let upper = Shape::Box { min: [0.5 * radius, -20.0, -20.0], max: [20.0; 3] };
            check(&format!("cylinder {radius} with a flat"), &Body::lattice(cylinder, 1.0).cut(upper), flat);
        }
        for cut in [0.3, 0.5, 0.6, 0.9] {
            let above = Shape::Box { min: [-30.0, 20.0 * cut], max: [30.0, 30.0] };
            check(
                &format!("disk cut at {cut}"),
                &Body::lattice(Shape::disk([0.0; 2], 20.0), 1.0).cut(above),
                flat,
            );
            let above = Shape::Box { min: [-30.0, -30.0, 7.0 * cut], max: [30.0; 3] };
            let ball = Shape::Ball { centre: [0.0; 3], radius: 7.0 };
            check(&format!("ball cut at {cut}"), &Body::lattice(ball, 1.0).cut(above), flat);
        }
        for (depth, least) in [(-2.0, 0.15), (0.0, 0.15), (3.0, 0.3)] {
            let notch = Shape::disk([12.0, 20.0 - depth], 6.0);
            check(
                &format!("notch {depth}"),
                &Body::lattice(Shape::rectangle([0.0; 2], [24.0, 20.0]), 1.0).cut(notch),
                [curved, least],
            );
        }
    }
}

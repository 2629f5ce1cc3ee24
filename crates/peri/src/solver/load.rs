//! Loads and supports: body forces and prescribed displacement components, proportional to one load factor
//! except in rotating regions and with curves.

use super::curves::CurvedLoads;
use super::rigid::RigidRegion;
use super::rotation::RotatingRegion;
use crate::bonds::BodyGeometry;
use crate::field::{CHUNK, Field};
use crate::parallel;

/// Prescribed displacement and body force of a region at load factor 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Support<const D: usize> {
    /// Prescribed displacement components, m; `None` is free.
    pub displacement: [Option<f64>; D],
    /// Body force density, N/m³.
    pub body_force: [f64; D],
}

/// Loads of a body, site by site. Absent kinds of load are not stored.
#[derive(Clone, Debug, Default)]
pub struct Loads<const D: usize> {
    /// Sites of tractions on sides, whose body forces have either sign.
    pub pushed_regions: Vec<Vec<u32>>,
    /// Body force density at load factor 1, N/m³.
    pub body_force: Option<Field<D>>,
    /// Prescribed displacement at load factor 1, m, of constrained components; in rotating regions its rate
    /// over the load factor.
    pub displacement: Option<Field<D>>,
    /// Bit d of a site: component d is constrained. Empty without constraints.
    pub constrained: Vec<u8>,
    /// Sites of each region of prescribed displacement, in the order given.
    pub held_regions: Vec<Vec<u32>>,
    /// Regions that rotate about an axis.
    pub turned: Vec<RotatingRegion<D>>,
    /// Regions that move as a whole, see [`Self::join`].
    pub rigid: Vec<RigidRegion>,
    /// With such regions: bit d of a site: component d is constrained or shared.
    pub joined: Vec<u8>,
    /// Mean displacement gradient H of a body with periodic sides at load factor 1; zero columns along other
    /// axes.
    pub mean_gradient: Option<[[f64; D]; D]>,
    /// Loads that follow curves; absent: all follow the load factor.
    pub curved: Option<Box<CurvedLoads<D>>>,
}

/// Force of a body force and of `pushes` along each axis, N: the larger sum of both directions, of `regions`
/// as wholes, in whose particles it may have either sign, and of other particles. A particle counts in the
/// first region that contains it.
pub(super) fn one_sided<const D: usize>(
    bonds: &dyn BodyGeometry<D>,
    regions: &[Vec<u32>],
    body: Option<&Field<D>>,
    pushes: &[[f64; D]],
) -> [f64; D] {
    let mut sums = [[0.0; D]; 2];
    let mut add = |force: [f64; D]| {
        for d in 0..D {
            sums[0][d] += force[d].max(0.0);
            sums[1][d] += (-force[d]).max(0.0);
        }
    };
    pushes.iter().for_each(|&push| add(push));
    let Some(body) = body else { return larger(sums) };
    let mut counted = vec![false; if regions.is_empty() { 0 } else { bonds.sites() }];
    let force = |site: usize| body.get(site).map(|b| b * bonds.volume(site));
    for region in regions {
        let mut sum = [0.0; D];
        for site in region.iter().map(|&site| site as usize) {
            if !std::mem::replace(&mut counted[site], true) {
                let own = force(site);
                (0..D).for_each(|d| sum[d] += own[d]);
            }
        }
        add(sum);
    }
    for site in bonds.particles().iter().map(|&site| site as usize) {
        if !counted.get(site).copied().unwrap_or(false) {
            add(force(site));
        }
    }
    larger(sums)
}

fn larger<const D: usize>([up, down]: [[f64; D]; 2]) -> [f64; D] {
    std::array::from_fn(|d| f64::max(up[d], down[d]))
}

impl<const D: usize> Loads<D> {
    /// Collects regions, each given by its sites and its support; body forces add up, the last displacement
    /// applies.
    pub fn new(sites: usize, regions: &[(Vec<u32>, Support<D>)]) -> Self {
        let mut loads = Self::default();
        for (members, support) in regions {
            if support.body_force.iter().any(|&b| b != 0.0) {
                let field = loads.body_force.get_or_insert_with(|| Field::zeros(sites));
                for &site in members {
                    let old = field.get(site as usize);
                    field.set(site as usize, std::array::from_fn(|d| old[d] + support.body_force[d]));
                }
            }
            if support.displacement.iter().any(Option::is_some) {
                loads.held_regions.push(members.clone());
                let field = loads.displacement.get_or_insert_with(|| Field::zeros(sites));
                loads.constrained.resize(sites, 0);
                for &site in members {
                    let mut value = field.get(site as usize);
                    for d in 0..D {
                        if let Some(prescribed) = support.displacement[d] {
                            value[d] = prescribed;
                            loads.constrained[site as usize] |= 1 << d;
                        }
                    }
                    field.set(site as usize, value);
                }
            }
        }
        loads
    }

    /// Bits of the constrained components of a site.
    pub fn constrained(&self, site: usize) -> u8 {
        self.constrained.get(site).copied().unwrap_or(0)
    }

    /// Removes the body force from a site.
    pub fn unload(&mut self, site: usize) {
        if let Some(field) = &mut self.body_force {
            field.set(site, [0.0; D]);
        }
        self.unload_curved(site as u32);
    }

    /// Sums of the loads' conjugate quantities, N·m: Σ −F V·d over constrained components with d the rate of
    /// their displacement over the factor, and Σ b V·u with b the body force at factor 1. `force` holds
    /// out-of-balance force densities.
    pub fn conjugates(
        &self,
        bonds: &dyn BodyGeometry<D>,
        displacement: &Field<D>,
        force: &Field<D>,
    ) -> (f64, f64) {
        let (mut pull, mut push) = (0.0, 0.0);
        for &site in bonds.particles() {
            let site = site as usize;
            let (constrained, volume) = (self.constrained(site), bonds.volume(site));
            if let Some(prescribed) = self.displacement.as_ref().filter(|_| constrained != 0) {
                let (full, force) = (prescribed.get(site), force.get(site));
                pull -= (0..D).filter(|d| constrained >> d & 1 == 1).map(|d| full[d] * force[d]).sum::<f64>()
                    * volume;
            }
            if let Some(body) = &self.body_force {
                let (body, moved) = (body.get(site), displacement.get(site));
                push += (0..D).map(|d| body[d] * moved[d]).sum::<f64>() * volume;
            }
        }
        (pull, push)
    }

    /// Relative prescribed displacement at factor 1, m: √Σ_d (max − min)²; for rotating regions the longest
    /// arc; `rigid` are the displacements of rigid surfaces.
    pub fn reach(&self, bonds: &dyn BodyGeometry<D>, rigid: &[[f64; D]]) -> f64 {
        let mut turned = vec![false; if self.turned.is_empty() { 0 } else { bonds.sites() }];
        self.turned.iter().flat_map(|region| &region.sites).for_each(|&site| turned[site as usize] = true);
        let still = |site: usize| !turned.get(site).copied().unwrap_or(false);
        let span = |d: usize| {
            let constrained = bonds
                .particles()
                .iter()
                .map(|&s| s as usize)
                .filter(|&s| self.constrained(s) >> d & 1 == 1 && still(s));
            let prescribed = self.displacement.as_ref();
            let (low, high) = constrained
                .filter_map(|s| Some(prescribed?.get(s)[d]))
                .chain(rigid.iter().map(|plane| plane[d]))
                .chain(self.turned.iter().map(|region| region.shift[d]))
                .fold((0.0_f64, 0.0_f64), |(low, high), x| (low.min(x), high.max(x)));
            high - low
        };
        let straight = (0..D).map(|d| span(d).powi(2)).sum::<f64>().sqrt();
        if self.turned.is_empty() {
            straight
        } else {
            straight.hypot(self.arc(bonds, |turned| turned.rotation.angle))
        }
    }

    /// Total force at factor 1 along each axis, N, of the body force and of `pushes` on rigid surfaces: the
    /// larger sum of both directions.
    pub fn applied(&self, bonds: &dyn BodyGeometry<D>, pushes: &[[f64; D]]) -> [f64; D] {
        one_sided(bonds, &self.pushed_regions, self.body_force.as_ref(), pushes)
    }

    /// Load, N, and its conjugate displacement, m, from [`Loads::conjugates`]: the force conjugate to the
    /// grips' distance `factor` · [`Loads::reach`]; with prescribed forces only, these, and the mean
    /// displacement of their points along them (of both ends together if they pull at both). Of rigid
    /// surfaces `rigid` are the displacements, as in [`Loads::reach`], and `pushes` the forces, N.
    pub fn response(
        &self,
        bonds: &dyn BodyGeometry<D>,
        factor: f64,
        (pull, push): (f64, f64),
        [rigid, pushes]: [&[[f64; D]]; 2],
    ) -> (f64, f64) {
        let reach = self.reach(bonds, rigid);
        if reach > 0.0 {
            return (pull / reach, factor * reach);
        }
        let applied = self.applied(bonds, pushes).iter().map(|x| x * x).sum::<f64>().sqrt();
        if applied > 0.0 { (factor * applied, push / applied) } else { (0.0, 0.0) }
    }

    /// Reaction on each region of prescribed displacement, N; unconstrained components give none.
    pub fn reactions(&self, bonds: &dyn BodyGeometry<D>, force: &Field<D>) -> Vec<[f64; 3]> {
        let of_region = |sites: &Vec<u32>| {
            let mut sum = [0.0; 3];
            for &site in sites {
                let (force, volume) = (force.get(site as usize), bonds.volume(site as usize));
                for d in 0..D {
                    if self.constrained(site as usize) >> d & 1 == 1 {
                        sum[d] -= force[d] * volume;
                    }
                }
            }
            sum
        };
        self.held_regions.iter().map(of_region).collect()
    }

    /// Force of the regions of prescribed displacement along each axis, N: the larger of the summed positive
    /// and negative reactions. A particle counts in the first region that contains it.
    pub fn reaction(&self, bonds: &dyn BodyGeometry<D>, force: &Field<D>) -> [f64; D] {
        let mut counted = vec![false; self.constrained.len()];
        let (mut up, mut down) = ([0.0; D], [0.0; D]);
        for sites in &self.held_regions {
            let mut sum = [0.0; D];
            for &site in sites {
                let site = site as usize;
                if std::mem::replace(&mut counted[site], true) {
                    continue;
                }
                let (force, volume) = (force.get(site), bonds.volume(site));
                for d in (0..D).filter(|d| self.constrained(site) >> d & 1 == 1) {
                    sum[d] -= force[d] * volume;
                }
            }
            for d in 0..D {
                up[d] += sum[d].max(0.0);
                down[d] += (-sum[d]).max(0.0);
            }
        }
        std::array::from_fn(|d| up[d].max(down[d]))
    }

    /// Moves the images beyond periodic sides with their origins, and by F·H times the distance between both.
    pub(super) fn place_images(&self, bonds: &dyn BodyGeometry<D>, factor: f64, displacement: &mut Field<D>) {
        for image in bonds.images() {
            let mut value = displacement.get(image.origin as usize);
            if let Some(gradient) = &self.mean_gradient {
                for (value, row) in value.iter_mut().zip(gradient) {
                    *value += factor * (0..D).map(|d| row[d] * image.shift[d]).sum::<f64>();
                }
            }
            displacement.set(image.site as usize, value);
        }
    }

    /// Relative displacement of opposite periodic sides at factor 1, m: √Σ_d |H e_d|² L_d² with the edges L.
    pub(super) fn reach_of_sides(&self, period: [f64; D]) -> f64 {
        let Some(gradient) = &self.mean_gradient else { return 0.0 };
        let each = gradient.iter().flat_map(|row| (0..D).map(|d| (row[d] * period[d]).powi(2)));
        each.sum::<f64>().sqrt()
    }

    /// Affine field u_d = a_d + Σ_e B_de X_e to start from: closest to the prescribed displacements if there
    /// are any, otherwise in balance with the body forces. One row (a_d, B_d1, …) per component, at load
    /// factor 1.
    pub fn affine_predictor(&self, bonds: &dyn BodyGeometry<D>, stiffness: f64) -> [[f64; 4]; D] {
        if let Some(gradient) = &self.mean_gradient {
            self.affine_mean(bonds, gradient)
        } else if self.displacement.is_some() {
            self.affine_closest(bonds)
        } else if self.body_force.is_some() {
            self.affine_balance(bonds, stiffness)
        } else {
            [[0.0; 4]; D]
        }
    }

    /// Field H X, and the mean of the prescribed displacements in each component, which H does not move.
    fn affine_mean(&self, bonds: &dyn BodyGeometry<D>, gradient: &[[f64; D]; D]) -> [[f64; 4]; D] {
        let mut result = [[0.0; 4]; D];
        for d in 0..D {
            result[d][1..=D].copy_from_slice(&gradient[d]);
            let Some(prescribed) = &self.displacement else { continue };
            let held = bonds.particles().iter().map(|&site| site as usize);
            let held = held.filter(|&site| self.constrained(site) >> d & 1 == 1);
            let (sum, count) = held.fold((0.0, 0.0), |(s, n), site| (s + prescribed.get(site)[d], n + 1.0));
            result[d][0] = if count > 0.0 { sum / count } else { 0.0 };
        }
        result
    }

    /// Least-squares fit, of least norm, to the prescribed displacements: moves the whole body with its
    /// grips.
    pub(super) fn affine_closest(&self, bonds: &dyn BodyGeometry<D>) -> [[f64; 4]; D] {
        let mut result = [[0.0; 4]; D];
        let Some(field) = &self.displacement else { return result };
        for d in 0..D {
            let constrained: Vec<usize> = bonds
                .particles()
                .iter()
                .map(|&site| site as usize)
                .filter(|&site| self.constrained(site) >> d & 1 == 1)
                .collect();
            let mut normal = nalgebra::Matrix4::<f64>::zeros();
            let mut right = nalgebra::Vector4::<f64>::zeros();
            // lengths in units of the body, so that the threshold of the pseudo-inverse is meaningful
            let scale = constrained
                .iter()
                .flat_map(|&s| bonds.position(s))
                .fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
            // a rigidly moved body stays unstrained to the last bit
            let first = constrained.first().map_or(0.0, |&site| field.get(site)[d]);
            for &site in &constrained {
                let position = bonds.position(site);
                let mut row = nalgebra::Vector4::zeros();
                row[0] = 1.0;
                for e in 0..D {
                    row[e + 1] = position[e] / scale;
                }
                normal += row * row.transpose();
                right += row * (field.get(site)[d] - first);
            }
            let count = constrained.len().max(1) as f64;
            if let Ok(inverse) = (normal / count).pseudo_inverse(1e-10) {
                let solution = inverse * right / count;
                result[d][0] = first + solution[0];
                for e in 0..D {
                    result[d][e + 1] = solution[e + 1] / scale;
                }
            }
        }
        result
    }

    /// Homogeneous strain H whose bond forces do the same virtual work as the body forces in every
    /// homogeneous strain: Σ_I V_I Σ_J kθK w V_J |ξ| (n·Hn)(n·Gn) = Σ_I V_I b·G X for all symmetric G
    /// (Galerkin's projection). `stiffness` is kθK.
    fn affine_balance(&self, bonds: &dyn BodyGeometry<D>, stiffness: f64) -> [[f64; 4]; D] {
        let mut result = [[0.0; 4]; D];
        let Some(body_force) = &self.body_force else { return result };
        // components (a, b) of H, a ≤ b; off the diagonal each represents two
        let pairs: Vec<(usize, usize)> = (0..D).flat_map(|a| (a..D).map(move |b| (a, b))).collect();
        let twice = |(a, b): (usize, usize)| if a == b { 1.0 } else { 2.0 };
        let of_site = |site: usize, matrix: &mut [[f64; 6]; 6]| {
            let volume = bonds.volume(site);
            bonds.neighbours(site, &mut |bond| {
                let mut dyad = [0.0; 6];
                for (value, &(a, b)) in dyad.iter_mut().zip(&pairs) {
                    *value = twice((a, b)) * bond.bond[a] * bond.bond[b] / (bond.length * bond.length);
                }
                let factor = stiffness * volume * bond.weight * bond.length;
                for row in 0..pairs.len() {
                    for column in 0..pairs.len() {
                        matrix[row][column] += factor * dyad[row] * dyad[column];
                    }
                }
            });
        };
        let is_whole = |site: usize| bonds.has_whole_family(site);
        let mut of_whole = [[0.0; 6]; 6];
        let some = bonds.particles().iter().find(|&&site| is_whole(site as usize));
        some.iter().for_each(|&&site| of_site(site as usize, &mut of_whole));
        let part = |sites: &[u32]| {
            let mut matrix = [[0.0; 6]; 6];
            let mut right = [0.0; 6];
            let mut alike = 0.0;
            for &site in sites {
                let site = site as usize;
                if is_whole(site) {
                    alike += 1.0;
                } else {
                    of_site(site, &mut matrix);
                }
                let (force, position) = (body_force.get(site), bonds.position(site));
                let volume = bonds.volume(site);
                for (value, &(a, b)) in right.iter_mut().zip(&pairs) {
                    *value +=
                        0.5 * twice((a, b)) * volume * (force[a] * position[b] + force[b] * position[a]);
                }
            }
            for (row, own) in matrix.iter_mut().zip(&of_whole) {
                row.iter_mut().zip(own).for_each(|(sum, own)| *sum += alike * own);
            }
            (matrix, right)
        };
        let parts: Vec<([[f64; 6]; 6], [f64; 6])> = parallel::map_chunks(bonds.particles(), CHUNK, part);
        let count = pairs.len();
        let matrix =
            nalgebra::DMatrix::from_fn(count, count, |i, j| parts.iter().map(|p| p.0[i][j]).sum::<f64>());
        let right = nalgebra::DVector::from_fn(count, |i, _| parts.iter().map(|p| p.1[i]).sum::<f64>());
        let size = matrix.trace();
        if size > 0.0
            && let Ok(inverse) = (matrix / size).pseudo_inverse(1e-10)
        {
            let strain = inverse * right / size;
            for (&(a, b), &value) in pairs.iter().zip(strain.iter()) {
                result[a][b + 1] = value;
                result[b][a + 1] = value;
            }
        }
        result
    }
}

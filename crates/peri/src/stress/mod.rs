//! Stress of a bonded body: first Piola–Kirchhoff P from bond forces, Cauchy σ = P Fᵀ/J.
//!
//! With the dual force f = 2t and the bond function B_IJ(X) = ∫₀¹ φ(X_I + α ξ_IJ − X) dα of a window φ
//! (2.15), P = ½ Σ_I Σ_J f_IJ V_I V_J ⊗ ξ_IJ B_IJ over **all** bonds that cross the window (Eq. (2.14) with f
//! for t); its divergence is the window's average of the force density. A uniform strain is exact if every
//! bond's weights V B sum to 1 over the particles: those of a ball do not, those of a ball averaged over a
//! particle's cell do.

mod ball;
mod bond_fits;
mod bond_forces;
mod cloud;
mod convolution;
mod lattice;
mod window;

pub use ball::{ball_volume, cell_fractions, segment_fraction};
pub use bond_fits::BondFits;
#[cfg(feature = "gpu")]
pub(crate) use lattice::StressPlan;

use crate::bonds::{
    BodyGeometry, BondForces, BondKind, Bonds, CloudBonds, GradientSums, LatticeBonds, Neighbour,
};
use crate::field::{CHUNK, Field, chunk_range};
use crate::parallel;
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// A second-order tensor of dimension `D`, row by row.
pub type StressTensor<const D: usize> = [[f64; D]; D];

/// Measure of stress.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum StressMethod {
    /// All bonds crossing the ball, by the fraction inside, averaged over the particle's cell: weights that
    /// sum to 1 for every bond offset; [`SurfaceCompensation`] treats surfaces.
    #[default]
    Hardy,
    /// [`Self::Hardy`] with [`SurfaceCompensation::Bonds`] everywhere.
    HardyBonds,
    /// [`Self::Hardy`] with [`SurfaceCompensation::Window`] everywhere.
    HardyWindow,
    /// Without the average over the cell: every bond's weights are divided by their sum.
    HardyScaled,
    /// [`Self::Hardy`] with a Gaussian window.
    Gaussian,
    /// [`Self::Hardy`] with the cubic spline as window.
    Spline,
    /// Eq. (2.10) of Lehoucq and Silling with bond forces linear between particles: [`Self::Hardy`] with the
    /// particle's own cell as window.
    LehoucqSilling,
    /// All bonds crossing the ball, by the fraction inside; ball volume inside the body. Fails the patch test
    /// by up to 2.5 %.
    BallShare,
    /// P = ½ Σ_J f ⊗ ξ V_J: cheap, equals the lattice's stiffness.
    OnePoint,
    /// Eq. (2.31) as printed: t for f, bonds with both ends in the ball only, the whole ball's volume.
    AsPublished,
    /// P of the law at the mean deformation of a family, times its intact fraction: for solids. [`piola`] of
    /// bond forces gives NaN.
    Constitutive,
}

impl StressMethod {
    /// All measures of bond forces.
    pub const ALL: [Self; 10] = [
        Self::Hardy,
        Self::HardyBonds,
        Self::HardyWindow,
        Self::HardyScaled,
        Self::Gaussian,
        Self::Spline,
        Self::LehoucqSilling,
        Self::BallShare,
        Self::OnePoint,
        Self::AsPublished,
    ];

    /// Name in scenes and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hardy => "hardy",
            Self::HardyBonds => "hardy-bonds",
            Self::HardyWindow => "hardy-window",
            Self::HardyScaled => "hardy-scaled",
            Self::Gaussian => "gaussian",
            Self::Spline => "spline",
            Self::LehoucqSilling => "lehoucq-silling",
            Self::BallShare => "ball-share",
            Self::OnePoint => "one-point",
            Self::AsPublished => "as-published",
            Self::Constitutive => "constitutive",
        }
    }

    /// Returns true if it needs the offsets or cells of a lattice.
    pub fn needs_lattice(self) -> bool {
        matches!(self, Self::HardyBonds | Self::HardyWindow | Self::HardyScaled | Self::LehoucqSilling)
    }

    /// Returns true if it distributes every bond with weights of sum 1.
    fn is_partition(self) -> bool {
        !matches!(self, Self::BallShare | Self::OnePoint | Self::AsPublished | Self::Constitutive)
    }
}

/// Compensation for bonds missing at a surface, of the measures whose weights sum to 1, on a lattice.
#[derive(Clone, Copy, Debug, Default)]
pub enum SurfaceCompensation<'a> {
    /// Divides every bond offset by the weights of the bonds whose two particles exist; a broken bond counts,
    /// with no force. A uniform strain is then exact up to the surface; under a body force it extrapolates.
    #[default]
    Bonds,
    /// Divides all bonds by the share of the window that the body's cells cover.
    Window,
    /// [`Self::Window`] in the marked sites (where body forces act), [`Self::Bonds`] elsewhere.
    WindowAt(&'a [bool]),
}

impl SurfaceCompensation<'_> {
    fn is_window(self, site: usize) -> bool {
        match self {
            Self::Bonds => false,
            Self::Window => true,
            Self::WindowAt(marked) => marked.get(site).copied().unwrap_or(false),
        }
    }
}

/// Volume Ω of the averaging ball inside the body, for [`StressMethod::BallShare`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum BallVolume {
    /// Volume of the ball times the share of its particles that exist.
    #[default]
    Particles,
    /// Part of the ball that the particles' cells cover (lattices; clouds, which have no cells, use
    /// `Particles`).
    Cells,
    /// Volume of the whole ball.
    Whole,
}

/// Bond law and state from which stresses follow.
pub struct StressInput<'a, const D: usize> {
    /// Displacement, m.
    pub displacement: &'a Field<D>,
    /// Fitted bond laws, covering the stretches of `displacement`.
    pub fit: BondFits<'a>,
    /// kθ.
    pub modulus: f64,
    /// Compensation for bonds missing at surfaces.
    pub missing: SurfaceCompensation<'a>,
}

/// Stress of every particle by one of several measures.
#[derive(Clone, Debug)]
pub struct MeasuredStress<const D: usize> {
    /// First Piola–Kirchhoff stress, in the order of [`BodyGeometry::particles`], Pa.
    pub piola: Vec<StressTensor<D>>,
    /// Seconds that this measure takes on its own, including the forces of all bonds, which several measures
    /// on a lattice share.
    pub seconds: f64,
}

/// Computes [`piola`] of several measures. On a lattice they share the forces of bonds; with periodic sides
/// measures other than [`StressMethod::OnePoint`] give NaN.
pub fn piolas<const D: usize>(
    bonds: &dyn Bonds<D>,
    state: &StressInput<D>,
    measures: &[StressMethod],
    ball: BallVolume,
) -> Vec<MeasuredStress<D>> {
    if let BondKind::Lattice(lattice) = bonds.kind()
        && !measures.contains(&StressMethod::Constitutive)
    {
        return lattice::piolas(lattice, state, measures, ball);
    }
    let one = |&measure: &StressMethod| {
        let started = Instant::now();
        let piola = piola(bonds, state, measure, ball);
        MeasuredStress { piola, seconds: started.elapsed().as_secs_f64() }
    };
    measures.iter().map(one).collect()
}

/// Computes the first Piola–Kirchhoff stress of every particle (in the order of [`BodyGeometry::particles`]),
/// Pa.
pub fn piola<const D: usize>(
    bonds: &dyn Bonds<D>,
    state: &StressInput<D>,
    measure: StressMethod,
    ball: BallVolume,
) -> Vec<StressTensor<D>> {
    match bonds.kind() {
        BondKind::Lattice(lattice) => piola_on_lattice(lattice, state, measure, ball),
        BondKind::Cloud(cloud) => piola_in_cloud(cloud, state, measure, ball),
    }
}

/// Computes the first Piola–Kirchhoff stress of every particle (in the order of [`BodyGeometry::particles`]),
/// Pa, on a lattice.
pub fn piola_on_lattice<const D: usize>(
    bonds: &LatticeBonds<D>,
    state: &StressInput<D>,
    measure: StressMethod,
    ball: BallVolume,
) -> Vec<StressTensor<D>> {
    if measure == StressMethod::Constitutive {
        return vec![[[f64::NAN; D]; D]; bonds.particles().len()];
    }
    lattice::piolas(bonds, state, &[measure], ball).swap_remove(0).piola
}

/// Computes the first Piola–Kirchhoff stress of every particle (in the order of [`BodyGeometry::particles`]),
/// Pa, in a cloud.
///
/// A cloud has neither common offsets of bonds nor cells: a measure whose weights sum to 1 distributes every
/// bond over the particles whose windows it crosses, by volume × bond function, so that the sum of P V is
/// that of f ⊗ ξ over all bonds; [`StressInput::missing`] has no effect. Measures that need a lattice
/// ([`StressMethod::needs_lattice`]) are treated as [`StressMethod::Hardy`]; scenes refuse them.
pub fn piola_in_cloud<const D: usize>(
    bonds: &CloudBonds<D>,
    state: &StressInput<D>,
    measure: StressMethod,
    ball: BallVolume,
) -> Vec<StressTensor<D>> {
    if measure == StressMethod::Constitutive {
        return vec![[[f64::NAN; D]; D]; bonds.particles().len()];
    }
    cloud::piola(bonds, state, measure, ball)
}

/// Force f V_I V_J, N, along ζ per unit |ζ|: 2kθ w V_I V_J q(e)/|ξ|, of a bond `from` a site.
pub(crate) fn force_over_length<const D: usize>(
    fits: BondFits,
    modulus: f64,
    own_volume: f64,
    from: usize,
    bond: &Neighbour<D>,
    eta: [f64; D],
) -> f64 {
    let square: f64 = bond.bond.iter().map(|x| x * x).sum();
    let e = (0..D).map(|d| eta[d] * (2.0 * bond.bond[d] + eta[d])).sum::<f64>() / square;
    2.0 * modulus * bond.weight * own_volume * fits.value(from, bond.site, e) / square.sqrt()
}

/// Computes the nonlocal deformation gradient F = (Σ w ζ ⊗ ξ)(Σ w ξ ⊗ ξ)⁻¹ over the intact bonds (Silling et
/// al. 2007, doi:10.1007/s10659-007-9125-1); the identity if the bonds do not span space.
pub fn deformation_gradients<const D: usize>(
    bonds: &dyn BondForces<D>,
    displacement: &Field<D>,
) -> Vec<StressTensor<D>> {
    let particles = bonds.particles();
    // sums of one work item; `None` if bonds have to be visited one by one
    let chunk = |chunk: usize| {
        let sums = bonds.gradient_sums(displacement, chunk)?;
        let sites = chunk_range(chunk, bonds.sites());
        let [from, to] =
            [sites.start, sites.end].map(|end| particles.partition_point(|&s| (s as usize) < end));
        Some(particles[from..to].iter().map(|&site| gradient(&sums[site as usize - sites.start])).collect())
    };
    let chunks: Vec<Option<Vec<StressTensor<D>>>> = parallel::map(bonds.sites().div_ceil(CHUNK), chunk);
    let chunks: Option<Vec<Vec<StressTensor<D>>>> = chunks.into_iter().collect();
    if let Some(chunks) = chunks {
        return chunks.concat();
    }
    parallel::map_each(particles, |&site| deformation_gradient(bonds, displacement, site as usize))
}

/// Computes the nonlocal deformation gradient of one particle, as [`deformation_gradients`].
pub fn deformation_gradient<const D: usize>(
    bonds: &(impl BodyGeometry<D> + ?Sized),
    displacement: &Field<D>,
    site: usize,
) -> StressTensor<D> {
    let own = displacement.get(site);
    let (mut shape, mut change) = ([[0.0; D]; D], [[0.0; D]; D]);
    bonds.neighbours(site, &mut |bond| {
        let other = displacement.get(bond.site);
        let weight = bond.volume / (bond.length * bond.length);
        for a in 0..D {
            for b in 0..D {
                shape[a][b] += weight * bond.bond[a] * bond.bond[b];
                change[a][b] += weight * (other[a] - own[a]) * bond.bond[b];
            }
        }
    });
    gradient(&GradientSums { shape, change })
}

/// Computes 1 + change·shape⁻¹; the identity if there is no inverse.
fn gradient<const D: usize>(sums: &GradientSums<D>) -> StressTensor<D> {
    let matrix = |t: &StressTensor<D>| nalgebra::SMatrix::<f64, D, D>::from_fn(|a, b| t[a][b]);
    let shape = matrix(&sums.shape);
    let mut gradient: StressTensor<D> =
        std::array::from_fn(|a| std::array::from_fn(|b| f64::from(u8::from(a == b))));
    let singular = determinant::<D>(|a, b| shape[(a, b)]).abs() <= 1e-9 * shape.trace().powi(D as i32);
    if let Some(inverse) = shape.try_inverse().filter(|_| !singular) {
        let change = matrix(&sums.change) * inverse;
        for a in 0..D {
            for b in 0..D {
                gradient[a][b] += change[(a, b)];
            }
        }
    }
    gradient
}

/// Computes the Cauchy stress σ = P Fᵀ/J, Eq. (2.32), particle by particle.
pub fn cauchy<const D: usize>(
    piola: &[StressTensor<D>],
    gradients: &[StressTensor<D>],
) -> Vec<StressTensor<D>> {
    let one = |particle: usize| -> StressTensor<D> {
        let (p, f) = (piola[particle], gradients[particle]);
        let jacobian = determinant::<D>(|a, b| f[a][b]);
        // an inverted family has no Cauchy stress; its nominal stress replaces it
        if jacobian <= 0.0 {
            return p;
        }
        std::array::from_fn(|a| {
            std::array::from_fn(|b| (0..D).map(|c| p[a][c] * f[b][c]).sum::<f64>() / jacobian)
        })
    };
    parallel::map(piola.len(), one)
}

/// Determinant of a D × D matrix, embedded in three dimensions.
fn determinant<const D: usize>(entry: impl Fn(usize, usize) -> f64) -> f64 {
    let identity = |a, b| f64::from(u8::from(a == b));
    nalgebra::Matrix3::from_fn(|a, b| if a < D && b < D { entry(a, b) } else { identity(a, b) }).determinant()
}

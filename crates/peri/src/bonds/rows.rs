//! Builds kernel rows of a compiled size from a fitted law, once per scene.

use super::cloud_kernel::{CloudData, CloudPass};
use super::kernel::dispatch;
use super::lattice_kernel::{LatticePass, StencilRow, Tiles};
use super::real::KernelReal;
use crate::potential::{KernelFit, StretchRange};
use std::any::Any;

/// A bond of the stencil: its distance in sites, ξ, and its stiffness 2kθ w V/|ξ|.
#[derive(Clone, Copy, Debug)]
pub struct StencilBond<const D: usize> {
    /// Distance to the neighbour in sites.
    pub shift: isize,
    /// Reference bond.
    pub bond: [f64; D],
    /// 2kθ w V/|ξ|.
    pub stiffness: f64,
}

/// A lattice kernel with its law in place.
pub trait LatticeKernel<const D: usize, T = f64>: Send + Sync {
    /// Runs [`super::kernel::ForceKernel::run`]; `tiles` in the unit of length of the stencil.
    fn run(
        &self,
        tiles: &Tiles<D, T>,
        start: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    );
}

/// A cloud kernel with its law in place.
pub trait CloudKernel<const D: usize>: Send + Sync {
    /// Runs [`super::kernel::ForceKernel::run`].
    fn run(
        &self,
        data: &CloudData<D>,
        start: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    );
}

struct LatticeRows<T, const D: usize, const P: usize, const Q: usize> {
    rows: Vec<StencilRow<T, D, P, Q>>,
    unit: f64,
}

impl<T: KernelReal, const D: usize, const P: usize, const Q: usize> LatticeKernel<D, T>
    for LatticeRows<T, D, P, Q>
{
    fn run(
        &self,
        tiles: &Tiles<D, T>,
        start: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    ) {
        dispatch(LatticePass { rows: &self.rows, tiles, unit: self.unit }, start, force, track);
    }
}

struct CompiledCloudLaw<const P: usize, const Q: usize>((f64, [f64; P], [f64; Q]), [f64; 2]);

impl<const D: usize, const P: usize, const Q: usize> CloudKernel<D> for CompiledCloudLaw<P, Q> {
    fn run(
        &self,
        data: &CloudData<D>,
        start: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    ) {
        dispatch(CloudPass { data, law: self.0, clamp: self.1 }, start, force, track);
    }
}

/// q(e) = constant + e·M(e)/(1 + Σ bₖ eᵏ⁺¹), the form of all kernels.
pub struct Rational {
    /// Least and greatest e, beyond which q is constant.
    pub clamp: [f64; 2],
    /// q(0).
    pub constant: f64,
    /// Coefficients of M.
    pub numerator: Vec<f64>,
    /// b.
    pub denominator: Vec<f64>,
}

impl Rational {
    /// Form of a fitted law; `None` for a table.
    pub fn new(fit: &KernelFit) -> Option<Self> {
        let KernelFit { numerator, denominator, stress_free, .. } = fit;
        if numerator.is_empty() {
            return None;
        }
        let denominator = denominator.clone();
        if *stress_free {
            return Some(Self { clamp: fit.clamp, constant: 0.0, numerator: numerator.clone(), denominator });
        }
        // N/D = q₀ + e·M/D with M = (N − q₀ D)/e
        let constant = numerator[0];
        let length = (numerator.len() - 1).max(denominator.len()).max(1);
        let at = |list: &[f64], k: usize| list.get(k).copied().unwrap_or(0.0);
        let numerator = (0..length).map(|k| at(numerator, k + 1) - constant * at(&denominator, k)).collect();
        Some(Self { clamp: fit.clamp, constant, numerator, denominator })
    }
}

/// Law of a bond of the stencil: coefficients in E = |ξ|² e, times the bond's stiffness; see [`StencilRow`].
struct ScaledLaw {
    /// 1/|ξ|².
    inverse_square: f64,
    /// Ends of the law in E.
    clamp: [f64; 2],
    /// Value at E = 0.
    constant: f64,
    /// Scaled numerator.
    numerator: Vec<f64>,
    /// Scaled denominator beyond its leading 1.
    denominator: Vec<f64>,
}

impl Rational {
    fn scaled<const D: usize>(&self, bond: &StencilBond<D>) -> ScaledLaw {
        let inverse_square = 1.0 / bond.bond.iter().map(|x| x * x).sum::<f64>();
        let scale = |k: usize| inverse_square.powi(k as i32 + 1);
        let times = |list: &[f64], factor: &dyn Fn(usize) -> f64| {
            list.iter().enumerate().map(|(k, v)| v * factor(k)).collect()
        };
        ScaledLaw {
            inverse_square,
            clamp: self.clamp.map(|e| e / inverse_square),
            constant: self.constant * bond.stiffness,
            numerator: times(&self.numerator, &|k| bond.stiffness * scale(k)),
            denominator: times(&self.denominator, &scale),
        }
    }
}

fn padded<T: KernelReal, const N: usize>(values: &[f64]) -> [T; N] {
    std::array::from_fn(|k| T::from_f64(values.get(k).copied().unwrap_or(0.0)))
}

/// Compiled sizes (numerator, denominator); a fit is padded with zeros to the first that holds it, which
/// changes no bit. Each size takes time to compile: clouds, which wait for memory, and laws fitted
/// to 1e-6 for single precision have fewer.
macro_rules! for_size {
    ($d:literal, $rational:expr, $make:ident $arguments:tt) => {
        for_size!(@try $d, $rational, $make $arguments;
            (4, 0) (6, 0) (8, 0) (10, 0) (12, 0) (4, 4) (5, 5) (7, 6) (9, 8) (11, 10))
    };
    (cloud $d:literal, $rational:expr, $make:ident $arguments:tt) => {
        for_size!(@try $d, $rational, $make $arguments; (6, 0) (8, 0) (12, 0) (5, 5) (8, 7) (11, 10))
    };
    (single $d:literal, $rational:expr, $make:ident $arguments:tt) => {
        for_size!(@try $d, $rational, $make $arguments; (4, 0) (6, 0) (8, 0) (12, 0) (5, 5) (11, 10))
    };
    (@try $d:literal, $rational:expr, $make:ident $arguments:tt; $(($p:literal, $q:literal))*) => {{
        $(if $rational.numerator.len() <= $p && $rational.denominator.len() <= $q {
            return Some($make::<$d, $p, $q> $arguments);
        })*
        None
    }};
}

/// Builds the lattice kernel of a fitted law; `None` if the law is a table or exceeds all compiled sizes.
pub fn lattice_kernel<const D: usize>(
    fit: &KernelFit,
    stencil: &[StencilBond<D>],
) -> Option<Box<dyn LatticeKernel<D>>> {
    let (rational, stencil) = (Rational::new(fit)?, stencil.to_vec());
    if D == 2 {
        same(plane_lattice(&rational, same(stencil)?)?)
    } else {
        same(solid_lattice(&rational, same(stencil)?)?)
    }
}

/// Builds the lattice kernel in single precision, for displacements over `spacing`.
pub fn single_kernel<const D: usize>(
    fit: &KernelFit,
    stencil: &[StencilBond<D>],
    spacing: f64,
) -> Option<Box<dyn LatticeKernel<D, f32>>> {
    let stiffest = stencil.iter().map(|bond| bond.stiffness.abs()).fold(f64::MIN_POSITIVE, f64::max);
    let scaled = |bond: &StencilBond<D>| StencilBond {
        shift: bond.shift,
        bond: bond.bond.map(|x| x / spacing),
        stiffness: bond.stiffness / stiffest,
    };
    let (rational, unit) = (Rational::new(fit)?, stiffest * spacing);
    let stencil: Vec<StencilBond<D>> = stencil.iter().map(scaled).collect();
    if D == 2 {
        same(plane_single(&rational, same(stencil)?, unit)?)
    } else {
        same(solid_single(&rational, same(stencil)?, unit)?)
    }
}

/// Builds the cloud kernel of a fitted law; `None` as in [`lattice_kernel`].
pub fn cloud_kernel<const D: usize>(fit: &KernelFit) -> Option<Box<dyn CloudKernel<D>>> {
    let rational = Rational::new(fit)?;
    if D == 2 { same(plane_cloud(&rational)?) } else { same(solid_cloud(&rational)?) }
}

// these six are not generic, so that the kernels are compiled in this crate only

fn plane_lattice(law: &Rational, stencil: Vec<StencilBond<2>>) -> Option<Box<dyn LatticeKernel<2>>> {
    for_size!(2, law, double_rows(law, &stencil))
}

fn solid_lattice(law: &Rational, stencil: Vec<StencilBond<3>>) -> Option<Box<dyn LatticeKernel<3>>> {
    for_size!(3, law, double_rows(law, &stencil))
}

fn plane_single(
    law: &Rational,
    stencil: Vec<StencilBond<2>>,
    unit: f64,
) -> Option<Box<dyn LatticeKernel<2, f32>>> {
    for_size!(single 2, law, single_rows(law, &stencil, unit))
}

fn solid_single(
    law: &Rational,
    stencil: Vec<StencilBond<3>>,
    unit: f64,
) -> Option<Box<dyn LatticeKernel<3, f32>>> {
    for_size!(single 3, law, single_rows(law, &stencil, unit))
}

fn plane_cloud(law: &Rational) -> Option<Box<dyn CloudKernel<2>>> {
    for_size!(cloud 2, law, cloud_law(law))
}

fn solid_cloud(law: &Rational) -> Option<Box<dyn CloudKernel<3>>> {
    for_size!(cloud 3, law, cloud_law(law))
}

/// Converts a value to the same type under another name: `X<D>` is `X<2>` if D = 2.
fn same<A: 'static, B: 'static>(value: A) -> Option<B> {
    let mut value = Some(value);
    (&mut value as &mut dyn Any).downcast_mut::<Option<B>>()?.take()
}

fn lattice_rows<T: KernelReal, const D: usize, const P: usize, const Q: usize>(
    law: &Rational,
    stencil: &[StencilBond<D>],
    unit: f64,
) -> Box<dyn LatticeKernel<D, T>> {
    let row = |bond: &StencilBond<D>| {
        let scaled = law.scaled(bond);
        StencilRow {
            shift: bond.shift,
            bond: bond.bond.map(T::from_f64),
            inverse_square: T::from_f64(scaled.inverse_square),
            clamp: scaled.clamp.map(T::from_f64),
            constant: T::from_f64(scaled.constant),
            numerator: padded(&scaled.numerator),
            denominator: padded(&scaled.denominator),
        }
    };
    Box::new(LatticeRows::<T, D, P, Q> { rows: stencil.iter().map(row).collect(), unit })
}

fn double_rows<const D: usize, const P: usize, const Q: usize>(
    law: &Rational,
    stencil: &[StencilBond<D>],
) -> Box<dyn LatticeKernel<D>> {
    lattice_rows::<f64, D, P, Q>(law, stencil, 1.0)
}

fn single_rows<const D: usize, const P: usize, const Q: usize>(
    law: &Rational,
    stencil: &[StencilBond<D>],
    unit: f64,
) -> Box<dyn LatticeKernel<D, f32>> {
    lattice_rows::<f32, D, P, Q>(law, stencil, unit)
}

fn cloud_law<const D: usize, const P: usize, const Q: usize>(law: &Rational) -> Box<dyn CloudKernel<D>> {
    let coefficients = (law.constant, padded(&law.numerator), padded(&law.denominator));
    Box::new(CompiledCloudLaw::<P, Q>(coefficients, law.clamp))
}

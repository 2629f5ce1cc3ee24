//! Lattices on a graphics card (feature `gpu`): velocity Verlet and equilibria, with bonds that break.
//!
//! A [`Device`] is a card, or a program that stands for one; [`DeviceBody`] is a lattice on it, with the
//! stencil, the fitted law and the bits of intact bonds of the host's kernel (see
//! [`crate::potential::KernelFit`]). The kernels are written once, in Rust, and compiled for the device when
//! they first run ([`cubecl`](https://docs.rs/cubecl)). Lengths are in spacings there and velocities in
//! spacings a step, so that nothing leaves the range of single precision; stretches come from differences of
//! displacements.
//!
//! [`VelocityVerlet::solve_on`](crate::solver::VelocityVerlet::solve_on) takes the steps of a
//! [`System`](crate::solver::System) on a device: the host decides as it does without one, from sums of each
//! step, and fetches fields for rows of the history only.

mod body;
mod bond_kernels;
mod driven;
mod kernels;
mod lbfgs;
mod lbfgs_kernels;
mod list_kernels;
mod pair_kernels;
mod pairs;
mod plane_kernels;
mod planes;
mod relaxation;
mod relaxation_kernels;
mod steps;
mod stress;
mod stress_kernels;

pub use body::{DeviceBody, DeviceLoads, MOST_STEPS};
pub use driven::DrivenSites;
pub use lbfgs::{DeviceLineSums, DeviceSearch};
pub use relaxation::{DeviceRelaxation, RelaxationSums};
pub use steps::{DeviceStep, ListedBond, StepSums};
pub use stress::piolas;

use crate::error::Error;
use cubecl::client::Client;
use cubecl::device::{DeviceUnavailable, WgpuDeviceKind};
use cubecl::ir::{ElemType, FloatKind};

/// The floating-point numbers that kernels compute with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// 32 bits.
    Single,
    /// 64 bits.
    Double,
}

impl Precision {
    /// Distance of 1 from the next larger number.
    pub fn epsilon(self) -> f64 {
        match self {
            Self::Single => f64::from(f32::EPSILON),
            Self::Double => f64::EPSILON,
        }
    }

    fn element(self) -> ElemType {
        ElemType::Float(match self {
            Self::Single => FloatKind::F32,
            Self::Double => FloatKind::F64,
        })
    }

    fn bytes(self) -> u64 {
        self.element().size() as u64
    }
}

/// A device that kernels run on.
pub struct Device {
    client: Client,
    precision: Precision,
}

impl Device {
    /// A card behind Vulkan, Metal or DirectX 12, the fastest there is; where there is no card, a program
    /// that stands for one (Mesa's lavapipe). `CUBECL_WGPU_DEFAULT_DEVICE` names another one:
    /// `DiscreteGpu(1)`, `Cpu`.
    ///
    /// # Errors
    /// [`Error::Device`] where this machine has none.
    pub fn portable() -> Result<Self, Error> {
        Self::open(cubecl::Device::wgpu(WgpuDeviceKind::default()))
    }

    /// The card that CUDA counts as `index`, in programs that depend on `cubecl` with its feature `cuda`:
    /// this crate does not turn it on, as its build downloads a compiler from GitHub.
    ///
    /// # Errors
    /// [`Error::Device`] where this machine has none, or this build no CUDA.
    pub fn cuda(index: usize) -> Result<Self, Error> {
        Self::open(cubecl::Device::cuda(index))
    }

    fn open(named: Result<cubecl::Device, DeviceUnavailable>) -> Result<Self, Error> {
        let client = named.map_err(|error| Error::Device(error.to_string()))?.client();
        let double = client.features().supports_type(Precision::Double.element());
        let precision = if double { Precision::Double } else { Precision::Single };
        Ok(Self { client, precision })
    }

    /// True for a card, false for a program that stands for one.
    pub fn is_card(&self) -> bool {
        self.client.properties().identity.physical.is_some()
    }

    /// Name that the device gives itself.
    pub fn name(&self) -> &str {
        &self.client.properties().identity.name
    }

    /// Bytes that a buffer may have: a field of a body, of D numbers a site, must fit into one. At most 4
    /// GiB, as kernels count in 32 bits.
    pub fn largest_buffer(&self) -> u64 {
        self.client.properties().memory.max_page_size.min(1 << 32)
    }

    /// The numbers that kernels compute with: double where the device has them.
    pub fn precision(&self) -> Precision {
        self.precision
    }

    /// Computes with these numbers.
    ///
    /// # Errors
    /// [`Error::Device`] for double precision on a device without it.
    pub fn with_precision(self, precision: Precision) -> Result<Self, Error> {
        if self.client.features().supports_type(precision.element()) {
            return Ok(Self { precision, ..self });
        }
        Err(Error::Device(format!("{} does not compute in {precision:?} precision", self.name())))
    }
}

//! Device and precision that a scene names: in `[dynamics]` for explicit dynamics, in `[solver]` for
//! equilibria.

use super::{Dynamics, Scene, SolverMethod};
use harness::scene::{SceneError, Source};
use serde::Deserialize;

/// Device that takes the steps of explicit dynamics, or the iterations towards equilibria.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DeviceChoice {
    /// The processor.
    #[default]
    Cpu,
    /// A graphics card: a lattice of one bond law, without friction and prestrains.
    Gpu,
    /// A graphics card where there is one that can do it and the body is large enough to gain by it, the
    /// processor otherwise.
    Auto,
}

impl DeviceChoice {
    /// Name in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cpu => "cpu",
            Self::Gpu => "gpu",
            Self::Auto => "auto",
        }
    }
}

/// Precision of bond forces on a lattice; everything else is in double precision, but on a graphics card in
/// single precision.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ForcePrecision {
    /// Double precision.
    #[default]
    Double,
    /// Single precision for bonds, double precision for the sums of their forces; the report has the error,
    /// `mixed_error`. Double precision while stretches are so extreme that single precision would miss the
    /// law by more than 1e-5.
    Mixed,
    /// Single precision throughout, on a graphics card.
    Single,
}

impl Scene {
    /// Returns the device, its precision, and the block of their keys.
    pub fn device(&self) -> (DeviceChoice, ForcePrecision, &'static str) {
        match &self.dynamics {
            Some(Dynamics { device, precision, .. }) => (*device, *precision, "dynamics"),
            None => {
                let (device, precision) = (self.solver.device, self.solver.precision);
                (device.unwrap_or_default(), precision.unwrap_or_default(), "solver")
            }
        }
    }
}

/// Checks device and precision.
///
/// # Errors
/// Keys in the wrong block, and a precision that the device does not have.
pub fn check(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    let own = [("device", scene.solver.device.is_some()), ("precision", scene.solver.precision.is_some())];
    if let Some((key, _)) = own.iter().find(|(_, given)| *given && scene.method() == SolverMethod::Verlet) {
        let why = format!("explicit dynamics has `{key}` in [dynamics]; here it is for `adr` and `lbfgs`");
        return Err(source.unexpected(&format!("solver.{key}"), why));
    }
    let (device, precision, block) = scene.device();
    let found = match (device, precision, block) {
        (_, ForcePrecision::Mixed, "solver") => "\"mixed\" for equilibria",
        (DeviceChoice::Cpu, ForcePrecision::Single, _) => "\"single\" on the processor",
        (DeviceChoice::Gpu, ForcePrecision::Mixed, _) => "\"mixed\" on a graphics card",
        _ => return Ok(()),
    };
    let allowed = match (device, block) {
        (DeviceChoice::Cpu, "dynamics") => "\"double\" or \"mixed\"; \"single\" is for `device = \"gpu\"`",
        (DeviceChoice::Cpu, _) => "\"double\"; \"single\" is for `device = \"gpu\"`",
        _ => "\"double\" or \"single\"",
    };
    Err(source.error(&format!("{block}.precision"), found, allowed))
}

//! The scene of a peridynamic problem, as written in TOML. Only what a scene names is built.

mod body_force;
mod boundary;
mod bridges;
mod build;
mod cells;
mod check;
mod cloud;
mod contact;
mod crack;
mod curve;
mod curve_spec;
mod device;
mod explain;
mod field;
mod followed;
mod formula;
mod grips;
mod inclusion;
mod inclusion_region;
mod indenter;
mod indenter_place;
mod interface;
mod limits;
mod line;
mod loads;
mod memory;
mod mesh_cells;
mod mesh_nodes;
mod mesh_region;
mod mesh_shape;
mod method;
mod network;
mod overlap;
mod part_law;
mod part_solid;
mod parts;
mod periodic;
mod picture_state;
mod placement;
mod planes;
mod pressure;
mod probe;
mod region;
mod rotation;
mod shapes;
mod side_areas;
mod solid;
mod step;
mod surface_curve;
mod tearing;
mod time;
mod traction_field;
mod values;
mod variant;
mod warn;

pub use body_force::{BodyForceSpec, SpinSpec};
pub use boundary::{Boundary, Prescribed, PrescribedField, RotationSpec, Side};
pub use build::{body_of, least_memory};
pub use check::{check, check_variant};
pub use contact::{ContactSpec, PARTICLES, PlaneSpec, tied_grips};
pub use crack::{cuts_of, severed_of_each};
pub use curve::common_amplitude;
pub use curve_spec::{CurveList, CurveSpec, CurveTable};
pub use device::{DeviceChoice, ForcePrecision};
pub use explain::explain;
pub use field::{FieldSpec, VaryingParameter};
pub use followed::{ParameterField, followed};
pub use formula::Formula;
pub use grips::free_lengths;
pub use inclusion::{Inclusion, Inclusions, density_ratios};
pub use indenter::IndenterSpec;
pub use interface::{InterfaceSpec, limits_of_bonds, sliding_bonds};
pub use limits::{LimitOf, limit_error, softening_limits};
pub use line::{LineField, SectionSpec, line_fields};
pub use loads::{loads_of, order_regions, region_names, velocities_of};
pub use memory::needed as memory_needed;
pub use method::{Dynamics, SolverMethod, SolverSpec};
pub use network::{ChemistrySpec, explain_network, resolve_network};
pub use part_law::laws_of_parts;
pub use part_solid::{relative_moduli, solid_of_parts};
pub use periodic::PeriodicSpec;
pub use picture_state::{NamedState, StateSpec};
pub use placement::{check_placement, check_surfaces, exact_plate};
pub use probe::{HistoryProbe, Track};
pub use shapes::{AxisName, ShapeKind, ShapeSpec};
pub use solid::{SolidKind, SolidLaw};
pub use step::{EarlierSteps, StepSpec, step_cuts};
pub use tearing::{explain_tearing, tearing_warnings};
pub use time::{TimeProgramSpec, TimeStep};
pub use values::{DiscreteBody, plain};
pub use variant::{NAMING, SceneVariant, Study, variants};
pub use warn::warnings;

use crate::bonds::VolumeCorrection;
use crate::calibrate::{Calibration, Space};
use crate::critical::{Convention, Critical};
use crate::material::Driving;
use crate::potential::Law;
use crate::stress::{BallVolume, StressMethod};
use harness::report::Expect;
use harness::scene::{LineSpec, SolidSpec};
use harness::study::{Compare, Comparisons, Convergence, ErrorAgainstTime};
use polycore::units::{Length, Stress};
use serde::Deserialize;
use std::path::PathBuf;

/// A whole scene.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// The program that runs it: `peri`.
    pub program: Program,
    /// Title for tables and pictures.
    #[serde(default)]
    pub title: String,
    /// Geometry and discretisation.
    pub body: BodySpec,
    /// Sides beyond which the body repeats itself.
    pub periodic: Option<PeriodicSpec>,
    /// Bond law.
    pub material: Material,
    /// Interfaces between parts of the body.
    #[serde(default)]
    pub interface: Vec<InterfaceSpec>,
    /// Loads and supports.
    #[serde(default)]
    pub boundary: Vec<Boundary>,
    /// Gravity, centrifugal and other body forces.
    #[serde(default)]
    pub body_force: Vec<BodyForceSpec>,
    /// Solver settings.
    #[serde(default)]
    pub solver: SolverSpec,
    /// Ramps and holds of a quasi-static run in time, for a solid with branches or softening, or curves.
    pub time: Option<TimeProgramSpec>,
    /// Density and times of explicit dynamics.
    pub dynamics: Option<Dynamics>,
    /// Later steps, each from the state at the end of the one before.
    #[serde(default)]
    pub step: Vec<StepSpec>,
    /// True for the scene of a later step, see [`Scene::stage`].
    #[serde(skip)]
    pub later: bool,
    /// Steps before this one.
    #[serde(skip)]
    pub earlier: EarlierSteps,
    /// Repulsion of particles without a bond, friction, rigid planes and indenters; default: none.
    pub contact: Option<ContactSpec>,
    /// Quantities recorded in every row of the history.
    #[serde(default)]
    pub probe: Vec<HistoryProbe>,
    /// Stress output; without it no stress is computed.
    pub stress: Option<StressSpec>,
    /// A closed-form solution to compare with.
    pub exact: Option<ExactSpec>,
    /// Files to write.
    #[serde(default)]
    pub output: OutputFiles,
    /// Variants to run instead of the scene's own discretisation.
    #[serde(default)]
    pub study: Vec<Study>,
    /// Limits and orders of quantities over variants.
    #[serde(default)]
    pub convergence: Vec<Convergence>,
    /// Error against run time over variants.
    #[serde(default)]
    pub error_against_time: Vec<ErrorAgainstTime>,
    /// Expected results.
    #[serde(default)]
    pub expect: Vec<Expect>,
}

/// The only program that runs these scenes.
#[derive(Clone, Copy, Debug, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Program {
    /// Program of this crate.
    Peri,
}

/// Geometry: shapes on a regular lattice, or points from a file.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodySpec {
    /// `plane-stress`, `plane-strain` or `solid`.
    pub space: Space,
    /// Thickness of a plane body.
    pub thickness: Option<Length>,
    /// Distance of neighbouring particles, with `shapes`.
    pub spacing: Option<Length>,
    /// Horizon over spacing, m = δ/Δx, with `shapes`.
    pub horizon_ratio: Option<f64>,
    /// Horizon, with `points` or `grid`.
    pub horizon: Option<Length>,
    /// Shapes added and cut in order.
    pub shapes: Option<Vec<ShapeSpec>>,
    /// CSV file with the columns x, y(, z) in m and volume in m³, or a mesh file: a point for each cell.
    pub points: Option<PathBuf>,
    /// Length of one unit of a mesh file in `points`.
    pub unit: Option<Length>,
    /// A box of cells that may have unequal sides, with `horizon`.
    pub grid: Option<GridSpec>,
    /// Bonds across gaps: between parts that do not touch and across cuts narrower than the horizon. Default:
    /// false; for points without a lattice: true.
    pub bond_gaps: Option<bool>,
    /// Cracks of zero width.
    #[serde(default)]
    pub cracks: Vec<CrackSpec>,
}

/// A box of equal cells, a particle in the middle of each.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GridSpec {
    /// Lower corner.
    pub min: Vec<Length>,
    /// Upper corner.
    pub max: Vec<Length>,
    /// Cells along each axis.
    pub cells: Vec<usize>,
}

impl BodySpec {
    /// Returns true for a body of points instead of shapes.
    pub fn has_points(&self) -> bool {
        self.points.is_some() || self.grid.is_some()
    }

    /// Returns the shapes; none for a body of points.
    pub fn shapes(&self) -> &[ShapeSpec] {
        self.shapes.as_deref().unwrap_or_default()
    }
}

/// Default horizon over spacing, as in the thesis.
pub const HORIZON_RATIO: f64 = 3.015;

/// Crack of zero width: the segment `from`–`to` in 2D; in 3D a parallelogram with the corner `from` and its
/// neighbours `to` and `and`.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CrackSpec {
    /// First corner.
    pub from: Vec<Length>,
    /// A neighbouring corner.
    pub to: Vec<Length>,
    /// The other neighbouring corner, in 3D.
    pub and: Option<Vec<Length>>,
}

/// The bond law and its constants, or a solid.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Chemistry of the network, from which modulus and links follow.
    pub network: Option<ChemistrySpec>,
    /// Young's modulus E of a bond law; ν follows from the space.
    pub youngs_modulus: Option<Stress>,
    /// Bond law; default: `chain-offset`.
    pub law: Option<Law>,
    /// Solid with any Poisson ratio, in place of a bond law.
    pub solid: Option<SolidLaw>,
    /// Links per bond n̄, for the chain laws.
    pub links: Option<f64>,
    /// Dissociation energy over kθ, D̂, for the chain laws.
    pub dissociation: Option<f64>,
    /// Scales kθ so that the small-strain modulus is exact; default by law.
    pub rescale: Option<bool>,
    /// Calibration of kθ, from integrals of the continuum or sums of the lattice.
    #[serde(default)]
    pub calibration: Calibration,
    /// Correction of volumes near the horizon.
    #[serde(default)]
    pub volume_correction: VolumeCorrection,
    /// Correction of bonds near free surfaces.
    #[serde(default)]
    pub surface_correction: SurfaceCorrection,
    /// Critical stretch, beyond which bonds break; default: no bond breaks.
    pub critical: Option<Critical>,
    /// Shapes whose particles keep all their bonds, whatever the limits: guard zones about grips and loads.
    #[serde(default)]
    pub unbreakable: Vec<ShapeSpec>,
    /// Parts of the body that are stiffer or softer.
    #[serde(default)]
    pub inclusions: Vec<Inclusion>,
    /// Parameters that follow fields of other scenes.
    #[serde(default)]
    pub fields: Vec<FieldSpec>,
}

/// Stiffening of bonds near free surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SurfaceCorrection {
    /// No correction, as in the thesis.
    #[default]
    None,
    /// Factors with which a homogeneous strain stores the energy of the continuum (Madenci & Oterkus).
    Energy,
}

/// Stress output.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StressSpec {
    /// Measures to compute; the first is drawn.
    pub measures: Vec<StressMethod>,
    /// Volume of the averaging ball of `ball-share`.
    #[serde(default)]
    pub ball: BallVolume,
    /// Stress component in pictures of stages, e.g. `22`; default: the largest principal stress, in a plane
    /// body in its plane.
    pub component: Option<String>,
}

impl StressSpec {
    /// Returns the row and the column of the component, from 0.
    pub fn component(&self) -> Option<[usize; 2]> {
        let digits: Vec<usize> =
            self.component.as_ref()?.chars().map(|c| c.to_digit(10).map_or(9, |d| d as usize)).collect();
        match digits[..] {
            [a @ 1..=3, b @ 1..=3] => Some([a - 1, b - 1]),
            _ => None,
        }
    }
}

/// Closed-form solutions.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(tag = "problem", rename_all = "kebab-case", deny_unknown_fields)]
pub enum ExactSpec {
    /// Circular hole at the origin in a plate under remote tension along x, Eqs (2.81)–(2.83).
    Kirsch {
        /// Radius of the hole.
        radius: Length,
        /// Remote stress.
        remote_stress: Stress,
    },
    /// Circular hole in the body's own rectangle, by [`crate::exact::Plate`]: free hole, tractions
    /// `remote_stress` in the layers of the sides x+ and x−.
    PlateWithHole {
        /// Radius of the hole.
        radius: Length,
        /// Traction on the sides.
        remote_stress: Stress,
    },
}

impl ExactSpec {
    /// Returns the radius of the hole, m, and the remote stress, Pa.
    pub fn hole(&self) -> (f64, f64) {
        let (Self::Kirsch { radius, remote_stress } | Self::PlateWithHole { radius, remote_stress }) = self;
        (radius.si(), remote_stress.si())
    }

    /// Returns the name in scenes.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Kirsch { .. } => "kirsch",
            Self::PlateWithHole { .. } => "plate-with-hole",
        }
    }

    /// Returns the names of the errors of a measure, as in `MEASURE_rmse`.
    pub fn errors(&self) -> &'static [&'static str] {
        match self {
            Self::Kirsch { .. } => &["rmse", "rmse_inner"],
            Self::PlateWithHole { .. } => {
                &["rmse", "rmse_inner", "rmse_bulk", "rmse_ring", "rmse_kirsch", "rmse_inner_kirsch"]
            }
        }
    }
}

/// Kind of an animation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Animation {
    /// GIF.
    Gif,
    /// MP4, by `ffmpeg`; a GIF where there is none.
    Mp4,
}

impl Animation {
    /// Returns the extension of its file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gif => "gif",
            Self::Mp4 => "mp4",
        }
    }
}

/// Files to write beside the report.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OutputFiles {
    /// Pictures (PNG).
    pub pictures: bool,
    /// Fields as VTKHDF.
    pub fields: bool,
    /// Interval of steps at which fields are written, also in every step in which bonds break; default: only
    /// the end.
    pub every: Option<usize>,
    /// Animation of the fields of all written steps; needs `fields` and `every`.
    pub animation: Option<Animation>,
    /// Number of stages in pictures, from the last intact state to the end; needs `every`.
    pub stages: usize,
    /// View of a solid in pictures.
    pub solid: Option<SolidSpec>,
    /// Writes where a learnt law is uncertain, as a field and in pictures.
    pub flags: bool,
    /// Writes the energy density of particles, as a field and in pictures.
    pub energy: bool,
    /// Writes pressure and shear of rigid planes and indenters on the body, as fields, tables and pictures.
    pub contact: bool,
    /// Displacements at which the report has the load, as `load_at_20mm`.
    pub load_at: Vec<Length>,
    /// Displacements at which the report has the stiffness, as `secant_stiffness_at_2mm`.
    pub stiffness_at: Vec<Length>,
    /// Adds the integrals of Appendix A over the horizon, by quadrature, to the report.
    pub integrals: bool,
    /// Reference for the variants.
    pub compare: Option<Compare>,
    /// Lines along which fields are written at the end.
    pub line: Vec<LineSpec>,
    /// Planes whose transmitted force is written in every row of the history.
    pub section: Vec<SectionSpec>,
    /// States at which the pictures of the end are drawn as well.
    pub state: Vec<StateSpec>,
}

impl Default for OutputFiles {
    fn default() -> Self {
        Self {
            pictures: true,
            fields: true,
            every: None,
            animation: None,
            stages: 5,
            solid: None,
            flags: false,
            energy: false,
            contact: false,
            load_at: Vec::new(),
            stiffness_at: Vec::new(),
            integrals: false,
            compare: None,
            line: Vec::new(),
            section: Vec::new(),
            state: Vec::new(),
        }
    }
}

/// Returns the JSON Schema of scenes.
pub fn schema() -> serde_json::Value {
    harness::scene::schema("peri", crate::program::quantities::ALL, |generator| {
        vec![generator.subschema_for::<Scene>()]
    })
}

impl Scene {
    /// Returns the comparisons of its variants.
    pub fn comparisons(&self) -> Comparisons<'_> {
        Comparisons { convergence: &self.convergence, curves: &self.error_against_time }
    }

    /// Returns true if forces are prescribed.
    pub fn has_forces(&self) -> bool {
        !self.body_force.is_empty() || self.boundary.iter().any(Boundary::prescribes_force)
    }

    /// Returns true if outputs need forces, stresses, energies or flags.
    pub fn observes_forces(&self) -> bool {
        let j_integral = self.probe.iter().any(|probe| probe.track == Track::JIntegral);
        let traced = self.stress.is_some() || !self.output.section.is_empty() || self.periodic.is_some();
        traced || j_integral || self.output.energy || self.is_learnt()
    }

    /// Returns the energy that drives breaking.
    pub fn driving(&self) -> Driving {
        self.material.critical.and_then(|critical| critical.driving).unwrap_or_default()
    }

    /// Returns true if bonds soften before they break.
    pub fn softens(&self) -> bool {
        self.convention() == Some(Convention::Softening)
    }
}

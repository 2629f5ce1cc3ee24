//! Shapes of a scene: those of the body, of regions and of inclusions.

use super::mesh_shape::{mesh_shape, polygon};
use super::values::{ONE_OF_THEM, check_order, required, vector};
use crate::geometry::{Operation, Shape};
use harness::scene::{SceneError, Source};
use polycore::units::Length;
use serde::Deserialize;
use std::path::PathBuf;

/// Shape; its kind determines the lengths that it needs.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShapeSpec {
    /// Kind of an added shape.
    pub add: Option<ShapeKind>,
    /// Kind of a shape that is cut out.
    pub cut: Option<ShapeKind>,
    /// Lower corner of a box.
    pub min: Option<Vec<Length>>,
    /// Upper corner of a box.
    pub max: Option<Vec<Length>>,
    /// Centre of a disk, ball or cylinder.
    pub centre: Option<Vec<Length>>,
    /// Radius of a disk, ball or cylinder.
    pub radius: Option<Length>,
    /// Length of a cylinder.
    pub length: Option<Length>,
    /// Axis of a cylinder.
    pub axis: Option<AxisName>,
    /// Corners of a polygon, in order.
    pub points: Option<Vec<Vec<Length>>>,
    /// File of a mesh: Gmsh `.msh`, Abaqus or CalculiX `.inp`, VTK `.vtu`, Exodus II `.e`; or a closed
    /// surface, `.stl`, or in a plane body the outline of a drawing, `.dxf`.
    pub file: Option<PathBuf>,
    /// Length of one unit of the file.
    pub unit: Option<Length>,
    /// Cells of the file that form the shape: a physical group of Gmsh, an element set of Abaqus, a block of
    /// Exodus II, the value of an array of VTK (`MaterialIds-2`); default: all.
    pub block: Option<String>,
    /// Layer of a drawing that has the outline; default: all.
    pub layer: Option<String>,
    /// Name of the part to which a shape of the body belongs, default: its `block`; of shapes that overlap,
    /// the last one counts.
    pub part: Option<String>,
}

/// Kinds of shapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ShapeKind {
    /// Axis-parallel box (2D: rectangle).
    Box,
    /// Disk, in 2D.
    Disk,
    /// Ball, in 3D.
    Ball,
    /// Cylinder along an axis, in 3D.
    Cylinder,
    /// Polygon, in 2D.
    Polygon,
    /// Cells of a mesh, or the inside of an STL surface.
    Mesh,
}

impl ShapeKind {
    /// Returns the name in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Disk => "disk",
            Self::Ball => "ball",
            Self::Cylinder => "cylinder",
            Self::Polygon => "polygon",
            Self::Mesh => "mesh",
        }
    }
}

impl ShapeSpec {
    /// Returns the name of the part that it forms.
    pub fn part_name(&self) -> Option<&str> {
        self.part.as_deref().or(self.block.as_deref())
    }
}

/// A coordinate axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum AxisName {
    /// First.
    X,
    /// Second.
    Y,
    /// Third.
    Z,
}

/// Reads the list of shapes under the key `list`.
pub(super) fn operations<const D: usize>(
    source: &Source,
    list: &str,
    shapes: &[ShapeSpec],
) -> Result<Vec<Operation<D>>, SceneError> {
    let each = shapes.iter().enumerate().map(|(index, spec)| {
        let key = format!("{list}[{index}]");
        match (spec.add, spec.cut) {
            (Some(kind), None) => Ok(Operation::Add(shape(source, &key, kind, spec)?)),
            (None, Some(kind)) => Ok(Operation::Cut(shape(source, &key, kind, spec)?)),
            (Some(_), Some(_)) => Err(source.conflict(&format!("{key}.add"), "cut", ONE_OF_THEM)),
            (None, None) => {
                Err(source.missing(&format!("{key}.add"), "needed for a shape: `add` or `cut` with its kind"))
            }
        }
    });
    each.collect()
}

pub(super) fn shape<const D: usize>(
    source: &Source,
    key: &str,
    kind: ShapeKind,
    spec: &ShapeSpec,
) -> Result<Shape<D>, SceneError> {
    let round = matches!(kind, ShapeKind::Disk | ShapeKind::Ball | ShapeKind::Cylinder);
    let given = [
        ("min", spec.min.is_some(), matches!(kind, ShapeKind::Box)),
        ("max", spec.max.is_some(), matches!(kind, ShapeKind::Box)),
        ("centre", spec.centre.is_some(), round),
        ("radius", spec.radius.is_some(), round),
        ("length", spec.length.is_some(), matches!(kind, ShapeKind::Cylinder)),
        ("axis", spec.axis.is_some(), matches!(kind, ShapeKind::Cylinder)),
        ("points", spec.points.is_some(), matches!(kind, ShapeKind::Polygon)),
        ("file", spec.file.is_some(), matches!(kind, ShapeKind::Mesh)),
        ("unit", spec.unit.is_some(), matches!(kind, ShapeKind::Mesh)),
    ];
    for (name, is_given, belongs) in given {
        let path = format!("{key}.{name}");
        if is_given && !belongs {
            return Err(source.unexpected(&path, format!("a {} has no {name}", kind.name())));
        }
        if belongs && !is_given {
            let why = match name {
                "unit" => "the file has none: the length of one unit, e.g. \"1 mm\"".to_owned(),
                _ => format!("needed for a {}", kind.name()),
            };
            return Err(source.missing(&path, why));
        }
    }
    if spec.block.is_some() && kind != ShapeKind::Mesh {
        return Err(source.unexpected(&format!("{key}.block"), format!("a {} has no block", kind.name())));
    }
    if spec.layer.is_some() && kind != ShapeKind::Mesh {
        return Err(source.unexpected(&format!("{key}.layer"), format!("a {} has no layer", kind.name())));
    }
    if spec.part.is_some() && (spec.cut.is_some() || !key.starts_with("body.shapes")) {
        return Err(
            source.unexpected(&format!("{key}.part"), "only shapes that `body.shapes` adds are parts")
        );
    }
    let positive = |name: &str, value: Option<Length>| {
        let path = format!("{key}.{name}");
        let value = required(source, &path, value, "needed for its size")?.si();
        if value > 0.0 { Ok(value) } else { Err(source.error(&path, format!("{value} m"), "above 0")) }
    };
    let point = |name: &str, value: &Option<Vec<Length>>| {
        let path = format!("{key}.{name}");
        vector::<D>(source, &path, value.as_deref().unwrap_or_default())
    };
    match kind {
        ShapeKind::Box => {
            let (min, max) = (point("min", &spec.min)?, point("max", &spec.max)?);
            check_order(source, key, min, max)?;
            Ok(Shape::Box { min, max })
        }
        ShapeKind::Disk | ShapeKind::Ball => {
            if (kind == ShapeKind::Disk) != (D == 2) {
                let allowed = if D == 2 {
                    "`disk`, `box`, `polygon` or `mesh` in a plane body"
                } else {
                    "`ball`, `cylinder`, `box` or `mesh` in a solid"
                };
                return Err(source.error(key, format!("a {}", kind.name()), allowed));
            }
            Ok(Shape::Ball {
                centre: point("centre", &spec.centre)?,
                radius: positive("radius", spec.radius)?,
            })
        }
        ShapeKind::Cylinder => {
            if D != 3 {
                return Err(source.error(
                    key,
                    "a cylinder",
                    "`disk`, `box`, `polygon` or `mesh` in a plane body",
                ));
            }
            let axis = match required(source, &format!("{key}.axis"), spec.axis, "needed for a cylinder")? {
                AxisName::X => 0,
                AxisName::Y => 1,
                AxisName::Z => 2,
            };
            Ok(Shape::Cylinder {
                centre: point("centre", &spec.centre)?,
                radius: positive("radius", spec.radius)?,
                length: positive("length", spec.length)?,
                axis,
            })
        }
        ShapeKind::Polygon => polygon(source, key, spec.points.as_deref().unwrap_or_default()),
        ShapeKind::Mesh => mesh_shape(source, key, spec),
    }
}

//! Outlines of drawings (DXF): closed loops of lines and curves in a plane.

mod curves;
mod joined;
mod pairs;

use dxf::Drawing;
use dxf::entities::{Entity, EntityType};
use dxf::enums::Units;
use std::path::Path;

use crate::error::{Error, check_scale, read_bytes};
use curves::{arc, bulged, ellipse, spline};

/// Closed loops of a drawing. By the even-odd rule, a loop inside of another one is a hole.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// Corners of each loop, m: outer loops anticlockwise, holes clockwise.
    pub loops: Vec<Vec<[f64; 2]>>,
    /// Area inside, m².
    pub area: f64,
    /// Notes for the user.
    pub notes: Vec<String>,
}

/// Points of an entity, in units of the drawing.
struct Chain {
    points: Vec<[f64; 2]>,
    closed: bool,
    /// Kind, handle and layer, for messages.
    name: String,
}

/// Reads the outline of a drawing with coordinates multiplied by `scale`, of one layer or of all: lines,
/// arcs, circles, ellipses, polylines and splines. Curves become segments, 256 a full turn. Ends nearer than
/// 1e-6 of the drawing's size are joined.
///
/// # Errors
/// [`Error::Shared`] for a file that cannot be read; [`Error::Data`] for one that is no drawing, an unknown
/// layer, blocks and entities that do not lie in the plane, open chains, branches, loops that meet, and no
/// loop.
pub fn read(path: &Path, scale: f64, layer: Option<&str>) -> Result<Outline, Error> {
    check_scale(scale)?;
    let wrong = |reason: String| Error::Data { path: path.to_path_buf(), reason };
    let bytes = read_bytes(path)?;
    let written = pairs::count(path, &bytes)?;
    let drawing = Drawing::load(&mut bytes.as_slice())
        .map_err(|error| wrong(format!("found {error}; allowed: a drawing in DXF")))?;
    let own = |entity: &&Entity| layer.is_none_or(|layer| entity.common.layer == layer);
    let visible =
        || drawing.entities().filter(|entity| entity.common.is_visible && !entity.common.is_in_paper_space);
    if let Some(layer) = layer
        && !visible().any(|entity| own(&entity))
    {
        let mut known: Vec<&str> = visible().map(|entity| entity.common.layer.as_str()).collect();
        known.sort_unstable();
        known.dedup();
        return Err(wrong(format!("found no entity on layer `{layer}`; allowed: {}", known.join(", "))));
    }
    let read = drawing.entities().filter(|entity| draws(&entity.specific)).count();
    if read != written {
        return Err(wrong(format!(
            "found {written} lines, curves and blocks, of which {read} can be read; allowed: a whole drawing"
        )));
    }
    let (mut chains, mut others) = (Vec::new(), 0);
    for entity in visible().filter(own) {
        match chain(entity).map_err(wrong)? {
            Some(chain) => chains.push(chain),
            None => others += 1,
        }
    }
    let mut notes = Vec::new();
    if others > 0 {
        notes.push(format!(
            "{others} entities other than lines, arcs, circles, ellipses, polylines and splines are left out"
        ));
    }
    notes.extend(other_unit(drawing.header.default_drawing_units, scale));
    let mut loops = joined::loops(chains).map_err(wrong)?;
    let area = joined::orient(&mut loops) * scale * scale;
    if !(area > 0.0 && area.is_finite()) {
        return Err(wrong(format!("found an area of {area} m²; allowed: above 0, finite")));
    }
    loops.iter_mut().flatten().for_each(|point| *point = point.map(|x| x * scale));
    Ok(Outline { loops, area, notes })
}

/// Returns true for an entity that may draw an outline.
fn draws(entity: &EntityType) -> bool {
    matches!(
        entity,
        EntityType::Line(_)
            | EntityType::Arc(_)
            | EntityType::Circle(_)
            | EntityType::Ellipse(_)
            | EntityType::LwPolyline(_)
            | EntityType::Polyline(_)
            | EntityType::Spline(_)
            | EntityType::Insert(_)
    )
}

/// Converts an entity; `None` for one that draws no outline.
fn chain(entity: &Entity) -> Result<Option<Chain>, String> {
    let name = |kind: &str| {
        format!("{kind} {} on layer `{}`", entity.common.handle.as_string(), entity.common.layer)
    };
    let flat = |kind: &str, normal: &dxf::Vector, heights: &[f64]| {
        let upright = normal.x.abs() < 1e-9 && normal.y.abs() < 1e-9 && normal.z > 0.0;
        let level = heights.iter().all(|z| *z == heights[0]);
        match upright && level {
            true => Ok(()),
            false => Err(format!(
                "found {}, which does not lie in the plane of x and y; allowed: entities at one height, with \
                 an extrusion along z",
                name(kind)
            )),
        }
    };
    let (kind, points, closed) = match &entity.specific {
        EntityType::Line(line) => {
            flat("LINE", &line.extrusion_direction, &[line.p1.z, line.p2.z])?;
            ("LINE", vec![[line.p1.x, line.p1.y], [line.p2.x, line.p2.y]], false)
        }
        EntityType::Circle(circle) => {
            flat("CIRCLE", &circle.normal, &[])?;
            ("CIRCLE", arc([circle.center.x, circle.center.y], circle.radius, [0.0, 360.0]), true)
        }
        EntityType::Arc(own) => {
            flat("ARC", &own.normal, &[])?;
            ("ARC", arc([own.center.x, own.center.y], own.radius, [own.start_angle, own.end_angle]), false)
        }
        EntityType::Ellipse(own) => {
            flat("ELLIPSE", &own.normal, &[own.center.z, own.center.z + own.major_axis.z])?;
            let (points, closed) = ellipse(
                [own.center.x, own.center.y],
                [own.major_axis.x, own.major_axis.y],
                own.minor_axis_ratio,
                [own.start_parameter, own.end_parameter],
            );
            ("ELLIPSE", points, closed)
        }
        EntityType::LwPolyline(own) => {
            flat("LWPOLYLINE", &own.extrusion_direction, &[])?;
            let corners: Vec<([f64; 2], f64)> = own.vertices.iter().map(|v| ([v.x, v.y], v.bulge)).collect();
            ("LWPOLYLINE", bulged(&corners, own.is_closed()), own.is_closed())
        }
        EntityType::Polyline(own) => {
            // control points of a fitted curve are no corners
            let corners = || own.vertices().filter(|vertex| vertex.flags & 16 == 0);
            let heights: Vec<f64> = corners().map(|vertex| vertex.location.z).collect();
            flat("POLYLINE", &own.normal, &heights)?;
            if own.flags & (16 | 64) != 0 {
                return Err(format!("found {}, a mesh of faces; allowed: polylines", name("POLYLINE")));
            }
            let corners: Vec<([f64; 2], f64)> =
                corners().map(|v| ([v.location.x, v.location.y], v.bulge)).collect();
            ("POLYLINE", bulged(&corners, own.is_closed()), own.is_closed())
        }
        EntityType::Spline(own) => {
            let heights: Vec<f64> = own.control_points.iter().map(|point| point.z).collect();
            flat("SPLINE", &dxf::Vector::z_axis(), &heights)?;
            let control: Vec<[f64; 2]> = own.control_points.iter().map(|point| [point.x, point.y]).collect();
            let points = spline(own.degree_of_curve, &own.knot_values, &own.weight_values, &control)
                .ok_or_else(|| {
                    format!(
                        "found {} of degree {} with {} control points and {} knots; allowed: as many knots \
                         as points, one and the degree",
                        name("SPLINE"),
                        own.degree_of_curve,
                        own.control_points.len(),
                        own.knot_values.len()
                    )
                })?;
            ("SPLINE", points, false)
        }
        EntityType::Insert(_) => {
            return Err(format!(
                "found {}, a block; allowed: entities of their own: explode the blocks in the drawing",
                name("INSERT")
            ));
        }
        _ => return Ok(None),
    };
    if points.iter().flatten().any(|x| !x.is_finite()) {
        return Err(format!(
            "found {} with coordinates that are not finite; allowed: finite ones",
            name(kind)
        ));
    }
    if points.len() < 2 {
        return Err(format!("found {} of fewer than two points; allowed: at least two", name(kind)));
    }
    Ok(Some(Chain { points, closed, name: name(kind) }))
}

/// Returns a note if the drawing names another unit than the scene.
fn other_unit(unit: Units, scale: f64) -> Option<String> {
    let (name, size) = match unit {
        Units::Inches => ("inches", 25.4e-3),
        Units::Feet => ("feet", 304.8e-3),
        Units::Millimeters => ("mm", 1e-3),
        Units::Centimeters => ("cm", 1e-2),
        Units::Meters => ("m", 1.0),
        Units::Microns => ("µm", 1e-6),
        _ => return None,
    };
    let differs = (scale / size - 1.0).abs() > 1e-9;
    differs.then(|| format!("the drawing is in {name}, and {} mm are taken for its unit", scale * 1e3))
}

#[cfg(test)]
mod tests;

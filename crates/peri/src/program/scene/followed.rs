//! Computes material parameters of particles from fields of other scenes.

use super::cells::{HexMesh, MeshField};
use super::field::TableEntry;
use super::values::{DiscreteBody, plain, positive};
use super::{FieldSpec, Scene, VaryingParameter};
use crate::bonds::Property;
use harness::output::vtkhdf::{self, Series};
use harness::scene::{SceneError, Source};
use polycore::transfer::{Cuboid, Overlap};
use polycore::units::dimension::{EnergyPerAreaDimension, RatioDimension, StressDimension};
use polycore::units::{Dimension, Quantity, Ratio, Stress, Temperature};
use std::fmt;

/// Distance beyond a table, over its range, that counts as rounding.
const TABLE_TOLERANCE: f64 = 1e-9;
/// Fraction of a particle's volume below which it lies outside the mesh.
const LEAST_COVERED: f64 = 1e-6;

/// Kind of a field, by the unit in the name of its array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FieldKind {
    Number,
    Temperature,
    Stress,
}

impl FieldKind {
    /// Returns the kind of an array and the unit of its values: `temperature_degC`, `crystallinity`.
    fn from_array_name(array: &str) -> (Self, &str) {
        match array.rsplit_once('_') {
            Some((_, unit @ ("degC" | "degF" | "K"))) => (Self::Temperature, unit),
            Some((_, unit @ ("Pa" | "kPa" | "MPa" | "GPa"))) => (Self::Stress, unit),
            _ => (Self::Number, ""),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Number => "a number without a unit",
            Self::Temperature => "a temperature, such as \"160 degC\"",
            Self::Stress => "a stress, such as \"5 MPa\"",
        }
    }

    /// Converts an entry to SI units; `None` for an entry of another kind.
    fn si(self, entry: &TableEntry) -> Option<f64> {
        match (self, entry) {
            (Self::Number, TableEntry::Number(value)) if value.is_finite() => Some(*value),
            (Self::Number, TableEntry::Text(text)) => text.parse::<Ratio>().ok().map(|value| value.si()),
            (Self::Temperature, TableEntry::Text(text)) => text.parse::<Temperature>().ok().map(|t| t.si()),
            (Self::Stress, TableEntry::Text(text)) => text.parse::<Stress>().ok().map(|stress| stress.si()),
            _ => None,
        }
    }

    /// Returns the offset and the factor that convert values of an array to SI units.
    fn scale(self, unit: &str) -> (f64, f64) {
        let si_of = |value: f64| self.si(&TableEntry::Text(format!("{value} {unit}"))).unwrap_or(f64::NAN);
        match self {
            Self::Number => (0.0, 1.0),
            _ => {
                // offset and factor from two temperatures
                let (low, high) = (si_of(100.0), si_of(200.0));
                (low - (high - low), 0.01 * (high - low))
            }
        }
    }

    fn unit(self) -> &'static str {
        match self {
            Self::Number => "",
            Self::Temperature => "K",
            Self::Stress => "Pa",
        }
    }
}

impl VaryingParameter {
    fn si(self, entry: &TableEntry) -> Result<f64, String> {
        let example = match (self, entry) {
            (Self::Prestrain, TableEntry::Number(value)) if value.is_finite() => return Ok(*value),
            (Self::Prestrain, TableEntry::Text(text)) => return in_si::<RatioDimension>(text),
            (Self::Prestrain, _) => return Err("a finite number".to_owned()),
            (Self::YoungsModulus, TableEntry::Text(text)) => return in_si::<StressDimension>(text),
            (Self::FractureEnergy, TableEntry::Text(text)) => return in_si::<EnergyPerAreaDimension>(text),
            (Self::YoungsModulus, _) => "1.6 GPa",
            (Self::FractureEnergy, _) => "5 kJ/m^2",
        };
        Err(format!("a value with a unit, such as \"{example}\""))
    }

    fn unit(self) -> &'static str {
        match self {
            Self::YoungsModulus => "Pa",
            Self::FractureEnergy => "J/m²",
            Self::Prestrain => "",
        }
    }
}

fn in_si<D: Dimension>(text: &str) -> Result<f64, String> {
    text.parse::<Quantity<D>>().map(Quantity::si).map_err(|error| error.to_string())
}

/// Parameter in the particles of a body, and the field that it follows.
#[derive(Clone, Debug)]
pub struct ParameterField {
    /// The parameter.
    pub parameter: VaryingParameter,
    /// Values by site, SI; for a stress tensor, of the mean stress.
    pub values: Property,
    /// Stress by site along the axes of the body while it is held in its shape, Pa; empty for scalar fields.
    pub stress: Vec<[[f64; 3]; 3]>,
    /// Mean, smallest and largest value of the field in the particles, SI.
    pub field: [f64; 3],
    /// Mean of the field over its mesh.
    pub mesh_mean: f64,
    /// Unit of the field.
    pub unit: &'static str,
    array: String,
    input: String,
}

impl fmt::Display for ParameterField {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { parameter, values, field: [_, low, high], array, input, unit, .. } = self;
        let (least, greatest, name) = (values.least(), values.greatest(), parameter.name());
        match self.stress.is_empty() {
            true => write!(f, "{name} {least:.4e} to {greatest:.4e} {}, from ", parameter.unit())?,
            false => write!(f, "{name} of stresses, from ")?,
        }
        write!(f, "`{array}` of `{input}`, {low:.4} to {high:.4} {unit}")
    }
}

/// Computes the parameters of a scene that follow fields.
///
/// # Errors
/// A file that cannot be read, or without the field, step or unit, or without hexahedra; a table that does
/// not increase, or that the field leaves; a body outside the mesh, or where the field is not finite.
pub fn followed<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
) -> Result<Vec<ParameterField>, SceneError> {
    let specs = scene.material.fields.iter().enumerate();
    specs.map(|(index, spec)| spec.follow(source, &format!("material.fields[{index}]"), body)).collect()
}

impl FieldSpec {
    fn follow<const D: usize>(
        &self,
        source: &Source,
        key: &str,
        body: &DiscreteBody<D>,
    ) -> Result<ParameterField, SceneError> {
        let (array, mesh, values) = self.read(source, key)?;
        let (kind, unit) = FieldKind::from_array_name(&array);
        let table = match values.components {
            1 => self.table(source, key, kind, &array)?,
            _ if self.table.is_empty() => Vec::new(),
            _ => {
                let why = "the strain of a stress tensor follows from Young's modulus";
                return Err(source.unexpected(&format!("{key}.table"), why));
            }
        };
        let boxes = self.boxes(source, &format!("{key}.placement"), body, &mesh.points)?;
        let refused = |at: &str, reason: String| source.refused(&format!("{key}.{at}"), reason);
        let overlap = Overlap::new(&mesh.points, &mesh.cells, &boxes)
            .map_err(|error| refused("from.input", error.to_string()))?;
        let bonds = &*body.bonds;
        let place = |index: usize| {
            let position = bonds.position(bonds.particles()[index] as usize);
            let numbers: Vec<String> = position.iter().map(|x| plain((1e9 * x).round() / 1e6)).collect();
            format!("the particle at ({}) mm", numbers.join(", "))
        };
        for (index, own) in boxes.iter().enumerate() {
            if overlap.covered_volume(index) < LEAST_COVERED * own.volume() {
                let reason = format!("{} lies outside of the mesh of `{}`", place(index), self.from.input);
                return Err(refused("placement", format!("{reason}; is it another mesh?")));
            }
            if let Some((at, value)) = values.missing(&mesh, &overlap, index) {
                let at = at.map(|x| (1e9 * x).round() / 1e6);
                let reason =
                    format!("`{array}` is {value} at {at:?} mm of the mesh, where {} lies", place(index));
                return Err(refused("from.field", reason));
            }
        }
        let fault = |error: polycore::Error| refused("from.field", error.to_string());
        let means = values.means(&overlap).map_err(fault)?;
        let (zero, scale) = kind.scale(unit);
        let mut field = Vec::with_capacity(boxes.len());
        let mut parameter = vec![0.0; bonds.sites()];
        let mut stress = vec![[[0.0; 3]; 3]; if values.components == 6 { bonds.sites() } else { 0 }];
        let (mut sum, mut volume) = (0.0, 0.0);
        for index in 0..boxes.len() {
            let component_mean =
                |component: usize| zero + scale * means[component][index].unwrap_or(f64::NAN);
            let value = values.mean_of(component_mean);
            let mapped = match values.components {
                1 => interpolate(&table, value),
                _ => Some(value),
            };
            let Some(mapped) = mapped else {
                let (low, high) = (table[0].0, table[table.len() - 1].0);
                let found = format!("`{array}` of {} {} in {}", plain(value), kind.unit(), place(index));
                let allowed = format!("values of the table, {} to {}", plain(low), plain(high));
                return Err(source.error(&format!("{key}.table"), found, allowed));
            };
            let site = bonds.particles()[index] as usize;
            parameter[site] = mapped;
            if let Some(tensor) = stress.get_mut(site) {
                *tensor = self.along_axes(MeshField::tensor(component_mean));
            }
            sum += bonds.volume(site) * value;
            volume += bonds.volume(site);
            field.push(value);
        }
        let extreme = |better: fn(f64, f64) -> f64| field.iter().copied().reduce(better).unwrap_or(f64::NAN);
        let [mesh_volume, mesh_sum] = values.integral(&mesh).map_err(fault)?;
        Ok(ParameterField {
            parameter: self.of,
            values: Property::new(bonds, |site, _| parameter[site]),
            stress,
            field: [sum / volume, extreme(f64::min), extreme(f64::max)],
            mesh_mean: zero + scale * mesh_sum / mesh_volume,
            unit: kind.unit(),
            array,
            input: self.from.input.clone(),
        })
    }

    /// Reads the array, its mesh and its values.
    fn read(&self, source: &Source, key: &str) -> Result<(String, HexMesh, MeshField), SceneError> {
        let from = &self.from;
        let folder = source.input(&format!("{key}.from.input"), &from.input)?;
        let path = source.file(folder.join(from.file.as_deref().unwrap_or("fields.vtkhdf".as_ref())));
        let refused =
            |at: &str, reason: &dyn fmt::Display| source.refused(&format!("{key}.from.{at}"), reason);
        let series = vtkhdf::read(&path).map_err(|error| refused("input", &error))?;
        let (of_nodes, of_cells) = (series.arrays().iter(), series.cell_arrays().iter());
        // of tensors only stresses, for prestrains
        let fits = |name: &str, n: usize| {
            n == 1
                || (n == 6
                    && self.of == VaryingParameter::Prestrain
                    && FieldKind::from_array_name(name).0 == FieldKind::Stress)
        };
        let arrays: Vec<&str> =
            of_nodes.chain(of_cells).filter(|(name, n)| fits(name, *n)).map(|(name, _)| &**name).collect();
        let named = |array: &&&str| {
            let (_, unit) = FieldKind::from_array_name(array);
            **array == from.field
                || (!unit.is_empty() && array.strip_suffix(unit) == Some(&format!("{}_", from.field)))
        };
        let Some(array) = arrays.iter().find(named).map(|&array| array.to_owned()) else {
            return Err(source.unknown(&format!("{key}.from.field"), &from.field, &arrays));
        };
        let step = self.step(source, key, &series)?;
        let mesh = HexMesh::new(&series).map_err(|reason| {
            refused("input", &format!("{}: {reason}; fields lie on hexahedra", path.display()))
        })?;
        let values = MeshField::new(&series, step, &array).map_err(|error| refused("field", &error))?;
        Ok((array, mesh, values))
    }

    fn step(&self, source: &Source, key: &str, series: &Series) -> Result<usize, SceneError> {
        let (times, last) = (series.times(), series.len() - 1);
        let Some(time) = self.from.time.map(|time| time.si()) else { return Ok(last) };
        let near = |at: &f64| (at - time).abs() <= 1e-9 * time.abs();
        times.iter().position(near).ok_or_else(|| {
            let nearest = times.iter().copied().min_by(|a, b| (a - time).abs().total_cmp(&(b - time).abs()));
            let allowed =
                format!("one of {} times, the nearest {} s", times.len(), plain(nearest.unwrap_or(f64::NAN)));
            source.error(&format!("{key}.from.time"), format!("{} s", plain(time)), allowed)
        })
    }

    /// Converts the rows of its table to SI units.
    fn table(
        &self,
        source: &Source,
        key: &str,
        kind: FieldKind,
        array: &str,
    ) -> Result<Vec<(f64, f64)>, SceneError> {
        let mut table: Vec<(f64, f64)> = Vec::new();
        for (row, [from, to]) in self.table.iter().enumerate() {
            let entry_key = |column: usize| format!("{key}.table[{row}][{column}]");
            let found = match from {
                TableEntry::Number(number) => plain(*number),
                TableEntry::Text(text) => format!("`{text}`"),
            };
            let Some(from) = kind.si(from) else {
                return Err(source.error(
                    &entry_key(0),
                    found,
                    format!("{}: the field is `{array}`", kind.name()),
                ));
            };
            if table.last().is_some_and(|(before, _)| *before >= from) {
                return Err(source.error(
                    &entry_key(0),
                    found,
                    "values of the field that increase from row to row",
                ));
            }
            let to = self.of.si(to).map_err(|reason| source.refused(&entry_key(1), reason))?;
            if self.of != VaryingParameter::Prestrain {
                positive(source, &entry_key(1), to, self.of.unit())?;
            }
            table.push((from, to));
        }
        match table.len() {
            0 | 1 => {
                let allowed = "at least two rows [value of the field, value of the parameter]";
                Err(source.error(&format!("{key}.table"), format!("{} rows", table.len()), allowed))
            }
            _ => Ok(table),
        }
    }

    /// Rotates a tensor of the mesh to the axes of the body; components across a plane body are zero.
    fn along_axes(&self, tensor: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
        let Some(axes) = &self.placement.axes else { return tensor };
        let mut along = [[0.0; 3]; 3];
        for (a, (from, sign)) in axes.iter().map(|axis| axis.index_and_sign()).enumerate() {
            for (b, (to, other)) in axes.iter().map(|axis| axis.index_and_sign()).enumerate() {
                along[a][b] = sign * other * tensor[from][to];
            }
        }
        along
    }

    /// Returns the particles as boxes in the mesh: cubes, or for a plane body columns through the mesh.
    fn boxes<const D: usize>(
        &self,
        source: &Source,
        key: &str,
        body: &DiscreteBody<D>,
        points: &[[f64; 3]],
    ) -> Result<Vec<Cuboid>, SceneError> {
        let placement = &self.placement;
        let axes: Vec<(usize, f64)> = match &placement.axes {
            None => (0..D).map(|d| (d, 1.0)).collect(),
            Some(axes) => axes.iter().map(|axis| axis.index_and_sign()).collect(),
        };
        let twice = (0..axes.len()).any(|a| (0..a).any(|b| axes[a].0 == axes[b].0));
        if axes.len() != D || twice {
            let found = format!("{} axes{}", axes.len(), if twice { ", one of them twice" } else { "" });
            return Err(source.error(
                &format!("{key}.axes"),
                found,
                format!("{D} different axes of the mesh"),
            ));
        }
        let scale = placement.scale.unwrap_or(1.0);
        positive(source, &format!("{key}.scale"), scale, "")?;
        let origin = placement.origin.map_or([0.0; 3], |origin| origin.map(|x| x.si()));
        let mut whole = Cuboid::bounding(points);
        if let Some(depth) = placement.depth {
            if D == 3 {
                return Err(source.unexpected(&format!("{key}.depth"), "a solid has its own depth"));
            }
            if depth[0].si() >= depth[1].si() {
                let found = format!("{} m to {} m", depth[0].si(), depth[1].si());
                return Err(source.error(
                    &format!("{key}.depth"),
                    found,
                    "[from, to], from < to, in the mesh",
                ));
            }
            if let Some(across) = (0..3).find(|d| axes.iter().all(|(axis, _)| axis != d)) {
                (whole.min[across], whole.max[across]) = (depth[0].si(), depth[1].si());
            }
        }
        let bonds = &*body.bonds;
        let cuboid = |&site: &u32| {
            let (position, volume) = (bonds.position(site as usize), bonds.volume(site as usize));
            let edge = if D == 3 { volume.cbrt() } else { (volume / body.thickness).sqrt() };
            let mut own = whole;
            for (d, &(axis, sign)) in axes.iter().enumerate() {
                let middle = origin[axis] + sign * scale * position[d];
                (own.min[axis], own.max[axis]) = (middle - 0.5 * scale * edge, middle + 0.5 * scale * edge);
            }
            own
        };
        Ok(bonds.particles().iter().map(cuboid).collect())
    }
}

/// Interpolates linearly between rows; `None` outside the table.
fn interpolate(table: &[(f64, f64)], value: f64) -> Option<f64> {
    let (low, high) = (table.first()?.0, table.last()?.0);
    let slack = TABLE_TOLERANCE * (high - low);
    if !(low - slack..=high + slack).contains(&value) {
        return None;
    }
    let value = value.clamp(low, high);
    let row = table.partition_point(|(at, _)| *at <= value).clamp(1, table.len() - 1);
    let ((from, first), (to, second)) = (table[row - 1], table[row]);
    Some(first + (second - first) * (value - from) / (to - from))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables() {
        let table = [(0.0, 1.0), (1.0, 3.0), (3.0, 2.0)];
        for (value, expected) in [(0.0, Some(1.0)), (0.5, Some(2.0)), (1.0, Some(3.0)), (2.0, Some(2.5))] {
            assert_eq!(interpolate(&table, value), expected);
        }
        assert_eq!(interpolate(&table, 3.0 + 1e-10), Some(2.0));
        assert_eq!((interpolate(&table, 3.1), interpolate(&table, f64::NAN)), (None, None));
    }

    #[test]
    fn units_of_arrays() {
        assert_eq!(FieldKind::from_array_name("temperature_degC"), (FieldKind::Temperature, "degC"));
        assert_eq!(FieldKind::from_array_name("mean_stress_MPa"), (FieldKind::Stress, "MPa"));
        assert_eq!(FieldKind::from_array_name("relative_crystallinity"), (FieldKind::Number, ""));
        for (kind, unit, value, si) in [
            (FieldKind::Temperature, "degC", 25.0, 298.15),
            (FieldKind::Temperature, "K", 25.0, 25.0),
            (FieldKind::Temperature, "degF", 32.0, 273.15),
            (FieldKind::Stress, "MPa", 2.0, 2e6),
            (FieldKind::Number, "", 0.3, 0.3),
        ] {
            let (zero, scale) = kind.scale(unit);
            assert!(
                (zero + scale * value - si).abs() < 1e-12 * si.max(1e2),
                "{unit}: {}",
                zero + scale * value
            );
        }
        assert_eq!(FieldKind::Temperature.si(&TableEntry::Number(20.0)), None);
        assert_eq!(FieldKind::Number.si(&TableEntry::Text("20 degC".into())), None);
    }
}

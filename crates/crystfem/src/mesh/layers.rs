//! Layers of elements, and groups of elements that appear together.

use crate::error::Error;
use crate::mesh::Mesh;
use polycore::numerics::range;

/// Elements by layer, in printing order.
#[derive(Clone, Debug, PartialEq)]
pub struct Layers {
    /// Elements of each layer, ascending.
    pub elements: Vec<Vec<u32>>,
    /// Notes for the user.
    pub notes: Vec<String>,
}

impl Layers {
    /// Collects layers from the element sets `PREFIX1`, `PREFIX2`, … (`layer-` in a [`crate::mesh::Bar`]).
    ///
    /// # Errors
    /// [`Error::Mesh`] without `PREFIX1`, for a gap in the numbers, an empty set, or an element in two
    /// layers.
    pub fn from_sets(mesh: &Mesh, prefix: &str) -> Result<Self, Error> {
        let numbers = mesh.element_sets.keys().filter_map(|name| name.strip_prefix(prefix));
        let count = numbers.filter_map(|number| number.parse::<usize>().ok()).max().unwrap_or(0);
        if count > mesh.element_sets.len() || count == 0 {
            let found: Vec<&str> = mesh.element_sets.keys().take(20).map(String::as_str).collect();
            return Err(Error::Mesh(format!(
                "layers `{prefix}N`: found sets {}; allowed: {prefix}1, {prefix}2, … without a gap",
                found.join(", ")
            )));
        }
        let mut layer_of = vec![0; mesh.element_count()];
        let mut elements = Vec::with_capacity(count);
        for layer in 1..=count {
            let name = format!("{prefix}{layer}");
            let Some(set) = mesh.element_sets.get(&name) else {
                return Err(Error::Mesh(format!(
                    "no element set `{name}`; allowed: {prefix}1 … {prefix}{count}"
                )));
            };
            if set.is_empty() {
                return Err(Error::Mesh(format!(
                    "layer {layer}: element set `{name}` is empty; allowed: 1 or more"
                )));
            }
            for element in set {
                match layer_of.get_mut(*element as usize) {
                    Some(0) => layer_of[*element as usize] = layer,
                    Some(other) => {
                        return Err(Error::Mesh(format!(
                            "element {element} is in layers {other} and {layer}; allowed: one layer"
                        )));
                    }
                    None => {
                        return Err(Error::Mesh(format!(
                            "element set `{name}` contains no element {element}"
                        )));
                    }
                }
            }
            elements.push(set.clone());
        }
        Ok(Self { elements, notes: Vec::new() })
    }

    /// Collects layers by height: an element belongs to the layer of its centre. `faces` are the z of the
    /// lower face of the first layer and of the upper face of each, m; `elements` the printed ones.
    ///
    /// # Errors
    /// [`Error::Mesh`] for faces that do not ascend (a layer without thickness), a layer without elements,
    /// and an element outside all layers.
    pub fn from_heights(mesh: &Mesh, elements: &[u32], faces: &[f64]) -> Result<Self, Error> {
        let named =
            |layer: usize| format!("layer {layer}, z from {} m to {} m", faces[layer - 1], faces[layer]);
        if faces.len() < 2 {
            return Err(Error::Mesh(format!("{} heights of layers; allowed: 2 or more", faces.len())));
        }
        let rises = |ends: &[f64]| ends[1] - ends[0] > 0.0 && ends[0].is_finite() && ends[1].is_finite();
        if let Some(layer) = (1..faces.len()).find(|layer| !rises(&faces[layer - 1..=*layer])) {
            return Err(Error::Mesh(format!("{}: no thickness; allowed: ascending heights", named(layer))));
        }
        let mut layers = vec![Vec::new(); faces.len() - 1];
        let mut across = 0;
        let mut highest = 0.0f64;
        for element in elements {
            let nodes = mesh.nodes(*element);
            if nodes.is_empty() {
                let allowed = format!("below {}", mesh.element_count());
                return Err(Error::Parameter { name: "element", found: f64::from(*element), allowed });
            }
            let [x, y, z] = mesh.centre(*element);
            let above = faces.partition_point(|face| *face <= z);
            if above == 0 || above == faces.len() {
                return Err(Error::Mesh(format!(
                    "element {element} at ({x:.6e}, {y:.6e}, {z:.6e}) m is in no layer; allowed: z from {} \
                     m to {} m",
                    faces[0],
                    faces[faces.len() - 1]
                )));
            }
            layers[above - 1].push(*element);
            let heights = nodes.iter().map(|node| mesh.points[*node as usize][2]);
            let (low, high) = heights.fold((z, z), |(low, high), z| (low.min(z), high.max(z)));
            highest = highest.max(high - low);
            // tolerance of a hundredth of the layer, for rounded heights
            let slack = 0.01 * (faces[above] - faces[above - 1]);
            across += usize::from(low < faces[above - 1] - slack || high > faces[above] + slack);
        }
        if let Some(layer) = layers.iter().position(Vec::is_empty) {
            return Err(Error::Mesh(format!(
                "{}: no element; allowed: 1 or more (elements are up to {highest} m high)",
                named(layer + 1)
            )));
        }
        for layer in &mut layers {
            layer.sort_unstable();
            layer.dedup();
        }
        let mut notes = Vec::new();
        if across > 0 {
            notes.push(format!(
                "{across} elements reach into a second layer: each belongs to the layer of its centre"
            ));
        }
        Ok(Self { elements: layers, notes })
    }

    /// Collects layers of equal height, from the lowest to the highest node of the elements, where the last
    /// layer ends.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a height that is not positive or gives more layers than elements, and errors
    /// of [`Self::from_heights`].
    pub fn from_height(mesh: &Mesh, elements: &[u32], height: f64) -> Result<Self, Error> {
        let nodes = elements.iter().flat_map(|element| mesh.nodes(*element));
        let heights = nodes.map(|node| mesh.points[*node as usize][2]);
        let [low, high] = range(heights);
        // a last layer of less than a millionth is rounding
        let count = ((high - low) / height - 1e-6).ceil();
        if !(height > 0.0 && count >= 1.0 && count <= elements.len() as f64) {
            let allowed = format!("above 0 m, and no more layers than the {} elements", elements.len());
            return Err(Error::Parameter { name: "height of a layer", found: height, allowed });
        }
        let mut faces: Vec<f64> = (0..count as usize).map(|layer| low + layer as f64 * height).collect();
        faces.push(high);
        Self::from_heights(mesh, elements, &faces)
    }
}

/// Groups elements that appear together, by time: those due within a `window`, s, appear at its end, so that
/// nothing appears before it is printed; windows begin at the first time. A window of 0 keeps each time
/// separate. Elements at −∞ exist already; those at +∞ never appear.
///
/// # Errors
/// [`Error::Parameter`] for a time or window that is NaN, or a negative window.
pub fn groups(activation: &[f64], window: f64) -> Result<Vec<(f64, Vec<u32>)>, Error> {
    if !(window >= 0.0 && window.is_finite()) {
        let allowed = "0 s or more".into();
        return Err(Error::Parameter { name: "window of activation", found: window, allowed });
    }
    if let Some(time) = activation.iter().find(|time| time.is_nan()) {
        let allowed = "a time, s".into();
        return Err(Error::Parameter { name: "time of activation", found: *time, allowed });
    }
    let mut due: Vec<(f64, u32)> =
        activation.iter().copied().zip(0..).filter(|due| due.0.is_finite()).collect();
    due.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let Some(first) = due.first().map(|due| due.0) else { return Ok(Vec::new()) };
    let mut groups: Vec<(f64, Vec<u32>)> = Vec::new();
    for (time, element) in due {
        // the first time has its own window, otherwise everything would be late by one
        let end = if window == 0.0 { time } else { first + ((time - first) / window).ceil() * window };
        match groups.last_mut().filter(|group| group.0 == end) {
            Some(group) => group.1.push(element),
            None => groups.push((end, vec![element])),
        }
    }
    for group in &mut groups {
        group.1.sort_unstable();
    }
    Ok(groups)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Bar, Block, CellSplit, Grid, Substrate};

    fn bar() -> Mesh {
        let substrate = Substrate { size: [0.03, 0.01], thickness: 1e-3, growth: 1.5 };
        let bar = Bar {
            size: [0.02, 0.004],
            layers: 3,
            layer_height: 2e-4,
            elements_per_layer: 2,
            element_size: 1e-3,
            substrate: Some(substrate),
            cells: CellSplit::Hexahedra,
        };
        bar.mesh().unwrap()
    }

    #[test]
    fn layers_by_name_and_by_height_are_the_same() {
        let mesh = bar();
        let named = Layers::from_sets(&mesh, "layer-").unwrap();
        assert_eq!(named.elements.len(), 3);
        let printed = &mesh.element_sets["bar"];
        assert_eq!(Layers::from_height(&mesh, printed, 2e-4).unwrap(), named);
        assert_eq!(Layers::from_heights(&mesh, printed, &[0.0, 2e-4, 4e-4, 6e-4]).unwrap(), named);
    }

    #[test]
    fn elements_across_layers_are_noted() {
        let block = Block { name: "brick".into(), lower: [0.0; 3], upper: [1.0; 3] };
        let grid = Grid::uniform([0.0; 3], [1.0; 3], [2, 2, 5]).unwrap();
        let mesh = grid.blocks(&[block], CellSplit::SixTetrahedra).unwrap();
        let all: Vec<u32> = (0..mesh.element_count() as u32).collect();
        let layers = Layers::from_height(&mesh, &all, 0.2).unwrap();
        assert_eq!((layers.elements.len(), layers.notes.len()), (5, 0));
        let halves = Layers::from_height(&mesh, &all, 0.5).unwrap();
        assert_eq!(halves.elements.len(), 2);
        assert!(halves.notes[0].starts_with("24 elements reach"), "{:?}", halves.notes);
    }

    #[test]
    fn invalid_layers_are_refused() {
        let mut mesh = bar();
        let printed = mesh.element_sets["bar"].clone();
        let text = |result: Result<Layers, Error>| result.unwrap_err().to_string();
        let thin = text(Layers::from_heights(&mesh, &printed, &[0.0, 2e-4, 2e-4, 6e-4]));
        assert!(thin.contains("layer 2, z from 0.0002 m to 0.0002 m: no thickness"), "{thin}");
        let empty = text(Layers::from_height(&mesh, &printed, 3e-5));
        assert!(empty.contains("layer 1, z from 0 m to 0.00003 m: no element"), "{empty}");
        let outside = text(Layers::from_heights(&mesh, &printed, &[0.0, 4e-4]));
        assert!(outside.contains("is in no layer; allowed: z from 0 m to 0.0004 m"), "{outside}");
        for height in [0.0, -1.0, f64::NAN, 1e-12, f64::INFINITY] {
            assert!(text(Layers::from_height(&mesh, &printed, height)).contains("height of a layer"));
        }
        assert!(
            text(Layers::from_heights(&mesh, &[u32::MAX], &[0.0, 1.0])).contains("element: found 4294967295")
        );
        assert!(text(Layers::from_sets(&mesh, "coat-")).contains("allowed: coat-1, coat-2"));
        let second = mesh.element_sets.remove("layer-2").unwrap();
        assert!(text(Layers::from_sets(&mesh, "layer-")).contains("no element set `layer-2`"));
        mesh.element_sets.insert("layer-2".into(), vec![]);
        assert!(text(Layers::from_sets(&mesh, "layer-")).contains("layer 2: element set `layer-2` is empty"));
        mesh.element_sets.insert("layer-2".into(), mesh.element_sets["layer-1"].clone());
        assert!(text(Layers::from_sets(&mesh, "layer-")).contains("is in layers 1 and 2"));
        mesh.element_sets.insert("layer-2".into(), second);
        mesh.element_sets.insert("layer-4000000000".into(), vec![0]);
        assert!(text(Layers::from_sets(&mesh, "layer-")).contains("without a gap"));
    }

    #[test]
    fn windows_delay_and_never_hasten() {
        let times = [3.0, f64::NEG_INFINITY, 0.5, 1.2, f64::INFINITY, 1.5, 3.0];
        let expected = vec![(0.5, vec![2]), (1.5, vec![3, 5]), (3.5, vec![0, 6])];
        assert_eq!(groups(&times, 1.0).unwrap(), expected);
        assert_eq!(groups(&times, 0.0).unwrap().len(), 4);
        assert!(groups(&[f64::NEG_INFINITY], 1.0).unwrap().is_empty());
        assert!(groups(&times, -1.0).is_err() && groups(&[f64::NAN], 0.0).is_err());
    }
}

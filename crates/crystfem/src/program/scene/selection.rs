//! Elements and coordinates of a scene.

use crate::mesh::Mesh;
use harness::scene::{SceneError, Source};

/// Returns the elements of a set, or all elements.
pub(super) fn elements(
    source: &Source,
    mesh: &Mesh,
    key: &str,
    name: Option<&str>,
) -> Result<Vec<u32>, SceneError> {
    let Some(name) = name else { return Ok((0..mesh.element_count() as u32).collect()) };
    mesh.element_sets.get(name).cloned().ok_or_else(|| {
        let known: Vec<&str> = mesh.element_sets.keys().map(String::as_str).collect();
        source.unknown(key, name, &known)
    })
}

/// Formats a point in mm, as a scene writes it.
pub(crate) fn millimetres(place: [f64; 3]) -> String {
    // rounded to a nanometre, which removes rounding errors of the unit
    let [x, y, z] = place.map(|x| (1e9 * x).round() / 1e6);
    format!("({x}, {y}, {z}) mm")
}

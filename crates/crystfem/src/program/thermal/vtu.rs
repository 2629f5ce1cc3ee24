//! VTK XML files: unstructured grids (`.vtu`), parallel grids (`.pvtu`) and series (`.pvd`).

use super::xml;
use super::{Analysis, CellsByDimension, ThermalFrame, choose_array, data_error};
use crate::error::Error;
use meshfile::vtu::{VtuGrid, beside, has_ending};
use std::path::{Path, PathBuf};

/// Opens a grid, at t = 0, or a series of grids with the same nodes. Files of the same time are parts of one
/// grid.
pub fn open(path: &Path, array: Option<&str>) -> Result<Analysis, Error> {
    let files = if has_ending(path, "pvd") { series(path)? } else { vec![(0.0, vec![path.to_path_buf()])] };
    let Some((_, first)) = files.first() else {
        return Err(data_error(path, "found no DataSet; allowed: at least one"));
    };
    let grid = VtuGrid::read(first)?;
    let first = first.first().map_or(path, PathBuf::as_path);
    let allowed = "lines, triangles, quadrilaterals, tetrahedra, pyramids, wedges, hexahedra";
    let mut cells = CellsByDimension::default();
    for (cell, &(kind, _)) in grid.cells.iter().enumerate() {
        cells.push(kind.into(), grid.cell_nodes(cell));
    }
    let Some(cells) = cells.highest() else {
        return Err(data_error(first, &format!("found no elements; allowed: {allowed}")));
    };
    let points = grid.points;
    let names: Vec<String> = grid.point_arrays.into_iter().map(|array| array.name).collect();
    let name = choose_array(first, &names, array)?.to_owned();
    let nodes = points.len();
    if let Some(missing) = files.iter().flat_map(|(_, parts)| parts).find(|file| !file.is_file()) {
        return Err(data_error(path, &format!("refers to {}, which does not exist", missing.display())));
    }
    let frames = files.into_iter().map(move |(time, parts)| {
        let arrays = VtuGrid::read(&parts)?.point_arrays;
        let own = arrays.into_iter().find(|array| array.name == name);
        let temperature = own.map(|array| array.values).unwrap_or_default();
        if temperature.len() != nodes {
            let found = format!("found {} values of `{name}`", temperature.len());
            let path = parts.first().map_or(Path::new(""), PathBuf::as_path);
            return Err(data_error(
                path,
                &format!("{found}; allowed: {nodes}, one per node of the first time"),
            ));
        }
        Ok(ThermalFrame { time, temperature })
    });
    Ok(Analysis { points, cells, frames: Box::new(frames) })
}

/// Reads times and files of a series.
fn series(path: &Path) -> Result<Vec<(f64, Vec<PathBuf>)>, Error> {
    let mut files: Vec<(f64, Vec<PathBuf>)> = Vec::new();
    for set in xml::read(path)?.descendants().into_iter().filter(|node| node.name == "DataSet") {
        let (Ok(time), false) = (set.get("timestep").parse::<f64>(), set.get("file").is_empty()) else {
            let allowed = "`timestep`, a number, and `file`";
            return Err(data_error(path, &format!("found a DataSet without them; allowed: {allowed}")));
        };
        let file = beside(path, set.get("file"));
        match files.iter_mut().find(|(other, _)| *other == time) {
            Some((_, parts)) => parts.push(file),
            None => files.push((time, vec![file])),
        }
    }
    Ok(files)
}

//! Exodus II files, as MOOSE, Cubit and ParaView write them.

use super::{Analysis, CellsByDimension, ThermalFrame, choose_array, data_error};
use crate::error::Error;
use harness::output::vtkhdf::Cells;
use meshfile::exodus;
use meshfile::netcdf::Netcdf;
use std::path::Path;

/// Opens a file and reads its mesh.
pub fn open(path: &Path, array: Option<&str>) -> Result<Analysis, Error> {
    let mut file = Netcdf::open(path)?;
    let points = exodus::points(&mut file, path)?;
    let cells = cells(&mut file, path, points.len())?;
    let names = exodus::text_rows(&mut file, "name_nod_var")?;
    let chosen = choose_array(path, &names, array)?;
    let variable = names.iter().position(|name| name == chosen).unwrap_or_default() + 1;
    let variable = format!("vals_nod_var{variable}");
    let times = file.numbers("time_whole", None)?;
    let (nodes, path) = (points.len(), path.to_path_buf());
    let frames = times.into_iter().enumerate().map(move |(row, time)| {
        let temperature = file.numbers(&variable, Some(row))?;
        check_count(&path, &variable, temperature.len(), nodes)?;
        Ok(ThermalFrame { time, temperature })
    });
    Ok(Analysis { points, cells, frames: Box::new(frames) })
}

fn check_count(path: &Path, name: &str, found: usize, allowed: usize) -> Result<(), Error> {
    if found == allowed {
        return Ok(());
    }
    Err(data_error(path, &format!("found {found} numbers in `{name}`; allowed: {allowed}, one per node")))
}

/// Cells of the highest dimension.
fn cells(file: &mut Netcdf, path: &Path, nodes: usize) -> Result<Cells, Error> {
    let mut cells = CellsByDimension::default();
    for block in exodus::blocks(file, path, nodes)? {
        let kind = match block.element_type.as_str() {
            kind if kind.starts_with("HEX") => 12,
            kind if kind.starts_with("TET") => 10,
            kind if kind.starts_with("WEDGE") => 13,
            kind if kind.starts_with("PYR") => 14,
            kind if kind.starts_with("TRI") => 5,
            kind if kind.starts_with("QUAD") || kind.starts_with("SHELL") => match block.nodes_each {
                // shells may be triangles
                3 | 6 | 7 => 5,
                _ => 9,
            },
            kind if ["BAR", "BEAM", "TRUSS", "EDGE"].iter().any(|name| kind.starts_with(name)) => 3,
            _ => continue,
        };
        block.nodes.chunks(block.nodes_each).for_each(|nodes| cells.push(kind, nodes));
    }
    let allowed = "blocks of HEX, WEDGE, PYRAMID, TET, QUAD, SHELL, TRI, BAR, BEAM or EDGE";
    cells.highest().ok_or_else(|| data_error(path, &format!("found no elements; allowed: {allowed}")))
}

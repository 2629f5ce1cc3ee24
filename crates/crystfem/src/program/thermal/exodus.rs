//! Exodus II files, as written by MOOSE, Cubit and ParaView (Schoof & Yarberry 1994, SAND92-2137, "EXODUS II:
//! A Finite Element Data Model").

use super::netcdf::Netcdf;
use super::{Analysis, CellsByDimension, ThermalFrame, choose_array, data_error};
use crate::error::Error;
use harness::output::vtkhdf::Cells;
use std::path::Path;

/// Opens a file and reads its mesh.
pub fn open(path: &Path, array: Option<&str>) -> Result<Analysis, Error> {
    let mut file = Netcdf::open(path)?;
    let points = points(&mut file, path)?;
    let cells = cells(&mut file, path, points.len())?;
    let names = names(&mut file)?;
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

fn points(file: &mut Netcdf, path: &Path) -> Result<Vec<[f64; 3]>, Error> {
    // older files have one variable for all axes
    let axes: Vec<Vec<f64>> = match file.shape("coord") {
        Some(shape) => {
            let values = file.numbers("coord", None)?;
            values.chunks(shape.last().copied().unwrap_or(1).max(1)).map(<[f64]>::to_vec).collect()
        }
        None => ["coordx", "coordy", "coordz"]
            .iter()
            .filter(|name| file.shape(name).is_some())
            .copied()
            .collect::<Vec<_>>()
            .into_iter()
            .map(|name| file.numbers(name, None))
            .collect::<Result<_, _>>()?,
    };
    let count = axes.first().map_or(0, Vec::len);
    if !(1..=3).contains(&axes.len()) || count == 0 {
        return Err(data_error(path, &format!("found {} axes of coordinates; allowed: 1 to 3", axes.len())));
    }
    for axis in &axes {
        check_count(path, "coord", axis.len(), count)?;
    }
    Ok((0..count).map(|k| [0, 1, 2].map(|d| axes.get(d).map_or(0.0, |axis| axis[k]))).collect())
}

fn cells(file: &mut Netcdf, path: &Path, nodes: usize) -> Result<Cells, Error> {
    let mut cells = CellsByDimension::default();
    for block in 1.. {
        let name = format!("connect{block}");
        let Some(shape) = file.shape(&name) else { break };
        let own = shape.get(1).copied().unwrap_or_default();
        let kind = file.attribute(&name, "elem_type").unwrap_or_default().to_uppercase();
        let kind = match &kind {
            kind if kind.starts_with("HEX") => 12,
            kind if kind.starts_with("TET") => 10,
            kind if kind.starts_with("WEDGE") => 13,
            kind if kind.starts_with("PYR") => 14,
            kind if kind.starts_with("TRI") => 5,
            kind if kind.starts_with("QUAD") || kind.starts_with("SHELL") => match own {
                // shells may be triangles
                3 | 6 | 7 => 5,
                _ => 9,
            },
            kind if ["BAR", "BEAM", "TRUSS", "EDGE"].iter().any(|name| kind.starts_with(name)) => 3,
            _ => continue,
        };
        for element in file.numbers(&name, None)?.chunks(own.max(1)) {
            let mut places = Vec::with_capacity(own);
            for &node in element {
                if !(1.0..=nodes as f64).contains(&node) {
                    return Err(data_error(
                        path,
                        &format!("found node {node} in `{name}`; allowed: 1 to {nodes}"),
                    ));
                }
                places.push(node as u32 - 1);
            }
            cells.push(kind, &places);
        }
    }
    let allowed = "blocks of HEX, WEDGE, PYRAMID, TET, QUAD, SHELL, TRI, BAR, BEAM or EDGE";
    cells.highest().ok_or_else(|| data_error(path, &format!("found no elements; allowed: {allowed}")))
}

/// Returns the names of the nodal variables.
fn names(file: &mut Netcdf) -> Result<Vec<String>, Error> {
    let longest = file.shape("name_nod_var").and_then(|shape| shape.last().copied()).unwrap_or(1);
    let letters = file.numbers("name_nod_var", None)?;
    let name = |letters: &[f64]| -> String {
        letters.iter().map(|&letter| letter as u8 as char).take_while(|letter| *letter != '\0').collect()
    };
    Ok(letters.chunks(longest.max(1)).map(|letters| name(letters).trim().to_owned()).collect())
}

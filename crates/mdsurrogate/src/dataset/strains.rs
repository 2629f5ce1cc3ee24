//! Strains for predictions, from tables with or without stresses.

use super::options::{BoxReference, ReadOptions, SampledColumns};
use super::read::TableLayout;
use super::table::{ColumnIndex, DataTable};
use crate::Error;
use polycore::tensor::{DeformationGradient, Voigt, voigt};

/// Columns of principal stretches; missing ones follow from λ₁λ₂λ₃ = 1, with two equal stretches.
#[derive(Clone, Copy)]
struct StretchColumns([Option<ColumnIndex>; 3]);

impl StretchColumns {
    fn new(table: &DataTable) -> Result<Self, Error> {
        let columns = ["stretch_1", "stretch_2", "stretch_3"].map(|name| table.find(name));
        let Some(first) = columns[0].or_else(|| table.find("stretch")) else {
            let similar = None;
            return Err(Error::MissingColumn {
                path: table.path.clone(),
                column: "stretch_1".into(),
                similar,
            });
        };
        if columns[1].is_none() && columns[2].is_some() {
            let allowed = "stretch_1 alone, with stretch_2, or with stretch_2 and stretch_3";
            return Err(Error::file(&table.path, "stretch_3 without stretch_2", allowed));
        }
        Ok(Self([Some(first), columns[1], columns[2]]))
    }

    fn row(&self, table: &DataTable, row: usize) -> Result<[f64; 3], Error> {
        let mut known = [f64::NAN; 3];
        for (stretch, column) in known.iter_mut().zip(self.0) {
            let Some(column) = column else { continue };
            *stretch = table.number(row, column)?;
            if *stretch <= 0.0 {
                return Err(table.cell(row, column, "a positive stretch"));
            }
        }
        let [first, second, third] = known;
        let second = if second.is_nan() { first.powf(-0.5) } else { second };
        let third = if third.is_nan() { 1.0 / (first * second) } else { third };
        Ok([first, second, third])
    }
}

/// Reads C in each row of a table: from the columns C11, C22, C33 and, with shear, C12, C13, C23, from
/// stretches, or from F or boxes as in [`super::read`]. Ignores other columns. Reads C of an HDF5 file.
///
/// # Errors
/// Returns an error for a table without rows, a missing or misspelt column, and a cell without a finite
/// number.
pub fn read_strains(path: impl AsRef<std::path::Path>) -> Result<Vec<Voigt>, Error> {
    let path = path.as_ref();
    #[cfg(feature = "hdf5")]
    if super::read::is_hdf5(path)? {
        return Ok(super::hdf5::read(path)?.rows().map(|row| row.c).collect());
    }
    let mut options = ReadOptions::default();
    let table = DataTable::read(path, &options)?;
    let known = crate::kinematics::NAMES.map(|name| format!("C{name}"));
    if table.contains("stretch_1") || table.contains("stretch") {
        if table.contains("mode") && !table.contains("stretch_1") {
            let allowed =
                "stretch_1 and stretch_2 (equal in equibiaxial tension, stretch_2 = 1 in pure shear)";
            return Err(Error::file(path, "a mode with one stretch only", allowed));
        }
        let stretches = StretchColumns::new(&table)?;
        let c =
            |row| stretches.row(&table, row).map(|[x, y, z]| Voigt::new(x * x, y * y, z * z, 0.0, 0.0, 0.0));
        return (0..table.rows()).map(c).collect();
    }
    let boxed = |prefix: &str| table.contains(&format!("{prefix}lx"));
    if !table.contains("C11") && (table.contains("F12") || boxed("avg_") || boxed("")) {
        if !boxed("avg_") {
            options.columns = SampledColumns::Instantaneous;
        }
        if table.lammps().is_some_and(|origin| origin.first_is_undeformed) {
            options.origin = Some(BoxReference::Run);
        }
        let layout = TableLayout::new(&table, &options, false)?;
        let (runs, _) = layout.runs(&table)?;
        let (found, _) = layout.deformations(&table, &runs, &options)?;
        let c = |f: &DeformationGradient| voigt::from_stress(&f.right_cauchy_green());
        return Ok(found.iter().flatten().map(c).collect());
    }
    // a misspelt name must not become zero shear
    let slip = |name: &&String| name.len() == 3 && name.starts_with(['C', 'c']) && !known.contains(name);
    if let Some(heading) = table.headings.iter().map(|(name, _)| name).find(slip) {
        return Err(Error::file(path, format!("column `{heading}`"), known.join(", ")));
    }
    let columns = known.each_ref().map(|name| table.find(name));
    if let Some(a) = (0..3).find(|&a| columns[a].is_none()) {
        let (path, column) = (path.to_path_buf(), known[a].clone());
        return Err(Error::MissingColumn { path, column, similar: None });
    }
    let mut points = vec![Voigt::zeros(); table.rows()];
    for (row, point) in points.iter_mut().enumerate() {
        for (value, column) in point.iter_mut().zip(columns) {
            if let Some(column) = column {
                *value = table.number(row, column)?;
            }
        }
    }
    Ok(points)
}

//! Reader of tension curves to rupture, several in one table.

use std::path::Path;

use super::columns::{ColumnKind, Role, StrainMeasure, TestStressMeasure};
use super::forecast::TensionCurve;
use crate::table::{Error, Table, plain_unit};
use crate::units::Unit;
use crate::units::dimension::StressDimension;

impl TensionCurve {
    /// Reads the curves of a table: columns of names, of stretches or engineering strains, of nominal
    /// stresses. A curve ends at its largest stress; rows at rest and repeated ones are left out.
    ///
    /// # Errors
    /// [`crate::Error::Io`]; columns that are missing, cells that are no number, a stress that is not above
    /// zero, strains that do not ascend.
    pub fn read(path: impl AsRef<Path>, names: &str) -> Result<Vec<Self>, crate::Error> {
        Ok(Self::of_table(&Table::read(path)?, names)?)
    }

    fn of_table(file: &Table, names: &str) -> Result<Vec<Self>, Error> {
        let name = file.require_column(&[names])?;
        let roles: Vec<Option<Role>> = file.headings.iter().map(Role::from_heading).collect();
        let kinds = || roles.iter().map(|role| role.as_ref().map(|role| role.what));
        let strain = kinds().position(|kind| matches!(kind, Some(ColumnKind::Strain(_))));
        let stress = kinds().position(|kind| matches!(kind, Some(ColumnKind::Stress(_))));
        let (Some(strain), Some(stress)) = (strain, stress) else {
            return Err(file.refuse_headings("a strain and a stress: `strain`, `stress [MPa]`"));
        };
        let is =
            |column: usize, kind: ColumnKind| roles[column].as_ref().is_some_and(|role| role.what == kind);
        if is(strain, ColumnKind::Strain(Some(StrainMeasure::True)))
            || is(stress, ColumnKind::Stress(Some(TestStressMeasure::True)))
        {
            return Err(file.refuse_headings("an engineering strain or a stretch, and a nominal stress"));
        }
        let rest = if is(strain, ColumnKind::Strain(Some(StrainMeasure::Stretch))) { 0.0 } else { 1.0 };
        let unit = roles[stress].as_ref().and_then(|role| role.unit.clone()).unwrap_or_default();
        let unit = Unit::<StressDimension>::parse(&plain_unit(&unit)).map_err(|error| {
            file.refuse_headings(format!("a stress with a unit, as `stress [MPa]`; {error}"))
        })?;
        let mut curves: Vec<Self> = Vec::new();
        for row in 0..file.rows() {
            let stretch = rest + file.number(row, strain)?;
            let nominal = unit.quantity(file.number(row, stress)?).map(|stress| stress.si());
            let nominal = nominal.map_err(|error| file.refuse_cell(row, stress, &error.to_string()))?;
            if stretch == 1.0 {
                continue;
            }
            if nominal.is_nan() || nominal <= 0.0 || stretch < 1.0 {
                let column = if stretch < 1.0 { strain } else { stress };
                return Err(file.refuse_cell(row, column, "tension: strain and stress above 0"));
            }
            let own = file.text(row, name);
            let at = curves.iter().position(|curve| curve.name == own).unwrap_or_else(|| {
                curves.push(Self { name: own.to_owned(), points: Vec::new() });
                curves.len() - 1
            });
            let points = &mut curves[at].points;
            match points.last() {
                Some(last) if *last == [stretch, nominal] => {}
                Some(last) if last[0] >= stretch => {
                    return Err(file.refuse_cell(row, strain, "a strain above that of the row before"));
                }
                _ => points.push([stretch, nominal]),
            }
        }
        for curve in &mut curves {
            let by_stress = |a: &(usize, &[f64; 2]), b: &(usize, &[f64; 2])| a.1[1].total_cmp(&b.1[1]);
            if let Some((last, _)) = curve.points.iter().enumerate().max_by(by_stress) {
                curve.points.truncate(last + 1);
            }
        }
        Ok(curves)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_of_a_table() {
        let parse = |text: &str| {
            TensionCurve::of_table(&Table::parse("c.csv", text.as_bytes().to_vec()).unwrap(), "material")
        };
        let head = "material,strain,stress_MPa,mark\n";
        let rows = "a,0,0,\na,1,0.1,\na,2,0.3,max\na,2,0.3,end\nb,0.5,1,\nb,0.6,2,max\nb,0.7,1.9,end\n";
        let curves = parse(&format!("{head}{rows}")).unwrap();
        assert_eq!(curves[0].points, [[2.0, 1e5], [3.0, 3e5]]);
        assert_eq!((curves[1].name.as_str(), curves[1].points.len()), ("b", 2));
        for (text, part) in [
            (format!("{head}a,1,-0.1,\n"), "tension: strain and stress above 0"),
            (format!("{head}a,2,0.1,\na,1,0.2,\n"), "a strain above that of the row before"),
            ("material,strain\na,1\n".to_owned(), "a strain and a stress"),
            ("name,strain,stress_MPa\na,1,1\n".to_owned(), "one column `material"),
        ] {
            let error = parse(&text).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
    }
}

//! Columns of measured data, read by [`polycore::table`], and the headings that calorimeters use.

use crate::error::Error;
use polycore::table::{self, Table};
use polycore::units::Dimension;
use std::path::Path;

/// Alternative names of a column, the likeliest first.
const NAMES: [(&str, &[&str]); 4] = [
    ("time", &["time", "t", "elapsed time", "test time", "zeit"]),
    (
        "temperature",
        &[
            "temperature",
            "T",
            "temp",
            "sample temperature",
            "sample temp",
            "ts",
            "t sample",
            "temperatur",
            "program temperature",
        ],
    ),
    (
        "heat_flow",
        &[
            "heat_flow",
            "heatflow",
            "dsc",
            "normalized heat flow",
            "heat flow normalized",
            "unsubtracted heat flow",
            "hf",
            "wärmestrom",
            "value",
        ],
    ),
    ("alpha", &["alpha", "α", "relative crystallinity", "conversion"]),
];

fn names(name: &'static str) -> Vec<&'static str> {
    NAMES.iter().find(|(first, _)| *first == name).map_or(vec![name], |(_, all)| all.to_vec())
}

/// Reads a column in SI; the unit applies to headings without one.
type Read = fn(&Table, usize, Option<&str>) -> Result<Vec<f64>, table::Error>;

/// A requested column.
#[derive(Clone, Copy)]
pub struct TableColumn {
    name: &'static str,
    read: Read,
    example: &'static str,
    unit: Option<&'static str>,
    least: f64,
    most: f64,
}

impl TableColumn {
    /// Returns a column of quantities of dimension `D`.
    pub fn new<D: Dimension>(name: &'static str) -> Self {
        let (least, most) = (f64::NEG_INFINITY, f64::INFINITY);
        Self { name, read: Table::column::<D>, example: D::EXAMPLE, unit: None, least, most }
    }

    /// Accepts a heading without a unit, with this default unit.
    pub fn or_unit(mut self, unit: &'static str) -> Self {
        self.unit = Some(unit);
        self
    }

    /// Limits the range of values, in SI.
    pub fn within(mut self, least: f64, most: f64) -> Self {
        (self.least, self.most) = (least, most);
        self
    }
}

/// Reads columns in SI units, in any order and units in the file; other columns are ignored.
///
/// # Errors
/// [`Error::File`] with line and column for a file that cannot be read, a missing or repeated column, a row
/// of another length, a cell that is not a finite number of the column's dimension, a number out of range,
/// and a table without rows.
pub fn read<const N: usize>(path: &Path, columns: [TableColumn; N]) -> Result<[Vec<f64>; N], Error> {
    read_with_lines(path, columns).map(|(data, _)| data)
}

/// Reads like [`read`], and returns the line of each row, from 1.
///
/// # Errors
/// Errors of [`read`].
pub fn read_with_lines<const N: usize>(
    path: &Path,
    columns: [TableColumn; N],
) -> Result<([Vec<f64>; N], Vec<usize>), Error> {
    let table = open(path)?;
    let mut data = [(); N].map(|()| Vec::new());
    let mut places = [0; N];
    for (column, place) in columns.iter().zip(&mut places) {
        let found = table.matching(&names(column.name));
        let [one] = found[..] else {
            let (name, example) = (column.name, column.example);
            let allowed = format!("one column `{name} [unit]`, with numbers like {example}");
            return Err(table.refuse_headings(allowed).into());
        };
        *place = one;
    }
    if table.rows() == 0 {
        let line = table.layout().heading_line;
        return Err(table.refuse(line, "table", "no row".into(), "at least one row of numbers").into());
    }
    for ((column, place), data) in columns.iter().zip(places).zip(&mut data) {
        *data = (column.read)(&table, place, column.unit)?;
        let range = column.least..=column.most;
        if let Some(row) = data.iter().position(|value| !range.contains(value)) {
            let allowed = format!("{} to {} (SI)", column.least, column.most);
            return Err(table.refuse_cell(row, place, &allowed).into());
        }
    }
    Ok((data, (0..table.rows()).map(|row| table.line(row)).collect()))
}

/// Describes how a calorimeter table is interpreted, in one line; `None` for other files.
pub fn describe_format(path: &Path) -> Option<String> {
    let table = Table::read(path).ok()?;
    let used: Vec<usize> = NAMES.iter().flat_map(|(_, names)| table.matching(names)).collect();
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    (!used.is_empty()).then(|| format!("data {name}: {}", table.describe(&used)))
}

impl From<table::Error> for Error {
    fn from(error: table::Error) -> Self {
        let table::Error { path, line, what, found, allowed } = error;
        Self::File { path, line, what, found, allowed }
    }
}

/// Opens a table; errors point to lines of the file.
fn open(path: &Path) -> Result<Table, Error> {
    Table::read(path).map_err(|error| match error {
        polycore::Error::Table(error) => error.into(),
        other => other.into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use polycore::units::dimension::{
        RatioDimension, SpecificPowerDimension, TemperatureDimension, TimeDimension,
    };

    fn of(text: &str) -> Result<[Vec<f64>; 3], String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        std::fs::write(&path, text).unwrap();
        let columns = [
            TableColumn::new::<TimeDimension>("time"),
            TableColumn::new::<TemperatureDimension>("temperature"),
            TableColumn::new::<RatioDimension>("alpha").within(0.0, 1.0),
        ];
        read(&path, columns).map_err(|error| error.to_string())
    }

    #[test]
    fn units_of_the_heading() {
        let found =
            of("# source: none\nalpha,note,time [min],temperature [degC]\n0.5,x,2,20\n0,y,3,-10\n").unwrap();
        assert_eq!(found, [vec![120.0, 180.0], vec![293.15, 263.15], vec![0.5, 0.0]]);
        let found = of("time [s] , temperature [K], alpha [%]\n1,300,50\n").unwrap();
        assert_eq!(found, [vec![1.0], vec![300.0], vec![0.5]]);
    }

    #[test]
    fn refusals_name_file_line_and_column() {
        let good = "time [s],temperature [degC],alpha\n";
        for (text, parts) in [
            ("time [s],alpha\n", ["t.csv:1: headings", "one column `temperature [unit]`"]),
            ("time [s],time [s],temperature [K],alpha\n", ["t.csv:1: headings", "one column `time"]),
            (good, ["t.csv:1: table", "at least one row"]),
            ("", ["headings", "a line of headings"]),
            (&format!("{good}1,2,x\n"), ["t.csv:2: column 3, `alpha`: found \"x\"", "a number"]),
            (&format!("{good}1,20,0.5\n# c\n1,-300,0.5\n"), ["t.csv:4: column 2", "below absolute zero"]),
            (&format!("{good}1,20,1.5\n"), ["found \"1.5\"", "0 to 1"]),
            (&format!("{good}nan,20,0.5\n"), ["t.csv:2: column 1", "not a finite number"]),
            (&format!("{good}1,20\n"), ["t.csv:2: row", "3, as the headings have"]),
            ("time,temperature [K],alpha\n1,2,0\n", ["t.csv:1: unit of column 1, `time`", "has no unit"]),
            ("time [m],temperature [K],alpha\n1,2,0\n", ["t.csv:1: unit of column 1", "a time is needed"]),
        ] {
            let error = of(text).unwrap_err();
            assert!(parts.iter().all(|part| error.contains(part)), "{error}");
        }
        let columns = [TableColumn::new::<TimeDimension>("time")];
        assert!(
            read(Path::new("/no/such.csv"), columns)
                .unwrap_err()
                .to_string()
                .contains("cannot read /no/such.csv")
        );
    }

    /// Exports of calorimeters: the same three rows from Netzsch (Latin-1), TA Instruments (UTF-16), Mettler,
    /// PerkinElmer and a spreadsheet.
    #[test]
    fn exports_of_calorimeters() {
        let netzsch = "#EXO:1\r\n#DECIMAL:COMMA\r\n##Temp./°C;Time/min;DSC/(mW/mg)\r\n200,5;0,0;0,05\r\n\
                       199,5;0,1;0,25\r\n";
        let latin: Vec<u8> = netzsch.chars().map(|c| u8::try_from(c).unwrap()).collect();
        let ta = "Filename\tPA12.tri\r\nSample\tx\r\nTime (min)\tTemperature (°C)\tHeat Flow (W/g)\r\n\
                  0.0\t200.5\t0.05\r\n0.1\t199.5\t0.25\r\n";
        let wide: Vec<u8> =
            "\u{feff}".chars().chain(ta.chars()).map(|c| c as u16).flat_map(u16::to_le_bytes).collect();
        let mettler = "Curve Values:\n  Index      t       Ts       Value\n             [s]     [°C]     \
            [W/g]\n\x20     0      0    200.5        0.05\n      1      6    199.5        0.25\n";
        let elmer = "PerkinElmer\nTime\tHeat Flow\tSample Temperature\nminutes\tmW/mg\tºC\n0\t0.05\t200.5\n\
            0.1\t0.25\t199.5\n";
        let sheet = "\u{feff}\"time [s]\";\"temperature [K]\";\"heat_flow \
            [W/kg]\"\n\"0\";\"473,65\";\"50\"\n6;472,65;250\n";
        for (name, bytes) in [
            ("netzsch", latin),
            ("ta", wide),
            ("mettler", mettler.as_bytes().to_vec()),
            ("elmer", elmer.as_bytes().to_vec()),
            ("sheet", sheet.as_bytes().to_vec()),
        ] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("t.csv");
            std::fs::write(&path, bytes).unwrap();
            let columns = [
                TableColumn::new::<TimeDimension>("time"),
                TableColumn::new::<TemperatureDimension>("temperature"),
                TableColumn::new::<SpecificPowerDimension>("heat_flow"),
            ];
            let [time, temperature, flow] =
                read(&path, columns).unwrap_or_else(|error| panic!("{name}: {error}"));
            assert_eq!(time, [0.0, 6.0], "{name}");
            assert_eq!(temperature, [473.65, 472.65], "{name}");
            assert_eq!(flow, [50.0, 250.0], "{name}");
            assert!(describe_format(&path).unwrap().starts_with("data t.csv: separat"), "{name}");
        }
    }
}

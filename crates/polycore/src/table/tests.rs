use super::*;
use crate::units::dimension::{RatioDimension, StressDimension, TemperatureDimension, TimeDimension};

fn parse(text: &str) -> Table {
    Table::parse("t.csv", text.as_bytes().to_vec()).unwrap_or_else(|error| panic!("{text}\n{error}"))
}

fn refused(text: &str) -> String {
    let table = match Table::parse("t.csv", text.as_bytes().to_vec()) {
        Err(error) => return error.to_string(),
        Ok(table) => table,
    };
    let values = table.require_column(&["strain"]).and_then(|i| table.column::<RatioDimension>(i, None));
    let other = table.require_column(&["stress"]).and_then(|i| table.column::<StressDimension>(i, None));
    values.and(other).expect_err(text).to_string()
}

/// Strain (as a fraction) and stress (Pa) in files of testing machines and of people: the numbers are the
/// same.
#[test]
fn ways_to_write_a_table() {
    for (text, how) in [
        (
            "strain,stress [MPa]\n0.125,0.5\n0.25,1.5\n",
            "separator `,`, decimal point, UTF-8, headings in line 1",
        ),
        ("Strain (%);Stress (MPa)\n12,5;0,5\n25;1,5\n", "separator `;`, decimal comma"),
        ("Strain (%);Stress (MPa)\r\n12,5;0,5\r\n25,0;1,5\r\n", "separator `;`, decimal comma"),
        ("strain\tstress (kPa)\n0.125\t500\n0.25\t1.5e3\n", "separator tab, decimal point"),
        // columns in another order, one more, units below, a blank cell
        ("Stress,Note,Strain\nMPa,,%\n0.5,a,12.5\n1.5,,25\n", "headings in line 1, units in line 2"),
        // testXpert: metadata, quotes, a row of units
        (
            "\"Prüfer\";\"M. \
             Weiß\"\n\"Dicke\";\"2,01\";\"mm\"\n\n\"Strain\";\"Stress\"\n\
             \"%\";\"N/mm²\"\n\"12,5\";\"0,5\"\n\"25\";\"1,5\"\n",
            "decimal comma, UTF-8, headings in line 4, units in line 5",
        ),
        // Bluehill: quoted numbers with thousands, units in brackets below
        (
            "Specimen label,A \
             12\nTemperature,23\n\nStrain,Stress\n\
             (mm/mm),(Pa)\n\"0.125\",\"500,000.0\"\n\"0.25\",\"1,500,000.0\"\n",
            "separator `,`, decimal point, UTF-8, headings in line 4, units in line 5",
        ),
        ("strain    stress (MPa)\n0.125   0.5\n0.25    1.5\n", "separated by blanks, decimal point"),
        ("  strain/%   stress/MPa\n  12,5   0,5\n  25,0   1,5\n", "separated by blanks, decimal comma"),
        ("# from a script\n# strain stress/MPa\n0.125 0.5\n0.25 1.5\n", "headings in line 2"),
        ("##Strain/%;Stress/(N/mm2)\n12,5;0,5\n25,0;1,5\n", "headings in line 1"),
        ("sep=;\nstrain;stress [MPa];\n0.125;0.5;\n0.25;1.5;\n;;\n", "headings in line 2"),
        // a column of text that begins like a number
        ("test,strain,stress in MPa,stress [MPa]\n2 b,0.125,x,0.5\n2 b,0.25,y,1.5\n", "separator `,`"),
        ("strain [-],stress [MPa]\n1.25E-1,5e-1\n+.25,1.5\n", "decimal point"),
    ] {
        let table = parse(text);
        let [strain, stress] =
            [table.require_column(&["strain"]).unwrap(), table.require_column(&["stress"]).unwrap()];
        assert_eq!(table.column::<RatioDimension>(strain, Some("")).unwrap(), [0.125, 0.25], "{text}");
        assert_eq!(table.column::<StressDimension>(stress, None).unwrap(), [0.5e6, 1.5e6], "{text}");
        let said = table.describe(&[strain, stress]);
        assert!(said.contains(how), "{said}\n{text}");
    }
}

#[test]
fn encodings() {
    let text = "Temp./°C;µ\n20,5;1\n";
    let latin: Vec<u8> = text.chars().map(|c| u8::try_from(c).unwrap()).collect();
    let wide = |bytes: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(bytes).collect::<Vec<u8>>();
    let little = wide(u16::to_le_bytes);
    for (bytes, name) in [
        (text.as_bytes().to_vec(), "UTF-8"),
        ([b"\xef\xbb\xbf", text.as_bytes()].concat(), "UTF-8 with BOM"),
        (latin, "Latin-1"),
        ([&[0xff, 0xfe], &little[..]].concat(), "UTF-16"),
        (little, "UTF-16"),
        ([&[0xfe, 0xff], &wide(u16::to_be_bytes)[..]].concat(), "UTF-16"),
        (text.replace('\n', "\r").into_bytes(), "UTF-8"),
    ] {
        let table = Table::parse("t.csv", bytes).unwrap();
        assert_eq!(table.layout().encoding, name);
        let column = table.require_column(&["temp"]).unwrap();
        assert_eq!(table.column::<TemperatureDimension>(column, None).unwrap(), [293.65], "{name}");
    }
    for (bytes, part) in [
        (&b"PK\x03\x04 ..."[..], "workbook (.xlsx, .ods)"),
        (&[0xd0, 0xcf, 0x11, 0xe0, 1], "an old Office"),
        (&[1, 2, 3, 0, 0, 0, 0, 7], "a binary file"),
    ] {
        let error = Table::parse("t.csv", bytes.to_vec()).unwrap_err().to_string();
        assert!(error.contains(part) && error.contains("as CSV"), "{error}");
    }
}

/// Mettler STARe: between blanks, units right-aligned below some of the headings.
#[test]
fn units_below_headings_between_blanks() {
    let text = "Curve Name:\n  !&PA12 cooling\nCurve Values:\n\
                \x20    Index             t            Ts         Value\n\
                \x20                   [s]          [°C]          [mW]\n\
                \x20        0             0       200.012        -0.123\n\
                \x20        1            60       199.012        -0.125\n";
    let table = parse(text);
    let units: Vec<_> = table.headings.iter().map(|heading| heading.unit.as_deref()).collect();
    assert_eq!(units, [None, Some("s"), Some("°C"), Some("mW")]);
    assert_eq!(
        table.column::<TimeDimension>(table.require_column(&["time", "t"]).unwrap(), None).unwrap(),
        [0.0, 60.0]
    );
    assert_eq!((table.line(1), table.layout().heading_line), (7, 4));
}

#[test]
fn headings() {
    for (text, name, unit) in [
        ("time [min]", "time", Some("min")),
        ("Time (min)", "Time", Some("min")),
        ("Temp./°C", "Temp.", Some("°C")),
        ("DSC/(mW/mg)", "DSC", Some("mW/mg")),
        ("Heat Flow (W/g)", "Heat Flow", Some("W/g")),
        ("Stress, MPa", "Stress", Some("MPa")),
        ("Stress (nominal) [MPa]", "Stress (nominal)", Some("MPa")),
        ("Strain (engineering)", "Strain (engineering)", None),
        ("alpha [-]", "alpha", Some("")),
        ("time_fs", "time_fs", None),
        ("S11 [GPa]", "S11", Some("GPa")),
        ("stress_N/mm^2", "stress_N", Some("mm^2")),
        ("stress, xx [Pa]", "stress, xx", Some("Pa")),
    ] {
        let found = &heading::read(&[text.to_owned()], &[])[0];
        assert_eq!((found.name.as_str(), found.unit.as_deref()), (name, unit), "{text}");
    }
    for (written, known) in
        [("N/mm2", "N/mm^2"), ("ºC", "degC"), ("minutes", "min"), ("(mm/mm)", ""), ("mPa", "mPa")]
    {
        assert_eq!(plain_unit(written), known);
    }
}

#[test]
fn refusals_say_how_the_table_was_understood() {
    for (text, parts) in [
        ("strain;stress [MPa]\n0,1;1,5\n0.2;2,5\n", ["t.csv:3: column 1", "a decimal point, where"]),
        ("strain;stress [MPa]\n0.1;1.5\n0.2;2,5\n", ["found \"2,5\"", "separator `;`, decimal point"]),
        ("strain,stress [MPa]\n0,1,1,5\n", ["t.csv:2: row: found \"4 cells\"", "export with `;`"]),
        ("strain,stress [MPa]\n0.1,1\n0.2\n", ["t.csv:3: row: found \"1 cells\"", "2, as the headings have"]),
        ("strain,stress [MPa]\n0.1,\n", ["t.csv:2: column 2", "the cell is blank"]),
        ("strain,stress [MPa]\n0.1,1\nstrain,stress [MPa]\n", ["t.csv:3", "a second table begins here"]),
        ("strain,stress [MPa]\n0.1,1 MPa\n", ["found \"1 MPa\"", "units stand in the heading"]),
        ("strain,stress\n0.1,1\n", ["t.csv:1: unit of column 2, `stress`", "has no unit"]),
        ("strain,stress [kg]\n0.1,1\n", ["unit of column 2", "a stress is needed"]),
        ("0.1,1\n0.2,2\n", ["t.csv:1: headings: found \"0.1, 1\"", "a line of headings"]),
        ("", ["headings: found \"an empty file\"", "a line of headings"]),
        (
            "strain,strain,stress [MPa]\n1,1,1\n",
            ["found \"strain,strain,stress [MPa]\"", "one column `strain"],
        ),
        ("strain,stress [MPa]\nnan,1\n", ["found \"nan\"", "not a finite number"]),
        ("strain;stress [MPa]\n1;1.234.567,5\n2;1,5,5\n", ["found \"1,5,5\"", "separators of thousands"]),
    ] {
        let error = refused(text);
        assert!(parts.iter().all(|part| error.contains(part)), "{error}");
    }
}

/// 50,000 rows: time grows with their number, not with the square.
#[test]
fn many_rows() {
    let mut text = String::from("time [s];value;note\n");
    for i in 0..50_000 {
        text += &format!("{i};{},5;n{i}\n", i % 7);
    }
    let table = parse(&text);
    let values = table.column::<RatioDimension>(1, None).unwrap();
    assert_eq!((table.rows(), values[49_999], table.line(49_999)), (50_000, 5.5, 50_001));
}

//! Tests of tables of torsion.

use super::*;
use crate::constitutive::hyperelastic::{Deviation, MooneyRivlin};

fn format(length: Option<f64>, stretch: Option<f64>) -> TestFormat {
    let cylinder = TestCylinder { radius: 5e-3, length, stretch };
    TestFormat { mode: Some(Mode::Torsion), cylinder: Some(cylinder), ..TestFormat::default() }
}

fn read(text: &str, format: &TestFormat) -> Result<ImportedTest, crate::constitutive::Error> {
    TestData::parse_as("t.csv", text.as_bytes().to_vec(), format)
}

/// M = πψR⁴(C₁ + C₂), N = −½πψ²R⁴(C₁ + 2C₂), in three sets of units.
#[test]
fn torque_and_force_of_a_cylinder() {
    let [a, b] = [0.2e6, 0.05e6];
    let law = MooneyRivlin::new(a, b).unwrap();
    let (radius, length, angle) = (5e-3_f64, 40e-3, 6.0_f64);
    let twist = angle / length;
    let torque = PI * twist * radius.powi(4) * (a + b);
    let force = -0.5 * PI * twist * twist * radius.powi(4) * (a + 2.0 * b);
    for (text, length) in [
        (format!("twist [rad/m],torque [N m],axial force [N]\n{twist},{torque},{force}\n"), None),
        (
            format!(
                "angle [deg];torque [N mm];force [kN]\n{};{};{}\n",
                angle.to_degrees(),
                1e3 * torque,
                1e-3 * force
            ),
            Some(length),
        ),
        (format!("twist [rad/mm],moment [N*mm],force [N]\n{},{},\n", -1e-3 * twist, -1e3 * torque), None),
    ] {
        let reading = read(&text, &format(length, None)).unwrap();
        let state = reading.table.states[0];
        let found = state.predict(&law).unwrap();
        for axis in (0..2).filter(|&axis| state.nominal[axis] != 0.0) {
            assert!((found[axis] / state.nominal[axis] - 1.0).abs() < 1e-9, "{text}{state:?} {found:?}");
        }
        let shear = state.cylinder().unwrap().shear;
        assert!((shear / (twist * radius) - 1.0).abs() < 1e-12, "{shear}");
    }
}

#[test]
fn rows_notes_and_weights() {
    let text = "# source: mine\nstretch,twist [rad/m],torque [N mm],force [N]\n1,0,0,0\n1,100,,\n\
                1.2,100,80,\n1,-100,-90,0.4\n1,50,0,-1\n";
    let reading = read(text, &format(None, None)).unwrap();
    assert_eq!((reading.table.states.len(), reading.table.measurements()), (4, 4));
    assert!((reading.table.states[1].cylinder().unwrap().stretch - 1.2).abs() < 1e-12);
    let notes = reading.notes.join("; ");
    for part in
        ["1 rows without", "1 twists with a torque of 0", "1 twists below 0", "1 axial forces are above 0"]
    {
        assert!(notes.contains(part), "{notes}");
    }
    assert!(reading.description.contains("radius 5.0000 mm; shear at its surface up to 0.5000"));
    let weighted = TestFormat { deviation: Deviation::parse("2 %").ok(), ..format(None, None) };
    let weighted = read(text, &weighted).unwrap().table;
    let shares = weighted.states[1..]
        .iter()
        .map(|state| weighted.deviation.unwrap() / state.roots[0] / state.nominal[0].abs());
    assert!(shares.zip([0.02; 2]).all(|(found, share)| (found / share - 1.0).abs() < 1e-12));
}

/// Columns of other quantities beside a name do not count.
#[test]
fn columns_beside_the_torque() {
    let text = "twist [rad/m],twist rate [rad/s],torque [N mm],torque sd [N mm]\n90,1,80,2\n";
    assert_eq!(read(text, &format(None, None)).unwrap().table.measurements(), 1);
    let gel = read("twist [rad/m],torque [N mm]\n90,0.08\n", &format(None, None)).unwrap();
    assert!(gel.notes[0].contains("less than that of a rubber"), "{:?}", gel.notes);
}

#[test]
fn bad_tables_of_torsion() {
    let plain = format(None, None);
    let bare = TestFormat { cylinder: None, ..plain.clone() };
    let error = read("stretch,stress [MPa]\n2,1\n", &bare).unwrap_err().to_string();
    assert!(error.contains("the radius of the cylinder"), "{error}");
    for (text, format, part) in [
        ("angle [deg],torque [N m]\n1,1\n", &plain, "`length`, the undeformed length"),
        ("twist [rad/m],torque [N m]\n1,1\n", &format(Some(0.1), None), "has a `length`"),
        ("twist,torque [N m]\n1,1\n", &plain, "unit of column 1, `twist`"),
        ("twist [rad/m],torque\n1,1\n", &plain, "unit of column 2, `torque`"),
        ("twist [rad/m],torque [N]\n1,1\n", &plain, "a torque"),
        ("twist [rad/m],torque [N m],force [MPa]\n1,1,1\n", &plain, "a force"),
        ("twist [rad/m],stress [MPa]\n1,1\n", &plain, "one column `torque [unit]`"),
        ("stretch,stress [MPa]\n1,1\n", &plain, "one column `twist [unit]`"),
        ("twist [rad/m],torque [N m]\n1,x\n", &plain, "line 2: column 2, `torque [N m]`: found `x`"),
        ("twist [rad/m],torque [N m]\n1,1\n2,-1\n", &plain, "line 3: column 2, `torque [N m]`: found `-1`"),
        ("twist [rad/m],torque [N m]\n1e200,1\n", &plain, "of a finite shear"),
        ("twist [rad/m],torque [N m]\n1,0\n", &plain, "a torque other than zero"),
        ("twist [rad/m],torque [N m],stretch\n1,1,0\n", &plain, "a stretch of 0.3 to 20"),
        ("twist [rad/m],torque [N mm],stretch\n90,80,125\n", &plain, "for per cent use the heading"),
        ("twist [rad/m],torque [N mm],stretch [%]\n90,80,25\n", &plain, "1 at the free length"),
        (
            "twist [rad/m],torque [N m]\n45,40\n90,80\n",
            &plain,
            "line 3: column 2, `torque [N m]`: found `80`; allowed: torques of a shear modulus",
        ),
        ("twist [rad/m],twist [deg/m],torque [N mm]\n90,80,80\n", &plain, "columns 1, 2: found"),
        (
            "twist [rad/m],torque [N mm],moment [N m]\n90,80,0.08\n",
            &plain,
            "line 1: columns 2, 3: found `torque [N mm], moment [N m]`",
        ),
        ("twist_rad_per_m,twist [deg/m],torque [N mm]\n90,80,80\n", &plain, "found `twist_rad_per_m, tw"),
        ("twist [rad/m],torque [N mm],torque 2 [N mm]\n90,80,80\n", &plain, ", torque 2 [N mm]`"),
        ("twist [rad/m],torque [N mm],force_N\n90,80,-1\n", &plain, "a heading `axial force [N]`"),
        ("twist [rad/m],torque [N mm],force [N],normal force [N]\n90,80,-1,-1\n", &plain, "columns 3, 4"),
        ("twist [rad/m],torque [N m],stretch\n1,1,1\n", &format(None, Some(1.1)), "not both"),
        ("twist [rad/m],torque [N m],strain [%]\n1,1,25\n", &plain, "in place of a strain"),
        ("twist [rad/m],torque [N m]\n0,5\n90,25\n", &plain, "no torque at a twist of 0"),
    ] {
        let error = read(text, format).unwrap_err().to_string();
        assert!(error.contains(part), "{text}{error}");
    }
}

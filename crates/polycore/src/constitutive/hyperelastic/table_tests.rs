use super::*;

fn read(text: &str, format: &TestFormat) -> Result<ImportedTest, String> {
    TestData::parse_as("t.csv", text.as_bytes().to_vec(), format).map_err(|error| error.to_string())
}

fn plain(text: &str) -> ImportedTest {
    read(text, &TestFormat::default()).unwrap_or_else(|error| panic!("{text}\n{error}"))
}

/// Reads the layouts that the programs have always written.
#[test]
fn both_layouts_and_any_unit_of_stress() {
    let uniaxial = TestData::parse("t", "# source: me, 2024\nstretch,nominal_kPa\n1,0\n4, 1500\n").unwrap();
    assert_eq!(uniaxial.source, "me, 2024");
    let expected = TestState::new(Mode::Uniaxial, [4.0, 0.5], [1.5e6, 0.0]);
    assert_eq!(uniaxial.states[1], expected);
    assert_eq!(uniaxial.measurements(), 1);
    let text = "stretch_1,stretch_2,nominal_1_MPa,nominal_2_N/mm^2\n2,1,0.5,0.25\n";
    let biaxial = TestData::parse("t", text).unwrap();
    assert_eq!(biaxial.states[0].nominal, [0.5e6, 0.25e6]);
    assert_eq!((biaxial.source.as_str(), biaxial.states[0].mode), ("", Mode::Biaxial));
    let text = "mode,stretch,nominal_MPa\nuniaxial,4,1.5\nequibiaxial,2,1\npure-shear,3,1\npure-shear,1,0\n";
    let modes = TestData::parse("t", text).unwrap();
    let stretches: Vec<[f64; 2]> = modes.states.iter().map(|state| state.stretches).collect();
    assert_eq!(stretches, [[4.0, 0.5], [2.0, 2.0], [3.0, 1.0], [1.0, 1.0]]);
    assert_eq!(modes.measurements(), 3);
    let strip = modes.select(Mode::PureShear).unwrap();
    assert_eq!((strip.states.len(), strip.measurements()), (2, 1));
    assert!(biaxial.select(Mode::Uniaxial).is_err());
}

/// Stress in simple shear: μγ of a neo-Hookean law, 2(C₁ + C₂)γ of a Mooney–Rivlin law.
#[test]
fn simple_shear_is_data() {
    let text = "mode,strain,stress_MPa\nsimple shear,0.5,0.2\nSS,1,0.4\nsimple-shear,2.5,1.0\n";
    let table = plain(text).table;
    assert!(table.states.iter().all(|state| state.mode == Mode::SimpleShear && state.stretches[1] == 1.0));
    let golden = 0.5 + 1.25_f64.sqrt();
    assert!((table.states[1].stretches[0] - golden).abs() < 1e-15);
    let measured: Vec<f64> = table.states.iter().flat_map(TestState::measured).collect();
    assert!(measured.iter().zip([0.2e6, 0.4e6, 1e6]).all(|(found, tau)| (found - tau).abs() < 1e-9));
    for key in ["neo-hookean", "mooney-rivlin"] {
        let found = super::super::fit::fit(super::super::model(key).unwrap(), &table).unwrap();
        assert!((found.law.shear_modulus() / 0.4e6 - 1.0).abs() < 1e-8 && found.rms < 1e-3, "{key}");
    }
    let format = TestFormat { mode: Some(Mode::SimpleShear), ..TestFormat::default() };
    assert_eq!(read("stretch,nominal_MPa\n-0.5,-0.2\n", &format).unwrap().table.measurements(), 1);
}

/// λ = 1.25 and 1.5 at 0.5 and 0.75 MPa, as laboratories write it.
#[test]
fn strains_and_stresses_of_laboratories() {
    let log = [1.25_f64.ln(), 1.5_f64.ln()];
    let natural = format!("true strain,true stress [MPa]\n{},0.625\n{},1.125\n", log[0], log[1]);
    for (text, parts) in [
        ("stretch,nominal_MPa\n1.25,0.5\n1.5,0.75\n", "stretch and nominal stress; stretches 1.25"),
        ("Strain (%);Stress (MPa)\n25;0,5\n50;0,75\n", "engineering strain and nominal stress (assumed;"),
        (
            "Stress [kPa],Engineering Strain\n500,0.25\n750,0.5\n",
            "engineering strain and nominal stress (stress assumed;",
        ),
        ("lambda\tCauchy stress (N/mm²)\n1.25\t0.625\n1.5\t1.125\n", "stretch and true stress; stretches"),
        (&natural, "true strain and true stress"),
        ("Dehnung;Spannung\n%;MPa\n25,0;0,5\n50,0;0,75\n", "units in line 2"),
        ("strain_%,stress_MPa\n25,0.5\n50,0.75\n", "columns `strain_%`, `stress_MPa`"),
        (
            "Elongation [%],Force [N],Stress [MPa],True stress [MPa]\n25,3,0.5,9\n50,4,0.75,9\n",
            "`Stress [MPa]`",
        ),
        ("strain [%],stress [MPa]\n25,0.5\n30,\n50,0.75\n", "engineering strain"),
        ("λ1 PK1/MPa\n1.25 0.5\n1.5 0.75\n", "separated by blanks"),
    ] {
        let reading = plain(text);
        assert!(reading.description.contains(parts), "{}", reading.description);
        let states = &reading.table.states;
        assert_eq!(states.len(), 2, "{text}");
        for (state, [stretch, nominal]) in states.iter().zip([[1.25, 0.5e6], [1.5, 0.75e6]]) {
            assert!((state.stretches[0] - stretch).abs() < 1e-15, "{text}: {state:?}");
            assert!((state.nominal[0] - nominal).abs() < 1e-9 * nominal, "{text}: {state:?}");
        }
    }
}

/// Names of tests, compression of either sign, and a test that only the scene names.
#[test]
fn tests_and_compression() {
    let text = "Test;Specimen;Strain (%);Stress (MPa)\nuniaxial;1;25;0.5\nPlanar \
                tension;1;25;0.5\nbiaxial;2;25;0.5\n\
                Uniaxial compression;1;20;0.4\n";
    let reading = plain(text);
    let found: Vec<(Mode, f64, f64)> =
        reading.table.states.iter().map(|state| (state.mode, state.stretches[0], state.nominal[0])).collect();
    let expected = [
        (Mode::Uniaxial, 1.25, 0.5e6),
        (Mode::PureShear, 1.25, 0.5e6),
        (Mode::Equibiaxial, 1.25, 0.5e6),
        (Mode::Uniaxial, 0.8, -0.4e6),
    ];
    assert_eq!(found, expected);
    assert_eq!(reading.notes.len(), 2, "{:?}", reading.notes);
    for text in [
        "stretch,nominal_MPa\n0.8,-0.4\n0.9,-0.2\n",
        "stretch,nominal_MPa\n0.8,0.4\n0.9,0.2\n",
        "compressive strain,compressive stress [MPa]\n0.2,0.4\n0.1,0.2\n",
        "strain [%],stress [MPa]\n-20,-0.4\n-10,-0.2\n",
        "strain [%],stress [MPa]\n-20,0.4\n-10,0.2\n",
        // a test number is no name of a test
        "test,strain [%],stress [MPa]\n1,-20,-0.4\n2,-10,-0.2\n",
    ] {
        let states = plain(text).table.states;
        assert_eq!([states[0].stretches[0], states[1].stretches[0]], [0.8, 0.9], "{text}");
        assert_eq!([states[0].nominal[0], states[1].nominal[0]], [-0.4e6, -0.2e6], "{text}");
    }
    let format = TestFormat { mode: Some(Mode::Equibiaxial), ..TestFormat::default() };
    assert_eq!(read("strain,stress [MPa]\n1,1\n", &format).unwrap().table.states[0].stretches, [2.0, 2.0]);
    // specimens side by side, of different lengths
    let text = "strain 1,stress 1 [MPa],strain 2,stress 2 [MPa]\n1,1,0.5,0.5\n2,2,,\n";
    assert!(read(text, &TestFormat::default()).unwrap_err().contains("if these are specimens side by side"));
    let second = TestFormat {
        strain_column: Some("strain 2".into()),
        stress_column: Some("4".into()),
        ..TestFormat::default()
    };
    let reading = read(text, &second).unwrap();
    assert_eq!((reading.table.states.len(), reading.table.states[0].nominal[0]), (1, 0.5e6));
    assert_eq!(reading.notes, ["1 rows without a stress are left out"]);
    let same = "strain,stress [MPa],strain,stress [MPa]\n1,1,0.5,0.5\n2,2,1,n/a\n";
    let third = |column: &str| TestFormat { strain_column: Some(column.into()), ..second.clone() };
    assert!(read(same, &third("strain")).unwrap_err().contains("the number of one of the columns"));
    assert_eq!(read(same, &third("3")).unwrap().table.states[0].stretches[0], 1.5);
    // a stress of two that was not measured
    let text = "lambda_1,lambda_2,stress_1 [MPa],stress_2 [MPa]\n2,1,0.5,\n2,2,0.5,0.5\n";
    let states = plain(text).table.states;
    assert_eq!((states[0].nominal, states[1].nominal), ([0.5e6, 0.0], [0.5e6, 0.5e6]));
}

/// Keys resolve what one heading leaves ambiguous.
#[test]
fn keys_settle_what_headings_leave_open() {
    let text = "Strain A,Strain B,Stress\n0.25,0.5,0.5\n0.5,1,0.75\n";
    let error = read(text, &TestFormat::default()).unwrap_err();
    assert!(error.contains("one strain, or `strain_column"), "{error}");
    let column = TestFormat { strain_column: Some("Strain B".into()), ..TestFormat::default() };
    assert!(read(text, &column).unwrap_err().contains("`stress_unit = \"MPa\"`"));
    let all = TestFormat {
        stress: Some(TestStressMeasure::True),
        stress_unit: Some("kPa".into()),
        strain: Some(StrainMeasure::Engineering),
        ..column
    };
    let state = read(text, &all).unwrap().table.states[1];
    assert_eq!((state.stretches[0], state.nominal[0]), (2.0, 375.0));
    let natural = TestFormat {
        strain: Some(StrainMeasure::True),
        stress: Some(TestStressMeasure::Nominal),
        ..TestFormat::default()
    };
    let state = read("strain,stress [Pa]\n0.5,3\n", &natural).unwrap().table.states[0];
    assert_eq!(state.stretches[0], 0.5_f64.exp());
}

/// Rows after a break are left out, those of an unloading are kept.
#[test]
fn what_follows_the_break_is_left_out() {
    let torn = "stretch,nominal_MPa\n1.5,0.3\n2,0.6\n2.5,1\n2.52,0.2\n2.6,0.01\n";
    let reading = plain(torn);
    assert_eq!(reading.table.states.len(), 3);
    assert!(
        reading.notes[0]
            .starts_with("warning: 2 rows after the largest stress left out, from the stretch 2.5200")
    );
    for whole in [
        "stretch,nominal_MPa\n1.5,0.3\n2,0.6\n2.5,1\n2.2,0.5\n1.8,0.2\n",
        "stretch,nominal_MPa\n1.5,0.3\n2,0.6\n2.5,1\n2.6,0.95\n",
        "stretch,nominal_MPa\n1.5,0.3\n2,0.6\n1.2,0.1\n1.6,0.3\n2.1,0.65\n",
        "mode,stretch,nominal_MPa\nuniaxial,2.5,1\nequibiaxial,2.5,0.1\n",
    ] {
        assert!(plain(whole).notes.is_empty(), "{whole}");
    }
    let two = plain("stretch,nominal_MPa\n2,0.6\n2.5,1\n2.52,0.1\n1.5,0.3\n2,0.6\n2.6,1.1\n2.7,0\n");
    let left: Vec<f64> = two.table.states.iter().map(|state| state.stretches[0]).collect();
    assert_eq!(left, [2.0, 2.5, 1.5, 2.0, 2.6]);
}

#[test]
fn bad_tables_are_refused_with_the_line() {
    for (text, message) in [
        ("stretch,force_N\n1,0\n", "found `stretch,force_N`"),
        ("Displacement [mm],Force [N]\n1,0\n", "divide forces by the undeformed area"),
        ("stretch,nominal_kg\n1,0\n", "line 1: unit of column 2, `nominal_kg`"),
        ("stretch,nominal_MPa\n1,0\n2,x\n", "line 3: column 2, `nominal_MPa`: found `x`"),
        ("stretch,nominal_MPa\n1,0\n2,NaN\n", "line 3: column 2, `nominal_MPa`: found `NaN`"),
        ("stretch,nominal_MPa\n-2,1\n", "line 2: column 1, `stretch`: found `-2`"),
        ("stretch,nominal_MPa\n1,2,3\n", "3 cells"),
        ("mode,stretch,nominal_MPa\ntorsion,1,0\n", "found `torsion`; allowed: a test: `uniaxial`"),
        ("stretch,nominal_MPa\n1,0\n", "a stress other than zero"),
        ("", "headings: found `an empty file`"),
        ("strain [mm],stress [MPa]\n1,0.1\n", "unit of column 1"),
        ("strain,true stress [MPa]\n0.1,0.1\n", "`strain = \"engineering\"` or"),
        ("true strain,stress [MPa]\n0.1,0.1\n", "`stress = \"nominal\"` or"),
        ("strain,stress [MPa]\n10,0.1\n100,1\n", "for per cent use the heading `strain [%]`"),
        ("strain,stress [MPa]\n1,0\n1.5,0.4\n2,0.6\n", "is this a stretch?"),
        ("stretch,nominal_MPa\n0.05,0.057\n0.1,0.109\n0.6,0.48\n1.2,0.797\n", "is this a strain?"),
        ("stretch,nominal_MPa\n0.05,0.057\n0.1,0.109\n0.6,0.48\n", "is this a strain?"),
        ("stretch,nominal_MPa\n0,0\n0.1,0.109\n", "if this is a strain"),
        ("stretch,nominal_MPa\n1.1,-0.1\n1.5,-0.4\n", "the stiffness would be negative"),
    ] {
        let error = read(text, &TestFormat::default()).expect_err(text);
        assert!(error.starts_with("t.csv: ") && error.contains(message), "{error}");
    }
}

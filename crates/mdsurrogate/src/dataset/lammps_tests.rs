//! Output files of LAMMPS.

use super::md_tests::{read_file, refused};
use super::*;

/// Returns a log of two runs: equilibration, which prints no stress, and a pull along x with lateral
/// contraction.
pub(super) fn lammps_log(units: &str, runs: usize) -> String {
    let mut text = format!("LAMMPS (2 Aug 2023 - Update 3)\n{units}atom_style charge\nrun 100\n");
    text += "Per MPI rank memory allocation (min/avg/max) = 5.1 | 5.1 | 5.1 Mbytes\n   Step          Temp\n";
    text += "         0   300.1\n       100   299.2\nLoop time of 1.2 on 4 procs for 100 steps with 500 \
        atoms\n\n";
    for run in 0..runs {
        text += "Per MPI rank memory allocation (min/avg/max) = 5.1 | 5.1 | 5.1 Mbytes\n";
        text += "   Step  Time Temp  Lx  Ly  Lz  Pxx  Pyy  Pzz  Pxy  Pxz  Pyz\n";
        for k in 0..5 {
            let x = f64::from(k);
            let size = 1.0 + 0.1 * run as f64;
            let lengths = [20.0 * (1.0 + 0.01 * x), 30.0 * (1.0 - 0.002 * x), 40.0].map(|l| l * size);
            text += &format!(
                " {} {} 300 {} {} {} {} 1.5 -2 0.5 0 0\n",
                100 + 100 * k,
                0.1 * x,
                lengths[0],
                lengths[1],
                lengths[2],
                -1000.0 * x - run as f64
            );
            if k == 2 {
                text += "WARNING: Fix halt condition (src/fix.cpp:1)\n";
            }
        }
        text += "Loop time of 3.2 on 4 procs for 400 steps with 500 atoms\n";
    }
    text
}

#[test]
fn logs_of_lammps() {
    let options = ReadOptions::default;
    let set = read_file("log.lammps", &lammps_log("units           metal\n", 1), &options()).unwrap();
    assert_eq!((set.paths.len(), set.len(), set.paths[0].id.as_str()), (1, 5, "log.lammps"));
    let row = &set.paths[0].rows[3];
    // units of metal: bar and ps
    assert!(
        (row.cauchy[0] / 300e6 - 1.0).abs() < 1e-12 && (row.cauchy[1] + 1.5e5).abs() < 1e-9,
        "{}",
        row.cauchy
    );
    assert!((row.c - Voigt::new(1.03f64.powi(2), 0.994f64.powi(2), 1.0, 0.0, 0.0, 0.0)).amax() < 1e-12);
    assert!((row.time / 0.3e-12 - 1.0).abs() < 1e-12);
    let line = &set.provenance[0];
    for part in ["1 of 2 blocks", "units metal", "σ = −p", "first row is undeformed", "1 other lines"] {
        assert!(line.contains(part), "{line}");
    }
    let commented = lammps_log("units metal # eV, ps, bar\n", 1);
    assert!(read_file("log", &commented, &options()).unwrap().provenance[0].contains("units metal"));
    // units must be given, and must not contradict each other
    assert!(refused(read_file("log", &lammps_log("", 1), &options())).contains("unknown units"));
    let with_units = |units| ReadOptions { units: Some(units), ..options() };
    let set = read_file("log", &lammps_log("", 1), &with_units(LammpsUnits::Real)).unwrap();
    assert!((set.paths[0].rows[3].cauchy[0] / 303.975e6 - 1.0).abs() < 1e-12);
    assert!(
        refused(read_file("log", &lammps_log("units metal\n", 1), &with_units(LammpsUnits::Real)))
            .contains("`units metal`")
    );
    assert!(refused(read_file("log", &lammps_log("units lj\n", 1), &options())).contains("`units lj`"));
    // several runs: the undeformed row must be given
    let two = lammps_log("units real\n", 2);
    let error = refused(read_file("log", &two, &options()));
    assert!(
        error.contains("2 runs and an unknown undeformed row") && error.contains("reference = \"run\""),
        "{error}"
    );
    let first = |set: Dataset| set.paths.iter().map(|path| path.rows[0].c[0]).collect::<Vec<_>>();
    let own = ReadOptions { origin: Some(BoxReference::Run), ..options() };
    assert_eq!(first(read_file("log", &two, &own).unwrap()), [1.0, 1.0]);
    let of_file = ReadOptions { origin: Some(BoxReference::File), ..options() };
    let set = read_file("log", &two, &of_file).unwrap();
    // one path: the second run continues the first
    assert_eq!((set.paths.len(), set.len(), set.paths[0].id.as_str()), (1, 10, "log"));
    assert!((set.paths[0].rows[5].c[0] - 1.21).abs() < 1e-12);
    // a row repeated at the end of one run and the start of the next counts once
    let one = lammps_log("units real\n", 1);
    let rows: Vec<&str> = one.lines().filter(|line| line.split_whitespace().count() == 12).collect();
    let again = format!("{one}{}\n{}\n{}\nLoop time of 1\n", rows[0], rows[5], rows[1]);
    assert_eq!(read_file("log", &again, &of_file).unwrap().len(), 6);
    let zero = ReadOptions {
        names: ["pxy", "pxz", "pyz"].map(|name| (name.to_owned(), "0".to_owned())).into(),
        ..options()
    };
    let without = lammps_log("units metal\n", 1).replace("Pxy  Pxz  Pyz", "Density Enthalpy PotEng");
    assert!(refused(read_file("log", &without, &options())).contains("pxy = \"0\""));
    assert_eq!(read_file("log", &without, &zero).unwrap().paths[0].rows[3].cauchy[3], 0.0);
    let chosen = ReadOptions { blocks: vec![3], ..options() };
    let set = read_file("log", &two, &chosen).unwrap();
    assert_eq!((set.len(), set.paths[0].rows[0].c[0]), (5, 1.0));
    assert!(
        refused(read_file("log", &two, &ReadOptions { blocks: vec![4], ..options() })).contains("1 to 3")
    );
    // bounds instead of lengths, and the built-in compute of pressure
    let bounds = lammps_log("units metal\n", 1).replace(
        "Pxx  Pyy  Pzz  Pxy  Pxz  Pyz",
        &(1..7).map(|k| format!(" c_thermo_press[{k}]")).collect::<String>(),
    );
    assert_eq!(
        read_file("log", &bounds, &options()).unwrap().paths[0].rows,
        read_file("log", &lammps_log("units metal\n", 1), &options()).unwrap().paths[0].rows
    );
    // missing stress, and tilts that are not printed
    let without = lammps_log("units metal\n", 1).replace("Pxy", "c_p[4]").replace(" Lx", " v_lx");
    let error = refused(read_file("log", &without, &options()));
    assert!(error.contains("without lx, pxy") && error.contains("names = {"), "{error}");
    let named = ReadOptions {
        names: [("lx", "v_lx"), ("pxy", "c_p[4]")].map(|(a, b)| (a.to_owned(), b.to_owned())).into(),
        ..options()
    };
    assert_eq!(read_file("log", &without, &named).unwrap().len(), 5);
    let own =
        lammps_log("units metal\n", 1).replace("Pxx  Pyy  Pzz  Pxy  Pxz  Pyz", "v_a v_b v_c v_d v_e v_f");
    let pairs =
        [("sxx", "v_a"), ("syy", "v_b"), ("szz", "v_c"), ("sxy", "v_d"), ("sxz", "v_e"), ("syz", "v_f")];
    let stresses = |stress_unit| ReadOptions {
        names: pairs.map(|(a, b)| (a.to_owned(), b.to_owned())).into(),
        stress_unit,
        ..options()
    };
    assert!(refused(read_file("log", &own, &stresses(None))).contains("Cauchy stress without a unit"));
    assert_eq!(read_file("log", &own, &stresses(Some(1e6))).unwrap().paths[0].rows[3].cauchy[0], -3e9);
    let tilted = lammps_log("units metal\n  triclinic box = (0 0 0) to (20 30 40) with tilt (0 0 0)\n", 1);
    assert!(refused(read_file("log", &tilted, &options())).contains("without columns of its tilts"));
    let multi = "LAMMPS (1 Jan 2024)\n------------ Step 0 ----- CPU = 0 (sec) -------------\nTotEng = -1 \
        KinEng = 2\n";
    assert!(
        refused(read_file("log", multi, &options())).contains("without thermo output in columns or yaml")
    );
}

#[test]
fn yaml_and_averages_of_lammps() {
    let real = ReadOptions { units: Some(LammpsUnits::Real), ..ReadOptions::default() };
    let yaml = "---\nkeywords: ['Step', 'Lx', 'Ly', 'Lz', 'Xy', 'Xz', 'Yz', 'Pxx', 'Pyy', 'Pzz', 'Pxy', \
        'Pxz', 'Pyz', ]\n\
                    data:\n\
          \x20 - [0, 10, 20, 30, 0, 0, 0, 1, 2, 3, 0, 0, 0, ]\n  - [50, 10, 20, 30, 4, 0, 0, 100, 2, 3, -80, \
          0, 0, ]\n\
         \x20 - [100, 10, 20, 30, -2, 0, 0, 100, 2, 3, -180, 0, 0, ]\n...\n";
    let set = read_file("thermo.yaml", yaml, &real).unwrap();
    let shears: Vec<f64> = set.rows().map(|row| row.c[3]).collect();
    // tilts of 4 and 8 over 20: −2 is flipped by the length of 10
    assert!((shears[1] - 0.2).abs() < 1e-12 && (shears[2] - 0.4).abs() < 1e-12, "{shears:?}");
    assert!((set.paths[0].rows[1].cauchy[3] / (80.0 * 101_325.0) - 1.0).abs() < 1e-12);

    let heading =
        "# Time-averaged data for fix out\n# TimeStep v_lx v_ly v_lz v_pxx v_pyy v_pzz v_pxy v_pxz v_pyz\n";
    let rows = |from: u64| {
        (0..4)
            .map(|k| format!("{} {} 20 30 {} 0 0 0 0 0\n", from + 100 * k, 10 + k, -100.0 * k as f64))
            .collect::<String>()
    };
    let named = |from: u64, origin| {
        let pairs = ["lx", "ly", "lz", "pxx", "pyy", "pzz", "pxy", "pxz", "pyz"]
            .map(|name| (name.to_owned(), format!("v_{name}")));
        read_file(
            "out.dat",
            &format!("{heading}{}", rows(from)),
            &ReadOptions { names: pairs.into(), origin, ..real.clone() },
        )
    };
    let error = refused(read_file("out.dat", &format!("{heading}{}", rows(0)), &real));
    assert!(error.contains("without lx, ly, lz, pxx") && error.contains("names = {"), "{error}");
    assert!((named(0, None).unwrap().paths[0].rows[2].c[0] - 1.44).abs() < 1e-12);
    // the first mean is over an interval in which the box moved
    assert!(refused(named(100, None)).contains("whose first row is a mean"));
    assert_eq!(named(100, Some(BoxReference::Run)).unwrap().len(), 4);
    let vector = "# Time-averaged data for fix 1\n# TimeStep Number-of-rows\n# Row c_1\n100 2\n1 3\n2 4\n";
    assert!(refused(read_file("v.dat", vector, &real)).contains("mode vector"));
    // separators without numbers
    for text in [
        "# TimeStep\n,\n,\n",
        "keywords: []\ndata:\n  - []\n  - []\n",
        "# TimeStep v_a\n",
        "keywords: ['Step', \n - [1\n",
    ] {
        refused(read_file("out.dat", text, &real));
    }
    // a job that restarts is another run
    let twice = format!("{heading}{0}{0}", rows(0)).replace("v_l", "l").replace("v_p", "p");
    let set = read_file("out.dat", &twice, &ReadOptions { origin: Some(BoxReference::Run), ..real });
    assert!(refused(set).contains("the same rows in the runs"));
}

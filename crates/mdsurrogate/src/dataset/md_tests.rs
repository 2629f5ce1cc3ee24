//! Tables of boxes, of F beside stresses of all kinds, and LAMMPS' own files.

use super::*;

fn file(name: &str, text: &str, options: &ReadOptions) -> Result<Dataset, Error> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join(name);
    std::fs::write(&path, text).unwrap();
    read(&path, options)
}

fn csv(text: &str) -> Result<Dataset, Error> {
    file("t.csv", text, &ReadOptions::default())
}

/// What an error says; the set read otherwise.
fn refused(found: Result<Dataset, Error>) -> String {
    let error = found.expect_err("refused");
    assert_eq!(polycore::case::Fault::exit_code(&error), 2);
    error.to_string()
}

/// A compressible neo-Hookean σ at F, Pa: μ 5 MPa, λ 20 MPa.
fn cauchy(f: &Tensor) -> Tensor {
    let j = f.determinant();
    (5e6 * (f * f.transpose() - Tensor::identity()) + 20e6 * j.ln() * Tensor::identity()) / j
}

fn s_of(f: &Tensor) -> Voigt {
    let c = polycore::tensor::voigt::from_stress(&(f.transpose() * f));
    let c = polycore::tensor::voigt::to_stress(&c);
    let inverse = c.try_inverse().unwrap();
    let s = 5e6 * (Tensor::identity() - inverse) + 10e6 * c.determinant().ln() * inverse;
    polycore::tensor::voigt::from_stress(&s)
}

/// Shears, stretches and turns of every kind.
fn gradients() -> Vec<Tensor> {
    (0..12)
        .map(|k| {
            let x = f64::from(k);
            Tensor::new(
                1.0 + 0.02 * x.sin(),
                0.1 * (2.0 * x).sin(),
                -0.05 * x.cos(),
                0.08 * (3.0 * x).cos(),
                1.0 - 0.03 * x.cos(),
                0.04,
                0.06 * x.sin(),
                -0.07 * (x + 1.0).cos(),
                1.0 + 0.05 * (x + 2.0).sin(),
            )
        })
        .collect()
}

fn row(numbers: impl IntoIterator<Item = f64>) -> String {
    numbers.into_iter().map(|number| format!("{number:?}")).collect::<Vec<_>>().join(",") + "\n"
}

const F: &str = "F11,F12,F13,F21,F22,F23,F31,F32,F33";
const BOX: &str = "run_id,sample,F11,F22,F33,lx,ly,lz,xy,xz,yz,avg_lx,avg_ly,avg_lz,avg_xy,avg_xz,avg_yz,avg_sxx,avg_syy,avg_szz,avg_sxy,avg_sxz,avg_syz\n";

/// A row of [`BOX`] at one instant and as a mean.
fn boxed(run: &str, sample: usize, f: [f64; 3], instant: [f64; 6], mean: [f64; 6]) -> String {
    let stress = [sample as f64 + 1.0, 0.0, 0.0, 5.0 * sample as f64, 0.0, 0.0];
    format!("{run},{sample},") + &row(f.into_iter().chain(instant).chain(mean).chain(stress))
}

/// Two runs of one cell at two temperatures: each has its own undeformed box, tilted or not.
#[test]
fn each_run_by_its_own_box() {
    for tilts in [[0.0; 3], [4.0, -3.0, 2.0]] {
        let mut text = BOX.to_owned();
        for (run, size) in [("cold", 1.0), ("hot", 1.05), ("press", 0.9)] {
            for sample in 0..4 {
                let f = [1.0 + 0.05 * sample as f64, 1.0, 1.0];
                let now =
                    [10.0 * f[0], 20.0, 30.0, tilts[0] * f[0], tilts[1] * f[0], tilts[2]].map(|x| x * size);
                text += &boxed(run, sample, f, now, now)
                    .replace(",1.0,0.0,0.0,0.0", &format!(",{size},0.0,0.0,0.0"));
            }
        }
        let set = csv(&text).unwrap();
        assert_eq!((set.paths.len(), set.len()), (3, 12));
        for path in &set.paths {
            for (sample, row) in path.rows.iter().enumerate() {
                let l = 1.0 + 0.05 * sample as f64;
                assert!(
                    (row.c - Voigt::new(l * l, 1.0, 1.0, 0.0, 0.0, 0.0)).amax() < 1e-12,
                    "{} {}",
                    path.id,
                    row.c
                );
            }
        }
        // the undeformed row of one run is missing: it is named
        let without: String =
            text.lines().filter(|line| !line.starts_with("hot,0")).map(|l| l.to_owned() + "\n").collect();
        let error = refused(csv(&without));
        assert!(error.contains("no row of run `hot` with F11 = F22 = F33 = 1"), "{error}");
        let first = ReadOptions { origin: Some(Origin::Run), ..ReadOptions::default() };
        let set = file("t.csv", &without, &first).unwrap();
        assert!((set.paths[1].rows[1].c[0] - (1.1f64 / 1.05).powi(2)).abs() < 1e-12);
    }
    // a tilt of the reference by a shear: F = H H₀⁻¹, here a further shear of γ in a cell tilted by 4
    let mut text = BOX.to_owned();
    for sample in 0..4 {
        let now = [10.0, 20.0, 30.0, 4.0 + 2.0 * sample as f64, 0.0, 0.0];
        text += &boxed("tilted", sample, [1.0; 3], now, now);
    }
    let set = csv(&text).unwrap();
    let last = &set.paths[0].rows[3];
    assert!((last.c - Voigt::new(1.0, 1.09, 1.0, 0.3, 0.0, 0.0)).amax() < 1e-14, "{}", last.c);
}

/// LAMMPS flips a box that is sheared beyond half its length.
#[test]
fn flips_are_undone() {
    let flipped = |tilt: f64| tilt - 20.0 * (tilt / 20.0).round();
    let of = |speed: f64, averaged: bool| {
        let mut text = BOX.to_owned();
        for sample in 0..9 {
            let tilt = speed * sample as f64;
            // a mean over an interval in which the box flips is the mean of both sides
            let steps = (0..=40).map(|part| flipped(tilt - speed * f64::from(part) / 40.0));
            let mean = if averaged && sample > 0 { steps.sum::<f64>() / 41.0 } else { flipped(tilt) };
            let at = |xy: f64| [20.0, 20.0, 20.0, xy, 0.0, 0.0];
            text += &boxed("s", sample, [1.0; 3], at(flipped(tilt)), at(mean));
        }
        csv(&text)
    };
    for speed in [2.0, 1.8, -2.0, 4.5, -1.3] {
        let set = of(speed, false).unwrap();
        for (sample, row) in set.paths[0].rows.iter().enumerate() {
            let shear = speed * sample as f64 / 20.0;
            assert!(
                (row.c[3] - shear).abs() < 1e-12 && (row.c[1] - 1.0 - shear * shear).abs() < 1e-12,
                "{}",
                row.c
            );
        }
        assert!(
            set.provenance[0].contains("flips of the tilted box undone in 1 runs"),
            "{:?}",
            set.provenance
        );
    }
    let error = refused(of(2.2, true));
    assert!(error.contains("between the two sides of a flip") && error.contains("instantaneous"), "{error}");
    // a step of more than half a length cannot be told from one the other way
    assert!(refused(of(9.0, false)).contains("too far apart"));
    // a box that turns back is not flipped
    let mut text = BOX.to_owned();
    for (sample, xy) in [0.0, 3.0, 6.0, 9.0, 6.0, 3.0, 0.0, -3.0, -6.0, -9.0].into_iter().enumerate() {
        let now = [20.0, 20.0, 20.0, xy, 0.0, 0.0];
        text += &boxed("s", sample, [1.0; 3], now, now);
    }
    assert!((csv(&text).unwrap().paths[0].rows[9].c[3] + 0.45).abs() < 1e-12);
}

/// One law in all measures: σ, −σ, P and S beside F give the same S, in every unit.
#[test]
fn stresses_beside_f() {
    let six = |t: Tensor| [t[(0, 0)], t[(1, 1)], t[(2, 2)], t[(0, 1)], t[(0, 2)], t[(1, 2)]];
    let pressure = ReadOptions { measure: Some(Measure::Pressure), ..ReadOptions::default() };
    for (heading, unit, options) in [
        ("sxx,syy,szz,sxy,sxz,syz", 1e6, ReadOptions::default()),
        (
            "avg_sxx [bar],avg_syy [bar],avg_szz [bar],avg_sxy [bar],avg_sxz [bar],avg_syz [bar]",
            1e5,
            ReadOptions::default(),
        ),
        ("sxx [kbar],syy [kbar],szz [kbar],sxy [kbar],sxz [kbar],syz [kbar]", 1e8, ReadOptions::default()),
        (
            "sxx [eV/Å³],syy [eV/Å^3],szz [eV/Å3],sxy [eV/angstrom^3],sxz [eV/A^3],syz [eV/Å³]",
            1.602_176_634e11,
            ReadOptions::default(),
        ),
        ("pxx [atm],pyy [atm],pzz [atm],pxy [atm],pxz [atm],pyz [atm]", -101_325.0, pressure.clone()),
        ("Pxx,Pyy,Pzz,Pxy,Pxz,Pyz", -1e5, ReadOptions { stress_unit: Some(1e5), ..pressure.clone() }),
        ("P11,P12,P13,P21,P22,P23,P31,P32,P33", 1e6, ReadOptions::default()),
        ("S11 [GPa],S22 [GPa],S33 [GPa],S12 [GPa],S13 [GPa],S23 [GPa]", 1e9, ReadOptions::default()),
    ] {
        let mut text = format!("{F},{heading}\n");
        for f in gradients() {
            let stress: Vec<f64> = match &heading[..3] {
                "P11" => (cauchy(&f) * f.try_inverse().unwrap().transpose() * f.determinant())
                    .transpose()
                    .as_slice()
                    .to_vec(),
                "S11" => s_of(&f).as_slice().to_vec(),
                _ => six(cauchy(&f)).to_vec(),
            };
            text += &row(f.transpose().as_slice().iter().copied().chain(stress.iter().map(|s| s / unit)));
        }
        let set = file("t.csv", &text, &options).unwrap_or_else(|error| panic!("{heading}: {error}"));
        for (row, f) in set.rows().zip(gradients()) {
            assert!((row.s - s_of(&f)).amax() < 1e-6 * 5e6, "{heading}: {} {}", row.s, s_of(&f));
        }
        if heading.starts_with("pxx") {
            let error = refused(csv(&text));
            assert!(
                error.contains("a pressure has the other sign") && error.contains("stress = \"pressure\""),
                "{error}"
            );
        }
        if heading.starts_with("Pxx") {
            assert!(refused(file("t.csv", &text, &pressure)).contains("pressure (σ = −p) without a unit"));
        }
        if heading.starts_with("P11") {
            let swapped = text.replacen("P12,P13,P21,P22,P23,P31,P32", "P21,P31,P12,P22,P32,P13,P23", 1);
            assert!(refused(csv(&swapped)).contains("the transpose of the first Piola"));
            let wrong = text.replacen("P11,P12,P13,P21", "P12,P11,P13,P21", 1);
            assert!(refused(csv(&wrong)).contains("P Fᵀ is not symmetric"));
        }
    }
    let error = refused(csv("F11,F22,F33,sxx\n1,1,1,0\n"));
    assert!(error.contains("all nine of F11") && error.contains("columns of zeros"), "{error}");
}

/// Decimal commas, semicolons, units below the headings and lengths in nm.
#[test]
fn tables_as_people_write_them() {
    let text = "Werkstoff;PA12\nrun_id;F11;F22;F33;lx;ly;lz;sxx;syy;szz;sxy;sxz;syz\n;;;;nm;nm;nm;kbar;kbar;kbar;kbar;kbar;kbar\n\
                a;1,0;1,0;1,0;2,0;2,0;2,0;0;0;0;0;0;0\na;1,1;1,0;1,0;2,2;2,0;2,0;1,5;0;0;0;0;0\n";
    let options = ReadOptions { columns: Columns::Instantaneous, ..ReadOptions::default() };
    let set = file("t.csv", text, &options).unwrap();
    let row = &set.paths[0].rows[1];
    assert!((row.c[0] - 1.21).abs() < 1e-12 && (row.cauchy[0] / 1.5e8 - 1.0).abs() < 1e-12);
    assert!(set.provenance[0].contains("separator `;`, decimal comma"), "{:?}", set.provenance);
    let given =
        ReadOptions { reference: Some(crate::kinematics::PeriodicBox::orthogonal([20.0; 3])), ..options };
    assert!((file("t.csv", text, &given).unwrap().paths[0].rows[1].c[0] - 1.21).abs() < 1e-12);
    let error = refused(file("t.csv", &text.replace("1,5;0", "1.5;0"), &given));
    assert!(error.contains("column `sxx`: found `1.5`") && error.contains("decimal comma"), "{error}");
}

/// Columns of one's own names.
#[test]
fn named_columns() {
    let names = |list: &[(&str, &str)]| ReadOptions {
        names: list.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())).collect(),
        ..ReadOptions::default()
    };
    let text = format!("{F},a,b,c,d,e,f\n1.1,0,0,0,1,0,0,0,1,7,0,0,0,0,0\n");
    let given = [("sxx", "a"), ("syy", "b"), ("szz", "c"), ("sxy", "d"), ("sxz", "e"), ("syz", "f")];
    assert_eq!(file("t.csv", &text, &names(&given)).unwrap().paths[0].rows[0].cauchy[0], 7e6);
    assert!(refused(file("t.csv", &text, &names(&[("sxx", "F111")]))).contains("did you mean `F11`"));
    assert!(refused(file("t.csv", &text, &names(&[("sx", "a")]))).contains("`sxx`"));
}

/// A log of two runs: equilibration, which prints no stress, and a pull along x with lateral contraction.
fn log(units: &str, runs: usize) -> String {
    let mut text = format!("LAMMPS (2 Aug 2023 - Update 3)\n{units}atom_style charge\nrun 100\n");
    text += "Per MPI rank memory allocation (min/avg/max) = 5.1 | 5.1 | 5.1 Mbytes\n   Step          Temp\n";
    text += "         0   300.1\n       100   299.2\nLoop time of 1.2 on 4 procs for 100 steps with 500 atoms\n\n";
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
    let set = file("log.lammps", &log("units           metal\n", 1), &options()).unwrap();
    assert_eq!((set.paths.len(), set.len(), set.paths[0].id.as_str()), (1, 5, "log.lammps"));
    let row = &set.paths[0].rows[3];
    // bar, and ps
    assert!(
        (row.cauchy[0] / 300e6 - 1.0).abs() < 1e-12 && (row.cauchy[1] + 1.5e5).abs() < 1e-9,
        "{}",
        row.cauchy
    );
    assert!((row.c - Voigt::new(1.03f64.powi(2), 0.994f64.powi(2), 1.0, 0.0, 0.0, 0.0)).amax() < 1e-12);
    assert!((row.time / 0.3e-12 - 1.0).abs() < 1e-12);
    let line = &set.provenance[0];
    for part in ["1 of 2 blocks", "units metal", "σ = −p", "first row is undeformed", "1 lines"] {
        assert!(line.contains(part), "{line}");
    }
    let commented = log("units metal # eV, ps, bar\n", 1);
    assert!(file("log", &commented, &options()).unwrap().provenance[0].contains("units metal"));
    // units must be told, and cannot be told twice differently
    assert!(refused(file("log", &log("", 1), &options())).contains("no word on its units"));
    let of = |units| ReadOptions { units: Some(units), ..options() };
    let set = file("log", &log("", 1), &of(LammpsUnits::Real)).unwrap();
    assert!((set.paths[0].rows[3].cauchy[0] / 303.975e6 - 1.0).abs() < 1e-12);
    assert!(refused(file("log", &log("units metal\n", 1), &of(LammpsUnits::Real))).contains("`units metal`"));
    assert!(refused(file("log", &log("units lj\n", 1), &options())).contains("`units lj`"));
    // which row is undeformed, of several runs
    let two = log("units real\n", 2);
    let error = refused(file("log", &two, &options()));
    assert!(
        error.contains("2 runs, and no word on which row is undeformed")
            && error.contains("reference = \"run\""),
        "{error}"
    );
    let first = |set: Dataset| set.paths.iter().map(|path| path.rows[0].c[0]).collect::<Vec<_>>();
    let own = ReadOptions { origin: Some(Origin::Run), ..options() };
    assert_eq!(first(file("log", &two, &own).unwrap()), [1.0, 1.0]);
    let of_file = ReadOptions { origin: Some(Origin::File), ..options() };
    let set = file("log", &two, &of_file).unwrap();
    // one path: the second run goes on where the first ended
    assert_eq!((set.paths.len(), set.len(), set.paths[0].id.as_str()), (1, 10, "log"));
    assert!((set.paths[0].rows[5].c[0] - 1.21).abs() < 1e-12);
    // the row that LAMMPS prints at the end of one run and at the start of the next is one
    let one = log("units real\n", 1);
    let rows: Vec<&str> = one.lines().filter(|line| line.split_whitespace().count() == 12).collect();
    let again = format!("{one}{}\n{}\n{}\nLoop time of 1\n", rows[0], rows[5], rows[1]);
    assert_eq!(file("log", &again, &of_file).unwrap().len(), 6);
    let zero = ReadOptions {
        names: ["pxy", "pxz", "pyz"].map(|name| (name.to_owned(), "0".to_owned())).into(),
        ..options()
    };
    let without = log("units metal\n", 1).replace("Pxy  Pxz  Pyz", "Density Enthalpy PotEng");
    assert!(refused(file("log", &without, &options())).contains("pxy = \"0\""));
    assert_eq!(file("log", &without, &zero).unwrap().paths[0].rows[3].cauchy[3], 0.0);
    let chosen = ReadOptions { blocks: vec![3], ..options() };
    let set = file("log", &two, &chosen).unwrap();
    assert_eq!((set.len(), set.paths[0].rows[0].c[0]), (5, 1.0));
    assert!(refused(file("log", &two, &ReadOptions { blocks: vec![4], ..options() })).contains("1 to 3"));
    // bounds instead of lengths, and LAMMPS' own compute of pressure
    let bounds = log("units metal\n", 1).replace(
        "Pxx  Pyy  Pzz  Pxy  Pxz  Pyz",
        &(1..7).map(|k| format!(" c_thermo_press[{k}]")).collect::<String>(),
    );
    assert_eq!(
        file("log", &bounds, &options()).unwrap().paths[0].rows,
        file("log", &log("units metal\n", 1), &options()).unwrap().paths[0].rows
    );
    // no stress, and a tilt that is not printed
    let without = log("units metal\n", 1).replace("Pxy", "c_p[4]").replace(" Lx", " v_lx");
    let error = refused(file("log", &without, &options()));
    assert!(error.contains("without lx, pxy") && error.contains("names = {"), "{error}");
    let named = ReadOptions {
        names: [("lx", "v_lx"), ("pxy", "c_p[4]")].map(|(a, b)| (a.to_owned(), b.to_owned())).into(),
        ..options()
    };
    assert_eq!(file("log", &without, &named).unwrap().len(), 5);
    let own = log("units metal\n", 1).replace("Pxx  Pyy  Pzz  Pxy  Pxz  Pyz", "v_a v_b v_c v_d v_e v_f");
    let pairs =
        [("sxx", "v_a"), ("syy", "v_b"), ("szz", "v_c"), ("sxy", "v_d"), ("sxz", "v_e"), ("syz", "v_f")];
    let stresses = |stress_unit| ReadOptions {
        names: pairs.map(|(a, b)| (a.to_owned(), b.to_owned())).into(),
        stress_unit,
        ..options()
    };
    assert!(refused(file("log", &own, &stresses(None))).contains("Cauchy stress without a unit"));
    assert_eq!(file("log", &own, &stresses(Some(1e6))).unwrap().paths[0].rows[3].cauchy[0], -3e9);
    let tilted = log("units metal\n  triclinic box = (0 0 0) to (20 30 40) with tilt (0 0 0)\n", 1);
    assert!(refused(file("log", &tilted, &options())).contains("whose tilt is not among the columns"));
    let multi = "LAMMPS (1 Jan 2024)\n------------ Step 0 ----- CPU = 0 (sec) -------------\nTotEng = -1 KinEng = 2\n";
    assert!(refused(file("log", multi, &options())).contains("without thermo output in columns or yaml"));
}

#[test]
fn yaml_and_averages_of_lammps() {
    let real = ReadOptions { units: Some(LammpsUnits::Real), ..ReadOptions::default() };
    let yaml = "---\nkeywords: ['Step', 'Lx', 'Ly', 'Lz', 'Xy', 'Xz', 'Yz', 'Pxx', 'Pyy', 'Pzz', 'Pxy', 'Pxz', 'Pyz', ]\ndata:\n\
         \x20 - [0, 10, 20, 30, 0, 0, 0, 1, 2, 3, 0, 0, 0, ]\n  - [50, 10, 20, 30, 4, 0, 0, 100, 2, 3, -80, 0, 0, ]\n\
         \x20 - [100, 10, 20, 30, -2, 0, 0, 100, 2, 3, -180, 0, 0, ]\n...\n";
    let set = file("thermo.yaml", yaml, &real).unwrap();
    let shears: Vec<f64> = set.rows().map(|row| row.c[3]).collect();
    // 4 of 20, then 8 of 20: −2 is a flip by the length of 10
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
        file(
            "out.dat",
            &format!("{heading}{}", rows(from)),
            &ReadOptions { names: pairs.into(), origin, ..real.clone() },
        )
    };
    let error = refused(file("out.dat", &format!("{heading}{}", rows(0)), &real));
    assert!(error.contains("without lx, ly, lz, pxx") && error.contains("names = {"), "{error}");
    assert!((named(0, None).unwrap().paths[0].rows[2].c[0] - 1.44).abs() < 1e-12);
    // the first mean is of an interval in which the box has moved
    assert!(refused(named(100, None)).contains("a mean after the start"));
    assert_eq!(named(100, Some(Origin::Run)).unwrap().len(), 4);
    let vector = "# Time-averaged data for fix 1\n# TimeStep Number-of-rows\n# Row c_1\n100 2\n1 3\n2 4\n";
    assert!(refused(file("v.dat", vector, &real)).contains("mode vector"));
    // nothing but separators
    for text in [
        "# TimeStep\n,\n,\n",
        "keywords: []\ndata:\n  - []\n  - []\n",
        "# TimeStep v_a\n",
        "keywords: ['Step', \n - [1\n",
    ] {
        refused(file("out.dat", text, &real));
    }
    // a job that begins anew is another run
    let twice = format!("{heading}{0}{0}", rows(0)).replace("v_l", "l").replace("v_p", "p");
    let set = file("out.dat", &twice, &ReadOptions { origin: Some(Origin::Run), ..real });
    assert!(refused(set).contains("with the same rows"));
}

/// Tables that a law was trained on are asked for again: F, boxes, logs and HDF5.
#[test]
fn strains_of_any_table() {
    let directory = tempfile::tempdir().unwrap();
    for (name, text, rows) in [
        ("f.csv", format!("{F},sxx\n1.1,0.1,0,0,1,0,0,0,1,5\n"), 1),
        (
            "b.csv",
            BOX.to_owned()
                + &boxed("r", 0, [1.0; 3], [1.0, 1.0, 1.0, 0.0, 0.0, 0.0], [1.1, 1.0, 1.0, 0.11, 0.0, 0.0]),
            1,
        ),
        ("log", log("units metal\n", 1), 5),
    ] {
        let path = directory.path().join(name);
        std::fs::write(&path, text).unwrap();
        let found = read_strains(&path).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(found.len(), rows);
        let c = Voigt::new(1.21, 1.01, 1.0, 0.11, 0.0, 0.0);
        assert!(name == "log" || name == "b.csv" || (found[0] - c).amax() < 1e-14, "{name}: {}", found[0]);
    }
}

/// Numbers of every width and order of bytes; C and S as tensors; F beside P.
#[cfg(feature = "hdf5")]
#[test]
fn hdf5_of_all_types() {
    use rust_hdf5::types::H5Type;
    use rust_hdf5::{H5File, H5Group};
    fn put<T: H5Type>(group: &H5Group, name: &str, shape: &[usize], data: Vec<T>) {
        group.new_dataset::<T>().shape(shape).create(name).unwrap().write_raw(&data).unwrap();
    }
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("d.h5");
    let rows: Vec<Tensor> = (0..6)
        .map(|k| {
            Tensor::identity() + Tensor::new(0.01, 0.02, 0.0, 0.0, -0.01, 0.0, 0.0, 0.0, 0.02) * f64::from(k)
        })
        .collect();
    let six: Vec<f64> = rows
        .iter()
        .flat_map(|f| polycore::tensor::voigt::from_stress(&(f.transpose() * f)).as_slice().to_vec())
        .collect();
    let nine: Vec<f64> = rows.iter().flat_map(|f| (f.transpose() * f).as_slice().to_vec()).collect();
    let whole: Vec<i32> = (0..36).map(|k| 1_000_000 + k).collect();
    let make = |fill: &dyn Fn(&H5Group)| {
        let file = H5File::create(&path).unwrap();
        fill(&file.root_group());
        file.close().unwrap();
        read(&path, &ReadOptions::default())
    };
    let single = make(&|root| {
        put(root, "C", &[6, 6], six.iter().map(|x| *x as f32).collect());
        put(root, "S", &[6, 6], whole.clone());
        put(root, "path", &[6], vec![0.0, 0.0, 1.0, 1.0, 2.0, 2.0]);
        put::<u8>(root, "sample", &[6], vec![0, 1, 0, 1, 0, 1]);
    })
    .unwrap();
    assert_eq!((single.paths.len(), single.len(), single.paths[2].rows[1].s[5]), (3, 6, 1_000_035.0));
    assert!((single.paths[2].rows[1].c[3] - six[33]).abs() < 1e-7);
    let tensors = make(&|root| {
        put(root, "C", &[6, 3, 3], nine.clone());
        put(root, "S", &[6, 6], whole.iter().map(|x| i64::from(*x)).collect());
        put::<f32>(root, "path", &[6], vec![0.0; 6]);
    })
    .unwrap();
    assert!((tensors.paths[0].rows[5].c[3] - six[33]).abs() < 1e-12);
    let first: Vec<f64> = rows
        .iter()
        .flat_map(|f| {
            (cauchy(f) * f.try_inverse().unwrap().transpose() * f.determinant())
                .transpose()
                .as_slice()
                .to_vec()
        })
        .collect();
    let gradients = make(&|root| {
        put(
            root,
            "F",
            &[6, 9],
            rows.iter().flat_map(|f| f.transpose().as_slice().to_vec()).collect::<Vec<f64>>(),
        );
        put(root, "P", &[6, 3, 3], first.clone());
    })
    .unwrap();
    for (row, f) in gradients.rows().zip(&rows) {
        assert!((row.s - s_of(f)).amax() < 1e-6 * 5e6);
    }
    let half = make(&|root| {
        put(root, "C", &[6, 6], six.clone());
        put(root, "S", &[6, 6], whole.clone());
        put(root, "path", &[6], vec![0.5; 6]);
    });
    assert!(refused(half).contains("0.5 in dataset `path`"));
}

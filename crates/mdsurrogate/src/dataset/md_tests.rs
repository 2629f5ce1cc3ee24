//! Tables of boxes, of F with stresses of all measures, and LAMMPS output.

use super::lammps_tests::lammps_log;
use super::*;

pub(super) fn read_file(name: &str, text: &str, options: &ReadOptions) -> Result<Dataset, Error> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join(name);
    std::fs::write(&path, text).unwrap();
    read(&path, options)
}

fn csv(text: &str) -> Result<Dataset, Error> {
    read_file("t.csv", text, &ReadOptions::default())
}

/// Returns the message of a refusal.
pub(super) fn refused(found: Result<Dataset, Error>) -> String {
    let error = found.expect_err("refused");
    assert_eq!(harness::case::Fault::exit_code(&error), 2);
    error.to_string()
}

/// Computes σ of a compressible neo-Hookean solid, Pa: μ = 5 MPa, λ = 20 MPa.
fn cauchy(f: &Tensor) -> Tensor {
    let j = f.determinant();
    (5e6 * (f * f.transpose() - Tensor::identity()) + 20e6 * j.ln() * Tensor::identity()) / j
}

fn second_stress(f: &Tensor) -> Voigt {
    let c = polycore::tensor::voigt::from_stress(&(f.transpose() * f));
    let c = polycore::tensor::voigt::to_stress(&c);
    let inverse = c.try_inverse().unwrap();
    let s = 5e6 * (Tensor::identity() - inverse) + 10e6 * c.determinant().ln() * inverse;
    polycore::tensor::voigt::from_stress(&s)
}

/// Returns gradients with shears, stretches and rotations.
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
const BOX: &str = "run_id,sample,F11,F22,F33,lx,ly,lz,xy,xz,yz,avg_lx,avg_ly,avg_lz,avg_xy,avg_xz,avg_yz,\
                   avg_sxx,avg_syy,avg_szz,avg_sxy,avg_sxz,avg_syz\n";

/// Formats a row of [`BOX`], with instantaneous and averaged lengths.
fn boxed(run: &str, sample: usize, f: [f64; 3], instant: [f64; 6], mean: [f64; 6]) -> String {
    let stress = [sample as f64 + 1.0, 0.0, 0.0, 5.0 * sample as f64, 0.0, 0.0];
    format!("{run},{sample},") + &row(f.into_iter().chain(instant).chain(mean).chain(stress))
}

/// Runs of one cell at different temperatures: each has its own undeformed box, tilted or not.
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
        // the run without undeformed row is named
        let without: String =
            text.lines().filter(|line| !line.starts_with("hot,0")).map(|l| l.to_owned() + "\n").collect();
        let error = refused(csv(&without));
        assert!(error.contains("no undeformed row of run `hot` with F11 = F22 = F33 = 1"), "{error}");
        let first = ReadOptions { origin: Some(BoxReference::Run), ..ReadOptions::default() };
        let set = read_file("t.csv", &without, &first).unwrap();
        assert!((set.paths[1].rows[1].c[0] - (1.1f64 / 1.05).powi(2)).abs() < 1e-12);
    }
    // shear of a tilted reference: F = H H₀⁻¹, here a shear of γ in a cell tilted by 4
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
    let read_shear = |speed: f64, averaged: bool| {
        let mut text = BOX.to_owned();
        for sample in 0..9 {
            let tilt = speed * sample as f64;
            // a mean over an interval with a flip is the mean of both sides
            let steps = (0..=40).map(|part| flipped(tilt - speed * f64::from(part) / 40.0));
            let mean = if averaged && sample > 0 { steps.sum::<f64>() / 41.0 } else { flipped(tilt) };
            let at = |xy: f64| [20.0, 20.0, 20.0, xy, 0.0, 0.0];
            text += &boxed("s", sample, [1.0; 3], at(flipped(tilt)), at(mean));
        }
        csv(&text)
    };
    for speed in [2.0, 1.8, -2.0, 4.5, -1.3] {
        let set = read_shear(speed, false).unwrap();
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
    let error = refused(read_shear(2.2, true));
    assert!(error.contains("averaged across a flip") && error.contains("instantaneous"), "{error}");
    // a step of more than half a length is ambiguous
    assert!(refused(read_shear(9.0, false)).contains("too far apart"));
    // a box that turns back is not flipped
    let mut text = BOX.to_owned();
    for (sample, xy) in [0.0, 3.0, 6.0, 9.0, 6.0, 3.0, 0.0, -3.0, -6.0, -9.0].into_iter().enumerate() {
        let now = [20.0, 20.0, 20.0, xy, 0.0, 0.0];
        text += &boxed("s", sample, [1.0; 3], now, now);
    }
    assert!((csv(&text).unwrap().paths[0].rows[9].c[3] + 0.45).abs() < 1e-12);
}

/// All measures of one law give the same S in every unit: σ, −σ, P and S with F.
#[test]
fn stresses_beside_f() {
    let six = |t: Tensor| [t[(0, 0)], t[(1, 1)], t[(2, 2)], t[(0, 1)], t[(0, 2)], t[(1, 2)]];
    let pressure = ReadOptions { pressure: Some(PressureConvention::Pressure), ..ReadOptions::default() };
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
                "S11" => second_stress(&f).as_slice().to_vec(),
                _ => six(cauchy(&f)).to_vec(),
            };
            text += &row(f.transpose().as_slice().iter().copied().chain(stress.iter().map(|s| s / unit)));
        }
        let set = read_file("t.csv", &text, &options).unwrap_or_else(|error| panic!("{heading}: {error}"));
        for (row, f) in set.rows().zip(gradients()) {
            assert!(
                (row.s - second_stress(&f)).amax() < 1e-6 * 5e6,
                "{heading}: {} {}",
                row.s,
                second_stress(&f)
            );
        }
        if heading.starts_with("pxx") {
            let error = refused(csv(&text));
            assert!(
                error.contains("pressures (p = −σ)") && error.contains("stress = \"pressure\""),
                "{error}"
            );
        }
        if heading.starts_with("Pxx") {
            assert!(
                refused(read_file("t.csv", &text, &pressure)).contains("pressure (σ = −p) without a unit")
            );
        }
        if heading.starts_with("P11") {
            let swapped = text.replacen("P12,P13,P21,P22,P23,P31,P32", "P21,P31,P12,P22,P32,P13,P23", 1);
            assert!(refused(csv(&swapped)).contains("the transpose of the first Piola"));
            let wrong = text.replacen("P11,P12,P13,P21", "P12,P11,P13,P21", 1);
            assert!(refused(csv(&wrong)).contains("P Fᵀ is not symmetric"));
        }
    }
    let error = refused(csv("F11,F22,F33,sxx\n1,1,1,0\n"));
    assert!(error.contains("all nine columns F11") && error.contains("columns of zeros"), "{error}");
}

/// Decimal commas, semicolons, units below the headings, and lengths in nm.
#[test]
fn tables_of_spreadsheets() {
    let text = "Werkstoff;PA12\nrun_id;F11;F22;F33;lx;ly;lz;sxx;syy;szz;sxy;sxz;syz\n\
                    ;;;;nm;nm;nm;kbar;kbar;kbar;kbar;kbar;kbar\n\
                a;1,0;1,0;1,0;2,0;2,0;2,0;0;0;0;0;0;0\na;1,1;1,0;1,0;2,2;2,0;2,0;1,5;0;0;0;0;0\n";
    let options = ReadOptions { columns: SampledColumns::Instantaneous, ..ReadOptions::default() };
    let set = read_file("t.csv", text, &options).unwrap();
    let row = &set.paths[0].rows[1];
    assert!((row.c[0] - 1.21).abs() < 1e-12 && (row.cauchy[0] / 1.5e8 - 1.0).abs() < 1e-12);
    assert!(set.provenance[0].contains("separator `;`, decimal comma"), "{:?}", set.provenance);
    let given =
        ReadOptions { reference: Some(crate::kinematics::PeriodicBox::orthogonal([20.0; 3])), ..options };
    assert!((read_file("t.csv", text, &given).unwrap().paths[0].rows[1].c[0] - 1.21).abs() < 1e-12);
    let error = refused(read_file("t.csv", &text.replace("1,5;0", "1.5;0"), &given));
    assert!(error.contains("column `sxx`: found `1.5`") && error.contains("decimal comma"), "{error}");
}

/// Columns with other names.
#[test]
fn named_columns() {
    let names = |list: &[(&str, &str)]| ReadOptions {
        names: list.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())).collect(),
        ..ReadOptions::default()
    };
    let text = format!("{F},a,b,c,d,e,f\n1.1,0,0,0,1,0,0,0,1,7,0,0,0,0,0\n");
    let given = [("sxx", "a"), ("syy", "b"), ("szz", "c"), ("sxy", "d"), ("sxz", "e"), ("syz", "f")];
    assert_eq!(read_file("t.csv", &text, &names(&given)).unwrap().paths[0].rows[0].cauchy[0], 7e6);
    assert!(refused(read_file("t.csv", &text, &names(&[("sxx", "F111")]))).contains("did you mean `F11`"));
    assert!(refused(read_file("t.csv", &text, &names(&[("sx", "a")]))).contains("`sxx`"));
}

/// Strains are read from training tables: F, boxes, logs and HDF5.
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
        ("log", lammps_log("units metal\n", 1), 5),
    ] {
        let path = directory.path().join(name);
        std::fs::write(&path, text).unwrap();
        let found = read_strains(&path).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(found.len(), rows);
        let c = Voigt::new(1.21, 1.01, 1.0, 0.11, 0.0, 0.0);
        assert!(name == "log" || name == "b.csv" || (found[0] - c).amax() < 1e-14, "{name}: {}", found[0]);
    }
}

/// HDF5 numbers of each width and byte order; C and S as tensors; F with P.
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
        assert!((row.s - second_stress(f)).amax() < 1e-6 * 5e6);
    }
    let half = make(&|root| {
        put(root, "C", &[6, 6], six.clone());
        put(root, "S", &[6, 6], whole.clone());
        put(root, "path", &[6], vec![0.5; 6]);
    });
    assert!(refused(half).contains("0.5 in dataset `path`"));
}

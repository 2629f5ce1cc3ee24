use super::*;
use crate::random::SplitMix64;
use harness::case::Fault;
use polycore::tensor::Tensor;

/// Creates paths of sheared rows with σ = 100 MPa on 11 plus uniform noise of a given deviation.
pub(crate) fn synthetic(paths: usize, rows: usize, deviation: f64) -> Dataset {
    let mut random = SplitMix64::new(7);
    let path = |index: usize| {
        let row = |sample: usize| {
            let stretch = 1.0 + 0.002 * (sample + 1) as f64 * (index + 1) as f64;
            let mut matrix = Tensor::identity();
            matrix[(index % 3, index % 3)] = stretch;
            // far from the other paths
            matrix[((index + 1) % 3, (index + 1) % 3)] = 1.0 + 0.3 * index as f64;
            let mut noise = || deviation * 12f64.sqrt() * (random.uniform() - 0.5);
            let cauchy = Voigt::from_fn(|a, _| if a == 0 { 1e8 } else { 0.0 } + noise());
            let f = DeformationGradient::new(matrix).unwrap();
            DataRow::new(sample as u64, sample as f64 * 1e-15, f, cauchy)
        };
        let rows = (0..rows).map(row).collect();
        Path { id: format!("p{index}"), kind: format!("u{}", index % 3), rates: [f64::NAN; 3], rows }
    };
    let mut path = path;
    Dataset { paths: (0..paths).map(&mut path).collect(), provenance: vec!["made".into()], skipped: 0 }
}

fn read_text(text: &str) -> Result<Dataset, Error> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("t.csv");
    std::fs::write(&path, text).unwrap();
    read(&path, &ReadOptions::default())
}

const MATERIAL: &str = "run_id,C11,C22,C33,C12,C13,C23,S11,S22,S33,S12,S13,S23\n";
const BOX: &str = "run_id,sample,F11,F22,F33,lx,ly,lz,avg_lx,avg_ly,avg_lz,\
                   avg_sxx,avg_syy,avg_szz,avg_sxy,avg_sxz,avg_syz\n";

/// The estimate from n second differences of white noise has a relative spread of about √(35/36n).
#[test]
fn noise_of_known_deviation() {
    let set = synthetic(4, 500, 5e6);
    let noise = noise(&set, |row| row.cauchy).unwrap();
    assert_eq!(noise.differences, 4 * 498);
    for deviation in &noise.deviation {
        assert!((deviation / 5e6 - 1.0).abs() < 0.1, "{deviation}");
    }
    // white noise: correlated by the fit only; spread 1/√(6·2000)
    assert!((noise.lag_1.unwrap() - noise.lag_1_of_white_noise).abs() < 0.04, "{noise:?}");
    // the fit reproduces a parabola: no residual without noise
    let smooth = super::noise(&synthetic(1, 50, 0.0), |row| row.cauchy).unwrap();
    assert_eq!((smooth.floor, smooth.lag_1), (0.0, None));
    assert!(super::noise(&synthetic(3, 2, 1.0), |row| row.cauchy).is_none());
}

#[test]
fn a_split_by_path_keeps_paths_and_kinds_together() {
    let set = synthetic(30, 10, 1e6);
    let parts =
        split(&set, SplitMethod::Path, Fractions { train: 0.6, validation: 0.2, test: 0.2 }, 3).unwrap();
    assert_eq!((parts.train.len(), parts.validation.len(), parts.test.len()), (180, 60, 60));
    let of_rows = set.path_of_rows();
    let labels = parts.labels();
    let mut test_of_kind = BTreeMap::new();
    for path in 0..30 {
        let own: HashSet<u8> = (0..300).filter(|&row| of_rows[row] == path).map(|row| labels[row]).collect();
        assert_eq!(own.len(), 1);
        *test_of_kind.entry(&set.paths[path].kind).or_insert(0) += usize::from(own.contains(&2));
    }
    assert_eq!(test_of_kind.into_values().collect::<Vec<_>>(), [2, 2, 2]);
    let again =
        split(&set, SplitMethod::Path, Fractions { train: 0.6, validation: 0.2, test: 0.2 }, 3).unwrap();
    assert_eq!(parts, again);
    let other =
        split(&set, SplitMethod::Path, Fractions { train: 0.6, validation: 0.2, test: 0.2 }, 4).unwrap();
    assert_ne!(parts, other);
}

#[test]
fn a_random_split_leaks_and_a_split_by_path_does_not() {
    let set = synthetic(12, 100, 1e6);
    let measured = |method| {
        let parts = split(&set, method, Fractions::default(), 1).unwrap();
        let rows: Vec<Voigt> = set.rows().map(|row| row.c).collect();
        let standardisation = Standardisation::from_rows(parts.train.iter().map(|&row| &rows[row])).unwrap();
        // the same by comparing all pairs
        let points: Vec<Voigt> = rows.iter().map(|c| standardisation.apply(c)).collect();
        let nearest = |row: usize| {
            let others = parts.train.iter().filter(|&&other| other != row);
            others.map(|&other| (points[other] - points[row]).norm()).fold(f64::INFINITY, f64::min)
        };
        let mut across: Vec<f64> = parts.test.iter().map(|&row| nearest(row)).collect();
        across.sort_by(f64::total_cmp);
        let found = leak(&set, &parts, &standardisation).unwrap();
        let middle = across.len() / 2;
        let median =
            if across.len() % 2 == 1 { across[middle] } else { 0.5 * (across[middle - 1] + across[middle]) };
        assert_eq!(found.across, median);
        assert!(found.distances < (rows.len() * parts.train.len()) as u64);
        found
    };
    assert_eq!(measured(SplitMethod::Path).same_path, 0.0);
    let random = measured(SplitMethod::Random);
    assert!(random.same_path > 0.5 && (0.7..1.5).contains(&random.ratio.unwrap()), "{random:?}");
}

#[test]
fn small_and_wrong_splits() {
    let one = synthetic(1, 5, 0.0);
    let error = split(&one, SplitMethod::Path, Fractions::default(), 1).unwrap_err().to_string();
    assert!(error.contains("found 1 path;") && error.contains("at least 3 paths"), "{error}");
    let three = synthetic(3, 5, 0.0);
    let parts = split(&three, SplitMethod::Path, Fractions::default(), 1).unwrap();
    assert!([&parts.train, &parts.validation, &parts.test].iter().all(|rows| rows.len() == 5));
    let all = Fractions { train: 1.0, validation: 0.0, test: 0.0 };
    assert_eq!(split(&one, SplitMethod::Path, all, 1).unwrap().train.len(), 5);
    for train in [-0.1, f64::NAN, 0.7, 0.0] {
        let fractions = Fractions { train, ..Fractions::default() };
        assert!(matches!(
            split(&three, SplitMethod::Random, fractions, 1),
            Err(Error::Parameter { name: "split", .. })
        ));
    }
}

#[test]
fn standardisation_of_components_without_variance() {
    let rows = [Voigt::new(1.0, 2.0, 0.0, 5.0, 0.1, 0.0), Voigt::new(3.0, 2.0, 0.0, 5.0, 0.1, 0.0)];
    let standardisation = Standardisation::from_rows(rows.iter()).unwrap();
    assert_eq!(standardisation.constant(), ["22", "33", "12", "13", "23"]);
    assert_eq!(standardisation.apply(&rows[1]), Voigt::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.0));
    assert_eq!(standardisation.invert(&standardisation.apply(&rows[1])), rows[1]);
    // shear without variance in the data does not give infinity
    assert_eq!(standardisation.apply(&Voigt::repeat(9.0))[3], 0.0);
    assert!(Standardisation::from_rows(rows[..0].iter()).is_err());
    assert!(Standardisation::from_rows([Voigt::repeat(f64::NAN)].iter()).is_err());
    // one row: all components are constant
    assert_eq!(Standardisation::from_rows(rows[..1].iter()).unwrap().constant().len(), 6);
}

#[test]
fn tables_of_c_and_s() {
    let text = format!(
        "# source: by hand\n{}a,1.1,1,1,0.02,0,0,2,0,0,0.003,0,0\n",
        MATERIAL.replace("S11", "S11 [GPa]").replace("S12", "S12 [GPa]")
    );
    let set = read_text(&text).unwrap();
    let row = set.paths[0].rows[0];
    assert!((row.c - Voigt::new(1.1, 1.0, 1.0, 0.02, 0.0, 0.0)).amax() < 1e-15);
    // through σ and back: some roundings of 2 GPa
    assert!((row.s - Voigt::new(2e9, 0.0, 0.0, 3e6, 0.0, 0.0)).amax() < 1e-5, "{}", row.s);
    assert_eq!((set.paths[0].kind.as_str(), row.sample, row.time.is_nan()), ("unknown", 0, true));
    assert_eq!(set.constant_components().len(), 12);
}

/// The pressure of a free face is eliminated: a neo-Hookean S = μ1 gives P = μ(λ − λ₃²/λ) in each mode.
#[test]
fn nominal_stresses_of_rubber() {
    let text = "# source: by hand\nmode,stretch,nominal_MPa\nuniaxial,1,0\nuniaxial,2,1\npure-shear,3,1.5\n";
    let set = read_text(text).unwrap();
    let ids: Vec<&str> = set.paths.iter().map(|path| path.id.as_str()).collect();
    assert_eq!((ids, set.skipped, set.len()), (vec!["uniaxial", "pure-shear"], 1, 2));
    assert!(set.is_nominal() && noise(&set, |row| row.s).is_none());
    let row = &set.paths[1].rows[0];
    assert!((row.c - Voigt::new(9.0, 1.0, 1.0 / 9.0, 0.0, 0.0, 0.0)).amax() < 1e-15);
    let pressure = 7e6;
    let stress = |mu: f64| Voigt::from_fn(|a, _| if a < 3 { mu - pressure / row.c[a] } else { 0.0 });
    let [measured, predicted] = row.compared(&stress(0.4e6));
    assert_eq!(measured, Voigt::new(1.5e6, 0.0, 0.0, 0.0, 0.0, 0.0));
    assert!((predicted[0] / (0.4e6 * (3.0 - 1.0 / 27.0)) - 1.0).abs() < 1e-12);
    // the other stress was not measured
    assert_eq!(predicted[1], 0.0);
    // a thickness of 0.05 is plausible, a stretch of 20 is not
    let sheet = |stretch: f64| format!("mode,stretch,nominal_MPa\nequibiaxial,{stretch},2.45\n");
    assert!(read_text(&sheet(4.45)).is_ok() && read_text(&sheet(20.0)).is_err());
    let biaxial = "stretch_1,stretch_2,nominal_1_kPa,nominal_2_kPa\n2,1.5,300,200\n";
    let set = read_text(biaxial).unwrap();
    assert_eq!((set.paths[0].id.as_str(), set.paths[0].kind.as_str()), ("t", "biaxial"));
    assert_eq!(set.paths[0].rows[0].nominal, Some([3e5, 2e5]));
    // laboratory format: strain in per cent, decimal commas
    let set = read_text("Strain (%);Stress (MPa)\n0,0;0\n100,0;1,0\n200,0;1,8\n").unwrap();
    assert_eq!((set.len(), set.paths[0].rows[0].nominal), (2, Some([1e6, 0.0])));
    assert!((set.paths[0].rows[0].c[0] - 4.0).abs() < 1e-12);
    assert!(set.provenance[0].contains("decimal comma"), "{:?}", set.provenance);
    for (text, parts) in [
        ("stretch,nominal_kg\n1,2\n", ["t.csv", "nominal_kg"]),
        ("mode,stretch,nominal_MPa\nshear,1,2\n", ["line 2", "shear"]),
        ("stretch,nominal_MPa\n1,x\n", ["line 2", "x"]),
    ] {
        let error = read_text(text).unwrap_err().to_string();
        assert!(parts.iter().all(|part| error.contains(part)), "{error}");
    }
}

#[test]
fn each_error_of_a_table_is_located() {
    let box_row = "a,0,1,1,1,10,10,10,11,10,10,50,0,0,0,0,0\n";
    for (text, parts) in [
        (String::new(), vec!["t.csv: found an empty file"]),
        (MATERIAL.to_owned(), vec!["headings without rows"]),
        (
            format!("{MATERIAL}a,1.1,1,1,0,0,0,NaN,0,0,0,0,0\n"),
            vec!["t.csv:2: column `S11`: found `NaN`; allowed: a finite number"],
        ),
        (format!("{MATERIAL}a,1.1,1,1,0,0,0,,0,0,0,0,0\n"), vec!["found an empty cell"]),
        (format!("{MATERIAL}a,1.1,1\n"), vec!["t.csv:2", "3 cells"]),
        (format!("{MATERIAL}a,1,1,1,1.5,0,0,1,0,0,0,0,0\n"), vec!["line 2", "eigenvalue -", "; allowed: "]),
        (
            MATERIAL.replace("S23", "S32") + "a,1,1,1,0,0,0,1,0,0,0,0,0\n",
            vec!["column `S23` is missing; did you mean `S32`?"],
        ),
        (
            "lx,ly,lz,sxx\n1,1,1,1\n".to_owned(),
            vec!["the headings lx, ly, lz, sxx", "`columns = \"instantaneous\"`"],
        ),
        ("a;b\n1;2\n".to_owned(), vec!["the headings a, b"]),
        (
            MATERIAL.replace("S11", "S11 [kg]") + "a,1,1,1,0,0,0,1,0,0,0,0,0\n",
            vec![":1: column `S11`", "the unit `kg`"],
        ),
        (
            BOX.replace("avg_sxx", "avg_sx") + box_row,
            vec!["column `avg_sxx` is missing; did you mean `avg_sx`?"],
        ),
        (
            format!("{BOX}{}", box_row.replace("a,0,1,1,1", "a,0,1,1,1.1")),
            vec!["no undeformed row with F11 = F22 = F33 = 1"],
        ),
        // lengths or stresses in a unit that is wrong by 1e6
        (
            format!("{BOX}{}", box_row.replace(",11,10,10,", ",11e6,10e6,10e6,")),
            vec!["principal stretch = 1.1000e6", "is a unit wrong?"],
        ),
        (
            format!("{BOX}{}", box_row.replace(",50,", ",50e9,")),
            vec!["root mean square of the stress = 2.0412e16 Pa", "is a unit wrong?"],
        ),
        (format!("{BOX}{}", box_row.replace(",50,", ",50e-6,")), vec!["2.0412e1 Pa", "is a unit wrong?"]),
        (format!("{BOX}{box_row}{box_row}"), vec!["sample 0 of run `a` twice, in lines 2 and 3"]),
        (format!("{BOX}{}", box_row.replace("a,0,", "a,-1,")), vec!["column `sample`: found `-1`"]),
        (format!("{BOX}{}", box_row.replace(",11,", ",-11,")), vec!["stretch 1 is -11"]),
        (
            format!(
                "{BOX}{box_row}{0}{1}{2}",
                box_row.replace("a,0", "a,1").replace(",50,", ",60,"),
                box_row.replace("a,0", "b,0"),
                box_row.replace("a,0", "b,1").replace(",50,", ",60,")
            ),
            vec!["the same rows in the runs `a` and `b`"],
        ),
    ] {
        let error = read_text(&text).expect_err(&text);
        assert_eq!(error.exit_code(), 2);
        let error = error.to_string();
        assert!(parts.iter().all(|part| error.contains(part)), "{error}\nfor {parts:?}");
    }
}

#[test]
fn one_sample_and_blank_rows() {
    let row = "a,1,1,1,1,10,10,10,11,10,10,50,0,0,0,0,0\n";
    let set = read_text(&format!("{BOX}a,0,1,1,1,10,10,10,,,,,,,,,\n{row}")).unwrap();
    assert_eq!((set.len(), set.skipped, set.duplicate_rows()), (1, 1, 0));
    assert_eq!(set.paths[0].rows[0].deformation.matrix()[(0, 0)], 1.1);
    let twin = read_text(&format!("{BOX}{row}{}", row.replace("a,1", "b,1"))).unwrap();
    assert_eq!(twin.duplicate_rows(), 1);
}

#[test]
fn broken_gzip() {
    use std::io::Write;
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("t.csv.gz");
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(format!("{MATERIAL}a,1.1,1,1,0,0,0,1,0,0,0,0,0\n").as_bytes()).unwrap();
    let bytes = encoder.finish().unwrap();
    std::fs::write(&path, &bytes).unwrap();
    assert_eq!(read(&path, &ReadOptions::default()).unwrap().len(), 1);
    for cut in [3, 20, bytes.len() - 1] {
        std::fs::write(&path, &bytes[..cut]).unwrap();
        let error = read(&path, &ReadOptions::default()).unwrap_err().to_string();
        assert!(error.contains("truncated or damaged"), "{error}");
    }
}

#[cfg(feature = "hdf5")]
#[test]
fn hdf5_there_and_back() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("d.h5");
    let set = synthetic(5, 7, 1e6);
    let parts = split(&set, SplitMethod::Path, Fractions::default(), 1).unwrap();
    let standardisation = Standardisation::from_rows(set.rows().map(|row| &row.c)).unwrap();
    hdf5::write(&path, &set, Some((&parts, &standardisation))).unwrap();
    let back = read(&path, &ReadOptions::default()).unwrap();
    assert_eq!(back.paths.len(), 5);
    for (a, b) in set.paths.iter().zip(&back.paths) {
        assert_eq!((&a.id, &a.kind, &a.rows), (&b.id, &b.kind, &b.rows));
    }
    assert_eq!(back.provenance[0], "made");
    // a second write replaces the whole file and leaves no temporary files
    hdf5::write(&path, &synthetic(2, 3, 1e6), None).unwrap();
    assert_eq!(read(&path, &ReadOptions::default()).unwrap().len(), 6);
    assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 1);

    std::fs::write(&path, "run_id,C11\n").unwrap();
    let error = read(&path, &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("an unreadable file"), "{error}");
}

#[cfg(feature = "hdf5")]
#[test]
fn hdf5_of_other_programs() {
    use rust_hdf5::H5File;
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("d.h5");
    let make = |c: &[f64], s: &[f64], name: &str| {
        let file = H5File::create(&path).unwrap();
        let root = file.root_group();
        root.new_dataset::<f64>().shape([c.len() / 6, 6]).create("C").unwrap().write_raw(c).unwrap();
        root.new_dataset::<f64>().shape([s.len() / 6, 6]).create(name).unwrap().write_raw(s).unwrap();
        file.close().unwrap();
        read(&path, &ReadOptions::default())
    };
    let c = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.1, 1.0, 1.0, 0.0, 0.0, 0.0];
    let s = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1e7, 0.0, 0.0, 0.0, 0.0, 0.0];
    let set = make(&c, &s, "S").unwrap();
    assert_eq!((set.paths.len(), set.len(), set.paths[0].rows[1].s[0]), (1, 2, 1e7));
    let fails = |c: &[f64], s: &[f64], name: &str| make(c, s, name).unwrap_err().to_string();
    assert!(fails(&c, &s[..6], "S").contains("1 rows of S for 2 of C"));
    assert!(fails(&c, &s, "stress").contains("column `S` is missing"));
    assert!(fails(&c, &[f64::NAN; 12], "S").contains("NaN in row 0"));
}

/// Returns twelve paths of 40 rows of a compressible neo-Hookean solid, S = μ(I − C⁻¹) + λ ln J C⁻¹ with μ =
/// 1 GPa, λ = 2 GPa (Bonet & Wood 2008, Eq. 6.28), stretched along one or two axes by up to 20 to 30 %.
pub(crate) fn set_of_a_law() -> Dataset {
    let path = |index: usize| {
        let row = |sample: usize| {
            let strain = 0.005 * sample as f64 * (1.0 + (index / 6) as f64 * 0.5);
            let mut matrix = Tensor::identity();
            matrix[(index % 3, index % 3)] = 1.0 + strain;
            if index % 6 > 2 {
                matrix[((index + 1) % 3, (index + 1) % 3)] = 1.0 + 0.6 * strain;
            }
            let f = DeformationGradient::new(matrix).unwrap();
            let s = neo_hookean(&polycore::tensor::voigt::from_stress(&f.right_cauchy_green()));
            DataRow::new(sample as u64, f64::NAN, f, crate::kinematics::cauchy_from_material(&f, &s))
        };
        let rows = (0..40).map(row).collect();
        let kind = format!("{}{}", if index % 6 > 2 { "b" } else { "u" }, index % 3);
        Path { id: format!("n{index}"), kind, rates: [f64::NAN; 3], rows }
    };
    Dataset { paths: (0..12).map(path).collect(), provenance: vec!["made".into()], skipped: 0 }
}

/// Returns the rows of [`set_of_a_law`].
pub(crate) fn rows_of_a_law() -> Vec<DataRow> {
    set_of_a_law().rows().copied().collect()
}

/// Computes S of [`set_of_a_law`] at C, Pa.
pub(crate) fn neo_hookean(c: &Voigt) -> Voigt {
    use polycore::tensor::voigt;
    let c = voigt::to_stress(c);
    let inverse = c.try_inverse().unwrap();
    let half_log = 0.5 * c.determinant().ln();
    voigt::from_stress(&(1e9 * (Tensor::identity() - inverse) + 2e9 * half_log * inverse))
}

/// A missing shear column gives advice, not a similar name of a stress.
#[test]
fn columns_without_shear() {
    let error = read_text("C11,C22,C33,S11,S22,S33\n1,1,1,0,0,0\n").unwrap_err().to_string();
    assert!(error.contains("no column `C12`") && error.contains("add columns of zeros"), "{error}");
    assert!(!error.contains("did you mean"), "{error}");
}

/// A row of a million times the others is refused with its place; a steeply growing stress is not.
#[test]
fn an_outlier_is_named() {
    let rows = |last: f64| {
        let row = |k: usize| {
            let s = if k == 30 { last } else { k as f64 };
            format!("r,{},1,1,0,0,0,{s},0,0,0,0,0\n", 1.0 + 0.01 * k as f64)
        };
        MATERIAL.to_owned() + &(0..40).map(row).collect::<String>()
    };
    let error = read_text(&rows(3e7)).unwrap_err().to_string();
    assert!(error.contains("run `r`, sample 30: norm of the stress"), "{error}");
    assert!(read_text(&rows(3e3)).is_ok());
}

/// Strains are read from any table, including training data.
#[test]
fn strains_of_tables() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("t.csv");
    let strains = |text: &str| {
        std::fs::write(&path, text).unwrap();
        read_strains(&path)
    };
    let trained = strains(&(MATERIAL.to_owned() + "r0,1.1,1,1,0.1,0,0,5,0,0,0,0,0\n")).unwrap();
    assert_eq!(trained, [Voigt::new(1.1, 1.0, 1.0, 0.1, 0.0, 0.0)]);
    assert!(
        (strains("name,stretch\nx,4\n").unwrap()[0] - Voigt::new(16.0, 0.25, 0.25, 0.0, 0.0, 0.0)).norm()
            < 1e-12
    );
    for (text, part) in [
        ("C11,C22,C33\n", "headings without rows"),
        ("mode,stretch\nequibiaxial,4\n", "a mode with one stretch only"),
        ("stretch_1\n-2\n", "a positive stretch"),
        ("stretch_1,stretch_3\n2,1\n", "stretch_3 without stretch_2"),
        ("C11,C22,C33,C21\n1,1,1,0\n", "column `C21`"),
        ("C11,C33\n1,1\n", "`C22` is missing"),
    ] {
        let error = strains(text).unwrap_err();
        assert!(error.to_string().contains(part) && error.exit_code() == 2, "{error}");
    }
}

#[test]
fn arrays_there_and_back() {
    let set = set_of_a_law();
    let [c, s] = set.to_arrays();
    assert_eq!((c.dim(), s[[7, 2]]), ((set.len(), 6), set.rows().nth(7).unwrap().s[2]));
    let back = Dataset::from_arrays("all", c.view(), s.view()).unwrap();
    for (own, other) in set.rows().zip(back.rows()) {
        assert_eq!((own.c, own.s), (other.c, other.s));
        // F is symmetric in both
        assert!((own.cauchy - other.cauchy).amax() <= 1e-12 * own.cauchy.amax());
    }
    assert!(Dataset::from_arrays("one", c.view(), s.slice(ndarray::s![1.., ..])).is_err());
    let error = Dataset::from_arrays("one", c.slice(ndarray::s![.., 1..]), s.view()).unwrap_err().to_string();
    assert!(error.contains("C: found 5 columns"), "{error}");
}

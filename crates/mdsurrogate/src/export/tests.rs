//! Exported laws, compiled and run, compared with Rust to 1e-12 of the norm: some hundred roundings in
//! another order.

use super::*;
use crate::kinematics::jaumann_tangent;
use crate::network::{
    Activation::{Elu, Relu},
    Architecture,
};
use crate::surrogate::{Flags, Header, Kind, Prediction, Support, Workspace, examples};
pub(super) use evidence::hosts::{has_program, run};
use polycore::constitutive::Law;
use polycore::tensor::{DeformationGradient, Tensor, Voigt, Voigt6x6, voigt};
use std::path::Path;
use std::process::Command;

fn deformations() -> Vec<DeformationGradient> {
    let mut random = crate::random::SplitMix64::new(3);
    let mut f = || {
        let noise = Tensor::from_fn(|_, _| 0.6 * (random.uniform() - 0.5));
        DeformationGradient::new(Tensor::identity() + noise).unwrap()
    };
    (0..5).map(|_| f()).collect()
}

fn right_cauchy_green(f: &DeformationGradient) -> Voigt {
    voigt::from_stress(&f.right_cauchy_green())
}

/// Returns all example laws, a law with kinks, limits and representatives, and the thesis' network.
fn laws() -> Vec<(String, Surrogate<f64>)> {
    let mut laws = examples().unwrap();
    let mut header = Header::new(Kind::Ann, &[(6, Relu), (5, Elu)], 2);
    header.spread_limit = Some(1.0);
    header.training_box = [[0.5, 2.0], [0.5, 2.0], [0.9, 1.0], [0.0, 0.0], [-1.0, 1.0], [-1.0, 1.0]];
    // training rows near each other: the other deformations are far away
    let near = right_cauchy_green(&deformations()[0]);
    let rows = [near, 1.01 * near, 1.02 * near];
    header.support = Some(Support::from_rows(&rows, 2).unwrap());
    laws.push(("relu".into(), Surrogate::random(header, 2).unwrap()));
    let mut header = Header::new(Kind::Ann, &[], 1);
    header.architecture = Architecture::thesis(4).unwrap();
    laws.push(("ANN-4".into(), Surrogate::random(header, 2).unwrap()));
    laws
}

pub(super) fn numbers_of(line: &str) -> Vec<f64> {
    line.split_whitespace().map(|word| word.parse().unwrap()).collect()
}

fn bits(flags: &Flags) -> f64 {
    let mut bits = u32::from(flags.spread) << 12 | u32::from(flags.far) << 13;
    for a in 0..6 {
        bits |= u32::from(flags.outside[a]) << a | u32::from(flags.unseen[a]) << (6 + a);
    }
    f64::from(bits)
}

/// Compares status, flags, S, tangent row by row, W and spread.
fn compare_results(name: &str, numbers: &[f64], prediction: &Prediction<f64>) {
    assert_eq!((numbers[0], numbers[1]), (0.0, bits(&prediction.flags)), "{name}");
    let stress = Voigt::from_row_slice(&numbers[2..8]);
    assert!((stress - prediction.stress).norm() < 1e-12 * (stress.norm() + 1e6), "{name}");
    let tangent = Voigt6x6::from_row_slice(&numbers[8..44]);
    assert!((tangent - prediction.tangent.unwrap()).norm() < 1e-12 * (tangent.norm() + 1e6), "{name}");
    let energy = prediction.energy.unwrap_or(0.0);
    assert!((numbers[44] - energy).abs() < 1e-12 * (energy.abs() + 1e6), "{name}");
    assert!((numbers[45] - prediction.spread).abs() < 1e-12 * (stress.norm() + 1e6), "{name}");
}

fn write(path: &Path, text: &str) {
    std::fs::write(path, text).unwrap();
}

#[test]
fn exported_c_agrees() {
    if !has_program("gcc") {
        return;
    }
    let directory = tempfile::tempdir().unwrap();
    let file = |name: &str| directory.path().join(name);
    let laws = laws();
    let (mut main, mut calls) = (String::from("#include <stdio.h>\n"), String::new());
    let mut build = Command::new("gcc");
    build
        .args(["-std=c99", "-O1", "-Wall", "-Wextra", "-Werror", "-o"])
        .arg(file("laws"))
        .arg(file("main.c"));
    for (index, (_, law)) in laws.iter().enumerate() {
        let name = format!("law{index}");
        let CSource { header, source } = c_source(law, &name).unwrap();
        write(&file(&format!("{name}.h")), &header);
        write(&file(&format!("{name}.c")), &source);
        build.arg(file(&format!("{name}.c")));
        main += &format!("#include \"{name}.h\"\n");
        for f in deformations() {
            calls += &format!(
                "{{ double c[6] = {{{}}}; show({name}, c); }}\n",
                numbers(right_cauchy_green(&f).as_slice())
            );
        }
    }
    main += "typedef int law(const double *, double *, double *, double *, double *, unsigned *);\n\
        static void show(law *f, const double *c) { double v[44]; unsigned flags; int i, r;\n\
        r = f(c, v, v + 6, v + 42, v + 43, &flags); printf(\"%d %u\", r, flags);\n\
        for (i = 0; i < 44; i++) { printf(\" %.17g\", v[i]); } printf(\"\\n\"); }\n";
    let bad = "{ double c[6] = {1, 1, 1, 1, 0, 0}, s[6]; printf(\"%d\\n\", law0(c, s, 0, 0, 0, 0)); }\n";
    main += &format!("int main(void) {{\n{calls}{bad}return 0; }}\n");
    write(&file("main.c"), &main);
    run(build.arg("-lm"));
    let text = run(&mut Command::new(file("laws")));
    let mut lines = text.lines();
    let mut memory = Workspace::default();
    let mut far = 0;
    for (name, law) in &laws {
        for f in deformations() {
            let prediction = law.tangent(&right_cauchy_green(&f), &mut memory).unwrap();
            far += u32::from(prediction.flags.far);
            compare_results(name, &numbers_of(lines.next().unwrap()), &prediction);
        }
    }
    assert!(far > 0);
    assert_eq!(lines.next(), Some("1"));
    for name in ["", "1law", "a b", "ä", "int"] {
        assert!(c_source(&laws[0].1, name).is_err() && fortran_source(&laws[0].1, name).is_err());
    }
    assert!(fortran_source(&laws[0].1, "Umat").is_err());
    let wide = Header::new(Kind::Ann, &[(20_000, Relu)], 1);
    assert!(c_source(&Surrogate::random(wide, 1).unwrap(), "law").unwrap_err().to_string().contains("stack"));
}

/// Compares the subroutine with the law, and the UMAT with the push-forward in Rust; one program per law.
#[test]
fn exported_fortran_agrees() {
    if !has_program("gfortran") {
        return;
    }
    let directory = tempfile::tempdir().unwrap();
    let mut memory = Workspace::default();
    for (name, law) in laws().into_iter().filter(|(name, _)| !name.contains("Monoclinic")) {
        let file = |name: &str| directory.path().join(name);
        write(&file("law.f90"), &fortran_source(&law, "law").unwrap());
        let list = |values: &[f64]| {
            values.iter().map(|value| Language::Fortran.number(*value)).collect::<Vec<_>>().join(", &\n")
        };
        let calls = deformations().iter().fold(String::new(), |calls, f| {
            calls + &format!("f = reshape([{}], [3, 3])\ncall show(f)\n", list(f.matrix().as_slice()))
        });
        write(&file("main.f90"), &MAIN.replace("CALLS", &calls));
        let mut build = Command::new("gfortran");
        build.args(["-std=f2008", "-O1", "-Wall", "-Werror", "-Wno-unused-dummy-argument", "-J"]);
        run(build.arg(directory.path()).arg("-o").arg(file("law")).args([file("law.f90"), file("main.f90")]));
        let text = run(&mut Command::new(file("law")));
        let mut lines = text.lines();
        for f in deformations() {
            let prediction = law.tangent(&right_cauchy_green(&f), &mut memory).unwrap();
            compare_results(&name, &numbers_of(lines.next().unwrap()), &prediction);
            let umat = numbers_of(lines.next().unwrap());
            // stress in MPa
            let stress = law.cauchy_stress(&f, &mut memory).unwrap().0 / 1e6;
            let tangent = jaumann_tangent(&f, &prediction.stress, &prediction.tangent.unwrap()) / 1e6;
            let difference = (Voigt::from_row_slice(&umat[..6]) - stress).norm();
            assert!(difference < 1e-12 * (stress.norm() + 1.0), "{name}: {difference:e}");
            let difference = (Voigt6x6::from_row_slice(&umat[6..42]) - tangent).norm();
            assert!(difference < 1e-12 * (tangent.norm() + 1.0), "{name}: {difference:e}");
            // state variables: flags, spread; PNEWDT unchanged
            assert_eq!((umat[42], umat[44]), (bits(&prediction.flags), 1.0), "{name}");
            // W/J in MPa; an ann leaves the given value
            let stored = prediction.energy.map_or(-7.0, |energy| energy / f.matrix().determinant() / 1e6);
            assert!(
                (umat[45] - stored).abs() < 1e-12 * (stored.abs() + 1.0),
                "{name}: {} {stored}",
                umat[45]
            );
        }
        // four components, as in plane strain, equal those of six; a folded element requests a smaller
        // increment
        let (plane, folded) = (numbers_of(lines.next().unwrap()), numbers_of(lines.next().unwrap()));
        assert_eq!((plane[0], folded[0]), (0.0, 0.25), "{name}");
    }
}

/// Prints status, flags and results of the subroutine, and those of the UMAT, for each F.
const MAIN: &str = "program main
    implicit none
    double precision :: f(3, 3), six(6), four(4), stiffness6(6, 6), stiffness4(4, 4), statev(2), pnewdt
    integer :: keep(4) = [1, 2, 3, 4]
CALLS
    call material(f, 6, six, stiffness6, statev, pnewdt)
    call material(f, 4, four, stiffness4, statev, pnewdt)
    print *, maxval(abs(six(1:4) - four)) + maxval(abs(stiffness6(keep, keep) - stiffness4))
    f(:, 1) = -f(:, 1)
    call material(f, 6, six, stiffness6, statev, pnewdt)
    print *, pnewdt
contains
    subroutine show(f)
        double precision, intent(in) :: f(3, 3)
        double precision :: cg(3, 3), s(6), tangent(6, 6), energy, spread, stress(6), stiffness(6, 6)
        double precision :: statev(2), pnewdt, sse
        integer :: flags, status
        cg = matmul(transpose(f), f)
        call law([cg(1, 1), cg(2, 2), cg(3, 3), cg(1, 2), cg(1, 3), cg(2, 3)], s, tangent, energy, spread, &
            flags, status)
        print '(2i6, 44es26.17e3)', status, flags, s, transpose(tangent), energy, spread
        call material(f, 6, stress, stiffness, statev, pnewdt, sse)
        print '(46es26.17e3)', stress, transpose(stiffness), statev, pnewdt, sse
    end subroutine show
    subroutine material(f, n, stress, stiffness, statev, pnewdt, sse)
        double precision, intent(in) :: f(3, 3)
        integer, intent(in) :: n
        double precision, intent(out) :: stress(n), stiffness(n, n), statev(2), pnewdt
        double precision, intent(out), optional :: sse
        double precision :: stored, unused, list(6), two(2), square(3, 3), one(1)
        character(len=80) :: cmname
        integer :: jstep(4)
        unused = 0
        list = 0
        two = 0
        square = 0
        jstep = 1
        pnewdt = 1
        cmname = 'law'
        one = 1d6
        stress = 0
        stored = -7
        call umat(stress, statev, stiffness, stored, unused, unused, unused, list(:n), list(:n), unused, &
            list(:n), list(:n), two, unused, unused, unused, two, two, cmname, 3, n - 3, n, 2, one, 1, two, &
            square, pnewdt, unused, square, f, 1, 1, 1, 1, jstep, 1)
        if (present(sse)) sse = stored
    end subroutine material
end program main
";

/// Evaluates all laws in onnxruntime (with the Python of `ONNX_PYTHON`, or `python3`), all points at once.
#[test]
fn exported_onnx_agrees() {
    let python = std::env::var("ONNX_PYTHON").unwrap_or("python3".into());
    let probe = Command::new(&python).args(["-c", "import onnxruntime"]).output();
    if !probe.is_ok_and(|output| output.status.success()) {
        evidence::skipped(&format!("onnxruntime in {python} (set ONNX_PYTHON to use another)"));
        return;
    }
    let directory = tempfile::tempdir().unwrap();
    let points: Vec<Voigt> = deformations().iter().map(right_cauchy_green).collect();
    let mut memory = Workspace::default();
    for (name, law) in laws() {
        let model = directory.path().join("law.onnx");
        std::fs::write(&model, onnx(&law, OnnxOptions::default()).unwrap()).unwrap();
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/onnx.py");
        let mut command = Command::new(&python);
        command.arg(script).arg(&model).args(points.iter().map(|c| numbers(c.as_slice())));
        let text = run(&mut command);
        let lines: Vec<Vec<f64>> = text.lines().map(numbers_of).collect();
        assert_eq!(lines.len(), points.len());
        // S, spread, W (NaN if absent), far (NaN if absent), outside
        for (c, numbers) in points.iter().zip(&lines) {
            let prediction = law.stress(c, &mut memory).unwrap();
            let stress = Voigt::from_row_slice(&numbers[..6]);
            let size = prediction.stress.norm() + 1e6;
            let difference = (stress - prediction.stress).norm();
            assert!(difference < 1e-12 * size, "{name}: {difference:e} of {size:e}");
            assert!((numbers[6] - prediction.spread).abs() < 1e-12 * size, "{name}");
            match prediction.energy {
                Some(energy) => assert!((numbers[7] - energy).abs() < 1e-12 * (energy.abs() + 1e6), "{name}"),
                None => assert!(numbers[7].is_nan(), "{name}"),
            }
            match law.header().support {
                Some(_) => assert_eq!(numbers[8], f64::from(prediction.flags.far), "{name}"),
                None => assert!(numbers[8].is_nan(), "{name}"),
            }
            assert_eq!(numbers[9..15], prediction.flags.outside.map(f64::from), "{name}");
        }
    }
}

/// Evaluates all laws with tangents and in single precision in onnxruntime.
#[test]
fn exported_onnx_has_tangents_and_single_precision() {
    let python = std::env::var("ONNX_PYTHON").unwrap_or("python3".into());
    let probe = Command::new(&python).args(["-c", "import onnxruntime"]).output();
    if !probe.is_ok_and(|output| output.status.success()) {
        evidence::skipped(&format!("onnxruntime in {python} (set ONNX_PYTHON to use another)"));
        return;
    }
    let directory = tempfile::tempdir().unwrap();
    let points: Vec<Voigt> = deformations().iter().map(right_cauchy_green).collect();
    let mut memory = Workspace::default();
    for (name, law) in laws() {
        // single precision: some thousand roundings of 6e-8, and differences of large invariants
        for (options, tolerance) in [
            (OnnxOptions { single: false, tangent: true }, 1e-11),
            (OnnxOptions { single: true, tangent: true }, 2e-3),
            (OnnxOptions { single: true, tangent: false }, 2e-3),
        ] {
            let model = directory.path().join("law.onnx");
            std::fs::write(&model, onnx(&law, options).unwrap()).unwrap();
            let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/onnx.py");
            let mut command = Command::new(&python);
            command.arg(script).arg(&model).args(points.iter().map(|c| numbers(c.as_slice())));
            let text = run(&mut command);
            assert_eq!(text.lines().count(), points.len());
            for (c, numbers) in points.iter().zip(text.lines().map(numbers_of)) {
                let prediction = law.tangent(c, &mut memory).unwrap();
                let difference = (Voigt::from_row_slice(&numbers[..6]) - prediction.stress).norm();
                let size = prediction.stress.norm() + 1e6;
                assert!(difference < tolerance * size, "{name} {options:?}: {difference:e} of {size:e}");
                assert_eq!(numbers[9..15], prediction.flags.outside.map(f64::from), "{name}");
                assert_eq!(numbers.len(), if options.tangent { 51 } else { 15 });
                if options.tangent {
                    let expected = prediction.tangent.unwrap();
                    let difference = (Voigt6x6::from_row_slice(&numbers[15..]) - expected).norm();
                    let size = expected.norm() + 1e6;
                    assert!(difference < tolerance * size, "{name} {options:?}: {difference:e} of {size:e}");
                }
            }
        }
    }
}

/// Checks DDSDDE by its definition: a small symmetric change of F without spin changes the Kirchhoff stress
/// over J (Sun et al. 2008). Central differences: 1e-7 for ε/h = 2e-11 and h² = 1e-10 of the largest entries.
#[test]
fn jaumann_tangent_by_differences() {
    const PAIRS: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [0, 1], [0, 2], [1, 2]];
    let mut memory = Workspace::default();
    for (name, law) in examples().unwrap() {
        for f in &deformations()[..2] {
            let prediction = law.tangent(&right_cauchy_green(f), &mut memory).unwrap();
            let expected = jaumann_tangent(f, &prediction.stress, &prediction.tangent.unwrap());
            for (b, [k, l]) in PAIRS.into_iter().enumerate() {
                let mut kirchhoff = |step: f64| {
                    let mut strain = Tensor::identity();
                    strain[(k, l)] += 0.5 * step;
                    strain[(l, k)] += 0.5 * step;
                    let f = DeformationGradient::new(strain * f.matrix()).unwrap();
                    law.cauchy_stress(&f, &mut memory).unwrap().0 * f.matrix().determinant()
                };
                let step = 1e-5;
                let slope = (kirchhoff(step) - kirchhoff(-step)) / (2.0 * step * f.matrix().determinant());
                let difference = (slope - expected.column(b)).amax();
                assert!(difference < 1e-7 * expected.amax().max(1e6), "{name} {b}: {difference:e}");
            }
        }
    }
}

//! Exported laws with softening: routines for Abaqus and CalculiX along a path, and in CalculiX itself.

use super::tests::{has_program, numbers_of, run};
use super::*;
use crate::network::Activation::Softplus;
use crate::surrogate::{Kind, Softening, SofteningHistory, Workspace};
use evidence::hosts;
use polycore::tensor::{DeformationGradient, Tensor, Voigt, voigt};
use std::process::Command;

/// Creates an energy in its own axes, with softening.
fn law() -> Surrogate {
    let header = Header::new(Kind::polyconvex_energy(Symmetry::Transverse), &[(8, Softplus)], 2);
    let softening = Softening { units: vec![[0.4, 3.0, 0.5], [0.3, 20.0, 4.0]], greatest: 1e6 };
    Surrogate::random(header, 5).unwrap().with_softening(softening).unwrap()
}

/// Returns a path of shear and stretch, and halfway back.
fn path() -> Vec<DeformationGradient> {
    let at = |part: f64| {
        Tensor::new(1.0 + 0.2 * part, 0.1 * part, 0.0, 0.0, 1.0 - 0.05 * part, 0.0, 0.0, 0.0, 1.0)
    };
    let parts = (1..=10).map(|k| 0.1 * f64::from(k)).chain((0..5).map(|k| 0.9 - 0.1 * f64::from(k)));
    parts.map(|part| DeformationGradient::new(at(part)).unwrap()).collect()
}

/// Computes S along the path, MPa.
fn stresses(law: &Surrogate) -> Vec<Voigt> {
    let (mut memory, mut history) = (Workspace::default(), SofteningHistory::default());
    let c = |f: &DeformationGradient| voigt::from_stress(&f.right_cauchy_green());
    path().iter().map(|f| law.follow(&c(f), false, &mut history, &mut memory).unwrap().stress / 1e6).collect()
}

/// Calls `umat` and `umat_user` with state variables along the path; checks the tangent of `umat_user` by
/// differences.
#[test]
fn routines_follow_the_history() {
    assert!(
        c_source(&law(), "law").unwrap_err().to_string().contains("--form fortran")
            && onnx(&law(), OnnxOptions::default()).is_err()
    );
    if !has_program("gfortran") {
        return;
    }
    let directory = tempfile::tempdir().unwrap();
    let file = |name: &str| directory.path().join(name);
    std::fs::write(file("law.f90"), fortran_source(&law(), "law").unwrap()).unwrap();
    let list = |f: &DeformationGradient| {
        let values = f.matrix().as_slice().iter().map(|value| Language::Fortran.number(*value));
        values.collect::<Vec<_>>().join(", &\n")
    };
    let call = |(step, f): (usize, &DeformationGradient)| {
        let back = if step < 10 { ".false." } else { ".true." };
        format!("f = reshape([{}], [3, 3])\ncall show(f, {back})\n", list(f))
    };
    let calls: String = path().iter().enumerate().map(call).collect();
    std::fs::write(file("main.f90"), MAIN.replace("CALLS", &calls)).unwrap();
    let mut build = Command::new("gfortran");
    build.args(["-std=f2008", "-O1", "-Wall", "-Werror", "-Wno-unused-dummy-argument", "-J"]);
    run(build.arg(directory.path()).arg("-o").arg(file("law")).args([file("law.f90"), file("main.f90")]));
    let text = run(&mut Command::new(file("law")));
    let (mut before, mut work, mut lost) =
        ((Voigt::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0), Voigt::zeros()), 0.0, 0.0);
    let mut sums = Vec::new();
    for (line, (f, s)) in text.lines().zip(path().iter().zip(stresses(&law()))) {
        let numbers = numbers_of(line);
        let cauchy = voigt::from_stress(&(f.matrix() * voigt::to_stress(&s) * f.matrix().transpose()))
            / f.matrix().determinant();
        let size = s.norm();
        assert!((Voigt::from_row_slice(&numbers[..6]) - cauchy).norm() < 1e-12 * size, "{line}");
        assert!((Voigt::from_row_slice(&numbers[6..12]) - s).norm() < 1e-12 * size, "{line}");
        // largest error of a tangent column against central differences, over the tangent
        assert!(numbers[12] < 1e-7, "{line}");
        // SSE and SPD per undeformed volume sum to the work; SPD depends on the largest energy only
        let [sse, spd] = [numbers[13], numbers[14]].map(|energy| energy * f.matrix().determinant());
        let strain = 0.5 * (voigt::from_stress(&f.right_cauchy_green()) - before.0);
        let doubled = Voigt::from_fn(|k, _| strain[k] * if k < 3 { 1.0 } else { 2.0 });
        work += 0.5 * (s + before.1).dot(&doubled);
        before = (voigt::from_stress(&f.right_cauchy_green()), s);
        assert!(spd >= lost - 1e-12 && sse > 0.0, "{line}");
        lost = spd;
        sums.push((sse + spd, work));
    }
    // ten steps and back: trapezoidal rule with a jump of the slope at the turning point
    for (sum, work) in &sums[2..] {
        assert!((sum / work - 1.0).abs() < 0.03, "{sums:?}");
    }
    assert!(lost > 0.01 * sums[14].1, "{sums:?}");
    assert_eq!(text.lines().count(), path().len());
}

/// Calls both routines with the same history; checks the tangent of `umat_user` by differences of the stress.
const MAIN: &str = "program main
    implicit none
    double precision :: f(3, 3), statev(3) = 0, before(3, 1, 1) = 0, after(3, 1, 1) = 0
CALLS
contains
    subroutine show(f, back)
        double precision, intent(in) :: f(3, 3)
        logical, intent(in) :: back
        double precision :: cauchy(6), ddsdde(6, 6), unused, six(6), two(2), square(3, 3), pnewdt, one(1)
        double precision :: e(3, 3), emec(6), s(6), stiff(21), up(6), low(6), dense(6, 6), worst, none(21)
        double precision :: energies(2)
        integer :: jstep(4), a, b
        unused = 0
        six = 0
        two = 0
        square = 0
        jstep = 1
        pnewdt = 1
        one = 1d6
        energies = 0
        call umat(cauchy, statev, ddsdde, energies(1), energies(2), unused, unused, six, six, unused, six, \
        six, &
            two, unused, unused, unused, two, two, repeat('x', 80), 3, 3, 6, 3, one, 1, two, square, pnewdt, &
            unused, square, f, 1, 1, 1, 1, jstep, 1)
        e = matmul(transpose(f), f) / 2
        emec = [e(1, 1) - 0.5d0, e(2, 2) - 0.5d0, e(3, 3) - 0.5d0, e(1, 2), e(1, 3), e(2, 3)]
        call material(emec, s, stiff, 0)
        before = after
        do b = 1, 6
            do a = 1, b
                dense(a, b) = stiff(a + b * (b - 1) / 2)
                dense(b, a) = dense(a, b)
            end do
        end do
        worst = 0
        do b = 1, 6
            ! in loading the curve has a kink here
            if (.not. back) exit
            emec(b) = emec(b) + 1d-5
            call material(emec, up, none, 3)
            emec(b) = emec(b) - 2d-5
            call material(emec, low, none, 3)
            emec(b) = emec(b) + 1d-5
            ! a shear stands for both of its entries
            worst = max(worst, norm2((up - low) / 2d-5 - merge(1, 2, b < 4) * dense(:, b)))
        end do
        print '(15es26.17e3)', cauchy, s, worst / norm2(dense), energies
    end subroutine show
    subroutine material(emec, s, stiff, icmd)
        double precision, intent(in) :: emec(6)
        double precision, intent(out) :: s(6), stiff(21)
        integer, intent(in) :: icmd
        double precision :: unused, six(6), square(3, 3), three(3), one(1), orab(7, 1), pnewdt
        integer :: list(3)
        unused = 0
        six = 0
        square = 0
        three = 0
        orab = 0
        list = 1
        pnewdt = -1
        one = 1d6
        call umat_user(repeat('x', 80), 1, 1, -101, one, emec, six, six, square, unused, square, unused, \
        list, &
            unused, unused, unused, unused, icmd, 0, list, 3, before, after, s, stiff, 0, three, orab, \
            pnewdt, &
            list)
    end subroutine material
end program main
";

/// Runs one element along the path in CalculiX.
#[test]
fn calculix_follows_the_history() {
    let Some(source) = hosts::calculix() else { return };
    let directory = tempfile::tempdir().unwrap();
    let file = |name: &str| directory.path().join(name);
    std::fs::write(file("law.f90"), fortran_source(&law(), "law").unwrap()).unwrap();
    hosts::link_calculix(&source, &[&file("law.f90")], &[], &file("ccx"));
    let mut deck = String::from(
        "*NODE, NSET=ALL\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n\
         *ELEMENT, TYPE=C3D8, ELSET=CUBE\n1,1,2,3,4,5,6,7,8\n*MATERIAL, NAME=USER_LAW\n\
         *USER MATERIAL, CONSTANTS=1\n1.0e6\n*DEPVAR\n3\n\
         *SOLID SECTION, ELSET=CUBE, MATERIAL=USER_LAW\n",
    );
    let corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
    for f in path() {
        deck += "*STEP, NLGEOM\n*STATIC, DIRECT\n1.0, 1.0\n*BOUNDARY\n";
        for (node, corner) in (1..).zip(corners) {
            let x = nalgebra::Vector3::from(corner.map(f64::from));
            let u = f.matrix() * x - x;
            for (direction, u) in (1..).zip(u.iter()) {
                deck += &format!("{node},{direction},{direction},{u:.15}\n");
            }
        }
        deck += "*EL PRINT, ELSET=CUBE\nS, SDV\n*END STEP\n";
    }
    let (_, results) = hosts::run_calculix(&file("ccx"), directory.path(), &deck);
    // Cauchy stress in the order xx yy zz xy xz yz, at eight points per step
    let blocks: Vec<&str> = results.split("stresses").skip(1).collect();
    assert_eq!(blocks.len(), path().len());
    let mut off = 0.0_f64;
    for (block, (f, s)) in blocks.iter().zip(path().iter().zip(stresses(&law()))) {
        let cauchy = voigt::from_stress(&(f.matrix() * voigt::to_stress(&s) * f.matrix().transpose()))
            / f.matrix().determinant();
        let line = block.lines().find(|line| line.trim_start().starts_with("1 ")).unwrap();
        let found = Voigt::from_row_slice(&numbers_of(line)[2..8]);
        off = off.max((found - cauchy).norm() / cauchy.norm());
    }
    // six digits are printed
    evidence::at_most("a learnt law in CalculiX, stresses", off, 3e-6);
}

//! The library called as hosts call it: from C, from Fortran in the order of Abaqus, and in CalculiX.
//!
//! Temperatures at which α reaches 0.01, 0.5, 0.99 on cooling are those of the formulation, which an
//! independent program computed.

use evidence::hosts::{self, has_program, run};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// Column 1 of Table 4.1, °C, at 1 and 10 K/min.
const CROSSINGS: [(f64, [f64; 3]); 2] =
    [(1.0, [166.2335, 162.0523, 159.7161]), (10.0, [159.6641, 152.7704, 148.5398])];

/// `libumatht.a`.
fn library() -> &'static Path {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    BUILT.get_or_init(|| hosts::static_library("umatht"))
}

/// Builds a program from the files, linked with the library.
fn link(compiler: &str, files: &[&Path], folder: &Path) -> PathBuf {
    let program = folder.join("host");
    let mut build = Command::new(compiler);
    build.args(["-O1", "-Wall", "-Wextra", "-Werror", "-I"]);
    build.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("include")).arg("-o").arg(&program);
    run(build.args(files).arg(library()).args(["-lpthread", "-ldl", "-lm"]));
    program
}

/// Calls by names from C give the same bits as from Rust.
#[test]
fn answers_in_c() {
    if !has_program("gcc") {
        return;
    }
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("main.c");
    std::fs::write(&file, C).unwrap();
    let text = run(&mut Command::new(link("gcc", &[&file], directory.path())));
    let mut numbers = text.split_whitespace().map(|word| word.parse::<f64>().unwrap());
    let at = umatht::HeatIncrement { temperature: 150.0, change: -2.0, time: 3.0, gradient: [1.0, 2.0, 3.0] };
    let state = umatht::State { z: 0.2, ..Default::default() };
    let own = umatht::respond(&[0.25, 2200.0, 52e3, 1.0, 273.15], &at, &state).unwrap();
    for expected in
        [own.state.z, own.state.degree, own.energy, own.slope, own.flux[2], own.conductivity[8], 1.0, -1.0]
    {
        assert_eq!(numbers.next(), Some(expected), "{text}");
    }
}

const C: &str = "#include <stdio.h>
#include \"crystfem.h\"
int main(void) {
    double constants[5], at[6] = {150, -2, 3, 1, 2, 3};
    crystfem_state state = {0.2, 0, 0};
    crystfem_answer answer;
    int wrong;
    constants[crystfem_constant(\"conductivity\")] = 0.25;
    constants[crystfem_constant(\"specific_heat\")] = 2200;
    constants[crystfem_constant(\"latent_heat\")] = 52e3;
    constants[crystfem_constant(\"kinetics\")] = 1;
    constants[crystfem_constant(\"absolute_zero\")] = 273.15;
    if (crystfem_respond(constants, 5, at, &state, &answer)) return 1;
    printf(\"%.17g %.17g %.17g %.17g %.17g %.17g\", answer.state.z, answer.state.degree, answer.energy, \
             answer.slope,
           answer.flux[2], answer.conductivity[8]);
    constants[0] = -1;
    wrong = crystfem_respond(constants, 5, at, &state, &answer);
    printf(\" %d %d\\n\", wrong, crystfem_constant(\"colour\"));
    return 0;
}
";

/// Calls in Abaqus' order: U and the state from the start of the increment in every iteration, increments
/// that are cut back and tried again; prescribed cooling, and a lumped body with latent heat.
#[test]
fn follows_the_order_of_abaqus() {
    if !has_program("gfortran") {
        return;
    }
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("main.f90");
    std::fs::write(&file, FORTRAN).unwrap();
    let program = link("gfortran", &[&file], directory.path());
    for ((rate, expected), shift) in CROSSINGS.into_iter().zip([5.67, 7.15]) {
        let crossings = |latent: &str| -> Vec<f64> {
            let text =
                run(Command::new(&program).args([&rate.to_string(), &(3.0 / rate).to_string(), latent]));
            text.split_whitespace().map(|word| word.parse().unwrap()).collect()
        };
        let found = crossings("0");
        for (found, expected) in found.iter().zip(expected) {
            // linear between steps of 0.05 K
            assert!((found - expected).abs() < 2e-3, "{rate}: {found} {expected}");
        }
        let warmer = crossings("52250")[1] - found[1];
        assert!((warmer - shift).abs() < 0.02, "{rate}: {warmer}");
    }
}

const FORTRAN: &str = "program main
    implicit none
    integer, parameter :: dp = kind(1d0)
    real(dp) :: u, dudt, dudg(3), flux(3), dfdt(3), dfdg(3, 3), statev(3)
    real(dp) :: temp, dtemp, dtime, props(4), pnewdt, rate
    real(dp) :: u0, old(3), residual, time(2), none(3), levels(3) = [0.01_dp, 0.5_dp, 0.99_dp]
    character(len=32) :: word
    integer :: increment, iteration, level
    call get_command_argument(1, word)
    read (word, *) rate
    call get_command_argument(2, word)
    read (word, *) dtime
    props = [0.25_dp, 2200.0_dp, 0.0_dp, 1.0_dp]
    call get_command_argument(3, word)
    read (word, *) props(3)
    rate = rate / 60
    temp = 473.15_dp
    statev = 0
    u = 0
    time = 0
    none = 0
    level = 1
    do increment = 1, 1000000
        old = statev
        u0 = u
        if (mod(increment, 7) == 0) then
            ! a larger increment that the host gives up
            dtemp = -4 * rate * dtime
            call material(4 * dtime)
        end if
        dtemp = -rate * dtime
        do iteration = 1, 50
            call material(dtime)
            if (.not. props(3) > 0) exit
            residual = (u - u0) + props(2) * rate * dtime
            if (abs(residual) < 1d-8) exit
            dtemp = dtemp - residual / dudt
        end do
        if (iteration > 8) error stop 'the tangent is wrong'
        do while (level <= 3)
            if (statev(2) < levels(level)) exit
            print *, temp - 273.15_dp + dtemp * (levels(level) - old(2)) / (statev(2) - old(2))
            level = level + 1
        end do
        if (level > 3) exit
        temp = temp + dtemp
    end do
contains
    subroutine material(step)
        real(dp), intent(in) :: step
        external :: umatht
        statev = old
        u = u0
        pnewdt = 1
        call umatht(u, dudt, dudg, flux, dfdt, dfdg, statev, temp, dtemp, none, time, step, none, none, &
            repeat('x', 80), 3, 3, &
            props, 4, none, pnewdt, 1, 1, 1, 1, 1, increment)
    end subroutine material
end program main
";

/// Cools a block at 10 K/min in CalculiX 2.20: temperatures at which it crystallizes.
#[test]
fn crystallizes_in_calculix() {
    let Some(source) = hosts::calculix() else { return };
    let directory = tempfile::tempdir().unwrap();
    let program = directory.path().join("ccx");
    hosts::link_calculix(&source, &[library()], &["-u,umatht_"], &program);
    let mut deck = String::from("*NODE, NSET=ALL\n");
    for k in 0..=4 {
        for (j, [y, z]) in (1..).zip([[0, 0], [1, 0], [1, 1], [0, 1]]) {
            deck += &format!("{},{k}e-5,{y}e-5,{z}e-5\n", 4 * k + j);
        }
    }
    deck += "*ELEMENT, TYPE=C3D8, ELSET=BLOCK\n";
    for k in 0..4 {
        let nodes: Vec<String> = (1..=8).map(|j| (4 * k + j).to_string()).collect();
        deck += &format!("{},{}\n", k + 1, nodes.join(","));
    }
    // one end from 200 °C to 120 °C at 10 K/min in steps of 0.1 K; the others 40 µm away at most follow
    // within 1 mK
    deck += "*MATERIAL, NAME=PA12\n*USER MATERIAL, TYPE=THERMAL, CONSTANTS=6\n0.25, 2200., 0., 1., 0., \
             1.\n*SPECIFIC HEAT\n2200.\n*DENSITY\n1010.\n\
             *DEPVAR\n3\n*SOLID SECTION, ELSET=BLOCK, MATERIAL=PA12\n*INITIAL CONDITIONS, TYPE=TEMPERATURE\n\
             ALL, 473.15\n\
             *AMPLITUDE, NAME=COOL\n0., 473.15, 480., 393.15\n*STEP, INC=2000\n*HEAT TRANSFER, DIRECT\n\
             0.6, 480.\n\
             *BOUNDARY, AMPLITUDE=COOL\n1, 11, 11, 1.\n2, 11, 11, 1.\n3, 11, 11, 1.\n4, 11, 11, 1.\n\
             *NODE PRINT, NSET=ALL, FREQUENCY=1\nNT\n*EL PRINT, ELSET=BLOCK, FREQUENCY=1\nSDV\n*END STEP\n";
    let (_, results) = hosts::run_calculix(&program, directory.path(), &deck);
    let (mut before, mut found) = ((473.15, 0.0), Vec::new());
    for block in results.split("internal state variables").skip(1) {
        let line = block.lines().find(|line| line.trim_start().starts_with("1 ")).unwrap();
        // below 1e-99 Fortran leaves the E out
        let number = |word: &str| word.parse().unwrap_or(0.0);
        let numbers: Vec<f64> = line.split_whitespace().skip(2).map(number).collect();
        let now = (numbers[2], numbers[1]);
        let level = [0.01, 0.5, 0.99, f64::INFINITY][found.len()];
        if now.1 >= level {
            let part = (level - before.1) / (now.1 - before.1);
            found.push(before.0 + part * (now.0 - before.0) - 273.15);
        }
        before = now;
    }
    assert_eq!(found.len(), 3, "{results:.2000}");
    let off = found.iter().zip(CROSSINGS[1].1).map(|(found, expected)| (found - expected).abs());
    evidence::at_most("crystallization in CalculiX, K", off.fold(0.0, f64::max), 4e-3);
}

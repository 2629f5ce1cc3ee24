//! Tests of the materials in CalculiX 2.20, if `CALCULIX_SOURCE` names its source build.

use evidence::hosts::{self, run};
use polycore::constitutive::hyperelastic::{homogeneous::uniaxial, model};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// Links CalculiX with the library. With `WITHOUT_TANGENT` in its environment it uses the tangent of the
/// material at rest.
fn program() -> Option<&'static Path> {
    static BUILT: OnceLock<Option<(tempfile::TempDir, PathBuf)>> = OnceLock::new();
    let built = BUILT.get_or_init(|| {
        let source = hosts::calculix()?;
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name);
        std::fs::write(file("wrap.f90"), WRAP).unwrap();
        run(Command::new("gfortran")
            .args(["-O1", "-ffree-line-length-none", "-c", "-o"])
            .args([file("wrap.o"), file("wrap.f90")]));
        let library = hosts::static_library("umat");
        let symbols = ["-u,umat_user_", "-u,umat_", "--wrap=umat_user_"];
        hosts::link_calculix(&source, &[&file("wrap.o"), &library], &symbols, &file("ccx"));
        Some((folder, PathBuf::from("ccx")))
    });
    static PATH: OnceLock<PathBuf> = OnceLock::new();
    built.as_ref().map(|(folder, name)| PATH.get_or_init(|| folder.path().join(name)).as_path())
}

/// Subroutine that the linker calls instead of the material.
const WRAP: &str = "subroutine wrap(amat, iel, iint, kode, elconloc, emec, emec0, beta, xokl, voj, xkl, vj, \
                    ithermal, t1l, dtime, &
    time, ttime, icmd, ielas, mi, nstate_, xstateini, xstate, stre, stiff, iorien, pgauss, &
    orab, pnewdt, ipkon) bind(c, name='__wrap_umat_user_')
    implicit none
    character(len=1) :: amat(80)
    integer :: iel, iint, kode, ithermal(*), icmd, ielas, mi(*), nstate_, iorien, ipkon(*), length
    double precision :: elconloc(*), emec(6), emec0(6), beta(6), xokl(3, 3), voj, xkl(3, 3), &
        vj, t1l, dtime, time, ttime, &
        xstateini(*), xstate(*), stre(6), stiff(21), pgauss(3), orab(7, *), pnewdt, none(6), rest(6)
    interface
        subroutine real_umat(amat, iel, iint, kode, elconloc, emec, emec0, beta, xokl, voj, xkl, vj, &
            ithermal, t1l, dtime, &
            time, ttime, icmd, ielas, mi, nstate_, xstateini, xstate, stre, stiff, iorien, pgauss, &
            orab, pnewdt, ipkon) &
            bind(c, name='__real_umat_user_')
            character(len=1) :: amat(80)
            integer :: iel, iint, kode, ithermal(*), icmd, ielas, mi(*), nstate_, iorien, ipkon(*)
            double precision :: elconloc(*), emec(6), emec0(6), beta(6), xokl(3, 3), voj, xkl(3, 3), &
            vj, t1l, dtime, time, &
                ttime, xstateini(*), xstate(*), stre(6), stiff(21), pgauss(3), orab(7, *), pnewdt
        end subroutine real_umat
    end interface
    none = 0
    call get_environment_variable('WITHOUT_TANGENT', length=length)
    if (length > 0) call real_umat(amat, iel, iint, kode, elconloc, none, emec0, beta, xokl, voj, xkl, vj, &
            ithermal, t1l, dtime, &
        time, ttime, icmd, ielas, mi, nstate_, xstateini, xstate, rest, stiff, iorien, &
        pgauss, orab, pnewdt, ipkon)
    call real_umat(amat, iel, iint, kode, elconloc, emec, emec0, beta, xokl, voj, xkl, vj, &
            ithermal, t1l, dtime, &
        time, ttime, merge(3, icmd, length > 0), ielas, mi, nstate_, xstateini, xstate, &
        stre, stiff, iorien, pgauss, orab, pnewdt, ipkon)
end subroutine wrap
";

/// Tests `examples/cube.inp`, which the guide shows: the force of the incompressible law, to μ/K.
#[test]
fn the_example() {
    let Some(program) = program() else { return };
    let (force, _) = solved(program, include_str!("../examples/cube.inp"), true);
    let law = model("eight-chain").unwrap().law(&[0.3, 25.0]).unwrap();
    let expected = uniaxial(&*law, 2.0).unwrap();
    eprintln!("cube: {force:?} N, {expected} N");
    evidence::near("a cube of eight chains in CalculiX", force.unwrap() / expected, 1.0, 1e-3);
}

/// A quarter of a sheet of 40 × 80 × 2 mm with notches of 10 mm at both edges, stretched by 20 % of its
/// length: one element through half of the thickness, the notched edge free.
fn notched_sheet(material: &str) -> String {
    let (columns, rows) = (16, 32);
    let node = |i: usize, j: usize, k: usize| 1 + i + (columns + 1) * (j + (rows + 1) * k);
    let mut deck = String::from("*NODE, NSET=ALL\n");
    for (k, j, i) in all(2, rows + 1, columns + 1) {
        let (x, y) = (20.0 * i as f64 / columns as f64, 40.0 * j as f64 / rows as f64);
        writeln!(deck, "{},{x},{y},{k}", node(i, j, k)).unwrap();
    }
    deck += "*ELEMENT, TYPE=C3D8, ELSET=SHEET\n";
    for (index, (_, j, i)) in (1..).zip(all(1, rows, columns)) {
        let face = |k| [node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k), node(i, j + 1, k)];
        let nodes: Vec<String> = [face(0), face(1)].concat().iter().map(usize::to_string).collect();
        writeln!(deck, "{index},{}", nodes.join(",")).unwrap();
    }
    let set = |deck: &mut String, name: &str, nodes: &dyn Fn(usize, usize, usize) -> bool| {
        writeln!(deck, "*NSET, NSET={name}").unwrap();
        for (k, j, i) in all(2, rows + 1, columns + 1).filter(|&(k, j, i)| nodes(i, j, k)) {
            writeln!(deck, "{},", node(i, j, k)).unwrap();
        }
    };
    set(&mut deck, "MIDDLE", &|i, _, _| i == 0);
    // the ligament: half of the width is cut
    set(&mut deck, "LIGAMENT", &|i, j, _| j == 0 && i <= columns / 2);
    set(&mut deck, "FACE", &|_, _, k| k == 0);
    set(&mut deck, "GRIP", &|_, j, _| j == rows);
    writeln!(
        deck,
        "{material}*SOLID SECTION, ELSET=SHEET, MATERIAL=USER_RUBBER_LAW\n*STEP, NLGEOM, \
         INC=1000\n*STATIC\n0.1, 1.0, 1e-6\n*BOUNDARY\nMIDDLE,1,1\n\
         LIGAMENT,2,2\nFACE,3,3\nGRIP,1,1\nGRIP,2,2,8.0\n*NODE PRINT, NSET=GRIP, TOTALS=ONLY\nRF\n*END STEP\n"
    )
    .unwrap();
    deck
}

fn all(planes: usize, rows: usize, columns: usize) -> impl Iterator<Item = (usize, usize, usize)> {
    (0..planes).flat_map(move |k| (0..rows).flat_map(move |j| (0..columns).map(move |i| (k, j, i))))
}

/// Returns the load along y at the end, N (`None` if CalculiX failed), and all iterations.
fn solved(program: &Path, deck: &str, tangent: bool) -> (Option<f64>, usize) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("deck.inp"), deck).unwrap();
    let mut command = Command::new(program);
    command.arg("deck").current_dir(folder.path());
    if !tangent {
        command.env("WITHOUT_TANGENT", "yes");
    }
    let ended = command.output().unwrap();
    let told = String::from_utf8_lossy(&ended.stdout);
    let iterations = told.lines().filter(|line| line.trim_start().starts_with("iteration ")).count();
    let results = std::fs::read_to_string(folder.path().join("deck.dat")).unwrap();
    let last = results.lines().rfind(|line| line.split_whitespace().count() == 3).unwrap_or_default();
    let numbers: Vec<f64> = last.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    (numbers.get(1).copied().filter(|_| ended.status.success()), iterations)
}

/// Compares the sheet with our neo-Hookean law and with CalculiX' own, nearly incompressible; iterations with
/// our tangent and with that at rest.
#[test]
fn a_notched_sheet() {
    let Some(program) = program() else { return };
    // K/μ = 200: −μ ln J + ¼λ(J² − 1 − 2 ln J) here, the isochoric stretches and K/2 (J − 1)² there
    let (mu, bulk) = (1.0, 200.0);
    let user = |name: &str, constants: &[f64]| {
        let list: Vec<String> = constants.iter().map(f64::to_string).collect();
        let material = format!("USER_{name}");
        let deck = notched_sheet(&format!(
            "*MATERIAL, NAME={material}\n*USER MATERIAL, CONSTANTS={}\n{}\n*DEPVAR\n1\n",
            list.len(),
            list.join(",")
        ));
        deck.replace("USER_RUBBER_LAW", &material)
    };
    let own = notched_sheet(&format!(
        "*MATERIAL, NAME=USER_RUBBER_LAW\n*HYPERELASTIC, NEO HOOKE\n{},{}\n",
        mu / 2.0,
        2.0 / bulk
    ))
    .replace("USER_RUBBER_LAW", "OWN");
    let (theirs, their_iterations) = solved(program, &own, true);
    let (ours, iterations) = solved(program, &user("NEO_HOOKEAN", &[bulk, mu]), true);
    eprintln!("CalculiX' law: {theirs:?} N, {their_iterations} iterations; ours: {ours:?} N, {iterations}");
    let (chains, with) = solved(program, &user("EIGHT_CHAIN", &[bulk, 1.0, 10.0]), true);
    let (slow, without) = solved(program, &user("EIGHT_CHAIN", &[bulk, 1.0, 10.0]), false);
    eprintln!("eight-chain: {chains:?} N, {with} iterations; with the tangent at rest {slow:?} N, {without}");
    evidence::near(
        "notched sheet in CalculiX: our neo-Hookean law over CalculiX' own",
        ours.unwrap() / theirs.unwrap(),
        1.0,
        5e-3,
    );
    assert!(iterations <= their_iterations + 2, "{iterations} {their_iterations}");
    assert!(with * 2 < without, "{with} {without}");
}

/// A plate of PA12, 4 mm thick, 220 °C to 25 °C with Bi = 1 on both faces, half of it in CalculiX, free to
/// shrink in its plane or held: stresses in the plane at its centre and its surface after 600 s
/// (`docs/reference/print/plate.py`).
#[test]
fn a_plate_cools() {
    let Some(program) = program() else { return };
    let (cells, wall) = (40, crystfem::exact::Wall { biot: 1.0 });
    for (held, expected) in [(true, [27.5719, 27.0687]), (false, [5.5791, -14.4911])] {
        let mut deck = String::from("*NODE, NSET=ALL\n");
        for k in 0..=cells {
            for (j, [x, y]) in (1..).zip([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) {
                writeln!(deck, "{},{x},{y},{}", 4 * k + j, 2.0 * k as f64 / cells as f64).unwrap();
            }
        }
        deck += "*ELEMENT, TYPE=C3D8, ELSET=PLATE\n";
        for k in 0..cells {
            let nodes: Vec<String> = (1..=8).map(|j| (4 * k + j).to_string()).collect();
            writeln!(deck, "{},{}", k + 1, nodes.join(",")).unwrap();
        }
        let mut supports = String::from("1,3\n2,3\n3,3\n4,3\n");
        for k in 0..=cells {
            let [a, b, c, d] = [1, 2, 3, 4].map(|j| 4 * k + j);
            writeln!(supports, "{a},1,2\n{b},2,2\n{d},1,1").unwrap();
            if held {
                writeln!(supports, "{b},1,1\n{c},1,2\n{d},2,2").unwrap();
            } else {
                // all edges move with those of the first nodes
                for (node, direction, first) in [(b, 1, 2), (c, 1, 2), (c, 2, 4), (d, 2, 4)] {
                    if node != first {
                        writeln!(deck, "*EQUATION\n2\n{node},{direction},1.,{first},{direction},-1.")
                            .unwrap();
                    }
                }
            }
        }
        // mm, N, s, K; temperatures in closed form: CalculiX' coupled steps would take the heat capacity of
        // the shrunken body
        let phases = [(0.1, 20.0, 0.0), (0.5, 80.0, 20.0), (2.0, 500.0, 100.0)];
        for k in 0..=cells {
            writeln!(deck, "*AMPLITUDE, NAME=A{k}, TIME=TOTAL TIME\n0., 493.15").unwrap();
            for (step, duration, begin) in phases {
                for n in 1..=(duration / step) as usize {
                    let time = begin + step * n as f64;
                    let fourier = 0.25 / 1010.0 / 2200.0 * time / 4e-6;
                    let kelvin = 298.15 + 195.0 * wall.share(k as f64 / cells as f64, fourier);
                    writeln!(deck, "{time}, {kelvin}").unwrap();
                }
            }
        }
        write!(
            deck,
            "*MATERIAL, NAME=USER_PRINTED_PA12\n*USER MATERIAL, CONSTANTS=5\n1., 0., 493.15, 0.25, \
             1e6\n*DEPVAR\n45\n\
             *SOLID SECTION, ELSET=PLATE, MATERIAL=USER_PRINTED_PA12\n\
             *INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL, 493.15\n\
             *BOUNDARY\n{supports}"
        )
        .unwrap();
        for (step, duration, _) in phases {
            let count = (duration / step) as usize;
            writeln!(deck, "*STEP, INC={}\n*VISCO, CETOL=1., DIRECT\n{step}, {duration}", count + 1).unwrap();
            for k in 0..=cells {
                writeln!(deck, "*TEMPERATURE, AMPLITUDE=A{k}").unwrap();
                (1..=4).for_each(|j| writeln!(deck, "{}, 1.", 4 * k + j).unwrap());
            }
            writeln!(deck, "*EL PRINT, ELSET=PLATE, FREQUENCY={count}\nS\n*END STEP").unwrap();
        }
        let folder = tempfile::tempdir().unwrap();
        let (_, results) = hosts::run_calculix(program, folder.path(), &deck);
        let block = results.split("stresses").last().unwrap_or_default();
        let mut points: Vec<(usize, f64)> = Vec::new();
        for line in block.lines() {
            let numbers: Vec<f64> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
            if numbers.len() == 8 && [1.0, 5.0].contains(&numbers[1]) {
                points.push((numbers[0] as usize, numbers[2]));
            }
        }
        assert_eq!(points.len(), 2 * cells);
        // means of elements (CalculiX takes the change of volume from an element's mean), extrapolated
        // linearly to the faces
        let mean = |element: usize| 0.5 * (points[2 * element].1 + points[2 * element + 1].1);
        let out = |near: usize, far: usize| mean(near) + 0.5 * (mean(near) - mean(far));
        let found = [out(0, 1), out(cells - 1, cells - 2)];
        eprintln!("held {held}: {found:?} MPa, {expected:?}");
        let name = if held { "held" } else { "free" };
        for (place, (found, expected)) in ["centre", "surface"].iter().zip(found.iter().zip(expected)) {
            evidence::near(
                &format!("plate of PA12 in CalculiX, {name}, {place}"),
                found / expected,
                1.0,
                2e-3,
            );
        }
    }
}

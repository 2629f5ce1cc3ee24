//! Export of a law as Fortran 2008, free form: a subroutine, a UMAT for Abaqus and compatible programs, and a
//! user material for CalculiX.

use super::{ExportModel, Language, check_name};
use crate::Error;
use crate::surrogate::{CONSTANT_TOLERANCE, Surrogate};
use std::fmt::Write;

/// Numbers per line and lines per statement, below the limits of the standard (132 columns, 255
/// continuations).
const NUMBERS: usize = 4;
const LINES: usize = 100;

/// Exports a model as Fortran: `NAME(c, s, tangent, energy, spread, flags, status)` with the conventions of
/// [`c_source`](super::c_source), and `umat` for the finite strains of Abaqus (see
/// [`jaumann_tangent`](crate::kinematics::jaumann_tangent)); agrees with Rust to rounding (tested to 1e-12).
///
/// `umat` reads `PROPS(1)`, the stress unit in Pa (default 1), sets `STATEV(1)` to the flags and `STATEV(2)`
/// to the spread if these exist, and requests a smaller increment (`PNEWDT` = 0.25) if the model refuses C.
/// With softening, `STATEV(3)` holds the largest energy of the history. `SSE` is W/J of an energy (with
/// softening: the recoverable part), and `SPD` the rest; an `ann` has no energy and leaves both unchanged.
///
/// `umat_user` is the same for CalculiX (Green's strain → S, 21 constants of 2 ∂S/∂C, symmetrised).
///
/// # Errors
/// Returns [`Error::Parameter`] for a name that is `umat` or not an identifier of 1 to 50 characters.
pub fn fortran_source(model: &Surrogate, name: &str) -> Result<String, Error> {
    check_name(name)?;
    if name.eq_ignore_ascii_case("umat") {
        return Err(Error::parameter("name", name, "a name other than `umat`"));
    }
    let law = ExportModel::new(model).description();
    let mut text =
        format!("! {name}: a constitutive law C -> S, written by mdsurrogate.\nmodule {name}_law\n");
    text.push_str(
        "    implicit none\n    private\n    public :: evaluate, soften, recovered, UNITS, ENERGETIC\n",
    );
    text.push_str("    integer, parameter :: dp = kind(1.0d0)\n    integer :: entry_\n");
    let softening = model.header().softening.as_ref();
    let count = ("UNITS", softening.map_or(0, |softening| softening.units.len()));
    for (name, value) in law.sizes().into_iter().chain([count]) {
        let _ = writeln!(text, "    integer, parameter :: {name} = {value}");
    }
    for (name, value) in [
        ("SPREAD_LIMIT", law.spread_limit.unwrap_or(f64::MAX)),
        ("UNSEEN", CONSTANT_TOLERANCE),
        ("FARTHEST", law.farthest),
        ("GREATEST_SEEN", softening.map_or(1.0, |softening| softening.greatest)),
    ] {
        let _ = writeln!(text, "    real(dp), parameter :: {name} = {}", Language::Fortran.number(value));
    }
    for (name, values) in [("width", &law.widths), ("activation", &law.activations)] {
        let _ = writeln!(text, "    integer, save :: {name}({})", values.len());
        let list: Vec<String> = values.iter().map(usize::to_string).collect();
        write_list(&mut text, name, &list);
    }
    let units = softening.map_or(vec![0.0; 3], |softening| softening.units.as_flattened().to_vec());
    for (name, values) in law.lists().into_iter().chain([("weight", &law.weights[..]), ("softening", &units)])
    {
        let _ = writeln!(text, "    real(dp), save :: {name}({})", values.len());
        let list: Vec<String> = values.iter().map(|value| Language::Fortran.number(*value)).collect();
        write_list(&mut text, name, &list);
    }
    text.push_str("contains\n\n");
    text.push_str("    recursive subroutine features(c, x, d, dd)\n        real(dp), intent(in) :: c(6)\n");
    text.push_str("        real(dp), intent(out) :: x(INPUTS), d(INPUTS, 6), dd(INPUTS, 6, 6)\n");
    for line in law.inputs_with_derivatives(Language::Fortran) {
        write_statement(&mut text, &line);
    }
    text.push_str("    end subroutine features\n\n");
    text.push_str(&BODY.replace("NAME", name));
    Ok(text)
}

/// Writes `data` statements for a list.
fn write_list(text: &mut String, name: &str, values: &[String]) {
    for (block, values) in values.chunks(NUMBERS * LINES).enumerate() {
        let first = block * NUMBERS * LINES + 1;
        let last = first + values.len() - 1;
        let _ = write!(text, "    data ({name}(entry_), entry_ = {first}, {last}) /");
        for (line, values) in values.chunks(NUMBERS).enumerate() {
            let end = if line == 0 { " &\n        " } else { ", &\n        " };
            let _ = write!(text, "{end}{}", values.join(", "));
        }
        text.push_str(" /\n");
    }
}

/// Writes a statement, with continuation lines at sums.
fn write_statement(text: &mut String, line: &str) {
    text.push_str("        ");
    let mut column = 8;
    for (index, part) in line.split(" + ").enumerate() {
        if index > 0 {
            let continued = column + part.len() > 110;
            text.push_str(if continued { " &\n            + " } else { " + " });
            column = if continued { 14 } else { column + 3 };
        }
        text.push_str(part);
        column += part.len();
    }
    text.push('\n');
}

/// Code shared by all laws.
const BODY: &str = include_str!("body.f90");

//! Symbols that hosts call.

use crate::{HeatIncrement, HeatResponse, NAMES, State, file, respond};
use std::ffi::{CStr, c_char, c_int};
use std::path::Path;

/// Length of a name in Fortran.
const NAME: usize = 80;

/// UMATHT as Abaqus declares it; CalculiX appends arguments, which are ignored. `STATEV` holds the three of
/// [`State`] and, if there is a fourth, the latent heat that crystals release per mass and time; `PROPS` are
/// the constants of [`NAMES`]. Invalid numbers end the program with a message that names them.
/// # Safety
/// As in Fortran: every pointer is valid for the length that `NTGRD`, `NSTATV` and `NPROPS` tell, and nothing
/// else refers to what is written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn umatht_(
    u: *mut f64,
    dudt: *mut f64,
    dudg: *mut f64,
    flux: *mut f64,
    dfdt: *mut f64,
    dfdg: *mut f64,
    statev: *mut f64,
    temp: *const f64,
    dtemp: *const f64,
    dtemdx: *const f64,
    _time: *const f64,
    dtime: *const f64,
    _predef: *const f64,
    _dpred: *const f64,
    cmname: *const c_char,
    ntgrd: *const c_int,
    nstatv: *const c_int,
    props: *const f64,
    nprops: *const c_int,
    _coords: *const f64,
    pnewdt: *mut f64,
) {
    let length = |count: c_int| usize::try_from(count).unwrap_or(0);
    // SAFETY: the caller's promise; lengths below 0 are 0
    let (gradient, states, constants, slices) = unsafe {
        let directions = length(*ntgrd).min(3);
        let slice = |data: *mut f64, length: usize| std::slice::from_raw_parts_mut(data, length);
        (
            std::slice::from_raw_parts(dtemdx, directions),
            slice(statev, length(*nstatv)),
            std::slice::from_raw_parts(props, length(*nprops)),
            [
                slice(dudg, directions),
                slice(flux, directions),
                slice(dfdt, directions),
                slice(dfdg, directions * directions),
            ],
        )
    };
    // SAFETY: the caller's promise
    let (temperature, change, time) = unsafe { (*temp, *dtemp, *dtime) };
    if states.len() < 3 {
        abort(&format!("umatht: NSTATV: found {}; allowed: 3 or more (*DEPVAR)", states.len()));
    }
    let directions = gradient.len();
    let mut at = HeatIncrement { temperature, change, time, gradient: [0.0; 3] };
    at.gradient[..directions].copy_from_slice(gradient);
    let state = State { z: states[0], degree: states[1], temperature: states[2] };
    let whole;
    let constants = if file::is_asked(constants) {
        // SAFETY: the caller's promise: 80 characters
        let name = String::from_utf8_lossy(unsafe { std::slice::from_raw_parts(cmname.cast::<u8>(), NAME) });
        whole = file::complete(Path::new(""), &name, constants).unwrap_or_else(|error| abort(&error));
        &whole
    } else {
        constants
    };
    let answer = respond(constants, &at, &state).unwrap_or_else(|error| abort(&error.to_string()));
    states[..3].copy_from_slice(&[answer.state.z, answer.state.degree, answer.state.temperature]);
    if let Some(heat) = states.get_mut(3) {
        // the source that CalculiX' DFLUX adds (include/dflux.f)
        let released = constants[2] * (answer.state.degree - state.degree);
        *heat = if time > 0.0 { released / time } else { 0.0 };
    }
    let [dudg, flux, dfdt, dfdg] = slices;
    dudg.fill(0.0);
    dfdt.fill(0.0);
    flux.copy_from_slice(&answer.flux[..directions]);
    for i in 0..directions {
        for j in 0..directions {
            // symmetric: the order of Fortran is that of Rust
            dfdg[directions * i + j] = answer.conductivity[3 * i + j];
        }
    }
    // SAFETY: the caller's promise
    unsafe {
        *u += answer.energy;
        *dudt = answer.slope;
        if answer.step_ratio < 1.0 {
            *pnewdt = answer.step_ratio;
        }
    }
}

/// Ends the process: a host cannot continue, and no Fortran routine returns an error.
fn abort(message: &str) -> ! {
    eprintln!("{message}");
    std::process::exit(2)
}

/// `int crystfem_respond(constants, count, increment, state, answer)`: returns 0, or 1 if a number is out of
/// range, with a message.
///
/// # Safety
/// `constants` points to `count` numbers, the others to what `include/crystfem.h` declares.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn crystfem_respond(
    constants: *const f64,
    count: usize,
    at: *const [f64; 6],
    state: *const State,
    answer: *mut HeatResponse,
) -> c_int {
    // SAFETY: the caller's promise
    let (constants, [temperature, change, time, gradient @ ..], state) =
        unsafe { (std::slice::from_raw_parts(constants, count), *at, &*state) };
    match respond(constants, &HeatIncrement { temperature, change, time, gradient }, state) {
        Ok(found) => {
            // SAFETY: the caller's promise
            unsafe { answer.write(found) };
            0
        }
        Err(error) => {
            eprintln!("{error}");
            1
        }
    }
}

/// `int crystfem_constant(name)`: returns the index of a constant, from 0; −1 for an unknown name.
/// # Safety
/// `name` points to a text that ends with 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn crystfem_constant(name: *const c_char) -> c_int {
    // SAFETY: the caller's promise
    let name = unsafe { CStr::from_ptr(name) };
    let place = NAMES.iter().position(|own| own.as_bytes() == name.to_bytes());
    place.and_then(|place| c_int::try_from(place).ok()).unwrap_or(-1)
}

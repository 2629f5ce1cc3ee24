//! Symbols that hosts call. `umatht_` of [`umatht`] is included.

use crate::{Error, Material, Print};
use polycore::constitutive::viscoelastic::user_material::CALCULIX_CONSTANTS;
use polycore::tensor::voigt::{self, Voigt, Voigt6x6};
use std::cell::RefCell;
use std::ffi::{c_char, c_int};

/// Length of a name in Fortran.
const NAME: usize = 80;
/// Ratio to which a host may cut its increment if there is no stress.
const CUT: f64 = 0.25;

/// Material with its name and constants.
type CachedMaterial = (Vec<u8>, Vec<f64>, Material);

thread_local! {
    /// Last material on this thread: hosts call once per integration point and iteration.
    static LAST: RefCell<Option<CachedMaterial>> = const { RefCell::new(None) };
}

fn with_material<R>(name: &[u8], constants: &[f64], work: impl FnOnce(&Material) -> R) -> R {
    LAST.with_borrow_mut(|last| {
        let (.., material) = match last.take() {
            Some(kept) if kept.0 == name && kept.1 == constants => last.insert(kept),
            _ => {
                let made = Material::new(&String::from_utf8_lossy(name), constants);
                let made = made.unwrap_or_else(|error| abort(&error));
                last.insert((name.to_vec(), constants.to_vec(), made))
            }
        };
        work(material)
    })
}

/// Ends the process: a host cannot continue, and no Fortran routine returns an error.
fn abort(message: &Error) -> ! {
    eprintln!("{message}");
    std::process::exit(2)
}

fn states(found: usize, needed: usize) {
    if found < needed {
        abort(&Error::new("state variables (*DEPVAR)", found, needed));
    }
}

/// Components of stress and strain that a host passes.
#[derive(Clone, Copy)]
struct Components(usize);

impl Components {
    /// Checks the numbers of normal and of all components.
    fn new(normal: c_int, all: c_int) -> Self {
        match (normal, all) {
            (3, 6) => Self(6),
            (3, 4) => Self(4),
            _ => {
                let allowed = "3 and 3: solids; 3 and 1: plane strain and axisymmetry; no plane stress";
                abort(&Error::new(
                    "normal and shear stresses",
                    format!("{normal} and {}", all - normal),
                    allowed,
                ))
            }
        }
    }

    /// Strain with 0 for the components that are not passed.
    fn strain(self, own: &[f64]) -> Voigt {
        Voigt::from_fn(|k, _| own.get(k).copied().unwrap_or(0.0))
    }
}

/// UMAT as Abaqus declares it (*Abaqus User Subroutines Guide*, 1.1.44): three normal stresses, three shear
/// stresses or one. Rubbers use F from `DFGRD1`, with branches also `DTIME` and the temperature at the end;
/// prints the strains `STRAN` + `DSTRAN`. If a law has no stress, `PNEWDT` requests a quarter of the
/// increment, and the state stays as it was.
///
/// Energies are per deformed volume, in the host's unit of stress: `SSE` is W/J of a rubber or the elastic
/// energy of a print, `SPD` the energy dissipated by softening or by growing and melting crystals, `SCD` that
/// of relaxation.
///
/// # Safety
/// As in Fortran: every pointer is valid for the length that `NTENS`, `NSTATV` and `NPROPS` tell, and nothing
/// else refers to what is written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn umat_(
    stress: *mut f64,
    statev: *mut f64,
    ddsdde: *mut f64,
    sse: *mut f64,
    spd: *mut f64,
    scd: *mut f64,
    _rpl: *mut f64,
    _ddsddt: *mut f64,
    _drplde: *mut f64,
    _drpldt: *mut f64,
    stran: *const f64,
    dstran: *const f64,
    _time: *const f64,
    dtime: *const f64,
    temp: *const f64,
    dtemp: *const f64,
    _predef: *const f64,
    _dpred: *const f64,
    cmname: *const c_char,
    ndi: *const c_int,
    _nshr: *const c_int,
    ntens: *const c_int,
    nstatv: *const c_int,
    props: *const f64,
    nprops: *const c_int,
    _coords: *const f64,
    drot: *const [f64; 9],
    pnewdt: *mut f64,
    _celent: *const f64,
    _dfgrd0: *const f64,
    dfgrd1: *const [f64; 9],
) {
    let length = |count: c_int| usize::try_from(count).unwrap_or(0);
    // SAFETY: the caller's promise
    let components = unsafe { Components::new(*ndi, *ntens) };
    let count = components.0;
    // SAFETY: the caller's promise; `NTENS` is `count`, lengths below 0 are 0
    let (name, constants, state, change) = unsafe {
        (
            std::slice::from_raw_parts(cmname.cast::<u8>(), NAME),
            std::slice::from_raw_parts(props, length(*nprops)),
            std::slice::from_raw_parts_mut(statev, length(*nstatv)),
            [stran, dstran].map(|own| components.strain(std::slice::from_raw_parts(own, count))),
        )
    };
    let answer: Result<_, Error> = with_material(name, constants, |material| match material {
        // SAFETY: the caller's promise
        Material::Rubber(rubber) => {
            let (stress, tangent, energy) = rubber.stored(unsafe { &*dfgrd1 })?;
            // SAFETY: the caller's promise
            unsafe { *sse = energy };
            Ok((stress, tangent))
        }
        Material::Relaxing(rubber) => {
            states(state.len(), rubber.states());
            // SAFETY: the caller's promise
            let (f, time, temperature) = unsafe { (&*dfgrd1, *dtime, *temp + *dtemp) };
            let kelvin = rubber.kelvin(temperature).unwrap_or_else(|error| abort(&error));
            let (stress, tangent, energies) = rubber.cauchy(state, f, time, kelvin)?;
            // SAFETY: the caller's promise; the state has the energies since the start
            unsafe {
                *sse = energies.stored;
                *spd = energies.softening;
                *scd = energies.viscous;
            }
            Ok((stress, tangent))
        }
        Material::Print(print) => {
            states(state.len(), Print::STATES);
            // SAFETY: the caller's promise
            let (turn, time, temperature) = unsafe { (&*drot, *dtime, *temp + *dtemp) };
            let mut old = state.to_vec();
            turned(&mut old, turn);
            // the host has rotated its own strain
            old[3..9].copy_from_slice(change[0].as_slice());
            let (stress, tangent, energies) =
                print.advance(&old, state, temperature, time, |before| before + change[1])?;
            // SAFETY: the caller's promise; they hold the energies at the start
            unsafe {
                *sse += energies.stored;
                *spd += energies.crystals;
                *scd += energies.viscous;
            }
            Ok((stress, tangent))
        }
    });
    // SAFETY: the caller's promise
    let (stress, tangent) = unsafe {
        (std::slice::from_raw_parts_mut(stress, count), std::slice::from_raw_parts_mut(ddsdde, count * count))
    };
    match answer {
        Ok((found, slope)) => {
            stress.copy_from_slice(&found.as_slice()[..count]);
            for (own, column) in tangent.chunks_exact_mut(count).zip(slope.column_iter()) {
                own.iter_mut().zip(column.iter()).for_each(|(own, entry)| *own = *entry);
            }
        }
        Err(_) => {
            tangent.fill(0.0);
            // SAFETY: the caller's promise
            unsafe { *pnewdt = CUT };
        }
    }
}

/// Rotates the elastic strains of a state by `DROT`.
fn turned(state: &mut [f64], turn: &[f64; 9]) {
    if *turn == [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0] {
        return;
    }
    let transformation = voigt::stress_transformation(&polycore::tensor::Tensor::from_column_slice(turn));
    for branch in state[9..Print::STATES].chunks_exact_mut(6) {
        let found = transformation * Voigt::from_column_slice(branch);
        branch.copy_from_slice(found.as_slice());
    }
}

/// UMAT_USER of CalculiX 2.20, materials whose name begins with `USER`: Green's strain (tensor shears) in, S
/// and dS/dE out; no `*ORIENTATION`.
///
/// # Safety
/// As in Fortran: every pointer is valid for what CalculiX declares, and nothing else refers to what is
/// written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn umat_user_(
    amat: *const c_char,
    iel: *const c_int,
    iint: *const c_int,
    kode: *const c_int,
    elconloc: *const f64,
    emec: *const [f64; 6],
    _emec0: *const f64,
    beta: *const [f64; 6],
    _xokl: *const f64,
    _voj: *const f64,
    _xkl: *const f64,
    _vj: *const f64,
    ithermal: *const c_int,
    t1l: *const f64,
    dtime: *const f64,
    _time: *const f64,
    _ttime: *const f64,
    icmd: *const c_int,
    _ielas: *const c_int,
    mi: *const c_int,
    nstate: *const c_int,
    xstateini: *const f64,
    xstate: *mut f64,
    stre: *mut [f64; 6],
    stiff: *mut [f64; 21],
    iorien: *const c_int,
    _pgauss: *const f64,
    _orab: *const f64,
    pnewdt: *mut f64,
) {
    let length = |count: c_int| usize::try_from(count).unwrap_or(0);
    // SAFETY: the caller's promise
    let (orientation, kode) = unsafe { (*iorien, *kode) };
    if orientation != 0 {
        abort(&Error::new("*ORIENTATION", orientation, "none: these materials are isotropic"));
    }
    let count = length(-kode - 100);
    if count > CALCULIX_CONSTANTS {
        let allowed = format!("at most {CALCULIX_CONSTANTS}, for which CalculiX has room");
        abort(&Error::new("constants (*USER MATERIAL)", count, allowed));
    }
    // SAFETY: the caller's promise: xstate(nstate, mi(1), elements), numbers from 1
    let (name, constants, strain, old, new) = unsafe {
        let states = length(*nstate);
        let place = states * (length(*iint - 1) + length(*mi) * length(*iel - 1));
        (
            std::slice::from_raw_parts(amat.cast::<u8>(), NAME),
            // CalculiX encodes the number of constants like this
            std::slice::from_raw_parts(elconloc, count),
            Voigt::from_column_slice(&*emec),
            std::slice::from_raw_parts(xstateini.wrapping_add(place), states),
            std::slice::from_raw_parts_mut(xstate.wrapping_add(place), states),
        )
    };
    // shears doubled
    let doubled = Voigt::from_fn(|k, _| strain[k] * if k < 3 { 1.0 } else { 2.0 });
    let answer = with_material(name, constants, |material| match material {
        Material::Rubber(rubber) => {
            let c = Voigt::from_fn(|k, _| 2.0 * strain[k] + if k < 3 { 1.0 } else { 0.0 });
            rubber.material(&c)
        }
        Material::Relaxing(rubber) => {
            states(old.len(), rubber.states());
            new.copy_from_slice(old);
            let c = Voigt::from_fn(|k, _| 2.0 * strain[k] + if k < 3 { 1.0 } else { 0.0 });
            // SAFETY: the caller's promise
            let (heated, given, time) = unsafe { (*ithermal != 0, *t1l, *dtime) };
            let temperature = if heated { given } else { f64::NAN };
            let kelvin = rubber.kelvin(temperature).unwrap_or_else(|error| abort(&error));
            let (stress, tangent, _) = rubber.material(new, &c, time, kelvin)?;
            Ok((stress, tangent))
        }
        Material::Print(print) => {
            states(old.len(), Print::STATES);
            // SAFETY: the caller's promise
            let (temperature, time) = unsafe { (*t1l, *dtime) };
            print
                .advance(old, new, temperature, time, |_| doubled)
                .map(|(stress, tangent, _)| (stress, tangent))
        }
    });
    match answer {
        // SAFETY: the caller's promise; `stiff` is written unless ICMD is 3
        Ok((stress, tangent)) => unsafe {
            *stre = (stress - Voigt::from(*beta)).into();
            if *icmd != 3 {
                *stiff = upper(&tangent);
            }
        },
        // SAFETY: the caller's promise
        Err(_) => unsafe { *pnewdt = CUT },
    }
}

/// Upper triangle, column by column.
fn upper(tangent: &Voigt6x6) -> [f64; 21] {
    let places: Vec<(usize, usize)> = (0..6).flat_map(|b| (0..=b).map(move |a| (a, b))).collect();
    std::array::from_fn(|k| {
        let (a, b) = places[k];
        0.5 * (tangent[(a, b)] + tangent[(b, a)])
    })
}

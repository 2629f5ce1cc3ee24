//! Calls of `umat_` in Abaqus' form, and errors of materials.

use crate::host::umat_;
use crate::{Material, Print};
use polycore::constitutive::hyperelastic::homogeneous::uniaxial;
use polycore::constitutive::hyperelastic::model;
use polycore::tensor::Tensor;
use polycore::tensor::voigt::{self, PAIRS, Voigt, Voigt6x6};

/// Arguments that change from one call to the next.
pub(crate) struct UmatCall<'a> {
    pub name: &'a str,
    pub constants: &'a [f64],
    pub deformation: Tensor,
    pub strain: [Voigt; 2],
    pub temperature: [f64; 2],
    pub time: f64,
    pub turn: Tensor,
    /// Shear stresses, 3 or 1; the others come back as 0.
    pub shears: usize,
}

impl UmatCall<'_> {
    /// Returns σ, DDSDDE and PNEWDT.
    pub fn umat(&self, state: &mut [f64]) -> (Voigt, Voigt6x6, f64) {
        self.with_energies(state, &mut [0.0; 3])
    }

    /// Calls it as above, and updates SSE, SPD and SCD.
    pub fn with_energies(&self, state: &mut [f64], energies: &mut [f64; 3]) -> (Voigt, Voigt6x6, f64) {
        let [sse, spd, scd] = energies;
        let (mut stress, mut tangent, mut cut) = ([0.0; 6], [0.0; 36], 1.0);
        let mut one = [0.0; 9];
        let none = one.as_mut_ptr();
        let mut name = [b' '; 80];
        name[..self.name.len()].copy_from_slice(self.name.as_bytes());
        let square = |tensor: &Tensor| -> [f64; 9] { std::array::from_fn(|k| tensor.as_slice()[k]) };
        let (f, turn) = (square(&self.deformation), square(&self.turn));
        let count = 3 + self.shears;
        let [start, change] = [self.temperature[0], self.temperature[1] - self.temperature[0]];
        // SAFETY: every array has the length that the call states; what is not read has nine numbers
        unsafe {
            umat_(
                stress.as_mut_ptr(),
                state.as_mut_ptr(),
                tangent.as_mut_ptr(),
                sse,
                spd,
                scd,
                none,
                none,
                none,
                none,
                self.strain[0].as_ptr(),
                self.strain[1].as_ptr(),
                none,
                &self.time,
                &start,
                &change,
                none,
                none,
                name.as_ptr().cast(),
                &3,
                &(self.shears as i32),
                &(count as i32),
                &(state.len() as i32),
                self.constants.as_ptr(),
                &(self.constants.len() as i32),
                none,
                &turn,
                &mut cut,
                none,
                none,
                &f,
            );
        }
        let entry = |a: usize, b: usize| if a < count && b < count { tangent[a + count * b] } else { 0.0 };
        (Voigt::from(stress), Voigt6x6::from_fn(entry), cut)
    }
}

pub(crate) fn call<'a>(name: &'a str, constants: &'a [f64], deformation: Tensor) -> UmatCall<'a> {
    let turn = Tensor::identity();
    UmatCall {
        name,
        constants,
        deformation,
        strain: [Voigt::zeros(); 2],
        temperature: [0.0; 2],
        time: 1.0,
        turn,
        shears: 3,
    }
}

/// Nearly incompressible under uniaxial stress: σ₁₁ of the incompressible law, to μ/K.
#[test]
fn chains_under_uniaxial_stress() {
    let (chain, links, stretch) = (0.3, 25.0, 3.0_f64);
    let nominal = uniaxial(&*model("eight-chain").unwrap().law(&[chain, links]).unwrap(), stretch).unwrap();
    // σ₂₂ = 0 by the transverse stretch
    let mut transverse = stretch.powf(-0.5);
    for _ in 0..20 {
        let f = Tensor::from_diagonal(&[stretch, transverse, transverse].into());
        let (stress, tangent, _) = call("EIGHT_CHAIN_SBR", &[1e4, chain, links], f).umat(&mut []);
        transverse *= (-stress[1] / (tangent[(1, 1)] + tangent[(1, 2)])).exp();
    }
    let f = Tensor::from_diagonal(&[stretch, transverse, transverse].into());
    let (stress, ..) = call("EIGHT_CHAIN_SBR", &[1e4, chain, links], f).umat(&mut []);
    evidence::near("eight-chain UMAT under uniaxial stress", stress[0] / (nominal * stretch), 1.0, 2e-4);
}

/// DDSDDE is the Jaumann tangent of τ = Jσ: differences under a stretching without spin.
#[test]
fn tangent_by_differences() {
    let f = Tensor::new(1.3, 0.2, -0.1, 0.0, 0.9, 0.15, 0.1, 0.0, 0.95);
    for (name, constants) in [
        ("NEO_HOOKEAN", &[20.0, 1.0][..]),
        ("EIGHT_CHAIN_ROOT_I2", &[30.0, 0.5, 12.0, 0.8][..]),
        ("GENT", &[30.0, 0.5, 60.0][..]),
        ("VAN_DER_WAALS", &[30.0, 0.5, 9.0, 0.2, 0.1][..]),
        ("HYPERFOAM_1", &[0.5, 4.0, 0.3][..]),
    ] {
        let kirchhoff = |f: Tensor| {
            let (stress, ..) = call(name, constants, f).umat(&mut []);
            stress * f.determinant()
        };
        let (_, tangent, _) = call(name, constants, f).umat(&mut []);
        let step = 1e-5;
        for (b, (k, l)) in PAIRS.into_iter().enumerate() {
            let mut rate = Tensor::zeros();
            rate[(k, l)] += 0.5;
            rate[(l, k)] += 0.5;
            let moved = |sign: f64| kirchhoff((Tensor::identity() + rate * (sign * step)) * f);
            let column = (moved(1.0) - moved(-1.0)) / (2.0 * step * f.determinant());
            let off = (column - tangent.column(b)).norm() / tangent.norm();
            assert!(off < 1e-8, "{name} {b}: {off}");
        }
    }
}

/// SSE is the stored energy of the deformed volume: J SSE grows by the work J σ:d of a slow path from rest.
#[test]
fn stored_energy_is_work() {
    let end = Tensor::new(0.3, 0.2, -0.1, 0.0, -0.1, 0.15, 0.1, 0.0, -0.05);
    for (name, constants) in [("NEO_HOOKEAN", &[20.0, 1.0][..]), ("EIGHT_CHAIN", &[30.0, 0.5, 12.0][..])] {
        let at = |part: f64| Tensor::identity() + part * end;
        let (mut work, steps) = (0.0, 200);
        let mut sse = [0.0; 3];
        for step in 0..steps {
            let [from, to] = [step, step + 1].map(|k| f64::from(k) / f64::from(steps));
            // midpoint rule: P : dF = J σ F⁻ᵀ : dF
            let f = at(0.5 * (from + to));
            let (stress, ..) = call(name, constants, f).umat(&mut []);
            let piola = voigt::to_stress(&stress) * f.try_inverse().unwrap().transpose() * f.determinant();
            work += piola.dot(&((to - from) * end));
            call(name, constants, at(to)).with_energies(&mut [], &mut sse);
        }
        let stored = sse[0] * at(1.0).determinant();
        assert!((stored / work - 1.0).abs() < 1e-4 && work > 0.01, "{name}: {stored} {work}");
        assert_eq!(sse[1..], [0.0; 2]);
    }
}

/// Work on a print with grown crystals at constant temperature is stored or relaxed: there is no free strain,
/// and no energy is lost.
#[test]
fn energies_of_a_print_close() {
    let constants = [1.0, 273.15, 180.0, 0.25, 1e6];
    let mut state = vec![0.0; Print::STATES];
    let mut energies = [0.0; 3];
    let mut one = call("PRINTED_PA12", &constants, Tensor::identity());
    (one.time, one.temperature) = (10.0, [150.0; 2]);
    let mut before = Voigt::zeros();
    for _ in 0..300 {
        before = one.with_energies(&mut state, &mut energies).0;
    }
    // held while it shrinks: crystals dissipate the energy of their birth
    assert!(state[1] > 0.999 && energies[0] > 0.0 && energies[1] > 0.0, "{energies:?} {}", state[1]);
    let (grown, mut work, steps) = (energies, 0.0, 2000);
    for step in 0..steps {
        one.time = 0.05;
        let sign = if step < steps / 2 { 1.0 } else { -0.7 };
        one.strain[1] = Voigt::new(1.0, -0.3, 0.0, 0.4, 0.0, 0.2) * (sign * 2e-5);
        let stress = one.with_energies(&mut state, &mut energies).0;
        work += 0.5 * (before + stress).dot(&one.strain[1]);
        before = stress;
        one.strain[0] += one.strain[1];
    }
    let [stored, crystals, viscous] = std::array::from_fn(|k| energies[k] - grown[k]);
    assert!(viscous > 0.1 * work && crystals.abs() < 1e-3 * work, "{stored} {crystals} {viscous} {work}");
    assert!(((stored + crystals + viscous) / work - 1.0).abs() < 2e-3, "{stored} {viscous} {work}");
}

/// A held print cools; rotated by 90° with its strains, its stresses rotate.
#[test]
fn a_print_turns() {
    let constants = [1.0, 273.15, 180.0, 0.25, 1e6];
    let mut state = vec![0.0; Print::STATES];
    let mut one = call("PRINTED_PA12", &constants, Tensor::identity());
    (one.time, one.temperature) = (20.0, [180.0, 170.0]);
    let mut stress = Voigt::zeros();
    for _ in 0..15 {
        // stretched along x, sheared in the plane of x and y
        one.strain[1] = Voigt::new(1e-3, 0.0, 0.0, 5e-4, 0.0, 0.0);
        stress = one.umat(&mut state).0;
        one.strain[0] += one.strain[1];
        one.temperature = one.temperature.map(|celsius| celsius - 10.0);
    }
    assert!(stress[0] > stress[1] + 1.0 && stress[3] > 0.2, "{stress}");
    let turn = Tensor::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let celsius = state[2] - 273.15;
    let still = |turn: Tensor, strain: Voigt, state: &[f64]| {
        let mut call = call("PRINTED_PA12", &constants, Tensor::identity());
        (call.turn, call.time, call.temperature, call.strain[0]) = (turn, 0.0, [celsius; 2], strain);
        call.umat(&mut state.to_vec()).0
    };
    let before = still(Tensor::identity(), one.strain[0], &state);
    let strain = voigt::from_strain(&(turn * voigt::to_strain(&one.strain[0]) * turn.transpose()));
    let after = still(turn, strain, &state);
    let expected = voigt::stress_transformation(&turn) * before;
    assert!((after - expected).norm() < 1e-12 * before.norm(), "{after} {expected}");
}

#[test]
fn wrong_input_is_named() {
    for (name, constants, says) in [
        ("RUBBER", &[][..], "one that begins with NEO_HOOKEAN"),
        ("EIGHT_CHAINS", &[100.0, 0.3, 25.0][..], "EIGHT_CHAIN"),
        ("EIGHT_CHAIN", &[100.0, 0.3][..], "allowed: K"),
        ("USER_EIGHT_CHAIN", &[0.01, 0.3, 25.0][..], "above"),
        ("EIGHT_CHAIN", &[100.0, -0.3, 25.0][..], "-0.3"),
        ("PRINTED_PA12", &[1.0, 0.0, 493.15, 0.25][..], "Pa in the unit"),
        ("PRINTED_PA12", &[3.0, 0.0, 493.15, 0.25, 1.0][..], "column of Table 4.1"),
        ("PRINTED_PA12", &[1.0, 0.0, -1.0, 0.25, 1.0][..], "above 0"),
        ("PRINTED_PA12", &[1.0, 0.0, 493.15, 1.5, 1.0][..], "0 to 1"),
    ] {
        let error = Material::new(name, constants).err().unwrap().to_string();
        assert!(error.contains(says), "{name}: {error}");
    }
    // chains beyond their limit: the host cuts its increment
    let f = Tensor::from_diagonal(&[9.0, 0.3, 0.3].into());
    let (_, tangent, cut) = call("EIGHT_CHAIN", &[100.0, 0.3, 4.0], f).umat(&mut []);
    assert!(cut == 0.25 && tangent.iter().all(|entry| *entry == 0.0));
}

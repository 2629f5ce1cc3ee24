//! Solidifying body of prints under the strains and temperatures of a host.

use crate::Error;
use crystfem::mechanics::SolidifyingMaxwell;
use polycore::tensor::voigt::{Voigt, Voigt6x6};
use umatht::{HeatIncrement, State, respond};

/// PA12 that crystallizes, shrinks and relaxes ([`SolidifyingMaxwell::pa12`]); it integrates α from the
/// temperatures of the host. Strains are small.
pub struct Print {
    body: SolidifyingMaxwell,
    /// Constants of [`umatht::respond`].
    thermal: [f64; 5],
    /// Temperature at birth, in the host's degrees.
    birth: f64,
    /// Value in Pa of the host's unit of stress.
    unit: f64,
}

/// Work of an increment by destination, in the host's unit of stress; the three together are the work of the
/// stress on the strain without the free strain.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dissipation {
    /// Increase of the elastic energy.
    pub stored: f64,
    /// Dissipated by growing and melting crystals, and by softening.
    pub crystals: f64,
    /// Dissipated by relaxation, including that of the melt.
    pub viscous: f64,
}

/// Number of strain components of a branch.
const COMPONENTS: usize = 6;

impl Print {
    /// Name in the input of a host, without `USER_`.
    pub const NAME: &'static str = "printed-pa12";
    /// Number of state variables: z, α, T (K), the total strain at the end (6), and the elastic strains of
    /// the branches (6 × 6); all 0 at birth.
    pub const STATES: usize = 9 + 6 * COMPONENTS;

    /// Creates the body from its constants: column of Table 4.1 (1 or 2), absolute zero (0 in kelvin, 273.15
    /// in °C), temperature at birth in the host's degrees (zero strain), crystallinity X∞ at α = 1, and the
    /// value in Pa of the host's unit of stress (1e6 for MPa).
    ///
    /// # Errors
    /// Constants out of range, too few or too many.
    pub fn new(constants: &[f64]) -> Result<Self, Error> {
        let &[column, zero, birth, crystallinity, unit] = constants else {
            let allowed =
                "5: column of Table 4.1, absolute zero, temperature of birth, X∞, Pa in the unit of stress";
            return Err(Error::new("constants of PRINTED_PA12", format!("{constants:?}"), allowed));
        };
        if !(0.0..1.0).contains(&crystallinity) {
            return Err(Error::new("X∞", crystallinity, "0 to 1"));
        }
        if !(unit.is_finite() && unit > 0.0) {
            return Err(Error::new("unit of stress", unit, "above 0"));
        }
        let body = SolidifyingMaxwell::pa12().with_crystallinity(crystallinity);
        let print = Self { body, thermal: [1.0, 1.0, 0.0, column, zero], birth, unit };
        print.degree(&State::default(), birth, birth, 0.0)?;
        Ok(print)
    }

    fn degree(&self, state: &State, from: f64, to: f64, time: f64) -> Result<State, Error> {
        let at = HeatIncrement { temperature: from, change: to - from, time, gradient: [0.0; 3] };
        let answer = respond(&self.thermal, &at, state);
        Ok(answer.map_err(|error| Error::new(error.name, error.found, error.allowed))?.state)
    }

    /// Computes stress, tangent and energies after an increment to a temperature, in a time, s; `strain`
    /// gives the total strain at its start and end, shears doubled. Reads `state`, writes `new`, both of
    /// [`Self::STATES`] numbers.
    ///
    /// # Errors
    /// Temperatures below absolute zero.
    pub fn advance(
        &self,
        state: &[f64],
        new: &mut [f64],
        temperature: f64,
        time: f64,
        strain: impl FnOnce(&Voigt) -> Voigt,
    ) -> Result<(Voigt, Voigt6x6, Dissipation), Error> {
        let zero = self.thermal[4];
        let old = State { z: state[0], degree: state[1], temperature: state[2] };
        // 0 in fresh material
        let start = if old.temperature > 0.0 { old.temperature - zero } else { self.birth };
        let end = self.degree(&old, start, temperature, time)?;
        let step = self.body.increment([start + zero, old.degree], [end.temperature, end.degree], time);
        let before = Voigt::from_column_slice(&state[3..9]);
        let after = strain(&before);
        // tensor components, without the free strain
        let mechanical: [f64; COMPONENTS] = std::array::from_fn(|k| {
            let change = after[k] - before[k];
            if k < 3 { change - step.free_strain } else { 0.5 * change }
        });
        let mut branches = [[0.0; COMPONENTS]; 6];
        let count = self.body.branches();
        for (branch, kept) in branches.iter_mut().zip(state[9..].chunks_exact(COMPONENTS)) {
            branch.copy_from_slice(kept);
        }
        let nu = self.body.poisson;
        // Ĉ of modulus 1
        let (lame, shear) = (nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), 0.5 / (1.0 + nu));
        let product = |a: &[f64; COMPONENTS], b: &[f64; COMPONENTS]| {
            let sum = |range: std::ops::Range<usize>| range.map(|k| a[k] * b[k]).sum::<f64>();
            let traces = (a[0] + a[1] + a[2]) * (b[0] + b[1] + b[2]);
            lame * traces + 2.0 * shear * (sum(0..3) + 2.0 * sum(3..6))
        };
        let energies = step.energies(&branches[..count], &mechanical, product);
        let floor = 0.5 * step.floor * product(&mechanical, &mechanical);
        let dissipation = Dissipation {
            stored: energies.stored / self.unit,
            crystals: (energies.growth + energies.melting - energies.softening) / self.unit,
            viscous: (energies.viscous + floor) / self.unit,
        };
        step.advance(&mut branches[..count], &mechanical);
        let elastic = step.stress(&branches[..count]);
        let sum: [f64; COMPONENTS] = std::array::from_fn(|k| elastic[k] + step.floor * mechanical[k]);
        new[..3].copy_from_slice(&[end.z, end.degree, end.temperature]);
        new[3..9].copy_from_slice(after.as_slice());
        for (branch, kept) in branches.iter().zip(new[9..].chunks_exact_mut(COMPONENTS)) {
            kept.copy_from_slice(branch);
        }
        let volume = lame * (sum[0] + sum[1] + sum[2]);
        let stress = Voigt::from_fn(|k, _| 2.0 * shear * sum[k] + if k < 3 { volume } else { 0.0 });
        let tangent = Voigt6x6::from_fn(|a, b| {
            let common = if a < 3 && b < 3 { lame } else { 0.0 };
            let own = if a == b { shear * if a < 3 { 2.0 } else { 1.0 } } else { 0.0 };
            common + own
        });
        Ok((stress / self.unit, tangent * (step.stiffness / self.unit), dissipation))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crystfem::exact::Wall;

    /// Advances a point of a plate with given strain in its plane and σ₃₃ = 0; returns the stress in the
    /// plane and its slope.
    fn point(print: &Print, state: &[f64], new: &mut [f64], t: f64, dt: f64, plane: f64) -> (f64, f64) {
        let mut advance = |third: f64| {
            print.advance(state, new, t, dt, |_| Voigt::new(plane, plane, third, 0.0, 0.0, 0.0)).unwrap()
        };
        // linear in the strain
        let (stress, tangent, _) = advance(state[5]);
        let stress = advance(state[5] - stress[2] / tangent[(2, 2)]).0;
        let coupled = tangent[(0, 2)] * (tangent[(2, 0)] + tangent[(2, 1)]) / tangent[(2, 2)];
        (stress[0], tangent[(0, 0)] + tangent[(0, 1)] - coupled)
    }

    /// A plate of 4 mm, 220 °C to 25 °C, Bi = 1 on both faces, after 600 s: `docs/reference/print/plate.py`,
    /// MPa.
    #[test]
    fn a_plate_cools() {
        let print = Print::new(&[1.0, 273.15, 220.0, 0.25, 1e6]).unwrap();
        let (wall, cells) = (Wall { biot: 1.0 }, 40);
        for (held, expected) in [(true, [27.5719, 27.0687]), (false, [5.5791, -14.4911])] {
            // centres of cells, with the centre and the surface of the plate, which have no weight
            let mut places: Vec<f64> = (0..cells).map(|k| (f64::from(k) + 0.5) / f64::from(cells)).collect();
            places.extend([0.0, 1.0]);
            let mut states = vec![vec![0.0; Print::STATES]; places.len()];
            let (mut plane, mut time, mut found) = (0.0, 0.0, Vec::new());
            for step in 1..=400 {
                let next = 600.0 * (f64::from(step) / 400.0_f64).powi(2);
                let at = |place: f64| {
                    let fourier = 0.25 / 1010.0 / 2200.0 * next / 4e-6;
                    25.0 + 195.0 * wall.share(place, fourier)
                };
                let mut new = states.clone();
                let all = |plane: f64, new: &mut [Vec<f64>]| -> Vec<(f64, f64)> {
                    let points = places.iter().zip(&states).zip(new);
                    points
                        .map(|((place, state), new)| {
                            point(&print, state, new, at(*place), next - time, plane)
                        })
                        .collect()
                };
                found = all(plane, &mut new);
                if !held {
                    let sum =
                        |of: fn(&(f64, f64)) -> f64| found[..cells as usize].iter().map(of).sum::<f64>();
                    plane -= sum(|point| point.0) / sum(|point| point.1);
                    found = all(plane, &mut new);
                }
                (states, time) = (new, next);
            }
            for (found, expected) in found[cells as usize..].iter().zip(expected) {
                assert!((found.0 / expected - 1.0).abs() < 2e-3, "held {held}: {} {expected}", found.0);
            }
        }
    }
}

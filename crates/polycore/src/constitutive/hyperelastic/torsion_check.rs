//! Plausibility of torsion tests: signs of torques, held stretches, the shear modulus that torques imply.

use std::ops::RangeInclusive;

use super::data::TestState;

/// Held stretches of a cylinder; others are strains or in per cent.
pub const HELD_STRETCHES: RangeInclusive<f64> = 0.3..=20.0;

/// Share of the largest torque below which one against its twist is noise.
const NOISE_LEVEL: f64 = 0.02;

/// Shear moduli of gels and rubbers, Pa: a torque in another unit gives one beyond.
const MODULI: RangeInclusive<f64> = 100.0..=100e6;
/// Least shear modulus of a rubber, Pa; gels are softer.
const LEAST_RUBBER: f64 = 1e3;

/// Checks the torques of some states, all of torsion. Returns a remark on a modulus that is rare.
///
/// # Errors
/// Index of a state and the torque allowed there: one against its twist, one without a twist, torques that
/// imply a shear modulus of no rubber or gel.
pub fn check_torques(states: &[TestState]) -> Result<Option<String>, (usize, String)> {
    let shear = |state: &TestState| state.cylinder().map_or(0.0, |cylinder| cylinder.shear);
    let largest = states.iter().map(|state| state.nominal[0].abs()).fold(0.0, f64::max);
    if let Some(at) = states.iter().position(|state| state.nominal[0] < -NOISE_LEVEL * largest) {
        return Err((at, "a torque with the sign of its twist".to_owned()));
    }
    let is_offset = |state: &TestState| shear(state) == 0.0 && state.nominal[0] > NOISE_LEVEL * largest;
    if let Some(at) = states.iter().position(is_offset) {
        return Err((at, "no torque at a twist of 0".to_owned()));
    }
    let measured = || states.iter().enumerate().filter(|(_, state)| state.nominal[0] != 0.0);
    // slope through rest: 2M/(πR³) = μψR
    let sum = |of: &dyn Fn(&TestState) -> f64| measured().map(|(_, state)| of(state)).sum::<f64>();
    let modulus = sum(&|state| shear(state) * state.nominal[0]) / sum(&|state| shear(state).powi(2));
    let by_torque = |a: &(usize, &TestState), b: &(usize, &TestState)| {
        a.1.nominal[0].abs().total_cmp(&b.1.nominal[0].abs())
    };
    let Some((at, _)) = measured().max_by(by_torque).filter(|_| !modulus.is_nan()) else { return Ok(None) };
    let advice = "check the units of the torque (N m is 1000 N mm) and of the twist, and the radius";
    if !MODULI.contains(&modulus) {
        let (low, high) = (MODULI.start(), MODULI.end() / 1e6);
        return Err((
            at,
            format!(
                "torques of a shear modulus 2M/(πψR⁴) of {low} Pa to {high} MPa, those of gels and rubbers; \
                 it is {modulus:.3e} Pa: {advice}"
            ),
        ));
    }
    let remark = format!(
        "the torques imply a shear modulus of {modulus:.0} Pa, less than that of a rubber: for no gel, \
         {advice}"
    );
    Ok((modulus < LEAST_RUBBER).then_some(remark))
}

#[cfg(test)]
mod tests {
    use super::super::TwistedCylinder;
    use super::super::data::Mode;
    use super::*;

    /// States of a linear cylinder of this modulus.
    fn states(modulus: f64) -> Vec<TestState> {
        let state = |shear: f64| {
            let surface = TwistedCylinder { stretch: 1.0, shear }.surface();
            TestState::new(Mode::Torsion, surface, [modulus * shear, 0.0])
        };
        [0.1, 0.2, 0.5].map(state).to_vec()
    }

    /// N m for N mm and the reverse, of a rubber and of a gel.
    #[test]
    fn moduli_of_torques() {
        assert_eq!(check_torques(&states(0.4e6)), Ok(None));
        let (at, allowed) = check_torques(&states(0.4e9)).unwrap_err();
        assert!(at == 2 && allowed.contains("it is 4.000e8 Pa"), "{at} {allowed}");
        let remark = check_torques(&states(400.0)).unwrap().unwrap();
        assert!(remark.contains("of 400 Pa, less than that of a rubber"), "{remark}");
        assert!(check_torques(&states(0.4)).is_err());
        // forces alone
        assert_eq!(check_torques(&states(0.0)), Ok(None));
        let reversed = [states(1e5), states(-1e5)].concat();
        assert_eq!(check_torques(&reversed).unwrap_err().0, 3);
    }
}

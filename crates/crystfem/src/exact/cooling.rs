//! Bodies of uniform temperature: small Biot numbers, and adiabatic bodies.

use super::root;

/// Temperature of a body of uniform temperature under a film, K: T = T_a + (T_i − T_a) e^{−rate·t}, rate =
/// hA/(ρcV), 1/s.
pub fn lumped_film(initial: f64, ambient: f64, rate: f64, time: f64) -> f64 {
    ambient + (initial - ambient) * (-rate * time).exp()
}

/// Temperature of a body of uniform temperature that radiates to surroundings at `ambient`, K: dT/dt = −rate
/// (T⁴ − T_s⁴), rate = εσA/(ρcV), 1/(K³ s). It solves rate·t = F(T) − F(T_i) with F = [ln|(T + T_s)/(T −
/// T_s)| + 2 atan(T/T_s)]/4T_s³, in forms of F that do not cancel, to rounding; towards 0 K, T = (T_i⁻³ + 3
/// rate t)^{−1/3}. Temperatures are absolute; NaN for negative ones.
pub fn lumped_radiation(initial: f64, ambient: f64, rate: f64, time: f64) -> f64 {
    let progress = rate * time;
    if !(initial >= 0.0 && ambient >= 0.0 && progress >= 0.0) {
        return f64::NAN;
    }
    if initial == ambient || progress == 0.0 {
        return initial;
    }
    if progress.is_infinite() {
        return ambient;
    }
    if ambient == 0.0 {
        return (initial.powi(-3) + 3.0 * progress).powf(-1.0 / 3.0);
    }
    // the unknown w = ln|T − T_s| keeps digits near the end; the slope (T⁴ − T_s⁴)/(T − T_s) lies between its
    // values at both ends
    let sign = if initial > ambient { 1.0 } else { -1.0 };
    let start = (initial - ambient).abs().ln();
    let slope = |t: f64| (t + ambient) * (t * t + ambient * ambient);
    let (slow, fast) = (slope(initial.min(ambient)), slope(initial.max(ambient)));
    let reached = primitive(start, ambient, sign);
    let w = root(start - slow * progress, start - fast * progress, |w| {
        progress - (primitive(w, ambient, sign) - reached)
    });
    ambient + sign * w.exp()
}

/// F of [`lumped_radiation`], up to a constant, at T = T_s ± e^w.
fn primitive(w: f64, ambient: f64, sign: f64) -> f64 {
    let temperature = ambient + sign * w.exp();
    let near = ((temperature + ambient).ln() - w) * 0.5;
    let ratio = temperature / ambient;
    if ratio < 1.0 {
        // (artanh s + atan s)/2T_s³, s = T/T_s
        return (near + ratio.atan()) / (2.0 * ambient.powi(3));
    }
    // (artanh p − atan p)/2T_s³, p = T_s/T; by its series T⁻³ (1/3 + p⁴/7 + p⁸/11 + …) if the terms cancel
    let p = ratio.recip();
    if p < 0.3 {
        let p4 = p.powi(4);
        let sum = (0..9).rev().fold(0.0, |sum, k| sum * p4 + f64::from(4 * k + 3).recip());
        return sum / temperature.powi(3);
    }
    (near - p.atan()) / (2.0 * ambient.powi(3))
}

/// Adiabatic temperature rise of a crystallizing body, K: ΔT = ΔH X∞/c, with `enthalpy` ΔH of the crystal,
/// J/kg, and ultimate `crystallinity` X∞.
pub fn adiabatic_rise(enthalpy: f64, crystallinity: f64, specific_heat: f64) -> f64 {
    enthalpy * crystallinity / specific_heat
}

#[cfg(test)]
mod tests {
    use super::*;

    /// εσA/(ρcV) of the 5 mm cube of `reference/ch4/analytic.py`, ε = 0.9.
    const CUBE: f64 = 0.9 * 5.670374419e-8 * (6.0 / 0.005) / (1010.0 * 2200.0);

    #[test]
    fn figures_of_the_formulation() {
        assert!((lumped_radiation(493.15, 353.15, CUBE, 600.0) - 357.811_561_146).abs() < 1e-9);
        assert!((lumped_radiation(493.15, 0.0, CUBE, 600.0) - 258.417_533_147).abs() < 1e-9);
        // ΔH = 209 J/g, X∞ = 0.25, c = 2200: 23.8 K (erratum 9)
        assert!((adiabatic_rise(209e3, 0.25, 2200.0) - 23.75).abs() < 1e-12);
        assert!(
            (lumped_film(493.15, 353.15, 0.01, 100.0) - (353.15 + 140.0 / std::f64::consts::E)).abs() < 1e-12
        );
    }

    #[test]
    fn radiation_solves_its_equation() {
        // heating and cooling, from 0 K to 1e4 K: dT/dt by central differences
        for (initial, ambient) in [
            (493.15, 353.15),
            (300.0, 500.0),
            (0.0, 400.0),
            (1e4, 1.0),
            (1e4, 100.0),
            (500.0, 140.0),
            (310.0, 309.0),
        ] {
            for progress in [1e-12, 1e-10, 1e-9, 1e-8] {
                let (before, after) = (0.999 * progress, 1.001 * progress);
                let at = |progress| lumped_radiation(initial, ambient, 1.0, progress);
                let slope = (at(after) - at(before)) / (after - before);
                let exact = f64::powi(ambient, 4) - at(progress).powi(4);
                // cancellation in the difference: 1e-13 T over a change of 0.002 of the slope
                let rounding = 1e-13 * at(progress) / (0.002 * progress);
                assert!(
                    (slope - exact).abs() < 1e-5 * exact.abs() + rounding,
                    "{initial} {ambient} {progress}"
                );
            }
        }
    }

    #[test]
    fn limits() {
        assert_eq!(lumped_radiation(493.15, 353.15, CUBE, 0.0), 493.15);
        assert_eq!(lumped_radiation(493.15, 353.15, CUBE, f64::INFINITY), 353.15);
        assert_eq!(lumped_radiation(493.15, 353.15, CUBE, 1e12), 353.15);
        assert_eq!(lumped_radiation(353.15, 353.15, CUBE, 10.0), 353.15);
        // near-zero ambient equals vacuum
        let vacuum = lumped_radiation(493.15, 0.0, CUBE, 600.0);
        for ambient in [1e-300, 1e-10, 1e-3] {
            assert!((lumped_radiation(493.15, ambient, CUBE, 600.0) - vacuum).abs() < 1e-11, "{ambient}");
        }
        assert!(lumped_radiation(-1.0, 353.15, CUBE, 1.0).is_nan());
        assert!(lumped_radiation(493.15, 353.15, CUBE, f64::NAN).is_nan());
    }
}

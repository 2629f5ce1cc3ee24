//! Moving fronts: solutions of Stefan and Neumann.

use super::{erfcx, root};

/// Root λ of the front x = 2λ√(αt) in Stefan's problem, λ e^{λ²} erf λ = Ste/√π, Ste = c (T_m − T_s)/L
/// (Carslaw & Jaeger, 11.2); 0 at Ste = 0, NaN below.
pub fn stefan_root(stefan: f64) -> f64 {
    if stefan.is_nan() || stefan < 0.0 {
        return f64::NAN;
    }
    // e^{λ²} erf λ ≥ 2λ/√π bounds λ; in logarithms nothing overflows
    let sought = (stefan / std::f64::consts::PI.sqrt()).ln();
    let greatest = (0.5 * stefan).sqrt();
    root(0.0, greatest, |root| sought - (root.ln() + root * root + libm::erf(root).ln()))
}

/// A half space of melt that freezes from its cooled surface, with conductivities of solid and melt and a
/// latent heat at one temperature (Neumann's solution, Carslaw & Jaeger, 11.2). Both have the same density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Freezing {
    /// Conductivities of solid and melt, W/(m K).
    pub conductivity: [f64; 2],
    /// Diffusivities of solid and melt, m²/s.
    pub diffusivity: [f64; 2],
    /// Specific heat of the solid, J/(kg K).
    pub specific_heat: f64,
    /// Latent heat, J/kg.
    pub latent_heat: f64,
    /// Temperature of melting T_m, K.
    pub melting: f64,
    /// Initial temperature T_i ≥ T_m, K.
    pub initial: f64,
    /// Temperature of the surface T_s < T_m, K.
    pub surface: f64,
}

impl Freezing {
    /// Root λ of the front x = 2λ√(α_s t), with ν = √(α_s/α_l):
    /// e^{−λ²}/erf λ − (k_l/k_s) ν (T_i − T_m)/(T_m − T_s) e^{−ν²λ²}/erfc(νλ) = λ L √π/(c (T_m − T_s)).
    /// NaN unless T_s < T_m ≤ T_i.
    pub fn root(&self) -> f64 {
        let fall = self.melting - self.surface;
        let ordered = fall > 0.0 && self.initial >= self.melting && self.latent_heat >= 0.0;
        if !ordered {
            return f64::NAN;
        }
        let nu = (self.diffusivity[0] / self.diffusivity[1]).sqrt();
        let melt = self.conductivity[1] / self.conductivity[0] * nu * (self.initial - self.melting) / fall;
        let latent = self.latent_heat * std::f64::consts::PI.sqrt() / (self.specific_heat * fall);
        // all terms over e^{−λ²}/erf λ would overflow; the left side falls from infinity
        root(0.0, 27.0, |root| {
            (-root * root).exp() / libm::erf(root) - melt / erfcx(nu * root) - latent * root
        })
    }

    /// Position of the front, m.
    pub fn front(&self, time: f64) -> f64 {
        2.0 * self.root() * (self.diffusivity[0] * time).sqrt()
    }

    /// Returns T at a depth, K; the initial temperature at t = 0 below the surface.
    pub fn temperature(&self, depth: f64, time: f64) -> f64 {
        let root = self.root();
        let nu = (self.diffusivity[0] / self.diffusivity[1]).sqrt();
        if depth == 0.0 {
            return self.surface;
        }
        let solid = depth / (2.0 * (self.diffusivity[0] * time).sqrt());
        if solid <= root {
            return self.surface + (self.melting - self.surface) * libm::erf(solid) / libm::erf(root);
        }
        let (here, front) = (nu * solid, nu * root);
        // erfc(here)/erfc(front)
        let share = ((front - here) * (front + here)).exp() * erfcx(here) / erfcx(front);
        self.initial - (self.initial - self.melting) * if here.is_infinite() { 0.0 } else { share }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PA12: Freezing = Freezing {
        conductivity: [0.25; 2],
        diffusivity: [0.25 / (1010.0 * 2200.0); 2],
        specific_heat: 2200.0,
        latent_heat: 52.25e3,
        melting: 450.0,
        initial: 493.15,
        surface: 353.15,
    };

    #[test]
    fn figures_of_the_formulation() {
        for (stefan, exact) in [(0.5, 0.464_785_920_646), (1.0, 0.620_062_633_314), (2.0, 0.800_601_362_806)]
        {
            assert!((stefan_root(stefan) - exact).abs() < 1e-12);
        }
        assert!((PA12.root() - 0.628_718_116_285).abs() < 1e-12);
        assert!((PA12.front(20.0) - 1.886_249e-3).abs() < 5e-10);
        // two sets of properties: scipy's brentq on the same equation
        let other = Freezing {
            conductivity: [0.3, 0.2],
            diffusivity: [1.3e-7, 0.9e-7],
            specific_heat: 2000.0,
            latent_heat: 100e3,
            ..PA12
        };
        assert!((other.root() - 0.581_528_263_747_162).abs() < 1e-14);
    }

    #[test]
    fn the_front_is_balanced() {
        // ρ L dX/dt = k_s ∂T/∂x|solid − k_l ∂T/∂x|melt, by one-sided differences of second order
        let (time, density) = (20.0, 1010.0);
        let front = PA12.front(time);
        let at = |x| PA12.temperature(x, time);
        let step = 1e-7;
        let slope = |h: f64| (-3.0 * at(front) + 4.0 * at(front + h) - at(front + 2.0 * h)) / (2.0 * h);
        let rate = 0.5 * front / time;
        let balance = density * 52.25e3 * rate - 0.25 * (slope(-step) - slope(step));
        assert!(balance.abs() < 1e-5 * density * 52.25e3 * rate, "{balance}");
        assert!((at(front) - 450.0).abs() < 1e-9);
    }

    #[test]
    fn limits() {
        // λ → √(Ste/2) for small Ste (next term −λ³/3·…), λ² ≈ ln(Ste/√π) − ln λ for large
        assert!((stefan_root(1e-12) / 0.5e-12f64.sqrt() - 1.0).abs() < 1e-11);
        let large = stefan_root(1e300);
        assert!((large.ln() + large * large - (1e300f64 / std::f64::consts::PI.sqrt()).ln()).abs() < 1e-10);
        assert_eq!(stefan_root(0.0), 0.0);
        assert!(stefan_root(-1.0).is_nan() && stefan_root(f64::NAN).is_nan());
        // without superheat it is Stefan's problem
        let saturated = Freezing { initial: 450.0, ..PA12 };
        let stefan = 2200.0 * (450.0 - 353.15) / 52.25e3;
        assert!((saturated.root() - stefan_root(stefan)).abs() < 1e-14);
        assert!(Freezing { initial: 400.0, ..PA12 }.root().is_nan());
        assert_eq!(PA12.temperature(1e-3, 0.0), 493.15);
        assert_eq!(PA12.temperature(0.0, 0.0), 353.15);
    }
}

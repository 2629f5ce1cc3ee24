//! Half spaces: with a held surface, with a film, two in contact.

use super::erfcx;

/// A half space of one initial temperature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    /// Conductivity k, W/(m K).
    pub conductivity: f64,
    /// Diffusivity α = k/(ρ c), m²/s.
    pub diffusivity: f64,
    /// Initial temperature T_i, K.
    pub initial: f64,
}

impl HalfSpace {
    /// Effusivity e = √(k ρ c) = k/√α, J/(m² K √s).
    pub fn effusivity(&self) -> f64 {
        self.conductivity / self.diffusivity.sqrt()
    }

    /// Returns T, K, with the surface held at `surface` from t = 0: T_s + (T_i − T_s) erf(x/2√(αt)) (Carslaw
    /// & Jaeger, 2.4). At t = 0 it is `surface` at depth 0 and the initial temperature elsewhere.
    pub fn with_held_surface(&self, surface: f64, depth: f64, time: f64) -> f64 {
        surface + (self.initial - surface) * libm::erf(self.similarity(depth, time))
    }

    /// Heat flux out through the held surface, q = k (T_i − T_s)/√(παt), W/m²; infinite at t = 0.
    pub fn flux_with_held_surface(&self, surface: f64, time: f64) -> f64 {
        self.conductivity * (self.initial - surface) / (std::f64::consts::PI * self.diffusivity * time).sqrt()
    }

    /// Returns T, K, under a film of coefficient `film`, W/(m² K), to `ambient`, K (Carslaw & Jaeger, 2.7):
    /// (T − T_i)/(T_a − T_i) = erfc η − e^{hx/k + h²αt/k²} erfc(η + h√(αt)/k), η = x/2√(αt).
    /// The product is computed as e^{−η²} erfcx(η + h√(αt)/k), which neither overflows nor cancels for any h
    /// from 0 to infinity.
    pub fn with_film(&self, film: f64, ambient: f64, depth: f64, time: f64) -> f64 {
        if film.is_infinite() {
            return self.with_held_surface(ambient, depth, time);
        }
        self.initial
            + (ambient - self.initial)
                * film_share(
                    self.similarity(depth, time),
                    film * (self.diffusivity * time).sqrt() / self.conductivity,
                )
    }

    /// η = x/2√(αt); 0 at the surface at all times.
    fn similarity(&self, depth: f64, time: f64) -> f64 {
        if depth == 0.0 { 0.0 } else { depth / (2.0 * (self.diffusivity * time).sqrt()) }
    }
}

/// θ = erfc η − e^{−η²} erfcx(η + β) with β = h√(αt)/k: 0 at the initial, 1 at the ambient temperature.
pub(super) fn film_share(similarity: f64, film: f64) -> f64 {
    if similarity.is_infinite() || film == 0.0 {
        return 0.0;
    }
    (-similarity * similarity).exp() * (erfcx(similarity) - erfcx(similarity + film))
}

/// Two half spaces in perfect contact from t = 0: a layer just printed on glass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpaceContact {
    /// Body at x < 0.
    pub lower: HalfSpace,
    /// Body at x > 0.
    pub upper: HalfSpace,
}

impl HalfSpaceContact {
    /// Contact temperature, constant in time: (e₁T₁ + e₂T₂)/(e₁ + e₂), K (Carslaw & Jaeger, 2.15).
    pub fn temperature_of_contact(&self) -> f64 {
        let [lower, upper] = [self.lower, self.upper].map(|body| body.effusivity());
        (lower * self.lower.initial + upper * self.upper.initial) / (lower + upper)
    }

    /// Returns T at `place` (m, negative in the lower body), K: each body has its surface held at the contact
    /// temperature.
    pub fn temperature(&self, place: f64, time: f64) -> f64 {
        let body = if place < 0.0 { self.lower } else { self.upper };
        body.with_held_surface(self.temperature_of_contact(), place.abs(), time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// PA12 of `reference/ch4/analytic.py`.
    const PA12: HalfSpace = HalfSpace { conductivity: 0.25, diffusivity: 1.125_112_511e-7, initial: 493.15 };

    // formulation.md, "Verification problems": x = 2 mm, t = 20 s, surface and ambient 353.15 K; its nine
    // decimals follow from α given with ten digits
    #[test]
    fn figures_of_the_formulation() {
        assert!((PA12.with_held_surface(353.15, 2e-3, 20.0) - 444.737_621_471).abs() < 5e-8);
        assert!((PA12.with_film(50.0, 353.15, 2e-3, 20.0) - 483.955_142_637).abs() < 5e-8);
        assert!((PA12.flux_with_held_surface(353.15, 20.0) - 13_163.765_378).abs() < 1e-5);
        let glass = HalfSpace { conductivity: 1.0, diffusivity: 1.0 / (2500.0 * 800.0), initial: 353.15 };
        let contact = HalfSpaceContact { lower: glass, upper: PA12 };
        assert!((contact.temperature_of_contact() - 401.468_157_592).abs() < 1e-8);
        // continuous in temperature and in flux
        let [below, above] = [contact.temperature(-1e-9, 20.0), contact.temperature(1e-9, 20.0)];
        let contact_temperature = contact.temperature_of_contact();
        assert!((below - contact_temperature).abs() < 1e-4 && (above - contact_temperature).abs() < 1e-4);
        let [out, into] = [PA12, glass].map(|body| body.flux_with_held_surface(contact_temperature, 20.0));
        assert!((out + into).abs() < 1e-10 * out);
    }

    #[test]
    fn limits() {
        assert_eq!(PA12.with_held_surface(353.15, 0.0, 0.0), 353.15);
        assert_eq!(PA12.with_held_surface(353.15, 1e-3, 0.0), 493.15);
        assert_eq!(PA12.with_film(50.0, 353.15, 0.0, 0.0), 493.15);
        assert_eq!(PA12.with_film(50.0, 353.15, 1e-3, 0.0), 493.15);
        assert_eq!(PA12.with_film(0.0, 353.15, 1e-3, 10.0), 493.15);
        assert_eq!(PA12.with_film(f64::INFINITY, 353.15, 0.0, 0.0), 353.15);
        // an infinite film holds the surface
        for film in [1e12, f64::INFINITY] {
            let held = PA12.with_held_surface(353.15, 2e-3, 20.0);
            assert!((PA12.with_film(film, 353.15, 2e-3, 20.0) - held).abs() < 1e-6);
        }
        // long after, everything is at ambient temperature; e^{h²αt/k²} alone would overflow
        assert!((PA12.with_film(50.0, 353.15, 2e-3, 1e12) - 353.15).abs() < 1e-1);
        assert!(PA12.with_film(50.0, 353.15, 2e-3, -1.0).is_nan());
    }

    #[test]
    fn the_film_solution_satisfies_its_surface_condition() {
        // −k ∂T/∂x = h (T_a − T) at the surface, by a one-sided difference of second order
        let at = |x| PA12.with_film(50.0, 353.15, x, 20.0);
        let step = 1e-6;
        let slope = (-3.0 * at(0.0) + 4.0 * at(step) - at(2.0 * step)) / (2.0 * step);
        assert!((-0.25 * slope / (50.0 * (353.15 - at(0.0))) - 1.0).abs() < 1e-5);
    }
}

//! Energies of the springs of branches.

use crate::constitutive::hyperelastic::{EightChain, Hyperelastic, LopezPamies, NeoHookean};

/// Isochoric energy W(I₁) of the spring of a branch, I₁ = Σ exp 2eᵢ of its principal log strains eᵢ.
#[derive(Debug, Clone, PartialEq)]
pub enum Spring {
    /// W = ν(I₁ − 3)/2.
    NeoHookean(NeoHookean),
    /// Sum of powers of I₁.
    LopezPamies(LopezPamies),
    /// Eight-chain law, with locking.
    EightChain(EightChain),
}

impl Spring {
    fn law(&self) -> &dyn Hyperelastic {
        match self {
            Self::NeoHookean(law) => law,
            Self::LopezPamies(law) => law,
            Self::EightChain(law) => law,
        }
    }

    /// Shear modulus at rest, ν = 2W′(3), Pa.
    pub fn shear_modulus(&self) -> f64 {
        self.law().shear_modulus()
    }

    /// W at principal log strains, J/m³; infinite beyond locking.
    pub fn energy(&self, strains: [f64; 3]) -> f64 {
        match self {
            Self::NeoHookean(law) => 0.5 * law.shear_modulus() * excess(strains),
            Self::LopezPamies(law) => law.energy_above(excess(strains)),
            Self::EightChain(law) => law.energy_at(strains.map(f64::exp)).unwrap_or(f64::INFINITY),
        }
    }

    /// 2W′ and 2W″ (derivatives by I₁) at principal log strains, Pa; infinite beyond locking.
    pub fn slopes(&self, strains: [f64; 3]) -> [f64; 2] {
        match self {
            Self::NeoHookean(law) => [law.shear_modulus(), 0.0],
            Self::LopezPamies(law) => law.slopes(excess(strains)).map(|slope| 2.0 * slope),
            Self::EightChain(law) => match law.response_at(strains.map(f64::exp)) {
                Ok(response) => [response.stress[0], 0.5 * response.normal[0][0]],
                Err(_) => [f64::INFINITY; 2],
            },
        }
    }

    /// W, J/m³, and τ = 2W′ dev exp 2e, Pa.
    pub(super) fn energy_and_stress(&self, strains: [f64; 3]) -> (f64, [f64; 3]) {
        let squares = squares_above_one(strains);
        let (energy, slope) = match self {
            Self::NeoHookean(law) => (0.5 * law.shear_modulus() * sum(squares), law.shear_modulus()),
            _ => (self.energy(strains), self.slopes(strains)[0]),
        };
        let [a, b, c] = without_mean(squares);
        (energy, [slope * a, slope * b, slope * c])
    }

    /// τ, and dτ/de on Σe = 0, Pa.
    pub(super) fn response(&self, strains: [f64; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
        let [slope, second] = self.slopes(strains);
        let deviator = deviator(strains);
        let tau = deviator.map(|b| slope * b);
        // of 2W′ (xᵢ − x̄): 2xᵢ δᵢⱼ − ⅔xⱼ, and by I₁; then without the mean of each row
        let squares = strains.map(|e| (2.0 * e).exp());
        let derivative: [[f64; 3]; 3] = std::array::from_fn(|i| {
            let row: [f64; 3] = std::array::from_fn(|j| {
                let own = if i == j { 2.0 * squares[j] } else { 0.0 };
                slope * (own - 2.0 / 3.0 * squares[j]) + second * deviator[i] * 2.0 * squares[j]
            });
            let mean = row.iter().sum::<f64>() / 3.0;
            row.map(|entry| entry - mean)
        });
        (tau, derivative)
    }

    /// Least slope of τ(e) over all directions and |eᵢ| ≤ `reach`, Pa: positive where a step has one
    /// solution and the branch does not soften elastically.
    pub fn least_slope(&self, reach: f64) -> f64 {
        let mut least = f64::INFINITY;
        for direction in 0..24 {
            let angle = std::f64::consts::PI / 12.0 * f64::from(direction);
            let axes = [0.0, 2.0, 4.0].map(|k| (angle - k * std::f64::consts::FRAC_PI_3).cos());
            let longest = axes.iter().fold(0.0_f64, |most, a| most.max(a.abs()));
            for part in 0..=40 {
                let size = reach * f64::from(part) / 40.0 / longest;
                let (_, derivative) = self.response(axes.map(|a| size * a));
                let [[a, b], [c, d]] = super::flow::plane(&derivative);
                let (mean, off) = (0.5 * (a + d), 0.5 * (b + c));
                least = least.min(mean - (0.5 * (a - d)).hypot(off));
            }
        }
        least
    }
}

/// I₁ − 3 of principal log strains, without cancellation.
fn excess(strains: [f64; 3]) -> f64 {
    sum(squares_above_one(strains))
}

/// I₁ − 3 of exp 2eᵢ − 1.
fn sum(squares: [f64; 3]) -> f64 {
    squares.iter().sum::<f64>().max(0.0)
}

/// exp 2eᵢ − 1.
pub(super) fn squares_above_one(strains: [f64; 3]) -> [f64; 3] {
    let [a, b, c] = strains;
    [(2.0 * a).exp_m1(), (2.0 * b).exp_m1(), (2.0 * c).exp_m1()]
}

/// exp 2eᵢ minus the mean.
pub(super) fn deviator(strains: [f64; 3]) -> [f64; 3] {
    without_mean(squares_above_one(strains))
}

/// Values minus their mean.
fn without_mean(values: [f64; 3]) -> [f64; 3] {
    let [a, b, c] = values;
    let mean = values.iter().sum::<f64>() / 3.0;
    [a - mean, b - mean, c - mean]
}

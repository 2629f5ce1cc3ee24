//! A branch of a solidifying Maxwell body over a step, in closed form, with its energies.

/// Input of a branch over a step: s is the fraction of the network that exists (1 for the amorphous phase), b
/// its softening.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BranchInput {
    /// Reduced time over relaxation time, y = Δξ/τ ≥ 0; 0 if elastic.
    pub relaxation: f64,
    /// s at the start and the end, 0 to 1.
    pub share: [f64; 2],
    /// b at the start and the end.
    pub softening: [f64; 2],
}

/// Step of a branch of modulus 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BranchStep {
    /// e₂ = `carried` e₁ + `gained` Δε for the elastic strain e and the mechanical strain increment Δε.
    pub carried: f64,
    /// See [`Self::carried`].
    pub gained: f64,
    /// b₂ s₂, or its mean over a growing network: the stiffness of the step is this times h = (1 − e^{−y})/y,
    /// and the stress at the end b₂ s₂ e₂.
    pub stiffness: f64,
    change: BranchInput,
    forms: Forms,
}

/// Energies of a step over the modulus, with e:Ĉ:e for squares.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct BranchEnergies {
    /// Work of the branch's stress on Δε.
    pub work: f64,
    /// Increase of the stored energy.
    pub stored: f64,
    /// Dissipation by relaxation, ≥ 0.
    pub viscous: f64,
    /// Loss by growth of new crystals without stress, ≥ 0.
    pub growth: f64,
    /// Loss with melting crystals, ≥ 0.
    pub melting: f64,
    /// Change of the stored energy due to softening alone.
    pub softening: f64,
}

impl BranchEnergies {
    /// Balance work + softening − stored − viscous − growth − melting: 0 to rounding.
    pub fn closure(&self) -> f64 {
        self.work + self.softening - self.stored - self.viscous - self.growth - self.melting
    }

    /// Sum of all magnitudes.
    pub fn size(&self) -> f64 {
        let Self { work, stored, viscous, growth, melting, softening } = *self;
        [work, stored, viscous, growth, melting, softening].map(f64::abs).iter().sum()
    }

    /// Energy lost by relaxation, growth and melting, ≥ 0.
    pub fn lost(&self) -> f64 {
        self.viscous + self.growth + self.melting
    }

    /// Adds a multiple of other energies.
    pub fn add(&mut self, other: &Self, factor: f64) {
        self.work += factor * other.work;
        self.stored += factor * other.stored;
        self.viscous += factor * other.viscous;
        self.growth += factor * other.growth;
        self.melting += factor * other.melting;
        self.softening += factor * other.softening;
    }
}

/// Coefficients h, g of the work h e·Δε + g Δε² and A, B, C of the loss A e² + 2B e·Δε + C Δε².
#[derive(Clone, Copy, Debug, PartialEq)]
struct Forms {
    h: f64,
    g: f64,
    loss: [f64; 3],
}

impl Forms {
    fn new(y: f64) -> Self {
        let p = -(-y).exp_m1();
        let h = if y > 0.0 { p / y } else { 1.0 };
        let (a, b) = (-0.5 * (-2.0 * y).exp_m1(), 0.5 * p * h);
        // closed forms cancel at small y: g = (1 − h)/y = Σ (−y)^k/(k + 2)!, C = Σ (−1)^{m+1} (2^{m−1} − 2)
        // y^{m−2}/m!
        let (g, c) = if y < 0.5 {
            let (mut g, mut c, mut power, mut factorial) = (0.0, 0.0, 1.0, 2.0);
            for m in 2..22_i32 {
                // power = (−y)^{m−2}, factorial = m!
                g += power / factorial;
                c -= (2.0_f64.powi(m - 1) - 2.0) * power / factorial;
                power *= -y;
                factorial *= f64::from(m + 1);
            }
            (g, c)
        } else {
            ((1.0 - h) / y, (y - 2.0 * p + a) / (y * y))
        };
        Self { h, g, loss: [a, b, c] }
    }
}

impl BranchStep {
    /// Computes the step: growth e ← (s₁ e^{−y} e + s̄ h Δε)/s₂, melting e ← e^{−y} e + h Δε, s̄ = ½(s₁ +
    /// s₂). New crystals are born without stress (Bažant's solidification); melting ones lose theirs. Linear
    /// in Δε, unconditionally stable.
    pub fn new(change: BranchInput) -> Self {
        let BranchInput { relaxation, share: [before, after], softening } = change;
        let forms = Forms::new(relaxation);
        let (decay, mean) = ((-relaxation).exp(), 0.5 * (before + after));
        let (carried, gained) = if after < before {
            (decay, forms.h)
        } else if after > 0.0 {
            (before * decay / after, mean * forms.h / after)
        } else {
            (0.0, 0.0)
        };
        let share = if after < before { after } else { mean };
        Self { carried, gained, stiffness: softening[1] * share * forms.h, change, forms }
    }

    /// Returns the step with another relaxation y.
    pub fn with_relaxation(&self, relaxation: f64) -> Self {
        Self::new(BranchInput { relaxation, ..self.change })
    }

    /// Input of the step.
    pub fn input(&self) -> &BranchInput {
        &self.change
    }

    /// Elastic strain after the first half of growth or melting, over that before.
    fn first_half(&self) -> f64 {
        let [before, after] = self.change.share;
        match after >= before {
            true if 0.5 * (before + after) > 0.0 => before / (0.5 * (before + after)),
            true => 0.0,
            false => 1.0,
        }
    }

    /// Coefficients of e and Δε in the elastic strain after relaxation at s̄, before the last half of growth,
    /// and their derivatives by ln y.
    pub fn relaxed(&self) -> [[f64; 2]; 2] {
        let (relaxation, first) = (self.change.relaxation, self.first_half());
        let decay = (-relaxation).exp();
        [[first * decay, self.forms.h], [-relaxation * first * decay, decay - self.forms.h]]
    }

    /// Computes the energies from e:Ĉ:e, e:Ĉ:Δε and Δε:Ĉ:Δε with the initial elastic strain e: growth or
    /// melting to s̄, relaxation there, and the rest of growth or melting (Strang splitting).
    pub fn energies(&self, ee: f64, ed: f64, dd: f64) -> BranchEnergies {
        let BranchInput { share: [before, after], softening: [soft, hard], .. } = self.change;
        let (mean, growing) = (0.5 * (before + after), after >= before);
        let [a, b, c] = self.forms.loss;
        let first = self.first_half();
        let (fee, fed) = (first * first * ee, first * ed);
        let decay = (-self.change.relaxation).exp();
        let after_relaxation =
            decay * decay * fee + 2.0 * decay * self.forms.h * fed + self.forms.h.powi(2) * dd;
        let last = self.carried * self.carried * ee
            + 2.0 * self.carried * self.gained * ed
            + self.gained * self.gained * dd;
        let (growth, melting) = if growing {
            (0.5 * hard * (before * ee - mean * fee + mean * after_relaxation - after * last), 0.0)
        } else {
            (0.0, 0.5 * hard * ((before - mean) * ee + (mean - after) * after_relaxation))
        };
        BranchEnergies {
            work: hard * mean * (self.forms.h * fed + self.forms.g * dd),
            stored: 0.5 * hard * after * last - 0.5 * soft * before * ee,
            viscous: hard * mean * (a * fee + 2.0 * b * fed + c * dd),
            growth,
            melting,
            softening: 0.5 * (hard - soft) * before * ee,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use evidence::{at_most, near};
    use polycore::random::SplitMix64;

    fn step(relaxation: f64, share: [f64; 2]) -> BranchStep {
        BranchStep::new(BranchInput { relaxation, share, softening: [1.0; 2] })
    }

    /// Energies close and losses are not negative in 20,000 random steps, as in
    /// `docs/reference/print/branch.py`.
    #[test]
    fn energies_close_over_any_history() {
        let mut random = SplitMix64::new(1);
        let (mut strain, mut share, mut softening) = (0.0, 0.3, 1.0);
        let (mut worst, mut least) = (0.0_f64, 0.0_f64);
        for _ in 0..20_000 {
            let mut next = random.uniform();
            if random.uniform() < 0.05 {
                next = 0.0;
            }
            let soft = 0.2 + 0.8 * random.uniform();
            let relaxation = 10.0_f64.powf(8.0 * random.uniform() - 6.0);
            let increment = 1e-2 * random.normal();
            let step = BranchStep::new(BranchInput {
                relaxation,
                share: [share, next],
                softening: [softening, soft],
            });
            let found = step.energies(strain * strain, strain * increment, increment * increment);
            worst = worst.max(found.closure().abs() / 1e-4);
            least = least.min(found.viscous).min(found.growth).min(found.melting);
            strain = step.carried * strain + step.gained * increment;
            (share, softening) = (next, soft);
        }
        at_most("print_energy_closure", worst, 1e-14);
        at_most("print_negative_loss", -least / 1e-4, 1e-15);
    }

    /// Step of one branch: e = 1e-3, Δε = 2e-3, y = 0.5.
    #[test]
    fn one_step_of_a_branch() {
        let step = step(0.5, [1.0; 2]);
        let (e, d) = (1e-3, 2e-3);
        near("print_branch_strain", step.carried * e + step.gained * d, 2.180_408_021e-3, 1e-12);
        let found = step.energies(e * e, e * d, d * d);
        near("print_branch_work", found.work, 3.278_367_917e-6, 1e-15);
        near("print_branch_viscous", found.viscous, 1.401_278_348e-6, 1e-15);
        near("print_branch_stored", found.stored, 1.877_089_569e-6, 1e-15);
        // series and closed forms meet
        let (below, above) = (Forms::new(0.5 - 1e-12), Forms::new(0.5));
        assert!((below.g - above.g).abs() < 1e-11 && (below.loss[2] - above.loss[2]).abs() < 1e-11);
    }

    /// Melting crystals lose their stress and new ones carry none: 1 GPa at a strain of 1e-3, s 1 → ½ → 1 and
    /// 1 → 0 → 1.
    #[test]
    fn cycles_of_melting() {
        let after = |shares: &[f64]| {
            let strain = shares.windows(2).fold(1e-3, |e, pair| step(0.0, [pair[0], pair[1]]).carried * e);
            1e9 * shares.last().unwrap() * strain
        };
        assert_eq!(after(&[1.0, 0.5]), 0.5e6);
        assert_eq!(after(&[1.0, 0.5, 1.0]), 0.5e6);
        assert_eq!(after(&[1.0, 0.0, 1.0]), 0.0);
    }
}

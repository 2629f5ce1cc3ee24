//! Solidifying Maxwell body: permanent amorphous branches, and a network of crystals.

use super::branch::{BranchEnergies, BranchInput, BranchStep};
use super::eigenstrain::SpecificVolume;
use super::phase::{Branch, Phase};
use polycore::constitutive::viscoelastic::Shift;

/// Stiffness over the sum of all moduli below which material flows instead of bearing stress.
const MELT_STIFFNESS: f64 = 0.01;

/// Solidifying Maxwell body, σ = Ĉ(ν):[Σ_A E_i e_i + b(T) s(α) Σ_N E_i e_i], with the elastic strain e_i of
/// each branch, the stiffness Ĉ of modulus 1, one Poisson's ratio and s = α. New crystals are born without
/// stress and melting ones lose theirs: no stress-free temperature is needed. Shear may flow by Eyring's law.
#[derive(Clone, Debug, PartialEq)]
pub struct SolidifyingMaxwell {
    /// Free strain.
    pub volume: SpecificVolume,
    /// Amorphous phase.
    pub amorphous: Phase,
    /// Crystal network.
    pub network: Phase,
    /// Temperatures, K, between which b(T) falls linearly from 1 to 0; `None` for b = 1.
    pub softening: Option<[f64; 2]>,
    /// Poisson's ratio ν.
    pub poisson: f64,
    /// Modulus of the melt over the sum of all others: acts on Δε − Δε* within a step and is then forgotten.
    pub floor: f64,
    /// Tensile strength, Pa: a value to compare with, unlike the flow of [`Phase::flow`].
    pub strength: f64,
}

/// Response of a material point over a step, linear in the strain increment.
#[derive(Clone, Debug, PartialEq)]
pub struct MaxwellIncrement {
    /// Linear free strain Δε*.
    pub free_strain: f64,
    /// Stiffness of the step over Ĉ, Pa, floor included: Δσ = stiffness Ĉ:(Δε − Δε* 1) plus relaxation.
    pub stiffness: f64,
    /// Contribution of the floor, whose stress is not kept, Pa.
    pub floor: f64,
    /// True for a stiffness below 1 % of the sum of all moduli.
    pub melt: bool,
    /// Branches of both phases.
    pub(super) branches: Vec<BranchIncrement>,
}

/// Branch of an increment.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct BranchIncrement {
    /// Step without flow.
    pub step: BranchStep,
    /// Modulus, Pa.
    pub modulus: f64,
    /// Modulus times b₂ s₂ at the end, Pa.
    pub kept: f64,
    /// τ₀ of Eyring flow, Pa.
    pub flow: Option<f64>,
}

impl SolidifyingMaxwell {
    /// PA12: moduli with a sum at 23 °C as in sheets of PA 2200 (EOS), with assumed spectrum and times; T_g
    /// of chapter 4. Placeholders until measured.
    pub fn pa12() -> Self {
        let third = |time: f64| Branch { modulus: 300e6, time };
        let network = [(420e6, f64::INFINITY), (140e6, 10.0), (140e6, 1000.0)];
        Self {
            volume: SpecificVolume::PA12,
            amorphous: Phase::new(
                [1.0, 10.0, 100.0].map(third).to_vec(),
                Shift::Wlf { reference: 324.0, constants: [17.44, 51.6] },
            ),
            network: Phase::new(
                network.map(|(modulus, time)| Branch { modulus, time }).to_vec(),
                Shift::Arrhenius { reference: 433.15, energy: 150e3 },
            ),
            softening: Some([296.15, 451.0]),
            poisson: 0.4,
            floor: 1e-4,
            strength: 48e6,
        }
    }

    /// Returns an elastic body of modulus E, Pa, ν, linear thermal expansion, 1/K, and strength, Pa: one
    /// branch without relaxation.
    pub fn elastic(modulus: f64, poisson: f64, expansion: f64, strength: f64) -> Self {
        // two phases of equal density and expansion: ln v is linear in T
        let volume = SpecificVolume {
            densities: [1.0; 2],
            glass_transition: 0.0,
            reference: 0.0,
            expansions: [3.0 * expansion; 3],
            crystallinity: 0.0,
        };
        Self {
            volume,
            amorphous: Phase::new(vec![Branch { modulus, time: f64::INFINITY }], Shift::None),
            network: Phase::default(),
            softening: None,
            poisson,
            floor: 0.0,
            strength,
        }
    }

    /// Changes the crystallinity X∞ at α = 1: its fraction in the volume, and the network in proportion;
    /// without crystals there is no network.
    pub fn with_crystallinity(mut self, crystallinity: f64) -> Self {
        let factor = crystallinity / self.volume.crystallinity;
        self.network.branches.iter_mut().for_each(|branch| branch.modulus *= factor);
        self.network.branches.retain(|branch| branch.modulus > 0.0);
        self.volume.crystallinity = crystallinity;
        self
    }

    /// Number of branches of both phases, and of elastic strains of a point, all 0 at birth.
    pub fn branches(&self) -> usize {
        self.amorphous.branches.len() + self.network.branches.len()
    }

    /// Softening b(T).
    pub fn softness(&self, temperature: f64) -> f64 {
        self.softening.map_or(1.0, |[hard, soft]| ((soft - temperature) / (soft - hard)).max(0.0))
    }

    /// Increment from one (T, α) to another in a time, s; 0 is elastic.
    pub fn increment(&self, from: [f64; 2], to: [f64; 2], duration: f64) -> MaxwellIncrement {
        let temperatures = [from[0], to[0]];
        let mut branches = Vec::with_capacity(self.branches());
        let (mut stiffness, mut whole) = (0.0, 0.0);
        let mut add = |phase: &Phase, share: [f64; 2], softening: [f64; 2]| {
            let reduced = phase.reduced_time(temperatures, [from[1], to[1]], duration);
            let flow = phase.flow.map(|flow| flow.stress_at(to[0]));
            for branch in &phase.branches {
                let step =
                    BranchStep::new(BranchInput { relaxation: reduced / branch.time, share, softening });
                stiffness += branch.modulus * step.stiffness;
                whole += branch.modulus;
                let kept = branch.modulus * softening[1] * share[1];
                let flow = flow.filter(|_| branch.time.is_finite());
                branches.push(BranchIncrement { step, modulus: branch.modulus, kept, flow });
            }
        };
        add(&self.amorphous, [1.0; 2], [1.0; 2]);
        add(&self.network, [from[1], to[1]], temperatures.map(|t| self.softness(t)));
        let free_strain = self.volume.strain(from, to);
        let floor = self.floor * whole;
        let melt = stiffness < MELT_STIFFNESS * whole;
        MaxwellIncrement { free_strain, stiffness: stiffness + floor, floor, melt, branches }
    }

    /// Stress over Ĉ after a hold, Σ E_i e_i, Pa, per strain, for example of a component under uniaxial
    /// stress.
    pub fn relaxation_modulus(&self, temperature: f64, degree: f64, time: f64) -> f64 {
        let sum = |phase: &Phase| -> f64 {
            let reduced = phase.reduced_time([temperature; 2], [degree; 2], time);
            phase.branches.iter().map(|branch| branch.modulus * (-reduced / branch.time).exp()).sum()
        };
        sum(&self.amorphous) + self.softness(temperature) * degree * sum(&self.network)
    }
}

impl MaxwellIncrement {
    /// Updates the elastic strains, of any components, from Δε of the same; `mechanical` is Δε − Δε* for a
    /// component with a free strain.
    pub fn advance<const N: usize>(&self, strains: &mut [[f64; N]], mechanical: &[f64; N]) {
        for (BranchIncrement { step, .. }, strain) in self.branches.iter().zip(strains) {
            for (e, d) in strain.iter_mut().zip(mechanical) {
                *e = step.carried * *e + step.gained * d;
            }
        }
    }

    /// Σ E b₂ s₂ e over the branches, Pa: the stress over Ĉ, from elastic strains at the end of the step.
    pub fn stress<const N: usize>(&self, strains: &[[f64; N]]) -> [f64; N] {
        let mut sum = [0.0; N];
        for (BranchIncrement { kept, .. }, strain) in self.branches.iter().zip(strains) {
            sum.iter_mut().zip(strain).for_each(|(sum, e)| *sum += kept * e);
        }
        sum
    }

    /// Energies of all branches, J/m³, with the product a:Ĉ:b; call before [`Self::advance`].
    pub fn energies<const N: usize>(
        &self,
        strains: &[[f64; N]],
        mechanical: &[f64; N],
        product: impl Fn(&[f64; N], &[f64; N]) -> f64,
    ) -> BranchEnergies {
        let mut sum = BranchEnergies::default();
        for (BranchIncrement { step, modulus, .. }, strain) in self.branches.iter().zip(strains) {
            let one = step.energies(
                product(strain, strain),
                product(strain, mechanical),
                product(mechanical, mechanical),
            );
            sum.add(&one, *modulus);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact::Wall;
    use crate::kinetics::{KineticConstants, Kinetics};
    use evidence::near;

    /// Returns α 1e-4/K, E∞ 0.4 and E₁ 0.6 GPa, τ 30 s. Without crystals the amorphous phase of one density
    /// is linear in T.
    fn held_bar(shift: Shift) -> SolidifyingMaxwell {
        let branch = |modulus, time| Branch { modulus, time };
        let volume = SpecificVolume {
            densities: [1000.0; 2],
            glass_transition: 0.0,
            reference: 0.0,
            expansions: [3e-4; 3],
            crystallinity: 0.0,
        };
        SolidifyingMaxwell {
            volume,
            amorphous: Phase::new(vec![branch(0.4e9, f64::INFINITY), branch(0.6e9, 30.0)], shift),
            network: Phase::default(),
            softening: None,
            poisson: 0.3,
            floor: 0.0,
            strength: f64::INFINITY,
        }
    }

    /// Returns the stress of a bar of fixed length after a history of (T, α, duration) from (T, α).
    fn held(body: &SolidifyingMaxwell, start: [f64; 2], legs: &[([f64; 2], f64)]) -> f64 {
        let (mut strains, mut stress, mut at) = (vec![[0.0]; body.branches()], 0.0, start);
        for &(to, duration) in legs {
            let increment = body.increment(at, to, duration);
            increment.advance(&mut strains, &[-increment.free_strain]);
            [stress] = increment.stress(&strains);
            at = to;
        }
        stress
    }

    /// Returns steps of equal size down from 433.15 K.
    fn cooling(step: f64) -> Vec<([f64; 2], f64)> {
        (1..=(100.0 / step).round() as usize).map(|k| ([433.15 - step * k as f64, 0.0], step)).collect()
    }

    /// Stress of a bar cooled at fixed length is exact at any step, α q t E∞ plus E₁ α q τ(1 − e^{−t/τ});
    /// then e^{−t/τ} at rest.
    #[test]
    fn a_held_bar_cools() {
        let body = held_bar(Shift::None);
        for step in [100.0, 10.0, 1.0] {
            let mut legs = cooling(step);
            near("print_held_bar", held(&body, [433.15, 0.0], &legs), 5.735_786_812e6, 6.0);
            legs.push(([333.15, 0.0], 100.0));
            near("print_held_bar_at_rest", held(&body, [433.15, 0.0], &legs), 4.061_922_447e6, 5.0);
        }
        let body = held_bar(Shift::Arrhenius { reference: 433.15, energy: 150e3 });
        for (step, error) in [(10.0, -1.43e-3), (5.0, -3.61e-4), (2.5, -9.05e-5)] {
            let found = held(&body, [433.15, 0.0], &cooling(step)) / 9.825_863_382e6 - 1.0;
            near(&format!("print_held_bar_shifted_{step}"), found / error, 1.0, 0.02);
        }
    }

    /// Cube at 160 °C, α 0 → 1, held in one direction, network of 1 GPa: E(1 − ln(1 + c)/c)/3, c = X∞(v_c −
    /// v_a)/v_a.
    #[test]
    fn a_held_cube_crystallizes() {
        let body = SolidifyingMaxwell {
            amorphous: Phase::default(),
            network: Phase::new(vec![Branch { modulus: 1e9, time: f64::INFINITY }], Shift::None),
            softening: None,
            floor: 0.0,
            ..SolidifyingMaxwell::pa12()
        };
        let of = |steps: usize| {
            let legs: Vec<_> = (1..=steps).map(|k| ([433.15, k as f64 / steps as f64], 1.0)).collect();
            held(&body, [433.15, 0.0], &legs)
        };
        near("print_held_cube_20", of(20), 3.650_395_167e6, 3.0);
        let (coarse, fine) = (3.650_428_241e6 - of(20), 3.650_428_241e6 - of(40));
        near("print_held_cube_order", (coarse / fine).log2(), 2.0, 0.02);
    }

    /// E(1 s) of PA12 at 100, 140 and 160 °C and the sum at rest agree with pa12.py.
    #[test]
    fn moduli_of_pa12() {
        let body = SolidifyingMaxwell::pa12();
        for (celsius, modulus) in [(100.0, 352e6), (140.0, 171e6), (160.0, 79e6)] {
            near(
                &format!("print_modulus_{celsius}"),
                body.relaxation_modulus(celsius + 273.15, 1.0, 1.0),
                modulus,
                1e6,
            );
        }
        near("print_modulus_at_rest", body.relaxation_modulus(296.15, 1.0, 0.0), 1600e6, 1.0);
    }

    /// Returns temperatures of the plate over time: at two Gauss points in each of 24 cells, then at its
    /// centre and surface.
    fn cooled(times: impl Iterator<Item = f64>) -> Vec<(f64, Vec<f64>)> {
        let (wall, diffusivity, cells) = (Wall { biot: 1.0 }, 0.25 / 1010.0 / 2200.0, 24);
        let offset = 0.5 / 3.0_f64.sqrt();
        let mut places: Vec<f64> = (0..cells)
            .flat_map(|k| [-offset, offset].map(|at| (f64::from(k) + 0.5 + at) / f64::from(cells)))
            .collect();
        places.extend([0.0, 1.0]);
        let at = |time: f64, place: f64| 298.15 + 195.0 * wall.share(place, diffusivity * time / 4e-6);
        times.map(|time| (time, places.iter().map(|&place| at(time, place)).collect())).collect()
    }

    /// Returns the in-plane stress of a plate of 4 mm of PA12, 220 °C to 25 °C, Bi = 1 on both faces, without
    /// latent heat, after 600 s: at centre and surface, free or held at its edges. σ = Σ E e/(1 − ν) with one
    /// in-plane elastic strain per branch.
    fn plate(body: &SolidifyingMaxwell, held: bool, history: &[(f64, Vec<f64>)]) -> [f64; 2] {
        let kinetics = Kinetics::new(KineticConstants::TABLE_4_1_COLUMN_1).unwrap();
        let count = history[0].1.len();
        let mut temperatures = vec![493.15; count];
        let mut grown = vec![0.0; count];
        let mut strains = vec![vec![[0.0]; body.branches()]; count];
        let mut found = vec![0.0; count];
        let mut time = 0.0;
        for (next, reached) in history {
            let mut increments = Vec::with_capacity(count);
            let (mut load, mut stiffness) = (0.0, 0.0);
            for (k, &temperature) in reached.iter().enumerate() {
                let before = [temperatures[k], kinetics.degree(grown[k])];
                grown[k] += kinetics.growth(temperatures[k], temperature, next - time).z;
                let increment =
                    body.increment(before, [temperature, kinetics.degree(grown[k])], *next - time);
                temperatures[k] = temperature;
                if k < count - 2 {
                    let mut predicted = strains[k].clone();
                    increment.advance(&mut predicted, &[-increment.free_strain]);
                    load += increment.stress(&predicted)[0] - increment.floor * increment.free_strain;
                    stiffness += increment.stiffness;
                }
                increments.push(increment);
            }
            let common = if held { 0.0 } else { -load / stiffness };
            for (k, increment) in increments.iter().enumerate() {
                increment.advance(&mut strains[k], &[common - increment.free_strain]);
                found[k] = increment.stress(&strains[k])[0] / (1.0 - body.poisson);
            }
            time = *next;
        }
        [found[count - 2] / 1e6, found[count - 1] / 1e6]
    }

    /// Elastic wall, Bi = 1, at Fo = 0.5: σ = Eα(mean T − T)/(1 − ν) (Boley and Weiner).
    #[test]
    fn an_elastic_wall_cools() {
        let wall = SolidifyingMaxwell::elastic(1e9, 0.3, 1e-4, f64::INFINITY);
        let unit = 1e-6 * 1e9 * 1e-4 * 195.0 / 0.7;
        let history = cooled(std::iter::once(0.5 * 4e-6 / (0.25 / 1010.0 / 2200.0)));
        let [centre, surface] = plate(&wall, false, &history);
        near("print_wall_surface", surface / unit, 0.176_582_638, 1e-6);
        near("print_wall_centre", centre / unit, -0.091_421_818, 1e-6);
    }

    /// Residual stress agrees with `docs/reference/print/plate.py`, MPa: a network of 1 GPa, and PA12.
    #[test]
    fn a_plate_cools_with_residual_stress() {
        let elastic = SolidifyingMaxwell {
            amorphous: Phase::default(),
            network: Phase::new(vec![Branch { modulus: 1e9, time: f64::INFINITY }], Shift::None),
            softening: None,
            ..SolidifyingMaxwell::pa12()
        };
        // steps that begin fine
        let times = (1..=400).map(|step| 600.0 * (f64::from(step) / 400.0).powi(2));
        let (pa12, history) = (SolidifyingMaxwell::pa12(), cooled(times));
        for (name, body, held, [centre, surface]) in [
            ("elastic", &elastic, false, [7.188_340, -18.060_895]),
            ("elastic_held", &elastic, true, [33.493_515, 32.759_579]),
            ("pa12", &pa12, false, [5.5791, -14.4911]),
            ("pa12_held", &pa12, true, [27.5719, 27.0687]),
        ] {
            let found = plate(body, held, &history);
            near(&format!("print_plate_{name}_centre"), found[0] / centre, 1.0, 2e-3);
            near(&format!("print_plate_{name}_surface"), found[1] / surface, 1.0, 2e-3);
        }
    }
}

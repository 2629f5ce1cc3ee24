//! Laws with time as user materials of finite-element programs: constants in one row, the state of a point in
//! one array.
//!
//! After the constants of the equilibrium law stand the absolute zero of the program's temperatures (0 where
//! they are in kelvin, 273.15 in °C), r, m and β of the softening (0, 0, 0 without), and for each branch
//! three numbers, each followed by constants:
//!
//! - spring: 1 neo-Hooke: ν; 2 Lopez-Pamies: number of terms, ν₁, β₁, …; 3 eight-chain: C_R, N;
//! - viscosity: 1 constant: η; 2 Kumar and Lopez-Pamies: η₀, η_∞, K₁, K₂, γ₁, γ₂; 3 Bergström and Boyce:
//!   γ̇₀, τ̂, m, c, ξ; 4 Eyring: γ̇₀, τ₀, μ_p; 5 Eyring with softening: γ̇₀, τ₀, μ_p, S_a, r₀, r₁, r₂;
//! - shift: 0 none; 1 WLF: T_r in K, c₁, c₂ in K; 2 Arrhenius: T_r in K, H in J/mol.
//!
//! The state of a point is the pressure, W_max of the softening, the energy that the branches have dissipated
//! per undeformed volume, and for each branch C_v (11, 22, 33, 12, 13, 23) and the viscous shear γ. Zeros are
//! a virgin point.

use super::{Branch, BranchState, Mullins, Shift, Spring, State, StrainSoftening, Viscoelastic, Viscosity};
use crate::constitutive::hyperelastic::{EightChain, Hyperelastic, LopezPamies, NeoHookean, deck};
use crate::constitutive::{Error, Law};
use crate::tensor::Voigt;

/// Numbers of a point before those of its branches.
const HEAD: usize = 3;

/// Numbers of a branch: C_v and γ.
const BRANCH: usize = 7;

/// Largest principal log strain up to which a spring must not soften.
const REACH: f64 = 1.0;

/// Number of state variables of a law with so many branches.
pub fn state_count(branches: usize) -> usize {
    HEAD + BRANCH * branches
}

/// State of a point with what a host keeps beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct PointRecord {
    /// State of the law.
    pub state: State,
    /// Pressure at the end of the last increment, in the host's unit of stress.
    pub pressure: f64,
    /// Energy that the branches have dissipated, per undeformed volume.
    pub dissipated: f64,
}

impl PointRecord {
    /// Reads the state variables of a host, at least [`state_count`] of them.
    pub fn read(numbers: &[f64]) -> Self {
        let branch = |own: &[f64]| {
            let viscous = Voigt::from_column_slice(&own[..6]);
            // a host begins with zeros
            if viscous == Voigt::zeros() { BranchState::REST } else { BranchState { viscous, shear: own[6] } }
        };
        let branches = numbers[HEAD..].chunks_exact(BRANCH).map(branch).collect();
        let state = State { branches, peak: numbers[1] };
        Self { state, pressure: numbers[0], dissipated: numbers[2] }
    }

    /// Writes the state variables of a host.
    pub fn write(&self, numbers: &mut [f64]) {
        numbers[..HEAD].copy_from_slice(&[self.pressure, self.state.peak, self.dissipated]);
        for (branch, own) in self.state.branches.iter().zip(numbers[HEAD..].chunks_exact_mut(BRANCH)) {
            own[..6].copy_from_slice(branch.viscous.as_slice());
            own[6] = branch.shear;
        }
    }
}

/// Number of constants for which CalculiX 2.20 has room in `elconloc`; more overwrite its stack.
pub const CALCULIX_CONSTANTS: usize = 21;

/// Lists the constants of branches and softening behind those of the equilibrium law, for a host whose
/// temperatures have this absolute zero and whose unit of stress has so many pascals.
pub fn constants(law: &Viscoelastic, zero: f64, pascals: f64) -> Vec<f64> {
    let mut all = vec![zero];
    all.extend(law.softening().map_or([0.0; 3], |own| [own.ratio, own.offset / pascals, own.slope]));
    for branch in law.branches() {
        all.extend(spring_constants(&branch.spring, pascals));
        all.extend(viscosity_constants(&branch.viscosity, pascals));
        all.extend(match branch.shift {
            Shift::None => vec![0.0],
            Shift::Wlf { reference, constants: [first, second] } => vec![1.0, reference, first, second],
            Shift::Arrhenius { reference, energy } => vec![2.0, reference, energy],
        });
    }
    all
}

/// Formats a law as the user material of crate `umat`, with its number of state variables: `key` is that of
/// the equilibrium law, `elastic` its constants in the host's unit of stress, K first; temperatures are in
/// kelvin.
pub fn card(key: &str, elastic: &[f64], law: &Viscoelastic, pascals: f64) -> String {
    let name = format!("VISCOELASTIC_{}", key.to_uppercase().replace('-', "_"));
    let numbers = [elastic, &constants(law, 0.0, pascals)].concat();
    let calculix = match numbers.len() {
        count if count > CALCULIX_CONSTANTS => {
            format!("more constants than the {CALCULIX_CONSTANTS} for which CalculiX has room")
        }
        count if count % 8 == 0 => {
            format!("in CalculiX NAME=USER_{name}, and a line `0.` more behind the constants")
        }
        _ => format!("in CalculiX NAME=USER_{name}"),
    };
    format!(
        "** of crate umat; {calculix}\n*MATERIAL, NAME={name}\n*USER MATERIAL, \
         CONSTANTS={}\n{}*DEPVAR\n{}\n",
        numbers.len(),
        deck::lines(&numbers),
        state_count(law.branches().len())
    )
}

fn spring_constants(spring: &Spring, pascals: f64) -> Vec<f64> {
    let of = |law: &dyn Hyperelastic| -> Vec<f64> {
        law.parameters().into_iter().map(|(_, value)| value).collect()
    };
    match spring {
        Spring::NeoHookean(law) => vec![1.0, law.shear_modulus() / pascals],
        Spring::LopezPamies(law) => {
            let terms = of(law);
            let scaled = terms.chunks_exact(2).flat_map(|term| [term[0] / pascals, term[1]]);
            [2.0, (terms.len() / 2) as f64].into_iter().chain(scaled).collect()
        }
        Spring::EightChain(law) => {
            let own = of(law);
            vec![3.0, own[0] / pascals, own[1]]
        }
    }
}

fn viscosity_constants(viscosity: &Viscosity, pascals: f64) -> Vec<f64> {
    match *viscosity {
        Viscosity::Constant(eta) => vec![1.0, eta / pascals],
        Viscosity::KumarLopezPamies { start, end, thickening, thinning, exponents: [first, second] } => {
            let [start, end, thickening] = [start, end, thickening].map(|eta| eta / pascals);
            vec![2.0, start, end, thickening, thinning * pascals * pascals, first, second]
        }
        Viscosity::BergstromBoyce { rate, stress, power, creep, offset } => {
            vec![3.0, rate, stress / pascals, power, creep, offset]
        }
        Viscosity::Eyring { rate, stress, pressure, softening } => {
            let own = [rate, stress / pascals, pressure];
            let kind = if softening.is_some() { 5.0 } else { 4.0 };
            let soft = softening.map(|soft| [[soft.amount].as_slice(), &soft.shape].concat());
            [kind].into_iter().chain(own).chain(soft.unwrap_or_default()).collect()
        }
    }
}

/// Builds a law from its equilibrium law and [`constants`]; stresses are in the unit of the equilibrium law.
/// Returns it with the absolute zero of temperatures.
///
/// # Errors
/// [`Error::Data`] for too few or too many constants, an unknown kind, an absolute zero other than 0 or
/// 273.15, or a spring that softens at large strains; [`Error::Parameter`].
pub fn law(equilibrium: Box<dyn Law>, constants: &[f64]) -> Result<(Viscoelastic, f64), Error> {
    let mut rest = Rest { all: constants, next: 0 };
    let [zero] = rest.take("the absolute zero of temperatures")?;
    if zero != 0.0 && zero != 273.15 {
        return Err(refuse(format!(
            "absolute zero {zero}: write 0 for kelvin or 273.15 for degrees Celsius"
        )));
    }
    let [ratio, offset, slope] = rest.take("r, m and beta of the softening")?;
    let mut branches = Vec::new();
    while rest.next < constants.len() {
        branches.push(rest.branch(branches.len() + 1)?);
    }
    let law = Viscoelastic::new(equilibrium, branches)?;
    let law = match [ratio, offset, slope] {
        [0.0, 0.0, 0.0] => law,
        _ => law.with_softening(Mullins { ratio, offset, slope })?,
    };
    Ok((law, zero))
}

/// Constants not yet read.
struct Rest<'a> {
    all: &'a [f64],
    next: usize,
}

fn refuse(reason: String) -> Error {
    Error::Data { what: "constants of branches".to_owned(), reason }
}

impl Rest<'_> {
    fn take<const N: usize>(&mut self, what: &str) -> Result<[f64; N], Error> {
        let found = self.all.get(self.next..self.next + N).and_then(|own| own.try_into().ok());
        self.next += N;
        found.ok_or_else(|| refuse(format!("{} numbers end before {what}", self.all.len())))
    }

    fn branch(&mut self, k: usize) -> Result<Branch, Error> {
        let spring = self.spring(k)?;
        let least = spring.least_slope(REACH);
        if least.is_nan() || least <= 0.0 {
            let slope = format!("a slope of {least:.3e} below log strains of {REACH}");
            return Err(refuse(format!("branch {k} has a spring whose stress falls: {slope}")));
        }
        let viscosity = self.viscosity(k)?;
        let mut branch = Branch::new(spring, viscosity)?;
        let at = format!("the shift of branch {k}");
        branch.shift = match self.take(&at)? {
            [0.0] => Shift::None,
            [1.0] => {
                let [reference, first, second] = self.take(&at)?;
                Shift::Wlf { reference, constants: [first, second] }
            }
            [2.0] => {
                let [reference, energy] = self.take(&at)?;
                Shift::Arrhenius { reference, energy }
            }
            [other] => return Err(refuse(format!("{at} is {other}: 0 none, 1 WLF, 2 Arrhenius"))),
        };
        Ok(branch)
    }

    fn spring(&mut self, k: usize) -> Result<Spring, Error> {
        let at = format!("the spring of branch {k}");
        match self.take(&at)? {
            [1.0] => {
                let [modulus] = self.take(&at)?;
                Ok(Spring::NeoHookean(NeoHookean::new(modulus)?))
            }
            [2.0] => {
                let [count] = self.take(&at)?;
                if !(count >= 1.0 && count.fract() == 0.0 && count <= self.all.len() as f64) {
                    return Err(refuse(format!("{at} has {count} terms: write a whole number from 1")));
                }
                let terms = (0..count as usize).map(|_| self.take(&at)).collect::<Result<_, _>>()?;
                Ok(Spring::LopezPamies(LopezPamies::new(terms)?))
            }
            [3.0] => {
                let [modulus, links] = self.take(&at)?;
                Ok(Spring::EightChain(EightChain::new(modulus, links)?))
            }
            [other] => Err(refuse(format!("{at} is {other}: 1 neo-Hooke, 2 Lopez-Pamies, 3 eight-chain"))),
        }
    }

    fn viscosity(&mut self, k: usize) -> Result<Viscosity, Error> {
        let at = format!("the viscosity of branch {k}");
        match self.take(&at)? {
            [1.0] => {
                let [eta] = self.take(&at)?;
                Ok(Viscosity::Constant(eta))
            }
            [2.0] => {
                let [start, end, thickening, thinning, first, second] = self.take(&at)?;
                let exponents = [first, second];
                Ok(Viscosity::KumarLopezPamies { start, end, thickening, thinning, exponents })
            }
            [3.0] => {
                let [rate, stress, power, creep, offset] = self.take(&at)?;
                Ok(Viscosity::BergstromBoyce { rate, stress, power, creep, offset })
            }
            [kind @ (4.0 | 5.0)] => {
                let [rate, stress, pressure] = self.take(&at)?;
                let softening = if kind == 5.0 {
                    let [amount, r0, r1, r2] = self.take(&at)?;
                    Some(StrainSoftening { amount, shape: [r0, r1, r2] })
                } else {
                    None
                };
                Ok(Viscosity::Eyring { rate, stress, pressure, softening })
            }
            [other] => {
                let kinds = "1 constant, 2 Kumar and Lopez-Pamies, 3 Bergström and Boyce, 4 Eyring, 5 Eyring \
                             with softening";
                Err(refuse(format!("{at} is {other}: {kinds}")))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::hyperelastic::{Compressible, Volumetric};

    fn rubber() -> Box<dyn Law> {
        let law = NeoHookean::new(0.4).unwrap();
        Box::new(Compressible::new(law, Volumetric::Ciarlet { lame: 40.0 }).unwrap())
    }

    /// All kinds of springs, viscosities and shifts return from their numbers in MPa.
    #[test]
    fn laws_return_from_their_constants() {
        let pascals = 1e6;
        let springs = [
            Spring::NeoHookean(NeoHookean::new(2e5).unwrap()),
            Spring::LopezPamies(LopezPamies::new(vec![[1e5, 0.5], [3e4, 2.0]]).unwrap()),
            Spring::EightChain(EightChain::new(3e5, 20.0).unwrap()),
        ];
        let soft = StrainSoftening { amount: 3.0, shape: [0.9, 2.0, -5.0] };
        let viscosities = [
            Viscosity::Constant(5e6),
            Viscosity::KumarLopezPamies {
                start: 7e6,
                end: 1e2,
                thickening: 3e6,
                thinning: 1e-10,
                exponents: [1.8, 0.3],
            },
            Viscosity::BergstromBoyce { rate: 1.0, stress: 2e5, power: 4.0, creep: -0.5, offset: 0.01 },
            Viscosity::Eyring { rate: 1e-3, stress: 1e6, pressure: 0.1, softening: None },
            Viscosity::Eyring { rate: 1e-3, stress: 1e6, pressure: 0.0, softening: Some(soft) },
        ];
        let shifts = [
            Shift::None,
            Shift::Wlf { reference: 293.15, constants: [10.0, 100.0] },
            Shift::Arrhenius { reference: 293.15, energy: 5e4 },
        ];
        let mut branches = Vec::new();
        for spring in &springs {
            for viscosity in viscosities {
                for shift in shifts {
                    branches.push(Branch { spring: spring.clone(), viscosity, shift });
                }
            }
        }
        let softening = Mullins { ratio: 2.0, offset: 4e4, slope: 0.1 };
        let given = Viscoelastic::new(rubber(), branches).unwrap().with_softening(softening).unwrap();
        let numbers = constants(&given, 273.15, pascals);
        let (found, zero) = law(rubber(), &numbers).unwrap();
        assert_eq!((zero, found.branches().len()), (273.15, 45));
        // in the host's unit a second time
        assert_eq!(constants(&found, zero, 1.0), numbers);
        for (own, given) in found.branches().iter().zip(given.branches()) {
            let (a, b) = (own.spring.shear_modulus() * pascals, given.spring.shear_modulus());
            assert!((a / b - 1.0).abs() < 1e-14);
            let eta = |law: &Branch, stress: f64| law.viscosity.fluidity(stress * stress, 3.2).logarithm;
            let off = eta(own, 0.1) - pascals.ln() - eta(given, 0.1 * pascals);
            assert!(off.abs() < 1e-12, "{off} {own:?}");
            assert_eq!(own.shift, given.shift);
        }
    }

    /// CalculiX has room for 21 constants, and reads one line more after whole lines of eight.
    #[test]
    fn cards_say_what_calculix_takes() {
        let spring = Spring::NeoHookean(NeoHookean::new(2e5).unwrap());
        let branch = || Branch::new(spring.clone(), Viscosity::Constant(5e6)).unwrap();
        for (count, constants, says) in [
            (1, 11, "in CalculiX NAME=USER_VISCOELASTIC_NEO_HOOKEAN\n"),
            (2, 16, "a line `0.` more behind the constants\n"),
            (4, 26, "more constants than the 21"),
        ] {
            let law = Viscoelastic::new(rubber(), (0..count).map(|_| branch()).collect()).unwrap();
            let card = card("neo-hookean", &[40.0, 0.4], &law, 1e6);
            assert!(card.contains(&format!("CONSTANTS={constants}\n")) && card.contains(says), "{card}");
        }
    }

    #[test]
    fn wrong_constants_are_named() {
        let one = [0.0, 0.0, 0.0, 0.0];
        for (numbers, says) in [
            (&[][..], "0 numbers end before the absolute zero"),
            (&[20.0, 0.0, 0.0, 0.0][..], "absolute zero 20: write 0"),
            (&[0.0, 2.0][..], "2 numbers end before r, m and beta"),
            (&[0.0, 0.5, 1.0, 0.1][..], "r = 0.5 is outside (1, ∞)"),
            (&[&one[..], &[4.0]].concat(), "the spring of branch 1 is 4: 1 neo-Hooke"),
            (&[&one[..], &[f64::NAN]].concat(), "the spring of branch 1 is NaN"),
            (&[&one[..], &[2.0, 0.0]].concat(), "has 0 terms"),
            (&[&one[..], &[2.0, 1e9]].concat(), "has 1000000000 terms"),
            (&[&one[..], &[2.0, 1.0, 0.3, -10.0, 1.0, 1.0, 0.0]].concat(), "branch 1 has a spring whose"),
            (&[&one[..], &[1.0, -0.3, 1.0, 1.0, 0.0]].concat(), "-0.3"),
            (&[&one[..], &[1.0, 0.3, 6.0]].concat(), "the viscosity of branch 1 is 6"),
            (&[&one[..], &[1.0, 0.3, 1.0, 0.0, 0.0]].concat(), "viscosity = 0 is outside"),
            (&[&one[..], &[1.0, 0.3, 1.0, 1.0, 3.0]].concat(), "the shift of branch 1 is 3"),
            (&[&one[..], &[1.0, 0.3, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0]].concat(), "reference of the shift"),
            (&[&one[..], &[1.0, 0.3, 1.0, 1.0, 0.0, 1.0]].concat(), "end before the spring of branch 2"),
        ] {
            let error = law(rubber(), numbers).err().map(|error| error.to_string()).unwrap_or_default();
            assert!(error.contains(says), "{numbers:?}: {error}");
        }
    }

    /// A row of zeros is a virgin point, and every state returns from its numbers to the last bit.
    #[test]
    fn states_return_from_their_numbers() {
        let mut numbers = vec![0.0; state_count(2)];
        let fresh = PointRecord::read(&numbers);
        assert_eq!(fresh.state, State { branches: vec![BranchState::REST; 2], peak: 0.0 });
        let viscous = Voigt::new(1.3, 0.9, 0.87, 0.1, -0.02, 0.3);
        let used = PointRecord {
            state: State {
                branches: vec![BranchState { viscous, shear: 0.4 }, BranchState::REST],
                peak: 0.3,
            },
            pressure: -0.7,
            dissipated: 0.02,
        };
        used.write(&mut numbers);
        assert_eq!(PointRecord::read(&numbers), used);
    }
}

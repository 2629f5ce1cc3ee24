//! End-linked networks: strands B₂ joined by cross-linkers A_f.

use super::{Error, LinkerMix, Melt, PolymerNetwork, SolFractions, not_negative, positive};
use crate::numerics::bisected;

/// Factor of the concentration of a strand's own end (Gaussian chain) in the probability of a loop. It is
/// the only number here that is fitted: to the conversions of 15 simulated networks of f = 4, given their
/// sol (doi:10.1021/acs.macromol.3c02544). No measured network was used.
pub const LOOP_FACTOR: f64 = 1.6;

/// Extent of the reaction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reacted {
    /// Conversion p_A of the groups A; p_B = r p_A.
    Conversion(f64),
    /// Measured mass fraction of the sol, from which the conversion follows.
    SolFraction(f64),
    /// All groups of the kind in deficit, p_A = min(1, 1/r). Few real networks get there.
    Complete,
}

/// Composition of an end-linked network: strands B₂ with a group B at either end, cross-linkers with f
/// groups A, and chains B₁ with one group B.
///
/// ```
/// use polycore::network::{EndLinked, Melt, Reacted};
///
/// let recipe = EndLinked::new(4, 11.3, Reacted::SolFraction(0.003)).ratio(1.33);
/// let network = recipe.network(&Melt::of_polymer("PDMS")?.extracted())?;
/// // measured: 0.275 MPa (Gottlieb and others 1981)
/// assert!((network.modulus() / 0.275e6 - 1.0).abs() < 0.1);
/// # Ok::<(), polycore::network::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct EndLinked {
    /// Cross-linkers; `Err` from a functionality that is none.
    linkers: Result<LinkerMix, Error>,
    /// Molar mass of a strand B₂ (number average), kg/mol.
    strand_mass: f64,
    reacted: Reacted,
    ratio: f64,
    linker_mass: f64,
    /// Share of the groups B on chains B₁, and their molar mass in kg/mol.
    ends: (f64, f64),
    loop_factor: f64,
}

impl EndLinked {
    /// Creates the composition of strands of a molar mass (kg/mol; of several lengths, the number average)
    /// and cross-linkers of a functionality, in balance (r = 1), cross-linkers without mass.
    pub fn new(functionality: u32, strand_mass: f64, reacted: Reacted) -> Self {
        Self {
            linkers: LinkerMix::new(&[(functionality, 1.0)]),
            strand_mass,
            reacted,
            ratio: 1.0,
            linker_mass: 0.0,
            ends: (0.0, 0.0),
            loop_factor: LOOP_FACTOR,
        }
    }

    /// Sets cross-linkers of several functionalities.
    pub fn linkers(self, linkers: LinkerMix) -> Self {
        Self { linkers: Ok(linkers), ..self }
    }

    /// Sets r, groups A per group B.
    pub fn ratio(self, ratio: f64) -> Self {
        Self { ratio, ..self }
    }

    /// Sets the molar mass of a cross-linker, kg/mol (of several kinds, the mean over their number).
    pub fn linker_mass(self, linker_mass: f64) -> Self {
        Self { linker_mass, ..self }
    }

    /// Sets the share of the groups B that stand on chains with this one group, and the molar mass of these
    /// chains, kg/mol.
    pub fn ends(self, share: f64, mass: f64) -> Self {
        Self { ends: (share, mass), ..self }
    }

    /// Sets the factor of loops in a conversion from a sol fraction; 0 takes the conversion of the tree
    /// theory.
    pub fn loop_factor(self, loop_factor: f64) -> Self {
        Self { loop_factor, ..self }
    }

    /// Computes the network.
    ///
    /// # Errors
    /// A composition at or below the gel point, conversions above 1, a sol fraction below what the ratio
    /// allows, numbers outside their range, strands of less than 1.5 Kuhn segments.
    pub fn network(&self, melt: &Melt) -> Result<PolymerNetwork, Error> {
        melt.check()?;
        let recipe = self.checked()?;
        let largest = 1.0_f64.min(1.0 / self.ratio);
        match self.reacted {
            Reacted::Conversion(conversion) => {
                positive("conversion p_A", conversion)?;
                if conversion > largest {
                    return Err(Error::TooManyReacted { conversion, ratio: self.ratio });
                }
                recipe.network(conversion, melt)
            }
            Reacted::Complete => recipe.network(largest, melt),
            Reacted::SolFraction(sol) => {
                let [tree, conversion] = recipe.conversions(sol, melt, self.loop_factor)?;
                let network = recipe.network(conversion, melt)?;
                let sol = SolFractions { mass: sol, ..network.sol };
                Ok(PolymerNetwork { sol, least_conversion: Some(tree), ..network })
            }
        }?
        .checked()
    }

    fn checked(&self) -> Result<Recipe<'_>, Error> {
        let linkers = self.linkers.as_ref().map_err(Clone::clone)?;
        positive("molar mass of the strands", self.strand_mass)?;
        positive("ratio r of groups A to groups B", self.ratio)?;
        not_negative("molar mass of the cross-linkers", self.linker_mass)?;
        not_negative("factor of loops", self.loop_factor)?;
        let (share, mass) = self.ends;
        if !(0.0..1.0).contains(&share) {
            let quantity = "share of the groups B on chains with one group";
            return Err(Error::Domain { quantity, value: share, allowed: "0 to 1, without 1" });
        }
        not_negative("molar mass of the chains with one group", mass)?;
        let strands = (1.0 - share) / 2.0;
        let masses = [strands * self.strand_mass, share * mass];
        let linker = self.ratio * linkers.per_group() * self.linker_mass;
        Ok(Recipe { linkers, ratio: self.ratio, bridging: 1.0 - share, masses, linker })
    }
}

/// Checked composition, per mole of groups B.
struct Recipe<'a> {
    linkers: &'a LinkerMix,
    ratio: f64,
    /// Share of the groups B on strands, 1 − b₁.
    bridging: f64,
    /// Masses of strands and of chains with one group, kg per mole of groups B.
    masses: [f64; 2],
    /// Mass of cross-linkers, kg per mole of groups B.
    linker: f64,
}

impl Recipe<'_> {
    fn mass(&self) -> f64 {
        self.masses[0] + self.masses[1] + self.linker
    }

    /// Returns p_A p_B (1 − b₁).
    fn product(&self, conversion: f64) -> f64 {
        self.ratio * conversion * conversion * self.bridging
    }

    /// Returns α and β at a conversion p_A; 1 and 1 at and below the gel point.
    fn extinction(&self, conversion: f64) -> [f64; 2] {
        let Some(alpha) = self.linkers.extinction(self.product(conversion)) else { return [1.0, 1.0] };
        [alpha, 1.0 - self.ratio * conversion * (1.0 - self.linkers.ends(alpha))]
    }

    /// Returns the soluble share of the mass.
    fn sol(&self, [alpha, beta]: [f64; 2]) -> f64 {
        let linkers = self.linkers.soluble(alpha) / self.linkers.per_group();
        (self.masses[0] * beta * beta + self.masses[1] * beta + self.linker * linkers) / self.mass()
    }

    fn no_gel(&self, conversion: f64) -> Error {
        let value = self.linkers.branching() * self.product(conversion);
        let plain = self.linkers.shares().len() == 1 && self.bridging == 1.0;
        let product = match plain {
            true => "(f - 1) p_A p_B",
            false => "sum a_f (f - 1) p_A p_B (1 - b_1)",
        };
        let advice = "raise the conversion or the functionality, or bring r nearer to 1";
        Error::NoGel { product, value, least: 1.0, advice }
    }

    /// Returns the conversion of the tree theory for a measured sol fraction, and the one that allows for
    /// loops.
    ///
    /// The sol falls with the conversion, so that the bracket from the gel point to the largest conversion
    /// holds one root. Loops of single strands end ways that the tree theory takes for ways to the gel:
    /// with a probability λ of such a loop 1 − √w = (1 − √w_tree)(1 − λ), λ = k (f − 1) p_A p_B c_own/[B],
    /// where c_own is the concentration of a Gaussian strand's own end at its other end, [B] that of all
    /// groups B, k the [`LOOP_FACTOR`]. Needs Kuhn data.
    fn conversions(&self, sol: f64, melt: &Melt, loop_factor: f64) -> Result<[f64; 2], Error> {
        if !(0.0..1.0).contains(&sol) {
            return Err(Error::Domain { quantity: "sol fraction", value: sol, allowed: "0 to 1, without 1" });
        }
        let largest = 1.0_f64.min(1.0 / self.ratio);
        let of_tree = |conversion: f64| self.sol(self.extinction(conversion));
        let gel_point = (self.linkers.branching() * self.ratio * self.bridging).sqrt().recip();
        if gel_point >= largest {
            return Err(self.no_gel(largest));
        }
        let least = of_tree(largest);
        if sol < least {
            let ratio = self.ratio;
            return Err(Error::TooLittleSol { sol, least, ratio, conversion: largest });
        }
        let tree = bisected(gel_point, largest, 200, |conversion| of_tree(conversion) > sol);
        let Some(chain) = melt.chain.filter(|_| loop_factor > 0.0) else { return Ok([tree, tree]) };
        let groups = melt.density / self.mass();
        let own = loop_factor * self.linkers.branching() * chain.own_end(self.strand_mass()) / groups;
        let with_loops = |conversion: f64| {
            let loops = (own * self.product(conversion)).min(1.0);
            (1.0 - (1.0 - of_tree(conversion).sqrt()) * (1.0 - loops)).powi(2)
        };
        let conversion = match with_loops(largest) < sol {
            true => bisected(tree, largest, 200, |conversion| with_loops(conversion) > sol),
            // loops alone explain the sol
            false => largest,
        };
        Ok([tree, conversion])
    }

    /// Returns the molar mass of a strand.
    fn strand_mass(&self) -> f64 {
        2.0 * self.masses[0] / self.bridging
    }

    /// Returns the structure at a conversion p_A.
    fn network(&self, conversion: f64, melt: &Melt) -> Result<PolymerNetwork, Error> {
        let [alpha, beta] = self.extinction(conversion);
        if alpha >= 1.0 {
            return Err(self.no_gel(conversion));
        }
        // mol/m³ of groups A
        let groups_b = melt.density / self.mass();
        let groups = groups_b * self.ratio;
        let [strands, junctions] = self.linkers.effective(alpha, 3).map(|count| groups * count);
        let carrying = (1.0 - beta).powi(2);
        let in_series = groups_b * self.bridging / 2.0 * carrying / strands;
        let chains = self.masses[0] / (self.masses[0] + self.masses[1]);
        let sol = SolFractions {
            mass: self.sol([alpha, beta]),
            strands: beta * beta,
            linkers: self.linkers.soluble(alpha) / self.linkers.per_group(),
            ends: if self.bridging < 1.0 { beta } else { 0.0 },
        };
        Ok(PolymerNetwork {
            melt: *melt,
            conversion: [conversion, self.ratio * conversion],
            least_conversion: None,
            extinction: [alpha, beta],
            strands,
            junctions,
            carrying: chains * carrying,
            strand_mass: in_series * self.strand_mass(),
            in_series,
            trapped: (chains * carrying).powi(2),
            sol,
        })
    }
}

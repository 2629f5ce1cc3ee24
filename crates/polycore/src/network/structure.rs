//! A polymer network: its structure per volume, and the mechanical figures that follow.

use super::{BOND_ENERGIES, Error, GAS_CONSTANT, KnownPolymer, KuhnChain, known_polymer};
use super::{not_negative, positive};

/// The polymer around and in the strands, and the state of the network.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Melt {
    /// Density ρ, kg/m³.
    pub density: f64,
    /// Temperature T, K.
    pub temperature: f64,
    /// Modulus G_e that entanglements contribute if all are trapped, Pa; 0 leaves them out.
    pub entanglement_modulus: f64,
    /// Kuhn data; without them a network has no chain length and no fracture energy.
    pub chain: Option<KuhnChain>,
    /// True if the sol was extracted and the gel dried, false if it is still in.
    pub extracted: bool,
}

impl Melt {
    /// Creates the melt of a polymer that the [table](super::KNOWN_POLYMERS) knows, at 298.15 K, sol left
    /// in.
    ///
    /// # Errors
    /// An unknown polymer, one whose density or plateau modulus the table lacks.
    pub fn of_polymer(polymer: &str) -> Result<Self, Error> {
        let &KnownPolymer { name, chain, density, entanglement_modulus, .. } = known_polymer(polymer)?;
        let missing = |property| Error::Missing { polymer: name, property };
        Ok(Self {
            density: density.ok_or_else(|| missing("density"))?,
            temperature: 298.15,
            entanglement_modulus: entanglement_modulus.ok_or_else(|| missing("entanglement modulus"))?,
            chain: Some(chain),
            extracted: false,
        })
    }

    /// Returns this melt with the sol of the network extracted.
    pub fn extracted(self) -> Self {
        Self { extracted: true, ..self }
    }

    /// Returns RT, J/mol.
    pub fn thermal_energy(&self) -> f64 {
        GAS_CONSTANT * self.temperature
    }

    /// Checks the numbers.
    pub(super) fn check(&self) -> Result<(), Error> {
        positive("density", self.density)?;
        positive("temperature", self.temperature)?;
        not_negative("entanglement modulus", self.entanglement_modulus)?;
        if let Some(KuhnChain { length, mass, bond_mass }) = self.chain {
            KuhnChain::new(length, mass, bond_mass)?;
        }
        Ok(())
    }
}

/// Soluble shares.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SolFractions {
    /// Mass fraction of the sol in everything.
    pub mass: f64,
    /// Share of the strands, or of the primary chains by mass.
    pub strands: f64,
    /// Share of the cross-linkers.
    pub linkers: f64,
    /// Share of the chains with one reactive group.
    pub ends: f64,
}

/// Structure per volume before anything is extracted, and what follows from it.
#[derive(Clone, Debug, PartialEq)]
pub struct PolymerNetwork {
    /// The polymer.
    pub melt: Melt,
    /// Conversions p_A, p_B of the groups; of random cross-linking, the cross-linked units per chain twice.
    pub conversion: [f64; 2],
    /// Conversion p_A of the tree theory if p_A comes from a sol fraction: a lower bound, since loops make
    /// a sol of their own.
    pub least_conversion: Option<f64>,
    /// α, β: probabilities that the way out from a group A, B leads to a finite piece.
    pub extinction: [f64; 2],
    /// Effective strands ν, mol/m³.
    pub strands: f64,
    /// Effective junctions μ (three or more ways to the gel), mol/m³.
    pub junctions: f64,
    /// Share of the chains by mass that carries load.
    pub carrying: f64,
    /// Molar mass of an effective strand, kg/mol.
    pub strand_mass: f64,
    /// Mean number of strands in series in an effective strand, s̄: junctions of two ways join them.
    pub in_series: f64,
    /// Trapping factor T_e: probability that all four ways out of an entanglement lead to the gel.
    pub trapped: f64,
    /// Sol.
    pub sol: SolFractions,
}

impl PolymerNetwork {
    /// Mass fraction that stays after extraction; 1 if nothing is extracted.
    fn rest(&self) -> f64 {
        if self.melt.extracted { 1.0 - self.sol.mass } else { 1.0 }
    }

    /// Returns the modulus of phantom strands and junctions, Pa: (ν − μ)RT; after extraction × (1 −
    /// w)^(−1/3): more strands per volume, each less stretched.
    pub fn phantom(&self) -> f64 {
        (self.strands - self.junctions) * self.melt.thermal_energy() * self.rest().powf(-1.0 / 3.0)
    }

    /// Returns the modulus of strands whose junctions move affinely, νRT (Pa); extraction as for the
    /// phantom.
    pub fn affine(&self) -> f64 {
        self.strands * self.melt.thermal_energy() * self.rest().powf(-1.0 / 3.0)
    }

    /// Returns the modulus of trapped entanglements, Pa: G_e T_e; after extraction × (1 − w)^(−2).
    pub fn entangled(&self) -> f64 {
        self.melt.entanglement_modulus * self.trapped * self.rest().powi(-2)
    }

    /// Returns the [stiffening](KuhnChain::stiffening) of strands of n segments; 1 if n is not known.
    pub fn stiffening(&self) -> f64 {
        self.segments().map_or(1.0, KuhnChain::stiffening)
    }

    /// Returns the shear modulus, Pa: stiffening × phantom part + trapped entanglements.
    pub fn modulus(&self) -> f64 {
        self.stiffening() * self.phantom() + self.entangled()
    }

    /// Returns s̄(2s̄ − 1), the mean square number of strands in series (they are distributed
    /// geometrically).
    pub fn in_series_square(&self) -> f64 {
        self.in_series * (2.0 * self.in_series - 1.0)
    }

    /// Returns n, the Kuhn segments of an effective strand. `None` without Kuhn data.
    pub fn segments(&self) -> Option<f64> {
        self.melt.chain.and_then(|chain| chain.segments(self.strand_mass).ok())
    }

    /// Returns the stretch √n at which strands that deform affinely lock; after extraction × (1 −
    /// w)^(−1/3). An estimate: mean vectors of phantom strands are shorter and lock later, trapped
    /// entanglements earlier.
    pub fn locking_stretch(&self) -> Option<f64> {
        self.segments().map(|segments| segments.sqrt() * self.rest().powf(-1.0 / 3.0))
    }

    /// Returns the stretch √(nν/(ν − μ)) at which the mean vectors of phantom strands lock; extraction as
    /// above.
    pub fn phantom_locking_stretch(&self) -> Option<f64> {
        let longer = self.strands / (self.strands - self.junctions);
        self.locking_stretch().map(|locking| locking * longer.sqrt())
    }

    /// Returns the range of the [fracture energy](KuhnChain::fracture_energy), J/m², for the two
    /// [`BOND_ENERGIES`]: an estimate, never a measurement.
    pub fn fracture_energy(&self) -> Option<[f64; 2]> {
        let (chain, segments) = (self.melt.chain?, self.segments()?);
        Some(
            BOND_ENERGIES
                .map(|energy| chain.fracture_energy(self.strands, segments, energy) * self.shrinkage()),
        )
    }

    /// Returns the factor of extraction in the fracture energy, (1 − w)^(−2/3): a plane shrinks, the number
    /// of strands through it does not. 1 if nothing is extracted.
    pub fn shrinkage(&self) -> f64 {
        self.rest().powf(-2.0 / 3.0)
    }

    /// Checks that an effective strand is a chain, if Kuhn data are given.
    pub(super) fn checked(self) -> Result<Self, Error> {
        if let Some(chain) = self.melt.chain {
            chain.segments(self.strand_mass)?;
        }
        Ok(self)
    }
}

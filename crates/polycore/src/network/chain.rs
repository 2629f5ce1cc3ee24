//! Kuhn data of polymers, and what they make of a strand.

use super::{AVOGADRO, Error, positive};
use crate::langevin::inverse;

/// Energies of a backbone bond when a strand breaks, J/mol. 350 kJ/mol is the dissociation energy of C–C;
/// about 60 kJ/mol is the energy stored per bond at scission, an estimate from force spectroscopy of single
/// hydrocarbon chains (Wang, Panyukov, Rubinstein, Craig 2019, Macromolecules 52, 2772). Neither is for
/// Si–O.
pub const BOND_ENERGIES: [f64; 2] = [60e3, 350e3];

/// Kuhn segments below which a strand is refused: the stiffness of a Langevin chain diverges at one.
const LEAST_SEGMENTS: f64 = 1.5;

/// Statistics of a chain: freely jointed segments of length b and molar mass M_K.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KuhnChain {
    /// Kuhn length b, m.
    pub length: f64,
    /// Molar mass of a Kuhn segment M_K, kg/mol.
    pub mass: f64,
    /// Molar mass per backbone bond M_b, kg/mol.
    pub bond_mass: f64,
}

/// Polymer with its data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownPolymer {
    /// Name.
    pub name: &'static str,
    /// Other names.
    pub aliases: &'static [&'static str],
    /// Kuhn data of melts at 413 K: Rubinstein and Colby, Polymer Physics, table 2.1, as
    /// formulation-networks.md quotes it; M_b from the repeat unit.
    pub chain: KuhnChain,
    /// Density near 298 K, kg/m³.
    pub density: Option<f64>,
    /// Plateau modulus of a melt near 298 K, Pa: what trapped entanglements contribute if all are trapped.
    pub entanglement_modulus: Option<f64>,
}

const fn known(
    name: &'static str,
    aliases: &'static [&'static str],
    [length, mass, bond_mass]: [f64; 3],
    density: Option<f64>,
    entanglement_modulus: Option<f64>,
) -> KnownPolymer {
    // nm and g/mol
    let chain = KuhnChain { length: length * 1e-9, mass: mass * 1e-3, bond_mass: bond_mass * 1e-3 };
    KnownPolymer { name, aliases, chain, density, entanglement_modulus }
}

/// Polymers with their data: Kuhn length (nm), molar mass of a segment and of a backbone bond (g/mol),
/// density, plateau modulus. That of PDMS, 0.20 MPa, is of Fetters and others (1994),
/// doi:10.1021/ma00095a001, quoted from memory; it is ρRT/M_e of M_e = 12 kg/mol.
pub const KNOWN_POLYMERS: [KnownPolymer; 6] = [
    known("PDMS", &["polydimethylsiloxane", "silicone"], [1.3, 381.0, 37.0], Some(970.0), Some(0.20e6)),
    known("polyisoprene", &["PI", "natural rubber"], [0.82, 113.0, 17.0], Some(910.0), None),
    known("polybutadiene", &["PB", "PBD"], [0.96, 105.0, 13.5], None, None),
    known("polyethylene", &["PE"], [1.4, 150.0, 14.0], None, None),
    known("polypropylene", &["PP"], [1.1, 180.0, 21.0], None, None),
    known("PEO", &["PEG", "polyethylene oxide", "polyethylene glycol"], [1.1, 137.0, 14.7], None, None),
];

/// Finds a polymer by one of its names, without regard to capitals, dashes and blanks.
///
/// # Errors
/// [`Error::UnknownPolymer`].
pub fn known_polymer(name: &str) -> Result<&'static KnownPolymer, Error> {
    let plain = |text: &str| -> String {
        text.chars().filter(char::is_ascii_alphanumeric).map(|c| c.to_ascii_lowercase()).collect()
    };
    let is_meant = |polymer: &&KnownPolymer| {
        std::iter::once(&polymer.name).chain(polymer.aliases).any(|known| plain(known) == plain(name))
    };
    KNOWN_POLYMERS.iter().find(is_meant).ok_or_else(|| Error::UnknownPolymer(name.to_owned()))
}

impl KuhnChain {
    /// Creates the statistics of a chain from Kuhn length (m), molar mass of a segment and of a backbone
    /// bond (kg/mol).
    ///
    /// # Errors
    /// Numbers that are not positive.
    pub fn new(length: f64, mass: f64, bond_mass: f64) -> Result<Self, Error> {
        positive("Kuhn length", length)?;
        positive("molar mass of a Kuhn segment", mass)?;
        positive("molar mass per backbone bond", bond_mass)?;
        Ok(Self { length, mass, bond_mass })
    }

    /// Returns n = M/M_K, the Kuhn segments of a strand of molar mass M (kg/mol).
    ///
    /// # Errors
    /// A strand of fewer than 1.5 segments.
    pub fn segments(&self, strand: f64) -> Result<f64, Error> {
        let segments = strand / self.mass;
        match segments >= LEAST_SEGMENTS {
            true => Ok(segments),
            false => Err(Error::TooShort { segments, least: LEAST_SEGMENTS }),
        }
    }

    /// Returns the small-strain modulus of Langevin chains of n segments over that of Gaussian ones,
    /// √n 𝓛⁻¹(1/√n)/3 = 1 + 3/(5n) + 99/(175n²) + …: the factor at which the eight-chain law begins.
    pub fn stiffening(segments: f64) -> f64 {
        inverse(segments.sqrt().recip()) * segments.sqrt() / 3.0
    }

    /// Returns the fracture energy of strands, J/m²: G₀ = ½ ν b√n N_b U with N_b = nM_K/M_b bonds per
    /// strand (Lake and Thomas 1967, doi:10.1098/rspa.1967.0160); ν in mol/m³, U in J/mol. The factor ½
    /// takes the root mean square length of a strand; other averages give 0.46 to 0.61.
    pub fn fracture_energy(&self, strands: f64, segments: f64, bond_energy: f64) -> f64 {
        let bonds = segments * self.mass / self.bond_mass;
        0.5 * strands * self.length * segments.sqrt() * bonds * bond_energy
    }

    /// Returns the concentration of one end of a strand of molar mass M at its other end, mol/m³:
    /// (3/(2πnb²))^{3/2}/N_A (Gaussian chain; Jacobson and Stockmayer 1950).
    pub(super) fn own_end(&self, strand: f64) -> f64 {
        let square = strand / self.mass * self.length * self.length;
        (1.5 / (std::f64::consts::PI * square)).powf(1.5) / AVOGADRO
    }
}

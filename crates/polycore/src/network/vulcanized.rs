//! Random cross-linking of long chains: vulcanization, peroxides, radiation.

use super::{Error, Melt, PolymerNetwork, SolFractions, positive};
use crate::numerics::bisected;

/// Distribution of the lengths of primary chains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PrimaryChains {
    /// Flory's most probable distribution, as of condensation and of random scission: M_w = 2 M_n.
    MostProbable,
    /// One length, as of anionic polymerization: M_w = M_n.
    OneLength,
}

/// Long chains with cross-links at random places, four arms each.
///
/// ```
/// use polycore::network::{Melt, PrimaryChains, Vulcanized};
///
/// let melt = Melt { entanglement_modulus: 0.35e6, ..Melt::of_polymer("PDMS")? };
/// let [broad, narrow] = [PrimaryChains::MostProbable, PrimaryChains::OneLength]
///     .map(|chains| Vulcanized::new(chains, 100.0, 2.0).network(&melt));
/// assert!((broad?.sol.mass - 0.134).abs() < 1e-3 && (narrow?.sol.mass - 0.203).abs() < 1e-3);
/// # Ok::<(), polycore::network::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vulcanized {
    chains: PrimaryChains,
    mass: f64,
    units: f64,
}

impl Vulcanized {
    /// Creates chains of a number-average molar mass M_n (kg/mol) with x cross-linked units per
    /// number-average chain: two units are one cross-link.
    pub fn new(chains: PrimaryChains, mass: f64, units: f64) -> Self {
        Self { chains, mass, units }
    }

    /// Creates chains whose cross-linked units follow from the sol fraction w: w + √w = 1/x of the most
    /// probable distribution (Charlesby and Pinner 1959, doi:10.1098/rspa.1959.0030), w = exp(−x(1 − w)) of
    /// one length.
    ///
    /// # Errors
    /// A sol fraction outside 0 to 1.
    pub fn with_sol(chains: PrimaryChains, mass: f64, sol: f64) -> Result<Self, Error> {
        if !(sol > 0.0 && sol < 1.0) {
            let (quantity, allowed) = ("sol fraction", "0 to 1, without both");
            return Err(Error::Domain { quantity, value: sol, allowed });
        }
        let units = match chains {
            PrimaryChains::MostProbable => 1.0 / (sol + sol.sqrt()),
            PrimaryChains::OneLength => -sol.ln() / (1.0 - sol),
        };
        Ok(Self { chains, mass, units })
    }

    /// Cross-linked units per number-average chain, x.
    pub fn units(&self) -> f64 {
        self.units
    }

    /// Computes the network: ways along its chain from a cross-link that lead to the gel are 0, 1 or 2; two
    /// chains meet in a junction, whose ways are the convolution; T_e is the square of the carrying share
    /// of the length.
    ///
    /// # Errors
    /// Too few cross-links for a gel (x ≤ 1/2 or 1), numbers outside their range, strands of less than 1.5
    /// Kuhn segments.
    pub fn network(&self, melt: &Melt) -> Result<PolymerNetwork, Error> {
        melt.check()?;
        positive("molar mass of the primary chains", self.mass)?;
        positive("cross-linked units per chain", self.units)?;
        let [none, one, two] = self.ways()?;
        // P_m of a junction, m = 0 to 4
        let of_junction =
            [none * none, 2.0 * none * one, 2.0 * none * two + one * one, 2.0 * one * two, two * two];
        let strands_of = |least: usize| (least..5).map(|m| m as f64 / 2.0 * of_junction[m]).sum::<f64>();
        let per_volume = melt.density * self.units / (2.0 * self.mass);
        let strands = per_volume * strands_of(3);
        let way = none.sqrt();
        PolymerNetwork {
            melt: *melt,
            conversion: [self.units; 2],
            least_conversion: None,
            extinction: [way; 2],
            strands,
            junctions: per_volume * (of_junction[3] + of_junction[4]),
            carrying: two,
            strand_mass: melt.density * two / strands,
            in_series: strands_of(2) / strands_of(3),
            trapped: two * two,
            sol: SolFractions { mass: none, strands: none, linkers: of_junction[0], ends: 0.0 },
        }
        .checked()
    }

    /// Returns the probabilities that 0, 1, 2 ways along its chain from a place lead to the gel; the first
    /// is the sol fraction, too.
    fn ways(&self) -> Result<[f64; 3], Error> {
        let x = self.units;
        let no_gel = |least| Error::NoGel {
            product: "x, cross-linked units per chain",
            value: x,
            least,
            advice: "add cross-links or take longer chains",
        };
        match self.chains {
            PrimaryChains::MostProbable if x <= 0.5 => Err(no_gel(0.5)),
            PrimaryChains::OneLength if x <= 1.0 => Err(no_gel(1.0)),
            PrimaryChains::MostProbable => {
                // along the chain to a finite end: u² + u + 1 = (1 + x)/x
                let u = ((1.0 + x) / x - 0.75).sqrt() - 0.5;
                Ok([u * u, 2.0 * u * (1.0 - u), (1.0 - u) * (1.0 - u)])
            }
            PrimaryChains::OneLength => {
                // g = 1 − exp(−xg), divided by g: falls from x to 1 − exp(−x)
                let gel = bisected(0.0, 1.0, 2000, |gel| -(-x * gel).exp_m1() > gel);
                let sol = 1.0 - gel;
                let one = 2.0 * (1.0 / x - sol);
                Ok([sol, one, gel - one])
            }
        }
    }
}

"""Polymer networks from their chemistry."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from . import _polymech


@dataclass(frozen=True)
class Network:
    """A polymer network. SI units."""

    modulus: float
    """Shear modulus, Pa: stiffening × phantom + entangled."""
    phantom: float
    """Modulus of phantom strands and junctions, Pa."""
    entangled: float
    """Modulus of trapped entanglements, Pa."""
    stiffening: float
    """Factor of Langevin chains of this length on the phantom part."""
    sol: float
    """Sol fraction by mass."""
    conversion: float
    """Conversion of the groups of the cross-linkers; of a vulcanized network its cross-linked units per chain."""
    least_conversion: float | None
    """Lower bound of a conversion from a sol fraction: that without loops."""
    strands: float
    """Effective strands, mol/m³."""
    junctions: float
    """Effective junctions, mol/m³."""
    segments: float
    """Kuhn segments of an effective strand."""
    locking_stretch: float
    """Stretch at which such strands lock, an estimate."""
    fracture_energy: tuple[float, float]
    """Range of the fracture energy of Lake and Thomas, J/m², for 60 and 350 kJ/mol of a bond: an estimate."""


def network(
    functionality: float | Mapping[int, float],
    strand_mass: float,
    *,
    conversion: float | None = None,
    sol_fraction: float | None = None,
    ratio: float = 1.0,
    linker_mass: float = 0.0,
    monofunctional: tuple[float, float] = (0.0, 0.0),
    extracted: bool = False,
    polymer: str = "PDMS",
    density: float | None = None,
    temperature: float = 298.15,
    entanglement_modulus: float | None = None,
    loop_factor: float | None = None,
) -> Network:
    """Computes an end-linked network from its chemistry, by the recursion of Miller and Macosko.

    >>> silicone = network(4, 10.0, conversion=0.95)
    >>> round(silicone.modulus / 1e6, 3), round(silicone.segments, 1)
    (0.261, 27.0)
    >>> network({3: 0.5, 4: 0.5}, 10.0, sol_fraction=0.02, extracted=True).conversion > 0.8
    True

    `functionality` of the cross-linkers: a number, or shares of their groups by functionality; `strand_mass`, `linker_mass` in kg/mol.
    Exactly one of `conversion` (of the groups of the cross-linkers) and `sol_fraction` (measured). `ratio`: groups of the cross-linkers per
    group of the chains. `monofunctional`: share of the groups of the chains that stand on chains with one group, and the molar mass of
    these. `density` (kg/m³) and `entanglement_modulus` (Pa) are those of the polymer where it is known; `loop_factor=0` takes a sol
    fraction as if there were no loops. Raises `ValueError` with the physics, e.g. ``no gel: (f - 1) p_A p_B = 0.75``.
    """
    shares = functionality.items() if isinstance(functionality, Mapping) else [(functionality, 1.0)]
    found = _polymech.network(
        functionality=[(float(f), float(share)) for f, share in shares],
        strand_mass=strand_mass,
        ratio=ratio,
        conversion=conversion,
        sol_fraction=sol_fraction,
        linker_mass=linker_mass,
        ends=monofunctional,
        extracted=extracted,
        polymer=polymer,
        density=density,
        temperature=temperature,
        entanglement_modulus=entanglement_modulus,
        loop_factor=loop_factor,
    )
    return Network(**found)


def vulcanized(
    chains: str,
    mass: float,
    *,
    units: float | None = None,
    sol_fraction: float | None = None,
    extracted: bool = False,
    polymer: str = "PDMS",
    density: float | None = None,
    temperature: float = 298.15,
    entanglement_modulus: float | None = None,
) -> Network:
    """Computes a network of long chains cross-linked at random: by sulphur, peroxide, radiation.

    >>> [round(vulcanized(chains, 100.0, units=2.0).sol, 3) for chains in ("most-probable", "one-length")]
    [0.134, 0.203]

    `chains`: their lengths, ``"most-probable"`` (Flory, M_w = 2 M_n) or ``"one-length"``; `mass`: their M_n, kg/mol. Exactly one of `units`
    (cross-linked units per number-average chain) and `sol_fraction` (measured). The others as in `network`. Raises `ValueError`.
    """
    found = _polymech.vulcanized(
        chains=chains,
        mass=mass,
        units=units,
        sol_fraction=sol_fraction,
        extracted=extracted,
        polymer=polymer,
        density=density,
        temperature=temperature,
        entanglement_modulus=entanglement_modulus,
    )
    return Network(**found)


@dataclass(frozen=True)
class Solvent:
    """A solvent that swells a network to equilibrium, by the law of Flory and Rehner with phantom junctions.

    >>> solvent = Solvent(molar_volume=106e-6, interaction=0.45)
    >>> round(1 / solvent.polymer_fraction(0.2e6), 2)
    5.06
    """

    molar_volume: float
    """Molar volume, m³/mol."""
    interaction: float
    """Interaction parameter χ of polymer and solvent."""

    def polymer_fraction(self, modulus: float, temperature: float = 298.15) -> float:
        """Computes the volume fraction of polymer at equilibrium from the shear modulus of the dry gel, Pa."""
        return _polymech.swollen_fraction(self.molar_volume, self.interaction, modulus, temperature)

    def modulus(self, fraction: float, temperature: float = 298.15) -> float:
        """Computes the shear modulus of the dry gel, Pa, from the volume fraction of polymer at equilibrium."""
        return _polymech.modulus_of_swelling(self.molar_volume, self.interaction, fraction, temperature)

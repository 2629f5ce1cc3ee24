//! Networks from their chemistry: closed forms, counts on random networks, limits, refused compositions.

use std::collections::BTreeMap;

use evidence::{at_most, near};
use polycore::network::{
    EndLinked, Error, KuhnChain, LinkerMix, Melt, PolymerNetwork, PrimaryChains, Reacted, Solvent, Vulcanized,
};
use polycore::table::Table;

/// PDMS of the simulations of formulation-networks.md, section D.
fn melt() -> Melt {
    Melt { entanglement_modulus: 0.235e6, ..Melt::of_polymer("PDMS").unwrap() }
}

/// A melt whose strands need not be chains.
fn beads() -> Melt {
    Melt { chain: None, ..melt() }
}

fn linked(functionality: u32, ratio: f64, conversion: f64) -> Result<PolymerNetwork, Error> {
    EndLinked::new(functionality, 10.0, Reacted::Conversion(conversion)).ratio(ratio).network(&beads())
}

/// f = 3: α = 1/s − 1; f = 4: α = √(1/s − 3/4) − 1/2 with s = p_A p_B; β from the recursion; both satisfy
/// the undivided equation.
#[test]
fn closed_forms_of_three_and_four_groups() {
    let mut worst = 0.0_f64;
    for (ratio, conversion) in [(1.0, 0.75), (1.0, 0.9), (1.0, 1.0), (0.8, 0.95), (1.3, 0.75), (1.42, 0.7)] {
        let s: f64 = ratio * conversion * conversion;
        for (functionality, alpha) in [(3, 1.0 / s - 1.0), (4, (1.0 / s - 0.75).sqrt() - 0.5)] {
            let found = linked(functionality, ratio, conversion).unwrap();
            let beta = 1.0 - ratio * conversion * (1.0 - alpha.powi(functionality as i32 - 1));
            let [a, b] = found.extinction;
            worst = worst.max((a - alpha).abs()).max((b - beta).abs());
            worst = worst.max((a - (1.0 - conversion * (1.0 - b))).abs());
        }
    }
    at_most("network_recursion_against_closed_forms", worst, 2e-15);
}

/// [B₂](1 − β)² = [A_f] Σ_{m≥2} (m/2) P_m: every strand that carries ends at two junctions. The left side
/// gives s̄ν; the right side adds junctions of two ways, P₂ = C(f,2) α^(f−2) (1 − α)², to ν.
#[test]
fn strands_counted_from_both_ends() {
    let mut worst = 0.0_f64;
    for functionality in [3, 4, 5, 8, 40, 300] {
        for (ratio, conversion) in [(1.0, 0.72), (1.0, 0.95), (0.7, 0.999), (2.0, 0.5)] {
            let Ok(found) = linked(functionality, ratio, conversion) else { continue };
            let [alpha, _] = found.extinction;
            let f = f64::from(functionality);
            let linkers = 2.0 * ratio / f * 970.0 / 10.0;
            let pairs = f * (f - 1.0) / 2.0 * alpha.powi(functionality as i32 - 2) * (1.0 - alpha).powi(2);
            let left = found.in_series * found.strands;
            worst = worst.max((left / (found.strands + linkers * pairs) - 1.0).abs());
        }
    }
    at_most("network_strands_from_both_ends", worst, 1e-13);
}

/// A gel above (f − 1) p_A p_B = 1 and none below, one part in a million to either side; there the sol is
/// everything but a trace.
#[test]
fn gel_point() {
    for functionality in [3, 4, 8, 300] {
        for ratio in [1.0, 0.8, 1.1] {
            let critical = (f64::from(functionality - 1) * ratio).sqrt().recip();
            let above = linked(functionality, ratio, critical * (1.0 + 1e-6)).unwrap();
            let [alpha, _] = above.extinction;
            assert!((0.0..1e-4).contains(&(1.0 - alpha)) && above.phantom() >= 0.0, "{above:?}");
            assert!(above.sol.mass < 1.0 && above.sol.mass > 0.99);
            // 1 − α = 2ε·2/(f − 2) to first order: s Σ α^k ≈ s (f − 1)(1 − (1 − α)(f − 2)/2), s = (1 +
            // 2ε)/(f − 1)
            let expected = 4e-6 / f64::from(functionality - 2);
            assert!(((1.0 - alpha) / expected - 1.0).abs() < 1e-3, "{functionality} {alpha}");
            let below = linked(functionality, ratio, critical * (1.0 - 1e-6)).unwrap_err();
            assert!(below.to_string().contains("no gel: (f - 1) p_A p_B = 1.0000"), "{below}");
        }
    }
    let error = linked(3, 1.0, (0.4_f64).sqrt()).unwrap_err().to_string();
    assert!(
        error.starts_with("no gel: (f - 1) p_A p_B = 0.8000, and a network needs more than 1; raise"),
        "{error}"
    );
    // two groups never make a network, nor does one
    for functionality in [1, 2] {
        assert!(matches!(linked(functionality, 1.0, 1.0), Err(Error::NoGel { .. })));
    }
    assert!(matches!(linked(4, 3.1, 1.0 / 3.1), Err(Error::NoGel { .. })), "all strands capped");
    assert!(matches!(linked(4, 0.3, 1.0), Err(Error::NoGel { .. })), "too few cross-linkers");
}

/// Perfect networks: ν = ρ/M, μ = 2ν/f, no sol, all entanglements trapped; fracture energies and lengths of
/// formulation-networks.md, section C, which gives three digits.
#[test]
fn perfect_networks() {
    let silicone = EndLinked::new(4, 10.0, Reacted::Complete).network(&melt()).unwrap();
    let rt = 8.314_462_618_153_24 * 298.15;
    assert_eq!((silicone.extinction, silicone.sol.mass, silicone.trapped), ([0.0, 0.0], 0.0, 1.0));
    assert!((silicone.phantom() / (97.0 / 2.0 * rt) - 1.0).abs() < 1e-12);
    assert!((silicone.affine() / (97.0 * rt) - 1.0).abs() < 1e-12);
    assert!(
        (silicone.phantom_locking_stretch().unwrap() / silicone.locking_stretch().unwrap() - 2_f64.sqrt())
            .abs()
            < 1e-12
    );
    let [low, high] = silicone.fracture_energy().unwrap();
    near("network_pdms_segments", silicone.segments().unwrap(), 26.2, 0.05);
    near("network_pdms_locking_stretch", silicone.locking_stretch().unwrap(), 5.12, 0.005);
    near("network_pdms_fracture_energy_low", low, 5.24, 0.005);
    near("network_pdms_fracture_energy_high", high, 30.6, 0.05);
    let rubber = Melt {
        density: 910.0,
        entanglement_modulus: 0.0,
        chain: Some(KuhnChain::new(0.82e-9, 0.113, 0.017).unwrap()),
        ..melt()
    };
    let rubber = EndLinked::new(3, 5.0, Reacted::Complete).network(&rubber).unwrap();
    let [low, high] = rubber.fracture_energy().unwrap();
    near("network_polyisoprene_segments", rubber.segments().unwrap(), 44.2, 0.05);
    near("network_polyisoprene_fracture_energy_low", low, 8.76, 0.005);
    near("network_polyisoprene_fracture_energy_high", high, 51.1, 0.05);
    // trifunctional: (ν − μ)/ν = 1/3
    assert!((rubber.phantom() / rubber.affine() - 1.0 / 3.0).abs() < 1e-12);
}

/// Kuhn chains: bonds per segment as section B states them, the eight-chain law's first modulus, refusals.
#[test]
fn chains() {
    let [silicone, rubber] = ["silicone", "pi"].map(|name| polycore::network::known_polymer(name).unwrap());
    assert!((silicone.chain.mass / silicone.chain.bond_mass - 10.3).abs() < 0.05);
    assert!((rubber.chain.mass / rubber.chain.bond_mass - 6.6).abs() < 0.05);
    for n in [20.0_f64, 26.0, 100.0] {
        let series = 1.0 + 0.6 / n + 99.0 / (175.0 * n * n);
        assert!((KuhnChain::stiffening(n) - series).abs() < 1.0 / n.powi(3), "{n}");
        let law = polycore::constitutive::hyperelastic::model("eight-chain").unwrap().law(&[1.0, n]).unwrap();
        assert!((KuhnChain::stiffening(n) / law.shear_modulus() - 1.0).abs() < 1e-9, "{n}");
    }
    let short = EndLinked::new(4, 0.5, Reacted::Complete).network(&melt()).unwrap_err();
    assert!(short.to_string().starts_with("1.312 Kuhn segments between junctions: too few"), "{short}");
    let unknown = Melt::of_polymer("PDMZ").unwrap_err().to_string();
    assert!(unknown.starts_with("unknown polymer `PDMZ`; known: PDMS, polyisoprene,"), "{unknown}");
    let missing = Melt::of_polymer("PEO").unwrap_err().to_string();
    assert_eq!(missing, "the density of PEO is not in the table; give it");
}

/// Parameters of a case of the counts: `f 4 r 1 p 0.9 b1 0.2`, `random Flory x 2`.
fn structure(case: &str) -> BTreeMap<&'static str, f64> {
    let words: Vec<&str> = case.split(' ').collect();
    let number = |i: usize| words[i].parse::<f64>().unwrap();
    if words[0] == "random" {
        let chains = if words[1] == "Flory" { PrimaryChains::MostProbable } else { PrimaryChains::OneLength };
        let units = number(words.len() - 1);
        let found = Vulcanized::new(chains, 100.0, units).network(&beads()).unwrap();
        let junctions = 970.0 * units / 200.0;
        return BTreeMap::from([
            ("sol", found.sol.mass),
            ("carrying", found.carrying),
            ("nu", found.strands / junctions),
            ("mu", found.junctions / junctions),
            ("in_series", found.in_series),
        ]);
    }
    let shares: Vec<(u32, f64)> = words[1]
        .split('+')
        .map(|part| part.split_once(':').unwrap_or((part, "1")))
        .map(|(f, share)| (f.parse().unwrap(), share.parse().unwrap()))
        .collect();
    let (ratio, conversion, ends) = (number(3), number(5), number(7));
    // ends without mass: the share of strands in the chains is 1, as the counts have no mass
    let recipe = EndLinked::new(4, 10.0, Reacted::Conversion(conversion))
        .linkers(LinkerMix::new(&shares).unwrap())
        .ratio(ratio)
        .ends(ends, 0.0);
    let found = recipe.network(&beads()).unwrap();
    let strands = 970.0 / 10.0;
    BTreeMap::from([
        ("sol_strand", found.sol.strands),
        ("sol_linker", found.sol.linkers),
        ("sol_B1", found.sol.ends),
        ("carrying", found.carrying),
        ("nu", found.strands / strands),
        ("mu", found.junctions / strands),
        ("in_series", found.in_series),
        ("in_series_square", found.in_series_square()),
        ("trapped", found.trapped),
    ])
}

/// All counts of random networks: f = 3, 4, 8, mixtures, chains with one group, both kinds of
/// vulcanization. 144 deviations of a normal distribution in standard errors: rms 1 ± 0.06, the largest
/// about 2.8; three beyond 2.0 and none beyond 3.0 are expected 6.6 and 0.4 times. The formulas of the
/// reference, six digits.
#[test]
fn counts_on_random_networks() {
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/networks_counted.csv");
    let table = Table::read(file).unwrap();
    let column = |name| table.require_column(&[name]).unwrap();
    let [case, quantity] = [column("case"), column("quantity")];
    let [formula, counted, error] = [column("formula"), column("monte_carlo"), column("standard_error")];
    let (mut squares, mut largest, mut apart, mut rows) = (0.0, 0.0_f64, 0.0_f64, 0);
    for row in 0..table.rows() {
        let found = structure(table.text(row, case))[table.text(row, quantity)];
        let number = |column| table.number(row, column).unwrap();
        let deviation = (found - number(counted)) / number(error);
        squares += deviation * deviation;
        largest = largest.max(deviation.abs());
        apart = apart.max((found / number(formula) - 1.0).abs());
        rows += 1;
    }
    assert_eq!(rows, 144);
    near("network_counts_rms_in_standard_errors", (squares / f64::from(rows)).sqrt(), 1.0, 0.2);
    at_most("network_counts_largest_in_standard_errors", largest, 3.0);
    at_most("network_formulas_against_reference", apart, 5e-6);
}

/// The example of section A: f = 4, r = 1.42, p_A = 0.605.
#[test]
fn example_of_the_formulation() {
    let found = linked(4, 1.42, 0.605).unwrap();
    for (value, reference) in [
        (found.sol.strands, 0.09708),
        (found.strands / 97.0, 0.22232),
        (found.junctions / 97.0, 0.14109),
        (found.in_series, 2.1317),
        (found.trapped, 0.22461),
    ] {
        assert!((value / reference - 1.0).abs() < 5e-5, "{value} {reference}");
    }
}

/// Conversion from the sol fraction and back, over compositions with mass everywhere; without loops the
/// tree's conversion, with loops a larger one that the tree's bounds from below.
#[test]
fn sol_fraction_both_ways() {
    let mut worst = 0.0_f64;
    for functionality in [3, 4, 8] {
        for ratio in [0.8, 1.0, 1.4] {
            for share in [0.05, 0.3, 0.8] {
                let largest = 1.0_f64.min(1.0 / ratio);
                let critical = (f64::from(functionality - 1) * ratio * 0.95).sqrt().recip();
                let conversion = critical + share * (largest - critical);
                let recipe = |reacted| {
                    EndLinked::new(functionality, 10.0, reacted).ratio(ratio).linker_mass(0.4).ends(0.05, 4.0)
                };
                let given = recipe(Reacted::Conversion(conversion)).network(&melt()).unwrap();
                let sol = Reacted::SolFraction(given.sol.mass);
                let back = recipe(sol).loop_factor(0.0).network(&melt()).unwrap();
                worst = worst.max((back.conversion[0] - conversion).abs());
                assert_eq!(back.least_conversion, Some(back.conversion[0]));
                let loops = recipe(sol).network(&melt()).unwrap();
                assert!(loops.conversion[0] > back.conversion[0] && loops.conversion[0] <= largest);
                assert!(loops.modulus() > back.modulus());
                assert!((loops.least_conversion.unwrap() - back.conversion[0]).abs() < 1e-15);
            }
        }
    }
    at_most("network_conversion_from_sol_and_back", worst, 1e-12);
    let sol = |sol| EndLinked::new(4, 10.8, Reacted::SolFraction(sol)).ratio(0.836).network(&melt());
    let error = sol(0.0239).unwrap_err().to_string();
    assert!(
        error.starts_with(
            "sol fraction 0.0239: with r = 0.836 at least 0.0282 stays soluble (at p_A = 1.0000, the largest)"
        ),
        "{error}"
    );
    assert!(matches!(sol(1.0), Err(Error::Domain { .. })) && matches!(sol(-0.1), Err(Error::Domain { .. })));
    for chains in [PrimaryChains::MostProbable, PrimaryChains::OneLength] {
        for units in [1.2, 2.0, 10.0] {
            let sol = Vulcanized::new(chains, 100.0, units).network(&melt()).unwrap().sol.mass;
            let back = Vulcanized::with_sol(chains, 100.0, sol).unwrap().units();
            assert!((back / units - 1.0).abs() < 1e-9, "{chains:?} {units} {back}");
        }
        assert!(Vulcanized::with_sol(chains, 100.0, 0.0).is_err());
    }
}

/// Extraction: phantom part × (1 − w)^(−1/3), entangled × (1 − w)^(−2), locking stretch × (1 − w)^(−1/3).
#[test]
fn extraction() {
    let recipe = EndLinked::new(4, 7.56935, Reacted::Conversion(0.605)).ratio(1.42);
    let [left, taken] = [melt(), melt().extracted()].map(|melt| recipe.network(&melt).unwrap());
    let rest = 1.0 - left.sol.mass;
    for (ratio, power) in [
        (taken.phantom() / left.phantom(), -1.0 / 3.0),
        (taken.affine() / left.affine(), -1.0 / 3.0),
        (taken.entangled() / left.entangled(), -2.0),
        (taken.locking_stretch().unwrap() / left.locking_stretch().unwrap(), -1.0 / 3.0),
        (taken.fracture_energy().unwrap()[0] / left.fracture_energy().unwrap()[0], -2.0 / 3.0),
    ] {
        assert!((ratio / rest.powf(power) - 1.0).abs() < 1e-12, "{power}");
    }
}

/// Vulcanization of the most probable distribution is the recursion of f = 4 with p_A p_B → x/(1 + x); gel
/// points at x = 1/2 and 1; the two distributions differ as section A states.
#[test]
fn vulcanization() {
    let of = |chains, units| Vulcanized::new(chains, 100.0, units).network(&melt());
    for units in [0.6, 2.0, 50.0_f64] {
        let found = of(PrimaryChains::MostProbable, units).unwrap();
        let conversion = (units / (1.0 + units)).sqrt();
        let linked = linked(4, 1.0, conversion).unwrap();
        let [u, _] = found.extinction;
        assert!((u - linked.extinction[0]).abs() < 1e-12, "{units}");
        assert!((found.junctions / found.strands - linked.junctions / linked.strands).abs() < 1e-12);
        // Charlesby and Pinner
        let sol = found.sol.mass;
        assert!((sol + sol.sqrt() - 1.0 / units).abs() < 1e-12);
    }
    for (chains, critical) in [(PrimaryChains::MostProbable, 0.5), (PrimaryChains::OneLength, 1.0)] {
        let above = of(chains, critical * (1.0 + 1e-6)).unwrap();
        assert!(above.sol.mass > 0.999_99 && above.sol.mass < 1.0, "{above:?}");
        let below = of(chains, critical).unwrap_err().to_string();
        assert!(below.starts_with("no gel: x, cross-linked units per chain = "), "{below}");
        assert!(below.contains(&format!("more than {critical}")), "{below}");
    }
    let per_junction = |chains| {
        let found = of(chains, 2.0).unwrap();
        (found.sol.mass, found.strands / (970.0 * 2.0 / 200.0))
    };
    let (broad, narrow) = (per_junction(PrimaryChains::MostProbable), per_junction(PrimaryChains::OneLength));
    assert!((broad.0 - 0.134).abs() < 5e-4 && (broad.1 - 0.883).abs() < 5e-4, "{broad:?}");
    assert!((narrow.0 - 0.203).abs() < 5e-4 && (narrow.1 - 0.444).abs() < 5e-4, "{narrow:?}");
}

/// Extremes stay finite, and numbers without a meaning are refused with their name.
#[test]
fn extremes_and_refusals() {
    for (functionality, ratio, conversion) in [
        (300, 1.0, 1.0),
        (300, 1.0, 0.06),
        (300, 200.0, 0.005),
        (300, 0.01, 1.0),
        (1000, 1.0, 0.5),
        (3, 1.0, 1.0),
    ] {
        let found = linked(functionality, ratio, conversion).unwrap();
        let numbers =
            [found.phantom(), found.entangled(), found.modulus(), found.in_series, found.strand_mass];
        assert!(numbers.iter().all(|x| x.is_finite() && *x > 0.0), "{functionality} {ratio}: {numbers:?}");
        assert!((0.0..1.0).contains(&found.sol.mass));
    }
    let refused = [
        (linked(4, 0.0, 0.9), "ratio r of groups A to groups B = 0 is outside positive numbers"),
        (linked(4, f64::NAN, 0.9), "ratio r"),
        (
            linked(4, 1.0, 1.2),
            "conversion p_A = 1.2 with r = 1: p_B = r p_A = 1.2000 is above 1; p_A is at most 1.0000",
        ),
        (linked(4, 1.25, 0.9), "p_B = r p_A = 1.1250 is above 1; p_A is at most 0.8000"),
        (linked(4, 1.0, 0.0), "conversion p_A = 0"),
        (linked(1001, 1.0, 0.9), "functionality = 1001 is outside 1 to 1000"),
        (linked(0, 1.0, 0.9), "functionality = 0"),
        (EndLinked::new(4, -1.0, Reacted::Complete).network(&beads()), "molar mass of the strands = -1"),
        (EndLinked::new(4, 10.0, Reacted::Complete).ends(1.0, 5.0).network(&beads()), "with one group = 1"),
        (
            EndLinked::new(4, 10.0, Reacted::Complete).linker_mass(-0.1).network(&beads()),
            "cross-linkers = -0.1",
        ),
        (Vulcanized::new(PrimaryChains::OneLength, 0.0, 2.0).network(&beads()), "primary chains = 0"),
        (
            EndLinked::new(4, 10.0, Reacted::Complete).network(&Melt { density: -1.0, ..beads() }),
            "density = -1",
        ),
    ];
    for (found, message) in refused {
        let error = found.unwrap_err().to_string();
        assert!(error.contains(message), "{error}\n{message}");
    }
    assert!(LinkerMix::new(&[]).is_err() && LinkerMix::new(&[(4, 0.0)]).is_err());
    // 5.1 groups on average: nine of ten cross-linkers have five, and the groups are counted, not the
    // linkers
    let mean = LinkerMix::mean(5.1).unwrap();
    assert!((mean.per_group() - 1.0 / 5.1).abs() < 1e-15 && mean.shares()[0].0 == 5);
    assert!((mean.shares()[1].1 - 6.0 * 0.1 / 5.1).abs() < 1e-12);
}

/// Roots of the law of Flory and Rehner by SciPy's `brentq`, and φ^(5/3) = V₁G/(RT(½ − χ)) of soft gels.
#[test]
fn swelling_to_equilibrium() {
    let volume = 106e-6;
    for (interaction, modulus, root) in [
        (0.0, 0.2e6, 0.08408379307820563),
        (0.45, 0.2e6, 0.19766153567491457),
        (1.2, 0.2e6, 0.7822618095095174),
    ] {
        let solvent = Solvent::new(volume, interaction).unwrap();
        let found = solvent.polymer_fraction(modulus, 298.15).unwrap();
        near("swelling_against_scipy", found, root, 1e-9);
        let back = solvent.modulus(found, 298.15).unwrap() / modulus;
        near("swelling_back_to_the_modulus", back, 1.0, 1e-9);
    }
    let soft = Solvent::new(volume, 0.3).unwrap().polymer_fraction(1e-3, 298.15).unwrap();
    let leading = (volume * 1e-3 / (8.314462618 * 298.15) / (0.5 - 0.3)).powf(0.6);
    near("swelling_of_a_soft_gel", soft / leading, 1.0, 1e-3);
    // the series of small φ meets the logarithm
    let solvent = Solvent::new(volume, 0.45).unwrap();
    let [below, above] =
        [0.999_999e-3, 1.000_001e-3].map(|fraction| solvent.modulus(fraction, 298.15).unwrap());
    near("swelling_series", below / above, 1.0, 1e-5);

    // a poor solvent: φ cannot be as small, whatever the network
    assert!(Solvent::new(volume, 1.2).unwrap().modulus(0.3, 298.15).is_err());
    assert!(Solvent::new(0.0, 0.4).is_err() && Solvent::new(volume, f64::NAN).is_err());
    assert!(solvent.polymer_fraction(-1.0, 298.15).is_err() && solvent.modulus(1.0, 298.15).is_err());
}

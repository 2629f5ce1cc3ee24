//! A shared check over all laws, and the figures of formulation.md.

use super::*;

fn laws(links: f64, dissociation: f64) -> Vec<(String, Box<dyn BondPotential>)> {
    Law::ALL
        .iter()
        .flat_map(|law| [false, true].map(|rescale| (law, rescale)))
        .map(|(law, rescale)| {
            (format!("{}, rescale {rescale}", law.name()), law.build(links, dissociation, rescale).unwrap())
        })
        .collect()
}

/// Checks energy → force → tangent by finite differences, the reference state, and finite values everywhere.
#[test]
fn every_law() {
    for (links, dissociation) in [(720.0, 1200.0), (100.0, 2300.0), (8.0, 50.0)] {
        for (name, law) in laws(links, dissociation) {
            for stretch in [0.2, 0.5, 0.9, 0.999, 1.001, 1.1, 1.5, 2.0, 3.0, 5.0, 20.0] {
                // central differences: truncation h²/6 of the third derivative, rounding ε/h of values up to
                // ~n̄
                let h = 1e-5 * stretch;
                let slope = |f: &dyn Fn(f64) -> f64| (f(stretch + h) - f(stretch - h)) / (2.0 * h);
                let (t, k) = (law.tension(stretch), law.tension_derivative(stretch));
                let force = slope(&|l| law.energy(l));
                let tangent = slope(&|l| law.tension(l));
                let scale = t.abs().max(k.abs()).max(1.0);
                assert!((force - t).abs() < 1e-6 * scale, "{name} at {stretch}: {force} is not {t}");
                assert!((tangent - k).abs() < 1e-6 * scale, "{name} at {stretch}: {tangent} is not {k}");
            }
            assert_eq!(law.energy(1.0), 0.0, "{name}");
            assert_eq!(law.is_stress_free(), law.tension(1.0).abs() < 1e-14, "{name}");
            if name.ends_with("true") {
                assert!((law.tangent() - 3.0).abs() < 1e-12, "{name}: {}", law.tangent());
            }
        }
    }
}

#[test]
fn signs_and_small_strains() {
    for (links, dissociation) in [(720.0, 1200.0), (100.0, 2300.0), (2.0, 20.0), (2.0, 1e9), (1e6, 1e9)] {
        for (name, law) in laws(links, dissociation).iter().filter(|(_, law)| law.is_stress_free()) {
            // below the greatest force of the softest chain, λ̄* = 3.3
            for stretch in [0.2, 0.5, 0.9, 0.999, 1.001, 1.1, 2.0, 3.0] {
                assert!(law.tension(stretch) * (stretch - 1.0) > 0.0, "{name} {stretch}");
                assert!(law.energy(stretch) > 0.0, "{name} {stretch}");
            }
            // t = K s(1 + O(s)) and ∫t = K s²/2 (1 + O(s)), coefficients below 10
            let tangent = law.tangent();
            for strain in [1e-9, -1e-9] {
                assert!((law.tension_at_strain(strain) / (tangent * strain) - 1.0).abs() < 1e-8, "{name}");
                let rounded = 1.0 + strain - 1.0;
                let energy = 0.5 * tangent * rounded * rounded;
                assert!((law.energy(1.0 + strain) / energy - 1.0).abs() < 1e-8, "{name}");
            }
            // the same law by strain and by stretch
            for stretch in [0.3, 0.97, 1.002, 1.2, 2.9] {
                let (a, b) = (law.tension(stretch), law.tension_at_strain(stretch - 1.0));
                assert!((a - b).abs() <= 1e-14 * a.abs(), "{name} {stretch}");
            }
        }
    }
}

#[test]
fn limits_at_zero_and_infinity() {
    for (links, dissociation) in [(1.0, 1.0), (2.0, 1.0), (720.0, 1200.0), (2.0, 1e9), (1e6, 1e9)] {
        for (name, law) in laws(links, dissociation) {
            for stretch in
                [0.0, 5e-324, 1e-300, 1e-200, 1e-100, 1e-20, 1e10, 1e76, 1e101, 1e160, 1e300, f64::MAX]
            {
                let values = [law.tension(stretch), law.tension_derivative(stretch), law.energy(stretch)];
                assert!(values.iter().all(|value| !value.is_nan()), "{name} {stretch}: {values:?}");
            }
            assert!(law.tension(f64::NAN).is_nan() && law.energy(f64::NAN).is_nan(), "{name}");
            assert!(
                !law.tension(f64::INFINITY).is_nan() && law.energy(f64::INFINITY).is_infinite(),
                "{name}"
            );
        }
        let get = |law: Law| law.build(links, dissociation, false).unwrap();
        let at_rest = Chain::new(links, dissociation).unwrap().stretched(1.0).force;
        assert_eq!(get(Law::ChainOffset).tension(0.0), -at_rest);
        assert_eq!(get(Law::ChainShifted).tension(0.0), -at_rest);
        assert_eq!(get(Law::ChainShifted).tangent(), 3.0);
        assert_eq!(get(Law::ChainAffine).tension(0.0), f64::NEG_INFINITY);
        assert_eq!(get(Law::AsPublished).tension(0.0), 0.0);
        assert_eq!(get(Law::Linear).tension(0.0), -3.0);
        // the final scission of a chain: no force is left
        assert_eq!(get(Law::ChainAffine).tension(f64::INFINITY), 0.0);
        assert_eq!(get(Law::AsPublished).tension(f64::INFINITY), 0.0);
    }
}

/// The reference state of (2.47) is in tension at every stretch down to a point, against the limit (2.70).
#[test]
fn printed_law_never_rests() {
    let printed = Law::AsPublished.build(720.0, 1200.0, false).unwrap();
    assert!(!printed.is_stress_free());
    assert!((1..=100).all(|k| printed.tension(0.01 * f64::from(k)) > 0.0));
}

/// Compares (2.61)–(2.65) with the second derivatives of (2.39), keeping n̄ where (2.67) and (2.69) lose it,
/// with the closed form; and the value that (2.72) takes from λ̄ = λ_b = 1, β → 0: 3 − 9/(n̄D̂ + 3), printed
/// as 3 − 9/(D̂ + 3).
#[test]
fn tangent_with_the_links_on_the_bond_energy() {
    use polycore::langevin;
    let (n, d) = (720.0f64, 1200.0);
    // with β′ = ∂β/∂x: ∂β/∂λ̄ = β′/(√n̄ λ_b), ∂β/∂λ_b = −β′x/λ_b
    let tangent = |stretch: f64, link: f64, beta: f64, slope: f64, links_on_bond_energy: f64| {
        let root = n.sqrt();
        let x = stretch / (link * root);
        let mixed = -root / (link * link) * (beta + x * slope);
        let own = links_on_bond_energy * d * (1.0 - link.ln()) / (link * link)
            + root * stretch * (slope * x + 2.0 * beta) / link.powi(3);
        slope / (link * link) - mixed * mixed / own
    };
    let chain = Chain::new(n, d).unwrap();
    for stretch in [0.5, 1.0, 3.0, 20.0, 26.8, 27.5, 40.0] {
        let (point, beta) = (chain.stretched(stretch), chain.beta(stretch));
        let full = tangent(stretch, point.link_stretch, beta, 1.0 / langevin::derivative(beta), n);
        // rounding, amplified by β′ = 1/(1 − x)² near locking
        assert!((full / point.stiffness - 1.0).abs() < 1e-9, "{stretch}");
    }
    let correction = 3.0 - tangent(1.0, 1.0, 0.0, 3.0, n);
    evidence::near("correction of (2.72) with n̄, 9/(n̄D̂ + 3)", correction, 9.0 / (n * d + 3.0), 1e-14);
    assert!((tangent(1.0, 1.0, 0.0, 3.0, 1.0) - (3.0 - 9.0 / (d + 3.0))).abs() < 1e-14);
}

/// 𝓛⁻¹(x) ≈ x(3 − x²)/(1 − x²) (Cohen 1991, doi:10.1007/BF00366640), as the thesis uses it: 4.9 %.
#[test]
fn error_of_cohens_approximant() {
    let error = |x: f64| (x * (3.0 - x * x) / (1.0 - x * x) / polycore::langevin::inverse(x) - 1.0).abs();
    let largest = (1..10_000).map(|k| error(1e-4 * f64::from(k))).fold(0.0, f64::max);
    evidence::near("error of Cohen's approximant", largest, 0.049, 0.0005);
}

/// The stiffest and softest parameters give finite forces from stretch 1e-3 to 1e6.
#[test]
fn extreme_parameters_stay_finite() {
    for links in [2.0, 720.0, 1e6] {
        for dissociation in [1.0, 1200.0, 1e9] {
            for (name, law) in laws(links, dissociation) {
                for stretch in [1e-3, 0.1, 1.0, 10.0, 1e3, 1e6] {
                    let values = [law.tension(stretch), law.tension_derivative(stretch), law.energy(stretch)];
                    assert!(
                        values.iter().all(|v| v.is_finite()),
                        "{name} {links} {dissociation} {stretch}: {values:?}"
                    );
                }
            }
        }
    }
}

/// Checks the parametric solution against the implicit relation (2.45): D̂ ln(λ_b) λ_b = λ̄β/√n̄.
#[test]
fn satisfies_the_implicit_relation() {
    for (links, dissociation) in [(720.0, 1200.0), (12.5, 2300.0), (2.0, 1.0)] {
        let chain = Chain::new(links, dissociation).unwrap();
        for share in [0.05, 0.3, 0.7, 0.95, 1.0, 1.05, 1.2, 1.5, 2.7, 10.0] {
            let stretch = share * links.sqrt();
            let beta = chain.beta(stretch);
            let point = chain.state_at(beta);
            assert!(
                (point.stretch / stretch - 1.0).abs() < 1e-13,
                "{share}: {}",
                point.stretch / stretch - 1.0
            );
            let (left, right) = (
                dissociation * point.link_stretch.ln() * point.link_stretch,
                point.stretch / links.sqrt() * beta,
            );
            assert!((left / right - 1.0).abs() < 1e-9 || left.abs() < 1e-9, "{share}: {left} {right}");
        }
    }
}

/// Compares with formulation.md: the force maximum, 1e-9 relative to the closed form; its printed digits.
#[test]
fn greatest_force() {
    for (dissociation, printed) in
        [(1200.0, [2.716018, 2.713754, 441.82336]), (2300.0, [2.717100, 2.715919, 846.49067])]
    {
        let links = 720.0;
        let top = Chain::new(links, dissociation).unwrap().strongest();
        let d: f64 = dissociation;
        let link = (1.0 - 1.0 / d).exp();
        let exact = [link, (1.0 - 1.0 / d) * link, d / link];
        let found = [top.link_stretch, top.stretch / links.sqrt(), top.force / links.sqrt()];
        for k in 0..3 {
            assert!((found[k] / exact[k] - 1.0).abs() < 1e-9, "{found:?} {exact:?}");
            assert!((found[k] / printed[k] - 1.0).abs() < 1e-6, "{found:?} {printed:?}");
        }
    }
}

/// Compares with formulation.md: T(1), the tangents at rest and the values of `chain-offset` and
/// `chain-affine`.
#[test]
fn values_of_the_formulation() {
    let chain = Chain::new(720.0, 1200.0).unwrap();
    let at_rest = chain.stretched(1.0).force;
    evidence::near("tension at rest as printed, n̄ = 720, over kθ", at_rest, 3.002_482_393_209_98, 1e-13);
    assert!((chain.stretched(1.0).force - 3.00248239).abs() < 5e-9);
    assert!((Chain::new(100.0, 1200.0).unwrap().stretched(1.0).force - 3.018019).abs() < 5e-7);
    let subtract = Law::ChainOffset.build(720.0, 1200.0, false).unwrap();
    // mpmath with 40 digits; formulation.md prints 3.00745365, one unit of its last digit off
    assert!((subtract.tangent() - 3.007_453_641_930_24).abs() < 1e-12, "{}", subtract.tangent());
    assert!((subtract.tangent() - 3.00745365).abs() < 1e-8);
    // the expansion 3 + 27/(5n̄) − 36/(n̄D̂) leaves terms of order n̄⁻²
    assert!((subtract.tangent() - (3.0 + 27.0 / 3600.0 - 36.0 / 864_000.0)).abs() < 30.0 / (720.0 * 720.0));
    assert!((Law::ChainShifted.build(720.0, 1200.0, false).unwrap().tangent() - 3.0).abs() < 1e-9);
    let network = Law::ChainAffine.build(720.0, 1200.0, false).unwrap();
    assert!((network.tangent() - 1.334437).abs() < 1e-6, "{}", network.tangent());
    assert!((network.tangent() - 4.0 / 9.0 * chain.stretched(1.0).force).abs() < 1e-12);
    let stretches = [0.5, 1.2, 2.0, 2.9442];
    for (law, expected) in [
        (&subtract, [-1.502172, 0.601810, 3.017455, 5.894111]),
        (&network, [-1.588965, 0.216649, 0.630618, 0.846484]),
    ] {
        for (stretch, expected) in stretches.iter().zip(expected) {
            let found = law.tension(*stretch);
            assert!((found - expected).abs() < 1e-5, "{stretch}: {found} against {expected}");
        }
    }
    // `chain-offset` stays within 1 % of a linear bond up to l = 3
    for stretch in [0.5, 1.5, 2.0, 3.0] {
        let linear = subtract.tangent() * (stretch - 1.0);
        assert!((subtract.tension(stretch) / linear - 1.0).abs() < 0.01, "{stretch}");
    }
}

/// Compares with formulation.md, "Max relative error of a table" (n̄ = 720, D̂ = 1200, λ̄ 0.3 … 1.25√n̄). Its
/// figures have one or two digits and depend on the sampling: within 30 % here.
#[test]
fn interpolation_errors_of_the_formulation() {
    let chain = Chain::new(720.0, 1200.0).unwrap();
    let (low, high) = (0.3, 1.25 * 720.0_f64.sqrt());
    let samples: Vec<ChainPoint> = (0..=8000)
        .map(|k| if k % 2 == 0 { f64::from(k) / 8000.0 } else { 0.75 + 0.1 * f64::from(k) / 8000.0 })
        .map(|s| chain.stretched(low + (high - low) * s))
        .collect();
    let uniform = |n: usize| -> Vec<ChainPoint> {
        (0..n).map(|k| chain.stretched(low + (high - low) * k as f64 / (n - 1) as f64)).collect()
    };
    let graded = |n: usize| -> Vec<ChainPoint> {
        let (from, to) = (chain.beta(low).asinh(), chain.beta(high).asinh());
        (0..n).map(|k| chain.state_at((from + (to - from) * k as f64 / (n - 1) as f64).sinh())).collect()
    };
    let worst = |nodes: &[ChainPoint], cubic: bool| -> f64 {
        samples
            .iter()
            .map(|p| {
                let k = nodes.partition_point(|n| n.stretch <= p.stretch).clamp(1, nodes.len() - 1);
                let (a, b) = (&nodes[k - 1], &nodes[k]);
                let w = b.stretch - a.stretch;
                let s = (p.stretch - a.stretch) / w;
                let r = 1.0 - s;
                let value = if cubic {
                    (1.0 + 2.0 * s) * r * r * a.force
                        + s * r * r * w * a.stiffness
                        + s * s * (3.0 - 2.0 * s) * b.force
                        - s * s * r * w * b.stiffness
                } else {
                    r * a.force + s * b.force
                };
                (value / p.force - 1.0).abs()
            })
            .fold(0.0, f64::max)
    };
    for (n, linear, cubic, asinh) in
        [(200, 1.6e-3, 1.2e-6, 6e-8), (1000, 6.4e-5, 1.8e-9, 9e-11), (2000, 1.6e-5, 1.1e-10, 6e-12)]
    {
        let found = [worst(&uniform(n), false), worst(&uniform(n), true), worst(&graded(n), true)];
        for (f, e) in found.iter().zip([linear, cubic, asinh]) {
            assert!(*f < 1.3 * e && *f > 0.7 * e, "N = {n}: {found:?} against {:?}", [linear, cubic, asinh]);
        }
    }
    let linear = worst(&uniform(200), false);
    evidence::within("error of the linear table, 200 nodes", linear, 0.7 * 1.6e-3, 1.3 * 1.6e-3);
}

/// Every law on every common range of scenes meets the default bound, by a form no dearer than stated; the
/// fit reports its form correctly.
#[test]
fn fits_meet_their_bound() {
    for (name, law) in laws(720.0, 1200.0) {
        for (range, cost) in [
            ([0.98, 1.02], 6),
            ([0.95, 1.05], 8),
            ([0.9, 1.1], 10),
            ([0.8, 1.25], 13),
            ([0.7, 1.5], 15),
            ([0.5, 2.0], 18),
            ([0.5, 3.0], 20),
            ([0.4, 3.0], 22),
            ([0.3, 3.0], 22),
            ([0.3, 4.0], 26),
            ([0.05, 6.0], 26),
        ] {
            let start = std::time::Instant::now();
            let fit = KernelFit::new(&*law, range, 1e-9).unwrap();
            let ms = start.elapsed().as_secs_f64() * 1e3;
            let kind = fit.kind();
            println!(
                "{name:28} {range:?} {kind} cost {} error {:.1e}, {ms:.1} ms",
                fit.cost(),
                fit.max_error
            );
            assert!(fit.cost() <= cost, "{name} {range:?} {kind}");
            // no ratio of this size suffices only if bonds are crushed to a twentieth
            assert!(range[0] < 0.3 || fit.cost() > 0, "{name} {range:?} {kind}");
            check_fit(&fit, &*law, 1e-9, &format!("{name} {range:?} {kind}"));
        }
    }
}

/// Checks a fit between the points at which it was measured.
fn check_fit(fit: &KernelFit, law: &dyn BondPotential, bound: f64, name: &str) {
    let [low, high] = fit.range;
    assert!(fit.max_error <= bound, "{name}: {:e}", fit.max_error);
    for k in 0..1000 {
        let stretch = low + (high - low) * (f64::from(k) + 0.37) / 1000.0;
        let e = (stretch - 1.0) * (stretch + 1.0);
        let exact = law.tension(stretch) / stretch;
        // 4097 points do not hit every extremum, and the law itself carries some rounding
        let limit = (1.05 * fit.max_error + 5e-14) * exact.abs();
        assert!(
            (fit.value(e) - exact).abs() <= limit,
            "{name} at {stretch}: {:e}",
            fit.value(e) / exact - 1.0
        );
    }
    if law.is_stress_free() && low < 1.0 && high > 1.0 {
        assert_eq!(fit.value(0.0), 0.0, "{name}");
        // relative, also where the force vanishes
        for e in [1e-15_f64, -1e-12, 1e-9, -1e-6] {
            let exact = law.tension_at_strain(e / (1.0 + (1.0 + e).sqrt())) / (1.0 + e).sqrt();
            assert!((fit.value(e) / exact - 1.0).abs() <= 1.05 * fit.max_error + 5e-14, "{name} at e = {e}");
        }
    }
}

#[test]
fn extreme_laws_are_fitted() {
    for (links, dissociation) in [(2.0, 20.0), (2.0, 1e9), (12.5, 1200.0), (1e6, 1e9)] {
        for (name, law) in laws(links, dissociation) {
            for (range, bound) in
                [([0.98, 1.02], 1e-12), ([0.5, 3.0], 1e-6), ([0.05, 1.5], 1e-9), ([1.5, 2.5], 1e-9)]
            {
                let name = format!("{name}, n̄ = {links}, D̂ = {dissociation}, {range:?}");
                let fit =
                    KernelFit::new(&*law, range, bound).unwrap_or_else(|error| panic!("{name}: {error}"));
                check_fit(&fit, &*law, bound, &format!("{name}: {}", fit.kind()));
            }
        }
    }
}

/// A bond without tension has no force to fit relative to.
#[test]
fn a_slack_law_is_refused() {
    struct Slack;
    impl BondPotential for Slack {
        fn tension(&self, _: f64) -> f64 {
            0.0
        }
        fn tension_derivative(&self, _: f64) -> f64 {
            0.0
        }
        fn energy(&self, _: f64) -> f64 {
            0.0
        }
    }
    assert!(KernelFit::new(&Slack, [0.9, 1.1], 1e-9).is_err());
}

#[test]
fn absurd_ranges_and_bounds_are_refused() {
    let law = Law::Linear.build(0.0, 0.0, false).unwrap();
    for range in [[1.1, 0.9], [0.0, 1.0], [0.5, f64::INFINITY], [f64::NAN, 2.0]] {
        assert!(KernelFit::new(&*law, range, 1e-9).is_err(), "{range:?}");
    }
    assert!(KernelFit::new(&*law, [0.5, 2.0], 0.0).is_err());
    assert!(
        Law::ChainOffset.build(0.5, 1200.0, false).is_err()
            && Law::ChainAffine.build(720.0, f64::NAN, false).is_err()
    );
    for bound in [0.0, -1e-9, f64::NAN] {
        assert!(KernelFit::new(&*law, [0.9, 1.1], bound).is_err(), "{bound}");
    }
}

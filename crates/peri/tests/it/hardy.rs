//! Stress measures with weights that sum to 1: patch test up to free edges, complete distribution of bonds,
//! balance of momentum, and reference definitions.

use crate::bodies::{Body, BondPair, Built, MODULUS, Random, fit, norm, scatter, stretch_range};
use peri::bonds::{BodyGeometry, BondDamage, BondForces, Overstretched};
use peri::geometry::{Operation, Shape};
use peri::potential::{BondPotential, KernelFit, Law};
use peri::stress::{BallVolume, StressInput, StressMethod, StressTensor, SurfaceCompensation};
use peri::stress::{piola_in_cloud, piola_on_lattice, segment_fraction};

const ALL: [StressMethod; 6] = [
    StressMethod::Hardy,
    StressMethod::HardyBonds,
    StressMethod::HardyScaled,
    StressMethod::Gaussian,
    StressMethod::Spline,
    StressMethod::LehoucqSilling,
];

fn size<const D: usize>(p: &StressTensor<D>) -> f64 {
    p.iter().flatten().map(|x| x * x).sum::<f64>().sqrt()
}

fn apart<const D: usize>(a: &StressTensor<D>, b: &StressTensor<D>) -> f64 {
    size::<D>(&std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] - b[i][j])))
}

fn linear(range: [f64; 2]) -> (Box<dyn BondPotential>, KernelFit) {
    let law = Law::Linear.build(1.0, 1.0, false).unwrap();
    let fit = fit(&*law, range);
    (law, fit)
}

fn on_lattice<const D: usize>(
    built: &Built<D>,
    fit: &KernelFit,
    u: &[[f64; D]],
    measure: StressMethod,
    missing: SurfaceCompensation,
) -> Vec<StressTensor<D>> {
    let field = scatter(built.lattice.sites(), &built.on_lattice, u);
    let state = StressInput { displacement: &field, fit: fit.into(), modulus: MODULUS, missing };
    piola_on_lattice(&built.lattice, &state, measure, BallVolume::Particles)
}

/// Strain without symmetry.
fn strained<const D: usize>(points: &[[f64; D]]) -> Vec<[f64; D]> {
    let h = |a: usize, b: usize| 0.01 * (1.0 + 0.7 * a as f64 - 0.9 * b as f64) / (1.0 + (a * b) as f64);
    points.iter().map(|x| std::array::from_fn(|a| (0..D).map(|b| h(a, b) * x[b]).sum())).collect()
}

/// Every particle of a body with a hole, also at edges and corners, has the stress of a complete family;
/// returns the largest error of `hardy`.
fn patch<const D: usize>(ratio: f64, cells: [usize; D], measures: &[StressMethod]) -> f64 {
    let mut body = Body::<D>::solid(cells, 1.0, ratio);
    let far = 2.0 * ratio;
    let centre = cells.map(|c| c as f64 - far - 1.5);
    body.operations.push(Operation::Cut(Shape::Ball { centre, radius: 1.6 }));
    let built = body.build();
    let u = strained(&built.points);
    let (_, fit) = linear([0.9, 1.1]);
    let one_point = on_lattice(&built, &fit, &u, StressMethod::OnePoint, SurfaceCompensation::Bonds);
    let whole = |x: &[f64; D]| {
        (0..D).all(|d| x[d] > ratio && x[d] < cells[d] as f64 - ratio)
            && norm::<D>(std::array::from_fn(|d| x[d] - centre[d])) > ratio + 2.6
    };
    let inside = built.points.iter().position(whole).expect("a particle with all its bonds");
    let exact = one_point[inside];
    let mut of_hardy = f64::NAN;
    for &measure in measures {
        let found = on_lattice(&built, &fit, &u, measure, SurfaceCompensation::Bonds);
        // looking one cell far, it finds no bond of some types at corners and at the steps of a hole
        let narrow = measure == StressMethod::LehoucqSilling;
        let by_one_edge = |x: &[f64; D]| {
            let edges = (0..D).filter(|&d| x[d].min(cells[d] as f64 - x[d]) < ratio).count();
            edges < 2 && norm::<D>(std::array::from_fn(|d| x[d] - centre[d])) > ratio + 2.6
        };
        let judged = built.points.iter().zip(&found).filter(|(x, _)| !narrow || by_one_edge(x));
        let worst = judged.map(|(_, p)| apart(p, &exact) / size(&exact)).fold(0.0, f64::max);
        // displacements of 1 are rounded to 1e-16, those of neighbours differ by 1e-2
        if measure == StressMethod::Hardy {
            of_hardy = worst;
        }
        assert!(worst < 1e-13, "{D}D, m = {ratio}, {}: {worst:e}", measure.name());
    }
    // errors of the old weights: the check can fail
    let old = on_lattice(&built, &fit, &u, StressMethod::BallShare, SurfaceCompensation::Bonds)[inside];
    assert!(apart(&old, &exact) > 1e-3 * size(&exact));
    of_hardy
}

#[test]
fn any_strain_is_exact_up_to_free_edges() {
    let mut worst = patch::<3>(3.015, [19; 3], &[StressMethod::Hardy, StressMethod::LehoucqSilling]);
    for ratio in [3.015, 4.015, 6.015, 8.015] {
        let side = (4.0 * ratio) as usize + 8;
        worst = worst.max(patch::<2>(ratio, [side, side + 3], &ALL));
    }
    patch::<2>(2.6, [17, 20], &ALL);
    patch::<2>(4.9, [30, 28], &ALL);
    evidence::at_most("patch test of hardy up to free edges", worst, 1e-13);
}

/// Results of `patch_test.py`: σ₁₁ in rows 0–3 below an edge along x over that inside, for the uniform strain
/// of uniaxial stress along x.
#[test]
fn rows_below_a_free_edge() {
    let built = Body::<2>::solid([41, 30], 1.0, 3.015).build();
    let u: Vec<[f64; 2]> = built.points.iter().map(|x| [1e-6 * x[0], -1e-6 / 3.0 * x[1]]).collect();
    let (_, fit) = linear([0.99, 1.01]);
    let rows = |measure: StressMethod, missing: SurfaceCompensation| -> Vec<f64> {
        let found = on_lattice(&built, &fit, &u, measure, missing);
        let exact = on_lattice(&built, &fit, &u, StressMethod::OnePoint, missing)[41 * 15 + 20][0][0];
        (0..4).map(|row| found[41 * row + 20][0][0] / exact).collect()
    };
    let table = [
        (StressMethod::OnePoint, SurfaceCompensation::Bonds, [0.801, 0.956, 1.0, 1.0]),
        (StressMethod::BallShare, SurfaceCompensation::Bonds, [0.879, 0.943, 0.949, 0.977]),
        (StressMethod::HardyScaled, SurfaceCompensation::Window, [0.897, 0.962, 0.968, 0.995]),
        (StressMethod::HardyScaled, SurfaceCompensation::Bonds, [1.0; 4]),
        (StressMethod::Hardy, SurfaceCompensation::Bonds, [1.0; 4]),
    ];
    for (measure, missing, expected) in table {
        for (found, expected) in rows(measure, missing).iter().zip(expected) {
            // three decimals are printed; bonds are linear to the strain
            assert!((found - expected).abs() < 6e-4, "{measure:?} {missing:?}: {found} against {expected}");
        }
    }
    // one row marked: it alone is taken by its window
    let mut marked = vec![false; built.lattice.sites()];
    built.on_lattice[..41].iter().for_each(|&site| marked[site] = true);
    let mixed = rows(StressMethod::HardyScaled, SurfaceCompensation::WindowAt(&marked));
    assert!((mixed[0] - 0.897).abs() < 6e-4 && (mixed[1] - 1.0).abs() < 1e-12, "{mixed:?}");
}

/// Σ P V over all particles is Σ f ⊗ ξ over all bonds: bonds of inner particles are distributed completely,
/// and a broken bond removes exactly its part.
#[test]
fn a_broken_bond_counts_with_no_force() {
    let body = Body::<2>::solid([27, 27], 1.0, 3.015);
    let built = body.build();
    let u = strained(&built.points);
    let (law, fit) = linear([0.9, 1.1]);
    let middle = 27 * 13 + 13;
    let pairs = body.pairs(&built.points);
    let pair = pairs.iter().find(|p| p.i == middle && p.length > 2.0).unwrap();
    let (zeta, stretch) = pair.deformed(&u);
    let force = 2.0 * MODULUS * law.tension(stretch) / norm(zeta);
    let expected: StressTensor<2> =
        std::array::from_fn(|a| std::array::from_fn(|b| force * zeta[a] * pair.bond[b]));
    for measure in ALL {
        let mut broken = body.build();
        let before = on_lattice(&broken, &fit, &u, measure, SurfaceCompensation::Bonds);
        let (i, j) = (broken.on_lattice[pair.i], broken.on_lattice[pair.j]);
        let mut ends = Vec::new();
        for (own, other) in [(i, j), (j, i)] {
            broken.lattice.neighbours(own, &mut |bond| {
                if bond.site == other {
                    let (site, index) = (own as u32, bond.index);
                    let (length, weight) = (bond.length, bond.weight);
                    ends.push(Overstretched { site, index, elongation: 1.0, length, weight });
                }
            });
        }
        broken.lattice.break_bonds(&ends);
        let after = on_lattice(&broken, &fit, &u, measure, SurfaceCompensation::Bonds);
        let mut lost = [[0.0; 2]; 2];
        for (before, after) in before.iter().zip(&after) {
            for a in 0..2 {
                for b in 0..2 {
                    lost[a][b] += before[a][b] - after[a][b];
                }
            }
        }
        // the fitted law's bound
        assert!(apart(&lost, &expected) < 1e-9 * size(&expected), "{measure:?}: {lost:?} {expected:?}");
    }
}

/// A regular cloud has the stresses of the lattice, and in any cloud the sum over particles is that over
/// bonds.
#[test]
fn clouds_share_bonds_out() {
    let built = Body::<2>::solid([25, 22], 1.0, 3.015).build();
    let (_, fit) = linear([0.5, 2.0]);
    let strained = strained(&built.points);
    let shaken = Random(5).vectors(built.points.len(), 0.1);
    for measure in [StressMethod::Hardy, StressMethod::Gaussian, StressMethod::Spline] {
        let of = |u: &[[f64; 2]], measure: StressMethod| {
            let field = scatter(built.cloud.sites(), &built.in_cloud, u);
            let state = StressInput {
                displacement: &field,
                fit: (&fit).into(),
                modulus: MODULUS,
                missing: SurfaceCompensation::Bonds,
            };
            piola_in_cloud(&built.cloud, &state, measure, BallVolume::Particles)
        };
        let inside = built.in_cloud[25 * 11 + 12];
        let (found, exact) = (of(&strained, measure)[inside], of(&strained, StressMethod::OnePoint)[inside]);
        // m = 3: bonds touch balls, whose fractions are rounded to √ε
        assert!(apart(&found, &exact) < 1e-7 * size(&exact), "{measure:?}: {found:?} {exact:?}");
        let total = |all: Vec<StressTensor<2>>| -> StressTensor<2> {
            std::array::from_fn(|a| std::array::from_fn(|b| all.iter().map(|p| p[a][b]).sum()))
        };
        let (found, exact) = (total(of(&shaken, measure)), total(of(&shaken, StressMethod::OnePoint)));
        assert!(apart(&found, &exact) < 1e-11 * size(&exact), "{measure:?}: {found:?} {exact:?}");
    }
}

/// Returns bodies, forces of their bonds, and a smooth displacement that is not uniform.
fn smooth() -> (Body<2>, Built<2>, Vec<BondPair<2>>, Vec<[f64; 2]>) {
    let body = Body::<2>::solid([29, 29], 1.0, 3.015);
    let built = body.build();
    let u = built
        .points
        .iter()
        .map(|p| {
            let (x, y) = (p[0] - 14.5, p[1] - 14.5);
            [1e-3 * (x * x + 0.06 * x * y * y - 0.2 * y * y), 1e-3 * (0.5 * x * y - 0.1 * x * x * x / 6.0)]
        })
        .collect();
    let pairs = body.pairs(&built.points);
    (body, built, pairs, u)
}

/// Returns Σ f ⊗ ξ ∫₀¹ φ(X_I + αξ − X) dα over all pairs, the integral by `steps` midpoints: Eqs (2.14),
/// (2.15).
fn by_definition(
    pairs: &[BondPair<2>],
    points: &[[f64; 2]],
    law: &dyn BondPotential,
    u: &[[f64; 2]],
    at: [f64; 2],
    steps: usize,
    window: &dyn Fn([f64; 2]) -> f64,
) -> StressTensor<2> {
    let mut sum = [[0.0; 2]; 2];
    for pair in pairs {
        let p = [points[pair.i][0] - at[0], points[pair.i][1] - at[1]];
        if segment_fraction(p, [p[0] + pair.bond[0], p[1] + pair.bond[1]], 25.0) == 0.0 {
            continue;
        }
        let along = |k: usize| {
            let alpha = (k as f64 + 0.5) / steps as f64;
            window([p[0] + alpha * pair.bond[0], p[1] + alpha * pair.bond[1]])
        };
        let weight = (0..steps).map(along).sum::<f64>() / steps as f64;
        let (zeta, stretch) = pair.deformed(u);
        let force = 2.0 * MODULUS * law.tension(stretch) * weight / norm(zeta);
        for a in 0..2 {
            for b in 0..2 {
                sum[a][b] += force * zeta[a] * pair.bond[b];
            }
        }
    }
    sum
}

/// Window function in the plane.
type Shape2 = fn([f64; 2]) -> f64;

fn ball(x: [f64; 2]) -> f64 {
    f64::from(u8::from(norm(x) < 3.015)) / (std::f64::consts::PI * 3.015_f64.powi(2))
}

/// Normal distribution with a standard deviation of a third of the horizon, truncated there at e^(−9/2).
fn gaussian(x: [f64; 2]) -> f64 {
    let variance = (3.015_f64 / 3.0).powi(2);
    let inside = f64::from(u8::from(norm(x) < 3.015));
    inside * (-0.5 * norm(x).powi(2) / variance).exp()
        / (2.0 * std::f64::consts::PI * variance * (1.0 - (-4.5_f64).exp()))
}

/// Cubic spline of Monaghan in the plane: 40/(7πh²) at its centre.
fn spline(x: [f64; 2]) -> f64 {
    let q = norm(x) / 3.015;
    let shape = if q < 0.5 { 6.0 * (q * q * q - q * q) + 1.0 } else { 2.0 * (1.0 - q).max(0.0).powi(3) };
    40.0 / (7.0 * std::f64::consts::PI * 3.015_f64.powi(2)) * shape
}

fn hat(x: [f64; 2]) -> f64 {
    (1.0 - x[0].abs()).max(0.0) * (1.0 - x[1].abs()).max(0.0)
}

/// Every particle agrees with the definition, with windows averaged over a cell by 16² points.
#[test]
fn measures_are_their_definitions() {
    let (_, built, pairs, u) = smooth();
    let law = Law::ChainOffset.build(720.0, 1200.0, false).unwrap();
    let fit = fit(&*law, stretch_range(&pairs, &u));
    let windows: [(StressMethod, Shape2); 3] =
        [(StressMethod::Hardy, ball), (StressMethod::Gaussian, gaussian), (StressMethod::Spline, spline)];
    let averaged = |window: Shape2, x: [f64; 2]| {
        let shift = |k: usize| (k as f64 + 0.5) / 16.0 - 0.5;
        (0..256).map(|k| window([x[0] + shift(k % 16), x[1] + shift(k / 16)])).sum::<f64>() / 256.0
    };
    for particle in [29 * 14 + 14, 29 * 12 + 17] {
        let at = built.points[particle];
        for (measure, window) in windows {
            let found = on_lattice(&built, &fit, &u, measure, SurfaceCompensation::Bonds)[particle];
            let exact = by_definition(&pairs, &built.points, &*law, &u, at, 48, &|x| averaged(window, x));
            // both sample the window at sixteenths of a cell; the ball's rim is observed to about 1e-3 of its
            // area
            let bound = 2e-3 * size(&exact);
            assert!(apart(&found, &exact) < bound, "{measure:?}: {found:?} against {exact:?}");
        }
        let found =
            on_lattice(&built, &fit, &u, StressMethod::LehoucqSilling, SurfaceCompensation::Bonds)[particle];
        let exact = by_definition(&pairs, &built.points, &*law, &u, at, 960, &hat);
        // midpoint rules of 1/16 a cell on curves of at most second degree in α
        assert!(apart(&found, &exact) < 1e-3 * size(&exact), "{found:?} against {exact:?}");
    }
}

/// div P is the average of the force density by the window: Eqs (2.11), (2.12) for the cell's window of
/// Lehoucq and Silling, and for the spline.
#[test]
fn divergence_is_the_average_over_the_window() {
    let (_, built, pairs, u) = smooth();
    let law = Law::ChainOffset.build(720.0, 1200.0, false).unwrap();
    let fit = fit(&*law, stretch_range(&pairs, &u));
    let mut lattice = Body::<2>::solid([29, 29], 1.0, 3.015).build().lattice;
    lattice.set_law(&fit, MODULUS);
    let densities = crate::bodies::forces(&lattice, &built.on_lattice, &u);
    let h = 1e-3;
    for window in [hat as Shape2, spline] {
        for at in [[14.637, 14.791], [13.09, 15.67]] {
            let p = |dx: f64, dy: f64| {
                by_definition(&pairs, &built.points, &*law, &u, [at[0] + dx, at[1] + dy], 2000, &window)
            };
            let (px, mx, py, my) = (p(h, 0.0), p(-h, 0.0), p(0.0, h), p(0.0, -h));
            for a in 0..2 {
                let average: f64 = built
                    .points
                    .iter()
                    .zip(&densities)
                    .map(|(x, f)| window([x[0] - at[0], x[1] - at[1]]) * f[a])
                    .sum();
                let divergence = (px[a][0] - mx[a][0] + py[a][1] - my[a][1]) / (2.0 * h);
                assert!(
                    (divergence - average).abs() < 1e-4 * average.abs(),
                    "at {at:?}, component {a}: {divergence} against {average}"
                );
            }
        }
    }
}

/// Fields do not depend on memory beside the rows of a body: a body in a larger box of cells has equal
/// fields.
#[test]
fn rows_do_not_reach_into_each_other() {
    let (_, fit) = linear([0.5, 2.0]);
    for ratio in [2.6, 3.015, 4.9, 5.5] {
        let narrow = Body::<2>::solid([7, 9], 1.0, ratio);
        let mut wide = Body::<2>::solid([40, 9], 1.0, ratio);
        let far = Shape::Box { min: [7.0, 0.0], max: [40.0, 9.0] };
        wide.operations.push(Operation::Cut(far));
        let (narrow, wide) = (narrow.build(), wide.build());
        assert_eq!(narrow.points, wide.points);
        let u = Random(11).vectors(narrow.points.len(), 0.1);
        for measure in ALL {
            let of = |built: &Built<2>| on_lattice(built, &fit, &u, measure, SurfaceCompensation::Bonds);
            for (a, b) in of(&narrow).iter().zip(&of(&wide)) {
                assert!(apart(a, b) <= 1e-14 * size(a), "m = {ratio}, {measure:?}: {a:?} {b:?}");
            }
        }
    }
}

/// Bits do not depend on threads, because work items have fixed sums.
#[test]
fn bits_do_not_depend_on_threads() {
    let body = Body::<2>::damaged([60, 70], 0.1, 3.015);
    let built = body.build();
    let u = Random(3).vectors(built.points.len(), 0.005);
    let (_, fit) = linear([0.5, 2.0]);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| ALL.map(|measure| on_lattice(&built, &fit, &u, measure, SurfaceCompensation::Bonds)))
    };
    assert!(with(1) == with(3));
}

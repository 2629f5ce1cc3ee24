use super::super::{Body, Branch, EyringFlow, FixedComponent, Phase, SolidifyingMaxwell};
use super::*;
use crate::mesh::Mesh;
use evidence::{at_most, near};
use polycore::constitutive::viscoelastic::Shift;
use polycore::random::SplitMix64;

/// Law of branches (modulus, time) with a flow of 1.6 MPa at 300 K.
fn law(branches: &[(f64, f64)], poisson: f64, flows: bool) -> SolidifyingMaxwell {
    let branches = branches.iter().map(|&(modulus, time)| Branch { modulus, time }).collect();
    let flow = flows.then_some(EyringFlow { stress: 1.6e6, reference: 300.0 });
    SolidifyingMaxwell {
        amorphous: Phase { flow, ..Phase::new(branches, Shift::None) },
        ..SolidifyingMaxwell::elastic(1.0, poisson, 0.0, f64::INFINITY)
    }
}

/// A cube of one element, held on x = 0 and 1, y = 0, z = 0.
fn cube() -> (Mesh, Vec<FixedComponent>) {
    let points: Vec<[f64; 3]> =
        (0..8).map(|k| [[0.0, 1.0, 1.0, 0.0][k % 4], [0.0, 0.0, 1.0, 1.0][k % 4], (k / 4) as f64]).collect();
    let held = |n: usize, d: usize| points[n][d] == 0.0 || d == 0;
    let supports = (0..8).flat_map(|n| (0..3).map(move |d| (n, d))).filter(|&(n, d)| held(n, d));
    let supports = supports.map(|(n, d)| (n as u32, d)).collect();
    (Mesh { points, hexahedra: vec![[0, 1, 2, 3, 4, 5, 6, 7]], ..Mesh::default() }, supports)
}

/// Steady flow at four rates, `eyring.csv` of the formulation: √3 τ₀ asinh(√3 ε̇/γ̇₀), γ̇₀ =
/// 1e-8 /s. The volume relaxes in 2.7e5 s, which lowers the stress by 5e-6.
#[test]
fn a_bar_yields_at_four_rates() {
    let (mesh, supports) = cube();
    let (shear, poisson) = (600e6, 0.4);
    let law = law(&[(2.0 * (1.0 + poisson) * shear, 1.6e6 / (shear * 1e-8))], poisson, true);
    for (rate, stress) in
        [(1e-4, 28.967_631_62), (1e-3, 35.348_742_61), (1e-2, 41.729_853_61), (1e-1, 48.110_964_6)]
    {
        let mut body = Body::new(&mesh, poisson).unwrap();
        body.activate([0], 1);
        let step = 5e-4 / rate;
        for _ in 0..400 {
            let increment = |_| law.increment([300.0, 0.0], [300.0, 0.0], step);
            body.step(increment, |_, _, _| -5e-4, &supports).unwrap();
        }
        near(&format!("eyring_bar_{rate}"), body.stress(0, 3)[0] / 1e6 / stress, 1.0, 1e-5);
        at_most("eyring_bar_lateral", body.stress(0, 3)[1].abs() / 1e6, 1e-6);
        at_most("eyring_bar_closure", body.state.balance.worst, 1e-13);
    }
}

/// Stress of a held shear 2e-2 after `time`, in `steps`, Pa.
fn held_shear(law: &SolidifyingMaxwell, degree: f64, time: f64, steps: usize) -> f64 {
    let (mut strains, still) = (vec![[0.0; 6]; law.branches()], [0.0; 6]);
    let sudden = law.increment([300.0, degree], [300.0, degree], 0.0);
    let shear = [0.0, 0.0, 0.0, 2e-2, 0.0, 0.0];
    sudden.point(law.poisson, &strains, &shear).advance(&mut strains, &shear);
    let step = law.increment([300.0, degree], [300.0, degree], time / steps as f64);
    for _ in 0..steps {
        step.point(law.poisson, &strains, &still).advance(&mut strains, &still);
    }
    step.stress(&strains)[3] / (2.0 * (1.0 + law.poisson))
}

/// A held shear relaxes by tanh(x/2) = tanh(x₀/2) e^{−t/τ}, x = s/τ₀: first order in the step.
#[test]
fn a_held_shear_flows() {
    let law = law(&[(1.5e9, 1e6)], 0.25, true);
    let start = 0.6e9 * 2e-2 / 1.6e6_f64;
    let exact = 1.6e6 * 2.0 * ((0.5 * start).tanh() * (-1e3 / 1e6_f64).exp()).atanh();
    let errors = [100, 200, 400].map(|steps| held_shear(&law, 0.0, 1e3, steps) / exact - 1.0);
    near("eyring_relaxation", errors[2], 0.0, 5e-3);
    near("eyring_relaxation_order", (errors[1] / errors[2]).log2(), 1.0, 0.05);
}

/// Crystals that slow relaxation by e³ are a shift of time, with and without flow.
#[test]
fn crystals_shift_time() {
    for flows in [false, true] {
        let mut law = law(&[(0.5e9, 1e4), (1e9, 1e6)], 0.3, flows);
        law.amorphous.retardation = 3.0;
        let (fast, slow) = (held_shear(&law, 0.0, 1e4, 50), held_shear(&law, 1.0, 1e4 * 3.0_f64.exp(), 50));
        near("time_shift_of_crystals", slow / fast, 1.0, 1e-12);
    }
}

/// Steps of 1e-12 to 1e12 relaxation times leave a finite stress that falls with its length.
#[test]
fn steps_of_any_length_are_finite() {
    let law = law(&[(1.5e9, 1.0)], 0.25, true);
    for strain in [1e-12, 1e-3, 1.0, 1e6] {
        let mut before = f64::INFINITY;
        for power in -12..=12 {
            let step = law.increment([300.0, 0.0], [300.0, 0.0], 10.0_f64.powi(power));
            for (e, d) in [(strain, 0.0), (0.0, strain), (strain, -strain), (strain, -0.9 * strain)] {
                let (e, d) = ([0.0, e, -e, e, 0.0, 0.0], [0.0, d, -d, d, 0.0, 0.0]);
                let point = step.point(0.25, &[e], &d);
                let mut strains = [e];
                point.advance(&mut strains, &d);
                let losses = point.energies(&[e], &d, |a, b| (0..6).map(|k| a[k] * b[k]).sum());
                assert!(strains[0].iter().all(|e| e.is_finite()), "{strain} {power} {strains:?}");
                assert!(losses.viscous >= 0.0 && point.tangent().iter().all(|c| c.is_finite()));
                if d[3] == 0.0 {
                    assert!(strains[0][3] <= before, "{strain} {power}");
                    before = strains[0][3];
                }
            }
        }
    }
}

/// Energies of 5000 random steps close and no loss is negative; the tangent is symmetric and positive, and
/// the derivative of the stress where strain and increment are parallel.
#[test]
fn energies_of_flow_close() {
    let law = law(&[(0.5e9, 10.0), (1e9, 1e5), (0.2e9, f64::INFINITY)], 0.3, true);
    let elastic = stiffness(0.3);
    let product = |a: &[f64; 6], b: &[f64; 6]| VoigtVector::from(*a).dot(&(elastic * VoigtVector::from(*b)));
    let (mut random, mut worst, mut least) = (SplitMix64::new(7), 0.0_f64, 0.0_f64);
    let (mut strains, mut stored) = (vec![[0.0; 6]; 3], 0.0);
    for _ in 0..5000 {
        let duration = 10.0_f64.powf(8.0 * random.uniform() - 4.0);
        let change: [f64; 6] = std::array::from_fn(|_| 1e-2 * random.normal());
        let point = law.increment([300.0, 0.0], [300.0, 0.0], duration).point(0.3, &strains, &change);
        let found = point.energies(&strains, &change, product);
        stored += found.stored;
        worst = worst.max(found.closure().abs() / (found.size() + stored));
        least = least.min(found.viscous / found.size());
        let tangent = point.tangent();
        assert!((tangent - tangent.transpose()).amax() <= 1e-15 * tangent.amax());
        assert!(tangent.symmetric_eigenvalues().min() > 0.0);
        point.advance(&mut strains, &change);
    }
    at_most("eyring_energy_closure", worst, 1e-14);
    at_most("eyring_negative_loss", -least, 1e-15);
    let (start, step) = ([[1e-3, 0.0, -1e-3, 4e-3, 0.0, 0.0]; 3], law.increment([300.0; 2], [300.0; 2], 1.0));
    let stress = |change: &[f64; 6]| {
        let mut strains = start;
        step.point(0.3, &strains, change).advance(&mut strains, change);
        elastic * VoigtVector::from(step.stress(&strains))
    };
    let change = start[0].map(|e| 0.5 * e);
    let tangent = step.point(0.3, &start, &change).tangent();
    for k in 0..6 {
        let moved = |by: f64| std::array::from_fn(|j| change[j] + if j == k { by } else { 0.0 });
        let slope = (stress(&moved(1e-8)) - stress(&moved(-1e-8))) / 2e-8;
        at_most("eyring_tangent", (tangent.column(k) - slope).amax() / tangent.amax(), 1e-6);
    }
}

/// A bar at fixed length cooled at 1 K/s from 433.15 K with WLF: ∫Eα q e^{−(ξ(t) − ξ(s))/τ}ds by
/// Simpson's rule. Second order in the step.
#[test]
fn a_bar_vitrifies() {
    let shift = Shift::Wlf { reference: 373.15, constants: [17.44, 51.6] };
    let mut law = law(&[(1e9, 30.0)], 0.3, false);
    law.amorphous.shift = shift;
    let (count, end) = (200_000, 80.0);
    let fine = end / f64::from(count);
    // ∫ from s to the end of dt/a, summed from the end
    let (mut later, mut sum) = (0.0, 0.0);
    for k in (0..count / 2).rev() {
        let at = |part: f64| 433.15 - fine * (2.0 * f64::from(k) + part);
        let value = |later: f64| (-later / 30.0).exp();
        let first = value(later);
        let middle = later + shift.reduced_time([at(1.0), at(2.0)], fine);
        later = middle + shift.reduced_time([at(0.0), at(1.0)], fine);
        sum += fine / 3.0 * (first + 4.0 * value(middle) + value(later));
    }
    let exact = 1e9 * 1e-4 * sum;
    let errors = [2.0, 1.0, 0.5].map(|step| {
        let mut strains = vec![[0.0]];
        let mut stress = 0.0;
        for k in 0..(end / step) as usize {
            let from = 433.15 - step * k as f64;
            let increment = law.increment([from, 0.0], [from - step, 0.0], step);
            increment.advance(&mut strains, &[1e-4 * step]);
            [stress] = increment.stress(&strains);
        }
        stress / exact - 1.0
    });
    near("vitrified_bar", errors[2], 0.0, 2e-3);
    near("vitrified_bar_order", (errors[1] / errors[2]).log2(), 2.0, 0.1);
}

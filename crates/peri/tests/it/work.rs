//! Work and memory: counts by closed forms, and bytes.

use crate::bodies::{Body, hold, relax};
use peri::bonds::{BodyGeometry, BondDamage, Bonds, LatticeBonds, Stencil};
use peri::geometry::{Operation, Shape, lattice};
use peri::potential::Law;
use peri::solver::{DynamicRelaxation, State};

#[test]
fn stencil_sizes() {
    // Gauss' circle and sphere problems: points within the radius, less the centre
    assert_eq!([1.0, 2.0, 3.015, 4.015].map(|m| Stencil::<2>::new(m).offsets.len()), [4, 12, 28, 48]);
    assert_eq!([1.0, 2.0, 3.015, 4.015].map(|m| Stencil::<3>::new(m).offsets.len()), [6, 32, 122, 256]);
    assert_eq!(Stencil::<2>::new(8.015).offsets.len(), 196);
    assert!(Stencil::<2>::new(0.99).offsets.is_empty());
    // the order that the kernels and stress measures count on
    for stencil in [Stencil::<3>::new(3.015), Stencil::<3>::new(2.0)] {
        let last = stencil.offsets.len() - 1;
        for (k, offset) in stencil.offsets.iter().enumerate() {
            assert_eq!(stencil.offsets[last - k], offset.map(|x| -x));
        }
    }
}

fn boxed<const D: usize>(cells: [usize; D], ratio: f64) -> LatticeBonds<D> {
    let max = cells.map(|c| c as f64);
    let body = [Operation::Add(Shape::Box { min: [0.0; D], max })];
    LatticeBonds::new(lattice(&body, 1.0, 1.0).unwrap(), ratio, Default::default(), &[]).unwrap()
}

/// Counts bonds of a box: an offset o fits (n − |o₁|)(n − |o₂|)… times.
#[test]
fn bonds_of_a_box() {
    fn check<const D: usize>(cells: [usize; D], ratio: f64) {
        let fits = |offset: &[i32; D]| -> u64 {
            (0..D).map(|d| cells[d].saturating_sub(offset[d].unsigned_abs() as usize) as u64).product()
        };
        let expected: u64 = Stencil::<D>::new(ratio).offsets.iter().map(fits).sum();
        assert_eq!(boxed(cells, ratio).directed_bonds(), expected, "{cells:?}, m = {ratio}");
    }
    // n ≥ 3: 28n² − n Σ(|o₁| + |o₂|) + Σ|o₁||o₂| over the 28 offsets
    for n in [3_u64, 10, 57] {
        assert_eq!(boxed([n as usize; 2], 3.015).directed_bonds(), 28 * n * n - 72 * n + 36);
    }
    check([1, 1], 3.015);
    check([17, 2], 8.015);
    check([300, 300], 3.015);
    check([46, 46, 46], 3.015);
    check([1, 5, 3], 4.015);
}

/// A bar needs equal memory and vectors of particles along any axis, because it is stored along its own.
#[test]
fn bars_are_stored_along_their_axis() {
    fn check<const D: usize>(bars: [[usize; D]; D]) {
        let stored = bars.map(|cells| {
            let bonds = boxed(cells, 3.015);
            let sites: Vec<usize> = bonds.particles().iter().map(|&site| site as usize).collect();
            let mut vectors: Vec<usize> = sites.iter().map(|site| site / 8).collect();
            vectors.dedup();
            // neighbours lie where the bonds say
            for &site in &sites {
                let (here, mut count) = (bonds.position(site), 0);
                bonds.neighbours(site, &mut |bond| {
                    let there = bonds.position(bond.site);
                    assert!(
                        (0..D).all(|d| there[d] - here[d] == bond.bond[d]),
                        "{cells:?}: {here:?} {there:?}"
                    );
                    assert!(bonds.is_bonded(site, bond.site));
                    count += 1;
                });
                let bonded = sites.iter().filter(|&&other| bonds.is_bonded(site, other));
                assert_eq!(bonded.count(), count, "{cells:?}");
            }
            (bonds.sites(), vectors.len())
        });
        assert!(stored.iter().all(|&one| one == stored[0]), "{bars:?}: {stored:?}");
    }
    check([[90, 6], [6, 90]]);
    check([[60, 5, 5], [5, 60, 5], [5, 5, 60]]);
}

/// A particle needs at most 200 bytes: displacement, velocity and force (3D doubles), mass and bonds.
#[test]
fn bytes_per_particle() {
    fn check<const D: usize>(cells: [usize; D], most: f64) {
        let bonds = boxed(cells, 3.015);
        let solver = bonds.sites() * (3 * D + 1) * 8;
        let each = (bonds.bytes() + solver) as f64 / bonds.particles().len() as f64;
        eprintln!("{D}D {cells:?}: {each:.1} bytes per particle");
        assert!(each <= most, "{D}D: {each}");
    }
    // without padding: 8 bytes of bond bits per 64 bonds, 4 of the particle list, 8(3D + 1) of fields: 68 and
    // 100; with the rows' padding (6 of 300, (6 of 46)²) and the guards 1.02·68 and 1.5·100
    check([300, 300], 72.0);
    check([46, 46, 46], 150.0);
    check([100, 100, 100], 130.0);
}

/// A converged step takes one force evaluation per iteration and one more; stretches at its start and end
/// need none.
#[test]
fn force_evaluations() {
    let mut built = Body::<2>::damaged([24, 20], 0.1, 3.015).build();
    let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
    let loads = hold(&built.lattice, |x| {
        (x[0] < 0.3 || x[0] > 2.1).then(|| (3, if x[0] < 0.3 { [0.0; 2] } else { [0.1, 0.02] }))
    });
    for (factors, name) in [(&[1.0][..], "one step"), (&[0.2, 0.5, 1.0], "three steps")] {
        let mut state = State::new(built.lattice.sites());
        let solver = DynamicRelaxation::default();
        relax(&solver, &mut built.lattice, (&*law, 1.0), &loads, factors, &mut state).unwrap();
        assert_eq!(state.step, factors.len());
        let extra = state.counts.evaluations - state.counts.total_iterations;
        assert!(state.counts.total_iterations > 10);
        assert_eq!(extra, factors.len() as u64, "{name}: {} iterations", state.counts.total_iterations);
    }
}

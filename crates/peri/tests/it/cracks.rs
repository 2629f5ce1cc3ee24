//! Bonds severed by cracks, against exact integer arithmetic, for any position of tips and order of ends.

use crate::bodies::{Body, Built, MODULUS, Random, fit, forces, norm, stretch_range};
use peri::bonds::{
    BodyGeometry, BondDamage, BondForces, CloudBonds, Lattice, LatticeBonds, VolumeCorrection,
};
use peri::geometry::Cut;
use peri::potential::Law;
use proptest::prelude::*;

type Whole<const D: usize> = [i64; D];

fn determinant<const D: usize>(c: &[Whole<D>; D]) -> i64 {
    if D == 2 {
        return c[0][0] * c[1][1] - c[0][1] * c[1][0];
    }
    let cyclic = |d: usize| {
        let (i, j) = ((d + 1) % 3, (d + 2) % 3);
        c[0][d] * (c[1][i] * c[2][j] - c[1][j] * c[2][i])
    };
    (0..3).map(cyclic).sum()
}

/// Returns true if a bond crosses the inside of a cut, by Cramer's rule without rounding.
fn crosses<const D: usize>(a: Whole<D>, b: Whole<D>, corner: Whole<D>, edges: &[Whole<D>]) -> bool {
    let mut columns = [[0; D]; D];
    columns[0] = std::array::from_fn(|d| b[d] - a[d]);
    (1..D).for_each(|i| columns[i] = edges[i - 1].map(|x| -x));
    let volume = determinant(&columns);
    (0..D).all(|i| {
        let mut replaced = columns;
        replaced[i] = std::array::from_fn(|d| corner[d] - a[d]);
        let part = determinant(&replaced) * volume.signum();
        0 < part && part < volume.abs()
    })
}

/// Lattice and cloud of a box of cells with cracks in quarters of the spacing: every bond from both ends.
fn check<const D: usize>(
    cells: [usize; D],
    (spacing, origin): (f64, f64),
    cracks: &[(Whole<D>, Vec<Whole<D>>)],
) {
    let place = |x: Whole<D>| x.map(|x| origin + 0.25 * spacing * x as f64);
    let count = cells.iter().product();
    let volume = spacing.powi(D as i32);
    let box_of_cells = Lattice { spacing, origin: [origin; D], cells, occupied: vec![true; count], volume };
    let cuts = |swapped: bool| -> Vec<Cut<D>> {
        let cut = |(corner, edges): &(Whole<D>, Vec<Whole<D>>)| {
            let mut result = Cut { corner: place(*corner), edges: [[0.0; D]; D] };
            for (i, edge) in edges.iter().enumerate() {
                let end = place(std::array::from_fn(|d| corner[d] + edge[d]));
                result.edges[i] = std::array::from_fn(|d| end[d] - result.corner[d]);
            }
            if swapped {
                let end = place(std::array::from_fn(|d| corner[d] + edges[0][d]));
                let start = result.corner;
                result.corner = end;
                result.edges[0] = std::array::from_fn(|d| start[d] - end[d]);
            }
            result
        };
        cracks.iter().map(cut).collect()
    };
    let ratio = 3.015;
    let whole = LatticeBonds::new(box_of_cells.clone(), ratio, VolumeCorrection::None, &[]).unwrap();
    let points: Vec<[f64; D]> = whole.particles().iter().map(|&s| whole.position(s as usize)).collect();
    let cell = |site: usize| whole.cell_of(site).unwrap().map(|c| 4 * c as i64);
    for swapped in [false, true] {
        let cuts = cuts(swapped);
        let lattice = LatticeBonds::new(box_of_cells.clone(), ratio, VolumeCorrection::None, &cuts).unwrap();
        let volumes = vec![volume; points.len()];
        let cloud =
            CloudBonds::new(&points, &volumes, 1.0, ratio * spacing, VolumeCorrection::None, &cuts).unwrap();
        let mut place = vec![0; points.len()];
        cloud.input_order().iter().enumerate().for_each(|(site, &p)| place[p as usize] = site);
        for (particle, &site) in whole.particles().iter().enumerate() {
            let site = site as usize;
            whole.neighbours(site, &mut |bond| {
                let there = whole.particles().partition_point(|&s| (s as usize) < bond.site);
                let cut = cracks.iter().any(|(c, e)| crosses(cell(site), cell(bond.site), *c, e));
                let found = [
                    lattice.is_bonded(site, bond.site),
                    lattice.is_bonded(bond.site, site),
                    cloud.is_bonded(place[particle], place[there]),
                    cloud.is_bonded(place[there], place[particle]),
                ];
                assert_eq!(found, [!cut; 4], "{:?} to {:?}, {cuts:?}", cell(site), cell(bond.site));
            });
        }
    }
}

fn scales() -> impl Strategy<Value = (f64, f64)> {
    let spacing = prop::sample::select(vec![1.0, 0.1, 1.0 / 3.0, 2e-3, 7e-9, 300.0]);
    (spacing, prop::sample::select(vec![0.0, 0.5, -3.1, 211.7])).prop_map(|(s, shift)| (s, s * shift))
}

/// Corners and edges of plane cracks, in quarters of the spacing.
fn segments() -> impl Strategy<Value = ([i64; 2], [i64; 2])> {
    (prop::array::uniform2(-5..30_i64), prop::array::uniform2(-24..24_i64))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn tips_anywhere_in_a_sheet(
        scale in scales(),
        cracks in prop::collection::vec(segments(), 1..3),
    ) {
        let cracks = cracks.into_iter().filter(|(_, edge)| *edge != [0, 0]);
        let cracks: Vec<_> = cracks.map(|(corner, edge)| (corner, vec![edge])).collect();
        // two cracks may go on from each other's tips: a test of its own
        cracks.iter().for_each(|crack| check([7, 6], scale, std::slice::from_ref(crack)));
    }

    #[test]
    fn rims_anywhere_in_a_solid(
        scale in scales(),
        corner in prop::array::uniform3(-3..16_i64),
        edges in prop::array::uniform2(prop::array::uniform3(-14..14_i64)),
    ) {
        let [a, b] = edges;
        let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        prop_assume!(cross != [0; 3]);
        check([4, 4, 3], scale, &[(corner, edges.to_vec())]);
    }
}

/// A sheet of 24 × 60 mm with a crack from (0, 30) to (6, 30) mm: 192 directed bonds cross it and 12 pass
/// through its tip, which must all stay for forces to sum to zero.
#[test]
fn a_tip_on_bond_lines() {
    let body = Body::<2>::solid([24, 60], 1e-3, 3.015);
    let Built { mut lattice, on_lattice, points, .. } = body.build();
    let all = lattice.directed_bonds();
    assert_eq!(all, 37_332);
    let cells = lattice.lattice().clone();
    let pairs = body.pairs(&points);
    let u = Random(3).vectors(points.len(), 1e-4);
    let law = Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
    let fit = fit(&*law, stretch_range(&pairs, &u));
    for (from, to) in [(0.0, 6e-3), (6e-3, 0.0)] {
        let cut = Cut { corner: [from, 0.03], edges: [[to - from, 0.0], [0.0; 2]] };
        lattice = LatticeBonds::new(cells.clone(), 3.015, VolumeCorrection::None, &[cut]).unwrap();
        assert_eq!(all - lattice.directed_bonds(), 192, "from {from} to {to}");
        lattice.set_law(&fit, MODULUS);
        let found = forces(&lattice, &on_lattice, &u);
        let size: f64 = found.iter().map(|f| norm(*f)).sum();
        for d in 0..2 {
            let sum: f64 = found.iter().map(|f| f[d]).sum();
            // rounding of 1440 sums
            assert!(sum.abs() < 1e-12 * size, "{sum:e} of {size:e}");
        }
    }
}

//! Kernels of solids against plain loops over bonds, and the energy that a breaking bond releases.

use crate::bodies::{Random, scatter};
use crate::solids::{displaced, neo_hooke, rubber};
use evidence::at_most;
use peri::bonds::{BodyGeometry, BondDamage, LatticeBonds, Overstretched, StretchRange, VolumeCorrection};
use peri::calibrate::Space;
use peri::field::Field;
use peri::geometry::{Operation, Shape, lattice};
use peri::material::{Family, Material, NonlocalSolid, PointLaw, Pointwise, SolverMaterial};

/// Solid by plain loops over bonds, without its kernels.
pub struct PlainLoops<M>(pub M);

impl<const D: usize, M: Material<D>> Material<D> for PlainLoops<M> {
    type Point = M::Point;

    fn begin(&self, family: &Family<D>) -> M::Point {
        self.0.begin(family)
    }
    fn prepare(&self, family: &Family<D>, point: &mut M::Point) {
        self.0.prepare(family, point);
    }
    fn force(&self, bond: &peri::material::Bond<D>, own: &M::Point, other: &M::Point) -> [f64; D] {
        self.0.force(bond, own, other)
    }
    fn energy(&self, family: &Family<D>, point: &M::Point) -> f64 {
        self.0.energy(family, point)
    }
    fn stiffness(&self, family: &Family<D>, points: &[M::Point]) -> f64 {
        self.0.stiffness(family, points)
    }
    fn micromodulus(&self, bonds: &dyn BodyGeometry<D>) -> f64 {
        self.0.micromodulus(bonds)
    }
}

/// Kernels agree with plain loops on a body with a hole: intact, cut, and severed until particles have
/// springs or no bond.
fn kernels_are_plain_loops<const D: usize>(space: Space, side: usize, volume: VolumeCorrection) {
    let mut body = vec![Operation::Add(Shape::Box { min: [0.0; D], max: [side as f64; D] })];
    body.push(Operation::Cut(Shape::Ball { centre: [0.5 * side as f64; D], radius: 1.6 }));
    let mut bonds = LatticeBonds::new(lattice(&body, 1.0, 1.0).unwrap(), 3.015, volume, &[]).unwrap();
    let sites: Vec<usize> = bonds.particles().iter().map(|&site| site as usize).collect();
    let placed: Vec<[f64; D]> = sites.iter().map(|&site| displaced(bonds.position(site))).collect();
    let displacement = scatter(bonds.sites(), &sites, &placed);
    let mut fast = rubber::<D>(space, 10.0).respond(&bonds);
    let mut plain = PlainLoops(rubber::<D>(space, 10.0)).respond(&bonds);
    let mut random = Random(7);
    let rest = StretchRange::REST;
    for severed in [-1.0, -0.4, 0.6, 1.0] {
        let mut list = Vec::new();
        for &site in &sites {
            // both ends of a bond, and all bonds of the first particles in the last round
            let alone = severed == 1.0 && site < sites[sites.len() / 2];
            bonds.neighbours(site, &mut |bond| {
                if site < bond.site && (alone || random.next() < severed && severed < 1.0) {
                    let entry = |site: usize, index| Overstretched {
                        site: site as u32,
                        index,
                        elongation: 0.0,
                        length: 1.0,
                        weight: 1.0,
                    };
                    list.push(entry(site, bond.index));
                    let count = bonds.stencil().offsets.len() as u32;
                    list.push(entry(bond.site, count - 1 - bond.index));
                }
            });
        }
        list.sort_by_key(|bond| bond.site);
        bonds.break_bonds(&list);
        let mut found = Vec::new();
        for material in [&mut fast, &mut plain] {
            material.prepare(&bonds, &displacement);
            let (mut force, mut seen) = (Field::<D>::zeros(bonds.sites()), rest);
            for (chunk, mut part) in force.chunks_mut().into_iter().enumerate() {
                material.force(&bonds, &displacement, chunk * peri::field::CHUNK, &mut part, Some(&mut seen));
            }
            found.push((force, seen, material.energy(&bonds, &displacement, rest)));
        }
        let scale =
            sites.iter().flat_map(|&site| found[1].0.get(site)).fold(1e-12_f64, |m, x| m.max(x.abs()));
        for &site in &sites {
            let (a, b) = (found[0].0.get(site), found[1].0.get(site));
            for d in 0..D {
                assert!((a[d] - b[d]).abs() < 1e-12 * scale, "{space:?} {severed} {site}: {a:?} {b:?}");
            }
        }
        assert!((found[0].2 - found[1].2).abs() <= 1e-12 * found[1].2.abs(), "{severed}: {found:?}");
        let off = |a: f64, b: f64| (a - b).abs() < 1e-13;
        assert!(off(found[0].1.low, found[1].1.low) && off(found[0].1.high, found[1].1.high), "{severed}");
    }
}

#[test]
fn kernels_of_solids_are_plain_loops() {
    for volume in [VolumeCorrection::None, VolumeCorrection::Linear] {
        kernels_are_plain_loops::<2>(Space::PlaneStrain, 11, volume);
        kernels_are_plain_loops::<3>(Space::Solid, 7, volume);
    }
}

/// A bond of 1/196 of its families releases the predicted energy, up to terms of second order in that
/// fraction.
#[test]
fn a_broken_bond_releases_its_energy() {
    fn off<L: PointLaw<2> + Clone>(solid: NonlocalSolid<L>) -> f64 {
        let body = [Operation::Add(Shape::Box { min: [0.0; 2], max: [22.0; 2] })];
        let lattice = lattice(&body, 1.0, 1.0).unwrap();
        let mut bonds = LatticeBonds::new(lattice, 8.015, VolumeCorrection::None, &[]).unwrap();
        let sites: Vec<usize> = bonds.particles().iter().map(|&site| site as usize).collect();
        let placed: Vec<[f64; 2]> = sites.iter().map(|&site| displaced(bonds.position(site))).collect();
        let displacement = scatter(bonds.sites(), &sites, &placed);
        let count = bonds.stencil().offsets.len() as u32;
        // a particle with every bond, and one of its bonds
        let site = *sites.iter().find(|&&site| bonds.position(site) == [10.5, 10.5]).unwrap();
        let mut found = None;
        bonds.neighbours(site, &mut |bond| found = if bond.bond == [3.0, 2.0] { Some(bond) } else { found });
        let bond = found.unwrap();
        let seen = peri::material::Bond::new(site, &bond, &displacement);
        let mut states = Pointwise::new(solid.clone(), &bonds);
        let before = states.energy(&bonds, &displacement, StretchRange::REST);
        let end = |end: usize| {
            let point = &states.points()[end];
            let weighed = solid.energy(&Family::new(&bonds, &displacement, end), point);
            solid.released_energy(&seen, point, weighed).unwrap()
        };
        let said = (end(site) + end(bond.site)) / f64::from(count);
        let entry = |site: usize, index| Overstretched {
            site: site as u32,
            index,
            elongation: 0.0,
            length: 1.0,
            weight: 1.0,
        };
        bonds.break_bonds(&[entry(site, bond.index), entry(bond.site, count - 1 - bond.index)]);
        let released = before - states.energy(&bonds, &displacement, StretchRange::REST);
        (released / said - 1.0).abs()
    }
    let worst = off(rubber::<2>(Space::PlaneStrain, 5.0)).max(off(neo_hooke::<2>(Space::PlaneStrain, 5.0)));
    at_most("released_energy_of_a_bond", worst, 0.03);
}

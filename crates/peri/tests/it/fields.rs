//! Parameters as fields over the particles: bars of two halves, whose strains and breaks are those of springs
//! in series.

use crate::bodies::{Body, MODULUS, hold};
use crate::linear_solid::LinearSolid;
use evidence::near;
use peri::bonds::Bonds;
use peri::correction::bond_factors;
use peri::material::{BondMaterial, Material, Property};
use peri::potential::LinearBond;
use peri::solver::{Breaking, Lbfgs, Method, Policy, State, System};

/// Length of the bar, m.
const LENGTH: f64 = 9.0;

/// Returns the state of a bar pulled by `strain` along x.
fn pulled(
    bonds: &mut dyn Bonds<2>,
    material: impl Material<2>,
    strain: f64,
    breaking: Option<Breaking>,
) -> State<2> {
    let loads = hold(bonds, |[x, _]| match x {
        x if x < 0.3 => Some((1, [0.0; 2])),
        x if x > LENGTH - 0.3 => Some((1, [strain * LENGTH, 0.0])),
        _ => None,
    });
    let mut state = State::new(bonds.sites());
    let mut system = System::new(bonds, material, &loads, &[1.0]);
    system.breaking = breaking;
    let method = Lbfgs { tolerance: 1e-6, ..Default::default() };
    method.solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(())).unwrap();
    state
}

/// Returns the strain along the middle of the bar between two positions.
fn strain(bonds: &dyn Bonds<2>, state: &State<2>, from: f64, to: f64) -> f64 {
    let at = |x: f64| {
        let near = |&site: &u32| {
            let p = bonds.position(site as usize);
            (p[0] - x).abs() < 0.06 && (p[1] - 0.35).abs() < 0.06
        };
        let site = bonds.particles().iter().copied().find(near).unwrap() as usize;
        (bonds.position(site)[0], state.displacement.get(site)[0])
    };
    let ((x, u), (y, v)) = (at(from), at(to));
    (v - u) / (y - x)
}

fn right_half(bonds: &dyn Bonds<2>, stiffness: f64) -> Property {
    Property::new(bonds, |_, [x, _]| if x > 0.5 * LENGTH { stiffness } else { 1.0 })
}

/// A uniform field is a number and needs no factors.
#[test]
fn a_constant_is_no_field() {
    let built = Body::<2>::solid([9, 7], 0.1, 3.015).build();
    let same = Property::new(&built.lattice, |_, _| 3.0);
    assert_eq!(same, 3.0.into());
    assert_eq!(bond_factors(&built.lattice, None, &1.0.into()), None);
    let field = right_half(&built.lattice, 1.0);
    assert_eq!(field.uniform(), Some(1.0));
}

/// Two halves of stiffness 1 and 3 in series have strains as 3 to 1, with bond laws on both paths and the
/// state-based solid from outside the crate.
#[test]
fn halves_in_series() {
    let ratio = |bonds: &dyn Bonds<2>, state: &State<2>| {
        strain(bonds, state, 1.5, 3.0) / strain(bonds, state, 6.0, 7.5)
    };
    let body = Body::<2>::solid([90, 7], 0.1, 3.015);
    let mut built = body.build();
    let bonds: [(&str, &mut dyn Bonds<2>); 2] =
        [("lattice", &mut built.lattice), ("cloud", &mut built.cloud)];
    for (path, bonds) in bonds {
        let factors = bond_factors(bonds, None, &right_half(bonds, 3.0)).unwrap();
        bonds.set_factors(factors);
        let state = pulled(bonds, BondMaterial::new(&LinearBond, MODULUS), 0.003, None);
        // 1.5 widths from ends and interface; second order in strains of half a percent
        near(&format!("halves_bonds_{path}"), ratio(bonds, &state), 3.0, 0.02);
    }
    let mut built = body.build();
    let [bulk, shear] = [9.0, 1.0].map(|size| {
        Property::new(&built.lattice, |_, [x, _]| if x > 0.5 * LENGTH { 3.0 * size } else { size })
    });
    let state = pulled(&mut built.lattice, LinearSolid { bulk, shear }, 0.003, None);
    near("halves_solid", ratio(&built.lattice, &state), 3.0, 0.02);
}

/// A row of weak particles loses the bonds that end at them, and no others.
#[test]
fn the_weaker_end_decides() {
    let body = Body::<2>::solid([90, 7], 0.1, 3.015);
    let weak = |x: f64| (6.0..6.1).contains(&x);
    for (stretch, breaks) in [(1.005, true), (1.05, false)] {
        let mut built = body.build();
        let bonds = &mut built.lattice;
        let count = |bonds: &dyn Bonds<2>| -> Vec<[u32; 2]> {
            let of = |&site: &u32| {
                let (mut all, mut strong) = (0, 0);
                bonds.neighbours(site as usize, &mut |bond| {
                    let ends = [site as usize, bond.site].map(|site| bonds.position(site)[0]);
                    all += 1;
                    strong += u32::from(!ends.into_iter().any(weak));
                });
                [all, strong]
            };
            bonds.particles().iter().map(of).collect()
        };
        let before = count(bonds);
        let field = Property::new(bonds, |_, [x, _]| if weak(x) { stretch } else { 1.5 });
        let breaking = Some(Breaking { criterion: field.into(), policy: Policy::AtEquilibrium });
        let state = pulled(bonds, BondMaterial::new(&LinearBond, MODULUS), 0.008, breaking);
        let after = count(bonds);
        assert_eq!(state.fracture.broken > 0, breaks, "{stretch}");
        let lost: u32 = before.iter().zip(&after).map(|(a, b)| a[0] - b[0]).sum();
        assert_eq!(u64::from(lost), 2 * state.fracture.broken);
        assert!(before.iter().zip(&after).all(|(a, b)| a[1] == b[1]), "a bond between strong ends broke");
        assert!((state.fracture.released > 0.0) == breaks);
    }
}

//! The γ crystal of polyamide 12, built from the lattice of Table 3.1.
//!
//! Table 3.1: a = 4.79 Å, b = 31.90 Å (chain axis), c = 9.58 Å, β = 120°, P2₁/c. The cell contains four
//! monomers, that is **two** chains (148 atoms, 1.034 g/cm³), not the four chains of the text
//! (formulation.md, chapter 3). With c = 2a and β = 120°, a and a + c are orthogonal: a box of 4.79 × 8.297 ×
//! 31.90 Å along x, y and z contains the same atoms.
//!
//! The chain has standard bond lengths and angles. All torsions are trans except the two beside the amide,
//! which are solved so that the 2₁ screw (half a turn and a rise of b/2) maps one monomer to the next. The
//! second chain is the inversion of the first through a point half-way along x and y. Parallel chains form
//! hydrogen-bonded rows along x; adjacent rows along y run in opposite directions.

use crate::Error;
use nalgebra::Vector3;

mod chain;

pub use chain::amide_torsions;
use chain::placed_monomer;

type Vec3 = Vector3<f64>;

/// Lattice of Table 3.1, Å.
pub const LATTICE: CrystalLattice = CrystalLattice { a: 4.79, b: 31.90, c: 9.58, beta: 120.0 };

/// Dalton per Å³ in g/cm³ (CODATA 2018: 1.66053906660e-24 g).
const DALTON_PER_CUBIC_ANGSTROM: f64 = 1.660_539_066_60;

/// Number of atoms of one monomer: N H, eleven CH₂, C O.
pub const ATOMS_OF_MONOMER: usize = 37;

/// Monoclinic lattice, Å and degrees; b is the unique axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CrystalLattice {
    /// Length of a, Å.
    pub a: f64,
    /// Length of b, along the chains, Å.
    pub b: f64,
    /// Length of c, Å.
    pub c: f64,
    /// Angle between a and c, degrees.
    pub beta: f64,
}

impl CrystalLattice {
    /// Returns the edges of the orthogonal cell of the same volume: |a|, the part of c normal to a, |b|.
    ///
    /// # Errors
    /// Returns [`Error::Parameter`] unless a and a + c are orthogonal (to 1e-9 of a²).
    pub fn orthogonal(&self) -> Result<[f64; 3], Error> {
        let beta = self.beta.to_radians();
        let product = self.a * self.a + self.a * self.c * beta.cos();
        if product.is_nan() || product.abs() > 1e-9 * self.a * self.a {
            let found = format!("a·(a + c) = {product} Å²");
            return Err(Error::parameter(
                "lattice",
                found,
                "0 (a and a + c orthogonal, e.g. c = 2a and β = 120°)",
            ));
        }
        Ok([self.a, self.c * beta.sin(), self.b])
    }
}

/// Chemical elements of polyamide, in the order of their LAMMPS types.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ChemicalElement {
    /// Carbon, type 1.
    C,
    /// Hydrogen, type 2.
    H,
    /// Oxygen, type 3.
    O,
    /// Nitrogen, type 4.
    N,
}

impl ChemicalElement {
    /// All elements, by type.
    pub const ALL: [Self; 4] = [Self::C, Self::H, Self::O, Self::N];

    /// Returns the standard atomic mass, g/mol.
    pub fn mass(self) -> f64 {
        [12.011, 1.008, 15.999, 14.007][self as usize]
    }

    /// Returns the covalent radius, Å (Cordero et al. 2008, <https://doi.org/10.1039/b801115j>).
    pub fn covalent_radius(self) -> f64 {
        [0.76, 0.31, 0.66, 0.71][self as usize]
    }
}

/// Periodic orthogonal box of atoms, Å.
#[derive(Debug, Clone, PartialEq)]
pub struct Crystal {
    /// Edges along x, y and z.
    pub lengths: [f64; 3],
    /// Elements and positions, wrapped into the box.
    pub atoms: Vec<(ChemicalElement, [f64; 3])>,
}

/// Free parameters of the packing.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Packing {
    /// Rotation of the chains about their axis, measured from N–H along x, degrees.
    pub setting: f64,
    /// Shift of the second chain along z from amides at the same level, Å. Zero has the lowest energy at 0 K
    /// in a ten-point scan with the Mattsson force field.
    pub shift: f64,
}

impl Crystal {
    /// Builds one cell: 148 atoms, two chains with two monomers each.
    ///
    /// # Errors
    /// Returns [`Error::Parameter`] for a lattice without orthogonal cell, or a rise b/2 that the chain
    /// cannot reach.
    pub fn unit_cell(lattice: &CrystalLattice, packing: Packing) -> Result<Self, Error> {
        let lengths = lattice.orthogonal()?;
        let rise = lattice.b / 2.0;
        let monomer = placed_monomer(rise, packing.setting)?;
        let turn = |p: &Vec3| Vec3::new(-p.x, -p.y, p.z + rise);
        let mut atoms = Vec::with_capacity(4 * ATOMS_OF_MONOMER);
        let centre = Vec3::new(lengths[0] / 2.0, lengths[1] / 2.0, packing.shift);
        for inverted in [false, true] {
            for second in [false, true] {
                for (element, position) in &monomer {
                    let p = if second { turn(position) } else { *position };
                    let p = if inverted { centre - p } else { p };
                    atoms.push((*element, wrap(p, lengths)));
                }
            }
        }
        Ok(Self { lengths, atoms })
    }

    /// Returns a supercell of `n` cells along x, y and z. The thesis' 8 × 4 × 2 cells have 9,472 atoms.
    ///
    /// # Errors
    /// Returns [`Error::Parameter`] for no cells or more than 10⁷ atoms.
    pub fn replicate(&self, n: [usize; 3]) -> Result<Self, Error> {
        let cells = n.iter().try_fold(1usize, |product, &n| product.checked_mul(n));
        let atoms = cells.and_then(|cells| cells.checked_mul(self.atoms.len()));
        let Some(atoms) = atoms.filter(|&atoms| atoms > 0 && atoms <= 10_000_000) else {
            return Err(Error::parameter("cells", format!("{n:?}"), "at least 1 each, up to 10⁷ atoms"));
        };
        let mut copy = Vec::with_capacity(atoms);
        for (i, j, k) in cell_indices(n) {
            let shift = [i, j, k].map(|i| i as f64);
            copy.extend(self.atoms.iter().map(|(element, p)| {
                (*element, [0, 1, 2].map(|axis| p[axis] + shift[axis] * self.lengths[axis]))
            }));
        }
        Ok(Self { lengths: [0, 1, 2].map(|axis| self.lengths[axis] * n[axis] as f64), atoms: copy })
    }

    /// Computes the density, g/cm³.
    pub fn density(&self) -> f64 {
        let mass: f64 = self.atoms.iter().map(|(element, _)| element.mass()).sum();
        mass * DALTON_PER_CUBIC_ANGSTROM / self.lengths.iter().product::<f64>()
    }

    /// Returns all bonds, with the vector from the first to the second atom: pairs closer than 1.2 times the
    /// sum of their covalent radii. Tests each pair with its 27 nearest images, so use it for unit cells
    /// only.
    pub fn bonds(&self) -> Vec<(usize, usize, Vec3)> {
        let mut bonds = Vec::new();
        for (i, (first, p)) in self.atoms.iter().enumerate() {
            for (j, (second, q)) in self.atoms.iter().enumerate().skip(i) {
                let reach = 1.2 * (first.covalent_radius() + second.covalent_radius());
                for (a, b, c) in cell_indices([3; 3]) {
                    let image = [a, b, c].map(|n| n as f64 - 1.0);
                    let d = [0, 1, 2].map(|axis| q[axis] - p[axis] + image[axis] * self.lengths[axis]);
                    let d = Vec3::from(d);
                    if d.norm() < reach && (i != j) {
                        bonds.push((i, j, d));
                    }
                }
            }
        }
        bonds
    }

    /// Returns the vectors to the bonded neighbours of each atom, Å.
    pub fn bonds_of_atoms(&self) -> Vec<Vec<Vec3>> {
        let mut of_atom = vec![Vec::new(); self.atoms.len()];
        for (i, j, d) in self.bonds() {
            of_atom[i].push(d);
            of_atom[j].push(-d);
        }
        of_atom
    }

    /// Returns the shortest and the longest bond between two elements, Å; ∞ and 0 without bonds.
    pub fn bond_lengths(&self, first: ChemicalElement, second: ChemicalElement) -> [f64; 2] {
        let mut range = [f64::INFINITY, 0.0_f64];
        for (i, j, d) in self.bonds() {
            let pair = [self.atoms[i].0, self.atoms[j].0];
            if pair == [first, second] || pair == [second, first] {
                range = [range[0].min(d.norm()), range[1].max(d.norm())];
            }
        }
        range
    }

    /// Returns the smallest and the largest bond angle at atoms of an element with `count` bonds, rad.
    pub fn angles(&self, element: ChemicalElement, count: usize) -> [f64; 2] {
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        let of_atom = self.bonds_of_atoms();
        for (_, own) in
            self.atoms.iter().zip(of_atom).filter(|((e, _), own)| *e == element && own.len() == count)
        {
            for (index, a) in own.iter().enumerate() {
                for angle in own[..index].iter().map(|b| a.angle(b)) {
                    range = [range[0].min(angle), range[1].max(angle)];
                }
            }
        }
        range
    }

    /// Counts the molecules: sets of atoms connected by bonds, also across the faces of the cell.
    pub fn molecules(&self) -> usize {
        let mut of: Vec<usize> = (0..self.atoms.len()).collect();
        for (i, j, _) in self.bonds() {
            let (from, to) = (of[i], of[j]);
            of.iter_mut().filter(|own| **own == from).for_each(|own| *own = to);
        }
        of.sort_unstable();
        of.dedup();
        of.len()
    }

    /// Returns a LAMMPS data file, `atom_style charge`, with zero charges (QEq sets them).
    pub fn lammps_data(&self, comment: &str) -> String {
        use std::fmt::Write;
        let mut text =
            format!("{}\n\n{} atoms\n4 atom types\n\n", comment.replace('\n', " "), self.atoms.len());
        for (length, axis) in self.lengths.iter().zip(["x", "y", "z"]) {
            let _ = writeln!(text, "0.0 {length:.10} {axis}lo {axis}hi");
        }
        text.push_str("\nMasses\n\n");
        for element in ChemicalElement::ALL {
            let _ = writeln!(text, "{} {}", element as usize + 1, element.mass());
        }
        text.push_str("\nAtoms # charge\n\n");
        for (index, (element, [x, y, z])) in self.atoms.iter().enumerate() {
            let kind = *element as usize + 1;
            let _ = writeln!(text, "{} {kind} 0.0 {x:.8} {y:.8} {z:.8}", index + 1);
        }
        text
    }
}

fn cell_indices(n: [usize; 3]) -> impl Iterator<Item = (usize, usize, usize)> {
    (0..n[0]).flat_map(move |i| (0..n[1]).flat_map(move |j| (0..n[2]).map(move |k| (i, j, k))))
}

fn wrap(p: Vec3, lengths: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| {
        let inside = p[axis].rem_euclid(lengths[axis]);
        // the rounding error of a small negative number wraps to the upper edge
        if inside >= lengths[axis] { 0.0 } else { inside }
    })
}

#[cfg(test)]
mod tests {
    use super::chain::{backbone, screw};
    use super::*;
    use std::collections::BTreeMap;

    fn cell() -> Crystal {
        Crystal::unit_cell(&LATTICE, Packing::default()).unwrap()
    }

    /// formulation.md, chapter 3: 148 atoms, 1.034 g/cm³, 4.79 × 8.297 × 31.90 Å; 8 × 4 × 2 cells have 9,472
    /// atoms.
    #[test]
    fn density_and_size() {
        let cell = cell();
        assert_eq!(cell.atoms.len(), 148);
        assert!((cell.density() - 1.034).abs() < 5e-4, "{}", cell.density());
        assert!((cell.lengths[1] - 8.297).abs() < 5e-4);
        let whole = cell.replicate([8, 4, 2]).unwrap();
        assert_eq!(whole.atoms.len(), 9472);
        // §3.2: 38.3 × 33.2 × 63.8 Å
        for (length, expected) in whole.lengths.iter().zip([38.3, 33.2, 63.8]) {
            assert!((length - expected).abs() < 0.05);
        }
        assert!((whole.density() / cell.density() - 1.0).abs() < 1e-12);
    }

    /// PROVENANCE.md: torsions of 116° and −112° beside the amide (or their mirror image).
    #[test]
    fn torsions_are_those_of_provenance() {
        let [first, second] = amide_torsions(15.95).unwrap();
        assert!((first.abs() - 116.0).abs() < 1.0 && (second.abs() - 112.0).abs() < 1.0, "{first} {second}");
        assert!(first * second < 0.0);
        let screw = screw(&backbone([first, second]));
        assert!((screw.rise - 15.95).abs() < 1e-9 && screw.cosine < -1.0 + 1e-12);
        for rise in [20.0, f64::NAN, 0.0, -1.0] {
            assert!(amide_torsions(rise).is_err(), "{rise}");
        }
    }

    /// Each C has 4 neighbours (3 in C=O), N 3, O and H 1. Lengths and angles are the prescribed ones, also
    /// across the screw and the periodic boundary, where only the solved torsions ensure it.
    #[test]
    fn bonds_and_angles() {
        let cell = cell();
        let bonds = cell.bonds();
        assert_eq!(bonds.len(), 148);
        let mut of_atom = vec![Vec::new(); 148];
        let mut kinds: BTreeMap<(ChemicalElement, ChemicalElement), Vec<f64>> = BTreeMap::new();
        for (i, j, d) in &bonds {
            of_atom[*i].push(*d);
            of_atom[*j].push(-d);
            let (a, b) = (cell.atoms[*i].0, cell.atoms[*j].0);
            kinds.entry((a.min(b), a.max(b))).or_default().push(d.norm());
        }
        let counts: Vec<(ChemicalElement, usize)> =
            cell.atoms.iter().zip(&of_atom).map(|((e, _), n)| (*e, n.len())).collect();
        for (element, allowed) in [(ChemicalElement::H, 1), (ChemicalElement::O, 1), (ChemicalElement::N, 3)]
        {
            assert!(counts.iter().filter(|(e, _)| *e == element).all(|(_, n)| *n == allowed));
        }
        let carbons = |n| counts.iter().filter(|c| **c == (ChemicalElement::C, n)).count();
        assert_eq!((carbons(4), carbons(3)), (44, 4));
        for (pair, lengths) in [
            ((ChemicalElement::C, ChemicalElement::C), vec![1.53, 1.515]),
            ((ChemicalElement::C, ChemicalElement::H), vec![1.095]),
            ((ChemicalElement::C, ChemicalElement::O), vec![1.235]),
            ((ChemicalElement::C, ChemicalElement::N), vec![1.335, 1.455]),
            ((ChemicalElement::H, ChemicalElement::N), vec![1.010]),
        ] {
            for found in &kinds[&pair] {
                assert!(lengths.iter().any(|length| (length - found).abs() < 1e-6), "{pair:?} {found}");
            }
        }
        assert_eq!(kinds.len(), 5);
        for ((element, _), bonds) in cell.atoms.iter().zip(&of_atom) {
            for (index, a) in bonds.iter().enumerate() {
                for b in &bonds[..index] {
                    let angle = a.angle(b).to_degrees();
                    let allowed = if *element == ChemicalElement::C && bonds.len() == 4 {
                        107.0..=112.6
                    } else {
                        115.9..=123.0
                    };
                    assert!(allowed.contains(&angle), "{element:?} {angle}");
                }
            }
        }
    }

    /// Atoms of different chains are at least 1.6 Å apart (H…O of the hydrogen bond is near 1.9 Å), and each
    /// N–H has an O of another chain within 2.6 Å along x.
    #[test]
    fn hydrogen_bonds_and_contacts() {
        let cell = cell();
        let mut least = f64::INFINITY;
        let mut bonded = 0;
        let bonds = cell.bonds();
        for (i, (first, p)) in cell.atoms.iter().enumerate() {
            let mut holds = false;
            for (j, (second, q)) in cell.atoms.iter().enumerate() {
                for (a, b, c) in cell_indices([3; 3]) {
                    let image = [a, b, c].map(|n| n as f64 - 1.0);
                    let d = Vec3::from([0, 1, 2].map(|k| q[k] - p[k] + image[k] * cell.lengths[k]));
                    let other = !bonds.iter().any(|(m, n, v)| {
                        ((*m, *n) == (i, j) && (v - d).norm() < 1e-9)
                            || ((*m, *n) == (j, i) && (v + d).norm() < 1e-9)
                    });
                    if d.norm() > 1e-9 && other && *first != ChemicalElement::H {
                        // 1–3 neighbours of heavy atoms are at least 2.0 Å apart
                        least = least.min(d.norm());
                    }
                    let amide = bonds.iter().any(|(m, n, _)| {
                        (*n == i && cell.atoms[*m].0 == ChemicalElement::N)
                            || (*m == i && cell.atoms[*n].0 == ChemicalElement::N)
                    });
                    holds |= *first == ChemicalElement::H
                        && amide
                        && *second == ChemicalElement::O
                        && d.norm() < 2.6;
                }
            }
            bonded += usize::from(holds);
        }
        assert_eq!(bonded, 4);
        assert!(least > 1.6, "{least}");
    }

    #[test]
    fn data_file_has_the_format_of_lammps() {
        let text = cell().lammps_data("γ-PA12");
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "γ-PA12");
        assert_eq!(lines[2..4], ["148 atoms", "4 atom types"]);
        assert!(text.contains("\n0.0 31.9000000000 zlo zhi\n") && text.contains("\n4 14.007\n"));
        assert_eq!(text.lines().skip_while(|line| *line != "Atoms # charge").count(), 150);
    }

    #[test]
    fn wrong_cells() {
        let oblique = CrystalLattice { beta: 110.0, ..LATTICE };
        assert!(Crystal::unit_cell(&oblique, Packing::default()).is_err());
        for n in [[0, 1, 1], [1000, 1000, 1000], [usize::MAX, 2, 2]] {
            assert!(cell().replicate(n).is_err());
        }
    }
}

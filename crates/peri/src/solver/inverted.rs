//! Refuses prescribed displacements that no body can follow: grips that pass through each other, regions
//! turned inside out.

use super::load::Loads;
use super::system::System;
use crate::bonds::BodyGeometry;
use crate::error::Error;
use crate::geometry::determinant;
use std::collections::{BTreeMap, HashMap};

/// Distance across their relative motion, in spacings, within which a particle of one grip passes through one
/// of another.
const PASSING_DISTANCE: f64 = 0.75;
/// Load factors between rest and each prescribed one at which the volume of a cell is computed.
const BETWEEN: u32 = 100;
/// Most grips that move rigidly: displacements of more follow a field.
const MOST_GRIPS: usize = 16;
/// Allowed alternatives, for messages.
pub const INVERTS: &str =
    "displacements that leave the body right side out; reduce them, or hold the regions farther apart";
/// D λ_min of the shape tensor below which neighbours do not span space.
const LEAST_SHAPE: f64 = 0.1;

/// Describes prescribed displacements that press a body through itself at any of the load factors `factors`,
/// or between them; `None` if there are none.
pub fn inverted<const D: usize>(
    bonds: &dyn BodyGeometry<D>,
    loads: &Loads<D>,
    factors: &[f64],
) -> Option<String> {
    loads.displacement.as_ref()?;
    // a rotation is not proportional to its end
    if !loads.is_proportional() {
        return None;
    }
    passing(bonds, loads, factors).or_else(|| turned(bonds, loads, factors))
}

/// Describes a mean displacement gradient that flattens the cell or turns it inside out at any of the load
/// factors `factors`, or before them; `None` if there is none.
pub fn flattened<const D: usize>(loads: &Loads<D>, factors: &[f64]) -> Option<String> {
    let gradient = loads.mean_gradient.as_ref()?;
    let volume = |factor: f64| {
        let entry = |a: usize, b: usize| f64::from(u8::from(a == b)) + factor * gradient[a][b];
        determinant::<D>(&std::array::from_fn(|a| std::array::from_fn(|b| entry(a, b))))
    };
    let between = |&end: &f64| (1..=BETWEEN).map(move |k| end * f64::from(k) / f64::from(BETWEEN));
    let factor = factors.iter().flat_map(between).find(|&factor| volume(factor) <= 0.0)?;
    Some(format!(
        "a mean displacement gradient of {gradient:?}: at load factor {factor:.2} the cell has {:.3} of its \
         volume",
        volume(factor)
    ))
}

/// Finds grips of one displacement each that pass through each other.
fn passing<const D: usize>(bonds: &dyn BodyGeometry<D>, loads: &Loads<D>, factors: &[f64]) -> Option<String> {
    let field = loads.displacement.as_ref()?;
    let mut grips: BTreeMap<(u8, [u64; D]), Vec<usize>> = BTreeMap::new();
    for site in bonds.particles().iter().map(|&site| site as usize) {
        let held = loads.constrained(site);
        if held != 0 {
            let u = field.get(site);
            let key = std::array::from_fn(|d| if held >> d & 1 == 1 { (u[d] + 0.0).to_bits() } else { 0 });
            grips.entry((held, key)).or_default().push(site);
            if grips.len() > MOST_GRIPS {
                return None;
            }
        }
    }
    let grips: Vec<(u8, [f64; D], Vec<usize>)> =
        grips.into_iter().map(|((held, bits), sites)| (held, bits.map(f64::from_bits), sites)).collect();
    let [low, high] = factors.iter().fold([0.0_f64, 0.0_f64], |[low, high], &f| [low.min(f), high.max(f)]);
    for (first, (own_held, own, here)) in grips.iter().enumerate() {
        for (held, other, there) in &grips[first + 1..] {
            // a free component lets it move
            let both = own_held & held;
            let apart: [f64; D] =
                std::array::from_fn(|d| if both >> d & 1 == 1 { other[d] - own[d] } else { 0.0 });
            if let Some((at, factor)) = passes(bonds, [here, there], apart, [low, high]) {
                let at: Vec<String> = at.iter().map(|x| format!("{:.4}", x * 1e3)).collect();
                let [own, other] = [own, other].map(|u| u.map(|x| format!("{:.4}", x * 1e3)).join(", "));
                return Some(format!(
                    "prescribed displacements of ({own}) mm and ({other}) mm: from load factor \
                     {factor:.4} on the two regions pass through each other at X = ({}) mm",
                    at.join(", ")
                ));
            }
        }
    }
    None
}

/// A particle of the first grip: position along the relative motion and across it, m, and its site.
type Passed<const D: usize> = (f64, [f64; D], usize);

/// Finds the point and load factor from which particles of the second grip, which moves by `apart` against
/// the first, pass through it.
fn passes<const D: usize>(
    bonds: &dyn BodyGeometry<D>,
    [here, there]: [&[usize]; 2],
    apart: [f64; D],
    [low, high]: [f64; 2],
) -> Option<([f64; D], f64)> {
    let spacing = bonds.spacing();
    let length = apart.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length * (high - low) < spacing {
        return None;
    }
    let along = apart.map(|x| x / length);
    // position along the motion, and the cell across it
    let place = |site: usize| {
        let x = bonds.position(site);
        let s: f64 = (0..D).map(|d| x[d] * along[d]).sum();
        let across: [f64; D] = std::array::from_fn(|d| x[d] - s * along[d]);
        (s, across)
    };
    let cell = |across: &[f64; D]| across.map(|x| (x / spacing).floor() as i64);
    let mut cells: HashMap<[i64; D], Vec<Passed<D>>> = HashMap::new();
    for &site in here {
        let (s, across) = place(site);
        cells.entry(cell(&across)).or_default().push((s, across, site));
    }
    let mut first: Option<([f64; D], f64)> = None;
    for &site in there {
        let (s, across) = place(site);
        let middle = cell(&across);
        for code in 0..3_usize.pow(D as u32) {
            let near = std::array::from_fn(|d| middle[d] + (code / 3_usize.pow(d as u32) % 3) as i64 - 1);
            for (other, off, at) in cells.get(&near).into_iter().flatten() {
                let distance = (0..D).map(|d| (across[d] - off[d]).powi(2)).sum::<f64>().sqrt();
                let factor = (other - s) / length;
                let meets = distance < PASSING_DISTANCE * spacing && (other - s).abs() > 0.5 * spacing;
                if meets && factor > low && factor < high {
                    let sooner = first.is_none_or(|(_, known)| factor.abs() < known.abs());
                    first = if sooner { Some((bonds.position(*at), factor)) } else { first };
                }
            }
        }
    }
    first
}

/// Finds particles whose whole neighbourhood is prescribed and has det F ≤ 0 at a load factor.
fn turned<const D: usize>(bonds: &dyn BodyGeometry<D>, loads: &Loads<D>, factors: &[f64]) -> Option<String> {
    let field = loads.displacement.as_ref()?;
    let all = (1_u8 << D) - 1;
    let mut known = Vec::new();
    for site in bonds.particles().iter().map(|&site| site as usize) {
        if loads.constrained(site) != all {
            continue;
        }
        let own = field.get(site);
        let (mut shape, mut moment) = ([[0.0; 3]; 3], [[0.0; 3]; 3]);
        let mut weight = 0.0;
        bonds.neighbours(site, &mut |bond| {
            if loads.constrained(bond.site) != all {
                return;
            }
            let other = field.get(bond.site);
            let share = bond.volume / (bond.length * bond.length);
            weight += bond.volume;
            for a in 0..D {
                for b in 0..D {
                    shape[a][b] += share * bond.bond[a] * bond.bond[b];
                    moment[a][b] += share * (other[a] - own[a]) * bond.bond[b];
                }
            }
        });
        let tensor = |rows: &[[f64; 3]; 3], third: f64| {
            nalgebra::Matrix3::from_fn(|a, b| {
                if a < D && b < D {
                    rows[a][b]
                } else if a == b {
                    third
                } else {
                    0.0
                }
            })
        };
        let shape = tensor(&shape, 1.0) / weight;
        let shape = nalgebra::Matrix3::from_fn(|a, b| if a == b && a >= D { 1.0 } else { shape[(a, b)] });
        let spans = weight > 0.0 && D as f64 * shape.symmetric_eigenvalues().min() > LEAST_SHAPE;
        let Some(inverse) = shape.try_inverse().filter(|_| spans) else { continue };
        let gradient = tensor(&moment, 0.0) / weight * inverse;
        // particles of one grip are alike
        if gradient.norm() == 0.0 || known.contains(&gradient) {
            continue;
        }
        let determinant = |factor: f64| (nalgebra::Matrix3::identity() + gradient * factor).determinant();
        if let Some(&factor) = factors.iter().find(|&&factor| determinant(factor) <= 0.0) {
            let at: Vec<String> = bonds.position(site).iter().map(|x| format!("{:.4}", x * 1e3)).collect();
            return Some(format!(
                "prescribed displacements with det F = {:.3} at X = ({}) mm and load factor {factor:.4}: \
                they turn the body inside out",
                determinant(factor),
                at.join(", ")
            ));
        }
        if known.len() < MOST_GRIPS {
            known.push(gradient);
        }
    }
    None
}

impl<const D: usize> System<'_, D> {
    /// Refuses prescribed displacements that press the body through itself.
    ///
    /// # Errors
    /// [`Error::Geometry`] with the regions and the load factor.
    pub(super) fn refuse_inverted(&self, factors: &[f64]) -> Result<(), Error> {
        match flattened(&self.loads, factors).or_else(|| inverted(&*self.bonds, &self.loads, factors)) {
            Some(found) => Err(Error::geometry(format!("found {found}; allowed: {INVERTS}"))),
            None => Ok(()),
        }
    }
}

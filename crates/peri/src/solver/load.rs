//! Loads and supports: body forces and prescribed displacement components, proportional to one load factor.

use crate::bonds::Bonds;
use crate::field::Field;

/// What is prescribed in a region at load factor 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Support<const D: usize> {
    /// Prescribed displacement components, m; `None` is free.
    pub displacement: [Option<f64>; D],
    /// Body force density, N/m³.
    pub body_force: [f64; D],
}

/// The loads of a body, slot by slot. What no region asks for is not stored.
#[derive(Clone, Debug, Default)]
pub struct Loads<const D: usize> {
    /// Body force density at load factor 1, N/m³.
    pub body_force: Option<Field<D>>,
    /// Prescribed displacement at load factor 1, m, where held.
    pub displacement: Option<Field<D>>,
    /// Bit d of a slot: component d is held. Empty where nothing is.
    pub held: Vec<u8>,
}

impl<const D: usize> Loads<D> {
    /// Collects regions, each given as its slots and what holds there; body forces add up, the last displacement wins.
    pub fn new(slots: usize, regions: &[(Vec<u32>, Support<D>)]) -> Self {
        let mut loads = Self { body_force: None, displacement: None, held: Vec::new() };
        for (members, support) in regions {
            if support.body_force.iter().any(|&b| b != 0.0) {
                let field = loads.body_force.get_or_insert_with(|| Field::zeros(slots));
                for &slot in members {
                    let old = field.get(slot as usize);
                    field.set(slot as usize, std::array::from_fn(|d| old[d] + support.body_force[d]));
                }
            }
            if support.displacement.iter().any(Option::is_some) {
                let field = loads.displacement.get_or_insert_with(|| Field::zeros(slots));
                loads.held.resize(slots, 0);
                for &slot in members {
                    let mut value = field.get(slot as usize);
                    for d in 0..D {
                        if let Some(prescribed) = support.displacement[d] {
                            value[d] = prescribed;
                            loads.held[slot as usize] |= 1 << d;
                        }
                    }
                    field.set(slot as usize, value);
                }
            }
        }
        loads
    }

    /// Bits of the held components of a slot.
    pub fn held(&self, slot: usize) -> u8 {
        self.held.get(slot).copied().unwrap_or(0)
    }

    /// The affine field u_d = a_d + Σ_e B_de X_e closest (least squares, least norm) to the prescribed displacements:
    /// a predictor that moves the whole body with its grips. Zero where nothing is prescribed.
    pub fn affine_predictor(&self, bonds: &dyn Bonds<D>) -> [[f64; 4]; D] {
        let mut result = [[0.0; 4]; D];
        let Some(field) = &self.displacement else { return result };
        for d in 0..D {
            let held: Vec<usize> = bonds
                .particles()
                .iter()
                .map(|&slot| slot as usize)
                .filter(|&slot| self.held(slot) >> d & 1 == 1)
                .collect();
            let mut normal = nalgebra::Matrix4::<f64>::zeros();
            let mut right = nalgebra::Vector4::<f64>::zeros();
            // lengths in units of the body, so that the pseudo-inverse's threshold means something
            let scale =
                held.iter().flat_map(|&s| bonds.position(s)).fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
            for &slot in &held {
                let position = bonds.position(slot);
                let mut row = nalgebra::Vector4::zeros();
                row[0] = 1.0;
                for e in 0..D {
                    row[e + 1] = position[e] / scale;
                }
                normal += row * row.transpose();
                right += row * field.get(slot)[d];
            }
            let count = held.len().max(1) as f64;
            if let Ok(inverse) = (normal / count).pseudo_inverse(1e-10) {
                let solution = inverse * right / count;
                result[d][0] = solution[0];
                for e in 0..D {
                    result[d][e + 1] = solution[e + 1] / scale;
                }
            }
        }
        result
    }
}

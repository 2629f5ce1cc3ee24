//! Conformation of one chain: backbone, screw from monomer to monomer, hydrogens and oxygens.

use super::{ATOMS_OF_MONOMER, ChemicalElement, Vec3};
use crate::Error;
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion};

/// Bond lengths, Å, and angles, degrees: standard values of amides and alkanes, as in the project's data.
mod geometry {
    pub const C_C: f64 = 1.530;
    pub const C_CO: f64 = 1.515;
    pub const CO_N: f64 = 1.335;
    pub const N_C: f64 = 1.455;
    pub const C_O: f64 = 1.235;
    pub const N_H: f64 = 1.010;
    pub const C_H: f64 = 1.095;
    pub const C_C_C: f64 = 112.5;
    pub const C_C_CO: f64 = 112.0;
    pub const C_CO_N: f64 = 116.0;
    pub const CO_N_C: f64 = 122.5;
    pub const N_C_C: f64 = 112.0;
    pub const H_C_H: f64 = 107.5;
}

/// Number of backbone atoms of a monomer: N, eleven CH₂, CO.
const BACKBONE: usize = 13;

/// Returns the backbone frames of four monomers: origin at the atom, x along the bond that leads to it.
pub(super) fn backbone(torsions: [f64; 2]) -> Vec<Isometry3<f64>> {
    use geometry::{C_C, C_C_C, C_C_CO, C_CO, C_CO_N, CO_N, CO_N_C, N_C, N_C_C};
    let mut frames = vec![Isometry3::identity()];
    for atom in 1..4 * BACKBONE {
        let length = match atom % BACKBONE {
            0 => CO_N,
            1 => N_C,
            12 => C_CO,
            _ => C_C,
        };
        // angle at the previous atom
        let angle = match (atom - 1) % BACKBONE {
            0 => CO_N_C,
            1 => N_C_C,
            11 => C_C_CO,
            12 => C_CO_N,
            _ => C_C_C,
        };
        // torsion about the bond that ends there, named by its first atom
        let torsion = match (atom + 2 * BACKBONE - 2) % BACKBONE {
            0 => torsions[0],
            11 => torsions[1],
            _ => 180.0,
        };
        let turn = Rotation3::from_axis_angle(&Vec3::x_axis(), f64::to_radians(torsion))
            * Rotation3::from_axis_angle(&Vec3::z_axis(), f64::to_radians(180.0 - angle));
        let step = Translation3::from(turn * Vec3::new(length, 0.0, 0.0));
        let step = Isometry3::from_parts(step, UnitQuaternion::from_rotation_matrix(&turn));
        frames.push(frames[atom - 1] * step);
    }
    frames
}

/// Screw motion that maps one monomer to the next.
pub(super) struct Screw {
    axis: Vec3,
    /// Point on the axis (for a half turn).
    point: Vec3,
    /// Sine of the angle: 0 at the half turn, with a change of sign.
    sine: f64,
    pub(super) cosine: f64,
    pub(super) rise: f64,
}

pub(super) fn screw(frames: &[Isometry3<f64>]) -> Screw {
    let map = frames[2 * BACKBONE] * frames[BACKBONE].inverse();
    let matrix: Matrix3<f64> = map.rotation.to_rotation_matrix().into_inner();
    // the axis spans the eigenspace of 1, the largest eigenvalue of the symmetric part
    let eigen = ((matrix + matrix.transpose()) / 2.0).symmetric_eigen();
    let mut axis: Vec3 = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    let shift = map.translation.vector;
    if shift.dot(&axis) < 0.0 {
        axis = -axis;
    }
    let rise = shift.dot(&axis);
    let skew = Vec3::new(
        matrix[(2, 1)] - matrix[(1, 2)],
        matrix[(0, 2)] - matrix[(2, 0)],
        matrix[(1, 0)] - matrix[(0, 1)],
    );
    let (sine, cosine) = (skew.dot(&axis) / 2.0, (matrix.trace() - 1.0) / 2.0);
    Screw { axis, point: (shift - rise * axis) / 2.0, sine, cosine, rise }
}

/// Solves for the torsions beside the amide (CO–N–C–C and C–C–CO–N, degrees) of a 2₁ screw with this rise, Å.
///
/// # Errors
/// Returns [`Error::Parameter`] for a rise beyond the reach of the chain.
pub fn amide_torsions(rise: f64) -> Result<[f64; 2], Error> {
    let residual = |torsions: [f64; 2]| {
        let screw = screw(&backbone(torsions));
        [screw.sine, (screw.rise - rise) / rise, screw.cosine]
    };
    let mut best: Option<[f64; 2]> = None;
    for start in [-150.0, -135.0, -120.0, 120.0, 135.0, 150.0] {
        let mut torsions = [start, -start];
        for _ in 0..60 {
            let at = residual(torsions);
            if at[0].abs() + at[1].abs() < 1e-14 {
                break;
            }
            let step = 1e-4;
            let right = residual([torsions[0] + step, torsions[1]]);
            let above = residual([torsions[0], torsions[1] + step]);
            let derivative = |a: [f64; 3], i: usize| (a[i] - at[i]) / step;
            let (a, b) = (derivative(right, 0), derivative(above, 0));
            let (c, d) = (derivative(right, 1), derivative(above, 1));
            let determinant = a * d - b * c;
            if determinant.is_nan() || determinant.abs() < 1e-30 {
                break;
            }
            let newton = [(d * at[0] - b * at[1]) / determinant, (a * at[1] - c * at[0]) / determinant];
            // limit the step: a longer one may lead to another solution
            let scale = (10.0 / newton[0].abs().max(newton[1].abs()).max(1e-12)).min(1.0);
            torsions = [torsions[0] - scale * newton[0], torsions[1] - scale * newton[1]];
        }
        let at = residual(torsions);
        let solved = at[0].abs() + at[1].abs() < 1e-9 && at[2] < -0.9;
        // of several solutions take the most symmetric one, with the smallest tilt of the amide plane
        let lean = |t: [f64; 2]| (t[0].abs() - t[1].abs()).abs();
        if solved && best.is_none_or(|best| lean(torsions) < lean(best)) {
            best = Some(torsions.map(|t| t - 360.0 * (t / 360.0).round()));
        }
    }
    best.ok_or_else(|| Error::parameter("rise of a monomer, Å", rise, "about 15 to 16.4 for this chain"))
}

/// Returns one monomer with its screw axis along z through the origin, N–H turned by `setting` degrees from
/// x, and the middle between its amide C and the next N at z = 0.
pub(super) fn placed_monomer(rise: f64, setting: f64) -> Result<Vec<(ChemicalElement, Vec3)>, Error> {
    use geometry::{C_H, C_O, H_C_H, N_H};
    let frames = backbone(amide_torsions(rise)?);
    let screw = screw(&frames);
    let at = |index: usize| frames[index].translation.vector;
    let mut atoms = Vec::with_capacity(ATOMS_OF_MONOMER);
    for k in 0..BACKBONE {
        let index = BACKBONE + k;
        let p = at(index);
        let (u, v) = ((p - at(index - 1)).normalize(), (p - at(index + 1)).normalize());
        let (outwards, across) = ((u + v).normalize(), u.cross(&v).normalize());
        match k {
            0 => atoms.extend([(ChemicalElement::N, p), (ChemicalElement::H, p + N_H * outwards)]),
            12 => atoms.extend([(ChemicalElement::C, p), (ChemicalElement::O, p + C_O * outwards)]),
            _ => {
                let (sine, cosine) = (H_C_H / 2.0).to_radians().sin_cos();
                atoms.push((ChemicalElement::C, p));
                atoms.push((ChemicalElement::H, p + C_H * (cosine * outwards + sine * across)));
                atoms.push((ChemicalElement::H, p + C_H * (cosine * outwards - sine * across)));
            }
        }
    }
    let upright = Rotation3::rotation_between(&screw.axis, &Vec3::z())
        .unwrap_or_else(|| Rotation3::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI));
    for (_, p) in &mut atoms {
        *p = upright * (*p - screw.point);
    }
    let bond = atoms[1].1 - atoms[0].1;
    let turn = Rotation3::from_axis_angle(&Vec3::z_axis(), setting.to_radians() - bond.y.atan2(bond.x));
    let carbon = atoms[ATOMS_OF_MONOMER - 2].1.z;
    let middle = (carbon + atoms[0].1.z + rise) / 2.0;
    for (_, p) in &mut atoms {
        *p = turn * *p - Vec3::new(0.0, 0.0, middle);
    }
    Ok(atoms)
}

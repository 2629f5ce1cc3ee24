//! Warnings of a scene that is valid but probably not intended.

use super::{DiscreteBody, Scene};
use crate::bonds::{BodyGeometry, Bonds, CellGrid};
use crate::geometry::{Cut, Operation, inside};
use harness::scene::Source;

/// Displacement of a grip in one step, in horizons, above which breaking within the step is not resolved.
const LONGEST_STEP: f64 = 3.0;
/// Largest edge of a point's volume over the distance of its neighbour, and its inverse, in an even cloud.
const UNEVEN: f64 = 4.0;

/// Distance from a crack within which a particle lies on it, in spacings.
const ON_CRACK: f64 = 1e-6;

/// Returns the warnings of a variant.
pub fn warnings<const D: usize>(source: &Source, scene: &Scene, body: &DiscreteBody<D>) -> Vec<String> {
    let bonds = &*body.bonds;
    let cracks = body.cuts.iter().enumerate().filter_map(|(index, cut)| on_crack(bonds, index, cut));
    let voids = (0..body.operations.len()).filter_map(|index| bridged(bonds, &body.operations, index));
    let contact = (scene.contact.is_some() && !scene.output.section.is_empty())
        .then(|| "the forces of `output.section` are those of bonds, without contact".to_owned());
    let slip =
        scene.contact.as_ref().and_then(|contact| contact.slip_velocity).map(|_| {
            "contact.slip_velocity is ignored: sticking friction holds by its elastic slip".to_owned()
        });
    let turns = super::rotation::chords(source, scene, body);
    let once = [
        volumes(scene, bonds, body.thickness),
        thin(bonds),
        long_steps(scene, bonds),
        contact,
        slip,
        super::parts::bonded_parts(scene, body),
        super::interface::free_to_pass(scene),
    ];
    once.into_iter()
        .flatten()
        .chain(cracks)
        .chain(super::bridges::bridges(body))
        .chain(turns)
        .chain(super::mesh_shape::notes(source, scene))
        .chain(super::planes::warnings(source, scene, body))
        .chain(super::indenter_place::warnings(source, scene, body))
        .chain(voids)
        .collect()
}

/// Warns of volumes of a plane cloud without the thickness.
fn volumes<const D: usize>(scene: &Scene, bonds: &dyn Bonds<D>, thickness: f64) -> Option<String> {
    if D == 3 || !scene.body.has_points() {
        return None;
    }
    let sites: Vec<usize> = bonds.particles().iter().map(|&site| site as usize).collect();
    let places: Vec<[f64; D]> = sites.iter().map(|&site| bonds.position(site)).collect();
    let middle = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    let volume = middle(sites.iter().map(|&site| bonds.volume(site)).collect())?;
    let grid = CellGrid::new(&places, bonds.horizon());
    let nearest = |own: usize| {
        let mut least = f64::INFINITY;
        grid.near(places[own], bonds.horizon(), |other| {
            if other != own {
                least = least.min((0..D).map(|d| (places[other][d] - places[own][d]).powi(2)).sum());
            }
        });
        least.sqrt()
    };
    // a tenth of the points suffices
    let distance = middle((0..places.len()).step_by(10).map(nearest).collect())?;
    let side = (volume / thickness).sqrt();
    (!(1.0 / UNEVEN..=UNEVEN).contains(&(side / distance))).then(|| {
        format!(
            "a volume of {volume:.3e} m³ and a thickness of {thickness:.3e} m belong to points {side:.3e} m \
             apart, but they are \
             {distance:.3e} m apart: do the volumes (in m³) include the thickness?"
        )
    })
}

/// Warns of parts that are one particle wide, whose width the lattice determines.
fn thin<const D: usize>(bonds: &dyn Bonds<D>) -> Option<String> {
    let lattice = bonds.as_lattice()?;
    let spacing = lattice.spacing();
    let lonely = |&&site: &&u32| {
        if bonds.has_whole_family(site as usize) {
            return false;
        }
        let mut beside = [false; D];
        lattice.neighbours(site as usize, &mut |bond| {
            for d in 0..D {
                let along = (bond.bond[d].abs() / spacing - 1.0).abs() < 0.01;
                beside[d] |= along && bond.length < 1.01 * spacing;
            }
        });
        beside.contains(&false)
    };
    let count = bonds.particles().iter().filter(lonely).count();
    // a body that is one particle thick everywhere is intended
    (count > 0 && 2 * count < bonds.particles().len()).then(|| {
        format!(
            "{count} particles have no neighbour one spacing ({spacing:.3e} m) away along some axis: a part \
             of the body is one \
             particle wide, whatever width its shape has"
        )
    })
}

/// Warns of particles on a crack, whose bonds bridge it.
fn on_crack<const D: usize>(bonds: &dyn Bonds<D>, index: usize, cut: &Cut<D>) -> Option<String> {
    let spacing = bonds.spacing();
    let places = bonds.particles().iter().map(|&site| (site, bonds.position(site as usize)));
    let on: Vec<(u32, [f64; D])> =
        places.filter(|(_, place)| cut.distance(*place) < ON_CRACK * spacing).collect();
    let &(_, first) = on.first()?;
    let normal = cut.normal();
    let along = |bond: &[f64; D]| (0..D).map(|d| bond[d] * normal[d]).sum::<f64>().abs();
    let mut kept = 0;
    for &(site, _) in &on {
        bonds.neighbours(site as usize, &mut |bond| {
            kept += u64::from(along(&bond.bond) > ON_CRACK * spacing);
        });
    }
    let place = first.map(|x| format!("{:.3}", x * 1e3)).join(", ");
    Some(format!(
        "{} particles lie on body.cracks[{index}], the first at ({place}) mm, and keep their {kept} bonds to \
         both of its sides: \
         the crack is bridged; move it by half a spacing ({:.3} mm)",
        on.len(),
        0.5e3 * spacing
    ))
}

/// Warns of bonds across a cut shape that is narrower than the horizon.
fn bridged<const D: usize>(
    bonds: &dyn Bonds<D>,
    operations: &[Operation<D>],
    index: usize,
) -> Option<String> {
    let Operation::Cut(shape) = operations.get(index)? else { return None };
    let (low, high) = shape.bounds();
    let axis = (0..D).min_by(|&a, &b| (high[a] - low[a]).total_cmp(&(high[b] - low[b])))?;
    let (width, horizon) = (high[axis] - low[axis], bonds.horizon());
    if width >= horizon {
        return None;
    }
    let middle = 0.5 * (low[axis] + high[axis]);
    let near = |place: &[f64; D]| {
        (0..D).all(|d| (low[d] - horizon..=high[d] + horizon).contains(&place[d])) && place[axis] <= low[axis]
    };
    let mut across = 0_u64;
    for &site in bonds.particles() {
        let place = bonds.position(site as usize);
        if !near(&place) {
            continue;
        }
        bonds.neighbours(site as usize, &mut |bond| {
            let part = (middle - place[axis]) / bond.bond[axis];
            let there = std::array::from_fn(|d| place[d] + part * bond.bond[d]);
            let beyond = place[axis] + bond.bond[axis] >= high[axis];
            across += u64::from(beyond && shape.contains(there) && !inside(operations, there));
        });
    }
    (across > 0).then(|| {
        format!(
            "body.shapes[{index}] cuts out {:.3} mm along {}, less than the horizon of {:.3} mm: {across} \
             bonds cross it, \
             as `bond_gaps` asks",
            width * 1e3,
            ["x", "y", "z"][axis],
            horizon * 1e3
        )
    })
}

/// Warns of load steps that are too large to resolve breaking.
fn long_steps<const D: usize>(scene: &Scene, bonds: &dyn Bonds<D>) -> Option<String> {
    if !scene.breaks() || scene.dynamics.is_some() {
        return None;
    }
    let prescribed = scene.boundary.iter().flat_map(|boundary| boundary.displacement.iter().flatten());
    let largest = prescribed.fold(0.0_f64, |most, held| match held {
        super::Prescribed::At(value) => most.max(value.abs()),
        super::Prescribed::Free | super::Prescribed::Hold => most,
    });
    let step = largest / scene.step_count() as f64;
    let horizons = step / bonds.horizon();
    (horizons > LONGEST_STEP).then(|| {
        format!(
            "a step moves a grip by {:.3} mm, {horizons:.0} horizons: breaking within the step is not \
             resolved; `solver.steps` = {:.0} moves it \
             by one spacing",
            step * 1e3,
            largest / bonds.spacing()
        )
    })
}

//! Choice of the device that takes the steps or iterations of a variant.

use crate::bonds::Bonds;
use crate::program::card::{self, Card};
use crate::program::scene::{
    BodyForceSpec, Boundary, ContactSpec, DeviceChoice, ForcePrecision, Scene, VaryingParameter,
};
use harness::scene::{SceneError, Source};

/// Directed bonds below which launching kernels takes longer than the processor's forces.
const FEWEST_BONDS: u64 = 5_000_000;

/// Device of a variant.
#[derive(Default)]
pub struct Chosen {
    /// The card; `None`: the processor.
    pub card: Option<Card>,
    /// Name of the device and its precision, or the reason for the processor, where the scene does not name
    /// that.
    pub note: Option<String>,
}

/// The device that a scene names for a variant.
///
/// # Errors
/// `device = "gpu"` of a variant that no card can do, on a machine or in a build without one.
pub fn choose<const D: usize>(
    source: &Source,
    scene: &Scene,
    bonds: &dyn Bonds<D>,
) -> Result<Chosen, SceneError> {
    let (device, precision, block) = scene.device();
    if device == DeviceChoice::Cpu {
        return Ok(Chosen::default());
    }
    let only = device == DeviceChoice::Gpu;
    let on_processor = |why: String| {
        let note = format!("`device = \"auto\"` takes the processor: {why}");
        Ok(Chosen { card: None, note: Some(note) })
    };
    if let Some((key, found)) = beyond_cards(scene) {
        let allowed = format!("none on a graphics card; `{block}.device = \"cpu\"` takes the processor");
        return if only {
            Err(source.error(&key, found, allowed))
        } else {
            on_processor(format!("{found}, `{key}`"))
        };
    }
    let directed = bonds.directed_bonds();
    if !only && directed < FEWEST_BONDS {
        return on_processor(format!("{directed} directed bonds are too few to gain by a card"));
    }
    let open = card::open(precision == ForcePrecision::Single, block);
    match open.and_then(|(card, name)| card::room(&card, scene, bonds).map(|()| (card, name))) {
        Ok((card, _)) if !only && !card::is_card(&card) => {
            on_processor("this machine has no graphics card".to_owned())
        }
        Ok((card, name)) => Ok(Chosen { card: Some(card), note: Some(name) }),
        Err(why) if only => {
            let found = format!("\"gpu\", but {why}");
            Err(source.error(
                &format!("{block}.device"),
                found,
                "`\"cpu\"`, or `\"auto\"` to take a card where there is one",
            ))
        }
        Err(why) => on_processor(why),
    }
}

/// Key and content of what a card cannot do.
fn beyond_cards(scene: &Scene) -> Option<(String, &'static str)> {
    let material = &scene.material;
    let rigid = scene.boundary.iter().position(|boundary| boundary.rigid);
    let rigid_key = format!("boundary[{}].rigid", rigid.unwrap_or(0));
    let pressure = scene.boundary.iter().position(|boundary| boundary.pressure.is_some());
    let pressure_key = format!("boundary[{}].pressure", pressure.unwrap_or(0));
    // new on all of its particles in each step
    let formula = scene.boundary.iter().position(Boundary::depends_on_time).filter(|_| scene.has_dynamics());
    let formula_key = format!("boundary[{}].traction_field", formula.unwrap_or(0));
    let spin = scene.body_force.iter().position(|force| force.spin.is_some());
    let spin_key = format!("body_force[{}].spin", spin.unwrap_or(0));
    let force = scene.body_force.iter().position(BodyForceSpec::depends_on_time);
    let force = force.filter(|_| scene.has_dynamics());
    let force_key = format!("body_force[{}].formula", force.unwrap_or(0));
    let followed = material.fields.iter().position(|field| field.of == VaryingParameter::Prestrain);
    let part = material.inclusions.iter().position(|part| part.prestrain.is_some());
    let prestrain_key = match followed {
        Some(index) => format!("material.fields[{index}].of"),
        None => format!("material.inclusions[{}].prestrain", part.unwrap_or(0)),
    };
    let dense = material.inclusions.iter().position(|part| part.density.is_some());
    let dense = dense.filter(|_| scene.has_dynamics());
    let dense_key = format!("material.inclusions[{}].density", dense.unwrap_or(0));
    let slides = scene.interface.iter().position(|interface| interface.slides);
    let slides_key = format!("interface[{}].slides", slides.unwrap_or(0));
    let faults = [
        ("step", !scene.step.is_empty(), "steps"),
        ("periodic", scene.periodic.is_some(), "periodic sides"),
        ("body.points", scene.body.points.is_some(), "a body of points"),
        ("body.grid", scene.body.grid.is_some(), "a grid of cells"),
        ("material.solid", material.solid.is_some(), "a solid"),
        (prestrain_key.as_str(), material.is_prestrained(), "bonds with prestrains"),
        ("material.inclusions", material.has_laws_of_parts(), "inclusions of another law"),
        (dense_key.as_str(), dense.is_some(), "a density of its own"),
        (slides_key.as_str(), slides.is_some(), "an interface that slides"),
        ("material.critical.convention", scene.softens(), "bonds that soften"),
        (rigid_key.as_str(), rigid.is_some(), "a region that moves as a whole"),
        (pressure_key.as_str(), pressure.is_some(), "a pressure"),
        (formula_key.as_str(), formula.is_some(), "a formula of `t`"),
        (force_key.as_str(), force.is_some(), "a formula of `t`"),
        (spin_key.as_str(), spin.is_some(), "a centrifugal force"),
        ("dynamics.precision", scene.is_mixed(), "mixed precision"),
    ];
    let first = faults.iter().find(|(_, given, _)| *given).map(|(key, _, found)| ((*key).to_owned(), *found));
    first.or_else(|| contact_beyond_cards(scene.contact.as_ref()?))
}

/// Key and content of contact that a card cannot do: friction, and other surfaces than planes.
fn contact_beyond_cards(contact: &ContactSpec) -> Option<(String, &'static str)> {
    if contact.has_pairs() && contact.friction > 0.0 {
        return Some(("contact.friction".to_owned(), "friction"));
    }
    if !contact.indenter.is_empty() {
        return Some(("contact.indenter[0]".to_owned(), "an indenter"));
    }
    contact.plane.iter().enumerate().find_map(|(index, plane)| {
        let own = |key: &str| format!("contact.plane[{index}].{key}");
        if plane.bonded {
            return Some((own("bonded"), "a bonded plane"));
        }
        let rubs = plane.friction.unwrap_or(contact.friction) > 0.0;
        let key = if plane.friction.is_some() { own("friction") } else { "contact.friction".to_owned() };
        rubs.then_some((key, "friction"))
    })
}

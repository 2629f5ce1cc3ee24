//! Parts of a body with solids of their own: checks of all materials, parts that are no others, limits of
//! parts that relax, and runs that continue.

use crate::answers::solve;
use crate::materials::battery;
use crate::solids::{neo_hooke, rubber};
use evidence::at_most;
use peri::bonds::Bonds;
use peri::calibrate::Space;
use peri::material::{EightChainSolid, Material, NonlocalSolid, PointLaw};
use std::sync::Arc;

type AnyLaw<const D: usize> = Arc<dyn PointLaw<D>>;

/// Every third site has the second law, every fifth the third.
fn mixed<const D: usize>(laws: [AnyLaw<D>; 3], bonds: &dyn Bonds<D>) -> NonlocalSolid<AnyLaw<D>> {
    let number = |site: usize| if site.is_multiple_of(5) { 2 } else { u16::from(site.is_multiple_of(3)) };
    let [rest, one, other] = laws;
    NonlocalSolid::new(rest).with_parts(vec![one, other], (0..bonds.sites()).map(number).collect()).unwrap()
}

/// Forces are derivatives of the energy, and the stiffness has its bound, with three laws in every family,
/// one of them with filtered pressures.
#[test]
fn solids_of_parts_pass_the_battery() {
    fn laws<const D: usize>(space: Space) -> [AnyLaw<D>; 3] {
        let chains = EightChainSolid::new(space, 3.0, 9.0, 300.0).unwrap().filtered().unwrap();
        let (soft, network) = (neo_hooke::<D>(space, 5.0), rubber::<D>(space, 100.0));
        [Arc::new(soft.law().clone()), Arc::new(*network.law()), Arc::new(chains)]
    }
    let plane = |bonds: &dyn Bonds<2>| mixed(laws(Space::PlaneStrain), bonds).respond(bonds);
    battery::<2>("solids of parts, plane strain", [8, 7], &plane);
    let solid = |bonds: &dyn Bonds<3>| mixed(laws(Space::Solid), bonds).respond(bonds);
    battery::<3>("solids of parts", [4, 4, 3], &solid);
}

#[test]
fn a_number_without_a_law_is_refused() {
    let solid = rubber::<2>(Space::PlaneStrain, 5.0);
    let error = solid.clone().with_parts(vec![*solid.law()], vec![0, 1, 2]).unwrap_err();
    assert!(error.to_string().contains("below 2"), "{error}");
}

/// A strip of two halves between grips; `soft` and `stiff` are their blocks.
fn halves(soft: &str, stiff: &str, rest: &str) -> String {
    format!(
        r#"version = 1
program = "peri"
[body]
space = "plane-strain"
thickness = "1 mm"
spacing = "1 mm"
shapes = [
  {{ add = "box", min = ["0 mm", "0 mm"], max = ["12 mm", "4 mm"], part = "soft" }},
  {{ add = "box", min = ["12 mm", "0 mm"], max = ["24 mm", "4 mm"], part = "stiff" }},
]
[material]
solid = {soft}
[[material.inclusions]]
part = "stiff"
solid = {stiff}
[[boundary]]
side = "x-"
layers = 3
displacement = ["0 mm", "0 mm"]
[[boundary]]
side = "x+"
layers = 3
displacement = ["0.1 mm", "0 mm"]
[solver]
tolerance = 1e-9
[output]
pictures = false
fields = false
{rest}
"#
    )
}

/// A neo-Hookean block of a shear modulus in MPa, K = 5μ; `branch` is as stiff.
fn block(shear: f64, branch: bool) -> String {
    let bulk = 5.0 * shear;
    let own = format!(
        "law = \"correspondence\", constitutive = {{ model = \"neo-hookean\", parameters = {{ \
         shear_modulus = \"{shear} MPa\" }}, bulk_modulus = \"{bulk} MPa\" }}"
    );
    let relaxing = format!(
        ", branch = [{{ spring = \"neo-hookean\", viscosity = \"constant\", parameters = {{ \
         nu = \"{shear} MPa\", eta = \"{shear} MPa s\" }} }}]"
    );
    format!("{{ {own}{} }}", if branch { &relaxing } else { "" })
}

fn stored(text: &str) -> f64 {
    let directory = tempfile::tempdir().unwrap();
    let finished = solve(text, directory.path());
    let mut values = finished.outcomes[0].values.iter();
    values.find(|(name, ..)| name == "stored_energy").unwrap().1
}

/// A part with the solid of the rest: the same bits as one solid.
#[test]
fn a_part_of_the_same_solid_is_no_part() {
    let one = halves(&block(0.4, false), &block(0.4, false), "");
    let rest = one
        .replace(&format!("[[material.inclusions]]\npart = \"stiff\"\nsolid = {}\n", block(0.4, false)), "");
    assert!(!rest.contains("inclusions"));
    assert_eq!(stored(&one).to_bits(), stored(&rest).to_bits());
}

/// Ten thousand relaxation times after a pull only the laws in equilibrium are left, whichever part relaxes.
#[test]
fn a_part_with_branches_relaxes_to_its_equilibrium() {
    let hold = "[[time.step]]\nduration = \"1 us\"\nfactor = 1\nincrements = 2\n[[time.step]]\nduration = \
                \"10000 s\"\nincrements = 12\n";
    let elastic = stored(&halves(&block(0.4, false), &block(4.0, false), ""));
    for (name, soft, stiff) in [("soft", true, false), ("stiff", false, true)] {
        let relaxed = stored(&halves(&block(0.4, soft), &block(4.0, stiff), hold));
        // a tenth of the branch's stabilisation lasts, on what no gradient describes
        at_most(&format!("relaxed_{name}_part"), (relaxed / elastic - 1.0).abs(), 1e-3);
    }
}

//! Learnt laws as solids: checks of all materials, homogeneous deformations, flags, refused laws.

use crate::bodies::{Body, scatter};
use crate::materials::battery;
use evidence::at_most;
use harness::case::{Case, Options, Run};
use harness::output::vtkhdf;
use harness::scene::Source;
use peri::bonds::Bonds;
use peri::calibrate::Space;
use peri::field::Field;
use peri::material::{
    BodyTensor, Correspondence, Deformation, Material, NonlocalSolid, PointLaw, Pointwise, SolverMaterial,
};
use peri::program::run::{FinishedScene, Peri, run};
use peri::program::scene::{self, Scene};
use polycore::constitutive::network::Activation::Softplus;
use polycore::constitutive::surrogate::{Header, Kind, Softening, Surrogate, Symmetry};
use polycore::constitutive::{Error, Law, Prediction, Workspace};
use polycore::tensor::voigt::{self, Voigt, Voigt6x6};
use std::path::Path;

/// Loads the law of `cases/ch5/learnt-sheet`.
const LAW: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../cases/ch5/learnt-sheet/law.safetensors");

fn trained() -> Surrogate {
    Surrogate::read(LAW).unwrap()
}

/// Returns a polyconvex orthotropic energy with random weights, in axes rotated about z and by `tilt` about
/// x.
fn orthotropic(tilt: f64) -> Surrogate {
    let turn = nalgebra::Rotation3::from_euler_angles(tilt, 0.0, 0.6);
    let axes = [0, 1, 2].map(|i| [0, 1, 2].map(|j| turn[(j, i)]));
    let kind = Kind::Energy { symmetry: Symmetry::Orthotropic, axes, polyconvex: true, norms: false };
    Surrogate::random(Header::new(kind, &[(12, Softplus), (8, Softplus)], 2), 3).unwrap()
}

fn solid<const D: usize>(law: &Surrogate, space: Space) -> NonlocalSolid<Correspondence<Surrogate, D>> {
    NonlocalSolid::new(Correspondence::new(law.clone(), space).unwrap())
}

#[test]
fn learnt_laws_pass_the_battery() {
    let mut greatest = 0.0_f64;
    for (name, law) in [("trained", trained()), ("orthotropic", orthotropic(0.0))] {
        for space in [Space::PlaneStrain, Space::PlaneStress] {
            let name = format!("{name}, {space:?}");
            greatest = greatest.max(battery::<2>(&name, [8, 7], &|bonds| solid(&law, space).respond(bonds)));
        }
    }
    for (name, law) in [("trained", trained()), ("tilted", orthotropic(0.4))] {
        let of = |bonds: &dyn Bonds<3>| solid(&law, Space::Solid).respond(bonds);
        greatest = greatest.max(battery::<3>(name, [4, 4, 3], &of));
    }
    at_most("learnt_stiffness_over_bound", greatest, 2.0);
}

/// Returns C₃₃ without stress along z, by bisection.
fn thickness(law: &Surrogate, mut c: Voigt) -> f64 {
    let memory = &mut Workspace::default();
    let (mut low, mut high) = (0.2, 3.0);
    for _ in 0..200 {
        c[2] = 0.5 * (low + high);
        if law.stress(&c, memory).unwrap().stress[2] > 0.0 { high = c[2] } else { low = c[2] }
    }
    c[2]
}

/// Returns the largest distance of P = FS from that of the law in any particle, over its norm, and the
/// largest force at rest over μV/Δx.
fn distance<const D: usize>(
    law: &Surrogate,
    space: Space,
    cells: [usize; D],
    gradient: BodyTensor<D>,
) -> [f64; 2] {
    let built = Body::<D>::damaged(cells, 0.1, 3.015).build();
    let whole = nalgebra::Matrix3::from_fn(|a, b| match a < D && b < D {
        true => gradient[(a, b)],
        false => f64::from(u8::from(a == b)),
    });
    let mut c = voigt::from_stress(&(whole.transpose() * whole));
    if space == Space::PlaneStress {
        c[2] = thickness(law, c);
    }
    let stress = voigt::to_stress(&law.stress(&c, &mut Workspace::default()).unwrap().stress);
    let expected = gradient * BodyTensor::<D>::from_fn(|a, b| stress[(a, b)]);
    let mut off = [0.0_f64; 2];
    for (bonds, sites) in [
        (&built.lattice as &dyn Bonds<D>, &built.on_lattice),
        (&built.cloud as &dyn Bonds<D>, &built.in_cloud),
    ] {
        let moved: Vec<[f64; D]> = (built.points.iter())
            .map(|x| std::array::from_fn(|a| (0..D).map(|b| gradient[(a, b)] * x[b]).sum::<f64>() - x[a]))
            .collect();
        let solid = solid::<D>(law, space);
        let mut material = Pointwise::new(solid.clone(), bonds);
        material.prepare(bonds, &scatter(bonds.sites(), sites, &moved));
        for &site in sites {
            let found = solid.law().respond(material.points()[site].deformation().unwrap()).piola;
            off[0] = off[0].max((found - expected).norm() / expected.norm());
        }
        let rest = Field::zeros(bonds.sites());
        material.prepare(bonds, &rest);
        let mut force = Field::<D>::zeros(bonds.sites());
        for (chunk, mut part) in force.chunks_mut().into_iter().enumerate() {
            material.force(bonds, &rest, chunk, &mut part, None);
        }
        let most = force.components().iter().flat_map(|c| c.iter()).fold(0.0_f64, |m, x| m.max(x.abs()));
        off[1] = off[1].max(most * 0.1 / solid.law().shear_modulus());
    }
    off
}

#[test]
fn a_homogeneous_deformation_has_the_stress_of_the_law() {
    let mut off = [0.0_f64; 2];
    let plane = BodyTensor::<2>::new(1.21, 0.12, -0.07, 0.94);
    let space = BodyTensor::<3>::new(1.2, 0.1, 0.05, -0.06, 0.95, 0.03, 0.02, -0.04, 1.1);
    let mut note = |[stress, force]: [f64; 2]| off = [off[0].max(stress), off[1].max(force)];
    for law in [trained(), orthotropic(0.0)] {
        for kind in [Space::PlaneStrain, Space::PlaneStress] {
            note(distance(&law, kind, [14, 13], plane));
        }
    }
    for law in [trained(), orthotropic(0.4)] {
        note(distance(&law, Space::Solid, [7, 6, 6], space));
    }
    at_most("learnt_homogeneous_stress", off[0], 1e-9);
    at_most("learnt_rest_force", off[1], 1e-12);
}

#[test]
fn what_leaves_the_box_is_flagged() {
    fn outside<const D: usize>(space: Space, stretches: [f64; D]) -> [bool; 3] {
        let mut displacement_gradient = BodyTensor::<D>::zeros();
        (0..D).for_each(|d| displacement_gradient[(d, d)] = stretches[d] - 1.0);
        let flags = solid(&trained(), space).law().flags(&Deformation::homogeneous(displacement_gradient));
        std::array::from_fn(|d| flags.outside[d])
    }
    // the box ends at stretches of 0.81 to 0.82 and 1.49
    assert_eq!(outside(Space::PlaneStrain, [1.45, 0.9]), [false; 3]);
    assert_eq!(outside(Space::PlaneStrain, [1.52, 0.75]), [true, true, false]);
    assert_eq!(outside(Space::PlaneStress, [1.45, 0.95]), [false; 3]);
    // a sheet stretched both ways thins beyond what the data have
    assert_eq!(outside(Space::PlaneStress, [1.45, 1.45]), [false, false, true]);
    assert_eq!(outside(Space::Solid, [1.0, 1.0, 1.6]), [false, false, true]);
    let closed = Correspondence::<_, 2>::new(
        polycore::constitutive::hyperelastic::Compressible::new(
            polycore::constitutive::hyperelastic::NeoHookean::new(1.0).unwrap(),
            polycore::constitutive::hyperelastic::Volumetric::Ciarlet { lame: 1.0 },
        )
        .unwrap(),
        Space::PlaneStrain,
    );
    let displacement_gradient = BodyTensor::<2>::identity();
    assert!(!closed.unwrap().flags(&Deformation::homogeneous(displacement_gradient)).any());
}

fn scene_of(law: &str, more: &str) -> String {
    format!(
        "version = 1\nprogram = \"peri\"
[body]\nspace = \"plane-stress\"\nthickness = \"1 mm\"\nspacing = \"1 mm\"
shapes = [{{ add = \"box\", min = [\"0 mm\", \"0 mm\"], max = [\"16 mm\", \"6 mm\"] }}]
[material.solid]\nlaw = \"correspondence\"\nconstitutive = {{ learnt = '{law}' }}
[[boundary]]\nside = \"x-\"\nlayers = 6\ndisplacement_field = [\"0.6*x\", \"free\"]
[[boundary]]\nside = \"x+\"\nlayers = 6\ndisplacement_field = [\"0.6*x\", \"free\"]\n{more}"
    )
}

fn solve(text: &str, output: &Path) -> FinishedScene {
    let source = Source::new("scene.toml", text);
    let scene = source.parse::<Scene>().unwrap_or_else(|error| panic!("{}", error.render()));
    let mut own = Run::new(const { &Peri::PROGRAM }, &source, Options::new(output));
    run(&source, &scene, &mut own).unwrap_or_else(|error| panic!("{error}"))
}

/// The field of a strip whose stretch in step k is 1 + 0.2 k: C₁₁ = 1.96 in step 2 and 2.56 in step 3; the
/// box ends at 2.2219.
#[test]
fn flags_are_a_field_and_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let text = scene_of(LAW, "[solver]\nsteps = 3\n[output]\npictures = false\nflags = true\nevery = 1\n");
    let finished = solve(&text, folder.path());
    let value = |name: &str| finished.report.scalar(name).unwrap();
    assert_eq!(
        [value("outside_share"), value("flagged_share"), value("first_step_outside")],
        [1.0, 1.0, 3.0]
    );
    assert!(
        finished
            .summary()
            .contains("warning: the learnt law leaves the box of its training data from step 3 on")
    );
    let frames = vtkhdf::read(folder.path().join("dx-1mm_m-3.015.vtkhdf")).unwrap();
    for (frame, bit) in [(frames.len() - 2, 0), (frames.len() - 1, 1)] {
        let flags = frames.data(frame, "flags").unwrap();
        assert!(flags.len() == 96 && flags.iter().all(|&flags| flags as u8 & 1 == bit), "{flags:?}");
    }
    let history = std::fs::read_to_string(folder.path().join("history_dx-1mm_m-3.015.csv")).unwrap();
    assert!(history.lines().next().unwrap().ends_with("outside_share,flagged_share"), "{history}");
}

#[test]
fn laws_that_no_solid_can_have_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let message = |law: Surrogate| {
        law.write(folder.path().join("law.safetensors")).unwrap();
        let source = Source::new(folder.path().join("scene.toml"), scene_of("law.safetensors", ""));
        let parsed = source.parse::<Scene>().unwrap_or_else(|error| panic!("{}", error.render()));
        scene::check(&source, &parsed, false).map(|_| ()).map_err(|error| error.message().to_owned())
    };
    assert_eq!(message(orthotropic(0.0)), Ok(()));
    let ann = Surrogate::random(Header::new(Kind::Ann, &[(4, Softplus)], 1), 1).unwrap();
    let error = message(ann).unwrap_err();
    assert!(error.contains("`material.solid.constitutive.learnt`: found a law of the kind `ann`"), "{error}");
    let softening = Softening { units: vec![[0.1, 1.0, 1.0]], greatest: 1e5 };
    let error = message(orthotropic(0.0).with_softening(softening).unwrap()).unwrap_err();
    assert!(error.contains("found a law with `softening`"), "{error}");
    let error = message(orthotropic(0.4)).unwrap_err();
    assert!(error.contains("`material.solid.constitutive`: found shear stress out of the plane"), "{error}");
    // an energy turned over: its polyconvex correction is linear in its weights, and so is its tangent
    let mut header = trained().header().clone();
    header.kind = Kind::energy(Symmetry::Isotropic);
    let members = trained().members().to_vec();
    let turned = members.iter().map(|network| {
        let mut layers = network.layers().to_vec();
        layers.last_mut().unwrap().weights.iter_mut().for_each(|weight| *weight = -*weight);
        polycore::constitutive::network::Network::new(network.architecture().clone(), layers).unwrap()
    });
    let error = message(Surrogate::new(header, turned.collect()).unwrap()).unwrap_err();
    assert!(
        error.contains("`material.solid.constitutive`: found") && error.contains("above 0 Pa"),
        "{error}"
    );
}

/// S = C₀ : E with a shear modulus of 1 but in one plane, where it is −0.1: stiff in the mean over all
/// directions.
struct Soft;

impl Law for Soft {
    fn name(&self) -> String {
        "soft".into()
    }

    fn stress(&self, c: &Voigt, memory: &mut Workspace) -> Result<Prediction, Error> {
        self.tangent(c, memory)
    }

    fn tangent(&self, c: &Voigt, _: &mut Workspace) -> Result<Prediction, Error> {
        let tangent = Voigt6x6::from_diagonal(&Voigt::new(2.0, 2.0, 2.0, -0.1, 1.0, 1.0));
        let strain = Voigt::from_fn(|a, _| if a < 3 { 0.5 * (c[a] - 1.0) } else { c[a] });
        let stress = tangent * strain;
        let energy = Some(0.5 * stress.dot(&strain));
        Ok(Prediction { stress, tangent: Some(tangent), energy, ..Prediction::default() })
    }
}

#[test]
fn a_law_that_is_unstable_in_one_direction_is_refused() {
    assert!(Soft.moduli(&mut Workspace::default()).unwrap().shear > 0.5);
    let error = Correspondence::<_, 3>::new(Soft, Space::Solid).err().unwrap().to_string();
    assert!(
        error.contains("least eigenvalue of the law's tangent at rest") && error.contains("-0.1"),
        "{error}"
    );
}

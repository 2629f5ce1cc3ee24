//! Fracture energies of bond laws: bonds of the lattice across a cut, against independent sums, critical
//! stretches of both conventions, the area of new cracks, and softening bonds.

use evidence::near;
use harness::scene::Source;
use peri::bonds::{
    BodyGeometry, BondDamage, Bonds, CloudBonds, LatticeBonds, Overstretched, VolumeCorrection,
};
use peri::calibrate::{Space, modulus, stiffness_1111};
use peri::correction::surface_factors;
use peri::critical::{Context, Convention, CrackArea, Critical, Crossing, fracture_energy};
use peri::field::Field;
use peri::geometry::{Operation, Shape, lattice};
use peri::material::{BondMaterial, Material};
use peri::potential::{BondPotential, BondSoftening, Law, StretchRange};
use peri::program::run::explanation;
use peri::program::scene::Scene;
use polycore::units::{EnergyPerArea, Stress};
use std::f64::consts::PI;
use std::path::Path;

fn sheet(ratio: f64, correction: VolumeCorrection) -> LatticeBonds<2> {
    let side = 4.0 * ratio.ceil();
    let shape = Operation::Add(Shape::rectangle([0.0; 2], [side; 2]));
    LatticeBonds::new(lattice(&[shape], 1.0, 0.5).unwrap(), ratio, correction, &[]).unwrap()
}

fn block(ratio: f64, layers: f64) -> LatticeBonds<3> {
    let side = 2.0 * ratio.ceil() + 1.0;
    let shape = Operation::Add(Shape::Box { min: [0.0; 3], max: [side, side, layers] });
    let built = lattice(&[shape], 1.0, 1.0).unwrap();
    LatticeBonds::new(built, ratio, VolumeCorrection::None, &[]).unwrap()
}

/// N, κ and S agree with the printed digits of independent tables (S of corrections: c over κ).
#[test]
fn bonds_across_a_cut() {
    use VolumeCorrection::{Linear, None as Full};
    let plane = [
        (2.015, Full, false, 12.0, 2.0333, 0.9497),
        (3.015, Full, false, 28.0, 1.4429, 1.0059),
        (4.015, Full, false, 48.0, 1.2583, 0.9152),
        (5.015, Full, false, 80.0, 1.1550, 1.0569),
        (6.015, Full, false, 112.0, 1.1107, 0.986),
        (8.015, Full, false, 196.0, 1.0633, 0.952),
        (3.015, Linear, false, 28.0, 1.4429, 1.175 / 1.4429),
        (4.015, Linear, false, 48.0, 1.2583, 1.045 / 1.2583),
        (3.015, Full, true, 28.0, 1.4429, 1.399 / 1.4429),
        (4.015, Full, true, 48.0, 1.2583, 1.195 / 1.2583),
        (3.015, Linear, true, 28.0, 1.4429, 1.365 / 1.4429),
        (4.015, Linear, true, 48.0, 1.2583, 1.198 / 1.2583),
    ];
    for (ratio, correction, surface, count, loss, share) in plane {
        let bonds = sheet(ratio, correction);
        let kt = modulus(Space::PlaneStress, 1.0, ratio, 0.5);
        let factors = surface.then(|| surface_factors(&bonds, kt, stiffness_1111(Space::PlaneStress, 1.0)));
        let found = Crossing::new::<2>(&bonds, factors.as_ref());
        assert!(found.whole && found.bonds == count, "{found:?}");
        near("tearing_loss", found.loss, loss, 1e-4);
        let name = format!("tearing_share_{ratio}_{correction:?}_{surface}");
        near(&name, found.reach / (0.5 * ratio.powi(4)), share, 1e-3);
    }
    for (ratio, count, loss, share) in
        [(2.015, 32.0, 1.75, 0.843), (3.015, 122.0, 1.1967, 1.120), (4.015, 256.0, 1.0938, 0.896)]
    {
        let found = Crossing::new::<3>(&block(ratio, 2.0 * ratio.ceil() + 1.0), None);
        assert!(found.whole && found.bonds == count, "{found:?}");
        near("tearing_loss_solid", found.loss, loss, 1e-4);
        near(&format!("tearing_share_solid_{ratio}"), found.reach / (0.4 * PI * ratio.powi(5)), share, 1e-3);
    }
    // a slab without a whole family has that of its middle layers, along the plane
    let thin = Crossing::new::<3>(&block(3.015, 4.0), None);
    assert!(!thin.whole && thin.bonds < 122.0 && thin.bonds > 80.0, "{thin:?}");
}

/// A cloud of the same points has equal sums without its surface particles.
#[test]
fn a_cloud_has_its_inner_particles() {
    let own = sheet(3.015, VolumeCorrection::None);
    let points: Vec<[f64; 2]> = own.particles().iter().map(|&site| own.position(site as usize)).collect();
    let volumes = vec![0.5; points.len()];
    let cloud = CloudBonds::new(&points, &volumes, 0.5, 3.015, VolumeCorrection::None, &[]).unwrap();
    let (a, b) = (Crossing::new::<2>(&own, None), Crossing::new::<2>(&cloud, None));
    assert!(b.whole && b.bonds == 28.0);
    near("tearing_cloud_reach", b.reach / a.reach, 1.0, 1e-12);
    near("tearing_cloud_short", b.short / a.short, 1.0, 1e-12);
}

fn context<'a>(law: &'a dyn BondPotential, bonds: &LatticeBonds<2>, youngs: f64) -> Context<'a> {
    let (space, horizon, thickness) = (Space::PlaneStress, bonds.horizon(), 0.5);
    Context {
        law,
        links: None,
        space,
        modulus: modulus(space, youngs, horizon, thickness),
        horizon,
        thickness,
        crossing: Crossing::new::<2>(bonds, None),
        convention: Convention::default(),
        softening: BondSoftening::default(),
    }
}

/// The critical λ_c − 1 of a linear law is proportional to √G: by `bonds` it is that of Silling and Askari
/// (√(4πG/(9Eδ)) in plane stress), by `tearing` √c times smaller; by `softening` the energy is e_f times that
/// up to the onset.
#[test]
fn critical_stretches_of_the_conventions() {
    let law = Law::Linear.build(0.0, 0.0, false).unwrap();
    let bonds = sheet(3.015, VolumeCorrection::None);
    let context = context(&*law, &bonds, 2e6);
    let stretch = |convention| {
        let (energy, convention) = (Some(EnergyPerArea::from_si(80.0)), Some(convention));
        let critical = Critical { fracture_energy: energy, convention, ..Critical::default() };
        critical.resolve(&context).unwrap()
    };
    let (silling, c) = ((4.0 * PI * 80.0 / (9.0 * 2e6 * 3.015)).sqrt(), 1.451_324_016_f64);
    near("tearing_stretch_bonds", (stretch(Convention::Bonds) - 1.0) / silling, 1.0, 1e-12);
    let ratio = (stretch(Convention::Bonds) - 1.0) / (stretch(Convention::Tearing) - 1.0);
    near("tearing_stretch_ratio", ratio / c.sqrt(), 1.0, 1e-6);
    let end = stretch(Convention::Softening);
    let soft = BondSoftening::default();
    let brittle = 1.5 * (soft.onset(end) - 1.0).powi(2) * soft.ductility;
    near("softening_stretch", context.crossing.reach * context.modulus * brittle / 80.0, 1.0, 1e-9);
    near("softening_energy", fracture_energy(&context, Convention::Softening, end) / 80.0, 1.0, 1e-9);
}

/// The critical stretch by `bonds` keeps the bits of versions without conventions.
#[test]
fn bonds_are_what_they_were() {
    let law = Law::Linear.build(0.0, 0.0, false).unwrap();
    let shape = Operation::Add(Shape::rectangle([0.0; 2], [6e-3; 2]));
    let built = lattice(&[shape], 0.5e-3, 1e-3).unwrap();
    let bonds = LatticeBonds::new(built, 3.015, VolumeCorrection::None, &[]).unwrap();
    let (horizon, thickness) = (bonds.horizon(), 1e-3);
    let modulus = modulus(Space::PlaneStress, 2e6, horizon, thickness);
    let context = Context { modulus, horizon, thickness, ..context(&*law, &bonds, 2e6) };
    let (energy, convention) = (Some(EnergyPerArea::from_si(2.0)), Some(Convention::Bonds));
    let critical = Critical { fracture_energy: energy, convention, ..Critical::default() };
    assert_eq!(critical.resolve(&context).unwrap().to_bits(), 1.030_433_718_334_635_7_f64.to_bits());
}

/// The tension t = d φ′ of a softened bond follows from its energy by finite differences: 0 at λ_f, undamaged
/// up to λ₀.
#[test]
fn softened_bonds() {
    let end = 1.8;
    let kinked = BondSoftening { ductility: 9.0, kink: Some([1.0 / 3.0, 2.0 / 9.0]) };
    for (law, soft) in [(Law::ChainOffset, BondSoftening::default()), (Law::Linear, kinked)] {
        let law = law.build(if law.is_chain() { 50.0 } else { 0.0 }, 1200.0, false).unwrap();
        let onset = soft.onset(end);
        for stretch in [0.9, 1.05, onset - 1e-3, onset + 1e-3, 1.3, 1.5, 1.79, 1.9] {
            let energy = |stretch| soft.energy(&*law, stretch, end);
            let slope = (energy(stretch + 1e-5) - energy(stretch - 1e-5)) / 2e-5;
            near("softened_tension", slope, soft.integrity(stretch, end) * law.tension(stretch), 1e-6);
        }
        assert_eq!([soft.integrity(onset - 1e-12, end), soft.integrity(end, end)], [1.0, 0.0]);
    }
}

/// With a strength a linear law softens from 1 + strength/(R E) on, and its energy across a cut is the
/// fracture energy, straight and with a kink; a strength whose bonds store more is refused. R by an
/// integration over 4000 directions in Python.
#[test]
fn strengths_of_bonds() {
    let law = Law::Linear.build(0.0, 0.0, false).unwrap();
    let bonds = sheet(3.015, VolumeCorrection::None);
    let energy = Some(EnergyPerArea::from_si(80.0));
    for kink in [None, Some([1.0 / 3.0, 2.0 / 9.0])] {
        let strength = |strength| Critical {
            fracture_energy: energy,
            convention: Some(Convention::Softening),
            strength: Some(Stress::from_si(strength)),
            kink,
            ..Critical::default()
        };
        let mut context = context(&*law, &bonds, 2e6);
        let critical = strength(2e3);
        context.softening = critical.softening(&context).unwrap();
        let end = critical.resolve(&context).unwrap();
        let ratio = context.softening.uniaxial_strength(Space::PlaneStress);
        near("strength_onset", (context.softening.onset(end) - 1.0) * 1e3 * ratio, 1.0, 1e-9);
        near("strength_energy", fracture_energy(&context, Convention::Softening, end) / 80.0, 1.0, 1e-9);
        assert!(strength(2e5).softening(&context).is_err());
    }
    let trilinear = Some([0.25, 0.107_142_857]);
    for (ductility, kink, space, expected) in [
        (2.0, None, Space::PlaneStress, 1.034_59),
        (10.0, None, Space::PlaneStress, 1.182_78),
        (100.0, None, Space::PlaneStress, 1.349_83),
        (10.0, trilinear, Space::PlaneStress, 1.045_52),
        (100.0, trilinear, Space::PlaneStress, 1.219_32),
        (10.0, None, Space::Solid, 1.444_93),
        (800.0, None, Space::Solid, 1.879),
    ] {
        let found = BondSoftening { ductility, kink }.uniaxial_strength(space);
        near("uniaxial_strength", found / expected, 1.0, 2e-3);
    }
}

/// Forces of a body with softening bonds are slopes of its energy, in the kernels of a lattice and of a
/// cloud, and sum to zero.
#[test]
fn forces_of_soft_bonds_are_slopes() {
    let lattice = sheet(3.015, VolumeCorrection::None);
    let points: Vec<[f64; 2]> =
        lattice.particles().iter().map(|&site| lattice.position(site as usize)).collect();
    let cloud =
        CloudBonds::new(&points, &vec![0.5; points.len()], 0.5, 3.015, VolumeCorrection::None, &[]).unwrap();
    for mut bonds in [Box::new(lattice) as Box<dyn Bonds<2>>, Box::new(cloud)] {
        let law = Law::Linear.build(0.0, 0.0, false).unwrap();
        let material =
            BondMaterial::new(law, 2.0).softening(BondSoftening::default(), 1.06.into(), None).unwrap();
        let mut response = material.respond(&*bonds);
        let mut displacement = Field::<2>::zeros(bonds.sites());
        let sites: Vec<usize> = bonds.particles().iter().map(|&site| site as usize).collect();
        for &site in &sites {
            let [x, y] = bonds.position(site);
            displacement.set(site, [0.01 * (0.7 * x).sin(), 0.03 * y + 0.02 * (0.5 * x + y).cos()]);
        }
        let cover =
            peri::material::LawCover { stretches: [0.9, 1.2], bound: 1e-9, clamped: true, known: None };
        response.cover(&mut *bonds, &displacement, &cover).unwrap();
        bonds.prepare(&displacement);
        response.prepare(&*bonds, &displacement);
        let mut force = Field::<2>::zeros(bonds.sites());
        for (chunk, mut part) in force.chunks_mut().into_iter().enumerate() {
            response.force(&*bonds, &displacement, chunk * peri::field::CHUNK, &mut part, None);
        }
        let range = StretchRange { low: -0.2, high: 0.4 };
        let scale = sites.iter().flat_map(|&s| force.get(s)).fold(0.0_f64, |m, f| m.max(f.abs()));
        let (mut worst, mut sum, step) = (0.0_f64, [0.0; 2], 1e-6);
        for (k, &site) in sites.iter().enumerate() {
            (0..2).for_each(|d| sum[d] += force.get(site)[d]);
            if k % 7 > 0 {
                continue;
            }
            for d in 0..2 {
                let mut at = |sign: f64| {
                    let (mut moved, mut value) = (displacement.clone(), displacement.get(site));
                    value[d] += sign * step;
                    moved.set(site, value);
                    response.energy(&*bonds, &moved, range)
                };
                let slope = (at(1.0) - at(-1.0)) / (2.0 * step * bonds.volume(site));
                worst = worst.max((slope + force.get(site)[d]).abs() / scale);
            }
        }
        evidence::at_most("soft_forces_are_slopes", worst, 1e-6);
        evidence::at_most("soft_forces_sum", sum.iter().fold(0.0_f64, |m, x| m.max(x.abs())) / scale, 1e-10);
    }
}

/// Severs all bonds across a plane n·x = `at`.
fn part<const D: usize>(bonds: &mut dyn Bonds<D>, n: [f64; D], at: f64) {
    let side = |x: [f64; D]| (0..D).map(|d| n[d] * x[d]).sum::<f64>() > at;
    let mut list = Vec::new();
    for &site in bonds.particles() {
        bonds.neighbours(site as usize, &mut |bond| {
            if side(bonds.position(site as usize)) != side(bonds.position(bond.site)) {
                let (index, length, weight) = (bond.index, bond.length, bond.weight);
                list.push(Overstretched { site, index, elongation: 0.0, length, weight });
            }
        });
    }
    bonds.break_bonds(&list);
}

/// The area of a plane crack through a body is exact along an axis except for missing half diagonals at both
/// ends, and to 3 % at 45° and in space; single broken bonds have none.
#[test]
fn areas_of_cracks() {
    let columns = 40.0;
    let shape = Operation::Add(Shape::rectangle([0.0; 2], [columns, 16.0]));
    let built = || {
        LatticeBonds::new(
            lattice(std::slice::from_ref(&shape), 1.0, 0.5).unwrap(),
            3.015,
            VolumeCorrection::None,
            &[],
        )
        .unwrap()
    };
    let mut bonds = built();
    let crossing = Crossing::new::<2>(&bonds, None);
    let area = CrackArea::new::<2>(&bonds, &crossing);
    assert_eq!(area.area::<2>(&bonds), 0.0);
    part(&mut bonds, [0.0, 1.0], 8.0);
    let diagonal = 2.0 / 2f64.sqrt();
    let exact = 0.5 * (columns + (columns - 1.0) * diagonal) / (1.0 + diagonal);
    near("crack_area_axis", area.area::<2>(&bonds), exact, 1e-12);
    // some bonds beside a crack are none
    let mut beside = built();
    let mut list = Vec::new();
    let site = beside.particles()[300];
    beside.neighbours(site as usize, &mut |bond| {
        if list.len() < 4 {
            let pair = [(site, bond.index), (bond.site as u32, 27 - bond.index)];
            list.extend(pair.map(|(site, index)| Overstretched {
                site,
                index,
                elongation: 0.0,
                length: bond.length,
                weight: bond.weight,
            }));
        }
    });
    beside.break_bonds(&list);
    assert_eq!(area.area::<2>(&beside), 0.0);
    // a lattice turned by 45°, as a cloud
    let turned = 0.5_f64.sqrt();
    let grid = (-40..40).flat_map(|i| (-40..40).map(move |j| [f64::from(i), f64::from(j) + 0.5]));
    let points: Vec<[f64; 2]> = grid
        .map(|[x, y]| [turned * (x - y), turned * (x + y)])
        .filter(|[x, y]| (0.0..40.0).contains(x) && (0.0..16.0).contains(y))
        .collect();
    let volumes = vec![0.5; points.len()];
    let mut cloud = CloudBonds::new(&points, &volumes, 0.5, 3.015, VolumeCorrection::None, &[]).unwrap();
    let area = CrackArea::new::<2>(&cloud, &Crossing::new::<2>(&cloud, None));
    part(&mut cloud, [0.0, 1.0], 8.0);
    near("crack_area_45_degrees", area.area::<2>(&cloud) / 20.0, 1.0, 0.03);
    let mut solid = block(2.015, 7.0);
    let area = CrackArea::new::<3>(&solid, &Crossing::new::<3>(&solid, None));
    part(&mut solid, [0.0, 1.0, 0.0], 3.0);
    // of 7 × 7 cells the diagonals at the rim are missing
    let (d, e) = (4.0 / 2f64.sqrt(), 4.0 / 3f64.sqrt());
    let exact = (49.0 + d * 42.0 + e * 36.0) / (1.0 + d + e);
    near("crack_area_solid", area.area::<3>(&solid), exact, 1e-12);
}

/// Returns the output of `peri check`.
fn check_output(text: &str, folder: &Path) -> String {
    let source = Source::new(folder.join("scene.toml"), text);
    let scene = source.parse::<Scene>().unwrap_or_else(|error| panic!("{}", error.render()));
    explanation(&source, &scene, false).unwrap_or_else(|error| panic!("{error}")).join("\n")
}

const STRIP: &str = r#"version = 1
program = "peri"
[body]
space = "plane-stress"
thickness = "1 mm"
spacing = "1 mm"
shapes = [{ add = "box", min = ["0 mm", "-12 mm"], max = ["80 mm", "12 mm"] }]
cracks = [{ from = ["-1 mm", "0 mm"], to = ["40 mm", "0 mm"] }]
[material]
youngs_modulus = "2 MPa"
law = "linear"
critical = { fracture_energy = "2 J/m^2" }
[[boundary]]
side = "y-"
displacement = ["0 mm", "0 mm"]
[[boundary]]
side = "y+"
displacement = ["0 mm", "0.4 mm"]
"#;

/// Each cause gives its warning; a scene without causes, and `bonds`, give none.
#[test]
fn causes_of_other_energies_are_named() {
    let directory = tempfile::tempdir().unwrap();
    let told = |text: &str| check_output(text, directory.path());
    let fine = told(STRIP);
    assert!(!fine.contains("warning"), "{fine}");
    assert!(fine.contains("2 J/m² by `tearing`, 1.37805 J/m² by `bonds`; c = 1.4513"), "{fine}");
    let short = STRIP.replace("\"40 mm\", \"0 mm\"", "\"19 mm\", \"0 mm\"");
    let narrow = STRIP.replace("[material]", "horizon_ratio = 2.015\n[material]");
    let wide = STRIP.replace("[material]", "horizon_ratio = 4.015\n[material]");
    let soft = STRIP.replace("2 J/m^2", "2000 J/m^2");
    let thin = STRIP
        .replace(
            "min = [\"0 mm\", \"-12 mm\"], max = [\"80 mm\", \"12 mm\"]",
            "min = [\"0 mm\", \"-2 mm\"], max = [\"80 mm\", \"2 mm\"]",
        )
        .replace("[[boundary]]\n", "[[boundary]]\nlayers = 1\n");
    let slab = STRIP
        .replace("plane-stress", "solid")
        .replace("thickness = \"1 mm\"\n", "")
        .replace(
            "\"-12 mm\"], max = [\"80 mm\", \"12 mm\"]",
            "\"-12 mm\", \"0 mm\"], max = [\"80 mm\", \"12 \
            mm\", \"6 mm\"]",
        )
        .replace(
            "from = [\"-1 mm\", \"0 mm\"], to = [\"40 mm\", \"0 mm\"]",
            "from = [\"-1 mm\", \"0 mm\", \
            \"-1 mm\"], to = [\"40 mm\", \"0 mm\", \"-1 mm\"], and = [\"-1 mm\", \"0 mm\", \"7 mm\"]",
        )
        .replace("[\"0 mm\", \"0 mm\"]", "[\"0 mm\", \"0 mm\", \"free\"]")
        .replace("[\"0 mm\", \"0.4 mm\"]", "[\"0 mm\", \"0.4 mm\", \"free\"]");
    for (scene, cause) in [
        (&short, "body.cracks[0] is 19.0 spacings long"),
        (&narrow, "a horizon of 2.015 spacings"),
        (&wide, "body.cracks[0] is 40.0 spacings long"),
        (&soft, "a critical stretch of 1.56"),
        (&thin, "no particle has a whole family"),
        (&slab, "the body is 6.0 layers thick along z"),
    ] {
        let text = told(scene);
        assert!(text.contains(cause), "{cause}: {text}");
        let text = told(&scene.replace("J/m^2\"", "J/m^2\", convention = \"bonds\""));
        assert!(!text.contains(cause), "{cause}: {text}");
    }
    // a cloud with a jitter of 0.05 and 0.2 spacings (splitmix64)
    for (jitter, uneven) in [(0.05, false), (0.2, true)] {
        let mut seed = 5_u64;
        let mut random = || {
            seed = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = seed;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            2.0 * ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64 - 1.0
        };
        let mut points = "x,y,volume\n".to_owned();
        for k in 0..80 * 24 {
            let [x, y] = [k % 80, k / 80].map(|k| (f64::from(k) + 0.5 + jitter * random()) * 1e-3);
            points += &format!("{x},{},1e-9\n", y - 12e-3);
        }
        std::fs::write(directory.path().join("points.csv"), points).unwrap();
        let from = STRIP.find("spacing").unwrap();
        let to = STRIP.find("cracks").unwrap();
        let cloud = STRIP.replace(&STRIP[from..to], "points = \"points.csv\"\nhorizon = \"3.015 mm\"\n");
        assert_eq!(told(&cloud).contains("points lie unevenly"), uneven, "{}", told(&cloud));
    }
}

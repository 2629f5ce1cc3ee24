//! Forces of the lattice path, the cloud path and a plain loop over all pairs agree.

use crate::bodies::{Body, Random, distance, fit, forces, laws, norm, rms, scatter, stretch_range};
use peri::bonds::{BodyGeometry, BondDamage, BondForces, Bonds, force};
use peri::field::Field;
use peri::potential::{KernelFit, StretchRange};

/// Forces of pieces have the bits of forces of work items.
fn in_pieces<const D: usize>(bonds: &dyn Bonds<D>, u: &Field<D>) {
    let (mut whole, piece) = (Field::zeros(bonds.sites()), bonds.piece());
    force(bonds, u, &mut whole);
    for start in (0..bonds.sites()).step_by(piece) {
        let size = piece.min(bonds.sites() - start);
        let mut parts = [(); D].map(|()| vec![f64::NAN; size]);
        bonds.force(u, start, &mut parts.each_mut().map(|part| &mut part[..]), None);
        for (part, whole) in parts.iter().zip(whole.components()) {
            assert!(part[..] == whole[start..start + size], "pieces of {piece} from site {start}");
        }
    }
}

/// Forces in mixed precision agree with double precision to the rounding of single precision in each bond,
/// and so does the range of stretches.
fn in_mixed_precision<const D: usize>(
    body: &Body<D>,
    fit: &KernelFit,
    u: &[[f64; D]],
    double: &[[f64; D]],
    sizes: &[f64],
    name: &str,
) {
    let built = body.build();
    let (mut bonds, scale) = (built.lattice, rms(double));
    bonds.set_mixed();
    bonds.set_law(fit, crate::bodies::MODULUS);
    let displacement = scatter(bonds.sites(), &built.on_lattice, u);
    bonds.prepare(&displacement);
    in_pieces(&bonds, &displacement);
    let mixed = forces(&bonds, &built.on_lattice, u);
    let unit = f64::from(f32::EPSILON);
    for (particle, (found, exact)) in mixed.iter().zip(double).enumerate() {
        let error = norm::<D>(std::array::from_fn(|d| found[d] - exact[d]));
        let allowed = 8.0 * unit * (sizes[particle] + scale);
        assert!(error <= allowed, "{name}, particle {particle}: off by {error:.1e} of {allowed:.1e} allowed");
    }
    let error = distance(&mixed, double) / scale;
    let stated = bonds.mixed_error(&displacement).unwrap();
    assert!(
        stated > 0.0 && stated < 10.0 * unit && error >= 0.5 * stated,
        "{name}: {stated:.1e} {error:.1e}"
    );
    let (mut seen, mut out) = (StretchRange::REST, Field::<D>::zeros(bonds.sites()));
    for (chunk, mut part) in out.chunks_mut().into_iter().enumerate() {
        bonds.force(&displacement, chunk * peri::field::CHUNK, &mut part, Some(&mut seen));
    }
    let range = peri::bonds::stretch_range(&bonds, &displacement);
    for (seen, exact) in [(seen.low, range.low), (seen.high, range.high)] {
        assert!((seen - exact).abs() < 8.0 * unit * (1.0 + exact.abs()), "{name}: {seen} {exact}");
    }
}

/// Forces of both paths agree with each other and with a plain loop, for every law on one body.
fn compare<const D: usize>(body: &Body<D>, size: f64, name: &str) {
    let mut built = body.build();
    let mut copied = body.build().cloud;
    let pairs = body.pairs(&built.points);
    assert_eq!(built.lattice.directed_bonds(), 2 * pairs.len() as u64, "{name}: bonds of the lattice");
    assert_eq!(built.cloud.directed_bonds(), 2 * pairs.len() as u64, "{name}: bonds of the cloud");
    let u = Random(7).vectors(built.points.len(), size * body.spacing);
    for (law, potential) in laws() {
        let fit = fit(&*potential, stretch_range(&pairs, &u));
        built.lattice.set_law(&fit, crate::bodies::MODULUS);
        built.cloud.set_law(&fit, crate::bodies::MODULUS);
        copied.set_law(&fit, crate::bodies::MODULUS);
        let on_lattice = forces(&built.lattice, &built.on_lattice, &u);
        in_pieces(&built.lattice, &scatter(built.lattice.sites(), &built.on_lattice, &u));
        let in_cloud = forces(&built.cloud, &built.in_cloud, &u);
        // with a copy of the displacement, not of the one before, every bit is the same
        copied.prepare(&Field::zeros(built.points.len()));
        copied.prepare(&scatter(built.points.len(), &built.in_cloud, &u));
        assert_eq!(in_cloud, forces(&copied, &built.in_cloud, &u), "{name}, {}", law.name());
        let scale = rms(&on_lattice);
        // sums of up to 200 terms and a law of up to 25 coefficients, each rounded in another order: 1e-12 ≈
        // 5e3 ε
        let apart = distance(&on_lattice, &in_cloud) / scale;
        assert!(apart <= 1e-12, "{name}, {}: paths differ by {apart:.1e} of the rms", law.name());
        let (plain, sizes) = body.plain_forces(&pairs, &*potential, &u);
        in_mixed_precision(body, &fit, &u, &on_lattice, &sizes, &format!("{name}, {}", law.name()));
        for (particle, (found, exact)) in on_lattice.iter().zip(&plain).enumerate() {
            let error = norm::<D>(std::array::from_fn(|d| found[d] - exact[d]));
            // each bond's force is off by at most the fit's own error, 1e-9 or less; samples may miss its
            // peak by a tenth, and where q/e is not sampled (|e| < 1e-4) it is off by rounding of T(l) −
            // T(1), 1e-15/1e-4
            let allowed = (1.1 * fit.max_error + 1e-12) * sizes[particle] + 1e-14 * scale;
            assert!(
                error <= allowed,
                "{name}, {}, particle {particle} at {:?}: {found:?} against {exact:?}, off by {:.1e} of \
                 {:.1e}",
                law.name(),
                built.points[particle],
                error,
                allowed
            );
        }
    }
}

#[test]
fn paths_agree_in_the_plane() {
    // m = 2 has bonds as long as the horizon: a spacing that is a power of two keeps their lengths exact
    for (ratio, spacing, cells) in [(2.0, 0.25, 19), (3.015, 0.1, 21), (4.015, 0.3, 22), (8.015, 1e-3, 27)] {
        compare(&Body::solid([cells, cells - 4], spacing, ratio), 0.05, &format!("plain sheet, m = {ratio}"));
        compare(&Body::damaged([cells, cells], spacing, ratio), 0.1, &format!("sheet, m = {ratio}"));
    }
}

#[test]
fn paths_agree_in_space() {
    for (ratio, spacing, cells) in [(2.0, 0.5, 9), (3.015, 0.1, 9), (4.015, 0.3, 9)] {
        compare(
            &Body::solid([cells, cells - 2, 7], spacing, ratio),
            0.05,
            &format!("plain block, m = {ratio}"),
        );
        compare(&Body::damaged([cells, cells, 8], spacing, ratio), 0.1, &format!("block, m = {ratio}"));
        // stored along its axis
        compare(&Body::damaged([5, 4, 26], spacing, ratio), 0.1, &format!("bar, m = {ratio}"));
    }
}

/// Errors of mixed precision grow with the displacement: single precision rounds n spacings to n·2⁻²⁴. A law
/// over a range of stretches that is too wide for single precision stays in double precision.
#[test]
fn limits_of_mixed_precision() {
    let built = Body::<3>::solid([9, 8, 7], 0.1, 3.015).build();
    let mut bonds = built.lattice;
    bonds.set_mixed();
    let law = peri::potential::Law::ChainOffset.build(720.0, 1200.0, true).unwrap();
    let u = Random(11).vectors(built.points.len(), 0.002);
    let error_at = |bonds: &mut peri::bonds::LatticeBonds<3>, range: [f64; 2], way: f64| {
        bonds.set_law(&KernelFit::new(&*law, range, 1e-6).unwrap(), crate::bodies::MODULUS);
        let moved: Vec<[f64; 3]> = u.iter().map(|u| u.map(|x| x + 0.1 * way)).collect();
        let displacement = scatter(bonds.sites(), &built.on_lattice, &moved);
        bonds.prepare(&displacement);
        bonds.mixed_error(&displacement).unwrap()
    };
    // displacements of 2 % of the spacing, which differ by as much
    let unit = 0.5 * f64::from(f32::EPSILON);
    for way in [1e2, 1e3, 1e4] {
        let error = error_at(&mut bonds, [0.9, 1.1], way);
        let expected = way / 0.02 * unit;
        assert!(
            error > 0.05 * expected && error < 2.0 * expected,
            "{way} spacings: {error:.1e} {expected:.1e}"
        );
    }
    assert!(error_at(&mut bonds, [0.5, 2.0], 0.0) > 0.0);
    assert_eq!(error_at(&mut bonds, [0.1, 3.0], 0.0), 0.0);
}

/// A law that only a table represents uses the plain loops of both paths.
#[test]
fn paths_agree_on_a_tabulated_law() {
    let body = Body::<2>::damaged([15, 14], 0.1, 3.015);
    let mut built = body.build();
    let pairs = body.pairs(&built.points);
    let u = Random(3).vectors(built.points.len(), 0.012);
    let range = stretch_range(&pairs, &u);
    // links nearly at their contour: no rational function of the compiled sizes follows T to 1e-9
    let potential = peri::potential::Law::ChainAffine.build(1.0, 1e9, false).unwrap();
    let fit = KernelFit::new(&*potential, [0.02, range[1].max(1.7)], 1e-7).unwrap();
    assert!(fit.kind().starts_with("table"), "{}", fit.kind());
    built.lattice.set_law(&fit, crate::bodies::MODULUS);
    built.cloud.set_law(&fit, crate::bodies::MODULUS);
    let on_lattice = forces(&built.lattice, &built.on_lattice, &u);
    let in_cloud = forces(&built.cloud, &built.in_cloud, &u);
    let apart = distance(&on_lattice, &in_cloud) / rms(&on_lattice);
    assert!(apart <= 1e-12, "paths differ by {apart:.1e} of the rms");
    let (plain, sizes) = body.plain_forces(&pairs, &*potential, &u);
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    let apart = distance(&on_lattice, &plain) / largest;
    // the bound asked of the fit
    assert!(apart <= 1e-7, "{apart:.1e}");
}

/// Bodies whose particles touch every edge of the storage, at sizes that no tile of 16 sites or group of 8
/// neighbours divides, in place of Miri, which cannot run vector kernels. (Valgrind 3.19 runs this test
/// without errors, probably on the 256-bit kernels.)
#[test]
fn thin_bodies_of_any_length() {
    let law = peri::potential::Law::ChainOffset.build(720.0, 1200.0, false).unwrap();
    let fit = KernelFit::new(&*law, [0.5, 1.6], 1e-9).unwrap();
    fn check<const D: usize>(
        cells: [usize; D],
        ratio: f64,
        fit: &KernelFit,
        law: &dyn peri::potential::BondPotential,
    ) {
        let body = Body::solid(cells, 0.1, ratio);
        let mut built = body.build();
        built.lattice.set_law(fit, crate::bodies::MODULUS);
        built.cloud.set_law(fit, crate::bodies::MODULUS);
        let u = Random(cells.iter().sum::<usize>() as u64).vectors(built.points.len(), 0.01);
        let pairs = body.pairs(&built.points);
        let (plain, sizes) = body.plain_forces(&pairs, law, &u);
        let scale = sizes.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        for (path, found) in [
            ("lattice", forces(&built.lattice, &built.on_lattice, &u)),
            ("cloud", forces(&built.cloud, &built.in_cloud, &u)),
        ] {
            let apart = distance(&found, &plain);
            // the fit's bound on every bond
            assert!(apart <= 1e-9 * scale, "{path} {cells:?}, m = {ratio}: {apart:.1e} of {scale:.1e}");
        }
    }
    for n in 1..=40 {
        for ratio in [1.0 + 1e-9, 3.015, 6.015] {
            check([1, n], ratio, &fit, &*law);
            check([n, 1], ratio, &fit, &*law);
            check([n, 3], ratio, &fit, &*law);
        }
        for ratio in [1.5, 3.015] {
            check([1, 1, n], ratio, &fit, &*law);
            check([1, n, 1], ratio, &fit, &*law);
            check([n, 1, 2], ratio, &fit, &*law);
        }
    }
    // across the boundaries of work items, 4096 sites each
    check([4097, 1], 3.015, &fit, &*law);
    check([1, 1033], 3.015, &fit, &*law);
}

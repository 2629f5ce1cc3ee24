//! Fracture energies of a bond law: their conventions, and warnings where cracks run at a different energy.

use super::{DiscreteBody, Inclusion, Scene, plain};
use crate::bonds::Bonds;
use crate::calibrate::Space;
use crate::critical::{Convention, Critical, Toughness};
use crate::geometry::Cut;
use crate::potential::Law;
use harness::scene::{SceneError, Source};

/// Horizon ratio below which cracks follow the axes of the lattice.
const LEAST_RATIO: f64 = 2.5;
/// Horizon ratio above which a tip advances by up to five spacings before it runs.
const WIDE_RATIO: f64 = 3.5;
/// Crack length in spacings for an error of 3 % in the load, below and above [`WIDE_RATIO`].
const LONG_CRACK: [f64; 2] = [20.0, 60.0];
/// Scatter of nearest distances over their mean, for points with a jitter of 0.1 spacings.
const UNEVEN: f64 = 0.06;
/// Critical stretch above which cracks run at a lower energy.
const LARGE_STRETCH: f64 = 1.5;
/// Number of layers above which a solid lacks less than a tenth of the bonds across a cut.
const LAYERS: f64 = 10.5;

/// Checks the conventions of a bond law's fracture energies.
///
/// # Errors
/// A convention without a fracture energy, or other ones beside bonds that soften.
pub(super) fn check(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    let material = &scene.material;
    let inclusions = material.inclusions.iter().enumerate();
    let interfaces = scene.interface.iter().enumerate();
    let criticals = inclusions
        .filter_map(|(index, one)| Some((format!("material.inclusions[{index}].critical"), one.critical?)))
        .chain(
            interfaces
                .filter_map(|(index, one)| Some((format!("interface[{index}].critical"), one.critical?))),
        )
        .chain(material.critical.map(|own| ("material.critical".to_owned(), own)));
    for (key, critical) in criticals {
        if critical.driving.is_some() {
            return Err(source.unexpected(&format!("{key}.driving"), "only for a `solid` with `branch`"));
        }
        strength(source, scene, &key, &critical)?;
        let Some(convention) = critical.convention else { continue };
        let key = format!("{key}.convention");
        if critical.fracture_energy.is_none() {
            return Err(source.unexpected(&key, "needs `fracture_energy` beside it"));
        }
        let soft = convention == Convention::Softening;
        if soft != scene.softens() {
            let found = format!("`{}` beside the `convention` of `material.critical`", convention.name());
            return Err(source.error(&key, found, "`softening` of all bonds, or of none"));
        }
    }
    Ok(())
}

/// Returns lines for `peri check`: the fracture energy by both conventions, and warnings.
pub fn explain_tearing<const D: usize>(
    scene: &Scene,
    body: &DiscreteBody<D>,
    toughness: Option<&Toughness>,
) -> Vec<String> {
    let Some(own) = toughness else { return Vec::new() };
    let (convention, crossing) = (own.convention.unwrap_or_default(), own.crossing);
    let (tearing, bonds) = (digits(own.tearing), digits(own.bonds));
    let (c, loss, count) = (own.tearing / own.bonds, crossing.loss, crossing.bonds);
    let text = match convention {
        Convention::Softening => format!(
            "λf = {:.6}, soft from λ0 = {:.6} on: {tearing} J/m² by `softening`; c = S = {c:.4}",
            own.stretch,
            own.softening.onset(own.stretch)
        ),
        Convention::Tearing => format!(
            "λc = {:.6}: {tearing} J/m² by `tearing`, {bonds} J/m² by `bonds`; c = {c:.4} (κ = {loss:.4} of \
             {count:.1} bonds)",
            own.stretch
        ),
        Convention::Bonds => format!(
            "λc = {:.6}: {bonds} J/m² by `bonds`, {tearing} J/m² by `tearing`; c = {c:.4} (κ = {loss:.4} of \
             {count:.1} bonds)",
            own.stretch
        ),
    };
    let warnings = tearing_warnings(scene, body, toughness).into_iter();
    std::iter::once(format!("  fracture   {text}"))
        .chain(warnings.map(|text| format!("  warning    {text}")))
        .collect()
}

/// Lists the alternatives of a limit that were found.
pub(super) fn listed(names: &[&str]) -> String {
    let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    if names.is_empty() { "none of them".to_owned() } else { names.join(" and ") }
}

/// Checks the strength of a bond law.
fn strength(source: &Source, scene: &Scene, key: &str, critical: &Critical) -> Result<(), SceneError> {
    let material = &scene.material;
    if let Some(kink) = critical.kink {
        let key = format!("{key}.kink");
        if critical.strength.is_none() {
            return Err(source.unexpected(&key, "needs `strength` beside it"));
        }
        if !kink.iter().all(|part| *part > 0.0 && *part < 1.0) {
            return Err(source.error(&key, format!("{kink:?}"), "two numbers above 0 and below 1"));
        }
    }
    if critical.strength.is_none() {
        return Ok(());
    }
    let key = format!("{key}.strength");
    if critical.convention != Some(Convention::Softening) || critical.fracture_energy.is_none() {
        let why = "bond laws need `fracture_energy` and `convention = \"softening\"` beside it";
        return Err(source.unexpected(&key, why));
    }
    if material.law != Some(Law::Linear) {
        return Err(source.unexpected(&key, "only for `law = \"linear\"` or [material.solid]"));
    }
    if critical.kink.is_some() && !key.starts_with("material.critical") {
        let key = key.replace(".strength", ".kink");
        return Err(source.unexpected(&key, "bonds of one body have the kink of `material.critical`"));
    }
    if !material.fields.is_empty() {
        return Err(source.conflict(&key, "fields", "bonds of one body have one stiffness and toughness"));
    }
    let stiff = |part: &Inclusion| part.stiffness != 1.0;
    if let Some(index) = material.inclusions.iter().position(stiff) {
        let why = "at the border of parts of other stiffness bonds soften below their strength";
        return Err(source.conflict(&key, &format!("material.inclusions[{index}].stiffness"), why));
    }
    Ok(())
}

fn digits(value: f64) -> String {
    let size = value.abs().log10().floor();
    plain(
        if (-3.0..5.0).contains(&size) {
            format!("{value:.*}", (5.0 - size).clamp(0.0, 8.0) as usize)
        } else {
            format!("{value:.5e}")
        }
        .parse()
        .unwrap_or(value),
    )
}

/// Warns where a crack runs at an energy other than the fracture energy by `tearing`; numbers from the theory
/// page of tearing.
pub fn tearing_warnings<const D: usize>(
    scene: &Scene,
    body: &DiscreteBody<D>,
    toughness: Option<&Toughness>,
) -> Vec<String> {
    let meant = |own: &&Toughness| own.convention.is_some_and(|one| one != Convention::Bonds);
    let Some(own) = toughness.filter(meant) else { return Vec::new() };
    let soft = own.convention == Some(Convention::Softening);
    let bonds = &*body.bonds;
    let ratio = bonds.horizon() / bonds.spacing();
    let whole = (!own.crossing.whole).then(|| {
        format!(
            "no particle has a whole family: the fracture energy is that of the largest, of {:.0} bonds; \
             take a finer spacing",
            own.crossing.bonds
        )
    });
    let narrow = (ratio < LEAST_RATIO).then(|| {
        format!(
            "a horizon of {ratio:.3} spacings: cracks keep to the axes of the lattice, others take more than \
             twice the fracture \
             energy; take a ratio of 3.015"
        )
    });
    let scatter = if scene.body.has_points() { scatter(bonds) } else { 0.0 };
    let uneven = (scatter > UNEVEN && !soft).then(|| {
        format!(
            "points lie unevenly (nearest distances scatter by {:.0} %): cracks run at the fracture energy \
             to 15 %, on a regular \
             lattice to 5 %",
            100.0 * scatter
        )
    });
    let large = (own.stretch > LARGE_STRETCH && !soft).then(|| {
        format!(
            "a critical stretch of {:.3}: from 1.5 on cracks run at up to 10 % less than the fracture energy",
            own.stretch
        )
    });
    let least = LONG_CRACK[usize::from(ratio >= WIDE_RATIO)] * bonds.spacing();
    let cracks = body.cuts.iter().enumerate().filter_map(|(index, cut)| {
        let length = length_inside(cut, body.bounds)?;
        (length < least * (1.0 - 1e-9)).then(|| {
            format!(
                "body.cracks[{index}] is {:.1} spacings long: its tip advances before it runs, so that the \
                 load comes out low; 3 % \
                 need {} spacings at a horizon of {ratio:.3}",
                length / bonds.spacing(),
                LONG_CRACK[usize::from(ratio >= WIDE_RATIO)]
            )
        })
    });
    let once = [whole, narrow, uneven, large, slab(scene, body)];
    once.into_iter().flatten().chain(cracks).collect()
}

/// Warns of a solid of few layers, which has fewer bonds across a cut.
fn slab<const D: usize>(scene: &Scene, body: &DiscreteBody<D>) -> Option<String> {
    let (low, high) = body.bounds;
    let across = (0..D).min_by(|&a, &b| (high[a] - low[a]).total_cmp(&(high[b] - low[b])))?;
    let layers = (high[across] - low[across]) / body.bonds.spacing();
    (scene.body.space == Space::Solid && layers < LAYERS).then(|| {
        format!(
            "the body is {layers:.1} layers thick along {}: bonds that its faces lack make cracks run at \
             less than the fracture energy, by \
             about a tenth at 10 layers and a fifth at 6",
            ["x", "y", "z"][across]
        )
    })
}

/// Returns the standard deviation of nearest distances over their mean, from every tenth particle.
fn scatter<const D: usize>(bonds: &dyn Bonds<D>) -> f64 {
    let nearest: Vec<f64> = bonds
        .particles()
        .iter()
        .step_by(10)
        .filter_map(|&site| {
            let mut least = f64::INFINITY;
            bonds.neighbours(site as usize, &mut |bond| least = least.min(bond.length));
            least.is_finite().then_some(least)
        })
        .collect();
    let mean = nearest.iter().sum::<f64>() / nearest.len().max(1) as f64;
    let square = nearest.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / nearest.len().max(1) as f64;
    square.sqrt() / mean
}

/// Returns the length, m, of a crack in a box: with two tips half of it, in a solid that of its shorter edge;
/// `None` without a tip inside.
fn length_inside<const D: usize>(cut: &Cut<D>, (low, high): ([f64; D], [f64; D])) -> Option<f64> {
    let edges = cut.edges[..D - 1].iter();
    let lengths = edges.filter_map(|edge| {
        // along a line through the middle of the crack
        let start: [f64; D] = std::array::from_fn(|d| {
            let all: f64 = cut.edges[..D - 1].iter().map(|other| other[d]).sum();
            cut.corner[d] + 0.5 * (all - edge[d])
        });
        let (mut from, mut to) = (0.0_f64, 1.0_f64);
        for d in 0..D {
            let ends = [(low[d] - start[d]) / edge[d], (high[d] - start[d]) / edge[d]];
            if edge[d] != 0.0 {
                from = from.max(ends[0].min(ends[1]));
                to = to.min(ends[0].max(ends[1]));
            }
        }
        let tips = f64::from(u8::from(from == 0.0)) + f64::from(u8::from(to == 1.0));
        let size = edge.iter().map(|x| x * x).sum::<f64>().sqrt();
        (tips > 0.0 && to > from).then(|| (to - from) * size / tips)
    });
    lengths.reduce(f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_of_cracks() {
        let bounds = ([0.0, 0.0], [10.0, 6.0]);
        let length = |from, to| length_inside(&Cut::<2>::segment(from, to), bounds);
        assert_eq!(length([-1.0, 3.0], [4.0, 3.0]), Some(4.0));
        assert_eq!(length([3.0, 3.0], [7.0, 3.0]), Some(2.0));
        assert_eq!(length([-1.0, 3.0], [11.0, 3.0]), None);
        let through =
            Cut::<3> { corner: [-1.0, 3.0, -1.0], edges: [[5.0, 0.0, 0.0], [0.0, 0.0, 4.0], [0.0; 3]] };
        assert_eq!(length_inside(&through, ([0.0; 3], [10.0, 6.0, 2.0])), Some(4.0));
    }
}

//! Pressure and shear of rigid planes, indenters and other parts on a body: fields, tables, pictures.

use super::moment::Moment;
use super::scale::{bridge_length, moment_title, stress_unit};
use super::solid::{EMPTY_BOX, extend_box};
use crate::contact::SurfaceTraction;
use crate::error::Error;
use crate::program::scene::{ContactSpec, PARTICLES, PlaneSpec, Scene};
use harness::observe::{Fields, Observer, Outputs, Place};
use harness::output::csv;
use harness::output::picture::{ColorMap, LegendPlace, LinePlot, Particles, Series, Solids, Strip, View};
use std::path::Path;

/// Elevation from which horizontal contacts are seen, and azimuth from the normal of the others, rad.
const ELEVATION: f64 = 0.9;
const ASIDE: f64 = 0.4;
/// Component of a normal along z from which a contact is horizontal.
const HORIZONTAL: f64 = 0.7;

/// Observer of pressures and shears.
pub(super) struct Tractions<'s>(pub &'s Scene);

/// Contact with one surface, or of particles: its tractions, its mean normal, and their distances along it
/// from the centre of pressure, m; of particles, of the side that has the greatest pressure.
struct PressedSurface<'a, const D: usize> {
    name: String,
    /// True for particles.
    mutual: bool,
    each: Vec<&'a SurfaceTraction<D>>,
    normal: [f64; D],
    along: Vec<f64>,
}

/// Returns true if contacts have shears.
fn has_shear(contact: &ContactSpec) -> bool {
    contact.has_friction() || contact.plane.iter().any(|plane: &PlaneSpec| plane.bonded)
}

/// Returns the direction along a plane contact: its tangent with the greater component positive.
fn tangent<const D: usize>(normal: &[f64; D]) -> [f64; D] {
    let turned: [f64; D] = std::array::from_fn(|d| [normal[1], -normal[0]].get(d).copied().unwrap_or(0.0));
    let sign = if turned[0] + turned[1] < 0.0 { -1.0 } else { 1.0 };
    turned.map(|x| sign * x)
}

fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl<'a, const D: usize> PressedSurface<'a, D> {
    /// Returns the contacts of surfaces that touch the body, then that of particles; in a plane body in order
    /// along them.
    fn all(scene: &Scene, tractions: &'a [SurfaceTraction<D>]) -> Vec<Self> {
        let mut names = scene.contact.as_ref().map_or_else(Vec::new, ContactSpec::surface_names);
        let surfaces = names.len();
        names.push(PARTICLES.to_owned());
        let of = |(number, name): (usize, String)| {
            let mutual = number == surfaces;
            let mut each: Vec<&SurfaceTraction<D>> =
                tractions.iter().filter(|one| one.surface == number).collect();
            let greatest = each.iter().max_by(|a, b| a.pressure.total_cmp(&b.pressure))?.normal;
            let shown = |one: &SurfaceTraction<D>| !mutual || dot(&one.normal, &greatest) > 0.0;
            let weight =
                |one: &&SurfaceTraction<D>| f64::from(u8::from(shown(one))) * one.pressure.abs() * one.area;
            let weights: Vec<f64> = each.iter().map(weight).collect();
            let total: f64 = weights.iter().sum();
            if total == 0.0 {
                return None;
            }
            let mean = |get: fn(&SurfaceTraction<D>) -> [f64; D]| -> [f64; D] {
                let sum = |d: usize| each.iter().zip(&weights).map(|(one, w)| w * get(one)[d]).sum::<f64>();
                std::array::from_fn(|d| sum(d) / total)
            };
            let (normal, middle) = (mean(|one| one.normal), mean(|one| one.place));
            let size = dot(&normal, &normal).sqrt();
            let normal = normal.map(|n| if size > 0.0 { n / size } else { 0.0 });
            let tangent = tangent(&normal);
            let along = |one: &SurfaceTraction<D>| dot(&one.place, &tangent) - dot(&middle, &tangent);
            if D == 2 {
                each.sort_by(|a, b| along(a).total_cmp(&along(b)));
            }
            let along = each.iter().map(|one| along(one)).collect();
            Some(Self { name, mutual, each, normal, along })
        };
        names.into_iter().enumerate().filter_map(of).collect()
    }

    /// Writes places, present areas, pressures and shears.
    fn write(&self, shear: bool, path: &Path) -> Result<(), Error> {
        let column =
            |get: &dyn Fn(&SurfaceTraction<D>) -> f64| self.each.iter().map(|one| get(one)).collect();
        let axes = ["x", "y", "z"].into_iter().take(D).enumerate();
        let mut columns: Vec<(String, &str, Vec<f64>)> = Vec::new();
        if D == 2 {
            columns.push(("along".to_owned(), "m", self.along.clone()));
        }
        columns.extend(axes.clone().map(|(d, axis)| (axis.to_owned(), "m", column(&|one| one.place[d]))));
        columns.push(("area".to_owned(), "m^2", column(&|one| one.area)));
        columns.push(("pressure".to_owned(), "Pa", column(&|one| one.pressure)));
        let shears = axes.filter(|_| shear);
        columns.extend(shears.map(|(d, axis)| (format!("shear_{axis}"), "Pa", column(&|one| one.shear[d]))));
        let views: Vec<_> = columns.iter().map(|(name, unit, data)| (&**name, *unit, &data[..])).collect();
        Ok(csv::write(path, &views)?)
    }

    /// Returns the viewer in front of the contact.
    fn view(&self) -> View {
        let [x, y, z] = [0, 1, 2].map(|d| -self.normal.get(d).copied().unwrap_or(0.0));
        if z.abs() > HORIZONTAL {
            View { elevation: ELEVATION * z.signum(), ..View::default() }
        } else {
            View { azimuth: y.atan2(x) - ASIDE, ..View::default() }
        }
    }
}

impl<'m, const D: usize> Observer<Moment<'m, D>, Error> for Tractions<'_> {
    /// Adds pressures and shears of particles on the surface: the mean over the faces above them that touch;
    /// 0 elsewhere.
    fn fields(&self, to: &mut Fields<Moment<'m, D>>) {
        let Some(contact) = self.0.contact.as_ref().filter(|_| self.0.output.contact) else { return };
        to.add("contact_pressure", 1, Place::Points, |m| {
            means(m, m.tractions().iter(), |one| [one.pressure]).into_flattened()
        });
        if has_shear(contact) {
            to.add("contact_shear", 3, Place::Points, |m| {
                means(m, m.tractions().iter(), |one| super::in_space(one.shear)).into_flattened()
            });
        }
    }

    /// Writes `contact_SURFACE_VARIANT.csv` for each surface that touches the body.
    fn write(&self, m: &Moment<'m, D>, to: &Outputs) -> Result<(), Error> {
        let Some(spec) = self.0.contact.as_ref().filter(|_| self.0.output.contact) else { return Ok(()) };
        for contact in PressedSurface::all(self.0, m.tractions()) {
            let path = to.folder.join(format!("contact_{}_{}.csv", contact.name, m.physics.name));
            contact.write(has_shear(spec), &path)?;
        }
        if to.pictures { self.draw(m, to) } else { Ok(()) }
    }

    /// Draws the pressure along all contacts of a plane body, and that of each surface on a solid.
    fn draw(&self, m: &Moment<'m, D>, to: &Outputs) -> Result<(), Error> {
        let Some(spec) = self.0.contact.as_ref().filter(|_| self.0.output.contact) else { return Ok(()) };
        let contacts = PressedSurface::all(self.0, m.tractions());
        if contacts.is_empty() {
            return Ok(());
        }
        if D == 2 {
            return draw_curves(m, &contacts, has_shear(spec), to.folder);
        }
        // parts that touch hide their contact
        contacts.iter().filter(|own| !own.mutual).try_for_each(|own| draw_solid(m, own, to.folder))
    }
}

/// Returns means of a value over the touching faces above each particle, weighted by area; 0 without any.
fn means<'a, const D: usize, const N: usize>(
    m: &Moment<D>,
    tractions: impl Iterator<Item = &'a SurfaceTraction<D>>,
    value: impl Fn(&SurfaceTraction<D>) -> [f64; N],
) -> Vec<[f64; N]> {
    let particles = m.bonds.particles();
    let (mut sums, mut areas) = (vec![[0.0; N]; particles.len()], vec![0.0; particles.len()]);
    for one in tractions {
        let value = value(one);
        for site in &one.sites {
            let particle = particles.partition_point(|other| other < site);
            areas[particle] += one.area;
            sums[particle].iter_mut().zip(value).for_each(|(sum, value)| *sum += one.area * value);
        }
    }
    let mean = |(sum, area): (&[f64; N], &f64)| if *area > 0.0 { sum.map(|sum| sum / area) } else { *sum };
    sums.iter().zip(&areas).map(mean).collect()
}

/// Draws pressure and shear along the contacts of a plane body.
fn draw_curves<const D: usize>(
    m: &Moment<D>,
    contacts: &[PressedSurface<D>],
    shear: bool,
    output: &Path,
) -> Result<(), Error> {
    let all = contacts.iter().flat_map(|contact| &contact.each);
    let (scale, unit) = stress_unit(all.map(|one| one.pressure.abs()).fold(0.0, f64::max));
    let mut plot =
        LinePlot::new(&m.titled(if m.scene.title.is_empty() { "Contact" } else { &m.scene.title }))
            .size(900.0, 560.0)
            .axes("distance from the centre of pressure (mm)", &format!("pressure ({unit})"))
            .legend(LegendPlace::Outside);
    for contact in contacts {
        let shown = |one: &SurfaceTraction<D>| !contact.mutual || dot(&one.normal, &contact.normal) > 0.0;
        let each = contact.each.iter().zip(&contact.along).filter(|(one, _)| shown(one));
        let along: Vec<f64> = each.clone().map(|(_, x)| x * 1e3).collect();
        let pressures: Vec<f64> = each.clone().map(|(one, _)| one.pressure * scale).collect();
        plot = plot.series(Series::marked_line(&contact.name, &along, &pressures));
        if shear {
            let tangent = tangent(&contact.normal);
            let shears: Vec<f64> = each.map(|(one, _)| dot(&one.shear, &tangent) * scale).collect();
            plot = plot.series(Series::line(&format!("{}, shear", contact.name), &along, &shears));
        }
    }
    Ok(plot.write(output.join(format!("contact_{}.png", m.file_name())))?)
}

/// Draws the pressure of a surface on a solid, seen from its side.
fn draw_solid<const D: usize>(
    m: &Moment<D>,
    contact: &PressedSurface<D>,
    output: &Path,
) -> Result<(), Error> {
    let values = means(m, contact.each.iter().copied(), |one| [one.pressure]).into_flattened();
    let [low, high] = [f64::min, f64::max].map(|pick| values.iter().copied().fold(0.0, pick));
    let (scale, unit) = stress_unit(high.max(-low));
    let rest: Vec<[f64; 3]> = m.sites().map(|site| super::in_space(m.bonds.position(site))).collect();
    let moved = m.sites().map(|site| super::in_space(m.state.displacement.get(site)));
    let places: Vec<[f64; 3]> = rest.iter().zip(moved).map(|(x, u)| [0, 1, 2].map(|d| x[d] + u[d])).collect();
    let (mut bounds, spacing) = (EMPTY_BOX, m.bonds.spacing());
    extend_box(&mut bounds, &places);
    for d in 0..3 {
        bounds[0][d] -= 0.5 * spacing;
        bounds[1][d] += 0.5 * spacing;
    }
    let label = format!("pressure of `{}` ({unit})", contact.name);
    let strip = Strip { label, range: (low * scale, high * scale), colors: ColorMap::Viridis };
    let solids = Solids {
        title: m.titled(&m.scene.title),
        bounds,
        unit: ("mm".into(), 1e-3),
        view: contact.view(),
        fields: vec![strip],
    };
    let bridge = bridge_length(m);
    let drawn = Particles { reference: &rest, positions: &places, spacing, bridge };
    let skin = drawn.skin(None, |k| [values[k] * scale, f64::NAN]);
    let title = moment_title(&m.state.history, m.state.history.len() as f64);
    let path = output.join(format!("contact_{}_{}.png", contact.name, m.file_name()));
    Ok(solids.write(path, 1, |_| Ok((title.clone(), skin.clone())))?)
}

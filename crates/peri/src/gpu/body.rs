//! A lattice on a device: its buffers, and what is computed on them.

use super::kernels::{Form, HEAD, leap, pull};
use super::{Device, Precision};
use crate::bonds::{BodyGeometry, BondDamage, LatticeBonds, StencilBond, not_finite, scaled_laws};
use crate::error::Error;
use crate::field::Field;
use crate::potential::KernelFit;
use cubecl::client::Client;
use cubecl::prelude::*;
use cubecl::server::{Handle, ServerError};

/// Threads that start together.
const CUBE: u32 = 128;
/// Launches between two waits for the device, so that its queue stays short.
const QUEUE: u64 = 256;

/// Displacement, velocity and force density of all sites.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion<const D: usize> {
    /// u, m.
    pub displacement: Field<D>,
    /// v, m/s.
    pub velocity: Field<D>,
    /// Force density of the intact bonds, N/m³.
    pub force: Field<D>,
}

/// Where and how motion begins.
#[derive(Clone, Debug)]
pub struct Start<const D: usize> {
    /// u, m.
    pub displacement: Field<D>,
    /// v, m/s.
    pub velocity: Field<D>,
    /// Bit d: component d of a site keeps the velocity that it has; empty where all are free.
    pub held: Vec<u8>,
    /// ρ, kg/m³.
    pub density: f64,
    /// Δt, s. Not compared with the critical one.
    pub time_step: f64,
}

/// A lattice with its law on a device. It begins at rest, undeformed.
pub struct DeviceBody<'a, const D: usize> {
    bonds: &'a LatticeBonds<D>,
    client: Client,
    precision: Precision,
    form: Form,
    spacing: f64,
    /// Force density of a unit force on the device, N/m³.
    unit: f64,
    time_step: f64,
    /// ½Δt²·`unit`/(ρ·spacing): the half kick, in spacings a step.
    push: f64,
    steps: u64,
    particles: Handle,
    shifts: Handle,
    rows: Handle,
    intact: Handle,
    held: Handle,
    displacement: Handle,
    velocity: Handle,
    force: Handle,
}

impl<'a, const D: usize> DeviceBody<'a, D> {
    /// Puts particles, intact bonds and a law q(e) with its modulus kθ, N/m⁶, on a device. Bonds beyond the stretch `critical`
    /// break; law and stretches are those of [`crate::bonds::BondForces::set_law`] and [`crate::bonds::overstretched`].
    ///
    /// # Errors
    /// [`Error::Device`] for what the kernels do not know, and for a body that the device's memory does not hold;
    /// [`Error::Parameter`] for a critical stretch that is not above 0.
    pub fn new(
        device: &Device,
        bonds: &'a LatticeBonds<D>,
        law: &KernelFit,
        modulus: f64,
        critical: Option<f64>,
    ) -> Result<Self, Error> {
        if let Some(found) = critical.filter(|stretch| !(*stretch > 0.0 && stretch.is_finite())) {
            let allowed = "above 0, finite".to_owned();
            return Err(Error::Parameter { name: "critical stretch", found, allowed });
        }
        if !bonds.is_uniform() {
            let what = "bonds with surface factors or softened bonds; allowed: the stencil's own weights";
            return Err(Error::Device(format!("kernels of lattices: found {what}")));
        }
        let precision = device.precision;
        let (form, rows, unit) = stencil(bonds, law, modulus, critical)?;
        let sites = bonds.sites();
        let field = (D * sites) as u64 * precision.bytes();
        let words = 4 * (sites * form.bonds.div_ceil(32)) as u64;
        let fields = [("displacement", field), ("velocity", field), ("force", field)];
        hold(device, &[&fields[..], &[("intact bonds", words)]].concat())?;
        let client = device.client.clone();
        let whole = |list: &[u32]| client.create_from_slice(u32::as_bytes(list));
        let shifts: Vec<i32> = bonds.stencil_bonds(modulus).iter().map(|bond| bond.shift as i32).collect();
        let zeros = Field::<D>::zeros(sites);
        Ok(Self {
            precision,
            form,
            spacing: bonds.spacing(),
            unit,
            time_step: 0.0,
            push: 0.0,
            steps: 0,
            particles: whole(bonds.particles()),
            shifts: client.create_from_slice(i32::as_bytes(&shifts)),
            rows: numbers(&client, precision, rows.into_iter()),
            intact: whole(&halves(&bonds.intact(), sites, form.bonds)),
            held: whole(&vec![0; sites]),
            displacement: upload(&client, precision, &zeros, 1.0),
            velocity: upload(&client, precision, &zeros, 1.0),
            force: upload(&client, precision, &zeros, 1.0),
            bonds,
            client,
        })
    }

    /// Force densities, N/m³, in a displacement, m, without a step. No bond breaks.
    ///
    /// # Errors
    /// [`Error::NotFinite`] for forces that are not finite; [`Error::Geometry`] for the field of another body;
    /// [`Error::Device`] where the device fails.
    pub fn force(&self, displacement: &Field<D>) -> Result<Field<D>, Error> {
        self.fits(&[displacement.sites()])?;
        let there = upload(&self.client, self.precision, displacement, 1.0 / self.spacing);
        let found = upload(&self.client, self.precision, &Field::<D>::zeros(self.bonds.sites()), 1.0);
        self.pull(&there, &found, Form { breaks: false, kicks: false, ..self.form });
        let force = self.download(&found, self.unit)?;
        self.finite("force", &force)?;
        Ok(force)
    }

    /// Takes a state, at which bonds break, as the beginning of motion.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a density or time step that is not positive; [`Error::Geometry`] for fields of another body.
    pub fn start(&mut self, start: &Start<D>) -> Result<(), Error> {
        for (name, found) in [("density", start.density), ("time step", start.time_step)] {
            if !(found > 0.0 && found.is_finite()) {
                return Err(Error::Parameter { name, found, allowed: "above 0, finite".to_owned() });
            }
        }
        let sites = self.bonds.sites();
        let held = if start.held.is_empty() { sites } else { start.held.len() };
        self.fits(&[start.displacement.sites(), start.velocity.sites(), held])?;
        let held: Vec<u32> =
            (0..sites).map(|site| start.held.get(site).map_or(0, |&bits| bits.into())).collect();
        self.time_step = start.time_step;
        self.push = 0.5 * start.time_step.powi(2) * self.unit / (start.density * self.spacing);
        self.steps = 0;
        self.held = self.client.create_from_slice(u32::as_bytes(&held));
        self.displacement = upload(&self.client, self.precision, &start.displacement, 1.0 / self.spacing);
        self.velocity = upload(&self.client, self.precision, &start.velocity, self.time_step / self.spacing);
        self.pull(&self.displacement, &self.force, Form { kicks: false, ..self.form });
        Ok(())
    }

    /// Steps of velocity Verlet: v ← v + ½Δt f/ρ, u ← u + Δt v, new f, v ← v + ½Δt f/ρ, then bonds break.
    ///
    /// # Errors
    /// [`Error::Parameter`] without a [`Self::start`]; [`Error::Device`] where the device fails.
    pub fn advance(&mut self, steps: u64) -> Result<(), Error> {
        if self.time_step == 0.0 {
            let allowed = "above 0: `start` sets it".to_owned();
            return Err(Error::Parameter { name: "time step", found: 0.0, allowed });
        }
        for step in 1..=steps {
            self.leap();
            self.pull(&self.displacement, &self.force, self.form);
            if step.is_multiple_of(QUEUE) || step == steps {
                cubecl::future::block_on(self.client.sync()).map_err(|error| failed(&error))?;
            }
        }
        self.steps += steps;
        Ok(())
    }

    /// Displacement, velocity and force density.
    ///
    /// # Errors
    /// [`Error::NotFinite`] for a state that is not finite; [`Error::Device`] where the device fails.
    pub fn state(&self) -> Result<Motion<D>, Error> {
        let speed = if self.time_step > 0.0 { self.spacing / self.time_step } else { 0.0 };
        let motion = Motion {
            displacement: self.download(&self.displacement, self.spacing)?,
            velocity: self.download(&self.velocity, speed)?,
            force: self.download(&self.force, self.unit)?,
        };
        self.finite("force", &motion.force)?;
        self.finite("velocity", &motion.velocity)?;
        self.finite("displacement", &motion.displacement)?;
        Ok(motion)
    }

    /// Which bonds are intact, as [`crate::bonds::BondDamage::restore`] takes it.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn intact(&self) -> Result<Vec<u64>, Error> {
        let bytes = self.client.read_one(self.intact.clone()).map_err(|error| failed(&error))?;
        let sites = self.bonds.sites();
        let mut words = vec![0; sites * self.form.bonds.div_ceil(64)];
        for (index, half) in u32::from_bytes(&bytes).iter().enumerate() {
            let (word, site) = (index / sites, index % sites);
            words[word / 2 * sites + site] |= u64::from(*half) << (32 * (word % 2));
        }
        Ok(words)
    }

    fn fits(&self, lengths: &[usize]) -> Result<(), Error> {
        let sites = self.bonds.sites();
        if lengths.iter().all(|&length| length == sites) {
            return Ok(());
        }
        Err(Error::geometry(format!("fields over {lengths:?} sites for a body of {sites}")))
    }

    fn finite(&self, quantity: &'static str, field: &Field<D>) -> Result<(), Error> {
        let wrong = field.non_finite().map(|(site, _)| site);
        wrong.map_or(Ok(()), |site| Err(not_finite(self.bonds, quantity, site, 0, self.steps)))
    }

    fn download(&self, from: &Handle, scale: f64) -> Result<Field<D>, Error> {
        let bytes = self.client.read_one(from.clone()).map_err(|error| failed(&error))?;
        let values: Vec<f64> = match self.precision {
            Precision::Single => f32::from_bytes(&bytes).iter().map(|&x| f64::from(x) * scale).collect(),
            Precision::Double => f64::from_bytes(&bytes).iter().map(|x| x * scale).collect(),
        };
        let mut field = Field::zeros(self.bonds.sites());
        for (to, from) in field.components_mut().into_iter().zip(values.chunks(self.bonds.sites())) {
            to.copy_from_slice(from);
        }
        Ok(field)
    }

    fn cubes(&self) -> CubeCount {
        cubecl::calculate_cube_count_elemwise(
            &self.client,
            self.bonds.particles().len(),
            CubeDim::new_1d(CUBE),
        )
    }

    fn pull(&self, displacement: &Handle, force: &Handle, form: Form) {
        let (sites, element) = (self.bonds.sites(), self.precision.element());
        let words = form.bonds.div_ceil(32);
        pull::launch(
            &self.client,
            self.cubes(),
            CubeDim::new_1d(CUBE),
            buffer(displacement, D * sites),
            buffer(&self.particles, self.bonds.particles().len()),
            buffer(&self.held, sites),
            buffer(&self.shifts, form.bonds),
            buffer(&self.rows, form.bonds * form.width()),
            buffer(&self.intact, words * sites),
            buffer(force, D * sites),
            buffer(&self.velocity, D * sites),
            InputScalar::new(self.push, element),
            form,
            element,
        );
    }

    fn leap(&self) {
        let (sites, element) = (self.bonds.sites(), self.precision.element());
        leap::launch(
            &self.client,
            self.cubes(),
            CubeDim::new_1d(CUBE),
            buffer(&self.force, D * sites),
            buffer(&self.particles, self.bonds.particles().len()),
            buffer(&self.held, sites),
            buffer(&self.velocity, D * sites),
            buffer(&self.displacement, D * sites),
            InputScalar::new(self.push, element),
            D,
            element,
        );
    }
}

/// A buffer as a kernel takes it.
fn buffer(handle: &Handle, length: usize) -> BufferArg {
    // SAFETY: every buffer is made from a list of `length` numbers of the kernel's type, here and in `upload`.
    unsafe { BufferArg::from_raw_parts(handle.clone(), length) }
}

/// The rows of a stencil in spacings, what they are compiled for, and the force density, N/m³, that is 1 in them: the greatest
/// stiffness times the spacing.
fn stencil<const D: usize>(
    bonds: &LatticeBonds<D>,
    law: &KernelFit,
    modulus: f64,
    critical: Option<f64>,
) -> Result<(Form, Vec<f64>, f64), Error> {
    let (spacing, physical) = (bonds.spacing(), bonds.stencil_bonds(modulus));
    let unit = spacing * physical.iter().map(|bond| bond.stiffness.abs()).fold(0.0, f64::max);
    let offsets = physical.iter().zip(&bonds.stencil().offsets);
    let scaled: Vec<StencilBond<D>> = offsets
        .map(|(bond, offset)| StencilBond {
            bond: offset.map(f64::from),
            stiffness: bond.stiffness * spacing / unit,
            ..*bond
        })
        .collect();
    let Some(laws) = scaled_laws(law, &scaled).filter(|_| unit > 0.0 && unit.is_finite()) else {
        let what = format!("{} of modulus {modulus} N/m⁶", law.kind());
        return Err(Error::Device(format!(
            "law of the bonds: found a {what}; allowed: a polynomial or rational, above 0"
        )));
    };
    let form = Form {
        dimension: D,
        bonds: scaled.len(),
        numerator: laws[0].numerator.len(),
        denominator: laws[0].denominator.len(),
        breaks: critical.is_some(),
        kicks: true,
    };
    let mut rows = Vec::with_capacity(form.bonds * form.width());
    for (bond, law) in scaled.iter().zip(&laws) {
        let breaks = critical.map_or(f64::INFINITY, |stretch| (stretch * stretch - 1.0) / law.inverse_square);
        let head: [f64; HEAD] = [law.clamp[0], law.clamp[1], law.constant, breaks];
        rows.extend(bond.bond.iter().chain(&head).chain(&law.numerator).chain(&law.denominator));
    }
    Ok((form, rows, unit))
}

/// Words of 64 bonds, each over all sites, as words of 32.
fn halves(words: &[u64], sites: usize, bonds: usize) -> Vec<u32> {
    let half = |word: usize| {
        words[word / 2 * sites..][..sites].iter().map(move |bits| (bits >> (32 * (word % 2))) as u32)
    };
    (0..bonds.div_ceil(32)).flat_map(half).collect()
}

fn upload<const D: usize>(client: &Client, precision: Precision, field: &Field<D>, scale: f64) -> Handle {
    numbers(client, precision, field.components().into_iter().flatten().map(|x| x * scale))
}

fn numbers(client: &Client, precision: Precision, values: impl Iterator<Item = f64>) -> Handle {
    match precision {
        // not beyond what single precision holds: ends of a law may be infinite, and no kernel has to know that
        Precision::Single => {
            let single = |x: f64| if x.is_infinite() { f32::MAX.copysign(x as f32) } else { x as f32 };
            client.create_from_slice(f32::as_bytes(&values.map(single).collect::<Vec<_>>()))
        }
        Precision::Double => client.create_from_slice(f64::as_bytes(&values.collect::<Vec<_>>())),
    }
}

fn failed(error: &ServerError) -> Error {
    let text = error.to_string();
    Error::Device(text.split("\nBacktrace").next().unwrap_or_default().to_owned())
}

/// Whether a device holds these buffers, bytes each by name.
fn hold(device: &Device, buffers: &[(&str, u64)]) -> Result<(), Error> {
    let (name, one) = (device.name(), device.largest_buffer());
    if let Some((what, bytes)) = buffers.iter().find(|(_, bytes)| *bytes > one) {
        let found = format!("{what}: found {bytes} bytes; allowed: {one} in a buffer of {name}");
        return Err(Error::Device(found));
    }
    let total = buffers.iter().map(|(_, bytes)| bytes).sum::<u64>();
    match device.client.properties().memory.max_memory().filter(|all| total > *all) {
        Some(all) => Err(Error::Device(format!("memory: found {total} bytes; allowed: {all} on {name}"))),
        None => Ok(()),
    }
}
